"""Figures as small pictures with smooth edges, made once for each heading and sub-pixel place.

They are rasterised larger than needed and then shrunk.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from functools import lru_cache
from pathlib import Path

import numpy as np
import pygame
from numpy.typing import NDArray

from socialnav_env.rendering.camera import View
from socialnav_env.rendering.drawing import Figure, Picture

TURNS = 120
"""Headings that a sprite is drawn at: one every 3 degrees."""
CLOSE = 40.0
"""From this scale on sprites lie on whole pixels [px/m], below on half pixels."""
SMALL = 52.0
"""Reach of the largest figures of which many are kept [px]."""

Stamp = tuple[pygame.Surface, tuple[int, int]]
"""A sprite and the column and row of its top left corner."""


def stamp(figure: Figure, x: float, z: float, heading: float, view: View) -> Iterator[Stamp]:
    """The sprite of a figure and its place; none if it is far out of the picture."""
    column, row = view.place(x, z)
    if not view.near(column, row):
        return
    turn = round(math.remainder(heading, math.tau) * TURNS / math.tau) % TURNS
    part = _parts(view)
    yield _placed(figure, turn, round(part * column), round(part * row), view)


def stamps(figures: Iterable[Figure], points: NDArray[np.float64], view: View) -> Iterator[Stamp]:
    """The sprites of many figures without a heading, all of them at most near the picture.

    Args:
        figures: One a point.
        points: (n, 2) x, z [m].
        view: How the corridor lies in the picture.
    """
    columns, rows = view.column + view.scale * points[:, 1], view.row - view.scale * points[:, 0]
    places = np.rint(_parts(view) * np.stack([columns, rows], axis=1)).astype(int).tolist()
    for figure, (column, row) in zip(figures, places, strict=True):
        yield _placed(figure, 0, column, row, view)


def _parts(view: View) -> int:
    """Places of a sprite in a pixel: two, or one in a close-up, which needs no more."""
    return 2 if view.scale < CLOSE else 1


def _placed(figure: Figure, turn: int, column: int, row: int, view: View) -> Stamp:
    """The sprite of a figure around a place, which is counted in parts of a pixel."""
    part = _parts(view)
    kept = _many if figure.extent * view.scale < SMALL else _few
    image = kept(figure, view.scale, turn, column % part, row % part)
    reach = image.get_width() // 2
    return image, (column // part - reach, row // part - reach)


def forget_sprites() -> None:
    """Give back the memory of all sprites; they are made again when they are needed."""
    for cache in (_many, _few, _image):
        cache.cache_clear()


def _sprite(
    figure: Figure, scale: float, turn: int, half_column: int, half_row: int
) -> pygame.Surface:
    """A figure at a scale [px/m], a heading, and half a pixel to the right or down.

    Its opacity is multiplied into its colours: only so do shrinking and blending leave no dark
    or bright fringe around it.
    """
    reach = math.ceil(figure.extent * scale) + 1
    size = 2 * reach + 1
    fine = min(6, max(3, 128 // size))
    large = pygame.Surface((size * fine, size * fine), pygame.SRCALPHA, 32)
    centre = reach + 0.5 * np.array([half_column, half_row])
    angle = math.tau * turn / TURNS
    cosine, sine = math.cos(angle), math.sin(angle)
    # (forward, left) to (right, down)
    turned = scale * np.array([[cosine, -sine], [-sine, -cosine]])
    for shape in figure.shapes:
        corners = fine * (centre + shape.points @ turned.T) - 0.5
        pygame.draw.polygon(large, shape.colour, np.round(corners).tolist())
    large = large.premul_alpha()
    if figure.picture is not None:
        image = _image(figure.picture, max(1, round(2 * figure.picture.reach * scale * fine)))
        image = pygame.transform.rotozoom(image, math.degrees(angle), 1.0)
        place = image.get_rect(center=tuple(np.round(fine * centre).tolist()))
        large.blit(image, place, special_flags=pygame.BLEND_PREMULTIPLIED)
    return pygame.transform.smoothscale(large, (size, size))


# So that neither a long episode in small pictures draws sprites again and again, nor large
# pictures fill the memory.
_many = lru_cache(maxsize=6000)(_sprite)
_few = lru_cache(maxsize=200)(_sprite)


@lru_cache(maxsize=256)
def _image(picture: Picture, side: int) -> pygame.Surface:
    """A drawing from the assets, looking right, as a square of so many pixels."""
    path = sprite_folder() / f"{picture.name}.svg"
    loaded = pygame.image.load_sized_svg(path, (side, side))
    # Surfaces that order their channels alike are blended sixty times faster.
    image = loaded.convert(pygame.Surface((1, 1), pygame.SRCALPHA, 32)).premul_alpha()
    return pygame.transform.flip(image, False, picture.mirrored)


def sprite_folder() -> Path:
    """Where the drawings lie: in the installed package, or in the checkout beside it."""
    package = Path(__file__).parents[1]
    installed = package / "assets" / "sprites"
    return installed if installed.is_dir() else package.parent / "assets" / "sprites"
