import gc
import math

import numpy as np
import pymunk
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymunk import batch
from scenes import FORWARD, STAND, bodies_of, world_with

from socialnav_env.chipmunk import Transfer, stepper
from socialnav_env.config import CorridorConfig
from socialnav_env.physics import Physics, can_touch
from socialnav_env.world import World

LEFT = math.pi / 2
NOBODY_PUSHES = {"human_force": 0.0, "wall_force": 0.0}
"""People who do not evade, so that contacts happen."""


def move(config, start, commands, steps=1):
    """Bodies and contacts after some steps of the bare physics at constant commands."""
    physics, bodies = Physics(config, 1), start.copy()
    physics.place(0, bodies[0])
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
    physics.place(0, bodies[0])
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


@given(st.integers(0, 10_000), st.floats(0.0, 5.0))
@settings(deadline=None, max_examples=60)
def test_whoever_cannot_touch_does_not_touch(seed, top):
    """`can_touch` may be wrong in one direction only: contacts are not read where it says no."""
    rng = np.random.default_rng(seed)
    config = CorridorConfig(
        num_humans=3, half_length=5.0, start_z=0.0, goal_z=1.0, intermittent_z=0.0
    )
    start = bodies_of((0, 0), [(0, 0)] * 3)
    start[0, :, :2] = rng.uniform(-1, 1, (4, 2)) * (4.6, 2.6)
    start[0, :, 3:5] = rng.uniform(-top, top, (4, 2))
    commands = np.zeros((1, 4, 3))
    commands[0, :, :2] = rng.uniform(-top, top, (4, 2))
    radii, edges = np.full(4, 0.3), np.array([5.0, 3.0])
    if can_touch(start, commands, radii, edges, config.dt):
        return
    bodies = move(config, start, commands[0])[0]
    gaps = np.linalg.norm(bodies[:, None, :2] - bodies[None, :, :2], axis=-1) + 9 * np.eye(4)
    assert gaps.min() > 0.6
    assert (np.abs(bodies[:, :2]) < (4.7, 2.7)).all()


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
        gc.collect()
    for world, state in kept:
        np.testing.assert_array_equal(world.state.bodies, state.bodies)
