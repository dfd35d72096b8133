"""What a picture of the corridor shows, and how the corridor lies in it.

Nothing here paints; :mod:`socialnav_env.rendering` turns these numbers into pixels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from socialnav_env.config import CorridorConfig

WALL_THICKNESS = 0.3
"""Drawn thickness of the walls [m]."""
MARGIN = 0.25
"""Blank space outside the walls [m]."""
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
    """(H, 4) x, z [m] and vx, vz [m/s], one row a person."""
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
            object.__setattr__(self, name, _checked(name, getattr(self, name), shape))


_SHAPES: dict[str, tuple[int | None, ...]] = {
    "robot": (3,),
    "people": (None, 4),
    "goals": (2, 2),
    "trail": (None, 2),
}


def _checked(name: str, value: object, shape: tuple[int | None, ...]) -> NDArray[np.float64]:
    """The value as a fresh float64 array of that shape (None: any length), or SceneError."""
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


class View(NamedTuple):
    """How the corridor lies in a picture: z to the right, x upwards."""

    width: int
    """Width of the picture [px]."""
    height: int
    """Height of the picture [px], a multiple of 16 as video encoders like it."""
    scale: float
    """Pixels per metre."""
    column: float
    """Where z = 0 lies [px]."""
    row: float
    """Where x = 0 lies [px]."""
    font: int
    """Height of the lettering [px]."""


@lru_cache(maxsize=64, typed=True)  # typed, or 640.0 and True would pass for 640 and 1
def view_of(config: CorridorConfig, width: int) -> View:
    """The view that fits the whole corridor, its walls and its axis into a width.

    Raises:
        ValueError: The width is no whole number in [64, 4096].
    """
    if isinstance(width, bool) or not isinstance(width, int) or not 64 <= width <= 4096:
        raise ValueError(f"width={width!r}: expected a whole number of pixels in [64, 4096]")
    frame = WALL_THICKNESS + MARGIN
    scale = width / (2 * (config.half_length + frame))
    # On half a pixel, so that a mirrored scene gives a mirrored picture.
    row = round(2 * scale * (config.half_width + frame)) / 2
    font = max(11, round(width / 62))
    floor = row + scale * (config.half_width + WALL_THICKNESS)
    height = 16 * math.ceil((floor + 2.9 * font) / 16)
    return View(width, height, scale, width / 2, row, font)


def world_to_pixel(
    points: NDArray[np.float64], config: CorridorConfig, width: int = 960
) -> NDArray[np.float64]:
    """Where points of the corridor lie in its picture.

    Args:
        points: (..., 2) x, z [m].
        config: The corridor.
        width: Width of the picture [px].

    Returns:
        (..., 2) column, row [px], fractional; pixel ``picture[i, j]`` covers [j, j+1) × [i, i+1).
    """
    view = view_of(config, width)
    x, z = np.moveaxis(np.asarray(points, dtype=np.float64), -1, 0)
    return np.stack([view.column + view.scale * z, view.row - view.scale * x], axis=-1)


def walking_heading(vx: float, vz: float) -> float:
    """Heading of a person from the velocity [rad]; who stands looks down the corridor, to −z."""
    return math.atan2(vx, vz) if math.hypot(vx, vz) >= STANDING else math.pi


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
