"""The hidden layer gives what PyTorch's own operations give, and so does its gradient."""

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch.nn.functional import leaky_relu, linear

from polite.rewards import hidden_layer
from polite.rewards.hidden_layer import FEWEST_ROWS, FEWEST_UNITS, SLOPE, HiddenLayer, has_onednn

sizes = st.integers(1, 70)


def both_ways(rows, inputs, units, seed, dtype=torch.float32):
    """Outputs and gradients, of the layer and of PyTorch's own operations."""
    generator = torch.Generator().manual_seed(seed)
    layer = HiddenLayer(inputs, units).to(dtype)
    x = torch.randn(rows, inputs, generator=generator, dtype=dtype, requires_grad=True)
    towards = torch.randn(rows, units, generator=generator, dtype=dtype)
    found = []
    for apply in (layer, lambda x: leaky_relu(linear(x, layer.weight, layer.bias), SLOPE)):
        outputs = apply(x)
        gradients = torch.autograd.grad(outputs, (x, layer.weight, layer.bias), towards)
        found.append((outputs.detach(), *gradients))
    return found


@given(rows=st.integers(1, 3 * FEWEST_ROWS), inputs=sizes, units=sizes, seed=st.integers(0, 99))
def test_outputs_and_gradients_are_those_of_pytorch(rows, inputs, units, seed):
    ours, theirs = both_ways(rows, inputs, units, seed)
    for mine, its in zip(ours, theirs, strict=True):
        torch.testing.assert_close(mine, its, rtol=1e-4, atol=1e-4)


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
    product = hidden_layer._product
    monkeypatch.setattr(
        hidden_layer, "_product", lambda *args: called.append(args) or product(*args)
    )
    both_ways(rows, 5, units, seed=0)
    assert len(called) == products


def test_without_onednn_pytorch_multiplies(monkeypatch):
    monkeypatch.setattr(hidden_layer, "has_onednn", lambda: False)
    ours, theirs = both_ways(2 * FEWEST_ROWS, 5, 7, seed=0)
    for mine, its in zip(ours, theirs, strict=True):
        assert torch.equal(mine, its)


def test_other_precisions_are_left_to_pytorch():
    ours, theirs = both_ways(2 * FEWEST_ROWS, 5, 7, seed=0, dtype=torch.float64)
    for mine, its in zip(ours, theirs, strict=True):
        assert torch.equal(mine, its)


def test_the_gradient_is_that_of_finite_differences():
    # In float32, so with wide steps and where no entry is near the kink of the ReLU.
    layer = HiddenLayer(3, 4)
    x = torch.randn(FEWEST_ROWS, 3, generator=torch.Generator().manual_seed(0))
    with torch.no_grad():
        layer.bias.copy_(torch.tensor([9.0, -9.0, 9.0, -9.0]))
    layer(x).sum().backward()
    step = 0.01
    for index in [(0, 0), (1, 2), (3, 1)]:
        found = []
        for sign in (+1, -1):
            with torch.no_grad():
                layer.weight[index] += sign * step
                found.append(layer(x).double().sum().item())
                layer.weight[index] -= sign * step
        difference = (found[0] - found[1]) / (2 * step)
        assert layer.weight.grad[index].item() == pytest.approx(difference, rel=1e-2, abs=1e-2)


def test_a_row_of_nan_stays_alone():
    layer = HiddenLayer(3, 4)
    x = torch.zeros(2 * FEWEST_ROWS, 3)
    x[5] = torch.nan
    broken = layer(x).isnan().any(dim=1)
    assert broken.nonzero().flatten().tolist() == [5]
