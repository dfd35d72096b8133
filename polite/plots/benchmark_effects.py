"""What makes the difference: probability of improvement, the ablation, quality of the reward."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from polite.analysis.numbers import as_array
from polite.plots.methods import look_of
from polite.plots.style import BLACK, BLUE, GREY, ORANGE, PURPLE, VERMILION, Look

Parts = Sequence[Mapping[str, Any]]
CONDITION_LOOKS: Final = (
    (BLUE, "-", "o"),
    (VERMILION, "--", "s"),
    (ORANGE, "-.", "D"),
    (PURPLE, ":", "v"),
    (GREY, "-", "^"),
)
"""Colours, lines and markers of conditions in their order."""
HATCHES: Final[Mapping[str, str]] = {
    "untrained": "....",
    "highlights": "////",
    "preferences": "",
    "polite": "xxxx",
}
"""The four bars of the ablation, in order, with their patterns."""
BARS: Final[Mapping[str, str]] = {
    "untrained": "neither (untrained)",
    "highlights": "highlights",
    "preferences": "preferences",
    "polite": "both (POLITE)",
}


def condition_look(place: int, label: str) -> Look:
    """The look of the condition at a place of the list."""
    colour, line, marker = CONDITION_LOOKS[place % len(CONDITION_LOOKS)]
    return Look(label, colour, line, marker)


def draw_improvement(ax: Axes, parts: Mapping[str, Parts], pairs: Sequence[str]) -> Axes:
    """P(first > second) over runs with 95% bootstrap intervals, one row a pair of cells.

    Args:
        ax: Where to draw.
        parts: comparisons of one env by the name of their condition.
        pairs: names of the rows, as "POLITE-200 > baseline-800".
    """
    for shaded in range(0, len(pairs), 2):
        ax.axhspan(shaded - 0.5, shaded + 0.5, color="#F5F5F5", lw=0, zorder=0)
    gap = 0.6 / max(len(parts), 1)
    for place, (name, comparisons) in enumerate(parts.items()):
        look = condition_look(place, name)
        label: str | None = name
        for part in comparisons:
            row = float(pairs.index(pair_name(part))) + (place - (len(parts) - 1) / 2) * gap
            mean, low, high = as_array([part["improvement"][k] for k in ("mean", "low", "high")])
            if np.isfinite([low, high]).all():
                ax.plot([low, high], [row] * 2, color=look.colour, lw=1.4, alpha=0.8)
            ax.plot(mean, row, look.marker, color=look.colour, ms=4.5, label=label, ls="none")
            label = None
    ax.axvline(0.5, color=BLACK, lw=0.8)
    ax.set_yticks(range(len(pairs)), pairs)
    ax.set_ylim(len(pairs) - 0.45, -0.55)
    ax.set_xlim(-0.04, 1.04)
    ax.set_xlabel("probability of improvement")
    ax.grid(axis="y", visible=False)
    return ax


def pair_name(part: Mapping[str, Any]) -> str:
    """A comparison as the name of a row; a variant that both were trained under comes first."""
    variant = f"{part['variant']}: " if part["variant"] else ""
    return f"{variant}{part['first']} > {part['second']}"


def draw_ablation(ax: Axes, groups: Sequence[tuple[str, Mapping[str, Any]]]) -> Axes:
    """Fig. 4c: final true return by what the reward model learns from, one group a condition.

    Args:
        ax: Where to draw.
        groups: names of conditions, with the cells that they hold by method.
    """
    width = 0.8 / len(HATCHES)
    for place, (_, cells) in enumerate(groups):
        for bar, (method, hatch) in enumerate(HATCHES.items()):
            x = place + (bar - (len(HATCHES) - 1) / 2) * width
            if method in cells:
                _draw_bar(ax, x, 0.9 * width, cells[method], hatch)
            else:
                ax.annotate("no run", (x, 0), rotation=90, ha="center", va="bottom", fontsize=6)
    ax.set_xticks(range(len(groups)), [name for name, _ in groups])
    ax.axhline(0, color=BLACK, lw=0.7)
    ax.set_ylabel("final true return")
    ax.grid(axis="x", visible=False)
    return ax


def draw_quality_against_return(ax: Axes, cells: Parts, measure: str, xlabel: str) -> Axes:
    """A measure of the learned reward, on the final policy's segments, against the final return.

    A dot is a run; open marks have the released loss.
    """
    for cell in cells:
        look = look_of(cell, shaded=False)
        x = as_array([run["quality"]["late"][measure] for run in cell["runs"]])
        y = as_array([run["final_return"] for run in cell["runs"]])
        face = look.colour if cell["loss"] == "pairwise" else "white"
        ax.plot(x, y, look.marker, ls="none", mfc=face, mec=look.colour, ms=4, alpha=0.85)
    ax.set_xlabel(xlabel)
    return ax


def _draw_bar(ax: Axes, x: float, width: float, cell: Mapping[str, Any], hatch: str) -> None:
    if cell["mean"] is None:
        return
    look = look_of({**cell, "highlights": None}, shaded=False)
    ax.bar(x, cell["mean"], width, color=look.colour, alpha=0.45, hatch=hatch, ec=look.colour)
    dots = as_array([run["final_return"] for run in cell["runs"]])
    ax.plot(x + np.linspace(-0.3, 0.1, dots.size) * width, dots, ".", color=look.colour, ms=3)
    low, high = as_array([cell["interval"][name] for name in ("low", "high")])
    if np.isfinite([low, high]).all():
        ax.plot([x + 0.25 * width] * 2, [low, high], color=BLACK, lw=1.1)
