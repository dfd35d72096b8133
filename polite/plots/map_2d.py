"""The learned reward on the floor plan: a heat map with walls, goals and people."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh

from polite.analysis.numbers import Array, as_array
from polite.plots.scene import draw_floor


def draw_map_2d(
    ax: Axes,
    part: Mapping[str, Any],
    scene: Mapping[str, Any],
    limits: tuple[float, float],
    *,
    standardised: bool = False,
) -> QuadMesh:
    """Mean r̂ over the corridor's floor; the mesh comes back for a colour bar.

    Cells without a state stay white. The colour scale runs evenly in lightness (cividis), so it
    reads alike with any colour vision and in print.

    Args:
        ax: Where to draw.
        part: `reward_map_2d.{condition}` of results.json.
        scene: `scene` of results.json.
        limits: Values at the ends of the colour scale.
        standardised: Draw `standard_scores` of the cells instead of r̂.
    """
    x, z, values = (as_array(part[name]) for name in ("x", "z", "mean"))
    cells = standard_scores(values) if standardised else values
    mesh = ax.pcolormesh(
        _edges(z),
        _edges(x),
        np.ma.masked_invalid(cells.T),
        cmap="cividis",
        vmin=limits[0],
        vmax=limits[1],
        rasterized=True,
    )
    draw_floor(ax, scene)
    ax.set_ylabel("x [m]")
    return mesh


def standard_scores(cells: Array) -> Array:
    """Cells (nz, nx) minus their mean, over their standard deviation; empty cells stay NaN."""
    scale = float(np.nanstd(cells))
    return np.asarray((cells - np.nanmean(cells)) / (scale if scale > 0 else 1.0), dtype=float)


def shared_limits(parts: Mapping[str, Any], *, standardised: bool = False) -> tuple[float, float]:
    """The 1% and 99% quantiles of both models' cells, so that both share one scale."""
    cells = [as_array(part["mean"]) for part in parts.values()]
    values = np.concatenate([(standard_scores(c) if standardised else c).ravel() for c in cells])
    low, high = np.nanquantile(values, [0.01, 0.99])
    return float(low), float(high)


def _edges(centres: Array) -> Array:
    """Bin edges (B+1,) of evenly spaced centres (B,)."""
    half = (centres[1] - centres[0]) / 2
    return np.append(centres - half, centres[-1] + half)
