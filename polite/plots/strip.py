"""One query as a strip of frames, with the highlight windows marked on frames and time line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import SubFigure
from matplotlib.patches import Rectangle

from polite.plots.style import BLACK, GREEN, VERMILION

Frames = npt.NDArray[np.uint8]
Windows = Mapping[str, tuple[int, int]]
"""First and last step of each highlight, under "positive" and "negative"."""

MARKS: Mapping[str, tuple[str, str, str]] = {
    "positive": ("+ good", GREEN, "////"),
    "negative": ("− bad", VERMILION, "...."),
}
"""Text, colour and pattern of each sign; any one of the three tells them apart."""


def draw_strip(
    figure: SubFigure, frames: Frames, windows: Windows, seconds: float, title: str, rows: int = 6
) -> None:
    """Evenly spaced frames of one clip, one under another, over a time line.

    Args:
        figure: Where to draw.
        frames: (T, height, width, 3) one frame a step.
        windows: The highlights of this clip, empty for a clip without.
        seconds: Duration of a step.
        title: What the clip is.
        rows: Number of frames.
    """
    height, width = frames.shape[1:3]
    ratio = height / width
    axes = figure.subplots(rows + 1, 1, height_ratios=[ratio] * rows + [0.15])
    steps = np.linspace(0, len(frames) - 1, rows).round().astype(int)
    for ax, step in zip(axes[:rows], steps, strict=True):
        draw_frame(ax, frames[step], step * seconds, _signs(windows, int(step)))
    axes[0].set_title(title)
    draw_timeline(axes[rows], len(frames), windows, seconds)


def draw_timeline(ax: Axes, steps: int, windows: Windows, seconds: float) -> Axes:
    """A bar from the clip's start to its end, with coloured, patterned and named windows."""
    duration = steps * seconds
    ax.add_patch(Rectangle((0, 0), duration, 1, fc="#EFEFEF", ec=BLACK, lw=0.6))
    if not windows:
        ax.text(duration / 2, 0.5, "no highlight", fontsize=7, ha="center", va="center_baseline")
    for sign, (start, end) in windows.items():
        text, colour, hatch = MARKS[sign]
        left, right = start * seconds, (end + 1) * seconds
        low = 0.5 if sign == "positive" else 0.0
        corner, length = (left, low), right - left
        ax.add_patch(Rectangle(corner, length, 0.5, fc=colour, ec="white", hatch=hatch, lw=0))
        on_left = right > 0.75 * duration
        ax.text(
            left - 0.015 * duration if on_left else right + 0.015 * duration,
            low + 0.25,
            text,
            color=colour,
            fontsize=7,
            fontweight="bold",
            ha="right" if on_left else "left",
            va="center_baseline",
        )
    ax.set(xlim=(0, duration), ylim=(0, 1), yticks=[], xlabel="time in the clip [s]")
    ax.spines[:].set_visible(False)
    ax.grid(False)
    return ax


def draw_frame(ax: Axes, frame: Frames, time: float, signs: Sequence[str] = ()) -> None:
    """One frame with its time, and the highlights that it is part of.

    Args:
        ax: Where to draw.
        frame: (h, w, 3).
        time: When it is [s].
        signs: "positive", "negative".
    """
    ax.imshow(frame, aspect="equal", interpolation="antialiased")
    ax.set(xticks=[], yticks=[])
    ax.grid(False)
    box = {"fc": "white", "ec": "none", "alpha": 0.85, "pad": 1.2}
    ax.text(0.01, 0.95, f"{time:.1f} s", transform=ax.transAxes, fontsize=7, va="top", bbox=box)
    ax.spines[:].set(visible=True, color="#9A9A9A", linewidth=0.6)
    for place, sign in enumerate(signs):
        text, colour, _ = MARKS[sign]
        ax.spines[:].set(color=colour, linewidth=2.0)
        ax.text(
            0.99,
            0.95 - 0.3 * place,
            text,
            color=colour,
            transform=ax.transAxes,
            fontsize=7,
            fontweight="bold",
            ha="right",
            va="top",
            bbox=box,
        )


def _signs(windows: Windows, step: int) -> list[str]:
    return [sign for sign, (start, end) in windows.items() if start <= step <= end]


def example_windows(example: Mapping[str, Any]) -> Windows:
    """The highlights of `example` in results.json, without those that were not given."""
    return {
        sign: (example[sign][0], example[sign][1])
        for sign in ("positive", "negative")
        if example[sign] is not None
    }
