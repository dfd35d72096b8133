import copy
import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scenes import STAND, bodies_of, world_with

from socialnav_env.config import CorridorConfig
from socialnav_env.observation import (
    HEAD,
    NUM_RAYS,
    PER_HUMAN,
    add_noise,
    observation_bounds,
    observation_parameters,
    observe,
    people_entries,
    ray_entries,
    ray_length,
    sight_from,
)
from socialnav_env.world import World

CONFIG = CorridorConfig(
    half_length=15.0, half_width=3.0, human_radius=0.3, ray_range=6.0,
    robot_speed=0.83, robot_turn_rate=1.0, human_speed=1.0, human_speed_std=0.15,
)  # fmt: skip
P = observation_parameters(CONFIG)
GOALS = ((-2.5, 1.0), (12.0, -1.0))
MODES = ("both", "state", "rays")
compiled = settings(deadline=None)


def look(bodies, goals=GOALS, flags=(False, False), **keywords):
    config = CorridorConfig(num_humans=bodies.shape[1] - 1, ray_range=6.0, **keywords)
    low, high = observation_bounds(config)
    out, row = np.full((1, len(low)), np.nan), np.array(observation_parameters(config))
    observe(bodies, np.array([goals]), np.array([flags]), low, high, row, out)
    return out[0]


def test_a_row_of_numbers_gives_the_parameters_back():
    assert sight_from(np.array(P)) == P


@pytest.mark.parametrize("people", [0, 1, 4, 12])
@pytest.mark.parametrize(
    ("mode", "each", "rest"), [("both", 4, 24), ("state", 4, 15), ("rays", 0, 24)]
)
def test_the_size_follows_from_mode_and_number_of_people(mode, each, rest, people):
    config = CorridorConfig(num_humans=people, observation=mode)
    low, high = observation_bounds(config)
    assert len(low) == len(high) == rest + each * people == ray_entries(config).stop
    assert people_entries(config) == slice(15, 15 + each * people)
    assert (low < high).all()


def test_bounds_by_hand():
    low, high = observation_bounds(CorridorConfig(num_humans=1, human_speed=1.0, robot_speed=0.8))
    speed, diagonal = 0.8 + 1.3 * 1.3, 2.0 * math.hypot(15.0, 3.0)
    goal, person = [diagonal, 1.0, 1.0, 1.0], [diagonal, diagonal, 2 * speed, 2 * speed]
    np.testing.assert_allclose(
        high, [3.0, 15.0, 1.0, 1.0, speed, speed, 1.0, *goal, *goal, *person, *[6.0] * 9]
    )
    assert not low[[7, 10, 11, 14, *range(19, 28)]].any()  # distances, flags, ranges
    signed = [*range(7), 8, 9, 12, 13, *range(15, 19)]
    np.testing.assert_array_equal(low[signed], -high[signed])


@compiled
@given(st.integers(0, 2**32), st.integers(0, 5))
def test_state_and_rays_are_parts_of_both(seed, people):
    rng = np.random.default_rng(seed)
    rows = rng.uniform(-1.0, 1.0, (1 + people, 6)) * (14.0, 2.5, 3.0, 1.0, 1.0, 1.0)
    both, state, rays = (look(bodies_of(rows[0], rows[1:]), observation=mode) for mode in MODES)
    np.testing.assert_array_equal(np.concatenate([state, rays[HEAD:]]), both)
    np.testing.assert_array_equal(rays[:HEAD], both[:HEAD])


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


@compiled
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


@compiled
@given(
    st.lists(st.tuples(*[numbers] * 6), min_size=1, max_size=4),
    st.sampled_from(MODES),
    st.sampled_from([0.0, 1.8]),
)
def test_whatever_happens_the_observation_lies_in_its_box(rows, mode, doorway):
    seen = look(bodies_of(rows[0], rows[1:]), observation=mode, doorway_width=doorway)
    low, high = observation_bounds(CorridorConfig(num_humans=len(rows) - 1, observation=mode))
    assert (low <= seen).all() and (seen <= high).all()


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("scenario", ["paper", "crowded", "doorway"])
def test_in_an_episode_nothing_is_cut_off(mode, scenario):
    """The bounds are wide enough: without people who push, clipping changes nothing."""
    config = CorridorConfig.from_keywords(scenario, observation=mode)
    world, rng = World(config, 8), np.random.default_rng(0)
    for n in range(8):
        world.begin(n, rng)
    free = np.ones(8, dtype=np.bool_)
    for _ in range(200):
        world.step(rng.uniform(-1, 1, (8, 2)))
        free &= ~world.contacts.any(axis=1)
        state, wide = world.state, np.full(len(world.low), 1e9)
        out = np.empty((8, len(world.low)))
        row = np.array(observation_parameters(config))
        observe(state.bodies, state.goals, state.flags, -wide, wide, row, out)
        np.testing.assert_array_equal(out[free], world.observe()[free])
    assert free.any()


@compiled
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


# --- the doorway ---------------------------------------------------------------------------------

DOOR = {"doorway_width": 1.8, "doorway_z": 2.0}


def test_nine_rays_before_a_doorway_by_hand():
    # 3 m before the faces at z = 1.9 of a wall whose doorposts' round ends have the middles |x| = 1
    rays = look(bodies_of((-1.1, 0.5)), half_width=5.0, **DOOR)[-NUM_RAYS:]
    angles = np.radians([-90, -67.5, -45, -22.5, 0, 22.5, 45, 67.5, 90])
    assert rays[4] == 6.0  # through the opening
    np.testing.assert_allclose(rays[[2, 6]], 3.0 / np.cos(angles[[2, 6]]))
    np.testing.assert_allclose(rays[5], 3.0 / np.cos(angles[5]))  # at x = 1.74
    np.testing.assert_allclose(rays[[1, 7]], [5.5 / np.sin(-angles[1]), 4.5 / np.sin(angles[7])])
    np.testing.assert_allclose(rays[[0, 8]], [5.5, 4.5])
    # at 22.5 degrees to the right the ray crosses z = 2 at x = .5 - 3.1 tan = -.784
    assert rays[3] == 6.0


def test_rays_at_a_doorpost_by_hand():
    inside = look(bodies_of((2.0, 0.0)), **DOOR)[-NUM_RAYS:]
    np.testing.assert_allclose(inside[[0, 8]], 0.9)
    assert inside[4] == 6.0
    # straight at the round end, .06 m beside its middle: half a chord is .08 m
    beside = look(bodies_of((0.0, 0.94)), **DOOR)[-NUM_RAYS:]
    assert beside[4] == pytest.approx(2.0 - 0.08)
    for x in (-2.0, -1.01, 1.01, 1.2, 2.0):
        assert look(bodies_of((0.0, x)), **DOOR)[HEAD + 4] == pytest.approx(1.9)
    assert look(bodies_of((4.0, 2.0, math.pi)), **DOOR)[HEAD + 4] == pytest.approx(1.9)


def to_wall(z, x):
    """Distance to the surface of the wall around the doorway."""
    return np.hypot(z - 2.0, np.maximum(1.0 - np.abs(x), 0.0)) - 0.1


@compiled
@given(st.floats(-3.0, 7.0), st.floats(-2.9, 2.9), st.floats(-4.0, 4.0))
def test_the_tip_of_a_ray_lies_on_what_it_met_around_a_doorway(z, x, angle):
    assume(to_wall(z, x) > 1e-6)
    p = observation_parameters(CorridorConfig(num_humans=0, ray_range=6.0, **DOOR))
    cos, sin = math.cos(angle), math.sin(angle)
    length = ray_length(bodies_of((z, x))[0], cos, sin, p)
    on_edge = min(abs(abs(z + length * cos) - 15.0), abs(abs(x + length * sin) - 3.0)) < 1e-9
    on_wall = abs(to_wall(z + length * cos, x + length * sin)) < 1e-6
    assert on_edge or on_wall or length == 6.0
    way = np.linspace(0.0, length, 500)
    assert (to_wall(z + way * cos, x + way * sin) >= -1e-6).all()  # nothing before


def test_a_person_in_the_doorway_hides_what_is_behind():
    seen = look(bodies_of((0.0, 0.0), [(2.0, 0.0)]), **DOOR)
    assert seen[HEAD + PER_HUMAN + 4] == pytest.approx(1.7)
    hidden = look(bodies_of((0.0, 2.0), [(4.0, 2.0)]), **DOOR)
    assert hidden[HEAD + PER_HUMAN + 4] == pytest.approx(1.9)


# --- sensor noise --------------------------------------------------------------------------------


def noisy(config, count, seed=0):
    """(count, n) what noise adds to an observation in the middle of its bounds, and the rest."""
    low, high = observation_bounds(config)
    middle, rng = 0.5 * (low + high), np.random.default_rng(seed)
    rows = np.tile(middle, (count, 1))
    for row in rows:
        add_noise(row, config, low, high, rng)
    return rows - middle, rng


@pytest.mark.parametrize("mode", MODES)
def test_noise_has_the_standard_deviation_that_was_asked_for(mode):
    config = CorridorConfig(observation=mode, ray_noise=0.2, tracking_noise=0.5)
    added, _ = noisy(config, 3000)
    people, rays = people_entries(config), ray_entries(config)
    assert not added[:, :HEAD].any()  # the robot knows itself and its goals
    for entries, deviation in ((people, 0.5), (rays, 0.2)):
        part = added[:, entries]
        if part.size:
            np.testing.assert_allclose(part.std(axis=0), deviation, rtol=0.06)
            np.testing.assert_allclose(part.mean(axis=0), 0.0, atol=0.08 * deviation)
            # no two entries share theirs
            assert np.abs(np.corrcoef(part.T) - np.eye(part.shape[1])).max() < 0.1


@pytest.mark.parametrize(("ray_noise", "tracking_noise"), [(0.3, 0.0), (0.0, 0.3)])
def test_each_sensor_has_its_own_noise(ray_noise, tracking_noise):
    config = CorridorConfig(ray_noise=ray_noise, tracking_noise=tracking_noise)
    added, _ = noisy(config, 50)
    assert added[:, people_entries(config)].any() == (tracking_noise > 0.0)
    assert added[:, ray_entries(config)].any() == (ray_noise > 0.0)


@compiled
@given(st.sampled_from(MODES), st.floats(0.0, 5.0), st.floats(0.0, 5.0), st.integers(0, 2**32))
def test_noise_stays_within_the_box(mode, ray_noise, tracking_noise, seed):
    config = CorridorConfig(observation=mode, ray_noise=ray_noise, tracking_noise=tracking_noise)
    low, high = observation_bounds(config)
    rng = np.random.default_rng(seed)
    row = rng.uniform(low, high)
    add_noise(row, config, low, high, rng)
    assert (low <= row).all() and (row <= high).all()


@pytest.mark.parametrize("mode", MODES)
def test_no_noise_changes_and_draws_nothing(mode):
    added, rng = noisy(CorridorConfig(observation=mode), 3)
    assert not added.any()
    assert rng.bit_generator.state == np.random.default_rng(0).bit_generator.state


@pytest.mark.parametrize(
    ("mode", "noise"), [("rays", {"tracking_noise": 0.5}), ("state", {"ray_noise": 0.5})]
)
def test_a_sensor_that_is_not_there_draws_nothing(mode, noise):
    added, rng = noisy(CorridorConfig(observation=mode, **noise), 3)
    assert not added.any()
    assert rng.bit_generator.state == np.random.default_rng(0).bit_generator.state


def test_noise_comes_from_the_episodes_own_generator_and_moves_nobody():
    config = CorridorConfig(ray_noise=0.2, tracking_noise=0.2)
    exact, world = World(CorridorConfig(), 3), World(config, 3)
    rngs = [np.random.default_rng(n) for n in range(3)]
    for n in range(3):
        exact.begin(n, np.random.default_rng(n))
        world.begin(n, rngs[n])
    sources = copy.deepcopy(world.noises)
    drawn = [rng.bit_generator.state for rng in rngs]
    truth, seen = exact.step(np.tile(STAND, (3, 1))), world.step(np.tile(STAND, (3, 1)))
    np.testing.assert_array_equal(exact.state.bodies, world.state.bodies)
    for source, row in zip(sources, truth, strict=True):
        add_noise(row, config, world.low, world.high, source)
    np.testing.assert_array_equal(truth, seen)
    assert [rng.bit_generator.state for rng in rngs] == drawn


def test_starts_depend_neither_on_noise_nor_on_how_long_an_episode_was():
    exact, noisy = World(CorridorConfig(), 1), World(CorridorConfig(ray_noise=0.2), 1)
    starts = []
    for world, steps in ((exact, 3), (noisy, 5), (noisy, 11)):
        rng = np.random.default_rng(0)
        for _ in range(3):
            world.begin(0, rng)
            for _ in range(steps):
                world.step(STAND)
        starts.append(world.state.goals.tolist())
    assert starts[0] == starts[1] == starts[2]


def test_only_the_chosen_look():
    world = World(CorridorConfig(ray_noise=0.2), 4)
    rngs = [np.random.default_rng(n) for n in range(4)]
    for n, rng in enumerate(rngs):
        world.begin(n, rng)
    before = [rng.bit_generator.state for rng in world.noises]
    seen = world.observe(np.array([2, 0]))
    assert [r.bit_generator.state == b for r, b in zip(world.noises, before, strict=True)] == (
        [False, True, False, True]
    )
    for rng, state in zip(world.noises, before, strict=True):
        rng.bit_generator.state = state
    np.testing.assert_array_equal(world.observe()[[2, 0]], seen)
    assert world.observe(np.array([], dtype=np.int64)).shape == (0, len(world.low))


def test_every_look_is_another_one_with_noise_only():
    exact = world_with((0.0, 0.0))
    np.testing.assert_array_equal(exact.observe(), exact.observe())
    world = world_with((0.0, 0.0), ray_noise=0.1)
    assert (world.observe() != world.observe()).any()
