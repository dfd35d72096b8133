"""Many corridors in one process, as a Gymnasium vector env."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from socialnav_env.config import ConfigError, CorridorConfig
from socialnav_env.kernels import BoolArray, FloatArray, IntArray
from socialnav_env.metrics import METRICS
from socialnav_env.reward import TERMS
from socialnav_env.world import World


class SocialCorridorVectorEnv(VectorEnv[FloatArray, FloatArray, Any]):
    """A world of N corridors that step together.

    A corridor whose episode ends begins the next one in the same step (`AutoresetMode.SAME_STEP`):
    `info["final_obs"]` and `info["final_info"]` then hold the last observations and values of the
    finished episodes. `info` has the single env's keys, each an (N,) array.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 (Gymnasium declares it an instance's)
        "render_modes": [],
        "autoreset_mode": AutoresetMode.SAME_STEP,
    }

    def __init__(self, num_envs: int, *, max_episode_steps: int = 600, **settings: Any) -> None:
        """Build the corridors.

        Args:
            num_envs: N.
            max_episode_steps: An episode is truncated after this many steps.
            **settings: Fields of CorridorConfig.

        Raises:
            ConfigError: An unknown or impossible keyword.
        """
        for name, value in (("num_envs", num_envs), ("max_episode_steps", max_episode_steps)):
            if not isinstance(value, int) or value < 1:
                raise ConfigError(f"{name}={value!r}: expected a whole number of at least 1")
        self.config = CorridorConfig.from_keywords(**settings)
        self.num_envs = num_envs
        self.render_mode = None
        self.max_episode_steps = max_episode_steps
        self.world = World(self.config, num_envs)
        self.single_observation_space = gym.spaces.Box(
            self.world.low, self.world.high, dtype=np.float64
        )
        self.single_action_space = gym.spaces.Box(-1.0, 1.0, (2,), dtype=np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._generators: list[np.random.Generator] = []
        self._elapsed: IntArray = np.zeros(num_envs, dtype=np.int64)

    def reset(
        self, *, seed: int | list[int] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Begin an episode in every corridor.

        Args:
            seed: Corridor n gets seed + n, or the n-th of a list.
            options: None are known.

        Raises:
            ConfigError: An unknown option, or a list of another length than N.
        """
        if options:
            raise ConfigError(f"unknown reset option {', '.join(sorted(options))}; none are known")
        if seed is not None or not self._generators:
            self._generators = [np.random.default_rng(s) for s in self._seeds(seed)]
        for n, generator in enumerate(self._generators):
            self.world.begin(n, generator)
        self._elapsed[:] = 0
        return self.world.observe(), self._info()

    def step(
        self, actions: FloatArray
    ) -> tuple[FloatArray, FloatArray, BoolArray, BoolArray, dict[str, Any]]:
        """Advance every corridor by `dt`.

        Args:
            actions: (N, 2) forward and turn in [-1, 1].

        Raises:
            ValueError: The actions have another shape or are not finite.
            gymnasium.error.ResetNeeded: No episode has begun.
        """
        if not self._generators:
            raise gym.error.ResetNeeded("call reset() before step()")
        actions = np.asarray(actions, dtype=np.float64)
        if actions.shape != (self.num_envs, 2) or not np.isfinite(actions).all():
            raise ValueError(
                f"actions: expected finite numbers of shape ({self.num_envs}, 2), "
                f"got shape {actions.shape}"
            )
        observations = self.world.step(actions)
        self._elapsed += 1
        info = self._info()
        rewards: FloatArray = self.world.terms.sum(axis=1)
        terminated = self.world.ended.copy()
        truncated = (self._elapsed >= self.max_episode_steps) & ~terminated
        ended = terminated | truncated
        if ended.any():
            final = {name: values.copy() for name, values in info.items()}
            info["final_obs"], info["_final_obs"] = observations.copy(), ended
            info["final_info"] = final
            info["_final_info"] = ended
            for n in np.flatnonzero(ended):
                self.world.begin(int(n), self._generators[n])
            self._elapsed[ended] = 0
            observations = self.world.observe()
        return observations, rewards, terminated, truncated, info

    def state_rows(self) -> FloatArray:
        """(N, 9 + 4 H) what pictures of the present moment need (`State.scene_rows`)."""
        return self.world.state.scene_rows()

    def _seeds(self, seed: int | list[int] | None) -> list[int | None]:
        """One seed a corridor."""
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, int | np.integer):
            return [int(seed) + n for n in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise ConfigError(f"seed: expected {self.num_envs} seeds, got {len(seed)}")
        return list(seed)

    def _info(self) -> dict[str, Any]:
        """The single env's keys, each an (N,) array."""
        world = self.world
        z, x, _, vz, vx, _ = world.state.bodies[:, 0].T.copy()
        return {
            **dict(zip(TERMS, world.terms.T.copy(), strict=True)),
            "x_position": x,
            "z_position": z,
            "x_velocity": vx,
            "z_velocity": vz,
            "collision": world.collided.copy(),
            **dict(zip(METRICS, world.metrics.T.copy(), strict=True)),
        }
