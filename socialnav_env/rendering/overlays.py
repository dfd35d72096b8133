"""What may be laid over a picture of the corridor, and the numbers that it shows."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from socialnav_env.config import ConfigError
from socialnav_env.rendering.scene import SceneError, checked_array

OVERLAYS = ("rays", "personal_space", "forces", "reward", "trajectory")
"""The overlays there are."""
DEFAULT_OVERLAYS = ("personal_space", "trajectory")
"""The overlays of a picture for which nobody asked for others."""
CAMERAS = ("corridor", "robot")
"""The whole corridor, or the part of it around the robot."""

METRES_PER_FORCE = 1.0
"""Length of an arrow for 1 m/s^2 [m]."""
LONGEST_ARROW = 2.5
"""No arrow is longer than this [m]."""
ARROW_HEAD = 0.5
"""Length and width of an arrow's head [m]; its shaft is a third as wide."""
SMALLEST_TERM = 0.001
"""A bar is as long as the logarithm of its term's size over this."""


@dataclass(frozen=True, eq=False)
class Annotations:
    """Numbers beside a scene that overlays show; None is not drawn. The arrays are copied.

    Raises:
        SceneError: An array has another shape, or a number is not finite.
    """

    rays: NDArray[np.float64] | None = None
    """(9,) the robot's ranges, from its right to its left over half a turn [m]."""
    forces: NDArray[np.float64] | None = None
    """(H, 2) each person's acceleration by the social force, x, z [m/s^2]."""
    terms: Mapping[str, float] | None = None
    """The last step's reward terms by name."""

    def __post_init__(self) -> None:
        """Copy the arrays and check all numbers."""
        for name, shape in (("rays", (9,)), ("forces", (None, 2))):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, checked_array(name, value, shape))
        for name, term in (self.terms or {}).items():
            if not math.isfinite(term):
                raise SceneError(f"terms: expected finite numbers, got {name}={term}")


def check_look(camera: str, overlays: Collection[str]) -> None:
    """Check the keywords that say how pictures look.

    Raises:
        ConfigError: The camera or an overlay is unknown; the message lists the valid ones.
    """
    if camera not in CAMERAS:
        raise ConfigError(f"camera={camera!r}: expected one of {', '.join(CAMERAS)}")
    many = isinstance(overlays, Collection) and not isinstance(overlays, str)
    if not many or not all(name in OVERLAYS for name in overlays):
        raise ConfigError(f"overlays={overlays!r}: expected some of {', '.join(OVERLAYS)}")


def ray_ends(robot: NDArray[np.float64], rays: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where the rays end.

    Args:
        robot: (3,) x, z [m] and heading [rad].
        rays: (R,) lengths [m], evenly spread over half a turn, the right first.

    Returns:
        (R, 2) x, z [m].
    """
    angle = robot[2] + np.linspace(-0.5 * np.pi, 0.5 * np.pi, len(rays))
    ends: NDArray[np.float64] = robot[:2] + rays[:, None] * np.stack(
        [np.sin(angle), np.cos(angle)], axis=1
    )
    return ends


def arrow(force: NDArray[np.float64], start: float) -> NDArray[np.float64]:
    """Outline of the arrow of a force, seen from whom it pulls.

    Args:
        force: (2,) x, z [m/s^2], not zero.
        start: How far from the origin the arrow begins [m].

    Returns:
        (7, 2) corners x, z [m].
    """
    size = float(np.hypot(*force))
    length = min(METRES_PER_FORCE * size, LONGEST_ARROW)
    head = min(ARROW_HEAD, length)
    half = head / 6.0  # a short arrow is a small one
    neck, tip = start + length - head, start + length
    ahead = np.array([start, neck, neck, tip, neck, neck, start])
    aside = np.array([half, half, 3.0 * half, 0.0, -3.0 * half, -half, -half])
    direction = force / size
    outline: NDArray[np.float64] = np.outer(ahead, direction) + np.outer(
        aside, [direction[1], -direction[0]]
    )
    return outline


def bar_share(term: float) -> float:
    """Signed length of a reward term's bar, 1 for a term of 1 or more.

    Terms of a step span three decades, so the length is logarithmic: 0.001 is a tenth of 1.
    """
    share = math.log10(1.0 + abs(term) / SMALLEST_TERM) / math.log10(1.0 + 1.0 / SMALLEST_TERM)
    return math.copysign(min(share, 1.0), term)
