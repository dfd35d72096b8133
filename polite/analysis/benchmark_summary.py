"""A benchmark's records as the numbers of results.json."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any, Final

import numpy as np

from polite.analysis.aggregate import (
    bootstrap_interval,
    interquartile_mean,
    probability_of_improvement,
)
from polite.analysis.benchmark_cells import cell_part, identity, scores
from polite.analysis.benchmark_records import (
    HIGHLIGHTED,
    NAMES,
    RAISED,
    UNASKED,
    Cell,
    Condition,
    Grid,
    Record,
    Run,
    label,
)
from polite.analysis.benchmark_rules import POLITE_200
from polite.analysis.benchmark_rules_own import (
    ALONE_200,
    EQUAL_EFFORT,
    NOISY_200,
    NOISY_ALONE_200,
    PLAIN,
    SHUFFLED_200,
    UPDATED_262,
    UPDATED_800,
    WITH_FEW_EPOCHS,
)
from polite.analysis.claims_benchmark import judge_grid
from polite.analysis.comparisons import View, Wanted
from polite.analysis.numbers import Array
from polite.analysis.query_budget import queries_to_reach
from polite.analysis.statistics import ratio_of_means, welch_difference

TARGETS: Final = (0.5, 0.6, 0.7, 0.8, 0.9)
"""Shares of the true reward's return whose queries are looked for."""
HEADLINE: Final = Wanted("preferences", 800)
"""The baseline whose return the paper reaches with fewer queries."""
_UPDATED: Final = (UPDATED_800, UPDATED_262)
_LEADERS: Final = (ALONE_200, *PLAIN)
"""Who may lead, under any condition; each is compared with each."""
_RAISED: Final = tuple(which._replace(variant=RAISED) for which in _LEADERS)
CONTROLS: Final = (
    (POLITE_200, SHUFFLED_200),
    *((POLITE_200, control) for control in _UPDATED),
    *((control, control._replace(variant="")) for control in _UPDATED),
    *zip(WITH_FEW_EPOCHS, PLAIN, strict=True),
    (ALONE_200, NOISY_ALONE_200),
    (POLITE_200, NOISY_200),
    *zip(_RAISED, _LEADERS, strict=True),
)
"""What highlights say; the baseline at equal updates of r̂, and what these updates do to it; what
few epochs of r̂ do; what careless highlights cost; what the level of r̂ does."""


def summarise(
    records: Sequence[Record],
    planned: Sequence[Run] = (),
    *,
    made_otherwise: int = 0,
    damaged: Sequence[str] = (),
    seed: int = 0,
) -> dict[str, Any]:
    """The content of a benchmark's results.json; the figures and the page read nothing else.

    Args:
        records: finished runs in any order; any cell may lack runs or be absent.
        planned: `run` of every run that the grid shall hold, finished ones included; may be empty.
        made_otherwise: finished runs that are left out, because other settings made them.
        damaged: files that should be records and are none, left out too.
        seed: of the bootstrap samples. Every interval starts from it, so that a new record changes
            the intervals of its own cell alone.

    Returns:
        `simulated_teacher`, `runs` (counts), `envs` (by name), `cells`,
        `aggregates` (over envs), `comparisons`, `queries_to_reach`, `claims` and `missing`, in
        plain values.

    Raises:
        InvalidValueError: when a run lacks one of its keys.
    """
    grid = Grid(records, planned)
    finished = sum(len(runs) for runs in grid.runs.values())
    waiting = sum(len(grid.missing_seeds(cell)) for cell in grid.runs)
    return {
        "simulated_teacher": True,
        "runs": {
            "finished": finished,
            "missing": waiting,
            "plan_known": bool(planned),
            "made_otherwise": made_otherwise,
            "damaged": list(damaged),
        },
        "envs": grid.envs,
        "cells": [cell_part(grid, cell, seed) for cell, runs in grid.runs.items() if runs],
        "aggregates": _aggregates(grid, seed),
        "comparisons": [part for view in _views(grid) for part in _comparisons(view, seed)],
        "queries_to_reach": [part for view in _views(grid) for part in _reach(view, seed)],
        "claims": judge_grid(grid),
        "missing": [
            identity(cell) | {"seeds": grid.missing_seeds(cell), "done": len(runs)}
            for cell, runs in grid.runs.items()
            if grid.missing_seeds(cell)
        ],
    }


def _views(grid: Grid) -> Iterator[View]:
    """Every env under each of its conditions, then under each loss for what has no highlights."""
    for env in grid.envs:
        conditions = grid.conditions(env)
        plain = [replace(condition, highlights=None) for condition in conditions]
        for condition in dict.fromkeys([*conditions, *plain]):
            yield View(grid, env, condition)


def _comparisons(view: View, seed: int) -> Iterator[dict[str, Any]]:
    for first, second in _pairs(view):
        samples = view.samples(first, second)
        if min(sample.size for sample in samples) == 0 or not view.depends(first, second):
            continue
        rng = np.random.default_rng(seed)
        yield _where(view.env, view.condition) | {
            "first": label(*first),
            "second": label(*second),
            "steps": view.together(first, second)[1],
            "n": [int(sample.size) for sample in samples],
            "means": [float(sample.mean()) for sample in samples],
            "difference": welch_difference(*samples).as_json(),
            "ratio": ratio_of_means(*samples).as_json(),
            "improvement": probability_of_improvement([(samples[0], samples[1])], rng).as_json(),
        }


def _pairs(view: View) -> list[tuple[Wanted, Wanted]]:
    """Who is compared with whom: headline, equal queries or effort, PEBBLE, ablations, leaders.

    The controls come last, beside the cells of the env itself.
    """
    budgets = sorted({c.queries for c in view.grid.cells(view.env) if c.queries})
    pairs = [
        (Wanted("polite", 200), HEADLINE),
        (Wanted("polite", 400), HEADLINE),
        *((Wanted("polite", q), Wanted("preferences", q)) for q in budgets),
        *((Wanted("polite", q), Wanted("preferences", more)) for q, more in EQUAL_EFFORT.items()),
        (Wanted("polite", 200), Wanted("pebble", 400)),
        *((Wanted("polite", q), Wanted("pebble", q)) for q in budgets),
        *((Wanted("highlights", q), Wanted("untrained", 0)) for q in budgets),
        *((Wanted("polite-pebble", q), Wanted("pebble", q)) for q in budgets),
        *((Wanted("pebble", q), Wanted("preferences", q)) for q in budgets),
        *combinations(_LEADERS, 2),
        *(CONTROLS if not view.condition.variant else ()),
    ]
    highlighted = view.condition.highlights is not None
    pairs = list(dict.fromkeys(pairs))
    return [p for p in pairs if any(w.method in HIGHLIGHTED for w in p) == highlighted]


def _reach(view: View, seed: int) -> Iterator[dict[str, Any]]:
    for method in NAMES:
        highlighted = method in HIGHLIGHTED
        if method in UNASKED or highlighted != (view.condition.highlights is not None):
            continue
        finals, steps = _by_budget(view, method)
        if not finals or not view.depends(*(Wanted(method, queries) for queries in finals)):
            continue
        for what, share, target in _targets(view, steps):
            reach = queries_to_reach(finals, target, np.random.default_rng(seed))
            names = {"method": method, "what": what, "share": share}
            yield _where(view.env, view.condition) | names | reach.as_json()


def _by_budget(view: View, method: str) -> tuple[dict[int, Array], int]:
    """Final returns of a method by its queries, of its longest training."""
    budgets = {c.queries for c in view.grid.cells(view.env) if c.method == method}
    found = {q: view.grid.find(view.env, view.condition, method, q) for q in sorted(budgets)}
    steps = max((max(cells) for cells in found.values() if cells), default=0)
    finals = {q: view.grid.finals(cells[steps]) for q, cells in found.items() if steps in cells}
    return {q: values for q, values in finals.items() if values.size}, steps


def _targets(view: View, steps: int) -> Iterator[tuple[str, float | None, float]]:
    """Returns to reach at so many steps: shares of the true reward's, and the headline's."""
    ceiling = _mean_at(view, Wanted("ground-truth", 0), steps)
    for share in TARGETS:
        if ceiling is not None and ceiling > 0:
            yield f"{share:.0%} of the true reward's return", share, share * ceiling
    headline = _mean_at(view, HEADLINE, steps)
    if headline is not None:
        yield f"the return of {label(*HEADLINE)}", None, headline


def _mean_at(view: View, wanted: Wanted, steps: int) -> float | None:
    found = view.grid.find(view.env, view.condition, *wanted)
    long_enough = [known for known in found if known >= steps]
    if not long_enough:
        return None
    finals = view.grid.finals(found[min(long_enough)], steps)
    return float(finals.mean()) if finals.size else None


def _aggregates(grid: Grid, seed: int) -> list[dict[str, Any]]:
    """IQM of the normalised scores over all envs that hold a cell, stratified by env.

    Every env counts as much: as many runs of each as of the env with the fewest, the first ones.
    """
    groups: dict[Cell, list[Cell]] = {}
    for cell, runs in grid.runs.items():
        if runs and not cell.variant:
            groups.setdefault(replace(cell, env=""), []).append(cell)
    parts = []
    for kind, cells in groups.items():
        strata = [scores(grid, cell) for cell in cells]
        if len(cells) < 2 or not all(s.size and np.isfinite(s).all() for s in strata):
            continue
        fewest = min(s.size for s in strata)
        strata = [s[:fewest] for s in strata]
        iqm = bootstrap_interval(strata, interquartile_mean, np.random.default_rng(seed))
        parts.append(
            identity(kind)
            | {"env": None, "envs": [cell.env for cell in cells]}
            | {"n": [int(s.size) for s in strata], "iqm": iqm.as_json()}
        )
    return parts


def _where(env: str, condition: Condition) -> dict[str, Any]:
    return {
        "env": env,
        "preset": condition.preset,
        "variant": condition.variant,
        "loss": condition.loss,
        "highlights": condition.highlights,
    }
