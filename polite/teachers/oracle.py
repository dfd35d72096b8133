"""A teacher who knows a reward and answers by it, now and then wrongly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol

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
    sign_test: bool = True
    """Whether the reward over the highlight's own window must have its sign (POLITE)."""

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
        return expressed(query, (rewards_1, rewards_2), int(difference <= 0), flipped, self)

    def answer_queries(
        self, pool: SegmentPool, queries: Sequence[Query], rng: np.random.Generator
    ) -> list[Answer]:
        """Answer each query by the pool's true rewards."""
        return [
            self.answer(index, *rewards_of(pool, query), rng) for index, query in enumerate(queries)
        ]


class Marking(Protocol):
    """How a teacher places highlights; see `Oracle` for what each setting means."""

    @property
    def positive_threshold(self) -> float: ...  # noqa: D102
    @property
    def negative_threshold(self) -> float: ...  # noqa: D102
    @property
    def length(self) -> int: ...  # noqa: D102
    @property
    def rule(self) -> CandidateRule: ...  # noqa: D102
    @property
    def marks_labelled(self) -> bool: ...  # noqa: D102
    @property
    def sign_test(self) -> bool: ...  # noqa: D102


def expressed(
    query: int,
    rewards: tuple[Floats64, Floats64],
    chosen: int,
    mistaken: bool,
    marking: Marking,
) -> Answer:
    """An answer with a preference, and highlights on the winner.

    Args:
        query: index of the query.
        rewards: along the real steps of σ₁ and of σ₂, (t₁,) and (t₂,).
        chosen: the better one to the teacher, 0 or 1.
        mistaken: whether the other one is labelled the winner.
        marking: where highlights go.
    """
    labelled = 1 - chosen if mistaken else chosen
    marked = labelled if marking.marks_labelled else chosen
    place = partial(
        place_highlight,
        rewards[marked],
        length=marking.length,
        rule=marking.rule,
        sign_test=marking.sign_test,
    )
    return Answer(
        query=query,
        preference=(FIRST, SECOND)[labelled],
        positive=place(+1, threshold=marking.positive_threshold),
        negative=place(-1, threshold=marking.negative_threshold),
        marks_other=marked != labelled,
    )


def rewards_of(pool: SegmentPool, query: Query) -> tuple[Floats64, Floats64]:
    """The true rewards along the real steps of both segments, (t₁,) and (t₂,)."""
    first, second = (
        pool.rewards[segment, : pool.lengths[segment]] for segment in (query.first, query.second)
    )
    return first, second
