"""An episode: some of its frames, and under them what every step was paid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import BytesIO
from math import ceil
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from polite.plots.strip import Frames, draw_frame
from polite.plots.style import BLUE, GREEN, GREY

FRAMES: Final = 6
"""Frames of a picture."""
COLOURS: Final = (GREEN, BLUE)
"""Of the traces, in their order."""
DPI: Final = 100
TRACE_HEIGHT: Final = 0.9
"""Of a trace [inches; under a clip at DPI]."""
WIDE: Final = 0.5
"""Frames whose height is a smaller share of their width are wide."""

Traces = Mapping[str, npt.NDArray[Any]]
"""What paid -> (T,) what it paid at every step."""


def draw_traces(axes: Sequence[Axes], traces: Traces, seconds: float) -> None:
    """One panel for each trace, all over the same time; units of r̂ are its own.

    Args:
        axes: As many as there are traces, from top to bottom.
        traces: What paid, and (T,) what it paid.
        seconds: Duration of a step.
    """
    for ax, colour, (name, values) in zip(axes, COLOURS, traces.items(), strict=False):
        times = seconds * np.arange(len(values))
        ax.axhline(0.0, color=GREY, lw=0.6)
        ax.plot(times, values, color=colour, lw=0.9)
        ax.set_ylabel(name)
        ax.set_xlim(0.0, seconds * len(values))
        ax.tick_params(labelbottom=ax is axes[-1])
    axes[-1].set_xlabel("time [s]")


def draw_episode(
    figure: Figure, frames: Frames, steps: Sequence[int], traces: Traces, seconds: float
) -> None:
    """Frames over the traces; a line in the traces is where each frame is.

    The figure gets the height that this takes at its width. Wide frames stand in two rows.

    Args:
        figure: Where to draw.
        frames: (F, h, w, 3).
        steps: The F steps that they show.
        traces: What paid, and (T,) what it paid.
        seconds: Duration of a step.
    """
    shape = frames.shape[1] / frames.shape[2]
    columns = len(frames) if shape > WIDE else ceil(len(frames) / 2)
    rows = ceil(len(frames) / columns)
    width = figure.get_figwidth()
    heights = [shape * width / columns] * rows + [TRACE_HEIGHT] * len(traces)
    figure.set_figheight(sum(heights) + 0.6)
    grid = figure.add_gridspec(len(heights), columns, height_ratios=heights)
    for place, (frame, step) in enumerate(zip(frames, steps, strict=True)):
        draw_frame(figure.add_subplot(grid[divmod(place, columns)]), frame, seconds * step)
    panels = [figure.add_subplot(grid[row, :]) for row in range(rows, len(heights))]
    draw_traces(panels, traces, seconds)
    for ax in panels:
        for step in steps:
            ax.axvline(seconds * step, color=GREY, lw=0.6, ls=":")


def below_frames(
    frames: Frames, steps: Sequence[int], traces: Traces, seconds: float, title: str
) -> Frames:
    """The frames with the traces under them, and in these a line that moves with the time.

    Args:
        frames: (F, h, w, 3).
        steps: The F steps that they show.
        traces: What paid, and (T,) what it paid.
        seconds: Duration of a step.
        title: Stands over the traces.

    Returns:
        (F, H, w, 3) with H > h.
    """
    width = frames.shape[2]
    figure = Figure(figsize=(width / DPI, TRACE_HEIGHT * len(traces) + 0.6), dpi=DPI)
    axes = list(figure.subplots(len(traces), 1, squeeze=False)[:, 0])
    figure.suptitle(title, x=0.02, ha="left", fontsize=7.5)
    draw_traces(axes, traces, seconds)
    pixels = BytesIO()
    figure.savefig(pixels, format="rgba", dpi=DPI)
    panel = np.frombuffer(pixels.getvalue(), np.uint8).reshape(-1, width, 4)[..., :3]
    times = seconds * np.asarray(steps, dtype=np.float64)
    points = axes[0].transData.transform(np.column_stack([times, np.zeros_like(times)]))
    columns = np.clip(points[:, 0].round().astype(int), 1, width - 1)
    rows = slice(*(round(len(panel) - y) for y in (axes[0].bbox.y1, axes[-1].bbox.y0)))
    height = frames.shape[1]
    pictures = np.empty((len(frames), height + len(panel), width, 3), np.uint8)
    pictures[:, :height], pictures[:, height:] = frames, panel
    for picture, column in zip(pictures, columns.tolist(), strict=True):
        picture[height:][rows, column - 1 : column + 1] = 0
    return pictures
