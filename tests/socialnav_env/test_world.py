import copy
import dataclasses
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import FORWARD, STAND, bodies_of, world_with

from socialnav_env.config import SCENARIOS, CorridorConfig
from socialnav_env.metrics import METRICS, NO_ONE
from socialnav_env.people import people_parameters
from socialnav_env.reward import TERMS
from socialnav_env.state import State
from socialnav_env.variation import variation_from
from socialnav_env.world import World

ROUGH = {
    "half_length": 6.0,
    "start_z": -4.0,
    "intermittent_z": 0.0,
    "goal_z": 4.0,
    "doorway_z": 1.0,
}
"""A short corridor: people, walls and goals are met soon."""
SETTINGS = [
    *({"scenario": name} for name in SCENARIOS),
    {"walking": "group", "num_humans": 5, "ray_noise": 0.2},
    {"walking": "queue", "num_humans": 4, "human_patience": 2.0, "observation": "rays"},
    {"action": "holonomic", "tracking_noise": 0.2, "observation": "state"},
    {"reactive": False, "robot_visible": False},
]
by_settings = pytest.mark.parametrize("keywords", SETTINGS, ids=str)


def begun(count, seed=0, **keywords):
    world = World(CorridorConfig.from_keywords(**keywords), count)
    for n in range(count):
        world.begin(n, np.random.default_rng([seed, n]))
    return world


def actions_for(world, rng):
    actions = rng.uniform(-1.0, 1.0, world.state.control.shape)
    actions[:, 0] = np.minimum(actions[:, 0] + 0.7, 1.0)
    return actions


def told(world, observations):
    """All that a step tells, in all bits."""
    arrays = [getattr(world.state, item.name) for item in dataclasses.fields(State)]
    arrays += [world.terms, world.metrics, world.contacts, world.collided, world.ended]
    return [array.tobytes() for array in (observations, world.forces, *arrays)]


# --- an episode ----------------------------------------------------------------------------------


@by_settings
def test_everything_stays_finite_and_in_its_place(keywords):
    world, rng = begun(6, **ROUGH, **keywords), np.random.default_rng(0)
    for _ in range(150):
        seen = world.step(actions_for(world, rng))
        assert ((world.low <= seen) & (seen <= world.high)).all()
        assert np.isfinite(world.terms).all() and np.isfinite(world.metrics).all()
        assert (np.abs(world.state.bodies[..., :2]) <= (6.0, 3.0)).all()
        assert (np.abs(world.state.control) <= 1.0).all()
    np.testing.assert_allclose(world.state.time, 15.0)


@by_settings
def test_equal_generators_give_equal_episodes(keywords):
    mine, yours = begun(3, **ROUGH, **keywords), begun(3, **ROUGH, **keywords)
    rng, twin = np.random.default_rng(0), np.random.default_rng(0)
    for _ in range(40):
        assert told(mine, mine.step(actions_for(mine, rng))) == (
            told(yours, yours.step(actions_for(yours, twin)))
        )


@by_settings
def test_a_corridor_is_the_same_alone_and_among_others(keywords):
    many, rng = begun(4, **ROUGH, **keywords), np.random.default_rng(0)
    alone = World(many.config, 1)
    alone.begin(0, np.random.default_rng([0, 2]))
    for _ in range(80):
        actions = actions_for(many, rng)
        seen, mine = many.step(actions), alone.step(actions[2:3])
        assert seen[2].tobytes() == mine[0].tobytes()
        for item in dataclasses.fields(State):
            theirs, ours = getattr(many.state, item.name), getattr(alone.state, item.name)
            assert theirs[2].tobytes() == ours[0].tobytes(), item.name
        assert many.terms[2].tobytes() == alone.terms[0].tobytes()
        assert many.metrics[2].tobytes() == alone.metrics[0].tobytes()


def test_to_act_is_to_step_without_looking():
    mine, yours = begun(2, ray_noise=0.1), begun(2, ray_noise=0.1)
    before = mine.generators[0].bit_generator.state
    mine.act(np.tile(FORWARD, (2, 1)))
    assert mine.generators[0].bit_generator.state == before
    seen = yours.step(np.tile(FORWARD, (2, 1)))
    np.testing.assert_array_equal(mine.observe(), seen)
    assert told(mine, seen) == told(yours, seen)


def test_the_beginning_of_an_episode_forgets_the_last_one():
    world = begun(2, **ROUGH)
    for _ in range(60):
        world.step(np.tile(FORWARD, (2, 1)))
    other = told(world, world.state.bodies[1])
    assert world.metrics[:, list(METRICS).index("path_length")].all()
    before = world.state.copy()
    world.begin(0, np.random.default_rng([7, 0]))
    fresh = begun(1, seed=7, **ROUGH)
    for item in dataclasses.fields(State):
        now, then = getattr(world.state, item.name), getattr(before, item.name)
        assert np.array_equal(now[0], getattr(fresh.state, item.name)[0]), item.name
        assert np.array_equal(now[1], then[1])
    assert np.array_equal(world.metrics[0], fresh.metrics[0])
    assert not (world.terms[0].any() or world.forces[0].any() or world.contacts[0].any())
    assert not (world.collided[0] or world.ended[0])
    assert told(world, world.state.bodies[1])[0] == other[0]


@pytest.mark.parametrize("doorway", [0.0, 1.8])
def test_an_episode_begins_with_the_whole_way_ahead(doorway):
    world = begun(5, doorway_width=doorway)
    metrics = dict(zip(METRICS, world.metrics.T, strict=True))
    assert (metrics["min_human_distance"] == NO_ONE).all() and not metrics["path_length"].any()
    places = np.concatenate([world.state.bodies[:, :1, :2], world.state.goals], axis=1)
    legs = np.linalg.norm(np.diff(places, axis=1), axis=-1).sum(axis=1)
    assert (world.state.remaining >= legs - 1e-9).all()
    if not doorway:
        np.testing.assert_allclose(world.state.remaining, legs)


# --- domain randomisation ------------------------------------------------------------------------


def test_an_episode_has_the_settings_that_were_drawn():
    config = CorridorConfig(num_humans=4, human_speed=2.0)
    options = {"human_speed": (0.5, 1.5), "relaxation_time": (0.2, 1.0), "reactive": [True, False]}
    world, variation = World(config, 30), variation_from(options, config)
    for n in range(30):
        world.begin(n, np.random.default_rng(n), variation)
        drawn = variation.draw(config, np.random.default_rng(n))
        np.testing.assert_array_equal(world.state.people_parameters[n], people_parameters(drawn))
        assert (np.abs(world.state.speeds[n] - drawn.human_speed) <= 0.3 + 1e-9).all()
    assert len(np.unique(world.state.people_parameters, axis=0)) == 30
    world.begin(0, np.random.default_rng(0))  # back to the config
    np.testing.assert_array_equal(world.state.people_parameters[0], people_parameters(config))


def test_standing_and_walking_people_can_take_turns():
    config = CorridorConfig(num_humans=4)
    variation = variation_from({"walking": ["cross", "group", "queue"]}, config)
    world, waits = World(config, 1), set()
    for seed in range(20):
        world.begin(0, np.random.default_rng(seed), variation)
        waits.add(bool(world.state.waits.all()))
        for _ in range(5):
            world.step(STAND)
    assert waits == {True, False}


# --- states --------------------------------------------------------------------------------------


@given(
    st.sampled_from(SETTINGS), st.integers(0, 2**32), st.integers(0, 60),
    st.sampled_from(["deepcopy", "pickle", "restore"]),
)  # fmt: skip
@settings(deadline=None, max_examples=40)
def test_a_copy_goes_on_to_the_last_bit(keywords, seed, steps, how):
    world, rng = begun(3, seed, **ROUGH, **keywords), np.random.default_rng(seed)
    for _ in range(steps):
        world.step(actions_for(world, rng))
    if how == "deepcopy":
        twin = copy.deepcopy(world)
    elif how == "pickle":
        twin = pickle.loads(pickle.dumps(world))
    else:
        twin = begun(3, seed + 1, **ROUGH, **keywords)
        twin.step(actions_for(world, np.random.default_rng(0)))
        twin.restore(world.state.copy())
        twin.noises[:] = copy.deepcopy(world.noises)
        assert np.array_equal(twin.metrics, world.metrics)
    for _ in range(20):
        actions = actions_for(world, rng)
        assert told(world, world.step(actions)) == told(twin, twin.step(actions))


def test_a_copy_is_independent():
    world = begun(2)
    twin, state = copy.deepcopy(world), world.state.copy()
    before = [getattr(state, item.name).copy() for item in dataclasses.fields(State)]
    rngs = [rng.bit_generator.state for rng in twin.generators]
    for _ in range(5):
        world.step(np.tile(FORWARD, (2, 1)))
    for copied in (state, twin.state):
        for item, array in zip(dataclasses.fields(State), before, strict=True):
            assert np.array_equal(getattr(copied, item.name), array)
    assert [rng.bit_generator.state for rng in twin.generators] == rngs


@pytest.mark.parametrize(("count", "people"), [(3, 3), (2, 4)])
def test_a_state_of_another_size_is_refused_and_nothing_changes(count, people):
    world = begun(2)
    before = told(world, world.observe())
    with pytest.raises(ValueError, match="expected shape"):
        world.restore(begun(count, num_humans=people).state)
    assert told(world, world.observe()) == before


def test_placing_bodies_is_no_progress_and_no_path():
    world = begun(1)
    world.step(FORWARD)
    bodies = bodies_of((3.0, 1.0, 0.3, 0.2, 0.1), [(9.0, 0.0), (-9.0, 0.0), (0.0, -2.0)])[0]
    path = world.metrics[0, list(METRICS).index("path_length")]
    world.place(0, bodies)
    np.testing.assert_array_equal(world.state.bodies[0], bodies)
    world.step(STAND)
    progress = world.terms[0, TERMS.index("reward_progress")]
    moved = world.metrics[0, list(METRICS).index("path_length")] - path
    # it moves on at .2 and .1 m/s for one physics step of .05 s
    assert moved == pytest.approx(0.05 * np.hypot(0.2, 0.1))
    assert abs(progress) < 0.2 * moved + 1e-9
    assert world.metrics[0, list(METRICS).index("acceleration_max")] < 10.0


# --- what a picture needs ------------------------------------------------------------------------


def test_a_scene_row_by_hand():
    # one walks ahead and left, one slowly, and one stands and looks somewhere
    people = [(5.0, 1.0, 2.0, 0.3, 0.3), (6.0, -1.0, 2.5, 0.03, 0.0), (7.0, 0.5, -1.0)]
    world = world_with((-4.0, 0.7, 0.2), people, goals=((-2.5, 0.1), (12.0, -0.2)))
    world.state.flags[0] = (True, False)
    row = world.state.scene_rows()[0]
    assert len(row) == 9 + 5 * 3
    np.testing.assert_allclose(row[:9], [0.7, -4.0, 0.2, 1.0, 0.0, 0.1, -2.5, -0.2, 12.0])
    expected = [
        (1.0, 5.0, np.pi / 4, 0.3, 0.3), (-1.0, 6.0, 2.5, 0.0, 0.03), (0.5, 7.0, -1.0, 0.0, 0.0)
    ]  # fmt: skip
    np.testing.assert_allclose(row[9:].reshape(3, 5), expected)


def test_scene_rows_are_copies():
    world = begun(2)
    rows = world.state.scene_rows()
    assert rows.shape == (2, 24)
    before = world.state.copy()
    rows[...] = 0.0
    assert np.array_equal(world.state.bodies, before.bodies)


def test_forces_are_what_people_feel():
    world = world_with((0.0, 0.0), [(1.0, 0.1), (12.0, 0.0)])
    world.act(STAND)
    assert np.linalg.norm(world.forces[0, 0]) > 1.0 and world.forces[0, 0, 0] > 0.0  # pushed away
    assert np.linalg.norm(world.forces[0, 1]) < 0.01
