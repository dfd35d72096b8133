"""Frames become a video that every browser plays and steps through, and a film strip."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Final

import imageio.v3 as iio
import numpy as np
from PIL import Image

from polite.clips import FASTEST, Frames
from polite.files import one_line, write_atomically
from polite.types import PoliteError, ShapeError

STRIP_FRAMES: Final = 10
"""Frames of a film strip."""
STRIP_WIDTH: Final = 96
"""Largest width of each of them [px]."""
ENDINGS: Final = (".mp4", ".webm", ".gif")
"""Of the videos that `read_video` reads."""
ENCODING: Final = (
    *("-preset", "veryfast"),
    *("-crf", "26"),
    *("-g", "10"),
    *("-bf", "0"),
    *("-movflags", "+faststart"),
    *("-threads", "1"),
)
"""ffmpeg's options. Every tenth frame stands alone, and none needs a later one, so that a browser
is fast to go to any; faststart lets it play before everything has come."""


def check_ffmpeg() -> None:
    """Check that videos can be written.

    Raises:
        PoliteError: The package for it, or the program, is missing.
    """
    try:
        import imageio_ffmpeg
    except ImportError as error:
        raise PoliteError(
            "videos need imageio-ffmpeg; install it with: pip install 'socialnav-polite[web]' "
            "for studies, 'socialnav-polite[video]' for clips alone"
        ) from error
    try:
        imageio_ffmpeg.get_ffmpeg_exe()
    except RuntimeError as error:
        raise PoliteError(
            f"videos need the program ffmpeg ({one_line(error)}); install it, or set "
            "IMAGEIO_FFMPEG_EXE to where it is"
        ) from error


def pad_to_even(frames: Frames) -> Frames:
    """Repeat the last row and column where their number is odd, as H.264 wants it.

    Args:
        frames: (T, h, w, 3).

    Raises:
        ShapeError: The frames have another shape.
    """
    if frames.ndim != 4 or frames.shape[-1] != 3 or 0 in frames.shape:
        raise ShapeError(f"frames: expected (T, h, w, 3) with T >= 1, got {frames.shape}")
    odd = [(0, size % 2) for size in frames.shape[1:3]]
    return np.pad(frames, [(0, 0), *odd, (0, 0)], mode="edge")


def write_video(path: Path, frames: Frames, fps: float) -> None:
    """Write H.264 in an mp4.

    Args:
        path: The file, written whole or not at all.
        frames: (T, h, w, 3), h and w even.
        fps: Frames per second.

    Raises:
        PoliteError: ffmpeg cannot do it.
    """

    def write(temporary: Path) -> None:
        iio.imwrite(
            temporary,
            frames,
            plugin="FFMPEG",
            fps=fps,
            codec="libx264",
            pixelformat="yuv420p",
            macro_block_size=2,
            quality=None,
            output_params=list(ENCODING),
            ffmpeg_log_level="error",
        )

    write_atomically(path, write)


def write_strip(path: Path, frames: Frames) -> None:
    """Write `STRIP_FRAMES` frames side by side, equally spaced, the first and the last among them.

    Args:
        path: The picture, written whole or not at all.
        frames: (T, h, w, 3).
    """
    height, width = frames.shape[1:3]
    share = min(1.0, STRIP_WIDTH / width)
    size = (max(1, round(width * share)), max(1, round(height * share)))
    places = np.linspace(0, len(frames) - 1, STRIP_FRAMES).round().astype(int)
    small = [Image.fromarray(frames[place]).resize(size, Image.Resampling.BOX) for place in places]
    strip = np.concatenate([np.asarray(picture) for picture in small], axis=1)
    write_atomically(path, lambda temporary: iio.imwrite(temporary, strip))


def read_video(path: Path) -> tuple[Frames, float]:
    """Read a video, every frame.

    Args:
        path: A file with one of the `ENDINGS`.

    Returns:
        (T, h, w, 3), and frames per second, at most `FASTEST`.

    Raises:
        PoliteError: It cannot be read, or does not say how fast it plays.
    """
    try:
        with warnings.catch_warnings():
            # imageio-ffmpeg leaves ffmpeg's pipes to the garbage collector.
            warnings.simplefilter("ignore", ResourceWarning)
            frames, fps = _read_gif(path) if path.suffix == ".gif" else _read_film(path)
    except (OSError, ValueError, KeyError, ZeroDivisionError, IndexError, RuntimeError) as error:
        raise PoliteError(
            f"{path}: expected a video or an animated GIF ({_last_line(error)}); record it again"
        ) from error
    return frames, min(FASTEST, fps)


def _read_gif(path: Path) -> tuple[Frames, float]:
    frames = np.asarray(iio.imread(path, plugin="pillow", index=None, mode="RGB"))
    fps = 1000.0 / iio.immeta(path, plugin="pillow")["duration"]
    return frames[None] if frames.ndim == 3 else frames, fps


def _read_film(path: Path) -> tuple[Frames, float]:
    # Otherwise ffmpeg would repeat and drop frames of a video with an uneven pace.
    every = ["-fps_mode", "passthrough"]
    frames = np.asarray(iio.imread(path, plugin="FFMPEG", index=None, output_params=every))
    return frames, float(iio.immeta(path, plugin="FFMPEG")["fps"])


def _last_line(error: Exception) -> str:
    """What went wrong, without ffmpeg's long list of itself before it."""
    lines = [line for line in str(error).splitlines() if line.strip()]
    return one_line(RuntimeError(lines[-1])) if lines else one_line(error)
