import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import bodies_of

from socialnav_env.config import CorridorConfig
from socialnav_env.observation import (
    HEAD,
    NUM_RAYS,
    observation_bounds,
    observation_parameters,
    observation_size,
    observe,
    ray_length,
    sight_from,
)

CONFIG = CorridorConfig(
    half_length=15.0, half_width=3.0, human_radius=0.3, ray_range=6.0,
    robot_speed=0.83, robot_turn_rate=1.0, human_speed=1.0, human_speed_std=0.15,
)  # fmt: skip
P = observation_parameters(CONFIG)
GOALS = ((-2.5, 1.0), (12.0, -1.0))


def look(bodies, goals=GOALS, flags=(False, False)):
    people = bodies.shape[1] - 1
    config = CorridorConfig(num_humans=people, half_length=15.0, half_width=3.0)
    low, high = observation_bounds(config)
    out = np.empty((1, len(low)))
    observe(bodies, np.array([goals]), np.array([flags]), low, high, np.array(P), out)
    return out[0]


def test_a_row_of_numbers_gives_the_parameters_back():
    assert sight_from(np.array(P)) == P


@pytest.mark.parametrize("people", range(5))
def test_the_size_follows_from_the_number_of_people(people):
    low, high = observation_bounds(CorridorConfig(num_humans=people))
    assert len(low) == len(high) == observation_size(people) == 24 + 4 * people
    assert (low < high).all()


def test_looking_along_the_corridor_by_hand():
    seen = look(bodies_of((-4.0, 0.5, 0.0, 0.6, 0.1, 0.2), [(-2.0, 1.5, 0.0, -0.9, 0.3)]))
    np.testing.assert_allclose(seen[:7], [0.5, -4.0, 1.0, 0.0, 0.6, 0.1, 0.2])
    near, far = math.hypot(1.5, 0.5), math.hypot(16.0, 1.5)
    np.testing.assert_allclose(seen[7:11], [near, 1.5 / near, 0.5 / near, 0.0])
    np.testing.assert_allclose(seen[11:15], [far, 16.0 / far, -1.5 / far, 0.0])
    np.testing.assert_allclose(seen[15:19], [2.0, 1.0, -1.5, 0.2])


def test_looking_to_the_left_by_hand():
    # The robot's forward is +x, and its left is -z.
    seen = look(bodies_of((-4.0, 0.5, math.pi / 2, 0.1, 0.6, 0.0), [(-2.0, 1.5, 0.0, -0.9, 0.3)]))
    np.testing.assert_allclose(seen[2:6], [0.0, 1.0, 0.6, -0.1], atol=1e-12)
    near = math.hypot(1.5, 0.5)
    np.testing.assert_allclose(seen[7:10], [near, 0.5 / near, -1.5 / near], atol=1e-12)
    np.testing.assert_allclose(seen[15:19], [1.0, -2.0, -0.3, 1.0], atol=1e-12)


def test_a_goal_beneath_the_robot_is_straight_ahead():
    np.testing.assert_array_equal(look(bodies_of((-2.5, 1.0, 0.7)))[7:10], [0.0, 1.0, 0.0])


@pytest.mark.parametrize("flags", [(False, False), (True, False), (False, True), (True, True)])
def test_flags(flags):
    assert tuple(look(bodies_of((0.0, 0.0)), flags=flags)[[10, 14]]) == flags


def test_nine_rays_between_walls_by_hand():
    # 1 m from the left wall and 5 m from the right one, 3 m from the final wall
    rays = look(bodies_of((12.0, 2.0)))[-NUM_RAYS:]
    angles = np.radians([-90, -67.5, -45, -22.5, 0, 22.5, 45, 67.5, 90])
    right = [5.0 / math.sin(-angle) for angle in angles[:2]]
    ahead = [3.0 / math.cos(angle) for angle in angles[2:5]]
    left = [1.0 / math.sin(angle) for angle in angles[5:]]
    np.testing.assert_allclose(rays, [*right, *ahead, *left])


def test_a_ray_ends_at_its_range_and_at_a_person():
    assert look(bodies_of((0.0, 0.0)))[HEAD + 4] == 6.0
    seen = look(bodies_of((0.0, 0.0), [(2.0, 0.0)]))
    assert seen[HEAD + 4 + 4] == pytest.approx(1.7)
    beside = look(bodies_of((0.0, 0.0), [(2.0, 0.18)]))  # .18 = .6 r: half a chord is .8 r
    assert beside[HEAD + 4 + 4] == pytest.approx(2.0 - 0.24)
    behind = look(bodies_of((0.0, 0.0), [(-2.0, 0.0)]))
    assert behind[HEAD + 4 + 4] == 6.0


def test_the_nearer_of_two_hides_the_other():
    seen = look(bodies_of((0.0, 0.0), [(4.0, 0.0), (2.0, 0.0)]))
    assert seen[HEAD + 8 + 4] == pytest.approx(1.7)


@given(st.floats(-14.0, 14.0), st.floats(-2.5, 2.5), st.floats(-4.0, 4.0))
def test_the_tip_of_a_ray_lies_on_what_it_met(z, x, angle):
    bodies = bodies_of((z, x), [(0.0, 0.0)])[0]
    length = ray_length(bodies, math.cos(angle), math.sin(angle), P)
    tip = np.array([z + length * math.cos(angle), x + length * math.sin(angle)])
    if math.hypot(z, x) <= 0.3:
        return  # inside the person
    on_wall = min(abs(abs(tip[0]) - 15.0), abs(abs(tip[1]) - 3.0)) < 1e-9
    on_person = abs(np.hypot(*tip) - 0.3) < 1e-6
    assert on_wall or on_person or length == 6.0
    assert np.hypot(*tip) >= 0.3 - 1e-9
    assert abs(tip[0]) <= 15.0 + 1e-9 and abs(tip[1]) <= 3.0 + 1e-9


numbers = st.floats(-100.0, 100.0)


@given(st.lists(st.tuples(*[numbers] * 6), min_size=1, max_size=4))
def test_whatever_happens_the_observation_lies_in_its_box(rows):
    seen = look(bodies_of(rows[0], rows[1:]))
    low, high = observation_bounds(CorridorConfig(num_humans=len(rows) - 1))
    assert (low <= seen).all() and (seen <= high).all()


@given(st.floats(-14.0, 14.0), st.floats(-2.9, 2.9), st.floats(-6.0, 6.0), st.floats(-6.0, 6.0))
def test_distances_do_not_depend_on_the_heading(z, x, angle, other):
    def norms(heading):
        seen = look(bodies_of((z, x, heading, 0.5, 0.2), [(1.0, 1.0, 0.0, 0.4, -0.8)]))
        pairs = (seen[i : i + 2] for i in (2, 4, 8, 12, 15, 17))
        return [seen[7], seen[11], *(np.hypot(*pair) for pair in pairs)]

    np.testing.assert_allclose(norms(angle), norms(other))


def test_a_mirrored_scene_gives_mirrored_rays():
    rays = look(bodies_of((1.0, 0.7, 0.4), [(2.5, 1.6)]))[-NUM_RAYS:]
    mirrored = look(bodies_of((1.0, -0.7, -0.4), [(2.5, -1.6)]))[-NUM_RAYS:]
    np.testing.assert_allclose(rays, mirrored[::-1])
