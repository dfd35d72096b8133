"""The linear layer gives what PyTorch's own operations give, and so do its gradients."""

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch.nn.functional import linear

from polite.rewards import linear as module
from polite.rewards.linear import FEWEST_PRODUCTS, FEWEST_UNITS, Linear, has_onednn

sizes = st.integers(1, 70)
MANY = FEWEST_PRODUCTS // (5 * 7) + 1  # rows of 5 numbers that 7 units are enough for


def both_ways(rows, inputs, units, seed=0, dtype=torch.float32, turned=False, loss_of=torch.sum):
    """Outputs, gradients and a gradient of gradients, of the layer and of PyTorch's operations."""
    generator = torch.Generator().manual_seed(seed)
    layer = Linear(inputs, units).to(dtype)
    x = torch.randn(inputs, rows, generator=generator, dtype=dtype).T
    x = (x if turned else x.contiguous()).requires_grad_()
    found = []
    for apply in (layer, lambda x: linear(x, layer.weight, layer.bias)):
        outputs = apply(x)
        loss = loss_of(outputs)
        parameters = (x, layer.weight, layer.bias)
        first = torch.autograd.grad(loss, parameters, create_graph=True)
        second = torch.autograd.grad(sum(g.square().sum() for g in first), parameters[:2])
        found.append([tensor.detach() for tensor in (outputs, *first, *second)])
    return found


@given(
    rows=st.integers(1, 200),
    inputs=sizes,
    units=sizes,
    seed=st.integers(0, 99),
    turned=st.booleans(),
    loss_of=st.sampled_from([torch.sum, lambda outputs: outputs.tanh().mean()]),
)
def test_outputs_and_gradients_are_those_of_pytorch(rows, inputs, units, seed, turned, loss_of):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "FEWEST_PRODUCTS", 0)
        ours, theirs = both_ways(rows, inputs, units, seed, turned=turned, loss_of=loss_of)
    for mine, its in zip(ours, theirs, strict=True):
        torch.testing.assert_close(mine, its, rtol=1e-4, atol=1e-5 * its.abs().max().item())


@pytest.fixture
def products(monkeypatch):
    """The products that oneDNN makes."""
    if not has_onednn():
        pytest.skip("this PyTorch was built without oneDNN")
    made = []
    forward = module._OneDnn.forward
    noted = staticmethod(lambda *args: made.append(args) or forward(*args))
    monkeypatch.setattr(module._OneDnn, "forward", noted)
    return made


@pytest.mark.parametrize(
    ("rows", "units", "count"),
    [
        (FEWEST_PRODUCTS // (4 * FEWEST_UNITS) - 1, FEWEST_UNITS, 0),
        (FEWEST_PRODUCTS // (4 * FEWEST_UNITS), FEWEST_UNITS, 3),
        (FEWEST_PRODUCTS // 4, FEWEST_UNITS - 1, 2),  # all but the weights' gradient
    ],
)
def test_onednn_multiplies_where_it_is_faster(products, rows, units, count):
    Linear(4, units)(torch.zeros(rows, 4, requires_grad=True)).sum().backward()
    assert len(products) == count


def test_what_onednn_does_not_suit_is_left_to_pytorch(products):
    layer = Linear(5, 7)
    assert layer(torch.zeros(2, MANY, 5)).shape == (2, MANY, 7)
    assert layer.to("meta")(torch.zeros(MANY, 5, device="meta")).shape == (MANY, 7)
    assert not products


def test_pytorch_multiplies_where_it_must_not_use_onednn(products, monkeypatch):
    monkeypatch.setattr(torch.backends.mkldnn, "enabled", False)
    net = Linear(5, 7)
    net(torch.zeros(MANY, 5))
    assert torch.func.vmap(net)(torch.zeros(2, MANY, 5)).shape == (2, MANY, 7)
    assert not products


def test_other_numbers_of_inputs_are_pytorch_s_error():
    with pytest.raises(RuntimeError, match="shapes cannot be multiplied"):
        Linear(5, 7)(torch.zeros(2 * MANY, 4))


def test_without_onednn_pytorch_multiplies(monkeypatch):
    monkeypatch.setattr(module, "has_onednn", lambda: False)
    ours, theirs = both_ways(MANY, 5, 7)
    for mine, its in zip(ours, theirs, strict=True):
        assert torch.equal(mine, its)


def test_other_precisions_are_left_to_pytorch():
    ours, theirs = both_ways(MANY, 5, 7, dtype=torch.float64)
    for mine, its in zip(ours, theirs, strict=True):
        assert torch.equal(mine, its)


def test_the_gradient_is_that_of_finite_differences(monkeypatch):
    monkeypatch.setattr(module, "FEWEST_PRODUCTS", 0)
    layer = Linear(3, FEWEST_UNITS)
    x = torch.randn(20, 3, generator=torch.Generator().manual_seed(0), requires_grad=True)
    layer(x).sum().backward()
    step = 0.25  # exact but for rounding, since the layer is linear in each
    for numbers in (layer.weight, layer.bias, x):
        for index in range(0, numbers.numel(), 7):
            found = []
            for sign in (+1, -1):
                with torch.no_grad():
                    numbers.view(-1)[index] += sign * step
                    found.append(layer(x).double().sum().item())
                    numbers.view(-1)[index] -= sign * step
            difference = (found[0] - found[1]) / (2 * step)
            assert numbers.grad.reshape(-1)[index].item() == pytest.approx(difference, abs=1e-3)


def test_a_row_of_nan_stays_alone():
    layer = Linear(3, 4)
    x = torch.zeros(FEWEST_PRODUCTS // (3 * 4) + 1, 3)
    x[5] = torch.nan
    broken = layer(x).isnan().any(dim=1)
    assert broken.nonzero().flatten().tolist() == [5]
