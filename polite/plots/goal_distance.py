"""Fig. 5b: mean reward against the distance to a goal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.axes import Axes

from polite.analysis.numbers import as_array
from polite.plots.curves import draw_band
from polite.plots.style import GREEN, LOOKS


def draw_goal_distance(ax: Axes, parts: Mapping[str, Any], radius: float, whose: str) -> Axes:
    """Mean (r̂+1)/2 by the distance to a goal, with ± 1 sd over states, both models alike.

    Args:
        ax: Where to draw.
        parts: `goal_distance` or `nearest_goal_distance` of results.json.
        radius: The goal's radius, metres; drawn as a band.
        whose: The goal in words, for the axis.
    """
    ax.axvspan(0, radius, color=GREEN, alpha=0.16, lw=0, zorder=0)
    for name in ("baseline", "polite"):
        part = parts[name]
        mean, std = as_array(part["mean"]), as_array(part["std"])
        draw_band(ax, part["distance"], mean, mean - std, mean + std, LOOKS[name])
    ax.set_xlim(left=0)
    ax.set_ylim(-0.02, 1.02)
    ax.set_xlabel(f"distance to {whose} [m]")
    ax.set_ylabel(r"mapped reward $(\hat r + 1)/2$")
    return ax
