"""Scoring many rows in blocks that fit the processor's cache.

A minibatch of segments is thousands of rows. Layer by layer over all of them, every intermediate
result goes to main memory and back, in fresh pages each time; block by block it does not.
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil

import torch
from torch import Tensor

FLOATS_AT_ONCE = 2**18
"""Entries of the widest intermediate result of a block: 1 MiB, a common second-level cache."""


def in_blocks(score: Callable[[Tensor], Tensor], rows: Tensor, width: int) -> Tensor:
    """Score rows block by block, each of them alone.

    Args:
        score: takes (…, R, n) to (…, R), each row by itself.
        rows: (…, N, n).
        width: entries for each row of the widest intermediate result of `score`.

    Returns:
        The scores, (…, N).
    """
    most = max(1, FLOATS_AT_ONCE // width)
    count = max(1, ceil(rows.shape[-2] / most))
    return torch.cat([score(block) for block in rows.tensor_split(count, dim=-2)], dim=-1)
