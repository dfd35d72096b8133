import doctest

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.wrappers import RecordEpisodeStatistics

from socialnav_env.metrics import METRICS
from socialnav_env.wrappers import (
    EpisodeMetrics,
    FixedHorizon,
    RecordState,
    SocialMetrics,
    VectorSocialMetrics,
)

ENVS = ["SocialCorridor-v0", "Walker2d-v5", "HalfCheetah-v5"]
each_env = pytest.mark.parametrize("name", ENVS)


def actions_for(env, count, seed=0):
    env.action_space.seed(seed)
    return [env.action_space.sample() for _ in range(count)]


def crash(env):
    """Put a corridor's robot in front of a wall, so that it collides in a few steps."""
    qpos = env.unwrapped.data.qpos
    qpos[:3] = (2.4, 0.0, np.pi / 2)
    env.unwrapped.set_state(qpos, np.zeros_like(qpos))


@pytest.mark.parametrize(
    "wrapper", [FixedHorizon, RecordState, EpisodeMetrics, SocialMetrics, VectorSocialMetrics]
)
def test_the_example_in_the_docstring_runs(wrapper):
    tests = doctest.DocTestFinder(recurse=False).find(wrapper, globs={})
    assert len(tests) == 1
    assert doctest.DocTestRunner().run(tests[0]).failed == 0


# --- the fixed horizon ---------------------------------------------------------------------------


@each_env
def test_every_episode_lasts_until_the_horizon(make_mujoco, name):
    env = FixedHorizon(make_mujoco(name), steps=250)
    lengths, early = [], 0
    for episode in range(3):
        env.reset(seed=episode)
        lengths.append(0)
        for action in actions_for(env, 300, episode):
            _, _, terminated, truncated, info = env.step(action)
            lengths[-1] += 1
            assert not terminated
            if truncated:
                break
        early += info["held"]
    assert lengths == [250] * 3
    if name == "Walker2d-v5":
        assert early == 3  # random actions make it fall


@each_env
def test_until_the_end_it_is_the_env_itself(make_mujoco, name):
    plain, fixed = make_mujoco(name), FixedHorizon(make_mujoco(name), steps=600)
    first, second = plain.reset(seed=1), fixed.reset(seed=1)
    np.testing.assert_array_equal(first[0], second[0])
    for action in actions_for(plain, 600, 1):
        observation, reward, terminated, truncated, info = plain.step(action)
        seen, paid, _, _, told = fixed.step(action)
        np.testing.assert_array_equal(seen, observation)
        assert paid == reward
        assert told == {**info, "held": False, "ended": terminated}
        if terminated or truncated:
            break


def held_steps(env):
    """The terminal step's results, and those of the steps after it."""
    env.reset(seed=0)
    if env.spec.id.startswith("Social"):
        crash(env)
    told = []
    for action in actions_for(env, env.steps):
        told.append(env.step(np.ones_like(action) if env.unwrapped.model.nu == 2 else action))
    last = next(i for i, step in enumerate(told) if step[4]["held"])
    return told[last - 1], told[last:]


@pytest.mark.parametrize("name", ["SocialCorridor-v0", "Walker2d-v5"])
def test_a_terminal_state_is_held_and_pays_nothing(make_mujoco, name):
    env = FixedHorizon(make_mujoco(name), steps=300)
    (observation, reward, _, _, info), held = held_steps(env)
    assert reward != 0.0
    assert len(held) > 10
    for seen, paid, terminated, truncated, told in held:
        np.testing.assert_array_equal(seen, observation)
        assert paid == 0.0 == sum(v for k, v in told.items() if k.startswith("reward_"))
        assert told["held"] and not terminated
        assert truncated == (told is held[-1][4])
        assert {k: v for k, v in told.items() if k in METRICS} == {
            k: v for k, v in info.items() if k in METRICS
        }
    if name == "SocialCorridor-v0":
        assert info["collision"] and not any(step[4]["collision"] for step in held)


def test_a_finished_episode_is_reported_once(make_mujoco):
    inner = RecordEpisodeStatistics(EpisodeMetrics(make_mujoco("SocialCorridor-v0")))
    env = SocialMetrics(FixedHorizon(inner, steps=60))
    env.reset(seed=0)
    crash(env)
    told = [env.step(np.array([1.0, 1.0]))[4] for _ in range(60)]
    assert sum("episode" in info for info in told) == 1
    assert len(env.episodes) == 1 and env.episodes[0]["length"] == 60


@pytest.mark.parametrize("spare", [0, 1])
def test_an_end_on_the_last_step_is_no_time_out(make_mujoco, spare):
    env = make_mujoco("SocialCorridor-v0")
    env.reset(seed=0)
    crash(env)
    steps = next(k for k in range(1, 99) if env.step(np.array([1.0, 1.0]))[2])
    fixed = EpisodeMetrics(FixedHorizon(make_mujoco("SocialCorridor-v0"), steps=steps + spare))
    fixed.reset(seed=0)
    crash(fixed)
    for _ in range(steps + spare):
        info = fixed.step(np.array([1.0, 1.0]))[4]
    assert info["episode_metrics"]["timeout"] == 0.0
    assert info["episode_metrics"]["collided"] == 1.0


def test_held_steps_share_no_object(make_mujoco):
    env = FixedHorizon(make_mujoco("SocialCorridor-v0"), steps=50)
    _, held = held_steps(env)
    held[0][0][:] = 99.0
    held[0][4]["held"] = None
    assert held[1][0].max() < 99.0 and held[1][4]["held"] is True


def test_a_reset_lets_go(make_mujoco):
    env = FixedHorizon(make_mujoco("SocialCorridor-v0"), steps=50)
    held_steps(env)
    _, info = env.reset(seed=0)
    assert info["held"] is False
    assert env.step(np.zeros(2))[4]["held"] is False


@pytest.mark.parametrize("bad", [0, -1, 2.5, True, "9"])
def test_an_impossible_horizon_is_an_error(bad):
    with pytest.raises(ValueError, match=r"steps=.*expected a whole number"):
        FixedHorizon(gym.make("SocialCorridor-v0"), bad)


def test_a_horizon_beyond_the_time_limit_is_an_error():
    FixedHorizon(gym.make("SocialCorridor-v0"), 600)
    with pytest.raises(ValueError, match=r"steps=601: .*time limit is 600.*max_episode_steps=601"):
        FixedHorizon(gym.make("SocialCorridor-v0"), 601)


# --- the recorded states -------------------------------------------------------------------------


def recorded(make_mujoco, name):
    size = {"render_width": 160} if name.startswith("Social") else {"width": 64, "height": 64}
    return RecordState(make_mujoco(name, render_mode="rgb_array", **size))


def picture(env):
    """The present moment; a MujocoEnv's own frames lag behind its qpos by one physics step."""
    if env.spec.id != "SocialCorridor-v0":
        inner = env.unwrapped
        inner.set_state(inner.data.qpos, inner.data.qvel)
    return env.render()


@each_env
def test_any_past_moment_can_be_rendered(make_mujoco, name):
    env = recorded(make_mujoco, name)
    env.reset(seed=0)
    frames = [picture(env)]
    for action in actions_for(env, 12):
        env.step(action)
        frames.append(picture(env))
    assert len(env.moments) == 13
    for t in (3, 0, 12, 7):
        np.testing.assert_array_equal(env.render_at(t), frames[t])
    assert (frames[0] != frames[12]).any()


@each_env
def test_rendering_the_past_leaves_the_present_exactly(make_mujoco, name):
    env, plain = recorded(make_mujoco, name), make_mujoco(name)
    env.reset(seed=0)
    plain.reset(seed=0)
    for t, action in enumerate(actions_for(env, 40)):
        observation, reward, _, _, info = env.step(action)
        expected = plain.step(action)
        assert observation.tobytes() == expected[0].tobytes()
        assert (reward, info) == (expected[1], expected[4])
        if t % 5 == 0:
            before = env.unwrapped.state_vector()
            env.render_at(t // 2)
            np.testing.assert_array_equal(env.unwrapped.state_vector(), before)


@each_env
def test_a_reset_begins_a_new_recording(make_mujoco, name):
    env = RecordState(make_mujoco(name))
    env.reset(seed=0)
    env.step(env.action_space.sample())
    assert len(env.moments) == 2
    env.reset()
    assert len(env.moments) == 1


@each_env
def test_recording_needs_no_pictures_until_they_are_asked_for(make_mujoco, name):
    env = RecordState(make_mujoco(name))
    env.reset(seed=0)
    with pytest.raises(ValueError, match="render_mode=None: expected 'rgb_array'"):
        env.render_at(0)


@pytest.mark.parametrize("t", [-1, 1, 99])
def test_a_moment_that_never_was_is_an_error(t):
    env = RecordState(gym.make("SocialCorridor-v0", render_mode="rgb_array", render_width=64))
    env.reset(seed=0)
    with pytest.raises(IndexError, match=rf"t={t}: expected a moment in \[0, 0\]"):
        env.render_at(t)


def test_an_env_without_a_state_is_an_error():
    with pytest.raises(TypeError, match="CartPoleEnv cannot be recorded: expected get_snapshot"):
        RecordState(gym.make("CartPole-v1"))


# --- the metrics of an episode -------------------------------------------------------------------


@each_env
def test_return_length_and_time_out_at_the_end_and_only_there(make_mujoco, name):
    env = EpisodeMetrics(make_mujoco(name, max_episode_steps=60))
    for episode in range(2):
        env.reset(seed=episode)
        total, length = 0.0, 0
        for action in actions_for(env, 60, episode):
            length += 1
            _, reward, terminated, truncated, info = env.step(action)
            total += reward
            assert ("episode_metrics" in info) == (terminated or truncated)
            if terminated or truncated:
                break
        metrics = info["episode_metrics"]
        assert metrics["return"] == pytest.approx(total)
        assert metrics["length"] == length
        assert metrics["timeout"] == float(truncated)
        social = set(METRICS) if name.startswith("Social") else set()
        counted = {"collided"} if social else set()
        assert set(metrics) == {"timeout", "return", "length"} | social | counted
        assert all(metrics[key] == info[key] for key in social)


def test_a_collision_is_no_time_out():
    env = EpisodeMetrics(gym.make("SocialCorridor-v0", num_humans=0))
    env.reset(seed=0)
    crash(env)
    info = {}
    while "episode_metrics" not in info:
        info = env.step(np.array([1.0, 0.0]))[4]
    assert info["episode_metrics"]["timeout"] == 0.0
    assert info["episode_metrics"]["wall_collisions"] == 1.0
    assert info["episode_metrics"]["collided"] == 1.0


@pytest.mark.parametrize("reached", [False, True])
def test_time_runs_out_only_before_the_goal_is_reached(reached):
    env = EpisodeMetrics(
        gym.make("SocialCorridor-v0", num_humans=0, terminate_on_goal=False, max_episode_steps=5)
    )
    env.reset(seed=0)
    if reached:
        env.unwrapped.world.state.goals[0, 1] = env.unwrapped.world.state.bodies[0, 0, :2]
    for _ in range(5):
        info = env.step(np.array([-1.0, 0.0]))[4]
    assert info["episode_metrics"]["success"] == float(reached)
    assert info["episode_metrics"]["timeout"] == float(not reached)


def test_held_steps_are_no_time_out():
    env = EpisodeMetrics(FixedHorizon(gym.make("SocialCorridor-v0", num_humans=0), steps=40))
    env.reset(seed=0)
    crash(env)
    for _ in range(40):
        info = env.step(np.array([1.0, 0.0]))[4]
    assert info["episode_metrics"]["timeout"] == 0.0
    assert info["episode_metrics"]["length"] == 40


# --- all of them ---------------------------------------------------------------------------------


@each_env
def test_wrappers_stack_and_are_made_again_from_their_spec(make_mujoco, name):
    env = EpisodeMetrics(RecordState(FixedHorizon(make_mujoco(name), steps=30)))
    again = gym.make(env.spec)
    told = []
    for made in (env, again):
        observation, _ = made.reset(seed=0)
        for action in actions_for(env, 30):
            observation, *_, info = made.step(action)
        told.append((observation.tobytes(), info["episode_metrics"]))
    assert told[0] == told[1]
    assert [type(e) for e in layers(again)][:3] == [EpisodeMetrics, RecordState, FixedHorizon]
    again.close()


def layers(env):
    while isinstance(env, gym.Wrapper):
        yield env
        env = env.env
