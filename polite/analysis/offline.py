"""The numbers of the offline bench: each candidate against preferences alone, trial by trial."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from polite.analysis.numbers import Array, as_array, as_json
from polite.analysis.statistics import mean_interval, paired_difference

Trials = Sequence[Mapping[str, Any]]

MEASURES: Final = ("pair_accuracy", "spearman", "pearson", "saturation", "calibration_error")
STAGES: Final = ("early", "late")
DECIDING_BUDGET = 200
"""Queries at which the candidates are ranked, or the largest budget below if there is none."""
RULE = (
    "At 200 queries, on segments of later stages: first by the mean over the envs of the step-wise "
    "rank correlation with the true reward; a candidate whose pair accuracy is below that of "
    "preferences alone in any env (the whole 95% interval of the paired difference below 0) is "
    "not eligible. Candidates with more marks, networks or noise than one answer, one network and "
    "a careful teacher are shown, and not ranked."
)
"""Which candidate is the best; written before the run that is landed."""


def summarise_trials(trials: Trials, ranked: Mapping[str, bool]) -> dict[str, Any]:
    """`rows`, one for each env, budget and candidate, and `ranking`.

    Args:
        trials: for each `env`, `candidate`, `queries`, `seed`, "early" and "late" with the
            MEASURES, and "answers".
        ranked: the candidates in their order, and whether each takes part in the ranking; the
            first is what the others are compared with.
    """
    names = list(ranked)
    cells: dict[tuple[str, int, str], Trials] = {}
    for trial in trials:
        key = (trial["env"], trial["queries"], trial["candidate"])
        cells[key] = [*cells.get(key, ()), trial]
    rows = [
        _row(env, queries, name, cells[env, queries, name], cells[env, queries, names[0]])
        for env, queries, name in sorted(
            cells, key=lambda key: (key[0], key[1], names.index(key[2]))
        )
    ]
    return {"rows": rows, "rule": RULE, "ranking": rank(rows, ranked)}


def rank(rows: Trials, ranked: Mapping[str, bool]) -> list[dict[str, Any]]:
    """Candidates by RULE, the best first; the eligible before the others."""
    budgets = [row["queries"] for row in rows if row["queries"] <= DECIDING_BUDGET]
    budget = max(budgets, default=0)
    entries = []
    for name in (name for name, takes_part in ranked.items() if takes_part):
        own = [row for row in rows if row["candidate"] == name and row["queries"] == budget]
        score = float(np.mean([as_array(row["late"]["spearman"]["mean"]) for row in own]))
        gaps = [as_array(row["late"]["pair_accuracy"]["difference"]["high"]) for row in own]
        eligible = not any(gap < 0 for gap in gaps)
        entries.append({"candidate": name, "score": as_json(score), "eligible": eligible})
    return sorted(entries, key=lambda entry: (not entry["eligible"], -as_array(entry["score"])))


def _row(env: str, queries: int, name: str, own: Trials, baseline: Trials) -> dict[str, Any]:
    """Means with 95% t intervals, and paired differences from the baseline's trials."""
    row: dict[str, Any] = {"env": env, "queries": queries, "candidate": name, "n": len(own)}
    for share in ("positive", "negative"):
        row[share] = as_json(as_array([trial["answers"][share] for trial in own]).mean())
    for stage in STAGES:
        row[stage] = {
            measure: _measure(_values(own, stage, measure), _values(baseline, stage, measure))
            for measure in MEASURES
        }
    return row


def _measure(own: Array, baseline: Array) -> dict[str, Any]:
    difference = paired_difference(own, baseline)
    return mean_interval(own).as_json() | {"difference": difference.as_json()}


def _values(trials: Trials, stage: str, measure: str) -> Array:
    ordered = sorted(trials, key=lambda trial: int(trial["seed"]))
    return as_array([trial[stage][measure] for trial in ordered])
