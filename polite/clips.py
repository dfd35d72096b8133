"""Recorded states become frames, and frames a clip; clips are never stored as frames."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import imageio.v3 as iio
import numpy as np
from numpy.typing import NDArray

from polite.files import write_atomically
from polite.types import ShapeError

Frames = NDArray[np.uint8]
"""(T, h, w, 3) pictures."""
Render = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.uint8]]
"""A state's row (k,) and the way so far (K, 2) -> (h, w, 3)."""


def frames_of(states: NDArray[np.float64], render: Render) -> Frames:
    """Draw recorded states.

    Args:
        states: (T, k) rows that `render` understands; the first two entries are the position whose
            trail is drawn.
        render: Draws one of them.
    """
    return np.stack([render(row, states[: t + 1, :2]) for t, row in enumerate(states)])


def write_clip(path: Path, frames: Frames, fps: float) -> None:
    """Write a looping clip; the ending of the path says in which format (.gif, .webp).

    Args:
        path: The file, written whole or not at all.
        frames: (T, h, w, 3).
        fps: Frames per second.

    Raises:
        ShapeError: The frames have another shape.
    """
    if frames.ndim != 4 or frames.shape[-1] != 3 or len(frames) == 0:
        raise ShapeError(f"frames: expected (T, h, w, 3) with T >= 1, got {frames.shape}")
    milliseconds = round(1000.0 / fps)
    write_atomically(
        path, lambda temporary: iio.imwrite(temporary, frames, duration=milliseconds, loop=0)
    )
