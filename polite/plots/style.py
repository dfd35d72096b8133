"""One look for all figures: colours that colour-blind readers can tell apart, fonts, sizes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

WIDTH = 7.1
"""Width of a full-width figure in inches (two columns of a journal page)."""

BLUE, VERMILION, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
ORANGE, SKY, GREY, BLACK = "#E69F00", "#56B4E9", "#6B6B6B", "#1A1A1A"
# Okabe and Ito (2008), https://jfly.uni-koeln.de/color/, and two neutral tones.

STYLE: Final[dict[Any, Any]] = {
    "font.family": "DejaVu Sans",
    "font.size": 8,
    "axes.titlesize": 8.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 8,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.5,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "legend.fontsize": 7.5,
    "legend.framealpha": 0.85,
    "legend.edgecolor": "none",
    "lines.linewidth": 1.6,
    "lines.markersize": 4,
    "hatch.linewidth": 0.5,
    "figure.constrained_layout.use": True,
    "savefig.dpi": 200,
    "pdf.fonttype": 42,
}
"""Matplotlib settings, applied with `rc_context` around drawing and saving."""


@dataclass(frozen=True)
class Look:
    """How a condition is drawn everywhere: colour, line and marker, so none is the only cue."""

    label: str
    colour: str
    line: str
    marker: str

    def of_line(self, points: int) -> dict[str, Any]:
        """Keywords of `Axes.plot` for a curve of so many points, with about ten markers."""
        return {
            "color": self.colour,
            "linestyle": self.line,
            "marker": self.marker,
            "markevery": max(1, points // 10),
        }


LOOKS: Final[Mapping[str, Look]] = {
    "polite": Look("POLITE", BLUE, "-", "o"),
    "baseline": Look("baseline (preferences only)", VERMILION, "--", "s"),
    "ground_truth": Look("PPO on the true reward", GREEN, "-.", "^"),
    "null_seed": Look("null: baseline ‖ baseline, other batches", GREY, ":", "D"),
    "null_shuffled": Look("null: POLITE, highlights shuffled ‖ baseline", PURPLE, "-.", "v"),
}
"""The looks of all conditions and null models."""


def shared_legend(
    figure: Figure, axes: Axes, band: str, more: Sequence[Artist] = (), columns: int = 4
) -> None:
    """One legend beneath the whole figure.

    Args:
        figure: Where to put it.
        axes: Its labelled artists come first.
        band: What the shaded bands are.
        more: Further labelled artists.
        columns: Entries in a row.
    """
    lines, _ = axes.get_legend_handles_labels()
    handles = [*lines, Patch(fc=GREY, alpha=0.25, lw=0, label=band), *more]
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, handlelength=2.8)


def panel_letters(axes: list[Axes]) -> None:
    """Write (a), (b), … before the titles of the panels."""
    for letter, ax in zip("abcdefghij", axes, strict=False):
        ax.set_title(f"({letter})  {ax.get_title(loc='left')}")
