"""Robot, people, goals and trail as filled polygons in colours that everyone can tell apart.

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
