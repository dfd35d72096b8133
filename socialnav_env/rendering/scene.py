"""What a picture of the corridor shows."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

STANDING = 0.05
"""Whoever is slower stands still [m/s] (the bound of the field's stalled-time metric)."""


class SceneError(ValueError):
    """A scene that cannot be drawn: an array of another shape, or numbers that are not finite."""


@dataclass(frozen=True, eq=False)
class Scene:
    """One moment of the corridor, all that a picture needs.

    The arrays are copied to float64.

    Raises:
        SceneError: An array has another shape, or holds NaN or an infinity.
    """

    robot: NDArray[np.float64]
    """(3,) x [m], z [m] and heading [rad]: 0 faces +z, positive turns towards +x."""
    people: NDArray[np.float64]
    """(H, 5) x, z [m], heading [rad] and vx, vz [m/s], one row a person."""
    goals: NDArray[np.float64]
    """(2, 2) x, z [m] of the intermittent goal, then of the end goal."""
    collected: bool
    """The intermittent goal has been collected."""
    reached: bool
    """The end goal has been reached."""
    trail: NDArray[np.float64]
    """(K, 2) x, z [m] of where the robot has been, oldest first; K may be 0."""

    def __post_init__(self) -> None:
        """Copy the arrays and check them."""
        for name, shape in _SHAPES.items():
            object.__setattr__(self, name, checked_array(name, getattr(self, name), shape))


_SHAPES: dict[str, tuple[int | None, ...]] = {
    "robot": (3,),
    "people": (None, 5),
    "goals": (2, 2),
    "trail": (None, 2),
}


def checked_array(name: str, value: object, shape: tuple[int | None, ...]) -> NDArray[np.float64]:
    """The value as a fresh float64 array of that shape (None: any length).

    Raises:
        SceneError: It has another shape, or holds NaN or an infinity.
    """
    array = np.array(value, dtype=np.float64)
    fits = array.ndim == len(shape) and all(
        want in (None, got) for want, got in zip(shape, array.shape, strict=True)
    )
    if not fits:
        expected = ", ".join("any" if size is None else str(size) for size in shape)
        raise SceneError(f"{name}: expected an array of shape ({expected}), got {array.shape}")
    if not np.isfinite(array).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise SceneError(
            f"{name}: expected finite numbers, got {array[where]} at {where}; "
            "the state was broken before it was drawn"
        )
    return array


def breadcrumbs(
    trail: NDArray[np.float64], spacing: float, reach: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points at equal distances along a trail, and how fresh each one is.

    They are counted from the oldest point, so that they stay where they are as the trail grows.

    Args:
        trail: (K, 2) x, z [m], oldest first.
        spacing: Distance between the points along the trail [m].
        reach: Freshness falls from 1 to 0 over this distance back from the newest point [m].

    Returns:
        Points (n, 2) and freshness (n,) in (0, 1]; none where the trail has no length.
    """
    steps = np.hypot(*np.diff(trail, axis=0).T)
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    length = float(travelled[-1]) if len(trail) else 0.0
    first = max(0, math.ceil((length - reach) / spacing))
    distance = spacing * np.arange(first, math.ceil(length / spacing), dtype=np.float64)
    freshness: NDArray[np.float64] = 1.0 - (length - distance) / reach
    if not len(distance):
        return np.empty((0, 2)), freshness
    x, z = (np.interp(distance, travelled, trail[:, axis]) for axis in (0, 1))
    return np.stack([x, z], axis=1), freshness


def stride(x: float, z: float, step: float = 0.6) -> int:
    """Which foot of a walker is ahead, 0 or 1.

    The floor is a chessboard of squares one step [m] wide: whoever walks straight on changes feet
    with every square, and the same place always shows the same foot, whatever went before.
    """
    return int(math.floor(x / step) + math.floor(z / step)) % 2
