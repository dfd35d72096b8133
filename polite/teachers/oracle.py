"""A teacher who knows a reward and answers by it, now and then wrongly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from polite.teachers.marking import Marking
from polite.types import (
    EQUAL,
    UNRELATED,
    Answer,
    Floats64,
    InvalidValueError,
    Query,
    SegmentPool,
)


@dataclass(frozen=True)
class Oracle(Marking):
    """Preferences by return, highlights at the extremes of the preferred segment.

    The defaults are those of the POLITE release on HalfCheetah.
    """

    tie_threshold: float = 0.1
    """ε: returns that differ by no more than this are a tie."""
    tie: tuple[float, float] = UNRELATED
    """The answer to a tie: (0, 0) as in the release, or (.5, .5) as B-Pref's equal teacher."""
    flip_probability: float = 0.1
    """How often an expressed preference is reversed (POLITE: 10%)."""

    def __post_init__(self) -> None:
        """Check the settings.

        Raises:
            InvalidValueError: if ε is negative, the flips are no rate, or a tie has a winner; or
                as in `Marking`.
        """
        super().__post_init__()
        if (
            not self.tie_threshold >= 0
            or not 0 <= self.flip_probability <= 1
            or self.tie not in (UNRELATED, EQUAL)
        ):
            raise InvalidValueError(
                "expected tie_threshold ≥ 0, flip_probability in [0, 1], tie (0, 0) or (.5, .5), "
                f"got {self}"
            )

    def answer(
        self, query: int, rewards_1: Floats64, rewards_2: Floats64, rng: np.random.Generator
    ) -> Answer:
        """Compare two segments.

        Args:
            query: index of the query.
            rewards_1: any reward along the real steps of σ₁, (t₁,).
            rewards_2: the same along σ₂, (t₂,).
            rng: source of the flips; one draw an answer, tie or not.
        """
        flipped = bool(rng.random() < self.flip_probability)
        difference = rewards_1.sum() - rewards_2.sum()
        if abs(difference) <= self.tie_threshold:
            return Answer(query, self.tie)
        return self.express(query, (rewards_1, rewards_2), int(difference <= 0), flipped)

    def answer_queries(
        self, pool: SegmentPool, queries: Sequence[Query], rng: np.random.Generator
    ) -> list[Answer]:
        """Answer each query by the pool's true rewards."""
        return [
            self.answer(index, *rewards_of(pool, query), rng) for index, query in enumerate(queries)
        ]


def rewards_of(pool: SegmentPool, query: Query) -> tuple[Floats64, Floats64]:
    """The true rewards along the real steps of both segments, (t₁,) and (t₂,)."""
    first, second = (
        pool.rewards[segment, : pool.lengths[segment]] for segment in (query.first, query.second)
    )
    return first, second
