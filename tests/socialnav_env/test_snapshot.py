"""Snapshots, copies and pickles go on exactly, in this process and in another one."""

import copy
import hashlib
import os
import pickle
import subprocess
import sys
from functools import cache
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from hypothesis import given, settings
from hypothesis import strategies as st

import socialnav_env  # noqa: F401 (registers the env)
from socialnav_env.rendering import OVERLAYS

CROWDED = {
    "num_humans": 6, "half_length": 6.0, "half_width": 1.6, "start_z": -4.5, "intermittent_z": 0.0,
    "goal_z": 4.0, "terminate_on_goal": False, "terminate_on_collision": False, "human_force": 0.3,
    "wall_force": 1.0, "human_radius": 0.25, "robot_radius": 0.25,
}  # fmt: skip
"""Contacts in most steps: with people, with walls, among people."""
NOISY = {"ray_noise": 0.1, "tracking_noise": 0.1}
KINDS = {
    "crowded": CROWDED,
    "noisy": {**CROWDED, **NOISY, "walking": "mixed", "frame_skip": 1, "timestep": 0.1},
    "holonomic": {**CROWDED, "action": "holonomic", "walking": "along", "ray_noise": 0.2},
    "doorway": {"scenario": "doorway", "start_z": 0.5, "observation": "rays", "ray_noise": 0.1},
    "standing": {"walking": "queue", "num_humans": 5, "human_patience": 1.0, "start_z": 0.0},
    "ending": {"num_humans": 8, "half_length": 6.0, "start_z": -1.0, "goal_z": 1.0} | {
        "intermittent_z": 0.0
    },
}  # fmt: skip
VARIED = {"human_speed": (0.3, 0.9), "walking": ["cross", "along"]}
SMALL = {"render_mode": "rgb_array", "render_width": 160, "overlays": OVERLAYS}
MODES = list(AutoresetMode)

kinds = st.sampled_from([*KINDS])
seeds, moments = st.integers(0, 10_000), st.integers(0, 60)


def make(kind="crowded", **further):
    return gym.make("SocialCorridor-v0", **{**KINDS[kind], **further}).unwrapped


def make_vec(kind="crowded", mode=AutoresetMode.NEXT_STEP, count=3, **further):
    keywords = {"max_episode_steps": 25, "autoreset_mode": mode, **KINDS[kind], **further}
    return gym.make_vec("SocialCorridor-v0", num_envs=count, **keywords)


made = cache(make)
made_vec = cache(make_vec)


def actions_of(env, rng, count):
    """Mostly straight on."""
    actions = rng.uniform(-1.0, 1.0, (count, *env.action_space.shape))
    actions[..., 0] += 0.4
    actions[..., -1] *= 0.7
    return actions


def bits(value):
    """A value that is equal only to its like in every bit."""
    if isinstance(value, dict):
        return {name: bits(one) for name, one in value.items()}
    if isinstance(value, np.ndarray):
        return [bits(one) for one in value] if value.dtype == object else value.tobytes()
    return value


def drive(env, actions):
    """Everything that the env tells under these actions, reset wherever it has to be."""
    vector = isinstance(env, gym.vector.VectorEnv)
    disabled = env.metadata.get("autoreset_mode") is AutoresetMode.DISABLED
    told = []
    for action in actions:
        step = env.step(action)
        ended = step[2] | step[3]
        told.append([bits(value) for value in step])
        if vector and disabled and ended.any():
            told.append([bits(value) for value in env.reset(options={"reset_mask": ended})])
        elif not vector and ended:
            told.append([bits(value) for value in env.reset()])
    return told


def told_by(env, actions):
    """What the env tells under these actions, and at the next two resets."""
    base = env.unwrapped
    rows = base.state_rows if isinstance(env, gym.vector.VectorEnv) else base.state_row
    told, row = drive(env, actions), bits(rows())
    return told, row, [[bits(value) for value in env.reset()] for _ in range(2)]


def pickled(env):
    return pickle.loads(pickle.dumps(env))


# --- property tests ------------------------------------------------------------------------------


@settings(deadline=None, max_examples=40)
@given(kinds, seeds, moments, st.integers(0, 30), st.sampled_from([None, {}, VARIED]))
def test_the_same_actions_after_a_snapshot_give_the_same_bits(
    kind, seed, before, elsewhere, options
):
    env, other, rng = made(kind), made(kind, render_mode=None), np.random.default_rng(seed)
    env.reset(seed=seed, options=options)
    drive(env, actions_of(env, rng, before))
    snapshot, actions = env.get_snapshot(), actions_of(env, rng, 30)
    first = told_by(env, actions)

    drive(env, actions_of(env, rng, elsewhere))  # the same env, which has gone elsewhere
    env.set_snapshot(snapshot)
    assert told_by(env, actions) == first

    other.reset(seed=seed + 1)  # another env with a past of its own
    drive(other, actions_of(other, rng, elsewhere))
    other.set_snapshot(snapshot)
    assert told_by(other, actions) == first


@settings(deadline=None, max_examples=40)
@given(kinds, st.sampled_from(MODES), seeds, moments, st.booleans())
def test_the_same_actions_after_a_snapshot_of_many_give_the_same_bits(
    kind, mode, seed, before, varied
):
    env, rng = made_vec(kind, mode), np.random.default_rng(seed)
    env.reset(seed=seed, options=VARIED if varied else {})
    drive(env, actions_of(env, rng, before))
    snapshot, actions = env.get_snapshot(), actions_of(env, rng, 40)
    first = told_by(env, actions)
    fresh = made_vec(kind, mode, render_mode=None)
    for one in (env, fresh):
        one.set_snapshot(snapshot)
        assert told_by(one, actions) == first


@settings(deadline=None, max_examples=15)
@given(
    kinds, seeds, moments, st.sampled_from([copy.deepcopy, lambda e: pickle.loads(pickle.dumps(e))])
)
def test_copies_and_pickles_of_wrapped_envs_go_on_too(kind, seed, before, copied):
    """With the time limit's count and the seeds of the spaces."""
    env = gym.make("SocialCorridor-v0", max_episode_steps=before + 10, **KINDS[kind])
    env.action_space.seed(seed)
    env.reset(seed=seed, options=VARIED)
    drive(env, actions_of(env, np.random.default_rng(seed), before))
    other = copied(env)
    samples = [[one.action_space.sample().tolist() for _ in range(20)] for one in (env, other)]
    assert samples[0] == samples[1]
    assert told_by(other, samples[0]) == told_by(env, samples[0])
    np.testing.assert_array_equal(other.unwrapped.data.qpos, env.unwrapped.data.qpos)


@settings(deadline=None, max_examples=15)
@given(kinds, st.sampled_from(MODES), seeds, moments)
def test_copies_and_pickles_of_vector_envs_go_on_too(kind, mode, seed, before):
    env = gym.wrappers.vector.RecordEpisodeStatistics(make_vec(kind, mode))
    env.action_space.seed(seed)
    env.reset(seed=seed, options=VARIED)
    drive(env.unwrapped, actions_of(env, np.random.default_rng(seed), before))
    others = copy.deepcopy(env.unwrapped), pickled(env).unwrapped
    actions = [env.action_space.sample() for _ in range(20)]
    first = told_by(env.unwrapped, actions)
    for other in others:
        assert all((other.action_space.sample() == action).all() for action in actions)
        assert told_by(other, actions) == first


# --- another process -----------------------------------------------------------------------------


def digest(told):
    return hashlib.sha256(repr(told).encode()).hexdigest()


PROGRAM = """
import pickle, sys
sys.path.insert(0, {folder!r})
import test_snapshot as t
for making, (env, snapshot, actions) in zip((t.make, t.make_vec), pickle.load(sys.stdin.buffer)):
    fresh = making("noisy")
    fresh.set_snapshot(snapshot)
    print(t.digest(t.told_by(fresh, actions)), t.digest(t.told_by(env, actions)))
"""


def test_another_process_goes_on_from_a_snapshot_and_from_a_pickled_env():
    given, expected = [], []
    for env in (make("noisy"), make_vec("noisy")):
        rng = np.random.default_rng(0)
        env.reset(seed=0, options=VARIED)
        drive(env, actions_of(env, rng, 30))
        actions = actions_of(env, rng, 20)
        given.append(pickle.dumps((env, env.get_snapshot(), actions)))
        expected += [digest(told_by(env, actions))] * 2
    here = Path(__file__).parent
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(folder=str(here))],
        input=pickle.dumps([pickle.loads(one) for one in given]),
        capture_output=True, check=True, timeout=120, cwd=here.parents[1],
        env={**os.environ, "PYTHONHASHSEED": "7"},
    )  # fmt: skip
    assert done.stdout.decode().split() == expected


# --- one by one ----------------------------------------------------------------------------------


def test_contacts_occur():
    env, contacts = made("crowded"), 0
    for seed in range(10):
        env.reset(seed=seed)
        actions = actions_of(env, np.random.default_rng(seed), 60)
        contacts += sum(bool(env.step(action)[4]["reward_collision"]) for action in actions)
    assert contacts > 60


@pytest.mark.parametrize("frames", [(1, 0.1), (2, 0.05), (5, 0.02)], ids=str)
def test_a_snapshot_in_the_middle_of_a_lasting_contact(frames):
    keywords = {"frame_skip": frames[0], "timestep": frames[1]}
    env = make(**keywords)
    env.reset(seed=0)
    qpos = env.data.qpos
    qpos[:3] = (1.3, 0.0, np.pi / 2)  # pressed against the left wall
    env.set_state(qpos, np.zeros_like(qpos))
    rng, push = np.random.default_rng(0), np.array([1.0, 0.0])
    for _ in range(10):
        env.step(push)
    assert env.world.contacts[0, 1]
    actions = np.vstack([np.tile(push, (20, 1)), actions_of(env, rng, 40)])
    snapshot = env.get_snapshot()
    first = told_by(env, actions)
    for other in (env, make(**keywords)):
        other.set_snapshot(snapshot)
        assert told_by(other, actions) == first


def test_every_moment_of_an_episode_can_be_gone_on_from():
    env, other = make("noisy"), make("noisy")
    env.reset(seed=1)
    moments = []
    for action in actions_of(env, np.random.default_rng(1), 40):
        snapshot = env.get_snapshot()
        moments.append((action, snapshot, env.step(action)[0].tobytes()))
    for action, snapshot, observation in moments:
        other.set_snapshot(snapshot)
        assert other.step(action)[0].tobytes() == observation


@pytest.mark.parametrize("env", [make("noisy"), make_vec("noisy")], ids=["one", "many"])
def test_a_snapshot_stays_as_it_was_taken(env):
    env.reset(seed=2)
    snapshot = env.get_snapshot()
    kept = pickle.dumps(snapshot)
    for _ in range(2):
        drive(env, actions_of(env, np.random.default_rng(2), 30))
        assert pickle.dumps(snapshot) == kept
        env.set_snapshot(snapshot)


@pytest.mark.parametrize("making", [make, make_vec])
def test_the_picture_belongs_to_a_snapshot(making):
    env, fresh = (making("crowded", **SMALL) for _ in range(2))
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    drive(env, actions_of(env, rng, 20))
    snapshot, picture = env.get_snapshot(), np.array(env.render())
    drive(env, actions_of(env, rng, 20))
    assert not np.array_equal(env.render(), picture)
    for one in (env, fresh):
        one.set_snapshot(snapshot)
        assert np.array_equal(one.render(), picture)


def test_a_snapshot_without_pictures_gives_a_trail_from_there_on():
    plain, drawn = make(), make(**SMALL)
    plain.reset(seed=0)
    drawn.set_snapshot(plain.get_snapshot())
    plain.reset(seed=0)
    drawn.step(np.array([1.0, 0.0]))
    assert len(drawn.get_snapshot().trails[0]) == 2


@pytest.mark.parametrize("making", [make, make_vec])
def test_a_snapshot_of_another_corridor_is_an_error_and_changes_nothing(making):
    env, other = making(), making(num_humans=2)
    for one in (env, other):
        one.reset(seed=0)
    before = pickle.dumps(env.get_snapshot())
    with pytest.raises(ValueError, match="num_humans=2, expected num_humans=6"):
        env.set_snapshot(other.get_snapshot())
    assert pickle.dumps(env.get_snapshot()) == before


@pytest.mark.parametrize("making", [make, make_vec])
@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"half_length": 7.0}, "half_length=7.0, expected half_length=6.0"),
        ({"goal_reward": 2.0, "ray_noise": 0.1}, "ray_noise=0.1, expected ray_noise=0.0"),
        ({"walking": "along"}, "walking='along', expected walking='cross'"),
    ],
)
def test_a_snapshot_of_other_settings_names_the_first_that_differs(making, settings, said):
    env, other = making(), making(**settings)
    other.reset(seed=0)
    with pytest.raises(ValueError, match=said):
        env.set_snapshot(other.get_snapshot())


def test_a_snapshot_of_another_number_of_corridors_is_an_error():
    env, other = make_vec(count=2), make_vec(count=3)
    other.reset(seed=0)
    with pytest.raises(ValueError, match="bodies: expected shape"):
        env.set_snapshot(other.get_snapshot())


def test_a_snapshot_of_another_autoreset_mode_is_an_error():
    """A corridor that is over waits for what the other mode never does."""
    env, other = make_vec(mode=AutoresetMode.SAME_STEP), make_vec(mode=AutoresetMode.NEXT_STEP)
    other.reset(seed=0)
    with pytest.raises(ValueError, match="NextStep, expected SameStep"):
        env.set_snapshot(other.get_snapshot())


def test_a_snapshot_of_one_is_none_of_many():
    single, vector = make(), make_vec(count=1)
    single.reset(seed=0)
    vector.reset(seed=0)
    with pytest.raises(ValueError, match="expected a VectorSnapshot, got a Snapshot"):
        vector.set_snapshot(single.get_snapshot())
    with pytest.raises(ValueError, match="expected a Snapshot, got a VectorSnapshot"):
        single.set_snapshot(vector.get_snapshot())


@pytest.mark.parametrize("making", [make, make_vec])
@pytest.mark.parametrize("bad", [None, {}, (np.zeros(9), np.zeros(9))], ids=str)
def test_what_is_no_snapshot_is_an_error(making, bad):
    with pytest.raises(ValueError, match=r"expected a \w*Snapshot, got a (NoneType|dict|tuple)"):
        making().set_snapshot(bad)


@pytest.mark.parametrize("making", [make, make_vec])
def test_there_is_no_snapshot_before_the_first_reset(making):
    with pytest.raises(gym.error.ResetNeeded, match=r"reset\(\) before get_snapshot\(\)"):
        making().get_snapshot()


def test_a_snapshot_has_the_generator_that_somebody_gave():
    env = make()
    env.reset(seed=0)
    env.np_random = np.random.default_rng(5)
    snapshot, start = env.get_snapshot(), env.reset()[0]
    env.set_snapshot(snapshot)
    assert bits(env.reset()[0]) == bits(start)


@pytest.mark.parametrize("making", [make, make_vec])
def test_the_sensor_noise_goes_on(making):
    env, fresh = making("noisy"), making("noisy")
    env.reset(seed=0)
    drive(env, actions_of(env, np.random.default_rng(0), 5))
    snapshot = env.get_snapshot()
    seen = bits(env.world.observe())
    for one in (env, fresh):
        one.set_snapshot(snapshot)
        assert bits(one.world.observe()) == seen


def test_the_initial_state_belongs_to_a_snapshot():
    env, fresh = make(), make()
    env.reset(seed=3)
    qpos, qvel, snapshot = env.init_qpos, env.init_qvel, env.get_snapshot()
    env.reset()
    fresh.reset(seed=9)
    for one in (env, fresh):
        one.set_snapshot(snapshot)
        np.testing.assert_array_equal(one.init_qpos, qpos)
        np.testing.assert_array_equal(one.init_qvel, qvel)


def test_a_copy_has_no_window(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    keywords = {"render_mode": "human", "render_width": 160, "frame_skip": 1, "timestep": 0.002}
    for env in (make(**keywords), make_vec(**keywords)):
        env.reset(seed=0)
        other = copy.deepcopy(env)
        assert env._window is not None and other._window is None
        env.close()
        other.close()
