"""An episode in numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Generic

import gymnasium as gym
from gymnasium.utils import RecordConstructorArgs

from socialnav_env.metrics import METRICS
from socialnav_env.wrappers.types import Action, Observation, Step


class EpisodeMetrics(
    gym.Wrapper[Observation, Action, Observation, Action],
    RecordConstructorArgs,
    Generic[Observation, Action],
):
    """At an episode's end `info["episode_metrics"]` sums it up; belongs outside the time limit.

    It holds the social metrics of `socialnav_env.metrics.METRICS` where the env has them, and

    - `collided`: 1 when there was a collision, else 0, where collisions are counted,
    - `timeout`: 1 when the time ran out before the goal was reached (TO), else 0,
    - `return`: the sum of the rewards, undiscounted,
    - `length`: the number of steps.

    Example:
        >>> import gymnasium as gym
        >>> import socialnav_env
        >>> from socialnav_env.wrappers import EpisodeMetrics
        >>> env = EpisodeMetrics(gym.make("SocialCorridor-v0", max_episode_steps=5))
        >>> _ = env.reset(seed=0)
        >>> for _ in range(5):
        ...     info = env.step([-1.0, 0.0])[4]  # stands still
        >>> metrics = info["episode_metrics"]
        >>> metrics["timeout"], metrics["length"], metrics["path_length"]
        (1.0, 5, 0.0)
    """

    def __init__(self, env: gym.Env[Observation, Action]) -> None:
        """Wrap an env."""
        RecordConstructorArgs.__init__(self)
        super().__init__(env)
        self._return = 0.0
        self._length = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode."""
        self._return, self._length = 0.0, 0
        return self.env.reset(seed=seed, options=options)

    def step(self, action: Action) -> Step[Observation]:
        """Step the env; add the metrics when the episode ends."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        self._return += float(reward)
        self._length += 1
        if terminated or truncated:
            summary = episode_summary(info, terminated, self._return, self._length)
            info = {**info, "episode_metrics": summary}
        return observation, reward, terminated, truncated, info


def episode_summary(
    info: Mapping[str, Any], terminated: bool, total: float, length: int
) -> dict[str, Any]:
    """A finished episode in numbers.

    Args:
        info: Of its last step.
        terminated: Whether the env ended it.
        total: Sum of the rewards.
        length: Number of steps.
    """
    over_before = terminated or bool(info.get("ended", False)) or bool(info.get("success", False))
    metrics = {name: info[name] for name in METRICS if name in info}
    if "collisions" in metrics:
        metrics["collided"] = 1.0 if metrics["collisions"] > 0 else 0.0
    return {
        **metrics,
        "timeout": 0.0 if over_before else 1.0,
        "return": total,
        "length": length,
    }
