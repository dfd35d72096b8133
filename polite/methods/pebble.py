"""PEBBLE: SAC, an ensemble of reward models, and a replay that is relabelled.

Lee, Smith, Abbeel: PEBBLE, Feedback-Efficient Interactive Reinforcement Learning via Relabeling
Experience and Unsupervised Pre-training, ICML 2021; details after its release, B-Pref. The policy
first gathers new states; then the teacher is asked, again and again, about segments of what the
policy has done, and after each session every stored reward is written anew.

Unlike B-Pref: the reward models see inputs standardised on the first session's segments, their
optimiser begins anew at each session, the novelty of a state is a logarithm (as in the paper), and
the env is reset at each session, so that a training can go on from there; the episode that is cut
off by it is not in the curve.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polite.dataset import Feedback
from polite.methods.asking import joined_feedback, only_asked
from polite.methods.checkpoint import (
    load_checkpoint,
    pack_feedback,
    pack_generator,
    pack_pool,
    pack_trajectories,
    save_checkpoint,
    set_generator,
    unpack_feedback,
    unpack_pool,
    unpack_trajectories,
)
from polite.methods.config import Session
from polite.methods.history import Teacher
from polite.methods.novelty import StateEntropy
from polite.methods.pairs import PairRequest, ask_uniformly, check_pairs
from polite.methods.pebble_config import PebbleConfig
from polite.methods.preference_learning import (
    Follow,
    Learned,
    MakeEnv,
    MakeTeacher,
    Report,
)
from polite.methods.setup import independent_seeds, torch_generator, vector_sizes
from polite.policies.policy import Policy, pack_policy, unpack_policy
from polite.policies.sac import SacTrainer
from polite.rewards.data import stack_feedback
from polite.rewards.ensemble import RewardEnsemble, train_ensemble
from polite.rewards.network import RewardNet, predict
from polite.segments import cut_segments
from polite.types import Floats32, SegmentPool, Trajectory


def learn_pebble(
    make_env: MakeEnv,
    make_teacher: MakeTeacher,
    config: PebbleConfig,
    seed: int,
    report: Report = lambda says, share: None,
    checkpoint: Path | None = None,
    follow: Follow = lambda episodes: None,
) -> Learned:
    """Train a policy by PEBBLE.

    Envs are made anew after every feedback session. So a training that goes on from a checkpoint
    ends with the same numbers as one that was never stopped, if the teacher's answers follow from
    its arguments.

    Args:
        make_env: makes the envs.
        make_teacher: chooses the teacher once the first segments are there.
        config: the settings.
        seed: everything random follows from it. The global generators of PyTorch and NumPy are
            used: run one training per process at a time.
        report: told how far it is.
        checkpoint: a file, written after each session. If it is there, the training goes on from
            it. Whoever keeps the result removes it.
        follow: given the finished episodes now and then.

    Raises:
        PoliteError: if the env's observations or actions are no vectors, the actions have no
            bounds, or the checkpoint is damaged or belongs to another training.
        NotFiniteError: if the env gives NaN or infinity.
    """
    learner = _Learner(make_env, make_teacher, config, seed, report, follow)
    identity = f"seed {seed}, {config}"  # of env and teacher the caller has to take care
    if checkpoint is not None and (content := load_checkpoint(checkpoint, identity)):
        learner.load_state(content)
    while learner.sessions_left:
        learner.train_policy(learner.sessions_left[0].at)
        learner.hold(learner.sessions_left[0])
        if checkpoint is not None:
            save_checkpoint(checkpoint, identity, learner.state())
    learner.train_policy(config.steps)
    return learner.result()


class _Learner:
    """One run: policy, reward models and feedback as they grow."""

    def __init__(
        self,
        make_env: MakeEnv,
        make_teacher: MakeTeacher,
        config: PebbleConfig,
        seed: int,
        report: Report,
        follow: Follow,
    ) -> None:
        self._env_seed, policy, weights, batches, samples, answers = independent_seeds(seed, 6)
        self._make_env, self._make_teacher = make_env, make_teacher
        self._config, self._report, self._follow = config, report, follow
        env = make_env(config.sac.num_envs, 0)
        try:
            sizes, source = vector_sizes(env), torch_generator(weights)
            self._ensemble = RewardEnsemble(
                [RewardNet(*sizes, config.net, source) for _ in range(config.members)]
            )
            reward = None if config.method.true_reward else self._score
            self._trainer = SacTrainer(env, config.sac, policy, config.steps, reward)
        finally:
            env.close()
        if config.method.asks:
            self._trainer.pay(StateEntropy(config.schedule.neighbours))
        self._batches = torch_generator(batches)
        self._samples = np.random.default_rng(samples)
        self._answers = np.random.default_rng(answers)
        self._recent: list[Trajectory] = []
        self._first_pool: SegmentPool | None = None
        self._teacher: Teacher | None = None
        self._feedback: Feedback | None = None
        self._held: list[int] = []
        self._session_policy: Policy | None = None

    @property
    def sessions_left(self) -> list[Session]:
        """The sessions that have not been held."""
        config = self._config
        if not config.method.asks:
            return []
        plan = config.schedule.plan(config.queries, config.steps, config.first_session)
        return plan[len(self._held) :]

    @property
    def _session(self) -> str:
        """The session that is held, in words."""
        number = len(self._held) + 1
        return f"session {number} of {number - 1 + len(self.sessions_left)}"

    def train_policy(self, until: int) -> None:
        """Train the policy in new envs until so many steps are done."""
        self._note_steps(self._trainer.steps)
        asks_again = bool(self.sessions_left)
        seed = int(np.random.SeedSequence([self._env_seed, len(self._held)]).generate_state(1)[0])
        env = self._make_env(self._config.sac.num_envs, seed >> 1)
        try:
            new = self._trainer.train(env, until, self._note_steps, record=asks_again)
        finally:
            env.close()
        self._recent = last_steps([*self._recent, *new], self._config.schedule.recent_steps)

    def hold(self, session: Session) -> None:
        """Ask the teacher, train the reward models on all answers so far, pay by them."""
        self._session_policy = self._trainer.policy()
        self._ask(session.queries)
        self._train_reward()
        self._says(f"{self._session}: relabelling the replay")
        self._trainer.relabel()
        if not self._held:  # until now the policy was paid for new states
            self._trainer.pay(None)
            self._trainer.reset_critics(self._config.schedule.critic_updates)
        self._held.append(self._trainer.steps)

    def _ask(self, count: int) -> None:
        """Choose pairs of segments of what the policy did, and keep the teacher's answers."""
        self._says(f"{self._session}: asking the teacher")
        schedule = self._config.schedule
        wanted = count * schedule.segments_per_query
        pool = cut_segments(self._recent, schedule.segment_length, wanted, self._samples)
        if self._first_pool is None:
            self._first_pool = pool
            self._ensemble.standardise(pool)
        sampler = self._config.sampler if self._held else ask_uniformly
        request = PairRequest(pool, [], count, self._samples)
        pairs = check_pairs(sampler(request, self._ensemble), request)
        asked, queries = only_asked(pool, pairs)
        if self._teacher is None:
            self._teacher = self._make_teacher(self._first_pool)
        answers = self._teacher(asked, queries, self._answers)
        self._feedback = joined_feedback(self._feedback, Feedback(asked, queries, answers))

    def _train_reward(self) -> None:
        """Train the reward models on, from where they are."""
        feedback, config = self._feedback, self._config
        assert feedback is not None
        training, data = config.training, stack_feedback(feedback)
        if not config.method.highlights:
            training = training.without_highlights()
        if not config.method.preferences:
            data = data.without_preferences()
        train_ensemble(
            self._ensemble,
            data,
            training,
            self._batches,
            lambda epoch, _: self._says(
                f"{self._session}: reward models, epoch {epoch} of {training.epochs}"
            ),
        )

    def result(self) -> Learned:
        """What the training leaves behind."""
        return Learned(
            policy=self._trainer.policy(),
            reward=self._ensemble if self._config.method.asks else None,
            feedback=self._feedback,
            episodes=self._trainer.episodes,
            sessions=self._held,
            policy_steps=self._trainer.steps,
            collection_steps=0,
            session_policy=self._session_policy,
        )

    def state(self) -> dict[str, Any]:
        """All that the rest of the training depends on, just after a session."""
        assert self._feedback is not None
        assert self._first_pool is not None
        assert self._session_policy is not None
        return {
            "trainer": self._trainer.state(),
            "ensemble": self._ensemble.state_dict(),
            "recent": pack_trajectories(self._recent),
            "first_pool": pack_pool(self._first_pool),
            "feedback": pack_feedback(self._feedback),
            "held": self._held,
            "session_policy": pack_policy(self._session_policy),
            "batches": self._batches.get_state(),
            "samples": pack_generator(self._samples),
            "answers": pack_generator(self._answers),
        }

    def load_state(self, content: dict[str, Any]) -> None:
        """Go on just after the session at which `state` was called."""
        self._trainer.load_state(content["trainer"])
        self._trainer.pay(None)
        self._ensemble.load_state_dict(content["ensemble"])
        self._recent = unpack_trajectories(content["recent"])
        self._first_pool = unpack_pool(content["first_pool"])
        self._feedback = unpack_feedback(content["feedback"])
        self._held = list(content["held"])
        self._session_policy = unpack_policy(content["session_policy"])
        self._batches.set_state(content["batches"])
        set_generator(self._samples, content["samples"])
        set_generator(self._answers, content["answers"])

    def _note_steps(self, steps: int) -> None:
        exploring = self._config.method.asks and not self._held
        self._says("gathering new states" if exploring else "training the policy")
        self._follow(self._trainer.episodes)

    def _says(self, what: str) -> None:
        self._report(what, min(1.0, self._trainer.steps / self._config.steps))

    def _score(self, observations: NDArray[Any], actions: NDArray[Any]) -> Floats32:
        """The reward models as they are now."""
        return predict(self._ensemble, observations, actions)


def last_steps(trajectories: Sequence[Trajectory], steps: int) -> list[Trajectory]:
    """The last in the list, env by env: as few as have so many steps together, or all."""
    kept, total = list[Trajectory](), 0
    for trajectory in reversed(trajectories):
        if total >= steps:
            break
        kept.append(trajectory)
        total += len(trajectory)
    return kept[::-1]
