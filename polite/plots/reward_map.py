"""Fig. 5a: mean reward along the corridor, and around each kind of object."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from polite.analysis.numbers import as_array
from polite.plots.curves import draw_band
from polite.plots.scene import draw_along
from polite.plots.style import BLUE, GREEN, GREY, LOOKS, Look

Part = Mapping[str, Any]

REWARD = r"learned reward $\hat r(s, a)$"


def draw_reward_map(ax: Axes, maps: Part, scene: Part, *, standardised: bool = False) -> Axes:
    """Mean r̂ by the robot's z with ± 1 sd over states, both models, goals and people drawn in.

    Args:
        ax: Where to draw.
        maps: `reward_map` of results.json.
        scene: `scene` of results.json.
        standardised: Draw the rewards standardised over the states instead of the raw ones.
    """
    draw_along(ax, scene)
    for name in ("baseline", "polite"):
        part = maps[name]["standardised"] if standardised else maps[name]
        _draw_profile(ax, maps[name]["z"], part, name)
        for row in as_array(part["per_seed"]):
            ax.plot(as_array(maps[name]["z"]), row, color=LOOKS[name].colour, lw=0.4, alpha=0.45)
    ax.set_xlabel("robot's position along the corridor z [m]")
    ax.set_ylabel("standardised reward [sd]" if standardised else REWARD)
    return ax


def draw_profile(ax: Axes, part: Part, scene: Part) -> Axes:
    """Mean r̂ of one model by the robot's z with ± 1 sd across the corridor.

    Args:
        ax: Where to draw.
        part: `{z, mean, std}` (B) each.
        scene: `scene` of results.json.
    """
    draw_along(ax, scene)
    mean, std = as_array(part["mean"]), as_array(part["std"])
    look = Look("mean across the corridor, ± 1 sd", BLUE, "-", "o")
    draw_band(ax, as_array(part["z"]), mean, mean - std, mean + std, look)
    ax.set_ylabel(REWARD)
    ax.legend(loc="best")
    return ax


def draw_offset(ax: Axes, parts: Part, radius: float, *, goal: bool, reach: float) -> Axes:
    """Mean r̂ by the signed distance to an object, with ± 1 sd over states.

    Args:
        ax: Where to draw.
        parts: `goal_offset`, `intermittent_offset` or `person_offset` of results.json.
        radius: What counts as "at" the object, metres; drawn as a band.
        goal: Whether the object is a goal (plain green band) or a person (hatched grey band).
        reach: Largest distance shown, metres.
    """
    if goal:
        ax.axvspan(-radius, radius, color=GREEN, alpha=0.16, lw=0, zorder=0)
    else:
        ax.axvspan(-radius, radius, fc="none", ec="#B5B5B5", hatch="/////", lw=0, zorder=0)
    ax.axvline(0, color=GREEN if goal else GREY, lw=0.8, zorder=1)
    for name in ("baseline", "polite"):
        _draw_profile(ax, parts[name]["offset"], parts[name], name)
    ax.set_xlim(-reach, reach)
    ax.set_xlabel("robot minus object along z [m]")
    return ax


def _draw_profile(ax: Axes, centre: Any, part: Part, name: str) -> None:
    mean, std = as_array(part["mean"]), as_array(part["std"])
    draw_band(ax, np.asarray(centre), mean, mean - std, mean + std, LOOKS[name])
