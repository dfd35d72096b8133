"""The benchmark's returns: against policy steps (Fig. 4), against queries, and run by run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from polite.analysis.benchmark_records import PAIRWISE
from polite.analysis.numbers import as_array
from polite.plots.curves import draw_band
from polite.plots.methods import form_of, look_of
from polite.plots.style import BLACK, GREEN, GREY

Cells = Sequence[Mapping[str, Any]]
ORDER = (
    "ground-truth",
    "polite",
    "preferences",
    "highlights",
    "pebble",
    "polite-pebble",
    "untrained",
)
"""The methods as legends list them."""


def draw_learning_curves(ax: Axes, cells: Cells) -> Axes:
    """True return against policy steps, mean ± standard error over runs, one curve a cell."""
    for cell in in_order(cells):
        curve, look = cell["curve"], look_of(cell)
        if not curve["n"]:
            continue
        steps, mean, error = (as_array(curve[name]) for name in ("steps", "mean", "error"))
        name = cell["label"] + form_of(cell)
        draw_band(ax, steps / 1000, mean, mean - error, mean + error, look, name)
    for line in ax.lines:
        line.set(markersize=2.8, linewidth=min(line.get_linewidth(), 1.3))
    ax.set_xlim(left=0)
    ax.set_xlabel("policy steps [thousands]")
    ax.set_ylabel("true return")
    return ax


def draw_returns_by_queries(ax: Axes, cells: Cells) -> Axes:
    """Final true return against queries, one curve a method: mean and 95% t interval over runs.

    Methods that ask nothing are level lines: the true reward's is the ceiling.
    """
    for cell in in_order(cells):
        if not cell["queries"] and cell["mean"] is not None:
            look = look_of(cell)
            ax.axhline(cell["mean"], color=look.colour, ls=look.line, lw=1.2, label=look.label)
    curves = _methods(in_order(cells))
    for place, curve in enumerate(curves):
        look = replace(look_of(curve[0], shaded=False), label=_method_name(curve[0]))
        aside = 2 ** (0.035 * (place - (len(curves) - 1) / 2))  # so that intervals do not overlap
        queries = aside * as_array([cell["queries"] for cell in curve])
        mean, low, high = (
            as_array([cell["interval"][name] for cell in curve]) for name in ("mean", "low", "high")
        )
        reach = np.nan_to_num(np.array([mean - low, high - mean]))  # one run has no interval
        ax.errorbar(
            queries, mean, reach, label=look.label, capsize=2, elinewidth=1, **look.of_line(1)
        )
    _query_axis(ax, sorted({cell["queries"] for cell in cells if cell["queries"]}))
    ax.set_ylabel("final true return")
    return ax


def in_order(cells: Cells) -> list[Mapping[str, Any]]:
    """The ceiling first, what asks nothing last, each method's cells by queries."""
    place = {method: k for k, method in enumerate(ORDER)}
    return sorted(
        cells,
        key=lambda cell: (
            place.get(cell["method"], len(place)),
            form_of(cell),
            cell["queries"],
        ),
    )


def draw_cells(ax: Axes, groups: Sequence[tuple[str, Cells]]) -> Axes:
    """One row a cell: a dot a run, the interquartile mean and its 95% bootstrap interval.

    Args:
        ax: Where to draw.
        groups: Titled groups of cells; each title has a row of its own.
    """
    rows: list[str] = []
    heads: list[int] = []
    for title, cells in groups:
        heads.append(len(rows))
        rows.append(title)
        for cell in cells:
            _draw_row(ax, len(rows), cell)
            rows.append(cell["label"] + form_of(cell))
    ax.set_yticks(range(len(rows)), rows)
    ax.tick_params(axis="y", length=0)
    for head in heads:
        ax.get_yticklabels()[head].set(fontweight="bold", fontsize=6.5)
        ax.axhline(head, color="#E4E4E4", lw=0.8, zorder=0)
    ax.set_ylim(len(rows) - 0.4, -0.6)
    ax.grid(axis="y", visible=False)
    ax.set_xlabel("final true return")
    return ax


def draw_aggregates(ax: Axes, aggregates: Cells) -> Axes:
    """Interquartile mean of the normalised scores over envs, with its stratified interval.

    One row a method and budget; open marks have another loss than the pairwise one.
    """
    names = list(dict.fromkeys(part["label"] + form_of(part) for part in aggregates))
    for part in aggregates:
        look, pairwise = look_of(part), part["loss"] in (None, PAIRWISE)
        place = names.index(part["label"] + form_of(part)) + (-0.12 if pairwise else 0.18)
        mean, low, high = as_array([part["iqm"][name] for name in ("mean", "low", "high")])
        ax.plot([low, high], [place] * 2, color=look.colour, lw=2.5, alpha=0.5)
        face = look.colour if pairwise else "white"
        ax.plot(mean, place, look.marker, mfc=face, mec=look.colour, mew=0.9, ms=4.5)
    ax.set_yticks(range(len(names)), names)
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.axvline(0, color=GREY, lw=0.8, ls=":")
    ax.axvline(1, color=GREEN, lw=0.8, ls="-.")
    ax.grid(axis="y", visible=False)
    ax.set_xlabel("normalised score (untrained 0, true reward 1)")
    return ax


def _draw_row(ax: Axes, place: int, cell: Mapping[str, Any]) -> None:
    look = look_of(cell)
    dots = as_array([run["final_return"] for run in cell["runs"]])
    shift = np.linspace(-0.12, 0.12, dots.size) if dots.size > 1 else np.zeros(dots.size)
    mean, low, high = as_array([cell["iqm"][name] for name in ("mean", "low", "high")])
    if np.isfinite([low, high]).all():
        ax.plot([low, high], [place] * 2, color=look.colour, lw=4.5, alpha=0.35, zorder=1.5)
    ax.plot(dots, place + shift, ".", color=look.colour, ms=3.5, alpha=0.8, mew=0)
    ax.plot(mean, place, "|", color=BLACK, ms=9, mew=1.5, zorder=4)


def _methods(cells: Cells) -> list[list[Mapping[str, Any]]]:
    """Cells of one method and form together, by queries; those without a mean are left out."""
    curves: dict[tuple[str, str | None], list[Mapping[str, Any]]] = {}
    for cell in sorted(cells, key=lambda cell: cell["queries"]):
        if cell["queries"] and cell["mean"] is not None:
            curves.setdefault((cell["method"], cell["highlights"]), []).append(cell)
    return list(curves.values())


def _method_name(cell: Mapping[str, Any]) -> str:
    return str(cell["label"]).rsplit("-", 1)[0] + form_of(cell)


def _query_axis(ax: Axes, budgets: Sequence[int]) -> None:
    """A log2 axis that names the budgets."""
    ax.set_xscale("log", base=2)
    ax.set_xlabel("queries")
    ax.xaxis.set_major_locator(FixedLocator(budgets))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.xaxis.set_minor_locator(NullLocator())
