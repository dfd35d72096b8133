"""What all controllers share: the checks, and one observation or a batch of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from socialnav_env.config import ConfigError, CorridorConfig
from socialnav_env.controllers.sight import Sight, sight_of
from socialnav_env.observation import observation_bounds


class Controller(ABC):
    """A robot that is steered by rules, as a policy without memory."""

    def __init__(self, config: CorridorConfig) -> None:
        """Get to know the corridor: its walls and what the robot can do.

        Args:
            config: As `env.unwrapped.config` has it.

        Raises:
            ConfigError: The people are not observed.
        """
        if config.observation == "rays":
            raise ConfigError(
                f"{type(self).__name__} needs to observe people: expected observation='both' or "
                "'state', got 'rays'"
            )
        self.config = config
        self._size = len(observation_bounds(config)[0])

    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], Any]:
        """Choose actions, with the signature of stable-baselines3's `predict`.

        Args:
            observation: (n,) or (B, n).
            state: Handed back as it came; there is no memory.
            episode_start: Not needed.
            deterministic: Not needed: there is no chance in it.

        Returns:
            Actions in [-1, 1], (A,) or (B, A), and the state.

        Raises:
            ValueError: The observation has another shape, or is not finite.
        """
        observations = np.asarray(observation, dtype=np.float64)
        batch = np.atleast_2d(observations)
        if batch.ndim != 2 or batch.shape[1] != self._size:
            raise ValueError(
                f"observation: expected shape ({self._size},) or (B, {self._size}), got "
                f"{observations.shape}; was the controller made with the env's own config?"
            )
        if not np.isfinite(batch).all():
            raise ValueError("observation: expected finite numbers")
        actions = np.clip(self.act(sight_of(batch, self.config)), -1.0, 1.0).astype(np.float32)
        return actions.reshape(*observations.shape[:-1], -1), state

    @abstractmethod
    def act(self, sight: Sight) -> NDArray[np.float64]:
        """(B, A) actions; what exceeds [-1, 1] is clipped."""
