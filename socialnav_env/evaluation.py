"""How well a policy does in the corridor."""

from __future__ import annotations

from typing import Any, Protocol

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode

from socialnav_env.checks import checked_count
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
        **keywords: Of `gym.make_vec("SocialCorridor-v0", ...)`, all but `autoreset_mode`.

    Raises:
        ValueError: `episodes` or `num_envs` is no whole number of at least 1, or an
            `autoreset_mode` is given.

    Example:
        >>> from socialnav_env import CorridorConfig
        >>> from socialnav_env.controllers import StraightToGoal
        >>> from socialnav_env.evaluation import evaluate
        >>> robot = StraightToGoal(CorridorConfig.from_keywords(scenario="empty"))
        >>> evaluate(robot, episodes=4, num_envs=4, scenario="empty")["success"].mean
        1.0
    """
    episodes, num_envs = checked_count("episodes", episodes), checked_count("num_envs", num_envs)
    if "autoreset_mode" in keywords:
        raise ValueError("autoreset_mode: expected none, since an evaluation begins anew by itself")
    each = -(-episodes // num_envs)
    # In the same step, so that a policy with a memory is told of a start by its own observation.
    keywords["autoreset_mode"] = AutoresetMode.SAME_STEP
    env = VectorSocialMetrics(gym.make_vec("SocialCorridor-v0", num_envs=num_envs, **keywords))
    observations, _ = env.reset(seed=seed)
    state, begins = None, np.ones(num_envs, dtype=np.bool_)
    while min(map(len, env.episodes)) < each:
        actions, state = policy.predict(observations, state, begins, deterministic=True)
        observations, _, terminated, truncated, _ = env.step(actions)
        begins = terminated | truncated
    env.close()
    return env.table(each)
