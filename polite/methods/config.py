"""What a method is made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite
from typing import Final

from polite.methods.pairs import NEED_ENSEMBLE, PairSampler, ask_uniformly
from polite.methods.schedules import LATER
from polite.methods.schedules import Schedule as Schedule
from polite.methods.schedules import Session as Session
from polite.policies.ppo import PpoConfig
from polite.rewards.network import FAST, RewardNetConfig
from polite.rewards.trainer import RewardTrainingConfig
from polite.types import InvalidValueError


@dataclass(frozen=True)
class Method:
    """Which reward pays the policy, and what the reward model is trained on."""

    true_reward: bool = False
    """The env's own reward pays; nobody is asked and there is no reward model."""
    preferences: bool = False
    """The reward model is trained on the preferences (Eq. 2)."""
    highlights: bool = False
    """It is trained on the highlights (Eqs. 4 and 5)."""

    @property
    def asks(self) -> bool:
        """Whether anything is learned from answers."""
        return self.preferences or self.highlights


METHODS: Final[Mapping[str, Method]] = {
    "polite": Method(preferences=True, highlights=True),
    "preferences": Method(preferences=True),
    "highlights": Method(highlights=True),
    "untrained": Method(),
    "ground-truth": Method(true_reward=True),
}
"""POLITE, the cells of its ablation (Fig. 4c), and the ceiling."""


@dataclass(frozen=True)
class LearningConfig:
    """How a policy is trained from feedback."""

    method: Method
    """Which reward pays, and what it is learned from."""
    queries: int
    """The budget; not used by a method that does not ask."""
    steps: int
    """PPO steps. The steps spent on collecting segments come on top."""
    schedule: Schedule = field(default_factory=Schedule)
    """When the teacher is asked."""
    sampler: PairSampler = ask_uniformly
    """Which pairs it is asked about, after the first session, which asks about any: the reward
    model knows nothing then (as in the released code of B-Pref)."""
    net: RewardNetConfig = FAST
    """The reward model."""
    members: int = 1
    """How many of them there are; the policy is paid by the mean of several."""
    normalise: bool = False
    """Whether each member's r̂ has mean 0 and spread 1 over the segments so far, after each session
    (`normalise`); the mean of several, which pays, then spreads less."""
    reward_offset: float = field(default=0.0, metadata=LATER)
    """Added to what r̂ pays for every step, before it is trained too (`raise_by`)."""
    training: RewardTrainingConfig = field(default_factory=RewardTrainingConfig)
    """How it is trained; the schedule sets the epochs."""
    ppo: PpoConfig = field(default_factory=PpoConfig)
    """How the policy is trained."""

    def __post_init__(self) -> None:
        """Check the budgets.

        Raises:
            InvalidValueError: if there are no steps, no reward model, an offset that is not
                finite, no queries for a method that asks, or one reward model for a sampler that
                compares several.
        """
        if self.steps < 1:
            raise InvalidValueError(f"expected steps ≥ 1, got {self.steps}")
        if not isfinite(self.reward_offset):
            raise InvalidValueError(f"expected a finite reward_offset, got {self.reward_offset}")
        if self.members < 1:
            raise InvalidValueError(f"expected members ≥ 1, got {self.members}")
        if self.members == 1 and self.sampler in NEED_ENSEMBLE:
            raise InvalidValueError(
                "this sampler asks what reward models disagree about: expected members ≥ 2, got 1"
            )
        if self.queries < 1 and self.method.asks:
            raise InvalidValueError(f"expected queries ≥ 1, got {self.queries}")
