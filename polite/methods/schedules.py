"""When the teacher is asked: ways to spread a budget of queries over a training."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from math import ceil, log1p
from typing import Final, NamedTuple, Self, TypeAlias

from polite.rewards.trainer import updates_per_epoch
from polite.types import InvalidValueError

UP_FRONT_SHARE = 0.25
"""Of the budget that a decaying rate asks before the training (Christiano et al. 2017)."""
HALF_RATE = 2e6
"""Policy steps after which a decaying rate has fallen to one half (Christiano et al. 2017)."""


LATER: Final[Mapping[str, bool]] = {"later": True}
"""Marks a setting that came when runs had been landed: at its default their fingerprints stay."""


class Epochs(NamedTuple):
    """How long a reward model is trained, in passes over all answers so far."""

    first: int
    """After the first session."""
    later: int
    """After each later one."""


EPOCHS: Final[Mapping[str, Epochs]] = {"released": Epochs(200, 50), "few": Epochs(25, 6)}
"""By the name that configurations use: the authors' release, and an eighth of it."""


class Session(NamedTuple):
    """One time that the teacher is asked."""

    at: int
    """Policy steps before it."""
    queries: int
    """How many are asked."""


Strategy: TypeAlias = "Callable[[Schedule, int, int], list[Session]]"
"""(schedule, queries, steps) -> sessions in order, the first before any step."""


def even_sessions(schedule: Schedule, queries: int, steps: int) -> list[Session]:
    """As many queries in each session, the first never empty: the release of POLITE."""
    times = [int(k * schedule.interval * steps) for k in range(schedule.sessions)]
    asked = [-(-k * queries // schedule.sessions) for k in range(schedule.sessions + 1)]
    return _sessions(times, asked[1:])  # rounded up


def decaying_rate(schedule: Schedule, queries: int, steps: int) -> list[Session]:
    """A quarter up front, then ever fewer until the training ends (Christiano et al. 2017).

    After t steps queries are due at a rate in proportion to h / (t + h), h = `HALF_RATE`; that is,
    ln(1 + t / h) / ln(1 + t_last / h) of the rest are due after t. Each `interval` of the training
    a session asks what is due, in whole queries, the last one all that is left.
    """
    count = ceil(1 / schedule.interval - 1e-9) if schedule.interval else 1
    times = sorted({int(k * schedule.interval * steps) for k in range(count)})
    due = [log1p(time / HALF_RATE) / log1p(max(1, times[-1]) / HALF_RATE) for time in times]
    shares = [UP_FRONT_SHARE + (1 - UP_FRONT_SHARE) * part for part in due]
    asked = [max(1, round(share * queries)) if queries else 0 for share in shares]
    return _sessions(times, [*asked[:-1], queries])


def up_front(schedule: Schedule, queries: int, steps: int) -> list[Session]:
    """Everything before the training, about segments of the untrained policy."""
    return _sessions([0], [queries])


def _sessions(times: list[int], asked: list[int]) -> list[Session]:
    """Sessions from their times and how many queries are asked up to and with each of them."""
    return [
        Session(time, total - before)
        for time, before, total in zip(times, [0, *asked], asked, strict=False)
        if total > before
    ]


@dataclass(frozen=True)
class Schedule:
    """When the teacher is asked, and about what (the released code's numbers)."""

    sessions: int = 10
    """Feedback sessions of `even_sessions`; the other strategies have a number of their own."""
    interval: float = 0.02
    """Between two sessions, as a share of all policy steps: 20,000 of 1,000,000. So the tenth is at
    18%, and the reward stays as it is from then on."""
    segment_length: int = 50
    """m, steps of a segment."""
    segments_per_query: int = 5
    """New segments of a session for each of its queries."""
    recent_sessions: int = 5
    """Pairs are drawn from the segments of this many last sessions."""
    first_epochs: int = EPOCHS["released"].first
    """Passes over the answers after the first session."""
    later_epochs: int = EPOCHS["released"].later
    """Passes over all answers so far after each later session."""
    strategy: Strategy = even_sessions
    """How the queries are spread."""
    show_ends: bool = field(default=False, metadata=LATER)
    """Whether segments of episodes that the env ended may be cut short by the end, so that answers
    say what an end costs (`polite.segments.cut_segments`)."""

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

    def with_epochs(self, epochs: Epochs) -> Self:
        """The same sessions, with a reward model that is trained for so long."""
        return replace(self, first_epochs=epochs.first, later_epochs=epochs.later)

    def plan(self, queries: int, steps: int) -> list[Session]:
        """Spread the queries over sessions; those that would ask nothing are left out.

        Args:
            queries: the budget, spent exactly.
            steps: policy steps of the whole training.
        """
        return self.strategy(self, queries, steps)

    def epochs(self, number: int, answers: int, batch_size: int, steps: int) -> int:
        """How long the reward model is trained after a session, in passes over all answers so far.

        Args:
            number: of the session, from 1.
            answers: how many there are by then.
            batch_size: of the reward training.
            steps: policy steps of the whole training.
        """
        return self.first_epochs if number == 1 else self.later_epochs


@dataclass(frozen=True)
class EqualUpdates(Schedule):
    """The same sessions, but more answers do not mean more training of the reward model.

    After each session it gets as many gradient updates as it would by the plain schedule with a
    budget of `reference` queries, whose minibatches are fewer; rounded up to whole epochs, so by
    less than one of them.
    """

    reference: int = 200
    """The budget whose updates are copied."""

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            InvalidValueError: if the reference asks nothing, or a range of `Schedule` is left.
        """
        super().__post_init__()
        if self.reference < 1:
            raise InvalidValueError(f"expected reference ≥ 1, got {self.reference}")

    def epochs(self, number: int, answers: int, batch_size: int, steps: int) -> int:
        """Epochs over these answers with the updates that the reference has after its session."""
        plan = self.plan(self.reference, steps)
        fewer = sum(session.queries for session in plan[:number])
        copied = super().epochs(number, fewer, batch_size, steps)
        updates = copied * updates_per_epoch(fewer, batch_size)
        return ceil(updates / updates_per_epoch(answers, batch_size))


SCHEDULES: Final[Mapping[str, Schedule]] = {
    "sessions": Schedule(),
    "decaying": Schedule(interval=0.05, strategy=decaying_rate),
    "up-front": Schedule(strategy=up_front),
}
"""By the name that configurations use."""
