import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import bodies_of

from socialnav_env.config import CorridorConfig
from socialnav_env.people import (
    OUT_OF_SIGHT_WEIGHT,
    people_from,
    people_parameters,
    repulsion,
    walk,
    wall_repulsion,
)
from socialnav_env.vector_env import SocialCorridorVectorEnv

CONFIG = CorridorConfig(
    human_force=2.0, human_force_range=0.5, human_foresight=0.5, wall_force=10.0,
    wall_force_range=0.2, relaxation_time=0.5, timestep=0.05, frame_skip=2, human_patience=8.0,
)  # fmt: skip
P = people_parameters(CONFIG)
coordinates = st.floats(-3.0, 3.0)
speeds = st.floats(-1.5, 1.5)


def test_a_row_of_numbers_gives_the_parameters_back():
    assert people_from(np.array(P)) == P


def test_repulsion_from_someone_who_stands_by_hand():
    # b is the distance: 2 / 0.5 * exp((0.6 - 1.1) / 0.5) = 4 / e, straight away from the other
    fz, fx = repulsion(1.1 * 0.6, 1.1 * -0.8, 0.0, 0.0, 0.6, P)
    assert math.hypot(fz, fx) == pytest.approx(4.0 / math.e)
    assert fz / fx == pytest.approx(0.6 / -0.8)
    assert fz > 0


def test_repulsion_from_someone_who_comes_by_hand():
    # At (2, 0) from one who walks at +1 m/s along z: stride .5, |r| = 2, |r - v dt| = 1.5,
    # 2b = sqrt(3.5^2 - .5^2) = sqrt(12), factor 3.5 / (4 b) times two unit vectors along z.
    b = math.sqrt(12.0) / 2.0
    expected = 2.0 / 0.5 * math.exp((0.6 - b) / 0.5) * 3.5 / (4.0 * b) * 2.0
    assert repulsion(2.0, 0.0, 1.0, 0.0, 0.6, P) == pytest.approx((expected, 0.0))


def test_repulsion_grows_no_more_in_contact():
    assert repulsion(0.3, 0.0, 0.0, 0.0, 0.6, P)[0] == pytest.approx(4.0)


@given(coordinates, coordinates, speeds, speeds)
def test_repulsion_is_minus_the_gradient_of_its_potential(dz, dx, vz, vx):
    def half_axis(z, x):
        far = math.hypot(z, x) + math.hypot(z - 0.5 * vz, x - 0.5 * vx)
        return 0.5 * math.sqrt(max(far**2 - 0.25 * (vz**2 + vx**2), 0.0))

    def potential(z, x):
        return 2.0 * math.exp((0.2 - half_axis(z, x)) / 0.5)

    if half_axis(dz, dx) < 0.25:
        return
    h = 1e-6
    slope_z = (potential(dz + h, dx) - potential(dz - h, dx)) / (2 * h)
    slope_x = (potential(dz, dx + h) - potential(dz, dx - h)) / (2 * h)
    force = repulsion(dz, dx, vz, vx, 0.2, P)
    np.testing.assert_allclose(force, (-slope_z, -slope_x), atol=1e-5)


@given(coordinates, coordinates, speeds, speeds)
def test_repulsion_is_bounded_even_on_the_way_of_the_other(dz, dx, vz, vx):
    reach, stride = 0.6, 0.5 * math.hypot(vz, vx)
    within = 2.0 * reach + stride  # farther away the exponential is below its pre-factor
    strongest = 2.0 / 0.5 * 2.0 * max(within, 1.0) / (2.0 * reach)
    assert math.hypot(*repulsion(dz, dx, vz, vx, reach, P)) <= strongest


@given(coordinates, coordinates, speeds, speeds)
def test_repulsion_mirrors_with_the_scene(dz, dx, vz, vx):
    fz, fx = repulsion(dz, dx, vz, vx, 0.6, P)
    assert repulsion(dz, -dx, vz, -vx, 0.6, P) == pytest.approx((fz, -fx))
    assert repulsion(-dz, -dx, -vz, -vx, 0.6, P) == pytest.approx((-fz, -fx))


@pytest.mark.parametrize("place", [(0.0, 0.0), (14.9, 2.9), (-14.0, 2.0), (3.0, -2.8)])
def test_walls_push_inwards_and_alike_on_both_sides(place):
    z, x = place
    az, ax = wall_repulsion(z, x, P)
    assert az * z <= 0.0 and ax * x <= 0.0
    assert wall_repulsion(-z, -x, P) == pytest.approx((-az, -ax))


def test_a_wall_by_hand():
    # .4 m from one wall of strength 10 and range .2, 5.6 m from the other
    expected = 10.0 / 0.2 * (math.exp(-5.6 / 0.2) - math.exp(-0.4 / 0.2))
    assert wall_repulsion(0.0, 2.6, P)[1] == pytest.approx(expected)


def stroll(bodies, waypoints, side=0.0, waypoint=0, age=0, parameters=P):
    """Commands, waypoint and age of the one person after `walk`."""
    index = np.array([[waypoint]])
    ages = np.array([[age]])
    commands = np.zeros((1, 2, 3))
    ways = np.array([[waypoints]], dtype=np.float64)
    walk(
        bodies, ways, index, ages, np.ones((1, 1)), np.full((1, 1), side),
        np.array(parameters), commands,
    )  # fmt: skip
    return commands[0, 1], index[0, 0], ages[0, 0]


FAR = (-14.0, 0.0)


def test_whoever_stands_takes_up_speed_towards_the_waypoint():
    # (1 * e - 0) / .5 * .1 = .2 e with e = (.6, .8)
    command, waypoint, age = stroll(bodies_of(FAR, [(0.0, 0.0)]), [(1.2, 1.6), (0.0, 0.0)])
    np.testing.assert_allclose(command, [0.12, 0.16, 0.0], atol=1e-5)
    assert (waypoint, age) == (0, 1)


def test_nobody_walks_faster_than_a_third_above_the_preferred_speed():
    command, _, _ = stroll(bodies_of(FAR, [(0.0, 0.0, 0.0, 9.0, 0.0)]), [(5.0, 0.0)])
    assert np.hypot(*command[:2]) == pytest.approx(1.3)


def test_a_reached_waypoint_is_followed_by_the_next_and_the_last_by_the_first():
    ways = [(0.3, 0.0), (3.0, 0.0)]
    person = bodies_of(FAR, [(0.0, 0.0)])
    assert stroll(person, ways, waypoint=0, age=7)[1:] == (1, 0)
    assert stroll(bodies_of(FAR, [(2.8, 0.0)]), ways, waypoint=1, age=7)[1:] == (0, 0)


def test_patience_ends():
    person = bodies_of(FAR, [(0.0, 0.0)])
    assert stroll(person, [(5.0, 0.0), (-5.0, 0.0)], age=79)[1:] == (0, 80)
    command, waypoint, age = stroll(person, [(5.0, 0.0), (-5.0, 0.0)], age=80)
    assert (waypoint, age) == (1, 0)
    assert command[0] < 0


def test_the_robot_is_evaded_and_counts_half_out_of_sight():
    ahead = stroll(bodies_of((1.0, 0.0), [(0.0, 0.0)]), [(5.0, 0.0)])[0]
    behind = stroll(bodies_of((-1.0, 0.0), [(0.0, 0.0)]), [(5.0, 0.0)])[0]
    force = repulsion(1.0, 0.0, 0.0, 0.0, 0.6, P)[0]
    assert ahead[0] == pytest.approx(0.1 * (2.0 - force), abs=1e-6)
    assert behind[0] == pytest.approx(0.1 * (2.0 + OUT_OF_SIGHT_WEIGHT * force), abs=1e-6)


def test_head_on_a_lean_gives_a_sidestep_to_its_side():
    meeting = bodies_of((1.0, 0.0), [(0.0, 0.0)])
    left = stroll(meeting, [(5.0, 0.0)], side=-0.1)[0]
    right = stroll(meeting, [(5.0, 0.0)], side=0.1)[0]
    assert left[1] == pytest.approx(-right[1])
    assert left[1] > 0


@pytest.fixture(scope="module")
def strolls():
    """(T, N, H, 4) z, x, velocity z, x of people while the robots stand."""
    env = SocialCorridorVectorEnv(16, terminate_on_collision=False, terminate_on_goal=False)
    env.reset(seed=0)
    rows = []
    for _ in range(600):
        rows.append(env.world.state.bodies[:, 1:, [0, 1, 3, 4]].copy())
        env.step(np.tile([-1.0, 0.0], (16, 1)))
    return env.config, np.stack(rows)


def test_no_one_stands_still_for_an_episode(strolls):
    config, rows = strolls
    paths = np.linalg.norm(np.diff(rows[..., :2], axis=0), axis=-1).sum(axis=0)
    assert paths.min() > 0.25 * config.human_speed * 60.0
    minutes = rows.reshape(6, 100, *rows.shape[1:])
    roams = np.ptp(minutes[..., :2], axis=1).max(axis=-1)
    assert roams.min() > 0.2  # within any ten seconds


def test_nobody_leaves_or_runs(strolls):
    config, rows = strolls
    edge = np.array([config.half_length, config.half_width]) - config.human_radius
    assert (np.abs(rows[..., :2]) <= edge + 0.05).all()
    assert np.linalg.norm(rows[..., 2:], axis=-1).max() <= config.human_top_speed + 1e-9
