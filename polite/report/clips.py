"""The two clips of the example query, read back from their files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import imageio.v3 as iio
import numpy as np
import numpy.typing as npt


def read_clip(path: Path, fps: float) -> npt.NDArray[np.uint8]:
    """Frames (T, height, width, 3), one a step of 1/fps seconds.

    A GIF writer merges equal neighbouring frames into one that lasts longer; they are repeated
    here, so that frame t is the world at step t.
    """
    frames = np.asarray(iio.imread(path, index=None))[..., :3]
    lasting = [_milliseconds(path, index) for index in range(len(frames))]
    repeats = [max(1, round(fps * milliseconds / 1000)) for milliseconds in lasting]
    return np.asarray(np.repeat(frames, repeats, axis=0), dtype=np.uint8)


def clip_paths(example: Mapping[str, Any], folder: Path) -> list[Path]:
    """The clips' files, or an empty list when the run has none or they are gone."""
    paths = [folder / name for name in example["files"]]
    return paths if all(path.is_file() for path in paths) else []


def _milliseconds(path: Path, index: int) -> float:
    return float(iio.immeta(path, index=index)["duration"])
