import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import STAND, bodies_of

from socialnav_env.config import CorridorConfig
from socialnav_env.people import (
    BEYOND_DOOR,
    OUT_OF_SIGHT_WEIGHT,
    aim,
    people_from,
    people_parameters,
    repulsion,
    social_force,
    walk,
    wall_repulsion,
)
from socialnav_env.world import World

CONFIG = CorridorConfig(
    human_force=2.0, human_force_range=0.5, human_foresight=0.5, wall_force=10.0,
    wall_force_range=0.2, relaxation_time=0.5, timestep=0.05, frame_skip=2, human_patience=8.0,
)  # fmt: skip
P = people_parameters(CONFIG)
compiled = settings(deadline=None)
"""The first call of a kernel takes longer."""
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


@compiled
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


@compiled
@given(coordinates, coordinates, speeds, speeds)
def test_repulsion_is_bounded_even_on_the_way_of_the_other(dz, dx, vz, vx):
    reach, stride = 0.6, 0.5 * math.hypot(vz, vx)
    within = 2.0 * reach + stride  # farther away the exponential is below its pre-factor
    strongest = 2.0 / 0.5 * 2.0 * max(within, 1.0) / (2.0 * reach)
    assert math.hypot(*repulsion(dz, dx, vz, vx, reach, P)) <= strongest


@compiled
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


# --- the doorway ---------------------------------------------------------------------------------

DOOR = CorridorConfig(
    human_force=2.0, human_force_range=0.5, wall_force=10.0, wall_force_range=0.2,
    doorway_width=1.8, doorway_z=2.0, human_radius=0.3,
)  # fmt: skip
D = people_parameters(DOOR)


def door_force(z, x):
    """The part of the doorway's wall."""
    return np.subtract(wall_repulsion(z, x, D), wall_repulsion(z, x, P))


def test_the_wall_beside_a_doorway_by_hand():
    # .4 m from its face at |x| = 2, where it is flat; the other half ends 3 m away
    az, ax = door_force(2.0 - 0.1 - 0.4, 2.0)
    assert az == pytest.approx(-10.0 / 0.2 * math.exp(-0.4 / 0.2), rel=1e-5)
    assert ax == pytest.approx(0.0, abs=1e-4)


def test_a_doorpost_by_hand():
    # its round end has the middle (2, 1): from (1.7, .6) it is .5 m to there, .4 m to the surface
    az, ax = door_force(1.7, 0.6)
    strength = 10.0 / 0.2 * math.exp(-0.4 / 0.2)
    other = 10.0 / 0.2 * math.exp(-(math.hypot(0.3, 1.6) - 0.1) / 0.2)
    assert az == pytest.approx(-strength * 0.6, abs=other)
    assert ax == pytest.approx(-strength * 0.8, abs=other)


def test_between_the_doorposts_nothing_pulls():
    assert wall_repulsion(2.0, 0.0, D) == pytest.approx((0.0, 0.0), abs=1e-4)
    assert door_force(2.0, 0.4)[1] < -1.0 and door_force(2.0, -0.4)[1] > 1.0


@compiled
@given(st.floats(-5.0, 5.0), st.floats(-2.5, 2.5))
def test_the_doorway_mirrors_with_the_scene(ahead, x):
    if 0.0 < abs(ahead) < 1e-3:
        return  # in the middle of the wall the push turns round
    az, ax = door_force(2.0 + ahead, x)
    assert door_force(2.0 + ahead, -x) == pytest.approx((az, -ax), abs=1e-8)
    assert door_force(2.0 - ahead, x) == pytest.approx((-az, ax), abs=1e-8)


@compiled
@given(st.floats(-1.5, 1.5), st.floats(-2.5, 2.5))
def test_the_doorways_push_is_minus_the_gradient_of_its_potential(ahead, x):
    def potential(z, x):
        gaps = [math.hypot(z - 2.0, max(1.0 - side * x, 0.0)) - 0.1 for side in (-1.0, 1.0)]
        return 10.0 * sum(math.exp(-gap / 0.2) for gap in gaps)

    z, h = 2.0 + ahead, 1e-6
    if min(abs(ahead), abs(abs(x) - 1.0)) < 1e-3:
        return  # the middle of the wall, the seam of its flat and its round part
    slope_z = (potential(z + h, x) - potential(z - h, x)) / (2 * h)
    slope_x = (potential(z, x + h) - potential(z, x - h)) / (2 * h)
    np.testing.assert_allclose(door_force(z, x), (-slope_z, -slope_x), atol=1e-4)


def test_where_to_aim_by_hand():
    assert aim(-4.0, 1.0, 0.0, 2.0, D) == (0.0, 2.0)  # on this side
    assert aim(5.0, 1.0, 3.0, 2.0, D) == (3.0, 2.0)
    assert aim(-4.0, 1.0, 8.0, 2.0, P) == (8.0, 2.0)  # there is no wall
    # the straight way crosses the wall's plane at x = .3, within the free half width .9 - .3 - .1
    assert aim(-4.0, 0.0, 16.0, 1.0, D) == pytest.approx((2.0 + BEYOND_DOOR, 0.3))
    assert aim(-4.0, 2.0, 8.0, 2.0, D) == pytest.approx((2.0 + BEYOND_DOOR, 0.5))
    assert aim(8.0, -2.0, -4.0, -2.0, D) == pytest.approx((2.0 - BEYOND_DOOR, -0.5))


@compiled
@given(*[st.floats(-14.0, 14.0), st.floats(-2.5, 2.5)] * 2)
def test_whoever_aims_through_the_doorway_has_room_there(z, x, to_z, to_x):
    aim_z, aim_x = aim(z, x, to_z, to_x, D)
    if (z - 2.0) * (to_z - 2.0) >= 0.0:
        assert (aim_z, aim_x) == (to_z, to_x)
    else:
        assert abs(aim_x) <= 0.5 + 1e-12
        assert aim_z - 2.0 == pytest.approx(math.copysign(BEYOND_DOOR, to_z - z))


# --- the sum -------------------------------------------------------------------------------------


@st.composite
def crowds(draw):
    """(1 + H, 6) bodies."""
    people = draw(st.integers(1, 6))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    bodies = np.zeros((1 + people, 6))
    bodies[:, :2] = rng.uniform(-1.0, 1.0, (1 + people, 2)) * (14.0, 2.8)
    bodies[:, 3:5] = rng.uniform(-1.7, 1.7, (1 + people, 2))
    return bodies


def full_force(bodies, h, ez, ex, side, p):
    """The social force with nothing left out."""
    total = np.array(wall_repulsion(*bodies[h, :2], p))
    turn = np.array([[math.cos(side), -math.sin(side)], [math.sin(side), math.cos(side)]])
    for other in range(len(bodies)):
        if other != h:
            apart = bodies[h, :2] - bodies[other, :2]
            reach = p.human_radius + (p.human_radius if other else p.robot_radius)
            force = turn @ repulsion(*apart, *bodies[other, 3:5], reach, p)
            seen = -apart @ (ez, ex) >= np.linalg.norm(apart) * p.sight_cosine
            total += force if seen else OUT_OF_SIGHT_WEIGHT * force
    return total


@pytest.mark.parametrize(
    "config",
    [
        CorridorConfig(),
        DOOR,
        CorridorConfig(human_force_range=0.05, human_foresight=2.0),
        CorridorConfig(human_force_range=0.01, human_foresight=5.0, robot_speed=5.0),
    ],
    ids=["defaults", "doorway", "foresight", "far foresight"],
)
@compiled
@given(crowds(), st.floats(0.0, 2 * math.pi), st.floats(-0.2, 0.2))
def test_what_is_left_out_far_away_is_negligible(config, bodies, angle, side):
    p = people_parameters(config)
    ez, ex = math.cos(angle), math.sin(angle)
    for h in range(1, len(bodies)):
        force = social_force(bodies, h, ez, ex, side, p)
        np.testing.assert_allclose(force, full_force(bodies, h, ez, ex, side, p), atol=1e-8)


@compiled
@given(crowds())
def test_oblivious_people_mind_walls_only(bodies):
    p = people_parameters(CorridorConfig(reactive=False))
    for h in range(1, len(bodies)):
        assert social_force(bodies, h, 1.0, 0.0, 0.1, p) == wall_repulsion(*bodies[h, :2], p)


@compiled
@given(crowds())
def test_who_does_not_see_the_robot_still_sees_people(bodies):
    seeing, blind = (people_parameters(CorridorConfig(robot_visible=v)) for v in (True, False))
    away = bodies.copy()
    away[0, :2] = 1e3
    for h in range(1, len(bodies)):
        force = social_force(bodies, h, 1.0, 0.0, 0.1, blind)
        assert force == social_force(away, h, 1.0, 0.0, 0.1, seeing)


# --- a step --------------------------------------------------------------------------------------


def stroll(bodies, waypoints, side=0.0, waypoint=0, age=0, waits=False, parameters=P):
    """Commands, waypoint, age and force of the one person after `walk`; ages in steps of .1 s."""
    index = np.array([[waypoint]])
    ages = np.array([[0.1 * age]])
    commands, forces = np.zeros((1, 2, 3)), np.zeros((1, 1, 2))
    ways = np.array([[waypoints]], dtype=np.float64)
    walk(
        bodies, ways, index, ages, np.ones((1, 1)), np.full((1, 1), side), np.full((1, 1), waits),
        np.array([parameters]), 0.1, commands, forces,
    )  # fmt: skip
    return commands[0, 1], index[0, 0], round(ages[0, 0] / 0.1), forces[0, 0]


FAR = (-14.0, 0.0)


def test_whoever_stands_takes_up_speed_towards_the_waypoint():
    # (1 * e - 0) / .5 * .1 = .2 e with e = (.6, .8)
    command, waypoint, age, force = stroll(bodies_of(FAR, [(0.0, 0.0)]), [(1.2, 1.6), (0.0, 0.0)])
    np.testing.assert_allclose(command, [0.12, 0.16, 0.0], atol=1e-5)
    np.testing.assert_allclose(force, 0.0, atol=1e-4)
    assert (waypoint, age) == (0, 1)


def test_nobody_walks_faster_than_a_third_above_the_preferred_speed():
    command = stroll(bodies_of(FAR, [(0.0, 0.0, 0.0, 9.0, 0.0)]), [(5.0, 0.0)])[0]
    assert np.hypot(*command[:2]) == pytest.approx(1.3)


def test_a_reached_waypoint_is_followed_by_the_next_and_the_last_by_the_first():
    ways = [(0.3, 0.0), (3.0, 0.0)]
    person = bodies_of(FAR, [(0.0, 0.0)])
    assert stroll(person, ways, waypoint=0, age=7)[1:3] == (1, 0)
    assert stroll(bodies_of(FAR, [(2.8, 0.0)]), ways, waypoint=1, age=7)[1:3] == (0, 0)


def test_patience_ends():
    person = bodies_of(FAR, [(0.0, 0.0)])
    assert stroll(person, [(5.0, 0.0), (-5.0, 0.0)], age=79)[1:3] == (0, 80)
    command, waypoint, age, _ = stroll(person, [(5.0, 0.0), (-5.0, 0.0)], age=80)
    assert (waypoint, age) == (1, 0)
    assert command[0] < 0


@pytest.mark.parametrize(
    ("speed", "age"), [((0.6, 0.0), 80), ((0.4, 0.9), 81), ((0.4, 0.0), 81), ((-1.0, 0.0), 81)]
)
def test_who_gets_ahead_loses_no_patience(speed, age):
    """The way may be long: at half of the preferred speed towards the waypoint nobody gives up."""
    person = bodies_of(FAR, [(0.0, 0.0, 0.0, *speed)])
    assert stroll(person, [(12.0, 0.0), (-5.0, 0.0)], age=70)[2] == age - 10
    turned = stroll(person, [(12.0, 0.0), (-5.0, 0.0)], age=80)[1:3]
    assert turned == ((0, 80) if age == 80 else (1, 0))


def test_who_waits_slows_down_at_the_waypoint_and_leaves_when_patience_is_out():
    ways = [(0.25, 0.0), (-5.0, 0.0)]
    person = bodies_of(FAR, [(0.0, 0.0)])
    command, waypoint, age, _ = stroll(person, ways, age=79, waits=True)
    assert command[0] == pytest.approx(0.1)  # half of the way to arrival, so half of the .2
    assert (waypoint, age) == (0, 80)  # reached already
    assert stroll(person, ways, age=80, waits=True)[1:3] == (1, 0)
    moving = bodies_of(FAR, [(0.0, 0.0, 0.0, 1.0, 0.0)])
    assert stroll(moving, [(5.0, 0.0), (-5.0, 0.0)], age=5, waits=True)[2] == 6  # time counts


def test_each_corridor_has_its_own_parameters():
    slow = people_parameters(CorridorConfig(relaxation_time=1.0))
    bodies = np.repeat(bodies_of(FAR, [(0.0, 0.0)]), 2, axis=0)
    ways, index = np.full((2, 1, 1, 2), 5.0), np.zeros((2, 1), dtype=np.int64)
    commands, forces = np.zeros((2, 2, 3)), np.zeros((2, 1, 2))
    walk(
        bodies, ways, index, index.copy(), np.ones((2, 1)), np.zeros((2, 1)),
        np.zeros((2, 1), dtype=np.bool_), np.array([P, slow]), 0.1, commands, forces,
    )  # fmt: skip
    np.testing.assert_allclose(commands[0, 1], 2.0 * commands[1, 1], atol=1e-4)


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


# --- episodes ------------------------------------------------------------------------------------


def watch(count, steps, robot=(-14.5, 2.5), **keywords):
    """The world, and (T, N, H, 4) z, x, velocity z, x of people while the robots stand."""
    world = World(CorridorConfig.from_keywords(**keywords), count)
    for n in range(count):
        world.begin(n, np.random.default_rng(n))
        world.state.bodies[n, 0, :2] = robot
    rows = []
    for _ in range(steps):
        rows.append(world.state.bodies[:, 1:, [0, 1, 3, 4]].copy())
        world.act(np.tile(STAND, (count, 1)))
    return world, np.stack(rows)


@pytest.fixture(scope="module")
def strolls():
    world, rows = watch(16, 600)
    return world.config, rows


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


def test_who_walks_along_gets_from_end_to_end():
    _, rows = watch(10, 600, walking="along")
    assert np.mean(np.ptp(rows[..., 0], axis=0) > 20.0) > 0.9


def test_people_get_through_the_doorway():
    world, rows = watch(15, 600, scenario="doorway")
    before = rows[..., 0] < world.config.doorway_z
    times = (before[1:] != before[:-1]).sum(axis=0)
    assert (times > 0).mean() >= 0.95
    assert times.mean() > 1.5
    # and through the opening only
    inside = np.abs(rows[..., 0] - world.config.doorway_z) < 0.1
    assert inside.any() and np.abs(rows[inside][:, 1]).max() < 0.9 - 0.3 + 0.02


@pytest.mark.parametrize(("walking", "people"), [("group", 4), ("queue", 5)])
def test_who_stands_and_waits_stays_and_comes_to_rest(walking, people):
    """Neighbours push each other apart until the pull of their places is as strong."""
    world, rows = watch(10, 200, walking=walking, num_humans=people, human_patience=60.0)
    drift = np.linalg.norm(rows[..., :2] - world.state.waypoints[:, :, 0], axis=-1)
    assert drift.max() < 0.6
    speed = np.linalg.norm(rows[150:, ..., 2:], axis=-1)
    assert speed.max() < 0.05
    assert (world.state.waypoint == 0).all()


def test_a_queue_moves_up_after_patience():
    world, rows = watch(30, 241, walking="queue", num_humans=4, human_patience=12.0)
    places = world.state.waypoints[:, :, 0]
    before, after = rows[119, ..., :2], rows[240, ..., :2]
    assert (world.state.waypoint == 1).all()
    assert np.linalg.norm(before - places, axis=-1).max() < 0.6
    moved_up = np.linalg.norm(after - np.roll(places, 1, axis=1), axis=-1) < 0.6
    assert moved_up[:, 1:].mean() > 0.95
    assert moved_up[:, 0].mean() > 0.6  # the first one has to get past the others to their end


def test_a_robot_in_the_way_is_evaded_where_it_is_seen():
    """A person walks almost straight at a robot that stands."""
    near = {}
    for visible in (True, False):
        config = CorridorConfig(num_humans=1, robot_visible=visible)
        world = World(config, 1)
        world.begin(0, np.random.default_rng(0))
        world.place(0, bodies_of((0.0, 0.0), [(-0.05, -2.0, 0.0, 0.0, 1.0)])[0])
        world.state.waypoints[0, 0] = (-0.05, 2.0)
        gaps, touched = [], False
        for _ in range(40):
            world.act(STAND)
            gaps.append(np.linalg.norm(np.subtract(*world.state.bodies[0, :, :2])) - 0.6)
            touched |= bool(world.contacts[0, 0])
        near[visible] = min(gaps)
        assert touched != visible
    assert near[True] > 0.05 > near[False]


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32))
def test_oblivious_people_walk_as_if_alone(seed):
    """Until they run into somebody."""
    alone = World(CorridorConfig(num_humans=1, reactive=False), 1)
    world = World(CorridorConfig(num_humans=3, reactive=False), 1)
    for each in (alone, world):
        each.begin(0, np.random.default_rng(seed))
    here, all_ = alone.state, world.state
    here.bodies[0] = all_.bodies[0, :2]
    for name in ("waypoints", "speeds", "sides"):
        getattr(here, name)[0] = getattr(all_, name)[0, :1]
    for _ in range(100):
        alone.act(STAND)
        world.act(STAND)
        places = all_.bodies[0, :, :2]
        gaps = np.linalg.norm(places[1] - np.delete(places, 1, axis=0), axis=1)
        if gaps.min() < 0.7:
            return
        assert np.array_equal(here.bodies[0], all_.bodies[0, :2])


def test_a_queues_last_turn_is_followed_by_its_first_in_whole_rounds():
    """Of 32 turns three people use 30, or at the end all would move by two places."""
    index, ages = np.full((1, 3), 29), np.full((1, 3), 8.0)
    bodies = bodies_of(FAR, [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)])
    commands, forces = np.zeros((1, 4, 3)), np.zeros((1, 3, 2))
    waits, ones = np.ones((1, 3), dtype=np.bool_), np.ones((1, 3))
    ways = np.zeros((1, 3, 32, 2))
    walk(bodies, ways, index, ages, ones, ones, waits, np.array([P]), 0.1, commands, forces)
    assert index.tolist() == [[0, 0, 0]]


def test_half_a_step_twice_is_a_step():
    """MuJoCo code may call `do_simulation(action, 1)` in a loop: people live by the clock."""
    config = CorridorConfig(num_humans=1, human_foresight=0.0, human_force=0.0, wall_force=0.0)
    speeds = []
    for frames in (1, 2, 4):
        world = World(config, 1)
        world.begin(0, np.random.default_rng(0))
        world.state.bodies[0, 1, 3:5] = 0.0
        for _ in range(40 // frames):
            world.simulate(np.array([[-1.0, 0.0]]), frames)
        speeds.append(np.hypot(*world.state.bodies[0, 1, 3:5]) / world.state.speeds[0, 0])
    np.testing.assert_allclose(speeds, 1.0, atol=0.05)


@pytest.mark.parametrize("frames", [0, -3, 1.5, True])
def test_a_number_of_frames_is_whole_and_positive(frames):
    world = World(CorridorConfig(), 1)
    world.begin(0, np.random.default_rng(0))
    with pytest.raises(ValueError, match=r"frames=.*whole number of at least 1"):
        world.simulate(np.zeros((1, 2)), frames)
