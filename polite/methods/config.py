"""What a method is made of, and when it asks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, NamedTuple

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


class Session(NamedTuple):
    """One time that the teacher is asked."""

    at: int
    """Policy steps before it."""
    queries: int
    """How many are asked."""


@dataclass(frozen=True)
class Schedule:
    """When the teacher is asked, and about what (the released code's numbers)."""

    sessions: int = 10
    """Feedback sessions; the queries are spread evenly over them."""
    interval: float = 0.02
    """Between two sessions, as a share of all policy steps: 20,000 of 1,000,000. So the tenth is at
    18%, and the reward stays as it is from then on."""
    segment_length: int = 50
    """m, steps of a segment."""
    segments_per_query: int = 5
    """New segments of a session for each of its queries."""
    recent_sessions: int = 5
    """Pairs are drawn from the segments of this many last sessions."""
    first_epochs: int = 200
    """Passes over the answers after the first session."""
    later_epochs: int = 50
    """Passes over all answers so far after each later session."""

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            InvalidValueError: unless the counts are at least 1 and the last session lies within
                the training.
        """
        counts = (
            self.sessions,
            self.segment_length,
            self.segments_per_query,
            self.recent_sessions,
            self.first_epochs,
            self.later_epochs,
        )
        last = (self.sessions - 1) * self.interval
        if min(counts) < 1 or self.segments_per_query < 2 or not 0 <= last < 1:
            raise InvalidValueError(
                "expected counts ≥ 1, segments_per_query ≥ 2 and (sessions − 1) · interval in "
                f"[0, 1), got {self}"
            )

    def plan(self, queries: int, steps: int) -> list[Session]:
        """Spread the queries over the sessions, the first never empty; empty ones are left out.

        Args:
            queries: the budget.
            steps: policy steps of the whole training.
        """
        asked = [-(-k * queries // self.sessions) for k in range(self.sessions + 1)]  # rounded up
        return [
            Session(at=int(k * self.interval * steps), queries=asked[k + 1] - asked[k])
            for k in range(self.sessions)
            if asked[k + 1] > asked[k]
        ]


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
    net: RewardNetConfig = FAST
    """The reward model."""
    training: RewardTrainingConfig = field(default_factory=RewardTrainingConfig)
    """How it is trained; the schedule sets the epochs."""
    ppo: PpoConfig = field(default_factory=PpoConfig)
    """How the policy is trained."""

    def __post_init__(self) -> None:
        """Check the budgets.

        Raises:
            InvalidValueError: if there are no steps, or no queries for a method that asks.
        """
        if self.steps < 1:
            raise InvalidValueError(f"expected steps ≥ 1, got {self.steps}")
        if self.queries < 1 and self.method.asks:
            raise InvalidValueError(f"expected queries ≥ 1, got {self.queries}")
