"""The offline bench: candidates against preferences alone, and against the number of queries."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from polite.analysis.numbers import as_array
from polite.plots.curves import draw_band
from polite.plots.style import BLACK, BLUE, GREY, ORANGE, PURPLE, VERMILION, Look

Rows = Sequence[Mapping[str, Any]]

LADDER_LOOKS: Final[Mapping[str, Look]] = {
    "preferences": Look("preferences alone", ORANGE, "--", "s"),
    "paper": Look("highlights as in the paper", VERMILION, "-.", "D"),
    "choice": Look("highlights as a choice", BLUE, "-", "o"),
    "choice-alone": Look("highlights as a choice, alone", PURPLE, "-", "P"),
    "preferences-few-epochs": Look("preferences alone, few epochs", ORANGE, ":", "^"),
    "choice-few-epochs": Look("highlights as a choice, few epochs", BLUE, ":", "v"),
}
"""How the candidates that are compared at every budget are drawn."""


def draw_gains(ax: Axes, rows: Rows, stage: str, measure: str, names: Sequence[str]) -> Axes:
    """Difference from preferences alone with its paired 95% t interval, one row a candidate.

    Args:
        ax: Where to draw.
        rows: rows of results.json of one env and one budget.
        stage: "early" or "late".
        measure: which of the measures.
        names: the candidates from top to bottom.
    """
    for place in range(0, len(names), 2):
        ax.axhspan(place - 0.5, place + 0.5, color="#F5F5F5", lw=0, zorder=0)
    for row in rows:
        part = row[stage][measure]["difference"]
        mean, low, high = as_array([part["mean"], part["low"], part["high"]])
        place = names.index(row["candidate"])
        beyond = low > 0 or high < 0
        colour = BLUE if low > 0 else VERMILION if high < 0 else GREY
        if np.isfinite([low, high]).all():
            ax.plot([low, high], [place] * 2, color=colour, lw=1.4)
        fill = colour if beyond else "white"
        ax.plot(mean, place, "o", mfc=fill, mec=colour, ms=4.5)
    ax.axvline(0, color=BLACK, lw=0.8)
    ax.set_yticks(range(len(names)), names)
    ax.set_ylim(len(names) - 0.5, -0.5)
    ax.grid(axis="y", visible=False)
    return ax


def draw_ladder(ax: Axes, rows: Rows, stage: str, measure: str, ylabel: str) -> Axes:
    """A measure against the number of queries, mean and 95% t interval over trials, log₂ axis."""
    for name, look in LADDER_LOOKS.items():
        own = sorted((r for r in rows if r["candidate"] == name), key=lambda r: int(r["queries"]))
        if own:
            parts = [row[stage][measure] for row in own]
            mean, low, high = ([part[key] for part in parts] for key in ("mean", "low", "high"))
            draw_band(ax, [row["queries"] for row in own], mean, low, high, look)
    budgets = sorted({int(row["queries"]) for row in rows if row["candidate"] in LADDER_LOOKS})
    ax.set_xscale("log", base=2)
    ax.set_xticks(budgets, [str(budget) for budget in budgets], rotation=45)
    ax.minorticks_off()
    ax.set_xlabel("queries")
    ax.set_ylabel(ylabel)
    return ax
