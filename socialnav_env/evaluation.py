"""How well a policy does in the corridor."""

from __future__ import annotations

from typing import Any, Protocol

import gymnasium as gym
import numpy as np

from socialnav_env.wrappers import MetricsTable, VectorSocialMetrics


class Policy(Protocol):
    """Whatever has stable-baselines3's `predict`: its models, and our controllers."""

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, *, deterministic: bool
    ) -> tuple[Any, Any]:
        """(N, n) observations, the last call's state, (N,) episode begins -> actions, state."""


def evaluate(
    policy: Policy, *, episodes: int = 200, num_envs: int = 50, seed: int = 0, **keywords: Any
) -> MetricsTable:
    """Let a policy drive and sum up its episodes' social metrics.

    Every corridor runs the same number of episodes; equal seeds give every policy the same ones.

    Args:
        policy: What drives.
        episodes: How many; rounded up to a multiple of `num_envs`.
        num_envs: Corridors that run at once.
        seed: Corridor n's first episode has seed + n.
        **keywords: Of `gym.make_vec("SocialCorridor-v0", ...)`.

    Raises:
        ValueError: `episodes` or `num_envs` is no whole number of at least 1.

    Example:
        >>> from socialnav_env import CorridorConfig
        >>> from socialnav_env.controllers import StraightToGoal
        >>> from socialnav_env.evaluation import evaluate
        >>> robot = StraightToGoal(CorridorConfig.from_keywords(scenario="empty"))
        >>> evaluate(robot, episodes=4, num_envs=4, scenario="empty")["success"].mean
        1.0
    """
    for name, value in (("episodes", episodes), ("num_envs", num_envs)):
        if isinstance(value, bool) or not isinstance(value, int) or value < 1:
            raise ValueError(f"{name}={value!r}: expected a whole number of at least 1")
    each = -(-episodes // num_envs)
    env = VectorSocialMetrics(gym.make_vec("SocialCorridor-v0", num_envs=num_envs, **keywords))
    observations, _ = env.reset(seed=seed)
    state, begins = None, np.ones(num_envs, dtype=np.bool_)
    while min(map(len, env.episodes)) < each:
        actions, state = policy.predict(observations, state, begins, deterministic=True)
        observations, _, terminated, truncated, _ = env.step(actions)
        begins = terminated | truncated
    env.close()
    return env.table(each)
