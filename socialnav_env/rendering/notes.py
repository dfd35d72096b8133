"""Overlays that show numbers: rays and forces on the floor, reward terms as bars beneath it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pygame
from numpy.typing import NDArray

from socialnav_env.rendering.background import LETTERS, write
from socialnav_env.rendering.camera import View
from socialnav_env.rendering.overlays import arrow, bar_share, ray_ends
from socialnav_env.rendering.scene import Scene, SceneError

RAY = (120, 170, 205)
FORCE = (44, 54, 66)
GAIN, LOSS = (0, 158, 115), (213, 94, 0)


def paint_rays(
    canvas: pygame.Surface,
    scene: Scene,
    rays: NDArray[np.float64],
    ray_range: float,
    view: View,
) -> None:
    """A line for each ray, with a dot where it meets something."""
    start = view.place(*scene.robot[:2].tolist())
    if not view.near(*start):
        return
    size = max(2.0, 0.05 * view.scale)
    for (x, z), length in zip(ray_ends(scene.robot, rays).tolist(), rays.tolist(), strict=True):
        end = view.place(x, z)
        pygame.draw.aaline(canvas, RAY, start, end)
        if length < ray_range:
            pygame.draw.aacircle(canvas, RAY, end, size)


def paint_forces(
    canvas: pygame.Surface,
    scene: Scene,
    forces: NDArray[np.float64],
    start: float,
    view: View,
) -> None:
    """An arrow from each person who is pushed.

    Raises:
        SceneError: There are not as many forces as people.
    """
    if len(forces) != len(scene.people):
        raise SceneError(f"forces: expected {len(scene.people)}, one a person, got {len(forces)}")
    for person, force in zip(scene.people, forces, strict=True):
        if not view.near(*view.place(*person[:2].tolist())) or not force.any():
            continue
        corners = [view.place(x, z) for x, z in (person[:2] + arrow(force, start)).tolist()]
        corners = [(round(column), round(row)) for column, row in corners]
        pygame.draw.polygon(canvas, FORCE, corners)
        pygame.draw.aalines(canvas, FORCE, True, corners)  # smooths the edges


def paint_terms(canvas: pygame.Surface, terms: Mapping[str, float], view: View) -> None:
    """Name, value and signed bar of each reward term, side by side beneath the corridor."""
    cell = view.width / max(1, len(terms))
    font, top = view.font, view.strip
    for index, (name, term) in enumerate(terms.items()):
        middle = (index + 0.5) * cell
        write(canvas, name.removeprefix("reward_"), font, middle, top + 0.6 * font)
        write(canvas, f"{term:+.3f}".replace("-", "−"), font, middle, top + 3.4 * font)
        reach = 0.42 * cell * bar_share(term)
        left, right = sorted((middle, middle + reach))
        bar = (round(left), round(top + 1.4 * font), round(right - left), round(1.1 * font))
        canvas.fill(GAIN if term > 0.0 else LOSS, bar)
        canvas.fill(LETTERS, (round(middle) - 1, round(top + 1.2 * font), 2, round(1.5 * font)))
