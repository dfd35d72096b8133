"""Every figure of a benchmark, from the numbers of its results.json."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from polite.analysis.benchmark_records import ANY_LOSS, PAIRWISE, PAPER_FORM, UNASKED
from polite.analysis.benchmark_rules_own import EQUAL_EFFORT
from polite.plots.benchmark import (
    draw_aggregates,
    draw_cells,
    draw_learning_curves,
    draw_returns_by_queries,
    in_order,
)
from polite.plots.benchmark_effects import (
    BARS,
    HATCHES,
    condition_look,
    draw_ablation,
    draw_improvement,
    draw_quality_against_return,
    pair_name,
)
from polite.plots.methods import form_of, look_of
from polite.plots.style import GREY, WIDTH, panel_letters
from polite.report.benchmark_selection import (
    Cell,
    Results,
    ablation_budget,
    cell_groups,
    compared_variants,
    full_length,
    has_quality,
    main_cells,
    place_title,
    places,
    seen_cells,
    short_title,
)
from polite.report.stored import draw_all

MEASURES: Final = {
    "pair_accuracy": "pair accuracy",
    "spearman": "Spearman correlation, step by step",
    "saturation": "saturation: share of |r̂| > .95",
}


def draw_benchmark_figures(results: Results, folder: Path) -> list[Path]:
    """Draw all figures of a benchmark into `folder/figures`, each as a PDF and a PNG of 200 dpi.

    Args:
        results: the content of results.json.
        folder: the benchmark's folder.

    Returns:
        The PNG files, in the order of the report; a figure without anything to show is left out.
    """
    return draw_all(FIGURES, results, folder / "figures")


def learning_figure(results: Results) -> Figure | None:
    """Fig. 4: one row an env, one column a loss, form of highlights and variant of the training.

    The paper's form stands beside baselines with as many queries, as in the paper, ours beside
    those of equal effort and the highlights alone.
    """
    envs = results["envs"]
    columns = [
        (place, variant)
        for place in places(results)
        for variant in ("", *compared_variants(results, place))
    ]
    if not columns:
        return None
    width = WIDTH * max(1.0, len(columns) / 4)  # four titles fit side by side
    figure = Figure(figsize=(width, 0.9 + 2.4 * len(envs)))
    axes = figure.subplots(len(envs), len(columns), squeeze=False, sharex=True, sharey="row")
    shown: list[Cell] = []
    for row, env in zip(axes, envs, strict=True):
        for ax, (place, variant) in zip(row, columns, strict=True):
            others = EQUAL_EFFORT.values() if place[1] == PAPER_FORM else EQUAL_EFFORT
            cells = [
                cell
                for cell in seen_cells(results, env, place, variant)
                if not (cell["method"] == "highlights" and place[1] == PAPER_FORM)
                and not (cell["method"] == "preferences" and cell["queries"] in others)
            ]
            title = f"{env}\n{short_title(place)}" + (f"\n{variant}" if variant else "")
            draw_learning_curves(ax, cells).set_title(title)
            ax.set_visible(any(cell["variant"] == variant for cell in cells))
            shown += cells
    for column in axes.T:
        visible = [ax for ax in column if ax.get_visible()]
        for ax in visible[:-1]:
            ax.set_xlabel("")
        for ax in visible[-1:]:
            ax.tick_params(labelbottom=True)
    for ax in axes[:, 1:].flat:
        ax.set_ylabel("")
    panel_letters([ax for ax in axes.flat if ax.get_visible()])
    _legend_of(figure, list(axes.flat), _with_counts(in_order(shown)), columns=3)
    return figure


def queries_figure(results: Results) -> Figure | None:
    """Final return against queries: one row an env, one column a loss."""
    envs = results["envs"]
    losses = sorted({loss for loss, _ in places(results)}, key=lambda loss: loss != PAIRWISE)
    if not losses:
        return None
    figure = Figure(figsize=(WIDTH, 0.6 + 2.5 * len(envs)))
    axes = figure.subplots(len(envs), len(losses), squeeze=False, sharey="row")
    budgets = [c["queries"] for env in envs for c in main_cells(results, env) if c["queries"]]
    for row, env in zip(axes, envs, strict=True):
        for ax, loss in zip(row, losses, strict=True):
            ax.set_xlim(min(budgets) / 1.2, max(budgets) * 1.2)
            cells = [
                cell
                for cell in main_cells(results, env)
                if cell["loss"] == loss or cell["method"] in ANY_LOSS
            ]
            draw_returns_by_queries(ax, full_length(cells)).set_title(f"{env}, {loss} loss")
        row[0].set_ylim(*_run_range(full_length(main_cells(results, env))))
        for ax in row[1:]:
            ax.set_ylabel("")
    panel_letters(list(axes.flat))
    _legend_of(figure, list(axes.flat))
    return figure


def _run_range(cells: Sequence[Cell]) -> tuple[float, float]:
    """Where the runs are, with room; two runs' t interval would leave the others no height."""
    told = [run["final_return"] for cell in cells for run in cell["runs"]]
    returns = [value for value in told if value is not None] or [0.0]  # no episode was finished
    room = 0.1 * (max(returns) - min(returns)) + 1.0
    return min(returns) - room, max(returns) + room


def cells_figure(results: Results) -> Figure | None:
    """Interquartile mean and runs of every cell, one panel an env."""
    envs = results["envs"]
    groups = {env: cell_groups(results, env) for env in envs}
    rows = max((sum(len(cells) for _, cells in groups[env]) for env in envs), default=0)
    if rows == 0:
        return None
    figure = Figure(figsize=(WIDTH, 0.9 + 0.2 * rows))
    axes = list(figure.subplots(1, len(envs), squeeze=False)[0])
    for ax, env in zip(axes, envs, strict=True):
        draw_cells(ax, groups[env]).set_title(env)
    panel_letters(axes)
    return figure


def aggregate_figure(results: Results) -> Figure | None:
    """Interquartile mean of the normalised scores over envs, for each loss a panel."""
    parts = [
        part
        for part in results["aggregates"]
        if part["method"] not in UNASKED and part["iqm"]["low"] is not None
    ]
    if not parts:
        return None
    names = {part["label"] + form_of(part) for part in parts}
    figure = Figure(figsize=(0.72 * WIDTH, 0.9 + 0.22 * len(names)))
    draw_aggregates(figure.subplots(), in_order(parts))
    if any(part["loss"] != PAIRWISE for part in parts):
        figure.legend(handles=[_open_mark()], loc="outside lower center")
    return figure


def improvement_figure(results: Results) -> Figure | None:
    """Probability of improvement of every pair of cells, one panel an env, variants last.

    Pairs without highlights stand in the first column of their loss.
    """
    envs, columns = results["envs"], places(results)
    first = {loss: form for loss, form in reversed(columns)}
    shown = {
        env: {
            place_title(place): [
                part
                for part in results["comparisons"]
                if part["env"] == env
                and (part["loss"], part["highlights"] or first.get(part["loss"])) == place
                and part["improvement"]["low"] is not None
            ]
            for place in columns
        }
        for env in envs
    }
    every = [part for parts in shown.values() for some in parts.values() for part in some]
    every.sort(key=lambda part: part["variant"])
    pairs = list(dict.fromkeys(pair_name(part) for part in every))
    if not pairs:
        return None
    figure = Figure(figsize=(WIDTH, 1.2 + 0.11 * len(pairs) * max(len(columns), 2)))
    axes = list(figure.subplots(1, len(envs), squeeze=False, sharey=True)[0])
    for ax, env in zip(axes, envs, strict=True):
        draw_improvement(ax, shown[env], pairs).set_title(env)
    panel_letters(axes)
    looks = [condition_look(k, place_title(place)) for k, place in enumerate(columns)]
    handles = [
        Line2D([], [], color=look.colour, marker=look.marker, label=look.label) for look in looks
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def ablation_figure(results: Results) -> Figure | None:
    """Fig. 4c: neither, highlights, preferences, both; one panel an env."""
    envs = results["envs"]
    queries = ablation_budget(results)
    if queries is None:
        return None
    figure = Figure(figsize=(WIDTH, 2.9))
    axes = list(figure.subplots(1, len(envs), squeeze=False)[0])
    for ax, env in zip(axes, envs, strict=True):
        groups = []
        for place in places(results):
            cells = {
                cell["method"]: cell
                for cell in seen_cells(results, env, place)
                if cell["method"] in HATCHES and cell["queries"] in (0, queries)
            }
            groups.append((short_title(place).replace(", ", ",\n"), cells))
        draw_ablation(ax, groups).set_title(f"{env}, {queries} queries")
    for ax in axes[1:]:
        ax.set_ylabel("")
    panel_letters(axes)
    handles = []
    for method, hatch in HATCHES.items():
        look = look_of(
            {"method": method, "highlights": None, "queries": 0, "label": BARS[method]},
            shaded=False,
        )
        colours = (look.colour, 0.45), look.colour
        handles.append(Patch(fc=colours[0], ec=colours[1], hatch=hatch, label=look.label))
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


def quality_figure(results: Results) -> Figure | None:
    """How the learned reward's quality goes with the final return: a row an env."""
    envs = results["envs"]
    shown = {
        env: [c for c in main_cells(results, env) if c["method"] not in UNASKED] for env in envs
    }
    if not any(has_quality(cell) for cells in shown.values() for cell in cells):
        return None
    figure = Figure(figsize=(WIDTH, 0.6 + 2.2 * len(envs)))
    axes = figure.subplots(len(envs), len(MEASURES), squeeze=False, sharey="row")
    for row, env in zip(axes, envs, strict=True):
        for ax, (measure, label) in zip(row, MEASURES.items(), strict=True):
            draw_quality_against_return(ax, shown[env], measure, label)
        row[0].set_title(env)
        row[0].set_ylabel("final true return")
    panel_letters(list(axes.flat))
    figure.legend(
        handles=_quality_handles([cell for cells in shown.values() for cell in cells]),
        loc="outside lower center",
        ncols=4,
    )
    return figure


FIGURES: Final[Mapping[str, Callable[[Results], Figure | None]]] = {
    "learning_curves": learning_figure,
    "return_by_queries": queries_figure,
    "cells": cells_figure,
    "aggregate": aggregate_figure,
    "improvement": improvement_figure,
    "fig4c_ablation": ablation_figure,
    "quality": quality_figure,
}
"""File names and who draws them, in the order of the report."""


def _legend_of(
    figure: Figure,
    axes: Sequence[Axes],
    counts: Mapping[str, str] | None = None,
    columns: int = 4,
) -> None:
    """One legend beneath the figure of all that any of its panels shows, with numbers of runs.

    Args:
        figure: Where to put it.
        axes: The panels.
        counts: What to append to a label, in the order of the legend; panels' order without it.
        columns: Entries in a row.
    """
    entries: dict[str, Any] = {}
    for ax in axes:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    order = [label for label in counts if label in entries] if counts else list(entries)
    if order:
        figure.legend(
            [entries[label] for label in order],
            [label + (counts or {}).get(label, "") for label in order],
            loc="outside lower center",
            ncols=columns,
            handlelength=3.4,
        )


def _with_counts(cells: Sequence[Cell]) -> dict[str, str]:
    """How many runs a cell has, or from how many to how many where panels differ, by its label."""
    found: dict[str, set[int]] = {}
    for cell in cells:
        found.setdefault(cell["label"] + form_of(cell), set()).add(cell["curve"]["n"])
    texts = {name: sorted(counts) for name, counts in found.items()}
    return {
        name: f", n = {counts[0]}" + (f" to {counts[-1]}" if len(counts) > 1 else "")
        for name, counts in texts.items()
    }


def _quality_handles(cells: Sequence[Cell]) -> list[Line2D]:
    handles: dict[str, Line2D] = {}
    for cell in cells:
        name = cell["label"].rsplit("-", 1)[0] + form_of(cell)
        look = look_of(cell, shaded=False)
        handles.setdefault(
            name, Line2D([], [], color=look.colour, marker=look.marker, ls="none", label=name)
        )
    marks = list(handles.values())
    return (
        [*marks, _open_mark()] if any(c["loss"] not in (None, PAIRWISE) for c in cells) else marks
    )


def _open_mark() -> Line2D:
    look: dict[str, Any] = {"marker": "o", "mfc": "white", "mec": GREY, "ls": "none"}
    return Line2D([], [], label="open: released loss", **look)
