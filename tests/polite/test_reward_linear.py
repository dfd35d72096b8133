"""The linear layer gives what PyTorch's own operations give, and so do its gradients."""

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch.nn.functional import linear

from polite.rewards import linear as module
from polite.rewards.linear import FEWEST_ROWS, FEWEST_UNITS, Linear, has_onednn

sizes = st.integers(1, 70)


def both_ways(rows, inputs, units, seed=0, dtype=torch.float32, turned=False):
    """Outputs, gradients and a gradient of gradients, of the layer and of PyTorch's operations."""
    generator = torch.Generator().manual_seed(seed)
    layer = Linear(inputs, units).to(dtype)
    x = torch.randn(inputs, rows, generator=generator, dtype=dtype).T
    x = (x if turned else x.contiguous()).requires_grad_()
    found = []
    for apply in (layer, lambda x: linear(x, layer.weight, layer.bias)):
        outputs = apply(x)
        loss = outputs.tanh().mean()
        parameters = (x, layer.weight, layer.bias)
        first = torch.autograd.grad(loss, parameters, create_graph=True)
        second = torch.autograd.grad(first[0].square().sum(), (x, layer.weight))
        found.append([tensor.detach() for tensor in (outputs, *first, *second)])
    return found


@given(
    rows=st.integers(1, 3 * FEWEST_ROWS),
    inputs=sizes,
    units=sizes,
    seed=st.integers(0, 99),
    turned=st.booleans(),
)
def test_outputs_and_gradients_are_those_of_pytorch(rows, inputs, units, seed, turned):
    ours, theirs = both_ways(rows, inputs, units, seed, turned=turned)
    for mine, its in zip(ours, theirs, strict=True):
        torch.testing.assert_close(mine, its, rtol=1e-4, atol=1e-5 * its.abs().max().item())


@pytest.mark.parametrize(
    ("rows", "units", "products"),
    [
        (FEWEST_ROWS - 1, FEWEST_UNITS, 0),
        (FEWEST_ROWS, FEWEST_UNITS - 1, 2),  # all but the weights' gradient
        (FEWEST_ROWS, FEWEST_UNITS, 3),
    ],
)
def test_onednn_multiplies_where_it_is_faster(monkeypatch, rows, units, products):
    if not has_onednn():
        pytest.skip("this PyTorch was built without oneDNN")
    called = []
    forward = module._OneDnn.forward
    monkeypatch.setattr(
        module._OneDnn,
        "forward",
        staticmethod(lambda *args: called.append(args) or forward(*args)),
    )
    layer = Linear(5, units)
    layer(torch.zeros(rows, 5, requires_grad=True)).sum().backward()
    assert len(called) == products


def test_without_onednn_pytorch_multiplies(monkeypatch):
    monkeypatch.setattr(module, "has_onednn", lambda: False)
    ours, theirs = both_ways(2 * FEWEST_ROWS, 5, 7)
    for mine, its in zip(ours, theirs, strict=True):
        assert torch.equal(mine, its)


def test_other_precisions_are_left_to_pytorch():
    ours, theirs = both_ways(2 * FEWEST_ROWS, 5, 7, dtype=torch.float64)
    for mine, its in zip(ours, theirs, strict=True):
        assert torch.equal(mine, its)


def test_the_gradient_is_that_of_finite_differences():
    layer = Linear(3, 4)
    x = torch.randn(FEWEST_ROWS, 3, generator=torch.Generator().manual_seed(0))
    layer(x).sum().backward()
    step = 0.25  # exact but for rounding, since the layer is linear in its weights
    for index in [(0, 0), (1, 2), (3, 1)]:
        found = []
        for sign in (+1, -1):
            with torch.no_grad():
                layer.weight[index] += sign * step
                found.append(layer(x).double().sum().item())
                layer.weight[index] -= sign * step
        difference = (found[0] - found[1]) / (2 * step)
        assert layer.weight.grad[index].item() == pytest.approx(difference, rel=1e-3, abs=1e-3)


def test_a_row_of_nan_stays_alone():
    layer = Linear(3, 4)
    x = torch.zeros(2 * FEWEST_ROWS, 3)
    x[5] = torch.nan
    broken = layer(x).isnan().any(dim=1)
    assert broken.nonzero().flatten().tolist() == [5]
