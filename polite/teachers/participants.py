"""What simulated participants answer. They are not people, and every output must say so."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import log, sqrt

import numpy as np

from polite.teachers.highlights import passes_sign_test, released_candidate
from polite.teachers.population import (
    BASELINE,
    POLITE,
    Participant,
    PopulationConfig,
    calibrated_inputs,
    draw_population,
    lognormal,
)
from polite.types import (
    EQUAL,
    FIRST,
    SECOND,
    UNRELATED,
    Answer,
    Floats64,
    Highlight,
    Integers,
    InvalidValueError,
    Query,
    SegmentPool,
)

__all__ = [
    "BASELINE",
    "POLITE",
    "Participant",
    "PopulationConfig",
    "answer_queries",
    "calibrated_inputs",
    "draw_population",
    "total_minutes",
]


@dataclass(frozen=True, eq=False)
class _Moments:
    """The moment of every segment that is most worth a highlight of one sign, (S,) each."""

    ends: Integers
    share_better: Floats64
    """Share of the study's better segments that have a better moment; 1 if the sign is wrong."""


@dataclass(frozen=True, eq=False)
class _Study:
    """The study's pairs (Q,) and moments, seen side by side."""

    pool: SegmentPool
    queries: Sequence[Query]
    differences: Floats64
    """First true return minus second, per standard deviation over the pool."""
    share_closer: Floats64
    """Share of the pairs that are harder to tell apart."""
    moments: dict[int, _Moments]
    """For h⁺ (+1) and h⁻ (−1)."""


def answer_queries(
    participants: Sequence[Participant],
    pool: SegmentPool,
    queries: Sequence[Query],
    rng: np.random.Generator,
    config: PopulationConfig,
) -> list[Answer]:
    """Let the participants answer the study's queries, each a block of `config.answers` in a row.

    A participant skips the share `skip_rate` of pairs whose true returns differ least. The others
    are compared by Boltzmann choice, or by a coin when attention slips. On the segment that was
    preferred, the best (worst) moment is marked if it is among the share `positive_rate`
    (`negative_rate`) of the best (worst) moments of the pairs' better segments and its window sums
    above (below) 0; the mark lies a step or two off.

    Args:
        participants: who answers.
        pool: the segments with their true rewards.
        queries: the study's list of pairs, `config.answers` for each participant.
        rng: source of all chance.
        config: the condition.

    Raises:
        InvalidValueError: if the number of queries does not fit that of the participants.
    """
    if len(queries) != len(participants) * config.answers:
        raise InvalidValueError(
            f"expected {config.answers} queries for each of {len(participants)} participants, "
            f"got {len(queries)}"
        )
    study = _compare(pool, queries, config)
    return [
        _answer(study, index, index // config.answers, participants, rng, config)
        for index in range(len(queries))
    ]


def total_minutes(answers: Sequence[Answer], config: PopulationConfig) -> Floats64:
    """Each participant's duration of the study, tutorial included [min], (participants,)."""
    people = [answer.participant for answer in answers]
    seconds = np.bincount(people, weights=[answer.seconds for answer in answers])
    return config.tutorial_minutes + np.asarray(seconds, dtype=np.float64) / 60


def _compare(pool: SegmentPool, queries: Sequence[Query], config: PopulationConfig) -> _Study:
    pairs = np.array([(query.first, query.second) for query in queries])
    returns = pool.returns[pairs]  # (Q, 2)
    differences = returns[:, 0] - returns[:, 1]
    better = pairs[np.arange(len(pairs)), (differences < 0).astype(int)]
    return _Study(
        pool=pool,
        queries=queries,
        differences=differences / (float(pool.returns.std()) or 1.0),
        share_closer=_share_below(abs(differences), abs(differences)),
        moments={sign: _moments(pool, better, sign, config.highlight_length) for sign in (1, -1)},
    )


def _moments(pool: SegmentPool, better: Integers, sign: int, length: int) -> _Moments:
    ends = np.zeros(len(pool), dtype=np.int64)
    badness = np.full(len(pool), np.inf)  # infinite where the sign is wrong
    for index, steps in enumerate(pool.lengths):
        rewards = pool.rewards[index, :steps]
        end, score = released_candidate(rewards, sign, length)
        ends[index] = end
        if passes_sign_test(rewards, Highlight(end, length), sign):
            badness[index] = -sign * score
    share_better = _share_below(badness, badness[better])
    return _Moments(ends, np.where(np.isfinite(badness), share_better, 1.0))


def _share_below(values: Floats64, reference: Floats64) -> Floats64:
    """Share of the reference that is strictly smaller than each value."""
    below = np.searchsorted(np.sort(reference), values, side="left")
    return np.asarray(below / len(reference), dtype=np.float64)


def _answer(
    study: _Study,
    index: int,
    person: int,
    participants: Sequence[Participant],
    rng: np.random.Generator,
    config: PopulationConfig,
) -> Answer:
    participant = participants[person]
    seconds = _draw_seconds(participant, config, rng)
    if study.share_closer[index] < participant.skip_rate:
        tie = EQUAL if rng.random() < config.equal_share else UNRELATED
        return Answer(index, tie, participant=person, seconds=seconds)
    first = _prefers_first(float(study.differences[index]), participant, rng)
    query = study.queries[index]
    segment = query.first if first else query.second
    rates = {+1: participant.positive_rate, -1: participant.negative_rate}
    positive, negative = (
        _highlight(study, segment, sign, rates[sign], rng, config) for sign in (+1, -1)
    )
    preference = FIRST if first else SECOND
    return Answer(index, preference, positive, negative, participant=person, seconds=seconds)


def _prefers_first(difference: float, participant: Participant, rng: np.random.Generator) -> bool:
    """Boltzmann choice, P = sigmoid(β ΔR / sd), or a coin toss when attention slips."""
    if rng.random() < participant.slip_rate:
        return bool(rng.random() < 0.5)
    # rng.logistic() < x has probability sigmoid(x), and never overflows.
    return bool(rng.logistic() < participant.rationality * difference)


def _highlight(
    study: _Study,
    segment: int,
    sign: int,
    rate: float,
    rng: np.random.Generator,
    config: PopulationConfig,
) -> Highlight | None:
    moments = study.moments[sign]
    if not config.highlights or moments.share_better[segment] >= rate:
        return None
    jitter = int(rng.integers(1, config.jitter, endpoint=True) * rng.choice([-1, 1]))
    last = int(study.pool.lengths[segment]) - 1
    end = min(max(int(moments.ends[segment]) + jitter, 0), last)
    return Highlight(end, config.highlight_length)


def _draw_seconds(
    participant: Participant, config: PopulationConfig, rng: np.random.Generator
) -> float:
    spread = sqrt(log(1 + config.pace_variation**2))
    median = participant.seconds * np.exp(-(spread**2) / 2)  # so that the mean is `seconds`
    return float(lognormal(rng, median, spread, 1)[0])
