"""Two or more cells of the grid side by side, at equal numbers of policy steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from polite.analysis.benchmark_records import ANY_LOSS, Cell, Condition, Grid, label
from polite.analysis.numbers import Array
from polite.analysis.run_curves import areas, steps_to_reach
from polite.analysis.statistics import (
    Estimate,
    ratio_of_means,
    welch_contrast,
    welch_difference,
)

FEWEST = 2
"""Runs that a cell needs before anything is judged; what is wanted where no plan is known."""
SHARE_OF_FINAL = 0.8
"""Of the baseline's final return: what "converged" means for the steps to it (our threshold)."""


class Wanted(NamedTuple):
    """A cell of a view."""

    method: str
    queries: int
    """Its budget."""
    variant: str = ""
    """A control that is set beside the condition's own cells; empty for one of them."""


@dataclass(frozen=True)
class View:
    """The grid of one env, seen under one condition."""

    grid: Grid
    env: str
    condition: Condition

    def samples(self, *wanted: Wanted) -> list[Array]:
        """Final true returns of each cell, (n,) each; empty where the cell has no run.

        All are read at the same number of policy steps: the largest that every cell was run for or,
        if there is none, the shortest training's, read off the curves of the longer ones.
        """
        cells, steps = self.together(*wanted)
        return [self.grid.finals(cell, steps) if cell else np.zeros(0) for cell in cells]

    def together(self, *wanted: Wanted) -> tuple[list[Cell | None], int]:
        """The cells to compare, None for one without a run, and the steps to read them at."""
        found = [self.grid.find(self.env, self.condition, *which) for which in wanted]
        held = [set(cells) for cells in found if cells]
        if not held:
            return [None] * len(wanted), 0
        shared = set.intersection(*held)
        steps = max(shared) if shared else min(max(steps) for steps in held)
        return [cells.get(steps, cells[max(cells)]) if cells else None for cells in found], steps

    def difference(self, first: Wanted, second: Wanted) -> Estimate:
        """Mean final return of the first minus the second, Welch's interval."""
        return welch_difference(*self.samples(first, second))

    def ratio(self, first: Wanted, second: Wanted) -> Estimate:
        """Mean final return of the first over the second, Fieller's interval."""
        return ratio_of_means(*self.samples(first, second))

    def synergy(self, queries: int) -> Estimate:
        """(both − preferences) − (highlights − untrained), Welch's interval of the contrast."""
        methods = ("polite", "preferences", "highlights")
        cells = self.samples(*(Wanted(m, queries) for m in methods), Wanted("untrained", 0))
        return welch_contrast(cells, [1.0, -1.0, -1.0, 1.0])

    def area_difference(self, first: Wanted, second: Wanted) -> Estimate:
        """Mean return over all policy steps, first minus second, Welch's interval."""
        return welch_difference(*self._of_curves(areas, first, second))

    def speed_difference(self, first: Wanted, second: Wanted) -> Estimate:
        """Steps to 80% of the second's mean final return, first minus second, Welch's interval.

        The target is taken as known: the error of that mean is not in the interval.

        A run that never reaches it counts as its whole training, which is only a lower bound of its
        steps: so such a run of the first leaves the difference unbounded above, and one of the
        second leaves it unbounded below. NaN where the second's mean final return is not above 0.
        """
        finals = self.samples(first, second)[1]
        if not finals.size or finals.mean() <= 0:
            return Estimate(np.nan, -np.inf, np.inf)
        target = SHARE_OF_FINAL * float(finals.mean())
        late, early = self._of_curves(lambda c, s: steps_to_reach(c, s, target), first, second)
        end = self.together(first, second)[1]
        gap = welch_difference(np.minimum(late, end), np.minimum(early, end))
        high = np.inf if np.isinf(late).any() else gap.high
        return Estimate(gap.mean, -np.inf if np.isinf(early).any() else gap.low, high)

    def missing(self, *wanted: Wanted) -> list[str]:
        """What stands between these cells and a verdict, or a complete one, in words."""
        return [text for which in wanted for text in [self._missing(which)] if text]

    def _missing(self, which: Wanted) -> str:
        found = self.grid.find(self.env, self.condition, *which)
        cell = found[max(found)] if found else self._planned(which)
        done = len(self.grid.finals(cell)) if cell else 0
        planned = cell is not None and cell in self.grid.planned
        wanted = done + len(self.grid.missing_seeds(cell)) if cell and planned else FEWEST
        return f"{label(*which)}: {done} of {wanted} runs" if done < wanted else ""

    def known(self, *wanted: Wanted) -> bool:
        """Whether each of these cells has a finished run or is planned."""
        return all(self._planned(which) for which in wanted)

    def depends(self, *wanted: Wanted) -> bool:
        """Whether the condition's loss is one that any of these cells was run under.

        What learns from no preference is the same under every loss, and is told only once.
        """
        if any(which.method not in ANY_LOSS for which in wanted):
            return True
        cells = [c for c in self.together(*wanted)[0] if c and c.loss]
        return not cells or any(cell.loss == self.condition.loss for cell in cells)

    def _planned(self, which: Wanted) -> Cell | None:
        planned = self.grid.find(self.env, self.condition, *which, finished=False)
        return planned[max(planned)] if planned else None

    def _of_curves(
        self, read: Callable[..., Array], first: Wanted, second: Wanted
    ) -> tuple[Array, Array]:
        cells, steps = self.together(first, second)
        curves = [[r["curve"] for r in self.grid.runs[cell]] if cell else [] for cell in cells]
        if steps == 0:
            return np.zeros(0), np.zeros(0)
        return read(curves[0], steps), read(curves[1], steps)
