"""A teacher who knows a reward and answers by it, now and then wrongly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from polite.teachers.highlights import CandidateRule, place_highlight, released_candidate
from polite.types import (
    EQUAL,
    FIRST,
    SECOND,
    UNRELATED,
    Answer,
    Floats64,
    InvalidValueError,
    Query,
    SegmentPool,
)


@dataclass(frozen=True)
class Oracle:
    """Preferences by return, highlights at the extremes of the preferred segment.

    The defaults are those of the POLITE release on HalfCheetah.
    """

    tie_threshold: float = 0.1
    """ε: returns that differ by no more than this are a tie."""
    tie: tuple[float, float] = UNRELATED
    """The answer to a tie: (0, 0) as in the release, or (.5, .5) as B-Pref's equal teacher."""
    flip_probability: float = 0.1
    """How often an expressed preference is reversed (POLITE: 10%)."""
    positive_threshold: float = 0.3
    """h⁺ is given if its score is above this; infinity for none."""
    negative_threshold: float = -0.3
    """h⁻ is given if its score is below this; minus infinity for none."""
    length: int = 5
    """L, how many steps a highlight reaches back."""
    rule: CandidateRule = released_candidate
    """Which moment is marked, and its score."""
    marks_labelled: bool = True
    """Whether highlights come from the segment labelled the winner even when the label was flipped
    (as in the release), or stay with the truly better one (an ablation)."""

    def __post_init__(self) -> None:
        """Check the settings.

        Raises:
            InvalidValueError: if ε is negative, the flips are no rate, or a tie has a winner.
        """
        if (
            self.tie_threshold < 0
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
        prefers_first = bool(difference > 0) != flipped
        marks_other = flipped and not self.marks_labelled
        marked = rewards_1 if prefers_first != marks_other else rewards_2
        return Answer(
            query=query,
            preference=FIRST if prefers_first else SECOND,
            positive=place_highlight(marked, +1, self.length, self.positive_threshold, self.rule),
            negative=place_highlight(marked, -1, self.length, self.negative_threshold, self.rule),
            marks_other=marks_other,
        )

    def answer_queries(
        self, pool: SegmentPool, queries: Sequence[Query], rng: np.random.Generator
    ) -> list[Answer]:
        """Answer each query by the pool's true rewards."""
        return [
            self.answer(index, _rewards(pool, query.first), _rewards(pool, query.second), rng)
            for index, query in enumerate(queries)
        ]


def _rewards(pool: SegmentPool, segment: int) -> Floats64:
    rewards: Floats64 = pool.rewards[segment, : pool.lengths[segment]]
    return rewards
