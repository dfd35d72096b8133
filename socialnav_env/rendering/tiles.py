"""Several pictures as one."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

GAP = 4
"""Pixels between two pictures."""
GAP_COLOUR = 200
"""Grey of the gaps and of places that stay empty."""


def tile(frames: Sequence[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """Lay pictures out in a grid, row by row, that makes the whole as nearly square as can be.

    Args:
        frames: At least one (h, w, 3) picture, all of one shape.

    Returns:
        A fresh (height, width, 3) picture, both sides a multiple of 16 as video encoders like it.

    Raises:
        ValueError: There is no picture, or their shapes differ.
    """
    shapes = {frame.shape for frame in frames}
    if len(shapes) != 1:
        seen = ", ".join(map(str, sorted(shapes))) or "none"
        raise ValueError(f"frames: expected pictures of one shape (h, w, 3), got {seen}")
    ((h, w, _),) = shapes
    columns = min(range(1, len(frames) + 1), key=lambda n: _oblongness(n, len(frames), h, w))
    rows = math.ceil(len(frames) / columns)
    height, width = (
        16 * math.ceil((count * (side + GAP) - GAP) / 16)
        for count, side in ((rows, h), (columns, w))
    )
    whole = np.full((height, width, 3), GAP_COLOUR, dtype=np.uint8)
    for index, frame in enumerate(frames):
        row, column = divmod(index, columns)
        top, left = row * (h + GAP), column * (w + GAP)
        whole[top : top + h, left : left + w] = frame
    return whole


def _oblongness(columns: int, count: int, h: int, w: int) -> float:
    """How far from square a grid with so many columns is: 0 is a square."""
    return abs(math.log(columns * w / (math.ceil(count / columns) * h)))
