"""The two clips of the example query, read back from their files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageSequence

from polite.files import one_line
from polite.types import PoliteError


def read_clip(path: Path, fps: float) -> npt.NDArray[np.uint8]:
    """Frames (T, height, width, 3), one a step of 1/fps seconds.

    A GIF writer merges equal neighbouring frames into one that lasts longer; they are repeated
    here, so that frame t is the world at step t.

    Raises:
        PoliteError: Naming the file, when it is damaged or no moving picture.
    """
    try:
        with Image.open(path) as clip:
            shown = [
                (np.asarray(frame.convert("RGB")), float(frame.info["duration"]))
                for frame in ImageSequence.Iterator(clip)
            ]
    except Exception as error:  # a damaged picture fails in a dozen ways inside its reader
        reason = one_line(error)
        raise PoliteError(
            f"{path}: not a readable clip ({reason}); delete it to do without"
        ) from error
    repeats = [max(1, round(fps * milliseconds / 1000)) for _, milliseconds in shown]
    return np.repeat(np.stack([frame for frame, _ in shown]), repeats, axis=0)


def clip_paths(example: Mapping[str, Any], folder: Path) -> list[Path]:
    """The clips' files, or an empty list when the run has none or they are gone."""
    paths = [folder / name for name in example["files"]]
    return paths if all(path.is_file() for path in paths) else []
