import math

import numpy as np
import pygame
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from socialnav_env.config import DOORWAY_WALL, CorridorConfig
from socialnav_env.rendering import Scene, SceneError, draw_scene, drawing, world_to_pixel
from socialnav_env.rendering.scene import breadcrumbs, stride
from socialnav_env.rendering.sprites import sprite_folder

CONFIG = CorridorConfig()
GOALS = np.array([[0.3, -2.5], [-0.5, 12.0]])
PEOPLE = np.array(
    [[1.5, -10.0, 0.2, 0.2, 0.9], [-1.2, 5.0, -2.4, -0.5, -0.6], [1.4, 8.0, math.pi, 0.0, 0.0]]
)
NOBODY = np.empty((0, 5))
NO_TRAIL = np.empty((0, 2))


def scene(
    robot=(0.0, 0.0, 0.0),
    people=NOBODY,
    goals=GOALS,
    collected=False,
    reached=False,
    trail=NO_TRAIL,
):
    return Scene(robot, people, goals, collected, reached, trail)


def centre_of_change(before, after):
    """Column and row of the middle of the box around all pixels that differ."""
    rows, columns = np.nonzero((before != after).any(axis=2))
    return (columns.min() + columns.max() + 1) / 2, (rows.min() + rows.max() + 1) / 2


def pixel_at(picture, x, z):
    column, row = world_to_pixel(np.array([x, z]), CONFIG, picture.shape[1])
    return picture[int(row), int(column)].astype(int)


# --- the array -----------------------------------------------------------------------------------


@pytest.mark.parametrize("width", [64, 480, 640, 960, 961])
def test_a_picture_is_a_contiguous_rgb_array_that_video_encoders_like(width):
    picture = draw_scene(scene(), CONFIG, width)
    assert picture.dtype == np.uint8
    assert picture.shape[1:] == (width, 3)
    assert picture.shape[0] % 16 == 0
    assert picture.flags.c_contiguous and picture.flags.owndata and picture.flags.writeable


def test_each_picture_is_a_fresh_copy():
    first = draw_scene(scene(), CONFIG, 480)
    kept = first.copy()
    first[:] = 0
    assert np.array_equal(draw_scene(scene(), CONFIG, 480), kept)


def test_the_same_scene_gives_the_same_bytes_whatever_was_drawn_before():
    shown = scene((0.4, -3.0, 0.7), PEOPLE, trail=[[0.0, -14.0], [0.4, -3.0]])
    before = draw_scene(shown, CONFIG).tobytes()
    draw_scene(scene((1.0, 2.0, 3.0), PEOPLE[:1]), CONFIG, 640)
    assert draw_scene(shown, CONFIG).tobytes() == before


def test_no_display_is_opened_for_an_array():
    draw_scene(scene(people=PEOPLE), CONFIG)
    assert not pygame.display.get_init()


@pytest.mark.parametrize("width", [0, 63, 4097, 640.0, True, "640"])
def test_an_impossible_width_is_named(width):
    with pytest.raises(ValueError, match=r"width=.*expected a whole number"):
        draw_scene(scene(), CONFIG, width)


# --- where things are ----------------------------------------------------------------------------


def test_world_to_pixel_at_hand_computed_points():
    # 960 px for 30 m of corridor and 0.3 m of wall and 0.25 m of margin at both ends
    scale = 960 / 31.1
    middle = world_to_pixel(np.zeros(2), CONFIG, 960)
    assert middle[0] == 480
    assert abs(middle[1] - 3.55 * scale) <= 0.25
    ahead, left = world_to_pixel(np.array([[0.0, 1.0], [1.0, 0.0]]), CONFIG, 960)
    np.testing.assert_allclose(ahead - middle, [scale, 0.0])
    np.testing.assert_allclose(left - middle, [0.0, -scale])


@pytest.mark.parametrize("place", [(0.0, 0.0), (1.7, -9.3), (-2.4, 9.0), (2.2, 14.1)])
def test_the_robot_is_drawn_where_it_is(place):
    x, z = place
    # Seen along ±z the outline is a disc with a tip of one more radius; the box's middle shifts.
    width, scale = 960, 960 / 31.1
    empty = draw_scene(scene((0.0, -500.0, 0.0)), CONFIG, width)
    column, row = centre_of_change(empty, draw_scene(scene((x, z, 0.0)), CONFIG, width))
    expected = world_to_pixel(np.array([x, z]), CONFIG, width)
    tip = 0.5 * CONFIG.robot_radius * scale
    np.testing.assert_allclose([column - tip, row], expected, atol=1.0)


def test_each_person_is_drawn_inside_a_ring_of_the_personal_space():
    width, scale = 960, 960 / 31.1
    nobody = draw_scene(scene(), CONFIG, width)
    picture = draw_scene(scene(people=[[0.4, -8.0, 0.0, 0.0, 1.0]]), CONFIG, width)
    rows, columns = np.nonzero((picture != nobody).any(axis=2))
    diameter = 2 * (CONFIG.human_radius + CONFIG.personal_space) * scale
    assert abs(columns.max() + 1 - columns.min() - diameter) <= 2
    assert abs(rows.max() + 1 - rows.min() - diameter) <= 2
    expected = world_to_pixel(np.array([0.4, -8.0]), CONFIG, width)
    np.testing.assert_allclose(centre_of_change(nobody, picture), expected, atol=1.0)


def test_a_person_is_drawn_where_only_the_person_moved():
    first, second = PEOPLE.copy(), PEOPLE.copy()
    second[1, :2] += [0.5, -0.5]
    changed = draw_scene(scene(people=first), CONFIG) != draw_scene(scene(people=second), CONFIG)
    columns = np.nonzero(changed.any(axis=(0, 2)))[0]
    reach = 2.5 * 960 / 31.1
    assert abs(columns - world_to_pixel(PEOPLE[1, :2], CONFIG)[0]).max() < reach


def test_personal_space_stays_on_the_floor():
    at_wall = draw_scene(scene(people=[[2.7, -5.0, 0.0, 0.0, 1.0]]), CONFIG)
    _, wall_row = world_to_pixel(np.array([3.15, 0.0]), CONFIG)
    assert np.array_equal(at_wall[int(wall_row)], draw_scene(scene(), CONFIG)[int(wall_row)])


@pytest.mark.parametrize(
    ("sign", "mirror_heading"),
    [((-1.0, 1.0), lambda heading: -heading), ((1.0, -1.0), lambda heading: math.pi - heading)],
    ids=["left-right", "back-front"],
)
def test_a_mirrored_scene_gives_a_mirrored_picture(sign, mirror_heading):
    sign = np.array(sign)
    away = np.full((2, 2), 500.0)  # the flag stays upright, so leave the goals out
    trail = np.stack([np.sin(np.linspace(0, 3, 90)), np.linspace(-12, -6, 90)], axis=1)
    robot = np.array([*trail[-1], mirror_heading(0.7)])
    mirrored_robot = np.array([*(sign * trail[-1]), 0.7])
    mirrored_people = PEOPLE * [*sign, 1.0, *sign]
    mirrored_people[:, 2] = [mirror_heading(heading) for heading in PEOPLE[:, 2]]
    picture = draw_scene(scene(robot, PEOPLE, away, trail=trail), CONFIG)
    other = draw_scene(scene(mirrored_robot, mirrored_people, away, trail=trail * sign), CONFIG)
    left_wall, right_wall = world_to_pixel(np.array([[3.0, 0.0], [-3.0, 0.0]]), CONFIG)[:, 1]
    corridor = slice(round(left_wall), round(right_wall))
    step = -1 if sign[0] < 0 else 1
    mirrored = other[corridor][::step, ::-step]
    difference = np.abs(picture[corridor].astype(int) - mirrored)
    assert difference.mean() < 0.2
    assert (difference.max(axis=2) > 60).mean() < 1e-3


# --- what they look like -------------------------------------------------------------------------


def test_heading_changes_the_picture_and_the_wedge_points_ahead():
    empty = draw_scene(scene((0.0, -500.0, 0.0)), CONFIG)
    middle = world_to_pixel(np.zeros(2), CONFIG)
    for heading in np.arange(0.0, 2 * math.pi, math.pi / 6):
        picture = draw_scene(scene((0.0, 0.0, heading)), CONFIG)
        rows, columns = np.nonzero((picture != empty).any(axis=2))
        ink = np.array([columns.mean() + 0.5, rows.mean() + 0.5]) - middle
        # the tip moves the middle of the figure's area ahead; up in the picture is to the left
        assert ink @ [math.cos(heading), -math.sin(heading)] > 1.0
        assert abs(ink @ [math.sin(heading), math.cos(heading)]) < 1.0


def test_a_full_turn_changes_nothing():
    picture = draw_scene(scene((0.0, 0.0, 1.0)), CONFIG)
    assert np.array_equal(picture, draw_scene(scene((0.0, 0.0, 1.0 + 4 * math.pi)), CONFIG))


def test_a_person_turns_with_the_heading_walking_or_standing():
    for speed in (0.0, 1.0):
        one, other = (
            draw_scene(scene(people=[[0.0, -8.0, turn, 0.0, speed]]), CONFIG) for turn in (0.0, 1.6)
        )
        assert not np.array_equal(one, other)


def test_who_walks_and_who_stands_are_told_apart():
    def picture(speed):
        return draw_scene(scene(people=[[0.0, -8.0, 0.0, 0.0, speed]]), CONFIG)

    assert np.array_equal(picture(0.0), picture(0.049))
    assert np.array_equal(picture(0.05), picture(1.0))
    assert not np.array_equal(picture(0.049), picture(0.05))


def test_who_walks_straight_on_changes_feet_at_every_step():
    feet = [stride(0.1, z) for z in np.arange(0.05, 6.0, 0.1)]
    changes = np.flatnonzero(np.diff(feet))
    assert len(changes) == 9
    assert (np.diff(changes) == 6).all()


@pytest.mark.parametrize("x, z", [(0.2, 3.1), (-1.7, -4.4)])
def test_a_mirrored_walker_has_the_other_foot_ahead(x, z):
    assert stride(-x, z) == stride(x, -z) == 1 - stride(x, z)


def test_every_look_has_a_drawing_for_each_posture():
    needed = {"robot.svg"} | {
        f"person_{look}_{posture}.svg"
        for look in range(len(drawing.PEOPLE))
        for posture in ("walking", "standing")
    }
    assert {path.name for path in sprite_folder().glob("*.svg")} == needed


def test_people_look_different_and_keep_their_look():
    def looks(place):
        people = np.zeros((12, 5))
        people[:, 0], people[:, 1] = -500.0, 0.0
        people[place, :2] = 0.0
        return draw_scene(scene((0.0, -500.0, 0.0), people), CONFIG).tobytes()

    pictures = [looks(place) for place in range(12)]
    assert len(set(pictures)) == len(drawing.PEOPLE)
    assert pictures[:6] == pictures[6:]


def test_a_drawing_lies_in_the_disc_that_collides_but_for_feet_and_hands():
    for turn in (0.0, 1.0):
        bare = draw_scene(scene((0.0, -500.0, 0.0)), CONFIG, overlays=())
        picture = draw_scene(scene((0.0, 0.0, turn)), CONFIG, overlays=())
        rows, columns = np.nonzero((picture != bare).any(axis=2))
        away = np.stack([columns, rows], 1) + 0.5 - world_to_pixel(np.zeros(2), CONFIG)
        behind = away @ [math.cos(turn), -math.sin(turn)] < 0
        radius = CONFIG.robot_radius * 960 / 31.1
        assert np.hypot(*away[behind].T).max() < radius + 1.5


def test_the_intermittent_goal_turns_grey_once_collected():
    fresh, taken = (draw_scene(scene(collected=flag), CONFIG) for flag in (False, True))
    red, green, blue = pixel_at(fresh, *GOALS[0])
    assert red > green > blue + 60
    assert np.ptp(pixel_at(taken, *GOALS[0])) < 10
    expected = world_to_pixel(GOALS[0], CONFIG)
    np.testing.assert_allclose(centre_of_change(fresh, taken), expected, atol=1.0)


def test_the_end_goal_shows_when_it_is_reached():
    open_goal, reached = (draw_scene(scene(reached=flag), CONFIG) for flag in (False, True))
    inside = GOALS[1] - [0.0, 0.7]
    assert pixel_at(open_goal, *inside).mean() > 180
    np.testing.assert_allclose(pixel_at(reached, *inside), drawing.GOAL[:3], atol=2)
    expected = world_to_pixel(GOALS[1], CONFIG)
    np.testing.assert_allclose(centre_of_change(open_goal, reached), expected, atol=1.0)


def test_the_markers_differ_in_more_than_colour():
    grey = [draw_scene(scene(goals=goals), CONFIG).mean(axis=2) for goals in (GOALS, GOALS[::-1])]
    assert np.abs(grey[0] - grey[1]).max() > 60


# --- the trail -----------------------------------------------------------------------------------


def test_breadcrumbs_are_evenly_spaced_and_stay_where_they_are_as_the_trail_grows():
    trail = np.array([[0.0, 0.0], [0.0, 1.0], [3.0, 5.0], [3.0, 5.0], [0.0, 9.0]])  # 1 + 5 + 5 m
    points, freshness = breadcrumbs(trail, 0.5, 22.0)
    assert len(points) == 22
    np.testing.assert_allclose(points[:4], [[0, 0], [0, 0.5], [0, 1], [0.3, 1.4]], atol=1e-12)
    np.testing.assert_allclose(freshness, 1.0 - (11.0 - 0.5 * np.arange(22)) / 22.0)
    longer, _ = breadcrumbs(np.vstack([trail, [0.0, 12.0]]), 0.5, 22.0)
    np.testing.assert_allclose(longer[:22], points, atol=1e-12)


def test_breadcrumbs_further_back_than_their_reach_are_left_out():
    points, freshness = breadcrumbs(np.array([[0.0, 0.0], [0.0, 10.0]]), 1.0, 4.0)
    np.testing.assert_allclose(points[:, 1], [6, 7, 8, 9])
    np.testing.assert_allclose(freshness, [0, 0.25, 0.5, 0.75])


@pytest.mark.parametrize("trail", [NO_TRAIL, [[0.0, -5.0]], [[0.0, -5.0]] * 300])
def test_a_trail_without_length_draws_nothing(trail):
    shown = draw_scene(scene(trail=trail), CONFIG)
    assert np.array_equal(shown, draw_scene(scene(), CONFIG))


def test_a_long_trail_is_drawn_and_fades():
    there_and_back = np.concatenate([np.linspace(-14, 14, 2000), np.linspace(14, -14, 2000)])
    lane = np.repeat([-1.5, 1.5], 2000)
    trail = np.stack([lane, there_and_back], axis=1)
    goals = np.full((2, 2), 500.0)
    empty = draw_scene(scene(goals=goals), CONFIG).astype(int)
    shown = draw_scene(scene(goals=goals, trail=trail), CONFIG).astype(int)

    def darkness(x):
        row = int(world_to_pixel(np.array([x, 0.0]), CONFIG)[1])
        return (empty - shown)[row - 4 : row + 5].sum()

    assert darkness(1.5) > 1.5 * darkness(-1.5) > 0


# --- bad input -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["robot", "people", "goals", "trail"])
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_not_finite_is_named(name, bad):
    parts = {
        "robot": np.zeros(3),
        "people": PEOPLE.copy(),
        "goals": GOALS.copy(),
        "trail": np.zeros((5, 2)),
    }
    parts[name].flat[1] = bad
    with pytest.raises(SceneError, match=rf"{name}: expected finite numbers, got {bad}"):
        Scene(collected=False, reached=False, **parts)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("robot", np.zeros(2)),
        ("people", np.zeros((3, 4))),
        ("people", np.zeros(5)),
        ("goals", np.zeros((3, 2))),
        ("trail", np.zeros((2, 5, 2))),
    ],
)
def test_a_wrong_shape_is_named_with_the_one_expected(name, value):
    with pytest.raises(
        SceneError, match=rf"{name}: expected an array of shape .*got \({len(value)}"
    ):
        scene(**{name: value})


def test_a_scene_keeps_its_own_arrays():
    trail = np.zeros((3, 2))
    shown = scene(trail=trail)
    trail[:] = 7.0
    assert (shown.trail == 0.0).all()


finite = st.floats(allow_nan=False, allow_infinity=False)


@settings(max_examples=60, deadline=None)
@given(
    robot=arrays(np.float64, 3, elements=finite),
    people=arrays(np.float64, st.tuples(st.integers(0, 5), st.just(5)), elements=finite),
    goals=arrays(np.float64, (2, 2), elements=finite),
    trail=arrays(np.float64, st.tuples(st.integers(0, 9), st.just(2)), elements=finite),
)
def test_whatever_is_finite_can_be_drawn(robot, people, goals, trail):
    picture = draw_scene(Scene(robot, people, goals, False, True, trail), CONFIG, 160)
    assert picture.shape == draw_scene(scene(), CONFIG, 160).shape


def test_people_and_goals_outside_the_picture_leave_it_as_it_is():
    gone = np.array([[0.0, 60.0], [400.0, 0.0]])
    everyone = [[0.0, -60.0, 0, 1, 0], [1e300, 1e300, 0, 0, 0], [0.0, 2e9, 0, 0, 0]]
    shown = draw_scene(scene(goals=gone, people=everyone), CONFIG)
    assert np.array_equal(shown, draw_scene(scene(goals=gone), CONFIG))


@pytest.mark.parametrize(
    "lengths",
    [
        {"half_length": 100.0},
        {"half_length": 5.0, "half_width": 20.0, "start_z": -4.0, "goal_z": 4.0},
        {
            "half_width": 1.5,
            "personal_space": 0.0,
            "human_radius": 0.05,
            "robot_radius": 1.0,
            "timestep": 0.02,
        },
        {"goal_radius": 0.1, "intermittent_radius": 5.0, "personal_space": 10.0},
    ],
)
@pytest.mark.parametrize("width", [64, 480])
def test_every_corridor_can_be_drawn(lengths, width):
    config = CorridorConfig(**lengths)
    picture = draw_scene(scene(people=PEOPLE, trail=[[0.0, -4.0], [0.0, 3.0]]), config, width)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 10


# --- the doorway ---------------------------------------------------------------------------------


def test_the_doorway_is_a_wall_with_an_opening_over_whatever_lies_on_the_floor():
    config = CorridorConfig(doorway_width=1.8, doorway_z=2.0)
    picture = draw_scene(scene(people=[[1.0, 2.0, 0.0, 0.0, 0.0]]), config)
    wall = pixel_at(picture, 3.15, 0.0)
    for x in (-2.8, -1.0, 1.9, 2.8):
        np.testing.assert_allclose(pixel_at(picture, x, 2.0), wall, atol=2)
    for x, z in [(-0.8, 2.0), (0.0, 2.0), (2.0, 2.2), (-2.0, 1.8)]:
        assert pixel_at(picture, x, z).min() > 180
    row = picture[int(world_to_pixel(np.array([-2.0, 2.0]), config)[1])]
    thick = (abs(row[300:800] - wall) <= 2).all(axis=1).sum()
    assert abs(thick - DOORWAY_WALL * 960 / 31.1) <= 1


def test_a_corridor_without_a_doorway_has_no_wall_inside():
    picture = draw_scene(scene(), CONFIG)
    assert np.array_equal(
        picture, draw_scene(scene(), CorridorConfig(doorway_width=0.0, doorway_z=5.0))
    )
