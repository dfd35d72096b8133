"""A linear layer that takes the fastest matrix product at hand.

On an x86 processor PyTorch multiplies float32 matrices with MKL, which on AMD's reaches less than
half of what oneDNN does. PyTorch carries oneDNN too; its own compiler calls it as is done here.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn

FEWEST_PRODUCTS = 2**21
"""With fewer multiplications a call of oneDNN costs more than it saves."""
FEWEST_UNITS = 64
"""With fewer units it does so for the weights' gradient."""


class Linear(nn.Linear):
    """W x + b for each row x, (R, n) -> (R, u).

    Transforms of `torch.func` need `torch.backends.mkldnn.enabled` to be False.
    """

    def forward(self, inputs: Tensor) -> Tensor:  # noqa: D102
        if _suits_onednn(inputs, self.weight) and has_onednn():
            return _OneDnn.apply(inputs, self.weight, self.bias)  # type: ignore[no-any-return, no-untyped-call]
        return super().forward(inputs)


def has_onednn() -> bool:
    """Whether PyTorch has oneDNN's matrix product, and may use it."""
    built = torch.backends.mkldnn.is_available()  # type: ignore[no-untyped-call]
    allowed = bool(torch.backends.mkldnn.enabled)
    return built and allowed and hasattr(torch.ops.mkldnn, "_linear_pointwise")


def _suits_onednn(rows: Tensor, weight: Tensor) -> bool:
    """Whether this product is worth a call. PyTorch is left to refuse what cannot be multiplied."""
    return (
        rows.ndim == 2
        and rows.shape[1] == weight.shape[1]
        and rows.numel() * len(weight) >= FEWEST_PRODUCTS
        and rows.dtype == weight.dtype == torch.float32
        and rows.device.type == weight.device.type == "cpu"
    )


class _OneDnn(torch.autograd.Function):
    """`torch.nn.functional.linear` of a matrix and its gradients, of any order, by oneDNN."""

    @staticmethod
    def forward(ctx: Any, rows: Tensor, weight: Tensor, bias: Tensor | None) -> Tensor:
        ctx.save_for_backward(rows, weight)
        return torch.ops.mkldnn._linear_pointwise(rows, weight, bias, "none", [], "")  # type: ignore[no-any-return]

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor | None, ...]:
        rows, weight = ctx.saved_tensors
        to_rows, to_weight, to_bias = ctx.needs_input_grad
        return (
            _OneDnn.apply(gradient, weight.T, None) if to_rows else None,  # type: ignore[no-untyped-call]
            _towards_weight(rows, gradient) if to_weight else None,
            gradient.sum(dim=0) if to_bias else None,
        )


def _towards_weight(rows: Tensor, gradient: Tensor) -> Tensor:
    """Gradient of W, (R, n), (R, u) -> (u, n)."""
    if gradient.shape[1] >= FEWEST_UNITS:
        return _OneDnn.apply(rows.T, gradient.T, None).T  # type: ignore[no-any-return, no-untyped-call]
    # oneDNN would copy both to transpose them, which takes longer than it saves.
    return (rows.T @ gradient).T
