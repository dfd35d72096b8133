"""Fig. 5d: true return and rates of the policies trained on each reward."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from polite.analysis.numbers import as_array
from polite.plots.curves import draw_seed_band, draw_seeds
from polite.plots.style import LOOKS

SHORT = {"polite": "POLITE", "baseline": "baseline", "ground_truth": "true\nreward"}
EVERY, RATES = (-np.inf, np.inf), (0.0, 1.0)


def draw_learning(ax: Axes, curves: Mapping[str, Any], key: str, ylabel: str) -> Axes:
    """A quantity against PPO steps, mean and 95% t band over seeds, one curve a condition.

    Args:
        ax: Where to draw.
        curves: `curves` of results.json.
        key: "return", "success_rate" or "collision_rate".
        ylabel: The quantity in words.
    """
    within = EVERY if key == "return" else RATES
    for name in present(curves):
        steps = as_array(curves[name]["steps"]) / 1000
        draw_seed_band(ax, steps, curves[name][key], LOOKS[name], within=within)
    ax.set_xlim(left=0)
    if key != "return":
        ax.set_ylim(-0.02, 1.02)
    ax.set_xlabel("PPO steps [thousands]")
    ax.set_ylabel(ylabel)
    return ax


def draw_final(ax: Axes, policies: Mapping[str, Any], key: str, ylabel: str) -> Axes:
    """The final policies' values, one dot a seed, from `policy` of results.json."""
    groups = [(SHORT[name], policies[name][key], LOOKS[name]) for name in present(policies)]
    draw_seeds(ax, groups, ylabel, within=EVERY if key == "return" else RATES)
    if key != "return":
        ax.set_ylim(-0.02, 1.02)
    return ax


def present(parts: Mapping[str, Any]) -> list[str]:
    """The policies' conditions that the results hold, the true reward first."""
    return [name for name in ("ground_truth", "baseline", "polite") if name in parts]
