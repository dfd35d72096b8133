import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from socialnav_env.config import ConfigError
from socialnav_env.vector_env import SocialCorridorVectorEnv

LENIENT = {"terminate_on_goal": False, "terminate_on_collision": False}


def make(count, **settings):
    return gym.make_vec("SocialCorridor-v0", num_envs=count, **settings)


def test_make_vec_makes_one_world():
    env = make(5, num_humans=2)
    assert isinstance(env.unwrapped, SocialCorridorVectorEnv)
    assert env.num_envs == 5
    assert env.unwrapped.max_episode_steps == 600
    assert (
        env.single_observation_space
        == gym.make("SocialCorridor-v0", num_humans=2).observation_space
    )
    assert env.metadata["autoreset_mode"] == AutoresetMode.SAME_STEP


def test_spaces_are_batches():
    env = make(3)
    observations, _ = env.reset(seed=0)
    assert env.observation_space.contains(observations)
    observations, rewards, terminated, truncated, info = env.step(np.zeros((3, 2)))
    assert env.observation_space.contains(observations)
    assert rewards.shape == terminated.shape == truncated.shape == (3,)
    assert all(values.shape == (3,) for values in info.values())


@pytest.mark.parametrize("count", [1, 3, 12])
def test_corridors_are_single_envs_with_equal_seeds(count):
    """Equal over whole episodes up to the rounding of a corridor's place in the common Space.

    Corridor n lies n times 10 m aside, so that x is rounded at 1e-15 of that; in a contact such
    a difference grows, hence 1e-6 instead of 1e-12.
    """
    together, apart = make(count), [gym.make("SocialCorridor-v0") for _ in range(count)]
    observations, info = together.reset(seed=7)
    for n, env in enumerate(apart):
        observation, values = env.reset(seed=7 + n)
        np.testing.assert_array_equal(observations[n], observation)
        assert {name: info[name][n] for name in values} == values
    rng, running, ends = np.random.default_rng(0), np.ones(count, dtype=bool), 0
    for _ in range(600):
        actions = rng.uniform(-1.0, 1.0, (count, 2)) * (1.0, 0.5) + (0.5, 0.0)
        observations, rewards, terminated, truncated, info = together.step(actions)
        for n in np.flatnonzero(running):
            observation, reward, *ended, values = apart[n].step(actions[n])
            assert [terminated[n], truncated[n]] == ended
            assert rewards[n] == pytest.approx(reward, abs=1e-6)
            over = any(ended)
            last = info["final_obs"][n] if over else observations[n]
            np.testing.assert_allclose(last, observation, atol=1e-6)
            told = info["final_info"] if over else info
            for name, value in values.items():
                assert told[name][n] == pytest.approx(value, rel=1e-4, abs=1e-4), name
            running[n] &= not over
            ends += over
    assert ends == count


def test_a_corridor_that_ends_begins_the_next_episode_in_the_same_step():
    env = make(4, max_episode_steps=7, **LENIENT)
    first, _ = env.reset(seed=0)
    for step in range(1, 22):
        observations, _, terminated, truncated, info = env.step(np.tile([1.0, 0.0], (4, 1)))
        assert not terminated.any()
        assert truncated.all() == (step % 7 == 0)
        assert ("final_obs" in info) == (step % 7 == 0)
    assert env.observation_space.contains(observations)
    assert (info["final_obs"] != observations).any(axis=1).all()
    np.testing.assert_array_equal(info["_final_obs"], True)
    np.testing.assert_array_equal(info["final_info"]["z_position"], info["final_obs"][:, 1])
    assert (observations[:, 1] < -13.0).all()
    assert (observations != first).any()


def test_only_corridors_that_end_begin_anew():
    env = make(3, num_humans=0)
    env.reset(seed=0)
    world = env.unwrapped.world
    world.place(1, np.array([[0.0, 2.69, np.pi / 2, 0.0, 0.0, 0.0]]))
    before = world.state.bodies.copy()
    ended = np.zeros(3, dtype=bool)
    while not ended.any():
        _, rewards, terminated, truncated, info = env.step(np.tile([1.0, 0.0], (3, 1)))
        ended = terminated | truncated
    assert ended.tolist() == info["_final_obs"].tolist() == [False, True, False]
    assert info["final_info"]["wall_collisions"][1] == 1.0
    assert rewards[1] == pytest.approx(
        sum(v[1] for k, v in info.items() if k.startswith("reward_"))
    )
    np.testing.assert_array_less(before[[0, 2], 0, 0], world.state.bodies[[0, 2], 0, 0])
    assert world.state.time[[0, 2]].min() > 0.0 == world.state.time[1]


def test_the_goal_is_no_time_out():
    """A corridor that reaches the goal on its last step has terminated, not been truncated."""
    env = make(2, num_humans=0, max_episode_steps=1)
    env.reset(seed=0)
    env.unwrapped.world.state.goals[0, 1] = env.unwrapped.world.state.bodies[0, 0, :2]
    _, _, terminated, truncated, _ = env.step(np.zeros((2, 2)))
    assert terminated.tolist() == [True, False]
    assert truncated.tolist() == [False, True]


def test_seeds():
    one = make(3).reset(seed=5)[0]
    np.testing.assert_array_equal(make(3).reset(seed=[5, 6, 7])[0], one)
    np.testing.assert_array_equal(make(3).reset(seed=np.int64(5))[0], one)
    assert len(np.unique(one, axis=0)) == 3
    with pytest.raises(ConfigError, match="seed: expected 3 seeds, got 2"):
        make(3).reset(seed=[1, 2])


def test_resets_without_a_seed_go_on_drawing():
    env, again = make(2), make(2)
    told = [[e.reset(seed=1)[0], e.reset()[0], e.reset()[0]] for e in (env, again)]
    np.testing.assert_array_equal(told[0], told[1])
    assert len(np.unique(np.vstack(told[0]), axis=0)) == 6


def test_infos_of_earlier_steps_stay_as_they_were():
    env = make(2)
    observations, info = env.reset(seed=0)
    kept = {name: values.copy() for name, values in info.items()}, observations.copy()
    for _ in range(5):
        env.step(np.ones((2, 2)))
    np.testing.assert_array_equal(observations, kept[1])
    for name, values in kept[0].items():
        np.testing.assert_array_equal(info[name], values)


@pytest.mark.parametrize("bad", [np.zeros((2, 3)), np.zeros(2), np.full((3, 2), np.nan)])
def test_bad_actions_are_an_error(bad):
    env = make(3)
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"expected finite numbers of shape \(3, 2\)"):
        env.step(bad)


@pytest.mark.parametrize("bad", [{"num_envs": 0}, {"num_envs": 1.5}, {"max_episode_steps": 0}])
def test_impossible_counts_are_an_error(bad):
    with pytest.raises(ConfigError, match="expected a whole number of at least 1"):
        SocialCorridorVectorEnv(**{"num_envs": 1, **bad})


def test_unknown_keywords_and_options_are_an_error():
    with pytest.raises(ConfigError, match="unknown keyword people"):
        make(2, people=3)
    with pytest.raises(ConfigError, match="unknown reset option mask"):
        make(2).reset(options={"mask": 1})


def test_a_step_needs_a_reset():
    with pytest.raises(gym.error.ResetNeeded, match="reset"):
        make(2).step(np.zeros((2, 2)))


def test_rows_draw_the_moment_they_were_taken_at():
    env, single = make(2), gym.make("SocialCorridor-v0").unwrapped
    env.reset(seed=3)
    single.reset(seed=4)
    np.testing.assert_array_equal(env.unwrapped.state_rows()[1], single.state_row())


def test_nothing_leaves_the_corridor_in_a_million_random_steps():
    count, steps = 256, 4000
    env = SocialCorridorVectorEnv(count, terminate_on_collision=False)
    observations, _ = env.reset(seed=0)
    config, rng = env.config, np.random.default_rng(0)
    low, high = env.single_observation_space.low, env.single_observation_space.high
    edge = np.array([config.half_length, config.half_width])
    radii = np.array([config.robot_radius] + [config.human_radius] * config.num_humans)
    deepest = (config.robot_speed + config.human_top_speed) * config.timestep + 0.01
    lowest, highest, farthest, contacts = observations.min(0), observations.max(0), -np.inf, 0.0
    push = np.zeros((count, 2))
    for step in range(steps):
        if step % 20 == 0:  # held for two seconds, so that the robots get somewhere
            push = rng.uniform(-1.0, 1.0, (count, 2)) * (1.0, 0.3) + (0.6, 0.0)
        observations, _, _, _, info = env.step(push)
        lowest = np.minimum(lowest, observations.min(axis=0))
        highest = np.maximum(highest, observations.max(axis=0))
        beyond = np.abs(env.world.state.bodies[..., :2]) + radii[:, None] - edge
        farthest = max(farthest, beyond.max())
        contacts += np.count_nonzero(info["reward_collision"])
    assert count * steps >= 1_000_000
    assert contacts > 10_000
    assert np.isfinite(highest).all()
    assert (low <= lowest).all() and (highest <= high).all()
    assert farthest <= deepest  # no deeper into a wall than one physics step presses
