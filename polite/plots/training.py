"""One training: a quantity against policy steps, and when the teacher was asked."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes

from polite.plots.style import GREY, Look


def draw_training(
    ax: Axes,
    steps: Sequence[float],
    values: Sequence[float],
    sessions: Sequence[int],
    look: Look,
    ylabel: str,
) -> Axes:
    """A learning curve, with a tick below the axis' upper edge for each feedback session.

    Args:
        ax: Where to draw.
        steps: Policy steps of each point.
        values: The quantity at each point.
        sessions: Policy steps before each feedback session; may be empty.
        look: How the curve is drawn.
        ylabel: The quantity in words.
    """
    thousands = [step / 1000 for step in steps]
    ax.plot(thousands, values, label=look.label, **look.of_line(len(thousands)))
    for number, session in enumerate(sessions):
        label = None if number else "feedback session"
        ax.axvline(session / 1000, ymin=0.93, color=GREY, lw=1.2, label=label)
    ax.set_xlim(left=0)
    ax.set_xlabel("policy steps [thousands]")
    ax.set_ylabel(ylabel)
    return ax
