"""How many queries a method needs until its policies reach a given return."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np

from polite.analysis.aggregate import DRAWS
from polite.analysis.numbers import Array, as_json
from polite.analysis.statistics import LEVEL

Reached = Literal["at", "at or before", "not reached"]
QUERIES: Final = ("queries", "low", "high")


@dataclass(frozen=True)
class QueriesToReach:
    """A budget with what is known of it."""

    target: float
    """The return that was asked for."""
    reached: Reached
    """"at or before": the smallest budget that was run suffices. "not reached": none does."""
    queries: float
    """The budget; the largest that was run where the target is not reached; NaN if none was."""
    low: float
    """Lower end of the 95% bootstrap interval over seeds; 0 where the smallest budget may do."""
    high: float
    """Its upper end; infinite where more than 2.5% of the samples do not reach the target."""

    def as_json(self) -> dict[str, Any]:
        """Plain values; an infinite bound is null. Queries have one decimal.

        `interval` tells one that lies at infinity from none, whose bounds are null as well.
        """
        queries = {name: as_json(round(getattr(self, name), 1)) for name in QUERIES}
        there = {"interval": not np.isnan(self.low)}
        return {"target": as_json(self.target), "reached": self.reached} | queries | there


def queries_to_reach(
    finals: Mapping[int, Array], target: float, rng: np.random.Generator, draws: int = DRAWS
) -> QueriesToReach:
    """The smallest budget at which the mean final return reaches a target.

    Between two budgets that were run, the mean is taken as linear in log2(queries). Nothing is
    extrapolated: below the smallest budget the answer is "at or before", above the largest "not
    reached". The first crossing counts, so that of two methods the one with more budgets has more
    chances to cross early by luck. The interval is a percentile bootstrap over the seeds of each
    budget, which is too narrow for few seeds; with a single seed at any budget there is none, and
    both of its ends are NaN.

    Args:
        finals: (n,) final returns by budget ≥ 1; empty budgets are left out.
        target: the return to reach.
        rng: draws the bootstrap samples.
        draws: how many.
    """
    budgets = sorted(queries for queries, values in finals.items() if np.size(values))
    if not budgets or not np.isfinite(target):
        return QueriesToReach(target, "not reached", np.nan, np.nan, np.inf)
    values = [np.asarray(finals[queries], dtype=float) for queries in budgets]
    logs = np.log2(budgets)
    crossing = float(_crossings(np.array([[v.mean() for v in values]]), logs, target)[0])
    reached: Reached = "at or before" if crossing == logs[0] else "at"
    queries = float(2**crossing)
    if not np.isfinite(crossing):
        reached, queries = "not reached", float(budgets[-1])
    if min(v.size for v in values) < 2:
        return QueriesToReach(target, reached, queries, np.nan, np.nan)
    samples = np.stack(
        [v[rng.integers(v.size, size=(draws, v.size))].mean(axis=1) for v in values], axis=1
    )
    tail = (1 - LEVEL) / 2
    drawn = _crossings(samples, logs, target)
    low, high = np.quantile(drawn, [tail, 1 - tail], method="inverted_cdf")
    least = 0.0 if low == logs[0] else float(2**low)
    return QueriesToReach(target, reached, queries, least, float(2**high))


def _crossings(means: Array, logs: Array, target: float) -> Array:
    """log2 budget of the first crossing in each row of means (D, B); infinite without one."""
    reached = means >= target
    first = reached.argmax(axis=1)
    row = np.arange(len(means))
    before = np.maximum(first - 1, 0)
    step = np.where(first > 0, means[row, first] - means[row, before], 1.0)
    share = np.where(first > 0, (target - means[row, before]) / np.where(step > 0, step, 1.0), 0.0)
    place = logs[before] + np.clip(share, 0.0, 1.0) * (logs[first] - logs[before])
    return np.asarray(np.where(reached.any(axis=1), place, np.inf))
