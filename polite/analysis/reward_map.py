"""Where a reward model pays: by position, by distance, on the floor plan (Fig. 5a, b)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from polite.analysis.numbers import Array, as_json
from polite.types import ShapeError


@dataclass(frozen=True)
class Profile:
    """Mean reward in B bins of a position or a distance, for S seeds; NaN where a bin is empty."""

    centre: Array
    """(B,) middle of each bin, in the unit of the position."""
    mean: Array
    """(B,) mean over the states of the bin, averaged over seeds."""
    std: Array
    """(B,) standard deviation over the states of the bin, averaged over seeds."""
    per_seed: Array
    """(S, B) mean over the states of the bin, one row a seed."""

    def as_json(self, axis: str) -> dict[str, Any]:
        """Plain lists `{axis, mean, std, per_seed}`, the bin centres under the name `axis`."""
        return {
            axis: as_json(self.centre),
            "mean": as_json(self.mean),
            "std": as_json(self.std),
            "per_seed": as_json(self.per_seed),
        }


def profile(position: Array, rewards: Array, edges: Array) -> Profile:
    """Mean and spread of the reward in each bin.

    Args:
        position: (M,) where each state lies; states outside the edges are left out.
        rewards: (S, M) the reward that each seed's model gives to each state.
        edges: (B+1,) increasing bin edges; the last bin holds its right edge too.

    Returns:
        The profile over B bins.

    Raises:
        ShapeError: When the shapes do not fit.
    """
    position, rewards, edges = (np.asarray(a, dtype=float) for a in (position, rewards, edges))
    if rewards.ndim != 2 or rewards.shape[1:] != position.shape:
        raise ShapeError(
            f"rewards: expected (S, M) with M = {position.size} positions, got {rewards.shape}"
        )
    bins, inside = _bin_of(position, edges)
    member = np.zeros((position.size, edges.size - 1))
    member[np.flatnonzero(inside), bins[inside]] = 1.0  # (M, B)
    count = member.sum(axis=0)
    share = member / np.where(count > 0, count, np.nan)  # NaN column where a bin is empty
    per_seed = rewards @ share  # (S, B)
    deviation = (rewards - np.where(inside, per_seed[:, bins], 0.0)) ** 2  # (S, M)
    return Profile(
        centre=(edges[:-1] + edges[1:]) / 2,
        mean=per_seed.mean(axis=0),
        std=np.sqrt(deviation @ share).mean(axis=0),
        per_seed=per_seed,
    )


def standardise(rewards: Array) -> Array:
    """(S, M) rewards with mean 0 and standard deviation 1 over the states, seed by seed.

    A reward is learned from comparisons only, so its scale is free and a saturated tanh alone can
    widen a map; standardised maps show the shape without the scale. A constant row stays at 0.
    """
    centred = np.asarray(rewards, dtype=float)
    centred = centred - centred.mean(axis=-1, keepdims=True)
    scale = centred.std(axis=-1, keepdims=True)
    return np.asarray(centred / np.where(scale > 0, scale, 1.0), dtype=float)


def spread(curve: Array) -> Array:
    """Standard deviation over the bins that hold data: (..., B) -> (...)."""
    return np.asarray(np.nanstd(np.asarray(curve, dtype=float), axis=-1))


def reward_map_part(z: Array, rewards: Array, edges: Array) -> dict[str, Any]:
    """`reward_map.{condition}` of results.json: profile over z, raw and standardised, spreads."""
    raw = profile(z, rewards, edges)
    scaled = profile(z, standardise(rewards), edges)
    return raw.as_json("z") | {
        "standardised": {
            "mean": as_json(scaled.mean),
            "std": as_json(scaled.std),
            "per_seed": as_json(scaled.per_seed),
        },
        "spread": float(spread(raw.mean)),
        "standardised_spread": float(spread(scaled.mean)),
    }


def map_2d_part(
    x: Array, z: Array, rewards: Array, x_edges: Array, z_edges: Array
) -> dict[str, Any]:
    """`reward_map_2d.{condition}` of results.json: mean reward over states and seeds on the floor.

    Args:
        x: (M,) lateral position of each state, metres.
        z: (M,) position along the corridor, metres.
        rewards: (S, M) rewards of each seed's model.
        x_edges: (nx+1,) bin edges across.
        z_edges: (nz+1,) bin edges along.

    Returns:
        `{x (nx), z (nz), mean (nz, nx)}`, null where a cell holds no state.
    """
    value = np.asarray(rewards, dtype=float).mean(axis=0)
    count, *_ = np.histogram2d(z, x, bins=(z_edges, x_edges))
    total, *_ = np.histogram2d(z, x, bins=(z_edges, x_edges), weights=value)
    mean = np.where(count > 0, total / np.maximum(count, 1.0), np.nan)
    return {
        "x": as_json((x_edges[:-1] + x_edges[1:]) / 2),
        "z": as_json((z_edges[:-1] + z_edges[1:]) / 2),
        "mean": as_json(mean),
    }


def _bin_of(position: Array, edges: Array) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Bin index (M,) of each position, and which positions lie inside the edges."""
    inside = (position >= edges[0]) & (position <= edges[-1])
    bins = np.clip(np.searchsorted(edges, position, side="right") - 1, 0, edges.size - 2)
    return bins, inside
