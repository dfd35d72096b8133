"""Learning curves of several runs on one grid: their mean, their area, steps to reach a return."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from polite.analysis.numbers import Array, as_array, as_json

POINTS = 50
"""Points of the common grid."""
TAIL = 0.1
"""Share of the steps whose episodes make up a final return."""

Curve = Mapping[str, Any]
"""`steps`, `return` and `episodes` of a run: means over stretches that end at `steps`."""


def common_grid(steps: int, points: int = POINTS) -> Array:
    """(points,) ends of equal stretches of so many steps."""
    return np.asarray(np.arange(1, points + 1) * (steps / points))


def on_grid(curve: Curve, grid: Array) -> Array:
    """(E,) a run's return on the grid, linear between its points and level outside them.

    All NaN for a run without a finished episode.
    """
    steps, values = as_array(curve["steps"]), as_array(curve["return"])
    known = np.isfinite(values)
    if not known.any():
        return np.full(grid.shape, np.nan)
    return np.asarray(np.interp(grid, steps[known], values[known]), dtype=float)


def stacked(curves: Sequence[Curve], grid: Array) -> Array:
    """(S, E) the curves that hold anything, on one grid."""
    rows = [on_grid(curve, grid) for curve in curves]
    rows = [row for row in rows if np.isfinite(row).all()]
    return np.array(rows).reshape(len(rows), grid.size)


def mean_curve(curves: Sequence[Curve], grid: Array) -> dict[str, Any]:
    """Mean ± standard error over runs at each point, as the paper's Fig. 4; plain values.

    Returns:
        `steps`, `mean`, `error` (null for one run) and `n`, the number of runs with a curve.
    """
    rows = stacked(curves, grid)
    count = len(rows)
    if count == 0:
        return {"steps": [], "mean": [], "error": [], "n": 0}
    spread = rows.std(axis=0, ddof=1) if count > 1 else np.full(grid.shape, np.nan)
    error = as_json(spread / np.sqrt(count))
    return {"steps": as_json(grid), "mean": as_json(rows.mean(axis=0)), "error": error, "n": count}


def areas(curves: Sequence[Curve], steps: int) -> Array:
    """(S,) area under each run's curve up to so many steps, over those steps: its mean return."""
    return np.asarray(stacked(curves, common_grid(steps)).mean(axis=1))


def steps_to_reach(curves: Sequence[Curve], steps: int, target: float) -> Array:
    """(S,) steps after which each run's curve first reaches a return; infinite if it never does."""
    grid = common_grid(steps)
    return np.array([_first_crossing(row, grid, target) for row in stacked(curves, grid)])


def return_at(curve: Curve, steps: int) -> float:
    """Mean true return of the episodes that ended in the last tenth of the first so many steps.

    This reads the final return of a shorter training off a longer one's curve. Where no point of
    the curve lies in that tenth, the last one before it is read; NaN if there is none.
    """
    ends, values = as_array(curve["steps"]), as_array(curve["return"])
    episodes = as_array(curve["episodes"])
    past = (ends <= steps) & np.isfinite(values)
    recent = past & (ends > (1 - TAIL) * steps)
    if recent.any():
        return float(np.average(values[recent], weights=episodes[recent]))
    return float(values[past][-1]) if past.any() else float("nan")


def _first_crossing(row: Array, grid: Array, target: float) -> float:
    reached = row >= target
    if not reached.any():
        return float("inf")
    k = int(reached.argmax())
    if k == 0:
        return float(grid[0])
    share = (target - row[k - 1]) / (row[k] - row[k - 1])
    return float(grid[k - 1] + share * (grid[k] - grid[k - 1]))
