"""Recorded states become frames, and frames a clip; clips are never stored as frames."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import gymnasium as gym
import imageio.v3 as iio
import numpy as np
from numpy.typing import NDArray

from polite.env_ids import making
from polite.files import one_line, write_atomically
from polite.types import PoliteError, ShapeError

Frames = NDArray[np.uint8]
"""(T, h, w, 3) pictures."""
Render = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.uint8]]
"""A state's row (k,) and the way so far (K, 2) -> (h, w, 3)."""

FASTEST = 50.0
"""Frames per second that players of GIFs still show; they play shorter pauses as long ones."""


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


@contextmanager
def picture_env(env_id: str, /, **settings: Any) -> Iterator[gym.Env[Any, Any]]:
    """Open an env for pictures only; nothing that is running anywhere is touched.

    Args:
        env_id: Its id.
        **settings: Its keywords, the size of the pictures among them.

    Raises:
        PoliteError: It is unknown, or cannot be made to give pictures.
    """
    with making(env_id, " to draw") as name:
        env = gym.make(name, render_mode="rgb_array", **settings)
    with closing(env):
        yield env


def state_render(env: gym.Env[Any, Any]) -> tuple[Render, float] | None:
    """How recorded states of this env are drawn, and its steps per second.

    The rows are those of `polite.rollouts.state_rows`. A MuJoCo env is seen by the camera that
    follows the robot, where its model has one.

    Returns:
        None where the env cannot go back to a state.

    Raises:
        PoliteError: This machine cannot draw it.
    """
    world: Any = env.unwrapped
    if hasattr(world, "render_state") and hasattr(world, "dt"):
        return world.render_state, 1.0 / world.dt
    if hasattr(world, "mujoco_renderer"):
        return _mujoco_render(world), 1.0 / world.dt
    return None


@contextmanager
def renderer(env_id: str, /, **settings: Any) -> Iterator[tuple[Render, float]]:
    """Open an env to draw recorded states (see `picture_env` and `state_render`).

    Yields:
        The function that draws, and the env's steps per second.

    Raises:
        PoliteError: The env is unknown, cannot restore a state, or this machine cannot draw it.
    """
    with picture_env(env_id, **settings) as env:
        drawing = state_render(env)
        if drawing is None:
            raise PoliteError(
                f"{env_id}: expected an env with render_state(row, trail) and dt, or a MuJoCo env; "
                "its recorded states cannot be drawn. A study of such an env takes clips that you "
                "recorded (polite study new --pool FOLDER --recorded FOLDER)"
            )
        yield drawing


def _mujoco_render(world: Any) -> Render:
    """Draws rows of qpos and qvel side by side by setting the env's state."""
    model, pictures = world.model, world.mujoco_renderer
    if "track" in {model.camera(index).name for index in range(model.ncam)}:
        pictures.camera_id = model.camera("track").id

    def draw(row: NDArray[np.float64]) -> NDArray[np.uint8]:
        world.set_state(row[: model.nq], row[model.nq :])
        return np.asarray(world.render(), dtype=np.uint8)

    def render(row: NDArray[np.float64], trail: NDArray[np.float64]) -> NDArray[np.uint8]:
        if np.shape(row) != (model.nq + model.nv,):
            raise ShapeError(f"row: expected ({model.nq + model.nv},), got {np.shape(row)}")
        return draw(row)

    with _offscreen():
        # A camera that does not follow looks at what is there when it first looks: the same always.
        draw(np.concatenate([world.init_qpos, world.init_qvel]))
    return render


@contextmanager
def _offscreen() -> Iterator[None]:
    """Let MuJoCo draw without a display, unless there is one or MUJOCO_GL says how.

    Raises:
        PoliteError: It cannot.
    """
    choose = sys.platform == "linux" and not {"MUJOCO_GL", "DISPLAY"} & os.environ.keys()
    if choose:
        os.environ["MUJOCO_GL"] = "egl"
    try:
        yield
    except Exception as error:  # what is missing shows as anything from ImportError to FatalError
        raise PoliteError(
            f"MuJoCo cannot draw here ({one_line(error)}); install EGL (Debian: libegl1, "
            "libopengl0, libgl1-mesa-dri), or set MUJOCO_GL to egl, osmesa or glfw"
        ) from error
    finally:
        if choose:
            del os.environ["MUJOCO_GL"]
