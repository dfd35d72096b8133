"""Fig. 5c: the divergence of the two reward models during training."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from polite.plots.curves import draw_seed_band
from polite.plots.style import GREEN, GREY, LOOKS, ORANGE, Look

FORWARD = replace(LOOKS["polite"], label="POLITE ‖ baseline")


def draw_divergence(ax: Axes, kl: Mapping[str, Any]) -> Axes:
    """KL(POLITE‖baseline), Gaussian closed form, with both null curves; bands: 95% t over seeds."""
    for look, key in (
        (LOOKS["null_seed"], "null_seed"),
        (LOOKS["null_shuffled"], "null_shuffled"),
        (FORWARD, "per_seed"),
    ):
        draw_seed_band(ax, kl["epochs"], kl[key], look, within=(0, np.inf))
    return _finish(ax)


def draw_divergence_forms(ax: Axes, kl: Mapping[str, Any]) -> Axes:
    """The same by histogram, the other way round, and of centred rewards."""
    forms = (
        (replace(FORWARD, label="POLITE ‖ baseline, Gaussian"), kl),
        (Look("POLITE ‖ baseline, histogram", GREEN, "--", "^"), kl["histogram"]),
        (Look("baseline ‖ POLITE, Gaussian", ORANGE, ":", "s"), kl["reverse"]),
        (Look("POLITE ‖ baseline, means taken out", GREY, "-.", "D"), kl["centred"]),
    )
    for look, part in forms:
        draw_seed_band(ax, kl["epochs"], part["per_seed"], look, within=(0, np.inf))
    return _finish(ax)


def _finish(ax: Axes) -> Axes:
    ax.set_xlim(left=0)
    ax.set_ylim(bottom=0)
    ax.set_xlabel("training epoch of the reward models")
    ax.set_ylabel("KL divergence [nats]")
    ax.legend(
        loc="upper left",
        handlelength=2.8,
        alignment="left",
        title="mean over seeds, band: 95% t interval",
        title_fontsize=7,
    )
    # Headroom, so that the legend covers no curve.
    ax.set_ylim(top=ax.get_ylim()[1] * 1.6)
    return ax
