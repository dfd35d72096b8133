"""Bugs of other preference-learning projects, looked for in the whole loop.

Each test names its bug. Those that one part alone can show are tested beside that part: the last
possible start of a segment in test_segments, the stochastic teacher in test_bpref, highlights that
leak into the next query in test_oracle, the reward that pays the policy in test_policies, and
episodes shorter than a segment in test_methods.
"""

import gc
import weakref
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from stub_envs import CountingEnv

import polite.methods.preference_learning as preference_learning
from polite.methods.config import METHODS, LearningConfig, Schedule
from polite.methods.history import FeedbackHistory
from polite.methods.preference_learning import learn
from polite.policies.ppo import PpoConfig
from polite.policies.vec_env import GymnasiumVecEnv
from polite.rewards.network import RewardNetConfig
from polite.rewards.trainer import RewardTrainingConfig
from polite.segments import cut_segments
from polite.teachers.bpref import BPREF_TEACHERS, BPrefTeacher
from polite.teachers.oracle import Oracle
from polite.types import EQUAL, UNRELATED, Segment, SegmentPool, Trajectory

ROLLOUT = 32
LOOP = LearningConfig(
    method=METHODS["preferences"],
    queries=12,
    steps=192,
    schedule=Schedule(sessions=3, interval=0.25, segment_length=4, first_epochs=2, later_epochs=1),
    net=RewardNetConfig(hidden=(4,), dropout=(0.0,)),
    training=RewardTrainingConfig(batch_size=8, learning_rate=1e-2),
    ppo=PpoConfig(num_envs=2, rollout=ROLLOUT // 2, batch_size=16, epochs=1, hidden=(4,)),
)
ORACLE = Oracle(tie_threshold=0.0, flip_probability=0.0)


def counting(count, seed):
    """Envs that pay step + action[0] / 100; most of their episodes are longer than a segment."""

    def make():
        return gym.wrappers.TimeLimit(CountingEnv(lengths=(9, 3, 7)), 20)

    env = SyncVectorEnv([make] * count, autoreset_mode=AutoresetMode.SAME_STEP)
    return GymnasiumVecEnv(env, seed)


def true_rewards(observations, actions):
    """What CountingEnv pays for actions in the observations before them."""
    return observations[..., 0] + actions[..., 0] / 100


class Listener:
    """A teacher who remembers what it was asked and what it said."""

    def __init__(self):
        self.heard = []

    def __call__(self, pool, queries, rng):
        answers = ORACLE.answer_queries(pool, queries, rng)
        self.heard.append((pool, queries, answers))
        return answers


@pytest.fixture(scope="module")
def sessions():
    """What the teacher of a whole loop was asked, session by session."""
    teacher = Listener()
    learn(counting, lambda pool: teacher, LOOP, seed=0)
    assert len(teacher.heard) == 3
    return teacher.heard


def test_labels_come_from_the_true_reward_at_every_session(sessions):
    """imitation labelled by the reward that it had learned itself (its pull request 336)."""
    for pool, queries, answers in sessions:
        returns = np.where(pool.mask, true_rewards(pool.observations, pool.actions), 0.0).sum(1)
        for query, answer in zip(queries, answers, strict=True):
            assert answer.preferred == int(returns[query.second] > returns[query.first])


def test_state_action_and_reward_of_a_step_belong_together(sessions):
    """The POLITE release keeps s_{t+1} and lets the reward model score it as if it were s_t."""
    for pool, _, _ in sessions:
        paid = true_rewards(pool.observations, pool.actions)[pool.mask]
        np.testing.assert_allclose(paid, pool.rewards[pool.mask], rtol=1e-6)
        assert len(np.unique(pool.actions[pool.mask][:, 0])) > 10  # or nothing were shown


def test_no_segment_spans_a_reset(sessions):
    """The POLITE release cuts segments across the ends of episodes."""
    lengths = set()
    for pool, _, _ in sessions:
        for index in range(len(pool)):
            step, episode = pool[index].observations.T
            assert (np.diff(step) == 1).all() and (episode == episode[0]).all()
            lengths.add(len(step))
    assert lengths == {3, 4}  # episodes of three steps end before the segment would


@pytest.mark.parametrize("steps", [32, 100, 192, 200])
def test_no_iteration_too_many(steps):
    """imitation trains its policy once more than asked: a fifth more steps at five iterations."""
    asked = []
    learned = learn(
        counting,
        lambda pool: (
            lambda pool, queries, rng: (
                asked.append(len(queries)) or ORACLE.answer_queries(pool, queries, rng)
            )
        ),
        replace(LOOP, steps=steps),
        seed=0,
    )
    assert steps <= learned.policy_steps < steps + ROLLOUT
    assert asked == [4, 4, 4] and len(learned.feedback.queries) == LOOP.queries


@pytest.mark.parametrize(
    "teacher",
    [
        replace(BPREF_TEACHERS["equal"], epsilon_equal=0.3, average_return=1.0),
        replace(BPREF_TEACHERS["skip"], epsilon_skip=0.9, average_return=1.0),
        BPrefTeacher(epsilon_skip=0.9, epsilon_equal=0.3),
    ],
    ids=["equal", "skip", "both, of the average return"],
)
def test_thresholds_are_the_same_in_every_session(teacher):
    """B-Pref multiplies its thresholds by epsilon again after the first session."""
    returns = np.linspace(0.5, 1.5, 30)
    segments = [
        Segment(*(np.full((1, 1), r) for _ in "oa"), np.array([r]), np.zeros((1, 1)), i, 0)
        for i, r in enumerate(returns)
    ]
    history, pool = FeedbackHistory(recent_sessions=1), SegmentPool.stack(segments, 1)
    for _ in range(4):
        history.add_segments(pool)
        history.ask(100, teacher.answer_queries, np.random.default_rng(0))  # the same pairs
    said = [answer.preference for answer in history.feedback.answers]
    undecided = [
        sum(preference in (EQUAL, UNRELATED) for preference in said[start : start + 100])
        for start in range(0, 400, 100)
    ]
    assert len(set(undecided)) == 1 and 10 < undecided[0] < 90


def test_a_pool_owns_its_memory():
    """imitation's fragments are views that keep their whole trajectories alive."""
    values = np.arange(500.0)
    episode = Trajectory(values[:, None], values[:, None], values, values[:, None], False)
    arrays = [weakref.ref(array) for array in (episode.observations, episode.actions)]
    pool = cut_segments([episode], 5, 3, np.random.default_rng(0))
    assert pool.observations.base is None and pool.actions.base is None
    del episode
    gc.collect()
    assert [array() for array in arrays] == [None, None]


def test_the_loop_keeps_no_trajectory(monkeypatch):
    """imitation's memory grows with every trajectory that a fragment was ever taken from."""
    collected = []

    def collect(*args):
        trajectories = preference_learning_collect(*args)
        collected.extend(weakref.ref(trajectory) for trajectory in trajectories)
        return trajectories

    preference_learning_collect = preference_learning.collect
    monkeypatch.setattr(preference_learning, "collect", collect)
    alive = []

    def teacher(pool, queries, rng):
        gc.collect()
        alive.append(sum(trajectory() is not None for trajectory in collected))
        return ORACLE.answer_queries(pool, queries, rng)

    learn(counting, lambda pool: teacher, LOOP, seed=0)
    assert len(collected) > 10 and alive == [0, 0, 0]
