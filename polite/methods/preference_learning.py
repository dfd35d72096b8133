"""A policy learns from a reward model, and the reward model from a teacher, by turns.

As in POLITE's synthetic experiments (Holk, Marta, Leite, ICRA 2024, and the released code), the
same reward model is trained on after each feedback session with all answers so far, and stays as it
is after the last one. When sessions are held, about which pairs, and who answers is passed in.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polite.dataset import Feedback
from polite.methods.config import LearningConfig, Session
from polite.methods.history import FeedbackHistory, Teacher
from polite.methods.pairs import ask_uniformly
from polite.methods.setup import independent_seeds, torch_generator, vector_sizes
from polite.policies.policy import GaussianPolicy, Policy
from polite.policies.ppo import PpoTrainer
from polite.policies.vec_env import GymnasiumVecEnv
from polite.rewards.data import stack_feedback
from polite.rewards.ensemble import RewardEnsemble
from polite.rewards.model import make_model, train_model
from polite.rewards.network import RewardNet, normalise, predict, raise_by
from polite.rollouts import Act, act_randomly, collect
from polite.segments import cut_segments
from polite.types import Floats32, SegmentPool

MakeEnv = Callable[[int, int], GymnasiumVecEnv]
"""(count, seed) -> so many envs that step together."""
MakeTeacher = Callable[[SegmentPool], Teacher]
"""The first session's segments -> who answers."""
Report = Callable[[str, float], object]
"""Told what is happening, and the share of all policy steps that is done, in [0, 1]."""
Follow = Callable[[Sequence[Mapping[str, float]]], object]
"""Given the finished training episodes so far, now and then."""
LONG_EPISODE = 5_000
"""Steps; where episodes are longer, few segments do not cost a whole one."""
RANDOM_SEGMENTS = 100
"""Segments of random actions that the reward model's input statistics are those of."""


@dataclass(frozen=True, eq=False)
class Learned:
    """What a training leaves behind."""

    policy: Policy
    """The trained policy."""
    reward: RewardNet | RewardEnsemble | None
    """The reward model that paid it, or several whose mean did; None if the true reward did."""
    feedback: Feedback | None
    """Segments, queries and answers; None if nobody was asked."""
    episodes: list[dict[str, float]]
    """Finished training episodes under the true reward (`policies.episodes.EpisodeTally`)."""
    sessions: list[int]
    """Policy steps before each feedback session; a session waits for the end of a rollout."""
    policy_steps: int
    """PPO steps, in whole rollouts."""
    collection_steps: int
    """Env steps spent on collecting segments, random ones included, beside the policy steps."""
    session_policy: Policy | None = None
    """The policy as it was when segments were collected for the last time; None if never."""


def learn(
    make_env: MakeEnv,
    make_teacher: MakeTeacher,
    config: LearningConfig,
    seed: int,
    report: Report = lambda says, share: None,
    follow: Follow = lambda episodes: None,
) -> Learned:
    """Train a policy by one of the methods.

    The reward model's input statistics are fixed on `RANDOM_SEGMENTS` of random actions: at the
    start every method has the same reward model. (The first policy's own segments would not do:
    where it hardly moves, as the preset's does on HalfCheetah, what later policies do would be tens
    of their standard deviations away.)

    Args:
        make_env: makes the envs.
        make_teacher: chooses the teacher once the first segments are there.
        config: the method and its settings.
        seed: everything random follows from it.
        report: told how far it is.
        follow: given the finished episodes after each rollout.

    Raises:
        PoliteError: if the env's observations or actions are no vectors.
        NotFiniteError: if the env gives NaN or infinity.
    """
    learner = _Learner(make_env, make_teacher, config, seed, report, follow)
    try:
        return learner.run()
    finally:
        learner.close()


class _Learner:
    """One run: policy, reward model and feedback as they grow."""

    def __init__(
        self,
        make_env: MakeEnv,
        make_teacher: MakeTeacher,
        config: LearningConfig,
        seed: int,
        report: Report,
        follow: Follow,
    ) -> None:
        env, policy, weights, batches, samples, answers, inputs = independent_seeds(seed, 7)
        self._make_env, self._make_teacher = make_env, make_teacher
        self._config, self._report, self._follow = config, report, follow
        self._env = make_env(config.ppo.num_envs, env)
        sizes, generator = vector_sizes(self._env), torch_generator(weights)
        self._model = make_model(sizes, config.net, config.members, generator)
        reward = None if config.method.true_reward else self._score
        self._trainer = PpoTrainer(self._env, config.ppo, policy, config.steps, reward)
        self._batches = torch_generator(batches)
        self._samples = np.random.default_rng(samples)
        self._answers = np.random.default_rng(answers)
        self._inputs = np.random.default_rng(inputs)
        self._history = FeedbackHistory(config.schedule.recent_sessions)
        self._teacher: Teacher | None = None
        self._held: list[int] = []
        self._session_policy: GaussianPolicy | None = None
        self._done = self._collected = 0

    def run(self) -> Learned:
        """Ask and train by turns, then train the policy to the end."""
        config = self._config
        if not config.method.true_reward:
            self._fix_statistics()
        sessions = config.schedule.plan(config.queries, config.steps) if config.method.asks else []
        for number, session in enumerate(sessions, 1):
            self._train_policy(session.at)
            self._hold(session, f"session {number} of {len(sessions)}")
        self._train_policy(config.steps)
        return Learned(
            policy=self._trainer.policy(),
            reward=None if config.method.true_reward else self._model,
            feedback=self._history.feedback if config.method.asks else None,
            episodes=self._trainer.episodes,
            sessions=self._held,
            policy_steps=self._done,
            collection_steps=self._collected,
            session_policy=self._session_policy,
        )

    def close(self) -> None:
        """Close the envs."""
        self._env.close()

    def _fix_statistics(self) -> None:
        """See what the env's observations and actions are like."""
        self._says("seeing the env")
        act = act_randomly(self._env.action_space, int(self._inputs.integers(2**31)))
        pool = self._collect(RANDOM_SEGMENTS, act, self._inputs)
        self._model.standardise(pool)
        if self._config.normalise:
            self._normalise(pool)
        else:
            raise_by(self._model, self._config.reward_offset)

    def _hold(self, session: Session, name: str) -> None:
        """Collect segments, ask about them, and train the reward model on all answers so far."""
        self._says(f"{name}: collecting segments")
        policy = self._session_policy = self._trainer.policy()
        pool = self._collect(
            session.queries * self._config.schedule.segments_per_query,
            lambda observations: policy.sample(observations, self._samples),  # as it trains
            self._samples,
        )
        self._history.add_segments(pool)
        choose = self._config.sampler if self._held else ask_uniformly
        self._teacher = self._teacher or self._make_teacher(pool)
        self._held.append(self._done)
        self._history.ask(
            session.queries,
            self._teacher,
            self._answers,
            lambda request: choose(request, self._model),
        )
        self._train_reward(name)
        if self._config.normalise:
            self._normalise(self._history.pool)

    def _collect(self, count: int, act: Act, rng: np.random.Generator) -> SegmentPool:
        """Act in envs of their own, and cut segments.

        Whole episodes if they are not very long, however few the segments: they may come from the
        end of one as well as from its beginning.
        """
        length = self._config.schedule.segment_length
        steps = max(count * length, LONG_EPISODE)
        steps = min(steps, self._env.time_limit or count * length)
        env = self._make_env(ceil(count * length / steps), 0)
        try:
            trajectories = collect(env.vector_env, act, steps, int(rng.integers(2**31)))
        finally:
            env.close()
        self._collected += env.num_envs * steps
        ends = self._config.schedule.show_ends
        return cut_segments(trajectories, length, count, rng, show_ends=ends)

    def _normalise(self, pool: SegmentPool) -> None:
        """Measure level and scale of r̂ anew, and raise it from there."""
        normalise(self._model, pool)
        raise_by(self._model, self._config.reward_offset)

    def _train_reward(self, name: str) -> None:
        """Train the reward model on, from where it is."""
        method, training = self._config.method, self._config.training
        feedback = self._history.feedback
        data = stack_feedback(feedback)
        epochs = self._config.schedule.epochs(
            len(self._held), len(data), training.batch_size, self._config.steps
        )
        config = replace(training, epochs=epochs)
        if not method.highlights:
            config = config.without_highlights()
        if not method.preferences:
            data = data.without_preferences()
        train_model(
            self._model,
            data,
            config,
            self._batches,
            lambda epoch: self._says(f"{name}: reward model, epoch {epoch} of {epochs}"),
        )

    def _train_policy(self, until: int) -> None:
        """Train the policy until so many steps are done, in whole rollouts."""
        self._says("training the policy")
        if until > self._done:
            self._trainer.train(until - self._done, self._note_steps)

    def _note_steps(self, steps: int) -> None:
        self._done = steps
        self._follow(self._trainer.episodes)
        self._says("training the policy")

    def _says(self, what: str) -> None:
        self._report(what, min(1.0, self._done / self._config.steps))

    def _score(self, observations: NDArray[Any], actions: NDArray[Any]) -> Floats32:
        """The reward model as it is now."""
        return predict(self._model, observations, actions)
