"""Which keys drive the robot, and which action they stand for."""

from __future__ import annotations

from collections.abc import Collection
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

KEYS = {
    "unicycle": {"up": (0, 2.0), "left": (1, 1.0), "right": (1, -1.0)},
    "holonomic": {
        "up": (0, 1.0),
        "down": (0, -1.0),
        "left": (1, 1.0),
        "right": (1, -1.0),
        "a": (2, 1.0),
        "d": (2, -1.0),
    },
}
"""For each kind of action: name of a key -> the entry that it changes, and by how much."""
IDLE = {"unicycle": (-1.0, 0.0), "holonomic": (0.0, 0.0, 0.0)}
"""For each kind of action: the one under which the robot stands."""
CODES = {
    "right": 1 << 30 | 79,
    "left": 1 << 30 | 80,
    "down": 1 << 30 | 81,
    "up": 1 << 30 | 82,
    "a": ord("a"),
    "d": ord("d"),
}
"""Name of a key -> SDL's key code, which pygame and `gymnasium.utils.play` use."""


def action_of(pressed: Collection[str], kind: str) -> NDArray[np.float32]:
    """The action that keys stand for; keys against each other cancel out, others mean nothing.

    Args:
        pressed: Names of the keys.
        kind: "unicycle" or "holonomic", as `CorridorConfig.action`.
    """
    action = np.array(IDLE[kind], dtype=np.float32)
    for key in pressed:
        if key in KEYS[kind]:
            index, amount = KEYS[kind][key]
            action[index] += amount
    return action


def keys_to_action(kind: str) -> dict[tuple[int, ...], NDArray[np.float32]]:
    """Every combination of keys, as `gymnasium.utils.play` wants it."""
    keys = [*KEYS[kind]]
    pressed = [some for count in range(1, len(keys) + 1) for some in combinations(keys, count)]
    return {tuple(CODES[key] for key in some): action_of(some, kind) for some in pressed}
