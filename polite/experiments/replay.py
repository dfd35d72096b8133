"""An episode played once more, to be drawn: for envs that cannot go back to a recorded state."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from polite.types import PoliteError, Trajectory


def replay(
    env: gym.Env[Any, Any], seed: int, episode: Trajectory, steps: Sequence[int]
) -> Iterator[NDArray[np.uint8]]:
    """Take the same actions from the same reset, and draw some of the moments.

    Args:
        env: with `render_mode="rgb_array"`, made as the one that the episode is from.
        seed: of the reset that it began with.
        episode: what happened.
        steps: which moments, in order; 0 is the reset.

    Yields:
        (h, w, 3), a picture for each of them.

    Raises:
        PoliteError: if something else happens than did, or the env gives no picture.
    """
    observation, _ = env.reset(seed=seed)
    for step, action in enumerate(episode.actions[: steps[-1] + 1]):
        if not np.array_equal(np.float32(observation), episode.observations[step]):
            raise PoliteError(
                f"{_name(env)}: expected that the same seed and actions lead to the same episode, "
                f"got another at step {step}; it cannot be drawn"
            )
        if step in steps:
            yield _picture(env)
        observation, *_ = env.step(action)


def _picture(env: gym.Env[Any, Any]) -> NDArray[np.uint8]:
    picture: Any = env.render()
    if np.ndim(picture) != 3 or np.shape(picture)[2] != 3:
        raise PoliteError(
            f"{_name(env)}: expected that render() gives a picture (h, w, 3) under "
            f'render_mode="rgb_array", got {type(picture).__name__}'
        )
    return np.asarray(picture, dtype=np.uint8)


def _name(env: gym.Env[Any, Any]) -> str:
    return env.spec.id if env.spec else str(env)
