import numpy as np
import pytest

from socialnav_env.config import CorridorConfig
from socialnav_env.rendering import CAMERAS, OVERLAYS, Annotations, Scene, draw_scene
from socialnav_env.rendering.background import smooth_background
from socialnav_env.rendering.sprites import forget_sprites

CONFIG = CorridorConfig()
GOALS = np.array([[0.3, -2.5], [-0.5, 12.0]])


def episode(steps):
    """Scenes of a robot that weaves through the corridor past three people who wander."""
    rng = np.random.default_rng(0)
    z = np.linspace(-14.0, 13.0, steps)
    x = 1.5 * np.sin(z / 3.0)
    heading = np.arctan2(np.gradient(x), np.gradient(z))
    places = np.array([[1.5, -10.0], [-1.2, 5.0], [1.4, 8.0]])
    velocities = np.array([[0.2, 0.9], [-0.5, -0.6], [0.0, 0.4]])
    scenes = []
    for step in range(steps):
        velocities = 0.97 * velocities + 0.1 * rng.normal(size=(3, 2))
        places = places + 0.1 * velocities
        people = np.column_stack([places, np.arctan2(*velocities.T), velocities])
        robot = np.array([x[step], z[step], heading[step]])
        trail = np.stack([x[: step + 1], z[: step + 1]], axis=1)
        scenes.append(Scene(robot, people, GOALS, z[step] > -2.5, False, trail))
    return scenes


def draw_all(scenes, width, **look):
    for scene in scenes:
        draw_scene(scene, CONFIG, width, **look)


@pytest.mark.parametrize("width", [480, 640, 960])
def test_frames_per_second_over_an_episode(benchmark, width):
    scenes = episode(350)
    benchmark.pedantic(draw_all, args=(scenes, width), rounds=5, warmup_rounds=1)
    frames = len(scenes) / benchmark.stats["mean"]
    benchmark.extra_info["frames_per_second"] = round(frames)
    if width == 640:
        assert frames >= 500, f"{frames:.0f} frames a second at width 640, expected at least 500"


@pytest.mark.parametrize("camera", CAMERAS)
def test_frames_per_second_with_every_overlay(benchmark, camera):
    scenes = episode(350)
    terms = {"reward_goal": 0.0, "reward_progress": 0.016, "reward_control": -0.001}
    notes = Annotations(np.linspace(1.0, 6.0, 9), np.ones((3, 2)), terms)
    look = {"camera": camera, "overlays": OVERLAYS, "annotations": notes}
    benchmark.pedantic(draw_all, args=(scenes, 640), kwargs=look, rounds=5, warmup_rounds=1)
    benchmark.extra_info["frames_per_second"] = round(len(scenes) / benchmark.stats["mean"])


def test_frames_per_second_of_the_very_first_episode(benchmark):
    """No sprite has been rasterised yet, as in a program that draws one clip and ends."""
    scenes = episode(350)

    def forget():
        forget_sprites()
        smooth_background.cache_clear()

    benchmark.pedantic(draw_all, args=(scenes, 640), setup=forget, rounds=3)
    frames = len(scenes) / benchmark.stats["mean"]
    benchmark.extra_info["frames_per_second"] = round(frames)
    assert frames >= 300, f"{frames:.0f} frames a second at width 640, expected at least 300"
