"""How good the learned rewards are, how far the policies differ, and what that depends on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from polite.analysis.numbers import as_array
from polite.plots.curves import draw_seeds
from polite.plots.style import BLACK, BLUE, LOOKS, ORANGE

SHORT = {"baseline": "baseline", "null_shuffled": "highlights\nshuffled", "polite": "POLITE"}


def draw_quality(ax: Axes, quality: Mapping[str, Any], key: str, ylabel: str) -> Axes:
    """Agreement with the true reward on held-out segments, one dot a seed (`reward_quality`)."""
    draw_seeds(ax, [(SHORT[n], quality[n][key], LOOKS[n]) for n in SHORT], ylabel)
    return ax


def draw_policy_difference(ax: Axes, difference: Mapping[str, Any]) -> Axes:
    """Distance of the policies' mean actions beside that of two baselines of different seeds."""
    groups = (
        ("POLITE to\nbaseline", difference["per_seed"], LOOKS["polite"]),
        ("baseline to\nbaseline", difference["null_per_seed"], LOOKS["null_seed"]),
    )
    draw_seeds(ax, groups, "mean L2 distance of actions")
    ax.set_ylim(bottom=0)
    return ax


def draw_sensitivity(ax: Axes, rows: Sequence[Mapping[str, Any]], key: str, xlabel: str) -> Axes:
    """POLITE minus baseline under each setting of the participants, 95% paired t intervals.

    Args:
        ax: Where to draw.
        rows: `sensitivity` of results.json.
        key: "pair_accuracy" or "correlation".
        xlabel: The difference in words.
    """
    colour, marker = (BLUE, "o") if key == "pair_accuracy" else (ORANGE, "s")
    for place, row in enumerate(rows):
        part = row["correlation_difference"] if key == "correlation" else row
        middle = part["mean"] if key == "correlation" else part["difference"]
        mean, low, high = as_array([middle, part["low"], part["high"]])
        if np.isfinite([low, high]).all():
            ax.plot([low, high], [place] * 2, color=colour, lw=1.4)
        ax.plot(mean, place, marker, color=colour, mec=BLACK, mew=0.5, ms=5)
    ax.axvline(0, color=BLACK, lw=0.8)
    ax.set_yticks(range(len(rows)), [f"{row['factor']}: {row['level']}" for row in rows])
    ax.set_ylim(len(rows) - 0.5, -0.5)
    ax.set_xlabel(xlabel)
    ax.grid(axis="y", visible=False)
    return ax
