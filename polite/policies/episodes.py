"""Tallies of finished episodes while a policy trains: true return, success, collisions."""

from __future__ import annotations

from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from polite.policies.vec_env import GymnasiumVecEnv
from polite.rollouts import told_numbers

KEPT = ("success", "collisions", "intermittent")
"""Values of an episode that are kept where the env tells them."""


class EpisodeTally(VecEnvWrapper):
    """Notes the true return of each finished episode, and when it finished.

    To be put directly on the env, where the reward is still the true one.

    Attributes:
        records: For each episode `step`, `return`, `length`, and those of KEPT that the env tells.
    """

    def __init__(self, venv: GymnasiumVecEnv) -> None:
        """Wrap the env."""
        super().__init__(venv)
        self.records: list[dict[str, float]] = []
        self._env = venv
        self._returns = np.zeros(venv.num_envs)
        self._lengths = np.zeros(venv.num_envs, dtype=np.int64)
        self._steps = 0

    def reset(self) -> Any:
        """Begin."""
        self._returns[:] = 0.0
        self._lengths[:] = 0
        return self.venv.reset()

    def step_wait(self) -> VecEnvStepReturn:
        """Step and count."""
        observations, rewards, ended, infos = self.venv.step_wait()
        self._steps += self.num_envs
        self._returns += rewards
        self._lengths += 1
        for n in np.flatnonzero(ended).tolist():
            told = told_numbers(self._env.last_info.get("final_info", {}), n)
            record = {"step": float(self._steps), "return": float(self._returns[n])}
            record["length"] = float(self._lengths[n])
            record.update({key: told[key] for key in KEPT if key in told})
            self.records.append(record)
        self._returns[ended] = 0.0
        self._lengths[ended] = 0
        return observations, rewards, ended, infos
