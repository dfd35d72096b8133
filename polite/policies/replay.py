"""A replay whose rewards can be written anew."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from gymnasium.spaces import Box
from numpy.typing import NDArray
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.type_aliases import ReplayBufferSamples
from torch import Tensor

from polite.policies.learned_reward import RewardFunction

IntrinsicReward = Callable[[Tensor, Tensor], Tensor]
"""(B, n) states that were drawn, and all (N, n) that are stored -> (B,) rewards."""

COLUMNS = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")


class RelabelledReplay(ReplayBuffer):
    """stable-baselines3's replay: a ring of transitions, the oldest overwritten first.

    It stores actions as SAC gives them, in [-1, 1], and rewards are told of the actions that the
    env was given.

    Attributes:
        intrinsic: If set, it pays what is drawn, instead of the reward that is stored.
    """

    intrinsic: IntrinsicReward | None = None

    @property
    def rows(self) -> int:
        """Rows that hold transitions, one of each env: all of them once the ring is full."""
        return self.buffer_size if self.full else self.pos

    def relabel(self, reward: RewardFunction) -> None:
        """Write every stored reward anew, on both sides of the place that is written next."""
        rows = self.rows
        observations = self.observations[:rows].reshape(rows * self.n_envs, -1)
        actions = self._given(self.actions[:rows].reshape(rows * self.n_envs, -1))
        self.rewards[:rows] = reward(observations, actions).reshape(rows, self.n_envs)

    def state(self) -> dict[str, Any]:
        """What is stored, as tensors that share its memory."""
        columns = {name: torch.from_numpy(getattr(self, name)[: self.rows]) for name in COLUMNS}
        return columns | {"position": self.pos, "full": self.full}

    def load_state(self, state: dict[str, Any]) -> None:
        """Store what another replay of this shape held."""
        self.pos, self.full = state["position"], state["full"]
        for name in COLUMNS:
            getattr(self, name)[: self.rows] = state[name].numpy()

    def _get_samples(self, batch_inds: NDArray[Any], env: Any = None) -> ReplayBufferSamples:
        """Draw as usual; pay the intrinsic reward if there is one."""
        drawn = super()._get_samples(batch_inds, env)
        if self.intrinsic is None:
            return drawn
        stored = self.to_torch(self.observations[: self.rows].reshape(-1, *self.obs_shape))
        rewards = self.intrinsic(drawn.observations.float(), stored.float())
        return drawn._replace(rewards=rewards.reshape(-1, 1))

    def _given(self, scaled: NDArray[Any]) -> NDArray[Any]:
        """The actions that the env was given, computed as stable-baselines3 does."""
        space = self.action_space
        assert isinstance(space, Box)  # SAC has no other
        return np.asarray(space.low + 0.5 * (scaled + 1.0) * (space.high - space.low))
