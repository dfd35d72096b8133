"""What the corridor's picture is made of: the scene, the view, and figures as filled polygons.

Nothing here paints; :mod:`socialnav_env.rendering` turns these numbers into pixels. A figure is
drawn in its own axes ``(forward, left)`` in metres, seen from above.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from socialnav_env.config import CorridorConfig

Colour = tuple[int, int, int, int]
"""Red, green, blue and opacity, each 0 to 255."""

# Okabe and Ito (2008): tell these apart with any colour vision.
PEOPLE: tuple[Colour, ...] = (
    (0, 114, 178, 255),
    (213, 94, 0, 255),
    (204, 121, 167, 255),
    (86, 180, 233, 255),
)
INTERMITTENT: Colour = (230, 159, 0, 255)
GOAL: Colour = (0, 158, 115, 255)
GREY: Colour = (158, 160, 163, 255)
INK: Colour = (44, 54, 66, 255)
WHITE: Colour = (255, 255, 255, 255)
EDGE: Colour = (122, 134, 148, 255)
SCREEN: Colour = (120, 190, 235, 255)
BASE: Colour = (206, 212, 219, 255)

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


# --- figures -------------------------------------------------------------------------------------


class Shape(NamedTuple):
    """A filled polygon. It replaces what lies beneath it, opacity included."""

    points: NDArray[np.float64]
    """(N, 2) forward, left [m]."""
    colour: Colour


@dataclass(frozen=True, eq=False)
class Figure:
    """Shapes drawn one over the other; two figures are equal only if they are the same object."""

    shapes: tuple[Shape, ...]

    @property
    def extent(self) -> float:
        """Radius of the smallest disc around the figure's origin that holds it [m]."""
        return max(float(np.hypot(*shape.points.T).max()) for shape in self.shapes)


def _ellipse(
    colour: Colour, forward: float, left: float, half_forward: float, half_left: float
) -> Shape:
    """An ellipse given by its centre and half axes [m], small enough for 28 corners."""
    angle = np.linspace(0.0, 2.0 * np.pi, 28, endpoint=False)
    points = np.stack(
        [forward + half_forward * np.cos(angle), left + half_left * np.sin(angle)], axis=1
    )
    return Shape(points, colour)


def _disc(colour: Colour, radius: float) -> Shape:
    """A disc around the origin [m]."""
    angle = np.linspace(0.0, 2.0 * np.pi, 120, endpoint=False)
    return Shape(radius * np.stack([np.cos(angle), np.sin(angle)], axis=1), colour)


def _polygon(colour: Colour, size: float, *corners: tuple[float, float]) -> Shape:
    """A polygon whose corners are given in units of a size [m]."""
    return Shape(size * np.array(corners), colour)


def _faint(colour: Colour, opacity: int) -> Colour:
    """The same colour with another opacity."""
    return (*colour[:3], opacity)


def _mixed(colour: Colour, other: Colour, share: float) -> Colour:
    """A colour with a share of another one in it."""
    red, green, blue, opacity = (
        round((1.0 - share) * mine + share * theirs)
        for mine, theirs in zip(colour, other, strict=True)
    )
    return red, green, blue, opacity


def _scaled(radius: float, *parts: tuple[Colour, float, float, float, float]) -> list[Shape]:
    """Ellipses whose numbers are given in units of a radius [m]."""
    return [_ellipse(colour, *(radius * number for number in rest)) for colour, *rest in parts]


def _drop(colour: Colour, radius: float, tip: float) -> Shape:
    """A disc drawn out to a point ahead, the tip so many radii from its centre: a heading."""
    side = math.acos(1.0 / tip)
    angle = np.linspace(side, 2.0 * np.pi - side, 33)
    rim = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return Shape(radius * np.concatenate([rim, [[tip, 0.0]]]), colour)


@lru_cache(maxsize=64)
def robot_figure(radius: float) -> Figure:
    """A Pepper seen from above: base, arms, shoulders, tablet, head with eyes, heading wedge.

    The round part of the outline is the robot's own disc, the one that collides.
    """
    body = _scaled(
        radius,
        (BASE, 0.0, 0.0, 0.82, 0.82),
        (EDGE, 0.20, 0.66, 0.44, 0.22),
        (EDGE, 0.20, -0.66, 0.44, 0.22),
        (WHITE, 0.20, 0.66, 0.36, 0.14),
        (WHITE, 0.20, -0.66, 0.36, 0.14),
        (EDGE, -0.10, 0.0, 0.50, 0.78),
        (WHITE, -0.10, 0.0, 0.42, 0.70),
    )
    tablet = [
        _polygon(INK, radius, (0.36, 0.40), (0.72, 0.34), (0.72, -0.34), (0.36, -0.40)),
        _polygon(SCREEN, radius, (0.46, 0.31), (0.64, 0.26), (0.64, -0.26), (0.46, -0.31)),
    ]
    head = _scaled(
        radius,
        (EDGE, -0.06, 0.0, 0.52, 0.52),
        (WHITE, -0.06, 0.0, 0.44, 0.44),
        (INK, 0.16, 0.20, 0.13, 0.12),
        (INK, 0.16, -0.20, 0.13, 0.12),
    )
    return Figure((_drop(INK, radius, 2.0), *body, *tablet, *head))


@lru_cache(maxsize=64)
def person_figure(radius: float, colour: Colour) -> Figure:
    """A person seen from above: shoulders, arms, head with the face ahead, a heading wedge.

    The round part of the faint outline is the person's own disc, the one that collides.
    """
    dark, light = _mixed(colour, INK, 0.5), _mixed(colour, WHITE, 0.8)
    body = _scaled(
        radius,
        (dark, 0.18, 0.72, 0.36, 0.24),
        (dark, 0.18, -0.72, 0.36, 0.24),
        (light, 0.32, 0.72, 0.14, 0.14),
        (light, 0.32, -0.72, 0.14, 0.14),
        (dark, -0.02, 0.0, 0.54, 0.94),
        (colour, -0.02, 0.0, 0.44, 0.84),
        (dark, 0.06, 0.0, 0.50, 0.48),
        (light, 0.14, 0.0, 0.36, 0.36),
        (dark, -0.06, 0.0, 0.36, 0.40),
    )
    return Figure((_drop(_faint(colour, 120), radius, 1.75), *body))


@lru_cache(maxsize=64)
def space_figure(radius: float, colour: Colour) -> Figure:
    """Personal space: a dashed ring around a faint disc of that radius [m]."""
    inner = radius - min(0.06, 0.5 * radius)
    arc = np.radians(np.linspace(-2.5, 2.5, 5))
    dashes = []
    for middle in np.radians(np.arange(0.0, 360.0, 10.0)):
        rim = np.stack([np.cos(middle + arc), np.sin(middle + arc)], axis=1)
        dash = np.concatenate([radius * rim, inner * rim[::-1]])
        dashes.append(Shape(dash, _faint(colour, 190)))
    return Figure((_disc(_faint(colour, 22), radius), *dashes))


def _marker(radius: float, colour: Colour, fill: int) -> list[Shape]:
    """The disc within which a goal counts: a solid rim and a see-through inside."""
    return [_disc(colour, radius), _disc(_faint(colour, fill), radius - 0.08)]


@lru_cache(maxsize=64)
def intermittent_figure(radius: float, collected: bool) -> Figure:
    """The intermittent goal: a gold ring with a star, both grey once it is collected."""
    colour = GREY if collected else INTERMITTENT
    turn = np.pi / 2 + np.arange(10) * np.pi / 5
    reach = radius * np.where(np.arange(10) % 2 == 0, 0.66, 0.28)
    star = np.stack([reach * np.cos(turn), reach * np.sin(turn)], axis=1)
    return Figure((*_marker(radius, colour, 40), Shape(star, colour)))


@lru_cache(maxsize=64)
def goal_figure(radius: float, reached: bool) -> Figure:
    """The end goal: a green ring with a flag; filled green with a white flag once reached."""
    colour = WHITE if reached else GOAL
    flag = [
        _polygon(colour, radius, (-0.34, -0.62), (-0.34, 0.62), (-0.22, 0.62), (-0.22, -0.62)),
        _polygon(colour, radius, (-0.22, 0.62), (0.52, 0.32), (-0.22, 0.02)),
    ]
    return Figure((*_marker(radius, GOAL, 255 if reached else 40), *flag))


@lru_cache(maxsize=64)
def crumb_figure(radius: float, opacity: int) -> Figure:
    """One dot of the robot's trail."""
    return Figure((_disc(_faint(INK, opacity), radius),))
