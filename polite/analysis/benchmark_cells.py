"""What results.json says of each cell of a benchmark: its returns, curve, answers and reward."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from polite.analysis.aggregate import bootstrap_interval, interquartile_mean, normalised
from polite.analysis.benchmark_records import TRAININGS, Cell, Condition, Grid, Record
from polite.analysis.numbers import Array, as_array, as_json
from polite.analysis.run_curves import common_grid, mean_curve
from polite.analysis.statistics import mean_interval

MEASURES: Final = ("pair_accuracy", "pearson", "spearman", "saturation")
"""Of a learned reward against the true one, on held-out segments."""
STAGES: Final = ("early", "late")
"""Segments of the policy at the last feedback session, and of the finished policy."""
SHARES: Final = ("no_preference", "positive", "negative")
"""Of the answers: without a preference, with a good moment, with a bad one."""


def cell_part(grid: Grid, cell: Cell, seed: int) -> dict[str, Any]:
    """The entry of a cell in `cells`; numbers that cannot be known are null.

    Args:
        grid: all runs; the ceiling and the untrained cell of the same setting normalise the score.
        cell: the one to describe.
        seed: of the bootstrap samples.
    """
    records, finals = grid.runs[cell], grid.finals(cell)
    iqm = bootstrap_interval([finals], interquartile_mean, np.random.default_rng(seed))
    score = mean_interval(scores(grid, cell))
    return identity(cell) | {
        "n": int(finals.size),
        "seeds": grid.seeds(cell),
        "mean": as_json(mean_interval(finals).mean),
        "sd": as_json(finals.std(ddof=1) if finals.size > 1 else np.nan),
        "interval": mean_interval(finals).as_json(),
        "iqm": iqm.as_json(),
        "normalised": score.as_json(),
        "evaluation": _estimate(records, ("evaluation", "return")),
        "collection_steps": _estimate(records, ("collection_steps",)),
        "answers": _answers(records),
        "quality": {
            stage: {name: _estimate(records, ("quality", stage, name)) for name in MEASURES}
            for stage in STAGES
        },
        "highlighted_reward": {
            sign: _estimate(records, ("quality", "highlighted_reward", sign))
            for sign in ("positive", "negative", "all")
        },
        "runs": [_run_part(record) for record in records],
        "curve": mean_curve([r["curve"] for r in records], common_grid(cell.steps)),
    }


def identity(cell: Cell) -> dict[str, Any]:
    """What a cell is; null for a loss or a form of highlights that it has not."""
    return {
        "env": cell.env,
        "preset": cell.preset,
        "variant": cell.variant,
        "steps": cell.steps,
        "loss": cell.loss or None,
        "highlights": cell.highlights or None,
        "method": cell.method,
        "queries": cell.queries,
        "label": cell.label,
    }


def scores(grid: Grid, cell: Cell) -> Array:
    """(n,) final returns between the untrained reward's (0) and the true reward's (1); maybe NaN.

    Both ends are those of the cell's env, preset and steps, and of the variant if that is another
    env; a longer training is read off its curve.
    """
    variant = "" if cell.variant in TRAININGS else cell.variant
    here = Condition(cell.preset, variant, cell.loss, None)
    ends = []
    for method in ("untrained", "ground-truth"):
        found = grid.find(cell.env, here, method, 0)
        long_enough = [steps for steps in found if steps >= cell.steps]
        if not long_enough:
            return np.full(grid.finals(cell).shape, np.nan)
        ends.append(grid.finals(found[min(long_enough)], cell.steps))
    return normalised(grid.finals(cell), *ends)


def values(records: Sequence[Record], path: Sequence[str]) -> Array:
    """(n,) a nested number of every record, NaN where it is null or absent."""
    return as_array([_at(record, path) for record in records])


def _at(record: Any, path: Sequence[str]) -> Any:
    for key in path:
        record = record.get(key) if isinstance(record, Mapping) else None
    return record


def _estimate(records: Sequence[Record], path: Sequence[str]) -> dict[str, Any]:
    found = values(records, path)
    return mean_interval(found[np.isfinite(found)]).as_json()


def _answers(records: Sequence[Record]) -> dict[str, Any]:
    """Shares over all runs: of no preference among the asked, of highlights among the expressed."""
    counts = {n: float(np.nansum(values(records, ("answers", n)))) for n in ("asked", *SHARES)}
    expressed = counts["asked"] - counts["no_preference"]
    whole = {"no_preference": counts["asked"], "positive": expressed, "negative": expressed}
    shares = {name: counts[name] / whole[name] if whole[name] else None for name in SHARES}
    return shares | {"label_accuracy": _estimate(records, ("answers", "label_accuracy"))}


def _run_part(record: Record) -> dict[str, Any]:
    return {
        "seed": record["run"]["seed"],
        "final_return": as_json(values([record], ("final_return",)))[0],
        "quality": {
            stage: {n: as_json(values([record], ("quality", stage, n)))[0] for n in MEASURES}
            for stage in STAGES
        },
    }
