"""Goals and people, drawn into a plot along the corridor or onto the floor plan."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Rectangle
from matplotlib.path import Path as Outline

from polite.plots.style import BLACK, GREEN, GREY

Scene = Mapping[str, Any]

PERSON = Outline.make_compound_path(
    Outline.circle((0.0, 0.62), 0.34),
    Outline([(-0.62, -0.9), (-0.5, 0.1), (0.5, 0.1), (0.62, -0.9), (-0.62, -0.9)]),
)
"""A head over shoulders, as a marker."""


def draw_along(ax: Axes, scene: Scene) -> None:
    """Vertical bands where goals and people are, named above the axes; x is z in metres."""
    goals = (
        ("intermittent\ngoal", scene["intermittent"][1], scene["intermittent_radius"]),
        ("end\ngoal", scene["goal"][1], scene["goal_radius"]),
    )
    for name, z, radius in goals:
        ax.axvspan(z - radius, z + radius, color=GREEN, alpha=0.16, lw=0, zorder=0)
        _name(ax, z, name, GREEN)
    for _, z in scene["people"]:
        reach = scene["anchor_jitter"]
        ax.axvspan(z - reach, z + reach, fc="none", ec="#9A9A9A", hatch="/////", lw=0, zorder=0)
        _name(ax, z, "person", GREY)
    ax.set_xlim(-scene["half_length"], scene["half_length"])


def along_handles() -> list[Patch]:
    """Legend entries of the bands of `draw_along`."""
    return [
        Patch(fc=GREEN, alpha=0.25, lw=0, label="goal (centre ± radius)"),
        Patch(fc="none", ec="#9A9A9A", hatch="/////", lw=0, label="person (range of start places)"),
    ]


def draw_floor(ax: Axes, scene: Scene) -> None:
    """Walls, goals and the people's anchors on the floor plan: z to the right, x upwards."""
    length, width = scene["half_length"], scene["half_width"]
    ax.add_patch(Rectangle((-length, -width), 2 * length, 2 * width, fill=False, ec=BLACK, lw=1.8))
    goals = (
        (scene["intermittent"], scene["intermittent_radius"]),
        (scene["goal"], scene["goal_radius"]),
    )
    for (x, z), radius in goals:
        ax.add_patch(Circle((z, x), radius, fill=False, ec="white", lw=2.6))
        ax.add_patch(Circle((z, x), radius, fill=False, ec=GREEN, lw=1.4))
        ax.plot(z, x, marker="*", ms=7, mfc=GREEN, mec="white", mew=0.6, ls="none")
    for x, z in scene["people"]:
        ax.plot(z, x, marker=PERSON, ms=9, mfc=BLACK, mec="white", mew=0.6, ls="none")
    margin = 0.15
    ax.set(xlim=(-length - margin, length + margin), ylim=(-width - margin, width + margin))
    ax.set_aspect("equal")
    ax.grid(False)
    ax.spines[:].set_visible(False)  # the wall is the frame


def floor_handles() -> list[Line2D]:
    """Legend entries of the marks of `draw_floor`."""
    return [
        Line2D(
            [], [], marker="*", ms=8, mfc=GREEN, mec="white", ls="none", label="goal and radius"
        ),
        Line2D([], [], marker=PERSON, ms=8, mfc=BLACK, mec="white", ls="none", label="person"),
        Line2D([], [], color=BLACK, lw=1.8, label="wall"),
    ]


def _name(ax: Axes, z: float, name: str, colour: str) -> None:
    above = ax.get_xaxis_transform()
    ax.text(z, 1.03, name, color=colour, fontsize=7, ha="center", va="bottom", transform=above)
