"""How the corridor lies in a picture: z to the right, x upwards."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from socialnav_env.config import CorridorConfig

WALL_THICKNESS = 0.3
"""Drawn thickness of the walls [m]."""
MARGIN = 0.25
"""Blank space outside the walls [m]."""
FRAME = WALL_THICKNESS + MARGIN
"""What is drawn outside the corridor on each side [m]."""
CLOSE_UP = 12.0
"""How much of the corridor's length the camera that follows the robot shows [m]."""
AXIS_LINES, REWARD_LINES = 2.9, 4.2
"""Height of what stands beneath the corridor, in heights of the lettering."""


class View(NamedTuple):
    """How the corridor lies in a picture."""

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
    strip: float
    """Where the strip of reward terms begins [px]; beneath the picture where there is none."""

    def place(self, x: float, z: float) -> tuple[float, float]:
        """Column and row [px] of a point of the corridor [m]."""
        return self.column + self.scale * z, self.row - self.scale * x

    def near(self, column: float, row: float) -> bool:
        """Whether a place is less than a picture away from the picture."""
        return -self.width < column < 2 * self.width and -self.height < row < 2 * self.height


@lru_cache(maxsize=64, typed=True)  # typed, or 640.0 and True would pass for 640 and 1
def view_of(
    config: CorridorConfig, width: int, camera: str = "corridor", rewards: bool = False
) -> View:
    """The view of the corridor's middle.

    Args:
        config: The corridor.
        width: Width of the picture [px].
        camera: "corridor" fits the whole length into the width, "robot" a part of it.
        rewards: Leave room for a strip of reward terms beneath.

    Raises:
        ValueError: The width is no whole number in [64, 4096].
    """
    if isinstance(width, bool) or not isinstance(width, int) or not 64 <= width <= 4096:
        raise ValueError(f"width={width!r}: expected a whole number of pixels in [64, 4096]")
    shown = 2 * (config.half_length + FRAME)
    if camera == "robot":
        # A wide corridor is shown at greater length, or the picture would be a tower.
        shown = min(shown, max(CLOSE_UP, 3.0 * (config.half_width + FRAME)))
    scale = width / shown
    # On half a pixel, so that a mirrored scene gives a mirrored picture.
    row = round(2 * scale * (config.half_width + FRAME)) / 2
    font = max(11, round(width / 62))
    strip = row + scale * (config.half_width + WALL_THICKNESS) + AXIS_LINES * font
    height = 16 * math.ceil((strip + rewards * REWARD_LINES * font) / 16)
    return View(width, height, scale, width / 2, row, font, strip)


def centred(view: View, config: CorridorConfig, z: float) -> View:
    """The view moved along the corridor until z [m] is in its middle, or the end wall in sight.

    It moves by whole pixels, so that what stands still keeps its shape.
    """
    reach = config.half_length + FRAME - 0.5 * view.width / view.scale
    middle = min(max(z, -reach), reach)
    return view._replace(column=view.width / 2 - round(view.scale * middle))


def world_to_pixel(
    points: NDArray[np.float64], config: CorridorConfig, width: int = 960
) -> NDArray[np.float64]:
    """Where points of the corridor lie in its whole picture.

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
