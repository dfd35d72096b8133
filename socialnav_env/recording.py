"""A driven episode on disk: numbers that replay it exactly, and its video."""

from __future__ import annotations

import json
import os
import uuid
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import imageio.v2 as imageio
import numpy as np
from numpy.typing import NDArray

from socialnav_env.kernels import FloatArray

VIDEO_FORMATS = ("gif", "mp4")
"""Endings of a video's file; mp4 needs `imageio-ffmpeg`."""
Render = Callable[[FloatArray, FloatArray], NDArray[np.uint8]]
"""A row of `state_row` (k,) and the way so far (K, 2) -> (h, w, 3), as `render_state`."""


@dataclass(frozen=True, eq=False)
class Recording:
    """One episode; with equal keywords and seed, the same actions give it again.

    Raises:
        ValueError: The arrays are not of one episode.
    """

    keywords: Mapping[str, Any]
    """Those of `gym.make("SocialCorridor-v0", ...)`."""
    seed: int
    """That of the reset."""
    observations: FloatArray
    """(T + 1, n) the reset's first."""
    actions: NDArray[np.float32]
    """(T, A)."""
    rewards: FloatArray
    """(T,)."""
    states: FloatArray
    """(T + 1, k) rows of `state_row`, from which pictures are drawn."""
    terminated: bool
    """The env ended the episode."""
    truncated: bool
    """The time ran out; an episode that was broken off is neither."""

    def __post_init__(self) -> None:
        """Check that the arrays fit together."""
        steps = len(self.actions)
        for name, count, dimensions in (
            ("observations", steps + 1, 2),
            ("actions", steps, 2),
            ("rewards", steps, 1),
            ("states", steps + 1, 2),
        ):
            shape = np.shape(getattr(self, name))
            if len(shape) != dimensions or shape[0] != count:
                raise ValueError(
                    f"{name}: expected {count} rows in {dimensions} dimensions, got shape {shape}"
                )


def save_recording(path: Path, recording: Recording) -> None:
    """Write an episode to one .npz file, whole or not at all."""
    content = {
        "keywords": np.array(json.dumps(dict(recording.keywords))),
        **{name: value for name, value in vars(recording).items() if name != "keywords"},
    }
    _write_whole(path, lambda temporary: np.savez_compressed(temporary, **content))


def load_recording(path: Path) -> Recording:
    """Read an episode that `save_recording` wrote. Nothing in the file can run code.

    Raises:
        FileNotFoundError: There is no such file.
        ValueError: It is damaged or holds something else.
    """
    try:
        with np.load(path, allow_pickle=False) as stored:
            return Recording(
                keywords=json.loads(str(stored["keywords"])),
                seed=int(stored["seed"]),
                observations=stored["observations"],
                actions=stored["actions"],
                rewards=stored["rewards"],
                states=stored["states"],
                terminated=bool(stored["terminated"]),
                truncated=bool(stored["truncated"]),
            )
    except FileNotFoundError:
        raise
    except Exception as error:  # a damaged archive fails in a dozen ways
        raise ValueError(f"{path}: expected a recording of the corridor ({error})") from None


def write_video(path: Path, recording: Recording, render: Render, fps: float) -> None:
    """Draw an episode, a frame for each state; written whole or not at all.

    Args:
        path: Its ending says in which of VIDEO_FORMATS.
        recording: The episode.
        render: As `render_state` of the env.
        fps: Frames per second.

    Raises:
        ValueError: Another ending.
    """
    if path.suffix not in (f".{name}" for name in VIDEO_FORMATS):
        raise ValueError(f"{path.name}: expected a name that ends in one of {VIDEO_FORMATS}")
    gif = path.suffix == ".gif"
    timing: dict[str, Any] = {"duration": 1000.0 / fps, "loop": 0} if gif else {"fps": fps}

    def write(temporary: Path) -> None:
        writer: Any = imageio.get_writer(temporary, **timing)
        with writer as video:
            for t, row in enumerate(recording.states):
                video.append_data(render(row, recording.states[: t + 1, :2]))

    _write_whole(path, write)


def _write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Let `write` fill a temporary file of the same kind, then move it into place."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.stem}-{uuid.uuid4().hex}{path.suffix}")
    try:
        write(temporary)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
