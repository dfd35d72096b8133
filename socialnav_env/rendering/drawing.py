"""Robot, people, goals and trail as figures in colours that everyone can tell apart.

Nothing here paints; :mod:`socialnav_env.rendering` turns these numbers into pixels. A figure is
made of filled polygons in its own axes ``(forward, left)`` in metres, seen from above; robot and
people also have a drawing from ``assets/sprites``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Colour = tuple[int, int, int, int]
"""Red, green, blue and opacity, each 0 to 255."""

# Okabe and Ito (2008): tell these apart with any colour vision.
PEOPLE: tuple[Colour, ...] = (
    (0, 114, 178, 255),
    (213, 94, 0, 255),
    (204, 121, 167, 255),
    (86, 180, 233, 255),
    (72, 74, 82, 255),
    (214, 186, 60, 255),
)
"""The clothes' colour of each look; also that of the personal space."""
DRAWN = 1.28
"""Half of a drawing's side, in radii of the disc that collides."""
INTERMITTENT: Colour = (230, 159, 0, 255)
GOAL: Colour = (0, 158, 115, 255)
GREY: Colour = (158, 160, 163, 255)
INK: Colour = (44, 54, 66, 255)
WHITE: Colour = (255, 255, 255, 255)


class Shape(NamedTuple):
    """A filled polygon. It replaces what lies beneath it, opacity included."""

    points: NDArray[np.float64]
    """(N, 2) forward, left [m]."""
    colour: Colour


class Picture(NamedTuple):
    """A drawing from the assets, laid over a figure's shapes."""

    name: str
    """File name without its ending."""
    reach: float
    """Half of the drawing's side [m]."""
    mirrored: bool = False
    """Left and right are swapped."""


@dataclass(frozen=True, eq=False)
class Figure:
    """Shapes drawn one over the other; two figures are equal only if they are the same object."""

    shapes: tuple[Shape, ...]
    picture: Picture | None = None

    @cached_property
    def extent(self) -> float:
        """Radius of the smallest disc around the figure's origin that holds it [m]."""
        corners = [float(np.hypot(*shape.points.T).max()) for shape in self.shapes]
        return max(*corners, self.picture.reach if self.picture else 0.0)


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


def _drop(colour: Colour, radius: float, tip: float) -> Shape:
    """A disc drawn out to a point ahead, the tip so many radii from its centre: a heading."""
    side = math.acos(1.0 / tip)
    angle = np.linspace(side, 2.0 * np.pi - side, 33)
    rim = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return Shape(radius * np.concatenate([rim, [[tip, 0.0]]]), colour)


@lru_cache(maxsize=64)
def robot_figure(radius: float) -> Figure:
    """A Pepper seen from above on a drop that points ahead.

    The round part of the drop is the robot's own disc, the one that collides.
    """
    return Figure((_drop(INK, radius, 2.0),), Picture("robot", DRAWN * radius))


@lru_cache(maxsize=256)
def person_figure(radius: float, look: int, walking: bool, foot: int) -> Figure:
    """A person seen from above on a faint drop that points ahead, further for who walks.

    The round part of the drop is the person's own disc, the one that collides.

    Args:
        radius: Radius of the disc [m].
        look: Which of the looks, below len(PEOPLE).
        walking: Whether the person walks or stands.
        foot: Which foot of a walker is ahead, 0 or 1.
    """
    drop = _drop(_faint(PEOPLE[look], 110), radius, 1.75 if walking else 1.3)
    posture = "walking" if walking else "standing"
    picture = Picture(f"person_{look}_{posture}", DRAWN * radius, mirrored=bool(walking and foot))
    return Figure((drop,), picture)


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
