import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import bodies_of, world_with

from socialnav_env.config import CorridorConfig
from socialnav_env.robot import action_size, drive

SPEED, TURN = 0.8, 1.5
compiled = settings(deadline=None)
shares = st.floats(-1.0, 1.0)
headings = st.floats(-10.0, 10.0)


def command(action, heading=0.0):
    """The robot's next velocity z, x and angular, and the action as it was clipped."""
    actions = np.array([action], dtype=np.float64)
    clipped, commands = np.full(actions.shape, 9.0), np.zeros((1, 1, 3))
    drive(actions, bodies_of((0.0, 0.0, heading)), SPEED, TURN, clipped, commands)
    return commands[0, 0], clipped[0]


def in_robots_frame(velocity, heading):
    """Ahead and left."""
    z, x = velocity[:2]
    cos, sin = math.cos(heading), math.sin(heading)
    return np.array([z * cos + x * sin, x * cos - z * sin])


def test_the_length_of_an_action():
    assert action_size(CorridorConfig()) == 2
    assert action_size(CorridorConfig(action="holonomic")) == 3


# --- unicycle ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("action", "heading", "expected"),
    [
        ((1.0, 0.0), 0.0, (0.8, 0.0, 0.0)),
        ((-1.0, 1.0), 0.0, (0.0, 0.0, 1.5)),
        ((0.0, -0.5), 0.0, (0.4, 0.0, -0.75)),
        ((1.0, 0.0), math.pi / 2, (0.0, 0.8, 0.0)),  # a robot that looks to the left moves there
        ((0.5, 0.0), math.pi, (-0.6, 0.0, 0.0)),
        ((3.0, -7.0), 0.0, (0.8, 0.0, -1.5)),  # clipped
        ((-3.0, 0.0), 0.0, (0.0, 0.0, 0.0)),
    ],
)
def test_a_unicycle_by_hand(action, heading, expected):
    np.testing.assert_allclose(command(action, heading)[0], expected, atol=1e-12)


@compiled
@given(shares, shares, headings)
def test_a_unicycle_moves_the_way_it_looks(forward, turn, heading):
    velocity, clipped = command((forward, turn), heading)
    ahead, left = in_robots_frame(velocity, heading)
    assert ahead == pytest.approx(SPEED * (forward + 1.0) / 2.0, abs=1e-12)
    assert left == pytest.approx(0.0, abs=1e-12)
    assert velocity[2] == TURN * turn
    assert tuple(clipped) == (forward, turn)


# --- holonomic -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("action", "heading", "expected"),
    [
        ((0.0, 0.0, 0.0), 0.0, (0.0, 0.0, 0.0)),
        ((1.0, 0.0, 0.0), 0.0, (0.8, 0.0, 0.0)),
        ((-1.0, 0.0, 0.2), 0.0, (-0.8, 0.0, 0.3)),
        ((0.0, 0.5, 0.0), 0.0, (0.0, 0.4, 0.0)),  # +x is to the left of a robot that looks along +z
        ((0.0, 1.0, 0.0), math.pi / 2, (-0.8, 0.0, 0.0)),
        ((0.3, -0.4, -1.0), math.pi, (-0.24, 0.32, -1.5)),
        ((1.0, 1.0, 0.0), 0.0, (0.8 * math.sqrt(0.5), 0.8 * math.sqrt(0.5), 0.0)),  # capped
        ((0.9, -1.2, 0.0), 0.0, (0.8 * 0.9 / math.hypot(0.9, 1.0), -0.8 / math.hypot(0.9, 1.0), 0)),
    ],
)
def test_a_holonomic_base_by_hand(action, heading, expected):
    np.testing.assert_allclose(command(action, heading)[0], expected, atol=1e-12)


@compiled
@given(st.tuples(*[st.floats(-3.0, 3.0)] * 3), headings)
def test_no_direction_is_faster_than_top_speed(action, heading):
    velocity, clipped = command(action, heading)
    speed = np.hypot(*velocity[:2])
    assert speed <= SPEED + 1e-12
    assert abs(velocity[2]) <= TURN
    np.testing.assert_array_equal(clipped, np.clip(action, -1.0, 1.0))
    length = np.hypot(*clipped[:2])
    assert speed == pytest.approx(SPEED * min(length, 1.0), abs=1e-12)
    if length > 1e-3:  # the direction stays
        np.testing.assert_allclose(
            in_robots_frame(velocity, heading) / speed, clipped[:2] / length, atol=1e-9
        )


@compiled
@given(shares, shares, shares, headings, headings)
def test_the_heading_turns_the_velocity_with_it(ahead, left, turn, heading, other):
    first = command((ahead, left, turn), heading)[0]
    second = command((ahead, left, turn), other)[0]
    np.testing.assert_allclose(
        in_robots_frame(first, heading), in_robots_frame(second, other), atol=1e-12
    )


# --- in the world --------------------------------------------------------------------------------


def test_robots_are_told_apart_and_people_left_alone():
    actions = np.array([(1.0, 0.0), (-1.0, 1.0), (0.0, -1.0)])
    bodies = np.repeat(bodies_of((0.0, 0.0), [(5.0, 0.0)]), 3, axis=0)
    commands = np.full((3, 2, 3), 7.0)
    drive(actions, bodies, SPEED, TURN, np.zeros((3, 2)), commands)
    np.testing.assert_allclose(commands[:, 0], [(0.8, 0, 0), (0, 0, 1.5), (0.4, 0, -1.5)])
    assert (commands[:, 1] == 7.0).all()


def test_a_holonomic_robot_goes_sideways_through_the_world():
    world = world_with((0.0, 0.0, 0.5), action="holonomic", robot_speed=1.0)
    for _ in range(11):
        world.step(np.array([[0.0, 1.0, 0.0]]))
    z, x, angle, vz, vx, _ = world.state.bodies[0, 0]
    assert angle == 0.5
    np.testing.assert_allclose((vz, vx), (-math.sin(0.5), math.cos(0.5)))
    # 1.1 s, less the one physics step of .05 s in which the speed is taken up
    np.testing.assert_allclose((z, x), (-1.05 * math.sin(0.5), 1.05 * math.cos(0.5)))


def test_a_unicycle_that_turns_drives_a_circle():
    world = world_with((0.0, 0.0), robot_speed=0.5, robot_turn_rate=1.0, timestep=0.002)
    places = []
    for _ in range(round(2 * math.pi / 0.004)):
        world.step(np.array([[1.0, 1.0]]))
        places.append(world.state.bodies[0, 0, :2].copy())
    # radius v / w = .5 m, to the left: around (0, .5)
    np.testing.assert_allclose(
        np.linalg.norm(np.subtract(places, (0.0, 0.5)), axis=1), 0.5, rtol=0.01
    )
    np.testing.assert_allclose(places[-1], (0.0, 0.0), atol=0.01)
