"""All that does not move: floor, walls, axis and scale bar."""

from __future__ import annotations

import math
from functools import lru_cache

import pygame

from socialnav_env.config import DOORWAY_WALL, CorridorConfig
from socialnav_env.rendering.camera import WALL_THICKNESS, View, view_of

JOINT = 0.018
"""Half the width of a joint between tiles [m]."""

PAPER = (255, 255, 255)
FLOOR = (244, 242, 237)
TILE = (228, 225, 217)
WALL = (84, 94, 106)
LETTERS = (70, 78, 88)

Rectangle = tuple[int, int, int, int]
"""Left, top, width and height [px]."""


@lru_cache(maxsize=8)
def smooth_background(config: CorridorConfig, width: int, rewards: bool) -> pygame.Surface:
    """The whole corridor's background, painted large and then shrunk."""
    small = view_of(config, width, rewards=rewards)
    wide, high, font = 3 * small.width, 3 * small.height, 3 * small.font
    scale, column, row, strip = (3 * n for n in (small.scale, small.column, small.row, small.strip))
    view = View(wide, high, scale, column, row, font, strip)
    canvas = paint_background(config, view)
    return pygame.transform.smoothscale(canvas, (small.width, small.height))


def paint_background(config: CorridorConfig, view: View) -> pygame.Surface:
    """The part of the corridor that a view shows, and what stands beneath it."""
    canvas = pygame.Surface((view.width, view.height), depth=32)
    canvas.fill(PAPER)
    _paint_corridor(canvas, config, view)
    _paint_axis(canvas, config, view)
    _paint_scale_bar(canvas, config, view)
    return canvas


def floor_of(config: CorridorConfig, view: View) -> Rectangle:
    """Where the floor lies in the picture."""
    return _rectangle(view, config.half_width, config.half_length)


def paint_doorway(canvas: pygame.Surface, config: CorridorConfig, view: View) -> None:
    """The wall on both sides of the doorway, over whatever is drawn on the floor."""
    if config.doorway_width == 0.0:
        return
    half = 0.5 * (config.half_width - 0.5 * config.doorway_width)
    for side in (-1.0, 1.0):
        x = side * (config.half_width - half)
        wall = _rectangle(view, half, 0.5 * DOORWAY_WALL, x, config.doorway_z)
        canvas.fill(WALL, wall)


def _paint_corridor(canvas: pygame.Surface, config: CorridorConfig, view: View) -> None:
    """Four walls around a floor of tiles, a metre each."""
    length, width, wall = config.half_length, config.half_width, WALL_THICKNESS
    canvas.fill(WALL, _rectangle(view, width + wall, length + wall))
    canvas.fill(FLOOR, _rectangle(view, width, length))
    for z in _marks(math.ceil(length) - 1, 1, view):
        canvas.fill(TILE, _rectangle(view, width, JOINT, z=z))
    for x in range(1 - math.ceil(width), math.ceil(width)):
        canvas.fill(TILE, _rectangle(view, JOINT, length, x=x))


def _marks(limit: float, step: int, view: View) -> range:
    """Multiples of a step [m] along z, up to a limit on both sides, that the picture shows."""
    first = max(-limit, -view.column / view.scale)
    last = min(limit, (view.width - view.column) / view.scale)
    return range(step * math.ceil(first / step), step * math.floor(last / step) + 1, step)


def _rectangle(
    view: View, half_width: float, half_length: float, x: float = 0.0, z: float = 0.0
) -> Rectangle:
    """A rectangle around x, z with these half sides [m]."""
    left, top = map(round, view.place(x + half_width, z - half_length))
    right, bottom = map(round, view.place(x - half_width, z + half_length))
    return left, top, right - left, bottom - top


def _paint_axis(canvas: pygame.Surface, config: CorridorConfig, view: View) -> None:
    """Ticks along z with their labels, beneath the corridor."""
    top = view.row + view.scale * (config.half_width + WALL_THICKNESS)
    step = next((step for step in (1, 5, 10, 20) if step * view.scale >= 3 * view.font), 50)
    for z in _marks(config.half_length, step, view):
        column = view.column + view.scale * z
        canvas.fill(LETTERS, (round(column) - 1, round(top), 3, round(0.35 * view.font)))
        write(canvas, f"{z}".replace("-", "−"), view.font, column, top + 0.95 * view.font)
    write(canvas, "z [m]", view.font, 0.5 * view.width, top + 2.05 * view.font)


def _paint_scale_bar(canvas: pygame.Surface, config: CorridorConfig, view: View) -> None:
    """A bar of five metres, or of one where the tick marks are a metre apart."""
    metres = 5 if view.scale < 3 * view.font else 1
    frame = WALL_THICKNESS * view.scale
    right = min(view.column + view.scale * config.half_length, view.width - frame)
    left = right - metres * view.scale
    row = view.row + view.scale * (config.half_width + WALL_THICKNESS) + 2.05 * view.font
    cap, thick = round(0.6 * view.font), round(0.16 * view.font)
    canvas.fill(LETTERS, (round(left), round(row) - thick // 2, round(right - left), thick))
    for end in (left, right - thick):
        canvas.fill(LETTERS, (round(end), round(row) - cap // 2, thick, cap))
    write(canvas, f"{metres} m", view.font, left - 1.4 * view.font, row)


def write(canvas: pygame.Surface, text: str, font: int, column: float, row: float) -> None:
    """Write a text around a place [px], moved inwards where it would not fit."""
    letters = _letters(text, round(1.25 * font))
    place = letters.get_rect(center=(round(column), round(row)))
    canvas.blit(letters, place.clamp(canvas.get_rect()))


@lru_cache(maxsize=512)
def _letters(text: str, size: int) -> pygame.Surface:
    """A text as a picture; opening a font takes longer than drawing with it."""
    pygame.font.init()
    return pygame.font.Font(None, size).render(text, True, LETTERS)
