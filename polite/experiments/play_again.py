"""An episode played once more, to be drawn: for envs that cannot go back to a recorded state."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from polite.files import one_line
from polite.types import PoliteError, Trajectory


def play_again(
    env: gym.Env[Any, Any], seed: int, episode: Trajectory, steps: Sequence[int]
) -> Iterator[NDArray[np.uint8]]:
    """Take the same actions from the same reset, and draw some of the moments.

    Args:
        env: with `render_mode="rgb_array"`, made as the one that the episode is from.
        seed: of the reset that it began with.
        episode: what happened.
        steps: which moments, at least one, in order; 0 is the reset.

    Yields:
        (h, w, 3), a picture for each of them.

    Raises:
        PoliteError: if something else happens than did, or the env gives no picture.
    """
    wanted, last = set(steps), steps[-1]
    observation, _ = env.reset(seed=seed)
    for step, action in enumerate(episode.actions):
        if not np.array_equal(np.float32(observation), episode.observations[step]):
            raise PoliteError(
                f"{_name(env)}: expected that the same seed and actions lead to the same episode, "
                f"got another at step {step}; it cannot be drawn"
            )
        if step in wanted:
            yield _picture(env)
        if step == last:
            return
        observation, *_ = env.step(action)


def _picture(env: gym.Env[Any, Any]) -> NDArray[np.uint8]:
    try:
        picture: Any = env.render()
    except Exception as error:  # a library that is missing, a method that is not there, a display
        raise PoliteError(
            f"{_name(env)}: cannot be drawn here ({type(error).__name__}: {one_line(error)})"
        ) from error
    shape, kind = np.shape(picture), getattr(picture, "dtype", type(picture).__name__)
    if len(shape) != 3 or shape[2] != 3 or kind != np.uint8:
        raise PoliteError(
            f"{_name(env)}: expected that render() gives a picture (h, w, 3) of uint8 under "
            f'render_mode="rgb_array", got {kind} {shape}'
        )
    return np.asarray(picture)


def _name(env: gym.Env[Any, Any]) -> str:
    return env.spec.id if env.spec else str(env)
