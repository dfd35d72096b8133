"""The learned reward in place of the true one, which is only logged."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

RewardFunction = Callable[[NDArray[Any], NDArray[Any]], NDArray[np.float32]]
"""(N, n) observations and (N, v) actions -> (N,) rewards."""


class LearnedReward(VecEnvWrapper):
    """Pays r̂(s_t, a_t) for raw observations and the actions that the env was given.

    To be put beneath VecNormalize. The true reward stays in each `info` as `true_reward`.
    """

    def __init__(self, venv: VecEnv, reward: RewardFunction) -> None:
        """Wrap a vec env.

        Args:
            venv: Gives raw observations and the true reward.
            reward: Scores all envs at once.
        """
        super().__init__(venv)
        self._reward = reward
        self._observations: NDArray[Any] = np.zeros(0)
        self._actions: NDArray[Any] = np.zeros(0)

    def reset(self) -> NDArray[Any]:
        """Begin; returns (N, n) raw observations."""
        self._observations = np.asarray(self.venv.reset())
        return self._observations

    def step_async(self, actions: NDArray[Any]) -> None:
        """Take note of the actions and pass them on."""
        self._actions = actions
        self.venv.step_async(actions)

    def step_wait(self) -> VecEnvStepReturn:
        """Step, and replace the true reward by the learned one."""
        scored = self._reward(self._observations, self._actions)
        observations, true_rewards, ended, infos = self.venv.step_wait()
        for info, true_reward in zip(infos, true_rewards.tolist(), strict=True):
            info["true_reward"] = true_reward
        self._observations = np.asarray(observations)
        return observations, scored, ended, infos
