"""One hidden layer: a leaky ReLU of an affine map, by the fastest matrix product at hand.

On an x86 processor PyTorch multiplies float32 matrices with MKL, which on AMD's reaches less than
half of what oneDNN does. PyTorch carries oneDNN too; its own compiler calls it as is done here.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn
from torch.autograd.function import once_differentiable
from torch.nn.functional import leaky_relu

SLOPE = 0.01
"""Of the leaky ReLU below 0."""
FEWEST_ROWS = 64
"""With fewer rows a call of oneDNN costs more than it saves."""
FEWEST_UNITS = 64
"""With fewer units it does so for the weights' gradient."""


class HiddenLayer(nn.Linear):
    """Leaky ReLU of W x + b for each row x, (R, n) -> (R, u).

    What it returns must stay as it is until the gradient is taken.
    """

    def forward(self, inputs: Tensor) -> Tensor:  # noqa: D102
        if inputs.dtype == torch.float32 and len(inputs) >= FEWEST_ROWS and has_onednn():
            return _OneDnnLayer.apply(inputs, self.weight, self.bias)  # type: ignore[no-any-return, no-untyped-call]
        return leaky_relu(super().forward(inputs), SLOPE, inplace=True)


def has_onednn() -> bool:
    """Whether this build of PyTorch has oneDNN's matrix product."""
    built = torch.backends.mkldnn.is_available()  # type: ignore[no-untyped-call]
    return built and hasattr(torch.ops.mkldnn, "_linear_pointwise")


class _OneDnnLayer(torch.autograd.Function):
    """The layer and its gradient, with every product by oneDNN."""

    @staticmethod
    def forward(ctx: Any, inputs: Tensor, weight: Tensor, bias: Tensor) -> Tensor:
        outputs = _product(inputs, weight, bias, "leaky_relu", SLOPE)
        ctx.save_for_backward(inputs, weight, outputs)
        return outputs

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor | None, Tensor, Tensor]:
        inputs, weight, outputs = ctx.saved_tensors
        # A leaky ReLU keeps the sign, so its output tells on which side of 0 its input was.
        gradient = torch.ops.aten.leaky_relu_backward(gradient, outputs, SLOPE, True)
        to_inputs = _product(gradient, weight.T) if ctx.needs_input_grad[0] else None
        # Both are copied to be transposed, which takes narrow layers longer than it saves.
        wide = len(weight) >= FEWEST_UNITS
        to_weight = _product(inputs.T, gradient.T) if wide else inputs.T @ gradient
        return to_inputs, to_weight.T, gradient.sum(dim=0)


def _product(
    rows: Tensor, weight: Tensor, bias: Tensor | None = None, then: str = "none", *slope: float
) -> Tensor:
    """W x + b for each row x and then an activation, (R, n), (u, n), (u,) -> (R, u)."""
    return torch.ops.mkldnn._linear_pointwise(rows, weight, bias, then, slope, "")  # type: ignore[no-any-return]
