import gymnasium as gym
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import socialnav_env  # noqa: F401 (registers the env)

CROWDED = {
    "num_humans": 6, "half_length": 6.0, "half_width": 1.6, "start_z": -4.5, "intermittent_z": 0.0,
    "goal_z": 4.0, "terminate_on_goal": False, "terminate_on_collision": False, "human_force": 0.3,
    "wall_force": 1.0, "human_radius": 0.25, "robot_radius": 0.25,
}  # fmt: skip
"""Contacts in most steps: with people, with walls, among people."""


def make(**settings):
    return gym.make("SocialCorridor-v0", **{**CROWDED, **settings}).unwrapped


ENV, OTHER = make(), make()
IN_PHYSICS = [{"frame_skip": 1, "timestep": 0.1}, {"frame_skip": 5, "timestep": 0.02}, {}]


def told(env, actions):
    """What the env tells under these actions, then at the next reset."""
    steps = []
    for action in actions:
        observation, reward, terminated, truncated, info = env.step(action)
        steps.append((observation.tobytes(), reward, terminated, truncated, info))
    vector, row = env.state_vector().tobytes(), env.state_row().tobytes()
    observation, info = env.reset()
    return steps, vector, row, env.data.time, observation.tobytes(), info


def actions_of(rng, count):
    return rng.uniform(-1.0, 1.0, (count, 2)) * (1.0, 0.7) + (0.4, 0.0)


def contacts_of(env, seed, count):
    """How many of the first steps the robot spends in contact."""
    env.reset(seed=seed)
    return sum(
        bool(env.step(action)[4]["reward_collision"])
        for action in actions_of(np.random.default_rng(seed), count)
    )


def test_contacts_occur():
    assert sum(contacts_of(ENV, seed, 60) for seed in range(10)) > 60


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10_000), st.integers(0, 60), st.integers(0, 30))
def test_the_same_actions_after_a_snapshot_give_the_same_bits(seed, before, elsewhere):
    rng = np.random.default_rng(seed)
    ENV.reset(seed=seed)
    for action in actions_of(rng, before):
        ENV.step(action)
    snapshot, actions = ENV.get_snapshot(), actions_of(rng, 40)
    first = told(ENV, actions)

    for action in actions_of(rng, elsewhere):  # the same env, which has gone elsewhere
        ENV.step(action)
    ENV.set_snapshot(snapshot)
    assert told(ENV, actions) == first

    OTHER.reset(seed=seed + 1)  # another env with a past of its own
    for action in actions_of(rng, elsewhere):
        OTHER.step(action)
    OTHER.set_snapshot(snapshot)
    assert told(OTHER, actions) == first


@pytest.mark.parametrize("settings", IN_PHYSICS, ids=str)
@pytest.mark.parametrize("seed", range(5))
def test_a_fresh_env_goes_on_from_a_snapshot(settings, seed):
    env, rng = make(**settings), np.random.default_rng(seed)
    env.reset(seed=seed)
    for action in actions_of(rng, 30):
        env.step(action)
    snapshot, actions = env.get_snapshot(), actions_of(rng, 60)
    first = told(env, actions)
    fresh = make(**settings)
    fresh.set_snapshot(snapshot)
    assert told(fresh, actions) == first


@pytest.mark.parametrize("settings", IN_PHYSICS, ids=str)
def test_a_snapshot_in_the_middle_of_a_lasting_contact(settings):
    env = make(**settings)
    env.reset(seed=0)
    qpos = env.data.qpos
    qpos[:3] = (1.3, 0.0, np.pi / 2)  # pressed against the left wall
    env.set_state(qpos, np.zeros_like(qpos))
    rng, push = np.random.default_rng(0), np.array([1.0, 0.0])
    for _ in range(10):
        env.step(push)
    assert env.world.contacts[0, 1]
    actions = np.vstack([np.tile(push, (20, 1)), actions_of(rng, 40)])
    snapshot = env.get_snapshot()
    first = told(env, actions)
    for other in (env, make(**settings)):
        other.set_snapshot(snapshot)
        assert told(other, actions) == first


def test_every_moment_of_an_episode_can_be_gone_on_from():
    ENV.reset(seed=1)
    actions = actions_of(np.random.default_rng(1), 40)
    moments = []
    for action in actions:
        snapshot = ENV.get_snapshot()
        moments.append((snapshot, ENV.step(action)[0].tobytes()))
    for action, (snapshot, observation) in zip(actions, moments, strict=True):
        OTHER.set_snapshot(snapshot)
        assert OTHER.step(action)[0].tobytes() == observation


def test_a_snapshot_stays_as_it_was_taken():
    ENV.reset(seed=2)
    snapshot = ENV.get_snapshot()
    bodies = snapshot.state.bodies.copy()
    for _ in range(2):
        for action in actions_of(np.random.default_rng(2), 20):
            ENV.step(action)
        np.testing.assert_array_equal(snapshot.state.bodies, bodies)
        ENV.set_snapshot(snapshot)


def test_the_trail_belongs_to_a_snapshot():
    env = make(render_mode="rgb_array", render_width=320)
    env.reset(seed=0)
    for _ in range(20):
        env.step([1.0, 0.1])
    snapshot, picture = env.get_snapshot(), env.render()
    for _ in range(20):
        env.step([1.0, 0.1])
    env.set_snapshot(snapshot)
    assert np.array_equal(env.render(), picture)


def test_a_snapshot_of_another_corridor_is_an_error_and_changes_nothing():
    other = make(num_humans=2)
    other.reset(seed=0)
    ENV.reset(seed=0)
    before = ENV.state_vector()
    with pytest.raises(ValueError, match="bodies: expected shape"):
        ENV.set_snapshot(other.get_snapshot())
    np.testing.assert_array_equal(ENV.state_vector(), before)
