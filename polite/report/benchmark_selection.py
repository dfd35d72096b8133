"""Which cells of a benchmark's results belong into which figure and panel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from polite.analysis.benchmark_records import (
    ANY_LOSS,
    HIGHLIGHTED,
    PAIRWISE,
    PAPER_FORM,
    TRAININGS,
    unchanged,
)
from polite.plots.benchmark import in_order

Results = Mapping[str, Any]
Cell = Mapping[str, Any]
Place = tuple[str, str]
"""A loss and a form of highlights."""


def place_title(place: Place) -> str:
    """A loss and a form of highlights in words."""
    loss, form = place
    return f"{loss} loss, {'the paper’s' if form == PAPER_FORM else form} highlights"


def short_title(place: Place) -> str:
    """The same for a panel's title."""
    loss, form = place
    return f"{loss}, {'paper’s form' if form == PAPER_FORM else f'form {form}'}"


def places(results: Results) -> list[Place]:
    """The losses and forms of highlights of the grid; the paper's first, pairwise first."""
    found = {
        (cell["loss"], cell["highlights"])
        for env in results["envs"]
        for cell in main_cells(results, env)
        if cell["method"] in ("polite", "highlights")
    }
    plain = {cell["loss"] for env in results["envs"] for cell in main_cells(results, env)}
    found |= {(loss, PAPER_FORM) for loss in plain - {None} - {loss for loss, _ in found}}
    return sorted(found, key=lambda place: (place[1] != PAPER_FORM, place[0] != PAIRWISE, place))


def main_cells(results: Results, env: str) -> list[Cell]:
    """The cells of an env itself, without those of its variants."""
    return [c for c in results["cells"] if (c["env"], c["variant"]) == (env, "")]


def seen_cells(results: Results, env: str, place: Place, variant: str = "") -> list[Cell]:
    """The cells that belong to a loss and form; what learns from no preference fits any loss.

    Beside a variant of the training stand floor and ceiling, where it does not change them.
    """
    loss, form = place
    return [
        cell
        for cell in results["cells"]
        if cell["env"] == env
        and cell["variant"] == ("" if unchanged(cell["method"], variant) else variant)
        and (cell["loss"] == loss or cell["method"] in ANY_LOSS)
        and (cell["method"] not in HIGHLIGHTED or cell["highlights"] == form)
    ]


def compared_variants(results: Results, place: Place) -> list[str]:
    """Variants of the training under which highlights and the baseline were run in any env."""
    found = {
        variant: {
            cell["method"]
            for env in results["envs"]
            for cell in seen_cells(results, env, place, variant)
        }
        for variant in TRAININGS
    }
    return [
        variant
        for variant, methods in found.items()
        if "preferences" in methods and methods & HIGHLIGHTED
    ]


def full_length(cells: Sequence[Cell]) -> list[Cell]:
    """Each method's longest training only; PEBBLE's is shorter than PPO's and says so."""
    longest: dict[str, int] = {}
    for cell in cells:
        longest[cell["method"]] = max(cell["steps"], longest.get(cell["method"], 0))
    return [cell for cell in cells if cell["steps"] == longest[cell["method"]]]


def cell_groups(results: Results, env: str) -> list[tuple[str, list[Cell]]]:
    """All cells of an env, parted by what they may be compared within."""
    groups: dict[str, list[Cell]] = {}
    for cell in results["cells"]:
        if cell["env"] != env:
            continue
        control = [cell["variant"]] if cell["variant"] else []
        title = ", ".join([f"{cell['loss']} loss" if cell["loss"] else "no queries", *control])
        groups.setdefault(title, []).append(cell)
    titles = sorted(groups, key=lambda title: ("," in title, title))
    return [(title, in_order(groups[title])) for title in titles]


def ablation_budget(results: Results) -> int | None:
    """Queries of the ablation: 400 as in the grid's, or else the most that highlights had."""
    budgets = {cell["queries"] for cell in results["cells"] if cell["method"] == "highlights"}
    if not budgets:
        return None
    return 400 if 400 in budgets else int(max(budgets))


def has_quality(cell: Cell) -> bool:
    """Whether any run of a cell compared its reward with the true one."""
    late = (run["quality"]["late"] for run in cell["runs"])
    return any(value is not None for stage in late for value in stage.values())
