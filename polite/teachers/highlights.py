"""Where a teacher who knows the reward would put a highlight: pure functions on (t,) rewards."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import isclose
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from polite.types import Answer, Floats64, Highlight, Query, SegmentPool

TRAILING_STEPS = 3


class Candidate(NamedTuple):
    """A moment that might be highlighted."""

    end: int
    """The anchor j."""
    score: float
    """How good the moment is; a teacher marks it if this is past a threshold."""


CandidateRule = Callable[[Floats64, int, int], Candidate]
"""(rewards (t,), sign ±1, L) → the best (+1) or worst (−1) moment."""


def trailing_sums(rewards: Floats64, steps: int) -> Floats64:
    """Sum of the last `steps` rewards, fewer at the beginning, at every step, (t,) → (t,).

    Each window by itself: equal windows have equal sums, to the last bit.
    """
    padded = np.concatenate([np.zeros(steps - 1), rewards])
    trailing: Floats64 = sliding_window_view(padded, steps).sum(axis=-1)
    return trailing


def trailing_means(rewards: Floats64, steps: int = TRAILING_STEPS) -> Floats64:
    """Mean of the last `steps` rewards, fewer at the beginning, at every step, (t,) → (t,)."""
    terms = np.minimum(np.arange(1, len(rewards) + 1), steps)
    means: Floats64 = trailing_sums(rewards, steps) / terms
    return means


def released_candidate(rewards: Floats64, sign: int, length: int) -> Candidate:
    """The release's form: the extreme reward within the window of the extreme trailing mean.

    The score is that mean, of at most three rewards; `length` plays no part in it.
    """
    means = trailing_means(rewards)
    last = int(np.argmax(sign * means))
    first = max(0, last - TRAILING_STEPS + 1)
    return Candidate(
        end=first + int(np.argmax(sign * rewards[first : last + 1])), score=float(means[last])
    )


def paper_candidate(rewards: Floats64, sign: int, length: int) -> Candidate:
    """The paper's form: the end of the window of L + 1 steps with the extreme sum, its score."""
    sums = trailing_sums(rewards, length + 1)
    end = int(np.argmax(sign * sums))
    return Candidate(end=end, score=float(sums[end]))


def passes_sign_test(rewards: Floats64, highlight: Highlight, sign: int) -> bool:
    """Whether the highlight's own window sums above 0 (sign +1) or below 0 (−1)."""
    return bool(sign * rewards[highlight.window].sum() > 0)


def _equal(score: float, threshold: float) -> bool:
    """Whether nothing but rounding tells two means of rewards apart."""
    return isclose(score, threshold, rel_tol=1e-9, abs_tol=1e-12)


def place_highlight(
    rewards: Floats64,
    sign: int,
    length: int,
    threshold: float,
    rule: CandidateRule,
    sign_test: bool = True,
) -> Highlight | None:
    """Mark the best (+1) or worst (−1) moment if it is past the threshold and the sign is right.

    Args:
        rewards: reward of each real step, (t,).
        sign: +1 for h⁺, −1 for h⁻.
        length: L.
        threshold: the score must be above it (+1) or below it (−1), by more than rounding.
        rule: which moment, with which score.
        sign_test: whether the window's own sum must have the sign too.
    """
    candidate = rule(rewards, sign, length)
    highlight = Highlight(candidate.end, length)
    past = sign * candidate.score > sign * threshold and not _equal(candidate.score, threshold)
    right = not sign_test or passes_sign_test(rewards, highlight, sign)
    return highlight if past and right else None


def shuffle_highlights(
    answers: Sequence[Answer],
    pool: SegmentPool,
    queries: Sequence[Query],
    rng: np.random.Generator,
) -> list[Answer]:
    """Deal the (h⁺, h⁻) marks out anew among the answers with an expressed preference.

    A null model: it has as many highlights as the original, which say nothing. A mark past the end
    of a shorter segment moves to its last step.
    """
    expressed = [i for i, answer in enumerate(answers) if answer.preferred is not None]
    shuffled = list(answers)
    for receiver, giver in zip(expressed, rng.permutation(expressed), strict=True):
        query = queries[answers[receiver].query]
        segment = (query.first, query.second)[answers[receiver].marked or 0]
        last = int(pool.lengths[segment]) - 1
        shuffled[receiver] = replace(
            answers[receiver],
            positive=_clip(answers[giver].positive, last),
            negative=_clip(answers[giver].negative, last),
        )
    return shuffled


def _clip(highlight: Highlight | None, last: int) -> Highlight | None:
    return highlight and replace(highlight, end=min(highlight.end, last))
