"""Small envs that can be computed by hand, for tests of policies, rollouts and methods."""

from __future__ import annotations

from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from polite.policies.vec_env import GymnasiumVecEnv


class CountingEnv(gym.Env):
    """Observes (step, episode); pays step + action[0] / 100; ends when `lengths` says so.

    Episode k terminates after lengths[k % len(lengths)] steps; the time limit truncates.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": []}
    observation_space = gym.spaces.Box(-1e6, 1e6, (2,), np.float64)
    action_space = gym.spaces.Box(-1.0, 1.0, (2,), np.float32)

    def __init__(
        self, lengths: tuple[int, ...] = (5,), spoiled_at: int = -1, blind_at: int = -1
    ) -> None:
        self.lengths, self.spoiled_at, self.blind_at = lengths, spoiled_at, blind_at
        self.episode, self.steps = -1, 0

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.episode, self.steps = self.episode + 1, 0
        return self._observe(), {}

    def step(self, action):
        reward = self.steps + float(action[0]) / 100
        self.steps += 1
        if self.steps == self.spoiled_at:
            reward = np.nan
        ended = self.steps == self.lengths[self.episode % len(self.lengths)]
        return self._observe(), reward, ended, False, {"success": float(ended)}

    def _observe(self):
        seen = np.nan if self.steps == self.blind_at else self.steps
        return np.array([seen, self.episode], dtype=np.float64)


class TalkativeEnv(CountingEnv):
    """Tells an array, a word, NumPy's own truth, and a value only in its second episodes."""

    def step(self, action):
        *step, _ = super().step(action)
        told = {"tendons": np.zeros(3), "gait": "trot", "success": np.bool_(self.steps > 2)}
        return *step, told | ({"seldom": 1.0} if self.episode % 2 else {})


class PointEnv(gym.Env):
    """A point on a line: observes its place, moves by the action, pays for being near 1."""

    metadata: ClassVar[dict[str, Any]] = {"render_modes": []}
    observation_space = gym.spaces.Box(-10.0, 10.0, (1,), np.float64)
    action_space = gym.spaces.Box(-1.0, 1.0, (1,), np.float32)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.place = self.np_random.uniform(-1.0, 1.0)
        return np.array([self.place]), {}

    def step(self, action):
        self.place = float(np.clip(self.place + 0.2 * float(action[0]), -2.0, 2.0))
        return np.array([self.place]), 1.0 - abs(self.place - 1.0), False, False, {}


class BoundlessPointEnv(PointEnv):
    """The same, with actions of any size."""

    action_space = gym.spaces.Box(-np.inf, np.inf, (1,), np.float32)


class DescribedPointEnv(PointEnv):
    """The same, with a dict for an observation."""

    observation_space = gym.spaces.Dict({"place": PointEnv.observation_space})

    def reset(self, *, seed=None, options=None):
        observation, info = super().reset(seed=seed)
        return {"place": observation}, info


class StepwisePointEnv(PointEnv):
    """The same, with whole numbers for actions."""

    action_space = gym.spaces.Box(0, 20, (1,), np.int64)


class CodedPointEnv(PointEnv):
    """The same, which observes signs as a vector of bits."""

    observation_space = gym.spaces.MultiBinary(1)

    def _signs(self):
        return np.array([self.place > 0], np.int8)

    def reset(self, *, seed=None, options=None):
        return super().reset(seed=seed) and (self._signs(), {})

    def step(self, action):
        return self._signs(), *super().step(action)[1:]


class WidePointEnv(PointEnv):
    """The same, with actions between -3 and 5."""

    action_space = gym.spaces.Box(-3.0, 5.0, (1,), np.float32)


def register() -> None:
    """Make the envs known to Gymnasium."""
    if "Point-v0" not in gym.registry:
        gym.register("BoundlessPoint-v0", entry_point=BoundlessPointEnv, max_episode_steps=20)
        gym.register("DescribedPoint-v0", entry_point=DescribedPointEnv, max_episode_steps=20)
        gym.register("StepwisePoint-v0", entry_point=StepwisePointEnv, max_episode_steps=20)
        gym.register("CodedPoint-v0", entry_point=CodedPointEnv, max_episode_steps=20)
        gym.register("WidePoint-v0", entry_point=WidePointEnv, max_episode_steps=20)
        gym.register(
            "Short-v0", entry_point=CountingEnv, max_episode_steps=8, kwargs={"lengths": (1, 2, 7)}
        )
        gym.register("Talkative-v0", entry_point=TalkativeEnv, max_episode_steps=8)
        gym.register("Point-v0", entry_point=PointEnv, max_episode_steps=20)
        gym.register("Counting-v0", entry_point=CountingEnv, max_episode_steps=8)
        gym.register("Endless-v0", entry_point=PointEnv)


def vec_env(count: int = 1, limit: int | None = None, **settings: Any) -> GymnasiumVecEnv:
    """CountingEnvs side by side, as stable-baselines3 wants them."""

    def make():
        env = CountingEnv(**settings)
        return env if limit is None else gym.wrappers.TimeLimit(env, limit)

    return GymnasiumVecEnv(
        SyncVectorEnv([make] * count, autoreset_mode=AutoresetMode.SAME_STEP), seed=0
    )
