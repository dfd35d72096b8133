"""A learned reward in place of an env's own, for whatever trains a policy."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.utils import RecordConstructorArgs

from polite.rewards.ensemble import RewardEnsemble
from polite.rewards.files import check_sizes, load_reward_model
from polite.rewards.network import RewardNet, predict, raise_by
from polite.types import InvalidValueError


class LearnedRewardWrapper(gym.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Pays r̂(s_t, a_t) of a reward model; the env's own reward is `info["true_reward"]`.

    A model is copied: training the original further does not change what is paid. Wrap the env
    before its observations are normalised: r̂ has learned from raw ones.

    Example:
        env = LearnedRewardWrapper(gym.make("Walker2d-v5"), "runs/walker/models/reward.pt")
    """

    def __init__(
        self,
        env: gym.Env[Any, Any],
        reward_model: Path | str | RewardNet | RewardEnsemble,
        reward_offset: float = 0.0,
    ) -> None:
        """Wrap an env.

        Args:
            env: Its observations (n,) and actions (v,) are those that the model was trained on.
            reward_model: The model's file, or the model.
            reward_offset: Added to what it pays for every step: where the env ends episodes early,
                a model below 0 pays for ending them.

        Raises:
            PoliteError: There is no such model.
            ShapeError: The env's observations or actions are of other sizes.
            InvalidValueError: The offset is not finite, or the model is none.
        """
        if isinstance(reward_model, RewardNet | RewardEnsemble):
            self._model = deepcopy(reward_model)
        elif not isinstance(reward_model, str | Path):
            raise InvalidValueError(
                f"reward_model: expected a reward model or its file, got {reward_model!r}"
            )
        else:
            self._model, reward_model = load_reward_model(reward_model), str(reward_model)
        RecordConstructorArgs.__init__(self, reward_model=reward_model, reward_offset=reward_offset)
        super().__init__(env)
        raise_by(self._model, reward_offset)
        check_sizes(self._model, env.observation_space.shape, env.action_space.shape)
        self._observation: Any = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode."""
        self._observation, info = self.env.reset(seed=seed, options=options)
        return self._observation, info

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Step the env, and pay for the step what the model says of it."""
        before = np.array(self._observation)  # some envs write the next one into it
        self._observation, reward, terminated, truncated, info = self.env.step(action)
        paid = float(predict(self._model, before, np.asarray(action)))
        return self._observation, paid, terminated, truncated, info | {"true_reward": reward}
