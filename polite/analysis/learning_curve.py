"""A learning curve from the episodes that a training finished."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

POINTS = 20
"""At most so many points a curve."""


def learning_curve(
    episodes: Sequence[Mapping[str, float]], steps: int, points: int = POINTS
) -> dict[str, list[float]]:
    """Mean of every quantity over the episodes that ended in each of equal stretches of training.

    Args:
        episodes: for each `step`, when it ended, and any numbers; what only some of them have has
            no curve.
        steps: env steps of the whole training.
        points: stretches; those in which no episode ended are left out.

    Returns:
        `steps`, the end of each stretch, `episodes`, how many ended there, and the means.
    """
    if not episodes:
        return {"steps": [], "episodes": []}
    shared = set(episodes[0]).intersection(*episodes)
    names = [name for name in episodes[0] if name in shared and name != "step"]
    ended = np.array([episode["step"] for episode in episodes])
    stretch = np.clip(np.ceil(ended / steps * points).astype(np.int64), 1, points)
    shown, inverse, counts = np.unique(stretch, return_inverse=True, return_counts=True)
    curve = {"steps": (shown * steps / points).tolist(), "episodes": counts.tolist()}
    for name in names:
        values = np.array([episode[name] for episode in episodes])
        curve[name] = (np.bincount(inverse, weights=values) / counts).tolist()
    return curve
