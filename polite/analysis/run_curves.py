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
    """(S,) steps after which each run first reaches a return; infinite if it never does.

    At every point the mean over the tenth of all steps before it is read, as for a final return,
    so that one lucky stretch is no convergence; the first point is a tenth of all steps.
    """
    grid = common_grid(steps)
    width = round(TAIL * grid.size)
    rows = np.lib.stride_tricks.sliding_window_view(stacked(curves, grid), width, axis=1)
    return np.array([_first_crossing(row, grid[width - 1 :], target) for row in rows.mean(axis=2)])


def return_at(curve: Curve, steps: int) -> float:
    """Mean true return of the episodes that ended in the last tenth of the first so many steps.

    This reads the final return of a shorter training off a longer one's curve, whose points are
    means over stretches: each weighs as many episodes as it has, times the share of its stretch
    that lies in that tenth. Where none does, the last point before it is read; NaN if there is
    none.
    """
    known = np.isfinite(as_array(curve["return"]))
    ends, values, episodes = (
        as_array(curve[name])[known] for name in ("steps", "return", "episodes")
    )
    if not ends.size:
        return float("nan")
    width = np.diff(ends, prepend=0.0).min()  # of a stretch; those without an episode are left out
    inside = np.minimum(ends, steps) - np.maximum(ends - width, (1 - TAIL) * steps)
    weights = episodes * np.clip(inside / width, 0.0, 1.0)
    if weights.any():
        return float(np.average(values, weights=weights))
    past = ends <= steps
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
