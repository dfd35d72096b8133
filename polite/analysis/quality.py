"""How well a learned reward agrees with the true one, and how far two policies differ."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.stats import rankdata

from polite.analysis.numbers import Array, as_json
from polite.analysis.statistics import mean_interval, paired_difference
from polite.types import SegmentPool


def pair_accuracy(learned: Array, true: Array, pairs: npt.NDArray[np.integer[Any]]) -> float:
    """Share of the pairs that both returns order alike; pairs with equal true returns are left out.

    Args:
        learned: (N,) learned return of each segment.
        true: (N,) true return of each segment.
        pairs: (P, 2) indices of the segments compared.
    """
    learned, true = np.asarray(learned, dtype=float), np.asarray(true, dtype=float)
    learned_gap = learned[pairs[:, 0]] - learned[pairs[:, 1]]
    true_gap = true[pairs[:, 0]] - true[pairs[:, 1]]
    told = true_gap != 0.0
    if not told.any():
        return float("nan")
    return float(np.mean(np.sign(learned_gap[told]) == np.sign(true_gap[told])))


def calibration_error(probabilities: Array, outcomes: Array, bins: int = 10) -> float:
    """Expected calibration error: by how much predicted and seen frequencies differ.

    Σ_b n_b / N · |mean predicted − mean seen| over bins of equal width (Guo et al. 2017).

    Args:
        probabilities: (N,) P[σ₁ ≻ σ₂] as predicted.
        outcomes: (N,) 1 where σ₁ is better, 0 where σ₂ is, ½ for a tie.
        bins: of equal width over [0, 1].
    """
    bin_of = np.clip((probabilities * bins).astype(np.int64), 0, bins - 1)
    gaps = np.bincount(bin_of, weights=probabilities - outcomes, minlength=bins)
    return float(np.abs(gaps).sum() / len(probabilities))


def step_correlation(learned: Array, true: Array) -> float:
    """Pearson correlation of two rewards over single steps, both (M,); NaN if one is constant."""
    learned, true = np.asarray(learned, dtype=float), np.asarray(true, dtype=float)
    if np.ptp(learned) == 0.0 or np.ptp(true) == 0.0:  # a rounded std need not be 0
        return float("nan")
    return float(np.corrcoef(learned, true)[0, 1])


def rank_correlation(learned: Array, true: Array) -> float:
    """Spearman correlation of two rewards over single steps, (M,); NaN if one is constant."""
    return step_correlation(rankdata(learned), rankdata(true))


def saturation(learned: Array, bound: float = 0.95) -> float:
    """Share of the steps at which a reward in (−1, 1) is all but at its bounds.

    Args:
        learned: (M,) learned rewards.
        bound: beyond which |r̂| counts.
    """
    return float(np.mean(np.abs(np.asarray(learned, dtype=float)) > bound))


def reward_quality(
    learned: npt.NDArray[np.floating[Any]], pool: SegmentPool, pairs: npt.NDArray[np.integer[Any]]
) -> dict[str, float | None]:
    """How well r̂ orders held-out segments and their steps; None where a measure has no value.

    Args:
        learned: (S, m) r̂ along the pool's segments, anything past their real steps.
        pool: the segments.
        pairs: (P, 2) which of them are compared.
    """
    real = np.where(pool.mask, learned, 0.0).astype(float)
    steps, true = real[pool.mask], pool.rewards[pool.mask]
    numbers = {
        "pair_accuracy": pair_accuracy(real.sum(axis=1), pool.returns, pairs),
        "pearson": step_correlation(steps, true),
        "spearman": rank_correlation(steps, true),
        "saturation": saturation(steps),
    }
    return {name: as_json(value) for name, value in numbers.items()}


def action_distance(first: Array, second: Array) -> Array:
    """Mean L2 distance of two policies' mean actions on shared states: (S, M, v) twice -> (S,)."""
    gap = np.asarray(first, dtype=float) - np.asarray(second, dtype=float)
    return np.asarray(np.linalg.norm(gap, axis=-1).mean(axis=-1))


def policy_difference_part(polite: Array, baseline: Array) -> dict[str, Any]:
    """`policy_difference` of results.json; the null compares baselines of different seeds.

    Args:
        polite: (S, M, v) mean actions of the POLITE policies on M shared states.
        baseline: (S, M, v) mean actions of the baseline policies on the same states.
    """
    between = action_distance(polite, baseline)
    estimate = mean_interval(between)
    null = action_distance(baseline, np.roll(baseline, 1, axis=0))
    if len(baseline) < 2:
        null = null[:0]  # one seed has no other seed to differ from
    return {"per_seed": as_json(between), "null_per_seed": as_json(null)} | estimate.as_json()


def sensitivity_row(
    factor: str,
    level: str,
    pair_accuracy: dict[str, list[float]],
    correlation: dict[str, list[float]],
    spread_ratio: list[float],
) -> dict[str, Any]:
    """One entry of `sensitivity` in results.json: POLITE minus baseline, paired by seed.

    Args:
        factor: What was changed, e.g. "willingness to highlight".
        level: To what, e.g. "half".
        pair_accuracy: One number a seed for "polite" and "baseline", on held-out segments.
        correlation: The same for the step-wise correlation with the true reward.
        spread_ratio: The spread over z of the baseline's map by that of POLITE's, one a seed.
    """
    accuracy_gap = paired_difference(*_both(pair_accuracy)).as_json()
    correlation_gap = paired_difference(*_both(correlation)).as_json()
    return {
        "factor": factor,
        "level": level,
        "pair_accuracy": {name: as_json(values) for name, values in pair_accuracy.items()},
        "correlation": {name: as_json(values) for name, values in correlation.items()},
        "difference": accuracy_gap["mean"],
        "low": accuracy_gap["low"],
        "high": accuracy_gap["high"],
        "correlation_difference": correlation_gap,
        "spread_ratio": as_json(spread_ratio),
    }


def _both(values: dict[str, list[float]]) -> tuple[Array, Array]:
    return np.asarray(values["polite"], dtype=float), np.asarray(values["baseline"], dtype=float)
