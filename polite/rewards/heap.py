"""Keeping the memory that a training frees at every minibatch for the next one."""

from __future__ import annotations

import torch

_LARGEST = 31 * 2**20
"""Bytes; just under the 32 MiB up to which glibc learns."""


def keep_freed_memory() -> None:
    """Let glibc keep the intermediate results that were freed instead of giving them back.

    It gives back whatever is free at the end of the heap beyond twice the largest block that it
    ever took from the system by itself, and the system then hands each page out anew, wiped: a
    quarter or more of the time of a small network's training. So one large block is taken and freed
    here. From then on the process keeps up to 62 MiB that are free. Other C libraries, and glibc
    where `MALLOC_` variables set these limits, are none the worse for it.
    """
    torch.empty(_LARGEST, dtype=torch.uint8, device="cpu")
