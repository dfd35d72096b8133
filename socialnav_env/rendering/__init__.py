"""Pictures of the corridor: a scene becomes an RGB array, or a window shows it.

This package is the only place that imports pygame. No display is opened for an array.
"""

import os

os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # or pygame greets in others' output

from socialnav_env.rendering.camera import world_to_pixel
from socialnav_env.rendering.overlays import (
    CAMERAS,
    DEFAULT_OVERLAYS,
    OVERLAYS,
    Annotations,
    check_look,
)
from socialnav_env.rendering.picture import draw_scene
from socialnav_env.rendering.scene import Scene, SceneError
from socialnav_env.rendering.tiles import tile
from socialnav_env.rendering.window import NoDisplayError, Window

__all__ = [
    "CAMERAS",
    "DEFAULT_OVERLAYS",
    "OVERLAYS",
    "Annotations",
    "NoDisplayError",
    "Scene",
    "SceneError",
    "Window",
    "check_look",
    "draw_scene",
    "tile",
    "world_to_pixel",
]
