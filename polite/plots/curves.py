"""The marks that several figures share: a curve with its band, and one dot a seed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

from polite.analysis.numbers import as_array
from polite.analysis.statistics import mean_band, mean_interval
from polite.plots.style import BLACK, Look


def draw_band(
    ax: Axes,
    x: npt.ArrayLike,
    mean: npt.ArrayLike,
    low: npt.ArrayLike,
    high: npt.ArrayLike,
    look: Look,
    label: str | None = None,
) -> None:
    """A curve (E,) over a shaded band; the band is left out where it is unbounded (NaN)."""
    x, mean, low, high = (as_array(values) for values in (x, mean, low, high))
    ax.fill_between(x, low, high, color=look.colour, alpha=0.17, lw=0, zorder=1.5)
    for edge in (low, high):
        ax.plot(x, edge, color=look.colour, ls=look.line, lw=0.4, alpha=0.6, zorder=1.6)
    ax.plot(x, mean, label=label or look.label, zorder=3, **look.of_line(x.size))


def draw_seed_band(
    ax: Axes,
    x: npt.ArrayLike,
    per_seed: npt.ArrayLike,
    look: Look,
    *,
    within: tuple[float, float] = (-np.inf, np.inf),
) -> None:
    """Mean over seeds with the pointwise 95% t interval, from one row a seed (S, E).

    The band is clipped to `within`, the values that the quantity can take.
    """
    band = mean_band(as_array(per_seed))
    bounded = np.isfinite(band.low)
    low = np.where(bounded, np.clip(band.low, *within), np.nan)
    high = np.where(bounded, np.clip(band.high, *within), np.nan)
    draw_band(ax, x, band.mean, low, high, look)


def draw_seeds(
    ax: Axes,
    groups: Sequence[tuple[str, npt.ArrayLike, Look]],
    ylabel: str,
    *,
    within: tuple[float, float] = (-np.inf, np.inf),
) -> None:
    """One dot a seed for each named group, with the mean and its 95% t interval beside them.

    The interval is clipped to `within`, the values that the quantity can take.
    """
    for place, (_, values, look) in enumerate(groups):
        dots = as_array(values)
        dots = dots[np.isfinite(dots)]
        shift = np.linspace(-0.16, -0.02, dots.size)
        ax.plot(place + shift, dots, look.marker, color=look.colour, ms=3.5, alpha=0.75, mew=0)
        estimate = mean_interval(dots)
        if np.isfinite(estimate.low):
            ends = np.clip([estimate.low, estimate.high], *within)
            ax.plot([place + 0.14] * 2, ends, color=BLACK, lw=1.1)
        if dots.size:
            ax.plot(place + 0.14, estimate.mean, look.marker, mfc="white", mec=BLACK, ms=5)
    ax.set_xticks(range(len(groups)), [name for name, _, _ in groups])
    ax.set_xlim(-0.5, len(groups) - 0.5)
    ax.set_ylabel(ylabel)
    ax.grid(axis="x", visible=False)
