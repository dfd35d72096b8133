"""The records of a benchmark, by cell of its grid; what is missing from it, by name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from polite.analysis.numbers import Array
from polite.analysis.run_curves import return_at
from polite.types import InvalidValueError

Record = Mapping[str, Any]
"""A finished run: `run`, `curve`, `final_return`, `evaluation`, `answers`, `quality` and steps."""
Run = Mapping[str, Any]
"""What was run: env, method, queries, loss, highlights, preset, steps, variant and seed."""

NAMES: Final[Mapping[str, str]] = {
    "polite": "POLITE",
    "preferences": "baseline",
    "highlights": "highlights",
    "pebble": "PEBBLE",
    "polite-pebble": "POLITE-PEBBLE",
    "untrained": "untrained reward",
    "ground-truth": "true reward",
}
"""The methods in words, in the order of every table and figure."""
HIGHLIGHTED: Final = frozenset({"polite", "highlights", "polite-pebble"})
"""Methods that learn from highlights."""
UNASKED: Final = frozenset({"untrained", "ground-truth"})
"""Methods that ask no queries, so that no loss applies."""
ANY_LOSS: Final = frozenset({"highlights"}) | UNASKED
"""Methods that learn from no preference: the preference loss does not touch them, so that runs
under one loss serve comparisons under any."""
SHUFFLED, NOISY = "shuffled", "noisy"
EQUAL_UPDATES, FEW_EPOCHS, RAISED = "equal-updates", "few-epochs", "raised"
TRAININGS: Final = (SHUFFLED, NOISY, EQUAL_UPDATES, FEW_EPOCHS, RAISED)
"""Variants of the training: highlights that say nothing; some that are wrong; as many updates of
the reward model whatever the budget; an eighth of its released epochs; nothing paid for steps two
standard deviations below the average. Their env is the plain one."""
PAIRWISE, PAPER_FORM, OWN_FORM = "pairwise", "paper", "choice"


@dataclass(frozen=True, order=True)
class Condition:
    """What is held fixed when methods are compared in an env."""

    preset: str
    variant: str
    loss: str
    highlights: str | None
    """The form of the highlights; None where no method of a comparison uses any."""

    @property
    def title(self) -> str:
        """The condition in words, but for the preset, which all runs of a folder share."""
        form = {None: "", PAPER_FORM: ", the paper's highlights"}
        own = f", highlights by {self.highlights}"
        more = f", {self.variant}" if self.variant else ""
        return f"{self.loss} loss{form.get(self.highlights, own)}{more}"


@dataclass(frozen=True)
class Cell:
    """A cell of the grid: all that its runs share but the seed."""

    env: str
    preset: str
    variant: str
    steps: int
    loss: str
    """Empty for methods that ask nothing."""
    highlights: str
    """The form of the highlights; empty for methods without any."""
    method: str
    queries: int

    @property
    def label(self) -> str:
        """The method and its queries, as "POLITE-200"."""
        return label(self.method, self.queries)

    @property
    def order(self) -> tuple[Any, ...]:
        """Sorts cells as tables list them."""
        place = list(NAMES).index(self.method) if self.method in NAMES else len(NAMES)
        where = (self.env, self.preset, self.variant, self.loss, place, self.method)
        form = (self.highlights != PAPER_FORM, self.highlights)
        return (*where, *form, self.queries, self.steps)


class Grid:
    """Finished runs and planned ones, grouped by cell.

    Attributes:
        runs: finished runs of every cell, by seed; planned cells without one are there, empty.
        planned: the seeds that each cell shall hold.
    """

    def __init__(self, records: Sequence[Record], planned: Sequence[Run] = ()) -> None:
        """Group the runs.

        Args:
            records: finished runs; of two with the same run the later one counts.
            planned: `run` of every run that the grid shall hold; may be empty.

        Raises:
            InvalidValueError: when a run lacks one of its keys.
        """
        found: dict[Cell, dict[int, Record]] = {}
        for record in records:
            run = _value(record, "run")
            found.setdefault(cell_of(run), {})[_value(run, "seed")] = record
        wanted: dict[Cell, set[int]] = {}
        for run in planned:
            wanted.setdefault(cell_of(run), set()).add(_value(run, "seed"))
        order = sorted(found.keys() | wanted.keys(), key=lambda cell: cell.order)
        self.runs: dict[Cell, list[Record]] = {
            cell: [record for _, record in sorted(found.get(cell, {}).items())] for cell in order
        }
        self.planned = wanted

    def since(self, seed: int) -> Grid:
        """The same grid with the runs of this seed and later ones only."""
        part = copy(self)
        part.planned = {c: {s for s in held if s >= seed} for c, held in self.planned.items()}
        part.runs = {
            cell: [record for record in records if record["run"]["seed"] >= seed]
            for cell, records in self.runs.items()
        }
        part.runs = {c: found for c, found in part.runs.items() if found or part.planned.get(c)}
        return part

    def seeds(self, cell: Cell) -> list[int]:
        """The seeds that are finished."""
        return [record["run"]["seed"] for record in self.runs[cell]]

    def missing_seeds(self, cell: Cell) -> list[int]:
        """The seeds that are planned and not finished."""
        return sorted(self.planned.get(cell, set()).difference(self.seeds(cell)))

    @property
    def envs(self) -> list[str]:
        """Every env of the grid, by name."""
        return sorted({cell.env for cell in self.runs})

    def cells(self, env: str) -> Iterator[Cell]:
        """The cells of an env."""
        return (cell for cell in self.runs if cell.env == env)

    def conditions(self, env: str) -> list[Condition]:
        """Every combination of loss and form of highlights that the env's cells hold.

        The env itself comes before its variants, the pairwise loss and the paper's form first
        within it.
        """
        held: set[Condition] = set()
        for cell in self.cells(env):
            if cell.method in ("polite", "highlights", "preferences"):
                form = cell.highlights or None
                held.add(Condition(cell.preset, cell.variant, cell.loss, form))
        formed = {replace(condition, highlights=None) for condition in held if condition.highlights}
        held -= formed  # preferences alone make a condition only where nothing else does
        return sorted(
            held,
            key=lambda c: (
                (c.preset, c.variant),
                (c.highlights != PAPER_FORM, c.highlights or "", c.loss != PAIRWISE, c.loss),
            ),
        )

    def find(
        self,
        env: str,
        condition: Condition,
        method: str,
        queries: int,
        variant: str = "",
        *,
        finished: bool = True,
    ) -> dict[int, Cell]:
        """The cells of a method and budget in a condition, by their number of steps.

        Args:
            env: the env.
            condition: what is held fixed; a method that learns from no preference fits any loss.
            method: the method.
            queries: its budget.
            variant: another one than the condition's; empty for the condition's own.
            finished: only cells that hold a finished run; otherwise planned ones too.
        """
        condition = replace(condition, variant=variant or condition.variant)
        fitting: dict[int, Cell] = {}
        for cell in self.cells(env):
            if (cell.method, cell.queries) != (method, queries) or not _fits(cell, condition):
                continue
            better = cell.loss == condition.loss or cell.steps not in fitting
            if better and (self.runs[cell] or not finished):
                fitting[cell.steps] = cell
        return fitting

    def finals(self, cell: Cell, steps: int | None = None) -> Array:
        """(n,) true returns at the end of a cell's runs, or after fewer steps; missing left out."""
        end = cell.steps if steps is None else steps
        values = [
            return_at(record["curve"], end) if end < cell.steps else record["final_return"]
            for record in self.runs[cell]
        ]
        array = np.array([np.nan if value is None else value for value in values], dtype=float)
        return np.asarray(array[np.isfinite(array)])


def cell_of(run: Run) -> Cell:
    """The cell that a run belongs to.

    Raises:
        InvalidValueError: when it lacks one of its keys.
    """
    method = str(_value(run, "method"))
    return Cell(
        env=str(_value(run, "env")),
        preset=str(_value(run, "preset")),
        variant=str(_value(run, "variant")),
        steps=int(_value(run, "steps")),
        loss="" if method in UNASKED else str(_value(run, "loss")),
        highlights=str(_value(run, "highlights")) if method in HIGHLIGHTED else "",
        method=method,
        queries=0 if method in UNASKED else int(_value(run, "queries")),
    )


def label(method: str, queries: int, variant: str = "") -> str:
    """A method and its queries in words, as "baseline-800", with a control's name if it is one."""
    name = NAMES.get(method, method)
    words = name if method in UNASKED else f"{name}-{queries}"
    return f"{words}, {variant}" if variant else words


def unchanged(method: str, variant: str) -> bool:
    """Whether a method without queries is the same under this variant as in the env itself.

    A random reward model that is raised is another one, and pays for not falling.
    """
    return method in UNASKED and variant in TRAININGS and (method, variant) != ("untrained", RAISED)


def _fits(cell: Cell, condition: Condition) -> bool:
    form = cell.method not in HIGHLIGHTED or cell.highlights == condition.highlights
    loss = cell.method in ANY_LOSS or cell.loss == condition.loss
    same = unchanged(cell.method, condition.variant)
    place = (condition.preset, "" if same else condition.variant)
    return form and loss and (cell.preset, cell.variant) == place


def _value(record: Mapping[str, Any], key: str) -> Any:
    if key not in record:
        raise InvalidValueError(
            f"record of a benchmark: expected the key {key!r}, found {sorted(record)}; was it "
            "written by another version? Run it again"
        )
    return record[key]
