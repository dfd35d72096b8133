import gymnasium as gym
import numpy as np
import pygame
import pytest

from socialnav_env.observation import ray_entries
from socialnav_env.pictures import annotations_of, scene_from_row
from socialnav_env.rendering import OVERLAYS, tile
from socialnav_env.reward import TERMS

SMALL = {"render_mode": "rgb_array", "render_width": 160}
AHEAD = [1.0, 0.3]


def make(**settings):
    return gym.make("SocialCorridor-v0", **{**SMALL, **settings}).unwrapped


def make_vec(count, **settings):
    return gym.make_vec("SocialCorridor-v0", num_envs=count, **{**SMALL, **settings})


def driven(env, steps=15):
    env.reset(seed=0)
    for _ in range(steps):
        env.step(AHEAD if isinstance(env, gym.Env) else np.tile(AHEAD, (env.num_envs, 1)))
    return env


def test_a_row_becomes_a_scene():
    env = driven(make(scenario="crowded"))
    scene, bodies = scene_from_row(env.state_row(), [(0.0, 1.0)]), env.world.state.bodies[0]
    np.testing.assert_array_equal(scene.robot, bodies[0, [1, 0, 2]])
    np.testing.assert_array_equal(scene.people[:, [0, 1, 3, 4]], bodies[1:][:, [1, 0, 4, 3]])
    np.testing.assert_array_equal(scene.trail, [(0.0, 1.0)])


# --- what is laid over them ----------------------------------------------------------------------


@pytest.mark.parametrize("settings", [{}, {"scenario": "doorway"}, {"half_length": 15}], ids=str)
def test_annotations_are_what_the_robot_sees_and_what_moves_people(settings):
    env = driven(make(**settings))
    notes = annotations_of(env.world, 0)
    np.testing.assert_allclose(notes.rays, env.world.observe()[0, ray_entries(env.config)])
    np.testing.assert_array_equal(notes.forces, env.world.forces[0, :, ::-1])
    assert notes.terms == dict(zip(TERMS, env.world.terms[0], strict=True))


def test_annotations_draw_no_noise():
    env = driven(make(ray_noise=0.5, observation="state"))
    generator = env.world.noises[0].bit_generator.state
    first, second = annotations_of(env.world, 0), annotations_of(env.world, 0)
    assert env.world.noises[0].bit_generator.state == generator
    np.testing.assert_array_equal(first.rays, second.rays)


@pytest.mark.parametrize("overlay", OVERLAYS)
def test_each_overlay_adds_something_to_a_living_picture(overlay):
    plain, laid = (driven(make(overlays=over)).render() for over in ((), (overlay,)))
    assert plain.shape != laid.shape or (plain != laid).any()


def test_a_recorded_row_is_drawn_without_annotations():
    env = driven(make(overlays=("rays", "forces")))
    assert (env.render_state(env.state_row()) != env.render()).any()
    plain = driven(make(overlays=()))
    assert np.array_equal(env.render_state(env.state_row()), plain.render())


def test_the_camera_follows_the_robot():
    env = driven(make(camera="robot"), 0)
    first = env.render()
    for _ in range(60):
        env.step([1.0, 0.0])
    assert (env.render() != first).mean() > 0.02


# --- many corridors ------------------------------------------------------------------------------


@pytest.mark.parametrize("settings", [{}, {"camera": "robot", "overlays": OVERLAYS}], ids=str)
def test_pictures_are_those_of_single_envs(settings):
    many, single = make_vec(3, **settings), make(**settings)
    many.reset(seed=0)
    single.reset(seed=2)
    for _ in range(15):
        many.step(np.tile(AHEAD, (3, 1)))
        single.step(AHEAD)
    frames = many.render()
    assert len(frames) == 3
    assert np.array_equal(frames[2], single.render())


def test_chosen_corridors_are_drawn():
    every, some = (driven(make_vec(20, render_envs=envs)).render() for envs in (range(20), (17, 3)))
    assert len(every) == 20 and len(some) == 2
    assert np.array_equal(some[0], every[17]) and np.array_equal(some[1], every[3])
    assert len(driven(make_vec(20), 0).render()) == 16


def test_tiled_pictures_are_one():
    env = driven(make_vec(4))
    assert np.array_equal(env.render_tiled(), tile(env.render()))


def test_a_trail_begins_with_its_episode():
    env = driven(make_vec(2, max_episode_steps=5, autoreset_mode="SameStep"), 7)
    trails = env.get_snapshot().trails
    assert [len(trail) for trail in trails.values()] == [3, 3]
    z, x = env.world.state.bodies[1, 0, :2]
    assert trails[1][-1] == (x, z)


def test_nothing_is_remembered_where_nothing_is_drawn():
    assert driven(make_vec(3, render_mode=None)).get_snapshot().trails == {}
    assert set(driven(make_vec(30, render_envs=[5])).get_snapshot().trails) == {5}


def test_rendering_changes_nothing():
    plain, drawn = make_vec(3, render_mode=None), make_vec(3)
    for env in (plain, drawn):
        env.reset(seed=0)
    for _ in range(10):
        drawn.render()
        told = [env.step(np.tile(AHEAD, (3, 1)))[0].tolist() for env in (plain, drawn)]
        assert told[0] == told[1]


def test_without_a_render_mode_render_says_so():
    with pytest.warns(UserWarning, match="render_mode"):
        assert driven(make_vec(2, render_mode=None), 0).render() is None


def test_a_window_shows_them_all(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    fast = {"frame_skip": 1, "timestep": 0.002}
    env = driven(make_vec(4, render_mode="human", **fast), 2)
    assert env.render() is None
    height, width, _ = env.render_tiled().shape
    assert pygame.display.get_surface().get_size() == (width, height)
    env.close()
    env.close()
    assert not pygame.display.get_init()
