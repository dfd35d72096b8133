"""The statistics that the paper draws from the participants' answers."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from polite.analysis.numbers import Array, as_json
from polite.analysis.statistics import (
    Summary,
    chi_square,
    permutation_test,
    variance,
    welch_difference,
    welch_test,
)


def chi_square_part(
    skipped_polite: Array,
    skipped_baseline: Array,
    per_participant: int | tuple[Array, Array],
    rng: np.random.Generator,
) -> dict[str, Any]:
    """`chi_square` of results.json: does the share of "no preference" depend on the condition?

    Args:
        skipped_polite: (N,) "no preference" answers of each participant of the POLITE group.
        skipped_baseline: (N,) the same for the baseline group.
        per_participant: Answers that each participant gave: one number for all, or (N,) for each
            of the POLITE and of the baseline group.
        rng: Draws the regroupings of the permutation test.
    """
    groups = [np.asarray(g, dtype=float) for g in (skipped_baseline, skipped_polite)]
    if isinstance(per_participant, int):
        totals = [np.full(g.shape, float(per_participant)) for g in groups]
    else:
        totals = [np.asarray(total, dtype=float) for total in per_participant[::-1]]
    counts = [
        int(n) for g, total in zip(groups, totals, strict=True) for n in (g.sum(), total.sum())
    ]
    corrected = chi_square(*counts, yates=True)
    plain = chi_square(*counts, yates=False)
    baseline, polite = (g / total for g, total in zip(groups, totals, strict=True))
    cluster = permutation_test(baseline, polite, rng)
    interval = welch_difference(baseline, polite)
    return {
        "statistic": as_json(corrected.statistic),
        "p_value": as_json(corrected.p_value),
        "yates": True,
        "uncorrected": {
            "statistic": as_json(plain.statistic),
            "p_value": as_json(plain.p_value),
        },
        "cluster": {
            "method": "permutation of whole participants; statistic: baseline minus POLITE rate",
            "statistic": as_json(cluster.statistic),
            "p_value": as_json(cluster.p_value),
        }
        | {name: interval.as_json()[name] for name in ("low", "high")},
    }


def times_part(polite: Array, baseline: Array) -> dict[str, Any]:
    """`times` of results.json: minutes a participant, tutorial included, with Welch's t test."""
    groups = {"polite": np.asarray(polite, dtype=float), "baseline": np.asarray(baseline, float)}
    summary = {name: summarise(minutes) for name, minutes in groups.items()}
    test = welch_test(summary["polite"], summary["baseline"])
    return {name: asdict(group) for name, group in summary.items()} | {
        "increase": summary["polite"].mean / summary["baseline"].mean - 1.0,
        "difference": welch_difference(groups["polite"], groups["baseline"]).as_json(),
        "welch_t": as_json(test.statistic),
        "p_value": as_json(test.p_value),
    }


def summarise(values: Array) -> Summary:
    """Mean, sample standard deviation (0 for a single value) and size of a sample (N,)."""
    sd = float(np.sqrt(variance(values))) if values.size > 1 else 0.0
    return Summary(float(values.mean()), sd, values.size)
