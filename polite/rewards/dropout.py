"""Dropout with an explicit generator and masks cut from random bytes.

On a CPU `nn.Dropout` draws one double for each entry, which takes longer than the layer itself.
"""

from __future__ import annotations

import torch
from torch import Tensor


def dropout(inputs: Tensor, probability: float, generator: torch.Generator) -> Tensor:
    """Zero each entry with `probability`, independently, and scale the rest to keep the mean.

    Args:
        inputs: any shape.
        probability: in [0, 1).
        generator: source of the draws, on the CPU.

    Returns:
        The inputs, thinned out, of the same shape.
    """
    if not probability:
        return inputs
    dropped = _bernoulli(inputs.numel(), probability, generator).view(inputs.shape)
    keep = torch.logical_not(dropped).to(inputs)  # as floats: mixed types multiply slowly
    return inputs * keep.mul_(1 / (1 - probability))


def _bernoulli(count: int, probability: float, generator: torch.Generator) -> Tensor:
    """Draw `count` booleans that are True with exactly `probability`, (count,).

    A byte below ⌊256 p⌋ is True; a byte equal to it is decided by a second, finer draw, so that no
    probability is rounded to a multiple of 1/256.
    """
    words = torch.empty((count + 7) // 8, dtype=torch.int64)
    bytes_ = words.random_(-(2**63), None, generator=generator).view(torch.uint8)[:count]
    whole = int(256 * probability)
    drawn = bytes_ < whole
    if remainder := 256 * probability - whole:
        ties = (bytes_ == whole).nonzero().squeeze(1)
        drawn[ties] = torch.rand(len(ties), generator=generator, dtype=torch.float64) < remainder
    return drawn
