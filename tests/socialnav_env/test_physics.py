import copy
import gc
import math
import pickle
import subprocess
import sys

import numpy as np
import pymunk
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pymunk import batch
from scenes import FORWARD, STAND, bodies_of, world_with

from socialnav_env.chipmunk import Transfer, stepper
from socialnav_env.config import DOORWAY_WALL, CorridorConfig
from socialnav_env.physics import Physics, can_touch, fly, physics_from, physics_parameters
from socialnav_env.world import World

LEFT, STILL = math.pi / 2, (0.0, 0.0, 0.0)
NOBODY_PUSHES = {"human_force": 0.0, "wall_force": 0.0}
"""People who do not evade, so that contacts happen."""


def move(config, start, commands, steps=1):
    """Bodies and contacts after some steps of the bare physics at constant commands."""
    physics, bodies = Physics(config, 1), start.copy()
    contacts, time = np.zeros((1, 2), dtype=np.bool_), np.zeros(1)
    touched = np.zeros((1, 2), dtype=np.bool_)
    for _ in range(steps):
        physics.commands[0] = commands
        physics.step(config.frame_skip, bodies, contacts, time)
        touched |= contacts
    return bodies[0], touched[0].tolist(), time[0]


def test_a_free_body_takes_up_its_command_in_one_physics_step_and_moves_with_it():
    config = CorridorConfig(num_humans=1, timestep=0.05, frame_skip=4)
    start = bodies_of((0.0, 0.0, 0.2), [(5.0, 1.0, 0.0, 0.4, 0.0)])
    bodies, touched, time = move(config, start, [(0.8, 0.2, 0.5), (-1.0, 0.0, 0.0)])
    np.testing.assert_allclose(bodies[0], [0.12, 0.03, 0.3, 0.8, 0.2, 0.5], atol=1e-12)
    np.testing.assert_allclose(bodies[1], [5.0 + 0.02 - 0.15, 1.0, 0.0, -1.0, 0.0, 0.0], atol=1e-12)
    assert touched == [False, False]
    assert time == pytest.approx(0.2)


frames = pytest.mark.parametrize(
    ("frame_skip", "timestep"), [(1, 0.1), (2, 0.05), (5, 0.02), (1, 0.02)]
)


@frames
@pytest.mark.parametrize("heading", [0.0, LEFT, 2 * LEFT, 3 * LEFT, 0.6])
def test_a_robot_stops_at_the_wall(frame_skip, timestep, heading):
    world = world_with((0.0, 0.0, heading), frame_skip=frame_skip, timestep=timestep)
    touched = []
    for _ in range(round(22.0 / world.config.dt)):
        world.step(FORWARD)
        touched.append(world.contacts[0].tolist())
    z, x, _, vz, vx, _ = world.state.bodies[0, 0]
    into_wall = max(abs(z) - 14.7, abs(x) - 2.7)
    assert -1e-3 <= into_wall <= 0.83 * timestep + 1e-3
    assert [False, True] in touched and touched[-1] == [False, True] and touched[0] == [False] * 2
    sliding = abs(math.cos(0.6)) * 0.83 if heading == 0.6 and abs(z) < 14.6 else 0.0
    assert math.hypot(vz, vx) == pytest.approx(sliding, abs=1e-6)


@frames
def test_a_person_cannot_be_walked_through(frame_skip, timestep):
    config = CorridorConfig(num_humans=1, frame_skip=frame_skip, timestep=timestep)
    start = bodies_of((0.0, 0.0), [(14.0, 0.0)])
    bodies, touched, _ = move(
        config, start, [(0.83, 0.0, 0.0), (0.0, 0.0, 0.0)], round(20.0 / config.dt)
    )
    assert touched[0]
    assert bodies[1, 0] - bodies[0, 0] >= 0.6 - 0.83 * timestep - 1e-3
    assert 14.7 - 1e-2 <= bodies[1, 0] <= 14.7 + 0.83 * timestep  # squeezed against the wall


def test_a_contact_pushes_and_momentum_is_shared():
    # The robot drives on, the person would stand: after the contact both move at m v / (m + M).
    config = CorridorConfig(num_humans=1, robot_mass=30.0, human_mass=70.0)
    bodies, touched, _ = move(
        config, bodies_of((0.0, 0.0), [(0.8, 0.0)]), [(0.5, 0, 0), (0, 0, 0)], 40
    )
    assert touched == [True, False]
    np.testing.assert_allclose(bodies[:, 3], 0.15, rtol=1e-2)
    assert bodies[1, 0] > 0.8 + 0.15


@given(
    st.floats(1.0, 500.0), st.floats(1.0, 500.0), st.floats(-3.0, 3.0), st.floats(0.0, 2 * math.pi)
)
@settings(deadline=None, max_examples=50)
def test_two_bodies_keep_their_momentum(robot_mass, human_mass, speed, angle):
    config = CorridorConfig(
        num_humans=1, robot_mass=robot_mass, human_mass=human_mass, frame_skip=4, timestep=0.02
    )
    physics = Physics(config, 1)
    ahead = np.array([math.cos(angle), math.sin(angle)])
    start = bodies_of((0.0, 0.0, 0.0, *(speed * ahead)), [tuple(0.62 * ahead)])
    masses = np.array([[robot_mass], [human_mass]])
    before = (masses * start[0, :, 3:5]).sum(axis=0)
    bodies, contacts, time = start.copy(), np.zeros((1, 2), dtype=np.bool_), np.zeros(1)
    physics.commands[0, :, :2] = start[0, :, 3:5]  # no force: whoever moves moves on
    physics.step(4, bodies, contacts, time)
    after = (masses * bodies[0, :, 3:5]).sum(axis=0)
    np.testing.assert_allclose(after, before, atol=1e-9 * max(robot_mass, human_mass))
    energy = (masses * np.square(bodies[0, :, 3:5])).sum()
    assert energy <= (masses * np.square(start[0, :, 3:5])).sum() * (1 + 1e-9)


def test_an_overlap_is_pushed_apart():
    config = CorridorConfig(num_humans=1)
    still = [(0, 0, 0), (0, 0, 0)]
    bodies, _, _ = move(config, bodies_of((0.0, 0.0), [(0.4, 0.0)]), still, 60)
    assert bodies[1, 0] - bodies[0, 0] >= 0.6 - 5e-3


def test_two_people_in_contact_are_not_the_robots_contact():
    config = CorridorConfig(num_humans=2)
    start = bodies_of((-10.0, 0.0), [(0.0, 0.0), (0.7, 0.0)])
    _, touched, _ = move(config, start, [(0, 0, 0), (1.0, 0, 0), (-1.0, 0, 0)], 10)
    assert touched == [False, False]


def test_a_person_at_a_wall_is_not_the_robots_contact():
    config = CorridorConfig(num_humans=1)
    _, touched, _ = move(config, bodies_of((0.0, 0.0), [(5.0, 2.5)]), [(0, 0, 0), (0, 1.0, 0)], 10)
    assert touched == [False, False]


@pytest.mark.parametrize("count", [1, 2, 9])
def test_contacts_are_told_apart_by_corridor(count):
    config = CorridorConfig(num_humans=1, terminate_on_collision=False, **NOBODY_PUSHES)
    world = World(config, count)
    for n in range(count):
        world.begin(n, np.random.default_rng(n))
        world.place(n, bodies_of((0.0, 0.0), [(5.0, 0.0)])[0])
    hit, wall = count - 1, count // 2
    world.place(hit, bodies_of((0.0, 0.0), [(0.55, 0.0)])[0])
    if wall != hit:
        world.place(wall, bodies_of((0.0, 2.75, LEFT), [(5.0, 0.0)])[0])
    world.step(np.tile(STAND, (count, 1)))
    assert np.flatnonzero(world.contacts[:, 0]).tolist() == [hit]
    assert np.flatnonzero(world.contacts[:, 1]).tolist() == ([wall] if wall != hit else [])


def test_corridors_do_not_touch_each_other():
    world = World(CorridorConfig(num_humans=0), 4)
    for n in range(4):
        world.begin(n, np.random.default_rng(n))
        world.place(n, bodies_of((0.0, 0.0, LEFT if n % 2 else -LEFT))[0])
    for _ in range(100):
        world.step(np.tile(FORWARD, (4, 1)))
    np.testing.assert_allclose(np.abs(world.state.bodies[:, 0, 1]), 2.7, atol=2e-3)


def test_a_row_of_numbers_gives_the_parameters_back():
    parameters = physics_parameters(CorridorConfig())
    assert physics_from(np.array(parameters)) == parameters


# --- free flight ---------------------------------------------------------------------------------


def random_bodies(rng, people, reach, top):
    """(1, 1 + H, 6) bodies and (1 + H, 3) commands; places within reach, speeds up to top."""
    bodies = np.zeros((1, 1 + people, 6))
    bodies[0, :, :2] = rng.uniform(-1.0, 1.0, (1 + people, 2)) * reach
    bodies[0, :, 2] = rng.uniform(-7.0, 7.0, 1 + people)
    bodies[0, :, 3:] = rng.uniform(-top, top, (1 + people, 3))
    return bodies, rng.uniform(-top, top, (1 + people, 3))


@given(
    st.integers(0, 2**32),
    st.integers(0, 5),
    st.integers(1, 20),
    st.floats(0.001, 0.1),
    st.floats(1.0, 500.0),
    st.floats(1.0, 500.0),
    st.floats(0.0, 3.0),
)
@settings(deadline=None, max_examples=150)
def test_free_flight_is_pymunks_step_to_the_last_bit(
    seed, people, frames, timestep, robot_mass, human_mass, top
):
    """Both routes on the same bodies, which nothing touches."""
    config = CorridorConfig(
        num_humans=people, timestep=timestep, robot_mass=robot_mass, human_mass=human_mass,
        half_length=100.0, half_width=20.0,
    )  # fmt: skip
    parameters = physics_parameters(config)
    bodies, commands = random_bodies(np.random.default_rng(seed), people, (1.0, 10.0), top)
    bodies[0, :, 0] += 30.0 * (np.arange(1 + people) - 2.0)  # two come 20 m closer at most
    assert not can_touch(bodies[0], commands, frames, parameters)

    flown, resolved, contacts = bodies[0].copy(), bodies[0].copy(), np.zeros(2, dtype=np.bool_)
    fly(flown, commands, frames, parameters)
    Physics(config, 1)._resolve(frames, resolved, commands, contacts)
    assert np.array_equal(flown, resolved)
    assert not contacts.any()
    stepped, touched, _ = move(config, bodies, commands) if frames == config.frame_skip else (
        flown, [False, False], 0
    )  # fmt: skip
    assert np.array_equal(stepped, flown) and touched == [False, False]


SMALL = {"half_length": 5.0, "start_z": 0.0, "goal_z": 1.0, "intermittent_z": 0.0}
DOOR = {"doorway_width": 1.4, "doorway_z": 1.0}


def to_doorway_wall(bodies, config):
    """Distance [m] from the bodies' centres to the surface of the wall around the doorway."""
    across = np.maximum(config.jamb - np.abs(bodies[:, 1]), 0.0)
    return np.hypot(bodies[:, 0] - config.doorway_z, across) - 0.5 * DOORWAY_WALL


def clearance(bodies, config):
    """The smallest gap [m] of one corridor's bodies to each other and to walls."""
    radii = np.full(len(bodies), config.human_radius)
    radii[0] = config.robot_radius
    places = bodies[:, :2]
    gaps = np.linalg.norm(places[:, None] - places, axis=-1) - radii - radii[:, None]
    np.fill_diagonal(gaps, np.inf)
    edges = np.array([config.half_length, config.half_width]) - np.abs(places) - radii[:, None]
    nearest = min(gaps.min(), edges.min())
    if config.doorway_width > 0.0:
        nearest = min(nearest, (to_doorway_wall(bodies, config) - radii).min())
    return nearest


@pytest.mark.parametrize("door", [{}, DOOR], ids=["plain", "doorway"])
@given(st.integers(0, 10_000), st.floats(0.0, 2.5), st.integers(0, 3), st.integers(1, 4))
@settings(deadline=None, max_examples=100)
def test_whoever_cannot_touch_does_not_touch(door, seed, top, people, frames):
    """`can_touch` may be wrong in one direction only: contacts are not read where it says no."""
    config = CorridorConfig(num_humans=people, frame_skip=frames, human_radius=0.2, **SMALL, **door)
    bodies, commands = random_bodies(np.random.default_rng(seed), people, (4.6, 2.6), top)
    if can_touch(bodies[0], commands, frames, physics_parameters(config)):
        return
    for few in range(1, frames + 1):  # at every physics step
        after, contacts = bodies[0].copy(), np.zeros(2, dtype=np.bool_)
        Physics(config, 1)._resolve(few, after, commands, contacts)
        assert clearance(after, config) > 0.0
        assert not contacts.any()


def test_who_flies_and_who_could_touch_by_hand():
    # .6 m of radii, or .3 m to a wall; a centimetre to spare; .1 m for who moves at 1 m/s for .1 s
    p = physics_parameters(CorridorConfig(num_humans=1, **SMALL, **DOOR))
    go, still = np.array([(1.0, 0, 0), STILL]), np.zeros((2, 3))

    def near(robot, person=(-3.5, 0.0), commands=still):
        return can_touch(bodies_of(robot, [person])[0], commands, 2, p)

    assert not near((-2.0, -2.0), (-1.38, -2.0)) and near((-2.0, -2.0), (-1.395, -2.0))
    assert not near((-2.0, -2.0), (-1.28, -2.0), go) and near((-2.0, -2.0), (-1.3, -2.0), go)
    assert not near((0.0, 2.68)) and near((0.0, 2.7))  # the side's wall
    assert not near((4.68, 0.0)) and near((4.7, 0.0))  # the final wall
    assert not near((0.58, 2.0)) and near((0.6, 2.0))  # the doorway's
    assert not near((1.0, 0.0)) and near((1.0, 0.4)) and near((1.0, -0.4))  # its posts


# --- nothing is remembered -----------------------------------------------------------------------


def rough_scenes(config, count, seed):
    """Bodies that touch each other and walls, some of them pressed into each other."""
    rng = np.random.default_rng(seed)
    return [
        random_bodies(rng, config.num_humans, rng.uniform(0.3, 1.0) * np.array([4.8, 2.8]), 1.5)
        for _ in range(count)
    ]


def resolved(physics, scene, frames=2, steps=3):
    """What some steps make of a scene in corridor 0, in all bits, and whether there was contact."""
    bodies, commands = scene[0].copy(), scene[1]
    contacts, time, log = np.zeros((1, 2), dtype=np.bool_), np.zeros(1), []
    for _ in range(steps):
        physics.commands[0] = commands
        physics.step(frames, bodies, contacts, time)
        log += [bodies.tobytes(), contacts.tobytes()]
    return log, contacts.any()


@pytest.mark.parametrize("door", [{}, DOOR], ids=["plain", "doorway"])
def test_a_step_does_not_depend_on_what_was_stepped_before(door):
    config = CorridorConfig(num_humans=5, **SMALL, **door)
    scenes = rough_scenes(config, 60, seed=0)
    fresh = [resolved(Physics(config, 1), scene) for scene in scenes]
    assert sum(touched for _, touched in fresh) >= 10
    used = Physics(config, 1)
    for scene in rough_scenes(config, 1000, seed=1):
        resolved(used, scene)
    for order in (range(60), reversed(range(60))):
        for n in order:
            assert resolved(used, scenes[n]) == fresh[n]


@pytest.mark.parametrize("door", [{}, DOOR], ids=["plain", "doorway"])
def test_a_corridor_moves_alike_alone_and_among_fifty(door):
    config = CorridorConfig(num_humans=4, **SMALL, **door)
    scenes = rough_scenes(config, 50, seed=2)
    many, time = np.concatenate([bodies for bodies, _ in scenes]), np.zeros(50)
    physics, contacts = Physics(config, 50), np.zeros((50, 2), dtype=np.bool_)
    alone = [bodies.copy() for bodies, _ in scenes]
    for _ in range(10):
        physics.commands[...] = [commands for _, commands in scenes]
        physics.step(2, many, contacts, time)
        for n, (_, commands) in enumerate(scenes):
            alone[n], touched, _ = move(config, alone[n], commands)
            alone[n] = alone[n][None]
            assert many[n].tobytes() == alone[n].tobytes()
            assert contacts[n].tolist() == touched
    assert time == pytest.approx(1.0)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda v: pickle.loads(pickle.dumps(v))])
def test_a_copy_moves_alike(copied):
    config = CorridorConfig(num_humans=5, **SMALL, **DOOR)
    physics = Physics(config, 1)
    for scene in rough_scenes(config, 30, seed=3):
        assert resolved(copied(physics), scene) == resolved(physics, scene)
    assert copied(Physics(config, 7)).commands.shape == (7, 6, 3)


# --- the doorway ---------------------------------------------------------------------------------


@given(
    st.integers(0, 2**32),
    st.sampled_from([(1, 0.1), (2, 0.05), (4, 0.025), (1, 0.02)]),
    st.sampled_from([-1.0, 1.0]),
    st.booleans(),
)
@example(34721, (2, 0.05), -1.0, False)  # bodies that begin in each other burst 15.6 cm into it
@settings(deadline=None, max_examples=80)
def test_nobody_gets_through_the_doorways_wall(seed, frames, side, apart):
    """Four bodies press against it and onto each other at top speed; some slide to the opening.

    Nobody gets through even from places that no env begins with, within each other.
    """
    rng = np.random.default_rng(seed)
    frame_skip, timestep = frames
    config = CorridorConfig(
        num_humans=3, frame_skip=frame_skip, timestep=timestep, doorway_width=1.2, doorway_z=1.0,
        robot_speed=2.0,
    )  # fmt: skip
    start, commands = random_bodies(rng, 3, (0.0, 0.0), 0.0)
    nearest = 0.0
    while nearest == 0.0 or (apart and nearest < 0.6):  # two radii
        away = rng.uniform(0.5, 2.0, 4)
        start[0, :, 0] = config.doorway_z + side * away
        start[0, :, 1] = rng.choice([-1.0, 1.0]) * rng.uniform(1.0, 2.5, 4)
        between = np.linalg.norm(start[0, :, None, :2] - start[0, None, :, :2], axis=-1)
        nearest = between[np.triu_indices(4, 1)].min()
    commands[:, 0] = -side * np.where(np.arange(4) == 0, 2.0, config.human_top_speed)
    bodies = start
    for _ in range(round(4.0 / config.dt)):
        before, (after, _, _) = bodies[0], move(config, bodies, commands)
        bodies = after[None]
        gaps = to_doorway_wall(after, config) - 0.3
        assert not apart or gaps.min() > -2.0 * timestep - 0.05  # no deeper than one physics step
        through = (before[:, 0] - config.doorway_z) * (after[:, 0] - config.doorway_z) < 0.0
        assert (np.abs(after[through, 1]) < 0.6).all()


@frames
@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("width", [1.2, 1.4, 1.8])
def test_the_robot_gets_through_the_opening(frame_skip, timestep, side, width):
    world = world_with(
        (2.0 + side * 3.0, 0.0, LEFT + side * LEFT), doorway_width=width,
        frame_skip=frame_skip, timestep=timestep,
    )  # fmt: skip
    for _ in range(round(7.0 / world.config.dt)):
        world.step(FORWARD)
        assert not world.contacts.any()
    assert side * (world.state.bodies[0, 0, 0] - 2.0) < -2.5


@frames
def test_a_robot_that_drives_against_the_doorways_wall_stops_and_is_told(frame_skip, timestep):
    world = world_with(
        (0.0, 2.0), doorway_width=1.8, frame_skip=frame_skip, timestep=timestep,
        terminate_on_collision=True,
    )  # fmt: skip
    touched = []
    for _ in range(round(4.0 / world.config.dt)):
        world.step(FORWARD)
        touched.append(world.contacts[0].tolist())
    assert touched[0] == [False, False] and touched[-1] == [False, True]
    assert 1.6 - 1e-3 <= world.state.bodies[0, 0, 0] <= 1.6 + 0.83 * timestep + 1e-3
    assert world.state.tallies[0].any() and world.metrics[0, 2] == 1.0  # one collision


def test_a_doorpost_turns_the_robot_aside():
    """Its end is round: who hits it off its middle slides past into the opening."""
    config = CorridorConfig(num_humans=0, doorway_width=1.8, doorway_z=2.0)
    start = bodies_of((0.0, 0.7))
    after, touched, _ = move(config, start, [(0.8, 0.0, 0.0)], 60)
    assert touched == [False, True]
    assert after[0, 0] > 2.5 and after[0, 1] < 0.65


# --- how fine a step is fine enough --------------------------------------------------------------


def both_steps(scenario, count):
    """The same episodes at the default physics step and at half of it."""
    worlds = []
    for timestep, frame_skip in ((0.05, 2), (0.025, 4)):
        settings_ = {"timestep": timestep, "frame_skip": frame_skip}
        world = World(CorridorConfig.from_keywords(scenario, **settings_), count)
        for n in range(count):
            world.begin(n, np.random.default_rng(n))
        worlds.append(world)
    return worlds


def smooth_actions(rng, last, robots):
    """Random, smooth, and turned towards the middle of the corridor, so that nothing is hit."""
    last[...] = np.clip(0.95 * last + 0.25 * rng.normal(size=last.shape), -1.0, 1.0)
    steer = 0.6 * last[:, 1] - 1.5 * robots[:, 2] - 0.5 * robots[:, 1]
    return np.stack([last[:, 0], np.clip(steer, -1.0, 1.0)], axis=1)


def gaps_between(worlds):
    """(N, 1 + H) how far apart the same body is in both worlds."""
    places = [world.state.bodies[..., :2] for world in worlds]
    return np.linalg.norm(places[0] - places[1], axis=-1)


def test_at_half_the_physics_step_the_robot_takes_the_same_way():
    """Bodies move on for one physics step before they take up a command.

    At half the step that is half the time, which shifts a robot by 25 ms times the speed gained
    since the start: .025 s * .83 m/s = 2.1 cm at most, at any time. Headings are the same.
    """
    worlds, rng = both_steps("paper", 50), np.random.default_rng(1)
    last, free, largest = np.zeros((50, 2)), np.ones(50, dtype=np.bool_), 0.0
    for _ in range(600):
        actions = smooth_actions(rng, last, worlds[0].state.bodies[:, 0])
        for world in worlds:
            world.act(actions)
            free &= ~world.contacts.any(axis=1)
        gaps = gaps_between(worlds)[free, 0]
        speeds = np.linalg.norm(worlds[0].state.bodies[free, 0, 3:5], axis=1)
        np.testing.assert_allclose(gaps, 0.025 * speeds, atol=1e-9)  # they set out at rest
        headings = [world.state.bodies[free, 0, 2] for world in worlds]
        np.testing.assert_allclose(*headings, atol=1e-9)
        largest = max(largest, gaps.max())
    assert free.mean() > 0.9
    assert 0.01 < largest <= 0.025 * 0.83 + 1e-9


@pytest.mark.parametrize("scenario", ["paper", "crowded", "doorway"])
def test_at_half_the_physics_step_people_take_nearly_the_same_way(scenario):
    """From the same state, a second later.

    People answer to where they are, and a waypoint reached one env step sooner is left .1 s
    sooner, which makes .1 s * 2 * 1 m/s = .2 m; nearly all are within 25 ms times the speeds that
    change, some centimetres. Over a whole episode this grows, as with any crowd, and ways part.
    """
    worlds, rng = both_steps(scenario, 20), np.random.default_rng(1)
    last, gaps = np.zeros((20, 2)), []
    for step in range(200):
        if step % 10 == 0:
            worlds[1].state.assign(worlds[0].state)
        actions = smooth_actions(rng, last, worlds[0].state.bodies[:, 0])
        for world in worlds:
            world.act(actions)
        gaps.append(gaps_between(worlds)[:, 1:])
    assert np.quantile(gaps, 0.99) < 0.06
    assert np.max(gaps) < 0.25


@pytest.mark.parametrize("scenario", ["paper", "doorway"])
def test_at_half_the_physics_step_people_walk_as_fast_and_get_as_far(scenario):
    """Over a whole episode it is the crowd that is compared."""
    speeds, turns = [], []
    for world in both_steps(scenario, 20):
        world.state.bodies[:, 0, :2] = (-14.5, 2.5)
        walked = 0.0
        for _ in range(600):
            world.act(np.tile(STAND, (20, 1)))
            walked += np.linalg.norm(world.state.bodies[:, 1:, 3:5], axis=-1).mean()
        speeds.append(walked / 600)
        turns.append(world.state.waypoint.mean())
    assert speeds[1] == pytest.approx(speeds[0], rel=0.02)
    assert turns[1] == pytest.approx(turns[0], rel=0.06)


# --- pymunk set up once --------------------------------------------------------------------------


def test_transfer_copies_what_pymunk_tells_body_by_body():
    space = pymunk.Space()
    space.add(pymunk.Segment(space.static_body, (0, 0), (1, 0), 0.1))  # then the static body counts
    rng = np.random.default_rng(0)
    for _ in range(5):
        body = pymunk.Body(2.0, math.inf)
        body.position, body.velocity = tuple(rng.normal(size=2)), tuple(rng.normal(size=2))
        body.angle, body.angular_velocity = rng.normal(size=2)
        space.add(body, pymunk.Circle(body, 0.1))
    fields = batch.BodyFields.POSITION | batch.BodyFields.ANGLE | batch.BodyFields.VELOCITY
    values = np.zeros((7, 5))
    Transfer(space, fields, values).read()
    told = [(*body.position, body.angle, *body.velocity) for body in space.bodies]
    assert np.array_equal(values[:5], told)

    drive = np.zeros((7, 3))
    drive[:5] = rng.normal(size=(5, 3))
    Transfer(space, batch.BodyFields.ANGULAR_VELOCITY | batch.BodyFields.FORCE, drive).write()
    told = [(body.angular_velocity, *body.force) for body in space.bodies]
    assert np.array_equal(drive[:5], told)
    before = [body.position for body in space.bodies]
    stepper(space)(0.5)
    for body, (z, x), (vz, vx) in zip(space.bodies, before, values[:5, 3:], strict=True):
        assert body.position == pytest.approx((z + 0.5 * vz, x + 0.5 * vx))


def test_an_array_that_is_too_short_is_an_error():
    space = pymunk.Space()
    space.add(pymunk.Body(1.0, 1.0))
    with pytest.raises(ValueError, match="expected 3 rows, got 2"):
        Transfer(space, batch.BodyFields.POSITION, np.zeros((2, 2)))


COLLECT_WHILE_A_SPACE_IS_FREED = """
import gc, sys
from socialnav_env.config import CorridorConfig
from socialnav_env.physics import Physics

for moment in range(0, 200, 10):
    physics, calls = Physics(CorridorConfig(num_humans=3), 1), []
    gc.collect()
    def collect(*_):
        calls.append(None)
        if len(calls) == moment + 1:
            gc.collect()
    sys.setprofile(collect)
    del physics
    sys.setprofile(None)
    assert len(calls) > 50, "nothing was freed"
"""


def test_the_garbage_collector_may_come_at_any_moment():
    """A Space outlives nobody: bodies freed while pymunk takes it apart would end the process."""
    subprocess.run([sys.executable, "-c", COLLECT_WHILE_A_SPACE_IS_FREED], check=True)


def test_many_worlds_come_and_go():
    """Buffers are shared with a C library: wrong sizes would show up as a crash or as garbage."""
    rng = np.random.default_rng(0)
    kept = []
    for round_ in range(60):
        count = int(rng.integers(1, 40))
        world = World(CorridorConfig(num_humans=int(rng.integers(0, 6))), count)
        for n in range(count):
            world.begin(n, rng)
        for _ in range(5):
            seen = world.step(rng.uniform(-1, 1, (count, 2)))
            assert np.isfinite(seen).all()
        if round_ % 10 == 0:
            kept.append((world, world.state.copy()))
        del world
        if round_ % 5 == 0:
            gc.collect()
    for world, state in kept:
        np.testing.assert_array_equal(world.state.bodies, state.bodies)
