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
"""Queries at which the candidates are ranked (see `deciding_budget`)."""
RULE = (
    "At 200 queries, on segments of later stages: first by the mean over the envs of the step-wise "
    "rank correlation with the true reward; a candidate whose pair accuracy is below that of "
    "preferences alone in any env (the whole 95% interval of the paired difference below 0) is "
    "not eligible. Candidates with more marks, networks or noise than one answer, one network and "
    "a careful teacher, or with fewer epochs, are shown, and not ranked."
)
"""Which candidate is the best; written before the run that is landed, whose rule has no word on
epochs."""


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
    if not rows:
        return []
    entries = []
    budget = deciding_budget(rows)
    for name in (name for name, takes_part in ranked.items() if takes_part):
        own = [row for row in rows if row["candidate"] == name and row["queries"] == budget]
        score = float(np.mean([as_array(row["late"]["spearman"]["mean"]) for row in own]))
        gaps = [row["late"]["pair_accuracy"]["difference"] for row in own]
        eligible = not any(gap["mean"] is None or as_array(gap["high"]) < 0 for gap in gaps)
        entries.append({"candidate": name, "score": as_json(score), "eligible": eligible})
    return sorted(entries, key=_place)


def deciding_budget(rows: Trials) -> int:
    """Queries at which candidates are ranked: 200, the largest budget below, or the smallest."""
    budgets = {int(row["queries"]) for row in rows}
    return max((b for b in budgets if b <= DECIDING_BUDGET), default=min(budgets))


def _place(entry: Mapping[str, Any]) -> tuple[bool, bool, float]:
    """Sorts the eligible first, then by score; what has no score comes last."""
    score = entry["score"]
    return not entry["eligible"], score is None, -score if score is not None else 0.0


def _row(env: str, queries: int, name: str, own: Trials, baseline: Trials) -> dict[str, Any]:
    """Means with 95% t intervals, and paired differences from the baseline's trials."""
    row: dict[str, Any] = {"env": env, "queries": queries, "candidate": name, "n": len(own)}
    for share in ("positive", "negative"):
        row[share] = as_json(as_array([trial["answers"][share] for trial in own]).mean())
    paired = _of_seeds(own, baseline), _of_seeds(baseline, own)
    for stage in STAGES:
        row[stage] = {
            measure: _measure(
                _values(own, stage, measure),
                *(_values(trials, stage, measure) for trials in paired),
            )
            for measure in MEASURES
        }
    return row


def _measure(values: Array, own: Array, baseline: Array) -> dict[str, Any]:
    """All values of a candidate, and the difference where the baseline has the same trials."""
    difference = paired_difference(own, baseline)
    return mean_interval(values).as_json() | {"difference": difference.as_json()}


def _of_seeds(trials: Trials, others: Trials) -> Trials:
    """The trials whose seeds others have too."""
    seeds = {trial["seed"] for trial in others}
    return [trial for trial in trials if trial["seed"] in seeds]


def _values(trials: Trials, stage: str, measure: str) -> Array:
    ordered = sorted(trials, key=lambda trial: int(trial["seed"]))
    return as_array([trial[stage][measure] for trial in ordered])
