"""What is set for each env: the oracle, the highlights, PPO (the paper and the released code)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from polite.methods.preference_learning import MakeTeacher
from polite.policies.ppo import PpoConfig
from polite.rewards.trainer import RewardTrainingConfig
from polite.teachers.highlights import trailing_means
from polite.teachers.oracle import Oracle
from polite.types import SegmentPool

QUANTILES = (0.2, 0.8)
"""Of the first segments' trailing means: highlight thresholds for an env that has no preset."""
TIE = 0.01
"""Tie threshold for such an env, as a share of the spread of the first segments' returns."""


@dataclass(frozen=True)
class EnvPreset:
    """How preferences are learned in one env."""

    oracle: Oracle | None = None
    """Who answers; None for one whose thresholds are quantiles of the first segments."""
    training: RewardTrainingConfig = field(
        default_factory=lambda: RewardTrainingConfig(batch_size=64, highlight_length=5)
    )
    """L, λ, α and the minibatch of the reward model."""
    ppo: PpoConfig = field(
        default_factory=lambda: PpoConfig(num_envs=8, rollout=256, learning_rate=3e-4, log_std=0.0)
    )
    """The policy's training, chosen for a laptop's two cores."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """Keywords of the env."""

    @property
    def make_teacher(self) -> MakeTeacher:
        """From the first session's segments to the oracle who answers."""
        length = self.training.highlight_length
        return lambda pool: (self.oracle or quantile_oracle(pool, length)).answer_queries


PRESETS: Final[Mapping[str, EnvPreset]] = {
    "SocialCorridor": EnvPreset(
        # The mean of three rewards is above .15 where any goal is reached (.5 / 3), below −.15 at a
        # collision (−1 / 3). The ±.2 of the authors' own corridor belongs to another reward; here
        # it would never mark the intermittent goal. A tie is 20 cm of way in five seconds.
        oracle=Oracle(
            tie_threshold=0.04, positive_threshold=0.15, negative_threshold=-0.15, length=10
        ),
        training=RewardTrainingConfig(batch_size=128, highlight_length=10),
        # At a fixed horizon all corridors are at the same part of their episodes: only a rollout of
        # a whole episode shows an update every part.
        ppo=PpoConfig(num_envs=4, rollout=600, batch_size=240, log_std=-0.5),
        settings={"terminate_on_goal": False, "terminate_on_collision": False},
    ),
    "HalfCheetah": EnvPreset(
        oracle=Oracle(),
        training=RewardTrainingConfig(batch_size=128, weight_decay=1e-3, highlight_length=5),
        ppo=PpoConfig(
            num_envs=8,
            rollout=256,
            learning_rate=3e-4,
            discount=0.98,
            gae_lambda=0.92,
            hidden=(256, 256),
            activation="relu",
            log_std=-2.0,
        ),
    ),
    "Walker2d": EnvPreset(
        oracle=Oracle(tie_threshold=2.0, positive_threshold=1.0, negative_threshold=-1.0),
        training=RewardTrainingConfig(batch_size=64, highlight_length=5, alpha_negative=5.0),
    ),
}
"""By the env's name without module and version."""


def preset_of(env_id: str) -> EnvPreset:
    """The preset of an env, or what serves any env."""
    name = env_id.rpartition(":")[2].rpartition("-v")[0]
    return PRESETS.get(name, EnvPreset())


def quantile_oracle(pool: SegmentPool, length: int) -> Oracle:
    """An oracle that highlights what is rare in these segments.

    Args:
        pool: the first session's segments.
        length: L.
    """
    means = np.concatenate([trailing_means(pool[index].rewards) for index in range(len(pool))])
    low, high = np.quantile(means, QUANTILES)
    return Oracle(
        tie_threshold=float(TIE * pool.returns.std()),
        positive_threshold=float(high),
        negative_threshold=float(low),
        length=length,
    )
