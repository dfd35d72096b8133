"""Scoring many rows block by block.

A minibatch of segments is thousands of rows. Under wide networks and ensembles an intermediate
result of all of them is larger than the processor's caches, and the next layer reads it back from
main memory; that of a block is still there.
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil

import torch
from torch import Tensor

FLOATS_AT_ONCE = 2**19
"""Entries of the widest intermediate result of a block, 2 MiB. Minibatches of one small network
are one block: 163 pairs of 50 steps at 32 units."""


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
