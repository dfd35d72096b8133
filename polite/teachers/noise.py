"""Highlights that are not quite right: missed, of the wrong sign, misplaced, or of other answers.

The preferences stay as they are. Any teacher's answers can be made noisy, those of people included.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from polite.teachers.highlights import shuffle_highlights
from polite.types import Answer, Floats64, Highlight, InvalidValueError, Query, SegmentPool

AnswerQueries = Callable[[SegmentPool, Sequence[Query], np.random.Generator], list[Answer]]
"""(segments, pairs of them, source of chance) -> an answer to each pair, in their order."""


@dataclass(frozen=True)
class HighlightNoise:
    """How often highlights go wrong; the defaults leave them as they are."""

    miss_probability: float = 0.0
    """How often a highlight is not given, each by itself."""
    wrong_sign_probability: float = 0.0
    """How often the signs are mixed up: h⁺ is given as h⁻ and h⁻ as h⁺, both of an answer at once,
    because it can have only one of each sign."""
    shift_probability: float = 0.0
    """How often a highlight lies beside its moment, each by itself."""
    shift: int = 5
    """How many steps at most it then lies off, either way."""

    def __post_init__(self) -> None:
        """Check the settings.

        Raises:
            InvalidValueError: if a probability is not in [0, 1] or the shift is below 1.
        """
        probabilities = (
            self.miss_probability,
            self.wrong_sign_probability,
            self.shift_probability,
        )
        if not all(0 <= p <= 1 for p in probabilities) or self.shift < 1:
            raise InvalidValueError(f"expected probabilities in [0, 1] and shift ≥ 1, got {self}")


CARELESS: Final = HighlightNoise(
    miss_probability=0.3, wrong_sign_probability=0.1, shift_probability=0.3
)
"""What our comparisons call noisy; no measurement of people."""


@dataclass(frozen=True)
class NoisyHighlights:
    """A teacher who answers as another one does, but with noisy highlights."""

    teacher: AnswerQueries
    """Who answers, such as `Oracle().answer_queries`."""
    noise: HighlightNoise
    """How often the highlights go wrong."""

    def answer_queries(
        self, pool: SegmentPool, queries: Sequence[Query], rng: np.random.Generator
    ) -> list[Answer]:
        """Answer each query, first the teacher, then the noise."""
        answers = self.teacher(pool, queries, rng)
        return perturb_highlights(answers, pool, queries, self.noise, rng)


@dataclass(frozen=True)
class ShuffledHighlights:
    """A teacher who answers as another one does, but whose highlights say nothing.

    A null model: those of a session are dealt out anew among its answers (`shuffle_highlights`).
    """

    teacher: AnswerQueries
    """Who answers."""

    def answer_queries(
        self, pool: SegmentPool, queries: Sequence[Query], rng: np.random.Generator
    ) -> list[Answer]:
        """Answer each query of a session, then shuffle."""
        return shuffle_highlights(self.teacher(pool, queries, rng), pool, queries, rng)


def perturb_highlights(
    answers: Sequence[Answer],
    pool: SegmentPool,
    queries: Sequence[Query],
    noise: HighlightNoise,
    rng: np.random.Generator,
) -> list[Answer]:
    """Miss, mix up and shift the highlights of answers.

    A shifted anchor is drawn uniformly from the other steps of its segment within `noise.shift`, so
    it always moves, unless the segment has one step only. The window keeps its length L and is cut
    off at step 0 like any other.

    Args:
        answers: of any teacher, to any of the queries.
        pool: the segments, whose lengths say where an anchor may lie.
        queries: what `answer.query` counts.
        noise: how often each kind happens.
        rng: source of all chance; seven draws an answer, highlighted or not.
    """
    draws = rng.random((len(answers), 7))
    return [
        _perturb(answer, _last_step(answer, pool, queries), noise, row)
        for answer, row in zip(answers, draws, strict=True)
    ]


def shifted_end(end: int, last: int, shift: int, draw: float) -> int:
    """Another step of 0 … last, at most `shift` from `end`, each as likely as any other.

    Args:
        end: the anchor j.
        last: the segment's last step.
        shift: how far it may move, at least 1.
        draw: uniform on [0, 1); the candidates share this interval in their order.

    Returns:
        The new anchor; `end` itself if the segment has no other step.
    """
    first, final = max(0, end - shift), min(last, end + shift)
    if first == final:
        return end
    moved = first + int(draw * (final - first))
    return moved + (moved >= end)  # `end` itself is left out


def _last_step(answer: Answer, pool: SegmentPool, queries: Sequence[Query]) -> int:
    """The last real step of the segment that the highlights lie on."""
    query = queries[answer.query]
    segment = (query.first, query.second)[answer.marked or 0]
    return int(pool.lengths[segment]) - 1


def _perturb(answer: Answer, last: int, noise: HighlightNoise, draws: Floats64) -> Answer:
    positive = _perturb_one(answer.positive, last, noise, draws[1:4])
    negative = _perturb_one(answer.negative, last, noise, draws[4:7])
    if draws[0] < noise.wrong_sign_probability:
        positive, negative = negative, positive
    return replace(answer, positive=positive, negative=negative)


def _perturb_one(
    highlight: Highlight | None, last: int, noise: HighlightNoise, draws: Floats64
) -> Highlight | None:
    missed, shifted, where = draws
    if highlight is None or missed < noise.miss_probability:
        return None
    if shifted >= noise.shift_probability:
        return highlight
    return replace(highlight, end=shifted_end(highlight.end, last, noise.shift, where))
