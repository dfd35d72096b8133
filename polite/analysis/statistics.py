"""Means with t intervals, Welch's test, and tests of a two-by-two table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from polite.analysis.numbers import Array, as_json
from polite.types import ShapeError

LEVEL = 0.95
"""Coverage of every interval."""
ROUNDING = 1e-12
"""Values that differ by no more than this, of the largest one, are equal."""


@dataclass(frozen=True)
class Estimate:
    """A number with its 95% interval; infinite bounds where the data cannot bound it."""

    mean: float
    low: float
    high: float

    def as_json(self) -> dict[str, Any]:
        """`{mean, low, high}` with null for an unbounded side."""
        return {"mean": as_json(self.mean), "low": as_json(self.low), "high": as_json(self.high)}


@dataclass(frozen=True)
class Band:
    """A curve (E,) with its pointwise 95% t interval over seeds."""

    mean: Array
    low: Array
    high: Array


@dataclass(frozen=True)
class Test:
    """A test statistic with its two-sided p-value."""

    __test__ = False  # not a test case, whatever pytest makes of the name

    statistic: float
    p_value: float


@dataclass(frozen=True)
class Summary:
    """What a paper prints of a sample."""

    mean: float
    sd: float
    count: int


def mean_interval(values: Array) -> Estimate:
    """Mean of n values with its t interval.

    Unbounded for fewer than two values, and where all are equal: that everybody gave the same says
    nothing about how far others would lie off.
    """
    values = np.asarray(values, dtype=float)
    if values.size < 2 or not (squared := variance(values)):
        return Estimate(float(values.mean()) if values.size else np.nan, -np.inf, np.inf)
    return _interval(float(values.mean()), float(np.sqrt(squared / values.size)), values.size - 1)


def paired_difference(first: Array, second: Array) -> Estimate:
    """Mean of first − second, paired entry by entry (the same seed in both), paired t interval.

    Raises:
        ShapeError: if the two are not of one length.
    """
    first, second = _pairs(first, second)
    return mean_interval(first - second)


def paired_ratio(first: Array, second: Array) -> Estimate:
    """Geometric mean of first / second, paired entry by entry, t interval of the log ratio.

    Raises:
        ShapeError: if the two are not of one length.
    """
    first, second = _pairs(first, second)
    with np.errstate(divide="ignore", invalid="ignore"):
        logs = np.log(first) - np.log(second)
    if not np.isfinite(logs).all():
        return Estimate(np.nan, -np.inf, np.inf)
    log = mean_interval(logs)
    with np.errstate(over="ignore"):
        return Estimate(*(float(np.exp(bound)) for bound in (log.mean, log.low, log.high)))


def welch_difference(first: Array, second: Array) -> Estimate:
    """Mean of first minus mean of second, independent samples, by Welch's t interval.

    With fewer than two values in a sample the interval is unbounded.
    """
    return welch_contrast([first, second], [1.0, -1.0])


def welch_contrast(samples: Sequence[Array], weights: Sequence[float]) -> Estimate:
    """A weighted sum of the means of independent samples, by Welch's t interval.

    The degrees of freedom are Satterthwaite's (1946). With an empty sample there is no mean; with
    one of a single value the interval is unbounded, and so it is where no sample has any spread.
    """
    arrays = [np.asarray(sample, dtype=float) for sample in samples]
    counts = np.array([array.size for array in arrays])
    if counts.min() < 1:
        return Estimate(np.nan, -np.inf, np.inf)
    mean = float(sum(w * array.mean() for w, array in zip(weights, arrays, strict=True)))
    if counts.min() < 2:
        return Estimate(mean, -np.inf, np.inf)
    parts = np.array([w**2 * variance(a) / a.size for w, a in zip(weights, arrays, strict=True)])
    if parts.sum() == 0.0:
        return Estimate(mean, -np.inf, np.inf)
    return _interval(mean, float(np.sqrt(parts.sum())), _welch_degrees(parts, counts))


def ratio_of_means(first: Array, second: Array) -> Estimate:
    """Mean of first by mean of second, independent samples, by Fieller's interval (1954).

    The variances may differ: the degrees of freedom are Satterthwaite's at the ratio found
    (Hasler, Vonk and Hothorn, Statistics in Medicine 27, 2008). A ratio to a mean at or below 0
    says nothing, so that it is NaN; where the second mean is not told apart from 0 by its own
    error, or neither sample has any spread, no bound exists.
    """
    first, second = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    if min(first.size, second.size) < 1 or second.mean() <= 0.0:
        return Estimate(np.nan, -np.inf, np.inf)
    ratio = float(first.mean() / second.mean())
    if min(first.size, second.size) < 2:
        return Estimate(ratio, -np.inf, np.inf)
    errors = np.array([variance(sample) / sample.size for sample in (first, second)])
    if errors.sum() == 0.0:
        return Estimate(ratio, -np.inf, np.inf)
    degrees = _welch_degrees(errors * [1.0, ratio**2], np.array([first.size, second.size]))
    top, bottom = errors * float(stats.t.ppf((1 + LEVEL) / 2, degrees)) ** 2
    # The bounds solve (m1 − ρ m2)² = t² (v1 + ρ² v2), a quadratic in ρ.
    square = float(second.mean() ** 2 - bottom)
    if square <= 0.0:
        return Estimate(ratio, -np.inf, np.inf)
    half = float(first.mean() * second.mean())
    root = float(np.sqrt(max(half**2 - square * (first.mean() ** 2 - top), 0.0)))
    return Estimate(ratio, (half - root) / square, (half + root) / square)


def welch_test(first: Summary, second: Summary) -> Test:
    """Welch's t test from two samples' means, standard deviations and sizes.

    There is none, and statistic and p-value are NaN, with fewer than two values in a sample, or for
    means that differ where neither sample has any spread.
    """
    if min(first.count, second.count) < 2:
        return Test(np.nan, np.nan)
    parts = np.array([s.sd**2 / s.count for s in (first, second)])
    gap = first.mean - second.mean
    if parts.sum() == 0.0:
        return Test(0.0, 1.0) if gap == 0.0 else Test(np.nan, np.nan)
    statistic = gap / float(np.sqrt(parts.sum()))
    degrees = _welch_degrees(parts, np.array([first.count, second.count]))
    return Test(statistic, float(2 * stats.t.sf(abs(statistic), degrees)))


def variance(values: Array) -> float:
    """Sample variance of two values or more; exactly 0 where they are equal but for rounding."""
    values = np.asarray(values, dtype=float)
    if np.ptp(values) <= ROUNDING * np.abs(values).max():
        return 0.0
    return float(values.var(ddof=1))


def mean_band(values: Array) -> Band:
    """Pointwise mean and t interval over seeds: (S, E) -> three curves (E,).

    Unbounded for a single seed. Where all seeds agree it has no width, as at a curve's beginning.
    """
    values = np.asarray(values, dtype=float)
    estimates = [mean_interval(column) for column in values.T]
    mean, low, high = np.reshape([(e.mean, e.low, e.high) for e in estimates], (-1, 3)).T
    agreed = np.isinf(low) & (len(values) > 1)
    return Band(mean, np.where(agreed, mean, low), np.where(agreed, mean, high))


def share_interval(count: int, total: int) -> Estimate:
    """Share count / total with Wilson's interval (1927); it takes the answers as independent."""
    if total == 0:
        return Estimate(np.nan, -np.inf, np.inf)
    interval = stats.binomtest(count, total).proportion_ci(LEVEL, method="wilson")
    return Estimate(count / total, float(interval.low), float(interval.high))


def chi_square(count_1: int, total_1: int, count_2: int, total_2: int, *, yates: bool) -> Test:
    """Pearson's χ² test of two shares, with or without Yates' continuity correction.

    Two shares that are both 0 or both 1 leave nothing to test: statistic 0, p = 1. Neither does a
    share of nothing: both NaN.
    """
    if min(total_1, total_2) == 0:
        return Test(np.nan, np.nan)
    table = np.array([[count_1, total_1 - count_1], [count_2, total_2 - count_2]])
    if (table.sum(axis=0) == 0).any():
        return Test(0.0, 1.0)
    result = stats.chi2_contingency(table, correction=yates)
    return Test(float(result.statistic), float(result.pvalue))


def permutation_test(
    first: Array, second: Array, rng: np.random.Generator, draws: int = 10_000
) -> Test:
    """Difference of the participants' mean rates, against regrouping whole participants at random.

    Answers of one participant depend on one another; participants do not, so they are what is
    exchanged. p = (1 + draws at least as far from 0) / (1 + draws), two-sided.

    Args:
        first: (N1,) one rate a participant.
        second: (N2,) one rate a participant.
        rng: Draws the regroupings.
        draws: Number of regroupings.

    Returns:
        The difference and its p-value; NaN for both if a group is empty or a rate is not known.
    """
    first, second = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    if min(first.size, second.size) < 1 or not np.isfinite([*first, *second]).all():
        return Test(np.nan, np.nan)
    gap = float(first.mean() - second.mean())
    everyone = np.tile(np.concatenate([first, second]), (draws, 1))
    regrouped = rng.permuted(everyone, axis=1)
    gaps = regrouped[:, : first.size].mean(axis=1) - regrouped[:, first.size :].mean(axis=1)
    as_far = np.count_nonzero(np.abs(gaps) >= abs(gap) - 1e-12)
    return Test(gap, float(1 + as_far) / (1 + draws))


def _pairs(first: Array, second: Array) -> tuple[Array, Array]:
    first, second = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    if first.shape != second.shape:
        raise ShapeError(f"expected pairs, got {first.shape} and {second.shape} values")
    return first, second


def _interval(mean: float, error: float, degrees: float) -> Estimate:
    reach = float(stats.t.ppf((1 + LEVEL) / 2, degrees)) * error
    return Estimate(mean, mean - reach, mean + reach)


def _welch_degrees(parts: Array, counts: Array) -> float:
    """Welch–Satterthwaite degrees of freedom; parts are squared errors of means, not all 0."""
    shares = parts / parts.sum()  # first, because squares of tiny variances are 0
    return float(1 / np.sum(shares**2 / (counts - 1)))
