"""Pictures of the corridor: a scene becomes an RGB array, or a window shows it.

Figures are rasterised once per heading and sub-pixel position, larger than needed and then shrunk,
which gives smooth edges; a frame is a copy of the corridor's background with those sprites on it.
No display is opened for an array.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from socialnav_env import drawing
from socialnav_env.config import CorridorConfig
from socialnav_env.drawing import Figure
from socialnav_env.scene import (
    WALL_THICKNESS,
    Scene,
    SceneError,
    View,
    breadcrumbs,
    view_of,
    walking_heading,
    world_to_pixel,
)

os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
import pygame  # after the line above, or its greeting ends up in other programs' output

__all__ = ["Scene", "SceneError", "Window", "draw_scene", "world_to_pixel"]

TURNS = 120
"""Headings that a sprite is drawn at: one every 3 degrees."""
DOT_SPACING, DOT_RADIUS, TRAIL_REACH = 0.22, 0.05, 60.0
"""Trail [m]: distance between dots, their radius, and the distance over which they fade."""

JOINT = 0.018
"""Half the width of a joint between tiles [m]."""

PAPER = (255, 255, 255)
FLOOR = (244, 242, 237)
TILE = (228, 225, 217)
WALL = (84, 94, 106)
LETTERS = (70, 78, 88)

Stamp = tuple[pygame.Surface, tuple[int, int]]
"""A sprite and the column and row of its top left corner."""


def draw_scene(scene: Scene, config: CorridorConfig, width: int = 960) -> NDArray[np.uint8]:
    """Draw a scene from above, z to the right and x upwards.

    Args:
        scene: What to draw; whatever lies outside the picture is left out.
        config: The corridor's lengths.
        width: Width of the picture [px]; the height follows from the corridor.

    Returns:
        A fresh C-contiguous (height, width, 3) RGB array.

    Raises:
        ValueError: The width is no whole number in [64, 4096].
    """
    view = view_of(config, width)
    canvas = _background(config, width).copy()
    on_floor = [
        *_goals(scene, config, view),
        *_personal_spaces(scene, config, view),
        *_trail(scene, config, view),
    ]
    standing = [*_people(scene, config, view), *_robot(scene, config, view)]
    canvas.set_clip(_rectangle(view, config.half_width, config.half_length))
    canvas.fblits(on_floor, pygame.BLEND_PREMULTIPLIED)
    canvas.set_clip(None)
    canvas.fblits(standing, pygame.BLEND_PREMULTIPLIED)
    return _pixels(canvas)


def _pixels(canvas: pygame.Surface) -> NDArray[np.uint8]:
    """A surface's pixels as a fresh (h, w, 3) array; channel by channel is the fastest way."""
    source = pygame.surfarray.pixels3d(canvas).transpose(1, 0, 2)
    frame = np.empty(source.shape, dtype=np.uint8)
    for channel in range(3):
        frame[:, :, channel] = source[:, :, channel]
    return frame


# --- layers, from the floor up -------------------------------------------------------------------


def _goals(scene: Scene, config: CorridorConfig, view: View) -> Iterator[Stamp]:
    """Both goals."""
    intermittent = drawing.intermittent_figure(config.intermittent_radius, scene.collected)
    end = drawing.goal_figure(config.goal_radius, scene.reached)
    for figure, (x, z) in zip((intermittent, end), scene.goals.tolist(), strict=True):
        yield from _stamp(figure, x, z, 0.0, view)


def _personal_spaces(scene: Scene, config: CorridorConfig, view: View) -> Iterator[Stamp]:
    """A ring around each person; a robot whose disc crosses it is inside the personal space."""
    radius = config.human_radius + config.personal_space
    for index, (x, z, _, _) in enumerate(scene.people.tolist()):
        figure = drawing.space_figure(radius, _colour(index))
        yield from _stamp(figure, x, z, 0.0, view)


def _trail(scene: Scene, config: CorridorConfig, view: View) -> Iterator[Stamp]:
    """Where the robot has been, fading with the distance travelled since."""
    # Clipped, because a point set far outside would ask for dots without end.
    edge = np.array([config.half_width, config.half_length])
    inside = np.clip(scene.trail, -edge, edge)
    points, freshness = breadcrumbs(inside, DOT_SPACING, TRAIL_REACH)
    opacities = 16 * np.ceil(12 * freshness).astype(int)
    for (x, z), opacity in zip(points.tolist(), opacities.tolist(), strict=True):
        yield from _stamp(drawing.crumb_figure(DOT_RADIUS, opacity), x, z, 0.0, view)


def _people(scene: Scene, config: CorridorConfig, view: View) -> Iterator[Stamp]:
    """Everyone who walks, looking where they go."""
    for index, (x, z, vx, vz) in enumerate(scene.people.tolist()):
        figure = drawing.person_figure(config.human_radius, _colour(index))
        yield from _stamp(figure, x, z, walking_heading(vx, vz), view)


def _robot(scene: Scene, config: CorridorConfig, view: View) -> Iterator[Stamp]:
    """The robot."""
    x, z, heading = scene.robot.tolist()
    yield from _stamp(drawing.robot_figure(config.robot_radius), x, z, heading, view)


def _colour(person: int) -> drawing.Colour:
    """A person's colour, kept through an episode."""
    return drawing.PEOPLE[person % len(drawing.PEOPLE)]


# --- sprites -------------------------------------------------------------------------------------


def _stamp(figure: Figure, x: float, z: float, heading: float, view: View) -> Iterator[Stamp]:
    """The sprite of a figure and its place, to half a pixel; none if it is out of the picture."""
    column, row = view.column + view.scale * z, view.row - view.scale * x
    if not (-view.width < column < 2 * view.width and -view.height < row < 2 * view.height):
        return
    turn = round(math.remainder(heading, math.tau) * TURNS / math.tau) % TURNS
    half_columns, half_rows = round(2 * column), round(2 * row)
    sprite = _sprite(figure, view.scale, turn, half_columns % 2, half_rows % 2)
    reach = sprite.get_width() // 2
    yield sprite, (half_columns // 2 - reach, half_rows // 2 - reach)


@lru_cache(maxsize=4096)
def _sprite(
    figure: Figure, scale: float, turn: int, half_column: int, half_row: int
) -> pygame.Surface:
    """A figure at a scale [px/m], a heading, and half a pixel to the right or down.

    Its opacity is multiplied into its colours: only so do shrinking and blending leave no dark
    or bright fringe around it.
    """
    reach = math.ceil(figure.extent * scale) + 1
    size = 2 * reach + 1
    fine = min(6, max(3, 512 // size))
    large = pygame.Surface((size * fine, size * fine), pygame.SRCALPHA, 32)
    centre = reach + 0.5 * np.array([half_column, half_row])
    angle = math.tau * turn / TURNS
    cosine, sine = math.cos(angle), math.sin(angle)
    # (forward, left) to (right, down)
    turned = scale * np.array([[cosine, -sine], [-sine, -cosine]])
    for shape in figure.shapes:
        corners = fine * (centre + shape.points @ turned.T) - 0.5
        pygame.draw.polygon(large, shape.colour, np.round(corners).tolist())
    return pygame.transform.smoothscale(large.premul_alpha(), (size, size))


# --- the background ------------------------------------------------------------------------------


@lru_cache(maxsize=8)
def _background(config: CorridorConfig, width: int) -> pygame.Surface:
    """All that never moves: floor, walls, axis and scale bar, painted large and then shrunk."""
    small = view_of(config, width)
    column, row, scale = 3 * small.column, 3 * small.row, 3 * small.scale
    view = View(3 * small.width, 3 * small.height, scale, column, row, 3 * small.font)
    canvas = pygame.Surface((view.width, view.height), depth=32)
    canvas.fill(PAPER)
    _paint_corridor(canvas, config, view)
    _paint_axis(canvas, config, view)
    _paint_scale_bar(canvas, config, view)
    return pygame.transform.smoothscale(canvas, (small.width, small.height))


def _paint_corridor(canvas: pygame.Surface, config: CorridorConfig, view: View) -> None:
    """Four walls around a floor of tiles, a metre each."""
    length, width, wall = config.half_length, config.half_width, WALL_THICKNESS
    canvas.fill(WALL, _rectangle(view, width + wall, length + wall))
    canvas.fill(FLOOR, _rectangle(view, width, length))
    for z in range(1 - math.ceil(length), math.ceil(length)):
        canvas.fill(TILE, _rectangle(view, width, JOINT, z=z))
    for x in range(1 - math.ceil(width), math.ceil(width)):
        canvas.fill(TILE, _rectangle(view, JOINT, length, x=x))


def _rectangle(
    view: View, half_width: float, half_length: float, x: float = 0.0, z: float = 0.0
) -> tuple[int, int, int, int]:
    """Left, top, width and height [px] of a rectangle around x, z with these half sides [m]."""
    left, right = (round(view.column + view.scale * (z + side * half_length)) for side in (-1, 1))
    top, bottom = (round(view.row - view.scale * (x - side * half_width)) for side in (-1, 1))
    return left, top, right - left, bottom - top


def _paint_axis(canvas: pygame.Surface, config: CorridorConfig, view: View) -> None:
    """Ticks along z with their labels, beneath the corridor."""
    top = view.row + view.scale * (config.half_width + WALL_THICKNESS)
    step = next((step for step in (5, 10, 20) if step * view.scale >= 3 * view.font), 50)
    last = step * math.floor(config.half_length / step)
    for z in range(-last, last + 1, step):
        column = view.column + view.scale * z
        canvas.fill(LETTERS, (round(column) - 1, round(top), 3, round(0.35 * view.font)))
        _write(canvas, f"{z}".replace("-", "−"), view, column, top + 0.95 * view.font)
    _write(canvas, "z [m]", view, view.column, top + 2.05 * view.font)


def _paint_scale_bar(canvas: pygame.Surface, config: CorridorConfig, view: View) -> None:
    """A bar of five metres in the lower right corner."""
    right = view.column + view.scale * config.half_length
    left = right - 5 * view.scale
    row = view.row + view.scale * (config.half_width + WALL_THICKNESS) + 2.05 * view.font
    cap, thick = round(0.6 * view.font), round(0.16 * view.font)
    canvas.fill(LETTERS, (round(left), round(row) - thick // 2, round(right - left), thick))
    for end in (left, right - thick):
        canvas.fill(LETTERS, (round(end), round(row) - cap // 2, thick, cap))
    _write(canvas, "5 m", view, left - 1.4 * view.font, row)


def _write(canvas: pygame.Surface, text: str, view: View, column: float, row: float) -> None:
    """Write a text around a place [px], moved inwards where it would not fit."""
    pygame.font.init()
    letters = pygame.font.Font(None, round(1.25 * view.font)).render(text, True, LETTERS)
    place = letters.get_rect(center=(round(column), round(row)))
    canvas.blit(letters, place.clamp(canvas.get_rect()))


# --- the window ----------------------------------------------------------------------------------


class Window:
    """A window for `human` mode. It opens with the first frame; only here is a display touched."""

    def __init__(self, caption: str = "SocialCorridor") -> None:
        """Remember the caption; nothing opens yet."""
        self._caption = caption
        self._clock = pygame.time.Clock()
        self._open = False
        self.dismissed = False
        """Whether the person in front of it has closed it; then `show` does nothing."""

    def show(self, frame: NDArray[np.uint8], fps: float) -> None:
        """Show a frame, and wait until it is time for it.

        Args:
            frame: (h, w, 3) RGB, as from :func:`draw_scene`.
            fps: Frames per second to keep to.
        """
        if self.dismissed:
            return
        screen = self._screen((frame.shape[1], frame.shape[0]))
        picture = pygame.image.frombuffer(
            np.ascontiguousarray(frame).data, screen.get_size(), "RGB"
        )
        screen.blit(picture, (0, 0))
        pygame.display.flip()
        if any(event.type == pygame.QUIT for event in pygame.event.get()):
            self.dismissed = True
            self.close()
        self._clock.tick(fps)

    def _screen(self, size: tuple[int, int]) -> pygame.Surface:
        """The window's surface, opened or resized where needed."""
        screen = pygame.display.get_surface() if self._open else None
        if screen is None or screen.get_size() != size:
            pygame.display.init()
            screen = pygame.display.set_mode(size)
            pygame.display.set_caption(self._caption)
            self._open = True
        return screen

    def close(self) -> None:
        """Close the window; closing twice does no harm."""
        if self._open:
            pygame.display.quit()
            self._open = False
