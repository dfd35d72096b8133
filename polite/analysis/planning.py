"""How many runs, queries and people a study needs for an effect that it shall be able to see."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from polite.analysis.published import PUBLISHED
from polite.types import InvalidValueError

SIGNIFICANCE = 0.05
"""Two-sided."""
POWER = 0.8
"""Chance to see an effect that is there, by default."""
BENCHMARK_ACCURACY = 0.9
"""Share of right answers of the benchmark's teacher, who flips 10% of the preferences."""
MOST = 10_000_000
"""Largest sample that is looked for."""


@dataclass(frozen=True)
class StudyPlan:
    """A study with people, as far as numbers can say."""

    queries: int
    """Answers in each condition, after the pilot's noise is allowed for."""
    participants: int
    """People in each condition."""
    queries_per_participant: int
    """Answers of one person."""
    minutes_per_participant: float
    """Time of one person, tutorial included."""
    hours: float
    """Time of all people in one condition."""
    design_effect: float
    """By how much answers of the same people widen a variance."""
    effective_queries: float
    """Independent answers that would say as much as this many of the same people do."""
    power: float | None
    """Chance to tell the two shares apart with this many answers; None without shares."""
    participants_for_power: int | None
    """People in each condition for the power asked for; None without shares."""
    runs_per_cell: int | None
    """Training runs of each condition for the effect on returns; None without an effect."""


def t_test_power(effect: float, count: int, significance: float = SIGNIFICANCE) -> float:
    """Power of a two-sided two-sample t test with equal groups, by the noncentral t distribution.

    Args:
        effect: difference of the means in standard deviations (Cohen's d).
        count: n of each group, at least 2.
        significance: chance of seeing an effect that is not there.
    """
    _expect(count >= 2, "count ≥ 2", count)
    degrees = 2 * count - 2
    shift = effect * math.sqrt(count / 2)
    bound = float(stats.t.ppf(1 - significance / 2, degrees))
    tails = stats.nct.sf(bound, degrees, shift), stats.nct.cdf(-bound, degrees, shift)
    return float(np.nansum(tails))  # far in the wrong tail SciPy's cdf is NaN instead of 0


def runs_for_effect(effect: float, power: float = POWER, significance: float = SIGNIFICANCE) -> int:
    """Runs (or people) of each group until a two-sample t test sees an effect with this power.

    Args:
        effect: difference of the means in standard deviations, not 0.
        power: chance to see it.
        significance: chance of seeing one that is not there.
    """
    _expect(effect != 0 and math.isfinite(effect), "a finite effect other than 0", effect)
    _expect_share("power", power)
    size = abs(effect)
    return _smallest(lambda n: t_test_power(size, n, significance) >= power, 2)


def shares_power(
    first: float, second: float, count: float, significance: float = SIGNIFICANCE
) -> float:
    """Power to tell two shares apart with so many independent answers in each group.

    The normal approximation of the test with a pooled variance, without continuity correction
    (Fleiss, Levin and Paik, Statistical Methods for Rates and Proportions, chapter 4).
    """
    _expect_share("first", first)
    _expect_share("second", second)
    pooled = (first + second) / 2
    null = math.sqrt(2 * pooled * (1 - pooled))
    spread = math.sqrt(first * (1 - first) + second * (1 - second))
    reach = abs(first - second) * math.sqrt(count)
    return float(
        stats.norm.cdf((reach - float(stats.norm.ppf(1 - significance / 2)) * null) / spread)
    )


def answers_for_shares(
    first: float, second: float, power: float = POWER, significance: float = SIGNIFICANCE
) -> int:
    """Independent answers in each group until two shares are told apart with this power."""
    _expect(first != second, "two different shares", (first, second))
    _expect_share("power", power)
    return _smallest(lambda n: shares_power(first, second, n, significance) >= power, 1)


def design_effect(answers_each: float, correlation: float) -> float:
    """1 + (m − 1) ICC: by how much m answers of each person widen a variance (Kish, 1965).

    Args:
        answers_each: m, answers of one person.
        correlation: ICC, correlation of two answers of one person, in [0, 1].
    """
    _expect(answers_each >= 1, "answers_each ≥ 1", answers_each)
    _expect(0 <= correlation <= 1, "an intraclass correlation in [0, 1]", correlation)
    return 1 + (answers_each - 1) * correlation


def accuracy_from_agreement(agreement: float) -> float:
    """Share of right answers of raters who agree with one another on a share of the queries.

    Two raters who are right independently with probability p agree with p² + (1 − p)², so that
    p = (1 + √(2A − 1)) / 2. The same holds for one rater asked twice. Raters who share a mistake
    agree more than that, so that p is an upper bound for them.

    Args:
        agreement: A, in (.5, 1].
    """
    _expect(0.5 < agreement <= 1, "an agreement in (.5, 1]", agreement)
    return (1 + math.sqrt(2 * agreement - 1)) / 2


def queries_for_accuracy(queries: float, accuracy: float, known: float = BENCHMARK_ACCURACY) -> int:
    """Queries that people need where a teacher of known accuracy needed so many.

    With a share η of the labels flipped, the number of examples that learning needs grows as
    1 / (1 − 2η)² (Angluin and Laird, Learning from Noisy Examples, 1988). It is a rule of thumb:
    mistakes of people are not spread evenly over queries.

    Args:
        queries: what the benchmark's teacher needed.
        accuracy: share of right answers of the people, in (.5, 1].
        known: that of the benchmark's teacher, in (.5, 1].
    """
    for share in (accuracy, known):
        _expect(0.5 < share <= 1, "a share of right answers in (.5, 1]", share)
    return _ceil(queries * ((2 * known - 1) / (2 * accuracy - 1)) ** 2)


def minutes_each(queries_per_participant: int, *, highlights: bool) -> float:
    """Minutes of a person, from the paper's 24.83 (with highlights) and 18.93 for 20 queries.

    The paper's times include its tutorial; here they are scaled with the number of queries, so that
    longer sessions are overestimated and shorter ones underestimated.
    """
    _expect(queries_per_participant >= 1, "queries_per_participant ≥ 1", queries_per_participant)
    minutes = PUBLISHED["times"]["polite" if highlights else "baseline"]["mean"]
    return float(minutes * queries_per_participant / PUBLISHED["queries_per_participant"])


def plan_study(
    queries: int,
    *,
    highlights: bool = True,
    queries_per_participant: int = 20,
    agreement: float | None = None,
    correlation: float = 0.0,
    shares: tuple[float, float] | None = None,
    effect: float | None = None,
    power: float = POWER,
) -> StudyPlan:
    """People and hours for a number of queries, and what such a study could see.

    Args:
        queries: answers in each condition, for instance from a benchmark's queries to reach.
        highlights: whether people mark highlights, which takes 31% longer.
        queries_per_participant: answers of one person.
        agreement: share of pilot queries on which two people, or one asked twice, agree; None to
            take the benchmark's teacher for granted.
        correlation: intraclass correlation of the answers of one person.
        shares: two shares to tell apart, for instance of "no preference" in two conditions.
        effect: difference of final returns in standard deviations over runs.
        power: chance to see the effect, or the shares' difference.

    Raises:
        InvalidValueError: naming the value that is out of its range.
    """
    _expect(queries >= 1, "queries ≥ 1", queries)
    if agreement is not None:
        queries = queries_for_accuracy(queries, accuracy_from_agreement(agreement))
    minutes = minutes_each(queries_per_participant, highlights=highlights)
    participants = _ceil(queries / queries_per_participant)
    inflation = design_effect(queries_per_participant, correlation)
    effective = participants * queries_per_participant / inflation
    needed = None if shares is None else answers_for_shares(*shares, power) * inflation
    return StudyPlan(
        queries=queries,
        participants=participants,
        queries_per_participant=queries_per_participant,
        minutes_per_participant=minutes,
        hours=participants * minutes / 60,
        design_effect=inflation,
        effective_queries=effective,
        power=None if shares is None else shares_power(*shares, effective),
        participants_for_power=None if needed is None else _ceil(needed / queries_per_participant),
        runs_per_cell=None if effect is None else runs_for_effect(effect, power),
    )


def _smallest(enough: Callable[[int], bool], least: int) -> int:
    """The smallest integer that is enough, for a condition that stays true once it is."""
    high = least
    while not enough(high):
        high *= 2
        if high > MOST:
            raise InvalidValueError(
                f"expected an effect that {MOST:,} of each group could show, got a smaller one; "
                "plan for a larger effect"
            )
    low = max(least, high // 2)
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if enough(middle) else (middle + 1, high)
    return high


def _ceil(value: float) -> int:
    return math.ceil(value - 1e-9)  # 180.00000000000003 is 180


def _expect_share(name: str, share: float) -> None:
    _expect(0 < share < 1, f"{name} in (0, 1)", share)


def _expect(fulfilled: bool, what: str, value: Any) -> None:
    if not fulfilled:
        raise InvalidValueError(f"expected {what}, got {value}")
