"""Several runs in one number: interquartile mean, probability of improvement, bootstrap intervals.

After Agarwal, Schwarzer, Castro, Courville and Bellemare, "Deep reinforcement learning at the edge
of the statistical precipice", NeurIPS 2021 (their library is rliable). These numbers describe; what
judges a claim is Welch's t, because a percentile bootstrap over few runs is too narrow. Measured on
normal values, its 95% interval holds the mean of five in 84% of the cases, of ten in 89%, and the
difference of two means of five in 88%.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from polite.analysis.numbers import Array
from polite.analysis.statistics import LEVEL, Estimate

DRAWS = 2000
"""Bootstrap samples of an interval (rliable's number)."""


def interquartile_mean(values: Array) -> Array:
    """Mean of the middle half along the last axis: (..., n) -> (...).

    A quarter of the values, rounded down, is cut off at each end; of fewer than four none is, so
    that it is the plain mean. NaN where there is no value.
    """
    values = np.sort(np.asarray(values, dtype=float), axis=-1)
    count = values.shape[-1]
    if count == 0:
        return np.full(values.shape[:-1], np.nan)
    cut = count // 4
    return np.asarray(values[..., cut : count - cut].mean(axis=-1))


def bootstrap_interval(
    strata: Sequence[Array],
    statistic: Callable[[Array], Array],
    rng: np.random.Generator,
    draws: int = DRAWS,
) -> Estimate:
    """A statistic of all runs together, with its stratified percentile bootstrap interval.

    Runs are drawn again with replacement within each stratum, so that each keeps its size. With
    fewer than two runs in a stratum the interval is unbounded.

    Args:
        strata: one array of values for each task; a single one for a single cell.
        statistic: maps (..., n) to (...).
        rng: draws the samples.
        draws: how many.
    """
    strata = [np.asarray(values, dtype=float) for values in strata]
    everyone = np.concatenate(strata) if strata else np.zeros(0)
    value = float(statistic(everyone)) if everyone.size else np.nan
    if not strata or min(values.size for values in strata) < 2:
        return Estimate(value, -np.inf, np.inf)
    drawn = statistic(np.concatenate([_resample(v, rng, draws) for v in strata], axis=1))
    return _percentiles(value, drawn)


def probability_of_improvement(
    pairs: Sequence[tuple[Array, Array]], rng: np.random.Generator, draws: int = DRAWS
) -> Estimate:
    """P(X > Y), ties counted half, averaged over tasks, with its stratified bootstrap interval.

    The Mann–Whitney U statistic over the number of pairs of runs. With fewer than two runs on a
    side the interval is unbounded; without any the value is NaN. When all runs of X lie above all
    of Y the interval is [1, 1], however few they are: a bootstrap sees no run but those there are.

    Args:
        pairs: (X, Y) for each task, the runs' values.
        rng: draws the samples.
        draws: how many.
    """
    pairs = [(np.asarray(x, dtype=float), np.asarray(y, dtype=float)) for x, y in pairs]
    smallest = min((min(x.size, y.size) for x, y in pairs), default=0)
    if smallest < 1:
        return Estimate(np.nan, -np.inf, np.inf)
    value = float(np.mean([_superiority(x, y) for x, y in pairs]))
    if smallest < 2:
        return Estimate(value, -np.inf, np.inf)
    drawn = [_superiority(_resample(x, rng, draws), _resample(y, rng, draws)) for x, y in pairs]
    return _percentiles(value, np.mean(drawn, axis=0))


def normalised(returns: Array, untrained: Array, ceiling: Array) -> Array:
    """(return − untrained) / (ground truth − untrained): 0 is a random reward, 1 the true one.

    Args:
        returns: (n,) final returns of a cell.
        untrained: (u,) those of policies trained on an untrained reward model; their mean is used.
        ceiling: (c,) those of policies trained on the true reward; their mean is used.

    Returns:
        (n,) scores, NaN unless both means exist and the second is the larger.
    """
    returns = np.asarray(returns, dtype=float)
    if min(np.size(untrained), np.size(ceiling)) == 0:
        return np.full(returns.shape, np.nan)
    floor, top = float(np.mean(untrained)), float(np.mean(ceiling))
    return np.asarray((returns - floor) / (top - floor) if top > floor else returns * np.nan)


def _superiority(x: Array, y: Array) -> Array:
    """P(X > Y) + P(X = Y) / 2 over all pairs: (..., n) and (..., m) -> (...)."""
    gaps = np.sign(x[..., :, None] - y[..., None, :])
    return np.asarray((gaps.mean(axis=(-2, -1)) + 1) / 2)


def _resample(values: Array, rng: np.random.Generator, draws: int) -> Array:
    """(draws, n) samples with replacement."""
    return np.asarray(values[rng.integers(values.size, size=(draws, values.size))])


def _percentiles(value: float, drawn: Array) -> Estimate:
    tail = (1 - LEVEL) / 2
    low, high = np.quantile(drawn, [tail, 1 - tail])
    return Estimate(value, float(low), float(high))
