"""How well a learned reward agrees with the true one, and how far two policies differ."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.stats import rankdata

from polite.analysis.numbers import Array, as_json
from polite.analysis.statistics import mean_interval, paired_difference


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


def step_correlation(learned: Array, true: Array) -> float:
    """Pearson correlation of two rewards over single steps, both (M,); NaN if one is constant."""
    learned, true = np.asarray(learned, dtype=float), np.asarray(true, dtype=float)
    if learned.std() == 0.0 or true.std() == 0.0:
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
