from copy import deepcopy

import gymnasium as gym
import numpy as np
import pytest
from stub_envs import register, vec_env

from polite.policies.vec_env import make_vec_env
from polite.rollouts import act_randomly, collect, evaluate, state_rows
from polite.types import NotFiniteError


def act(observations):
    """An action that tells of the observation it was chosen for."""
    return np.stack([observations[:, 0] / 10, observations[:, 1] / 10], axis=1).astype(np.float32)


def rolled(steps=11, count=1, **settings):
    return collect(vec_env(count, **settings).vector_env, act, steps, seed=0)


def test_no_trajectory_spans_a_reset() -> None:
    trajectories = rolled(steps=11, lengths=(5, 3))
    assert [len(t) for t in trajectories] == [5, 3, 3]
    for number, trajectory in enumerate(trajectories):
        assert trajectory.observations[:, 0].tolist() == list(range(len(trajectory)))
        assert (trajectory.observations[:, 1] == number).all()


def test_only_an_end_of_the_env_counts_as_terminated() -> None:
    assert [t.terminated for t in rolled(steps=11, lengths=(5, 3))] == [True, True, False]
    assert [t.terminated for t in rolled(steps=5, lengths=(9,), limit=4)] == [False, False]


def test_observation_action_and_reward_of_a_row_belong_together() -> None:
    for trajectory in rolled(steps=12, count=3, lengths=(4, 2)):
        steps = trajectory.observations[:, 0]
        np.testing.assert_array_equal(trajectory.actions, act(trajectory.observations))
        np.testing.assert_allclose(trajectory.rewards, steps + trajectory.actions[:, 0] / 100)


def test_all_steps_are_kept_env_by_env() -> None:
    trajectories = rolled(steps=7, count=4, lengths=(3,))
    assert sum(len(t) for t in trajectories) == 28
    assert [len(t) for t in trajectories] == [3, 3, 1] * 4


def test_the_corridor_states_are_those_before_the_step() -> None:
    import socialnav_env  # noqa: F401

    env = make_vec_env("SocialCorridor-v0", 2, 0).vector_env
    trajectories = collect(env, lambda o: np.tile([1.0, 0.0], (len(o), 1)), 30, seed=1)
    for trajectory in trajectories:
        np.testing.assert_allclose(trajectory.states[:, :2], trajectory.observations[:, :2])


def test_an_env_that_cannot_be_drawn_gives_its_observations_as_states() -> None:
    assert state_rows(vec_env().vector_env) is None
    (trajectory,) = rolled(steps=4)
    np.testing.assert_array_equal(trajectory.states, trajectory.observations)


def test_equal_seeds_give_equal_rollouts() -> None:
    env = make_vec_env("Pendulum-v1", 2, 0).vector_env
    still = lambda o: np.zeros((len(o), 1), np.float32)  # noqa: E731
    first, second, other = (collect(env, still, 10, seed)[0] for seed in (3, 3, 4))
    np.testing.assert_array_equal(first.observations, second.observations)
    assert (first.observations != other.observations).any()


def test_evaluation_counts_each_env_once_long_and_short_alike() -> None:
    env = vec_env(2, lengths=(2, 5)).vector_env
    env.envs[1].lengths = (5, 2)
    episodes = evaluate(env, lambda o: np.zeros((2, 2), np.float32), seed=0)
    assert episodes["length"].tolist() == [2, 5]
    assert episodes["return"].tolist() == [0 + 1, 0 + 1 + 2 + 3 + 4]
    assert episodes["success"].tolist() == [1, 1]


def test_evaluation_refuses_rewards_that_are_no_numbers() -> None:
    env = vec_env(2, lengths=(4,), spoiled_at=3).vector_env
    with pytest.raises(NotFiniteError, match="rewards: 2 of 2 values"):
        evaluate(env, lambda o: np.zeros((2, 2), np.float32), seed=0)


def test_evaluation_keeps_the_final_values_of_the_env() -> None:
    import socialnav_env  # noqa: F401

    env = make_vec_env("SocialCorridor-v0", 3, 0, max_episode_steps=5).vector_env
    episodes = evaluate(env, lambda o: np.tile([-1.0, 0.0], (len(o), 1)), seed=0)
    assert episodes["length"].tolist() == [5, 5, 5]
    assert episodes["success"].tolist() == [0, 0, 0]
    assert episodes["path_length"] == pytest.approx(np.zeros(3))


def test_evaluation_keeps_numbers_whatever_else_is_told() -> None:
    """An array per env (Humanoid-v5's tendons) and an np.bool_ each ended a training once."""
    register()
    env = make_vec_env("Talkative-v0", 2, 0, lengths=(2, 5)).vector_env
    env.envs[1].unwrapped.episode = 0  # its next one is a second episode, which tells more
    episodes = evaluate(env, lambda o: np.zeros((2, 2), np.float32), seed=0)
    assert set(episodes) == {"return", "length", "success", "seldom"}
    np.testing.assert_array_equal(episodes["seldom"], [np.nan, 1.0])
    assert episodes["success"].tolist() == [0, 1]


def test_random_actions_fill_their_bounds_and_leave_the_env_s_own_draws_alone() -> None:
    space = gym.spaces.Box(np.array([-3.0, 0.0]), np.array([5.0, 1.0]), dtype=np.float64)
    space.seed(7)
    expected = deepcopy(space).sample()
    first, second, other = (act_randomly(space, seed) for seed in (0, 0, 1))
    seen = np.zeros((500, 3))
    actions = first(seen)
    assert actions.shape == (500, 2) and actions.dtype == np.float32
    assert (actions >= space.low).all() and (actions <= space.high).all()
    np.testing.assert_allclose(actions.mean(axis=0), [1.0, 0.5], atol=0.3)
    np.testing.assert_array_equal(second(seen), actions)
    assert not np.array_equal(other(seen), actions)
    np.testing.assert_array_equal(space.sample(), expected)
