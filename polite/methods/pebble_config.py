"""How PEBBLE is set up, and when it asks."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Final

from polite.methods.config import METHODS, Method, Session
from polite.methods.pairs import PairSampler, ask_disputed
from polite.policies.sac import SacConfig
from polite.rewards.network import RewardNetConfig
from polite.rewards.trainer import RewardTrainingConfig
from polite.types import InvalidValueError

NET: Final = RewardNetConfig(hidden=(256, 256, 256), dropout=(0.0, 0.0, 0.0))
"""The net of PEBBLE's reward models."""
REFERENCE_STEPS: Final = 250_000
"""A training in which ten sessions find room, and time to learn after the last one."""


TRAINING: Final = RewardTrainingConfig(epochs=200, stop_accuracy=0.97)
"""How they are trained at each session, on all answers so far (B-Pref's default epochs)."""
PEBBLE_METHODS: Final[Mapping[str, Method]] = {
    "pebble": METHODS["preferences"],
    "polite-pebble": METHODS["polite"],
    "sac": METHODS["ground-truth"],
}
"""PEBBLE itself, PEBBLE whose reward models learn from highlights too, and the ceiling of both:
the same SAC on the true reward."""


@dataclass(frozen=True)
class PebbleSchedule:
    """What PEBBLE does when; the numbers are B-Pref's where nothing else is said."""

    unsupervised_steps: int = 9_000
    """Env steps, after the random ones, in which the policy is paid for new states. The teacher is
    asked for the first time after them."""
    neighbours: int = 5
    """k: a state is as new as it is far from its k-th nearest neighbour."""
    critic_updates: int = 100
    """Updates right after the first session, with critics that begin anew."""
    sessions: int = 10
    """Feedback sessions, if there is time for so many; the queries are spread evenly over them."""
    interval: int = 20_000
    """Env steps between two sessions."""
    segment_length: int = 50
    """m, steps of a segment."""
    segments_per_query: int = 20
    """Segments that are cut at a session for each of its queries: two for each of the ten candidate
    pairs (`polite.methods.pairs`)."""
    recent_steps: int = 100_000
    """Segments are cut from the trajectories of about so many last env steps (B-Pref: from the last
    100 episodes)."""

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            InvalidValueError: naming the valid ranges, if a value is outside.
        """
        counts = (
            self.neighbours,
            self.sessions,
            self.interval,
            self.segment_length,
            self.segments_per_query - 1,
            self.recent_steps,
        )
        if min(counts) < 1 or min(self.unsupervised_steps, self.critic_updates) < 0:
            raise InvalidValueError(
                "expected unsupervised_steps and critic_updates ≥ 0, segments_per_query ≥ 2 and "
                f"all else ≥ 1, got {self}"
            )

    def plan(self, queries: int, steps: int, first: int) -> list[Session]:
        """Spread the queries over the sessions that there is time for; empty ones are left out.

        Args:
            queries: the budget, all of which is spent.
            steps: env steps of the whole training.
            first: env steps before the first session, fewer than `steps`.
        """
        count = min(self.sessions, 1 + (steps - 1 - first) // self.interval)
        asked = [-(-k * queries // count) for k in range(count + 1)]  # rounded up
        return [
            Session(at=first + k * self.interval, queries=asked[k + 1] - asked[k])
            for k in range(count)
            if asked[k + 1] > asked[k]
        ]


@dataclass(frozen=True)
class PebbleConfig:
    """How a policy is trained from feedback by PEBBLE."""

    queries: int
    """The budget; not used by a method that does not ask."""
    steps: int
    """SAC's env steps, the random and the unsupervised ones included. No others are needed: the
    segments are cut from what the policy did."""
    method: Method = METHODS["preferences"]
    """What the reward models learn from; or the true reward, for a ceiling under the same SAC."""
    schedule: PebbleSchedule = field(default_factory=PebbleSchedule)
    """What happens when."""
    sampler: PairSampler = ask_disputed
    """Which pairs it asks about, after the first session, which asks about any."""
    members: int = 3
    """Reward models of the ensemble; their mean pays the policy."""
    net: RewardNetConfig = NET
    """Shape of each."""
    training: RewardTrainingConfig = TRAINING
    """How they are trained at each session, on all answers so far."""
    sac: SacConfig = field(default_factory=SacConfig)
    """How the policy is trained."""

    def __post_init__(self) -> None:
        """Check that the parts fit each other.

        Raises:
            InvalidValueError: unless there is a step after the first session, a query and two
                members, where the method asks.
        """
        if not (self.method.asks or self.method.true_reward):
            raise InvalidValueError(f"expected a method that asks, or the true reward, got {self}")
        needed = self.first_session + 1 if self.method.asks else 1
        if self.steps < needed:
            raise InvalidValueError(
                f"expected steps ≥ {needed}, beyond the random and unsupervised ones, got "
                f"{self.steps}; train longer, or lower random_steps and unsupervised_steps"
            )
        if self.method.asks and (self.queries < 1 or self.members < 2 or self.first_session < 1):
            raise InvalidValueError(
                "expected queries ≥ 1, members ≥ 2 and a step before the first session, got "
                f"{self.queries}, {self.members} and {self.first_session} of {self.steps} steps"
            )

    @property
    def first_session(self) -> int:
        """Env steps before the teacher is asked for the first time."""
        return self.sac.random_steps + self.schedule.unsupervised_steps

    def __str__(self) -> str:
        """All settings as JSON, the same in every process; functions by their names."""
        return json.dumps(asdict(self), default=lambda function: function.__name__)


def with_loss_of(training: RewardTrainingConfig) -> RewardTrainingConfig:
    """B-Pref's training with the loss, and only the loss, of another one."""
    return replace(
        TRAINING,
        preference=training.preference,
        highlights=training.highlights,
        highlight_length=training.highlight_length,
        highlight_decay=training.highlight_decay,
        alpha_positive=training.alpha_positive,
        alpha_negative=training.alpha_negative,
    )


def pebble_config(queries: int, steps: int, **settings: Any) -> PebbleConfig:
    """PEBBLE in a training of any length: below `REFERENCE_STEPS` all times are shortened alike.

    Args:
        queries: the budget.
        steps: env steps of the whole training.
        settings: other fields of `PebbleConfig`, the schedule that of `REFERENCE_STEPS` (B-Pref's
            if not given).

    Raises:
        InvalidValueError: if the training is too short even so.
    """
    share = min(1.0, steps / REFERENCE_STEPS)
    sac = settings.pop("sac", SacConfig())
    schedule = settings.pop("schedule", PebbleSchedule())
    return PebbleConfig(
        queries=queries,
        steps=steps,
        schedule=replace(
            schedule,
            unsupervised_steps=round(share * schedule.unsupervised_steps),
            interval=max(1, round(share * schedule.interval)),
        ),
        sac=replace(sac, random_steps=round(share * sac.random_steps)),
        **settings,
    )
