"""Everything that happens in envs while a policy trains, as trajectories."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from polite.policies.vec_env import GymnasiumVecEnv
from polite.rollouts import cut_episodes, state_rows
from polite.types import Trajectory


class TrajectoryRecorder(VecEnvWrapper):
    """Notes each step, with the true reward and what a picture of the moment needs.

    To be put where rewards and observations are still the env's own.
    """

    def __init__(self, venv: VecEnv, env: GymnasiumVecEnv) -> None:
        """Wrap a vec env.

        Args:
            venv: The one to wrap.
            env: The envs at its bottom, which are asked for their states.
        """
        super().__init__(venv)
        self._env = env.vector_env
        self._observations: NDArray[Any] = np.zeros(0)
        self._rows: list[dict[str, NDArray[Any]]] = []

    def reset(self) -> NDArray[Any]:
        """Begin."""
        self._observations = np.asarray(self.venv.reset())
        return self._observations

    def step_async(self, actions: NDArray[Any]) -> None:
        """Note where the envs are and what they are told."""
        states = state_rows(self._env)
        self._rows.append(
            {
                "observations": np.array(self._observations, dtype=np.float32),
                "actions": np.array(actions, dtype=np.float32),
                "states": np.array(self._observations if states is None else states),
            }
        )
        self.venv.step_async(actions)

    def step_wait(self) -> VecEnvStepReturn:
        """Step, and note what came of it."""
        observations, rewards, ended, infos = self.venv.step_wait()
        truncated = np.array([info.get("TimeLimit.truncated", False) for info in infos])
        self._rows[-1] |= {
            "rewards": np.array(rewards, dtype=np.float64),
            "truncated": truncated,
            "terminated": ended & ~truncated,
        }
        self._observations = np.asarray(observations)
        return observations, rewards, ended, infos

    def trajectories(self) -> list[Trajectory]:
        """All steps so far, env by env, in the order of time; the last one of each may go on."""
        if not self._rows:
            return []
        arrays = {name: np.stack([row[name] for row in self._rows]) for name in self._rows[0]}
        return [
            trajectory
            for n in range(self.num_envs)
            for trajectory in cut_episodes({name: a[:, n] for name, a in arrays.items()})
        ]
