"""A scene as an RGB array: a background with sprites on it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
import pygame
from numpy.typing import NDArray

from socialnav_env.config import CorridorConfig
from socialnav_env.rendering import drawing
from socialnav_env.rendering.background import (
    floor_of,
    paint_background,
    paint_doorway,
    smooth_background,
)
from socialnav_env.rendering.camera import View, centred, view_of
from socialnav_env.rendering.notes import paint_forces, paint_rays, paint_terms
from socialnav_env.rendering.overlays import DEFAULT_OVERLAYS, Annotations, check_look
from socialnav_env.rendering.scene import STANDING, Scene, breadcrumbs, stride
from socialnav_env.rendering.sprites import Stamp, stamp, stamps

DOT_SPACING, DOT_RADIUS, TRAIL_REACH = 0.22, 0.05, 60.0
"""Trail [m]: distance between dots, their radius, and the distance over which they fade."""


def draw_scene(
    scene: Scene,
    config: CorridorConfig,
    width: int = 960,
    *,
    camera: str = "corridor",
    overlays: Sequence[str] = DEFAULT_OVERLAYS,
    annotations: Annotations | None = None,
) -> NDArray[np.uint8]:
    """Draw a scene from above, z to the right and x upwards.

    Args:
        scene: What to draw; whatever lies outside the picture is left out.
        config: The corridor's lengths.
        width: Width of the picture [px]; the height follows from corridor, camera and overlays.
        camera: One of `CAMERAS`: the whole corridor, or the part around the robot.
        overlays: Some of `OVERLAYS`.
        annotations: What the overlays "rays", "forces" and "reward" show; they stay empty where it
            is missing.

    Returns:
        A fresh C-contiguous (height, width, 3) RGB array.

    Raises:
        ValueError: The width is no whole number in [64, 4096].
        ConfigError: The camera or an overlay is unknown.
        SceneError: There are not as many forces as people.
    """
    check_look(camera, overlays)
    notes = annotations or Annotations()
    rewards = "reward" in overlays
    view = centred(view_of(config, width, camera, rewards), config, float(scene.robot[1]))
    if camera == "robot":
        canvas = paint_background(config, view)
    else:
        canvas = smooth_background(config, width, rewards).copy()
    canvas.set_clip(floor_of(config, view))
    _paint_floor(canvas, scene, config, view, overlays)
    if "rays" in overlays and notes.rays is not None:
        paint_rays(canvas, scene, notes.rays, config.ray_range, view)
    paint_doorway(canvas, config, view)
    canvas.set_clip(None)
    standing = [*_people(scene, config, view), *_robot(scene, config, view)]
    canvas.fblits(standing, pygame.BLEND_PREMULTIPLIED)
    if "forces" in overlays and notes.forces is not None:
        paint_forces(canvas, scene, notes.forces, config.human_radius, view)
    if rewards and notes.terms is not None:
        paint_terms(canvas, notes.terms, view)
    return _pixels(canvas)


def _pixels(canvas: pygame.Surface) -> NDArray[np.uint8]:
    """A surface's pixels as a fresh (h, w, 3) array; channel by channel is the fastest way."""
    source = pygame.surfarray.pixels3d(canvas).transpose(1, 0, 2)
    frame = np.empty(source.shape, dtype=np.uint8)
    for channel in range(3):
        frame[:, :, channel] = source[:, :, channel]
    return frame


def _paint_floor(
    canvas: pygame.Surface,
    scene: Scene,
    config: CorridorConfig,
    view: View,
    overlays: Sequence[str],
) -> None:
    """Everything flat: goals, and personal spaces and trail where they are wanted."""
    stamps = [*_goals(scene, config, view)]
    if "personal_space" in overlays:
        stamps += _personal_spaces(scene, config, view)
    if "trajectory" in overlays:
        stamps += _trail(scene, config, view)
    canvas.fblits(stamps, pygame.BLEND_PREMULTIPLIED)


# --- layers, from the floor up -------------------------------------------------------------------


def _goals(scene: Scene, config: CorridorConfig, view: View) -> Iterator[Stamp]:
    """Both goals."""
    intermittent = drawing.intermittent_figure(config.intermittent_radius, scene.collected)
    end = drawing.goal_figure(config.goal_radius, scene.reached)
    for figure, (x, z) in zip((intermittent, end), scene.goals.tolist(), strict=True):
        yield from stamp(figure, x, z, 0.0, view)


def _personal_spaces(scene: Scene, config: CorridorConfig, view: View) -> Iterator[Stamp]:
    """A ring around each person; a robot whose disc crosses it is inside the personal space."""
    radius = config.human_radius + config.personal_space
    for index, (x, z, *_) in enumerate(scene.people.tolist()):
        figure = drawing.space_figure(radius, drawing.PEOPLE[_look(index)])
        yield from stamp(figure, x, z, 0.0, view)


def _trail(scene: Scene, config: CorridorConfig, view: View) -> Iterator[Stamp]:
    """Where the robot has been, fading with the distance travelled since."""
    # Clipped, because a point set far outside would ask for dots without end.
    edge = np.array([config.half_width, config.half_length])
    inside = np.clip(scene.trail, -edge, edge)
    points, freshness = breadcrumbs(inside, DOT_SPACING, TRAIL_REACH)
    opacities = 16 * np.ceil(12 * freshness).astype(int)
    dots = (drawing.crumb_figure(DOT_RADIUS, opacity) for opacity in opacities.tolist())
    yield from stamps(dots, points, view)


def _people(scene: Scene, config: CorridorConfig, view: View) -> Iterator[Stamp]:
    """Everyone, walking or standing."""
    for index, (x, z, heading, vx, vz) in enumerate(scene.people.tolist()):
        if not view.near(*view.place(x, z)):
            continue
        walking = math.hypot(vx, vz) >= STANDING
        foot = stride(x, z) if walking else 0
        figure = drawing.person_figure(config.human_radius, _look(index), walking, foot)
        yield from stamp(figure, x, z, heading, view)


def _robot(scene: Scene, config: CorridorConfig, view: View) -> Iterator[Stamp]:
    """The robot."""
    x, z, heading = scene.robot.tolist()
    yield from stamp(drawing.robot_figure(config.robot_radius), x, z, heading, view)


def _look(person: int) -> int:
    """A person's look, kept through an episode."""
    return person % len(drawing.PEOPLE)
