"""The replication's units of work; each is a task of its own and can be done again from disk."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from polite.analysis.numbers import as_json
from polite.analysis.quality import pair_accuracy, step_correlation
from polite.dataset import Feedback, load_feedback, save_feedback
from polite.experiments.runner import Report
from polite.experiments.study_config import StudyConfig
from polite.experiments.study_world import (
    FLAGS,
    MapStates,
    collect_along,
    collect_map_states,
    derive,
    floor_plan,
    people_of,
    study_env,
)
from polite.files import write_atomically
from polite.policies.policy import GaussianPolicy, load_policy, save_policy
from polite.policies.ppo import PpoTrainer
from polite.rewards.data import stack_feedback
from polite.rewards.network import RewardNet, load_reward_model, predict, save_reward_model
from polite.rewards.trainer import train_reward
from polite.rollouts import evaluate
from polite.segments import cut_segments, uniform_pairs
from polite.teachers.highlights import shuffle_highlights
from polite.teachers.participants import (
    BASELINE,
    POLITE,
    PopulationConfig,
    answer_queries,
    draw_population,
)
from polite.types import Answer, Query, SegmentPool
from socialnav_env import CorridorConfig
from socialnav_env.metrics import METRICS

CONDITIONS = {"polite": POLITE, "baseline": BASELINE}
MODELS = ("polite", "baseline", "null_seed", "null_shuffled")
POLICIES = ("polite", "baseline", "ground_truth")
RATES = ("success", "intermittent", "collisions")
"""Metrics that are told as rates over episodes."""
HELD_OUT_PAIRS = 2000


@dataclass(frozen=True)
class Study:
    """A run: its folder, its config and its seed."""

    folder: Path
    config: StudyConfig
    seed: int

    def model_path(self, name: str, k: int) -> Path:
        """Where the reward model of a condition and training run is kept."""
        return self.folder / "models" / f"reward-{name}-{k}.pt"

    def policy_path(self, name: str, k: int) -> Path:
        """Where the policy of a condition and training run is kept."""
        return self.folder / "models" / f"policy-{name}-{k}.pt"

    def arrays_path(self, name: str) -> Path:
        """Where a stage's arrays are kept."""
        return self.folder / "stages" / f"{name}.npz"

    def feedback(self, condition: str) -> Feedback:
        """The answers of a condition, with the pool and the pairs."""
        return load_feedback(self.folder / "data" / condition)


def save_arrays(path: Path, arrays: dict[str, NDArray[Any]]) -> None:
    """Write named arrays to one file, whole or not at all."""
    write_atomically(path, lambda temporary: np.savez_compressed(temporary, **arrays))  # type: ignore[arg-type]


def load_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Read what `save_arrays` wrote; nothing in the file can run code."""
    with np.load(path, allow_pickle=False) as arrays:
        return dict(arrays)


def train_clip_policy(study: Study, report: Report) -> dict[str, Any]:
    """Train the policy whose clips are rated, on the true reward, part of the way."""
    config = study.config
    env = study_env(config, config.ppo.num_envs, derive(study.seed, "clip", "env"))
    seed = derive(study.seed, "clip")
    trainer = PpoTrainer(env, config.ppo, seed, config.policy_steps)
    trainer.train(config.clip_steps, lambda steps: report(min(1.0, steps / config.clip_steps)))
    policy = trainer.policy()
    save_policy(study.folder / "models" / "policy-clips.pt", policy)
    return {"steps": config.clip_steps} | _judge(study, policy)


def ask_participants(study: Study, report: Report) -> dict[str, Any]:
    """Roll out the pool, draw the pairs, let both groups answer, and keep states for the maps."""
    config, seed = study.config, study.seed
    policy = load_policy(study.folder / "models" / "policy-clips.pt")
    pool = _segments(study, policy, "pool")
    queries = draw_queries(config, pool, seed)
    answers = {}
    for name, population in CONDITIONS.items():
        answers[name] = ask(config, population, pool, queries, derive(seed, "ask", name))
        save_feedback(study.folder / "data" / name, pool, queries, answers[name])
    report(0.3)
    held_out = _segments(study, policy, "held-out")
    save_feedback(study.folder / "data" / "held_out", held_out, [Query(0, 1)], [])
    report(0.6)
    rng = np.random.default_rng(derive(seed, "map"))
    states = collect_map_states(config, policy, rng)
    states.save(study.arrays_path("map_states"))
    return _content_of(pool)


def draw_queries(config: StudyConfig, pool: SegmentPool, seed: int) -> list[Query]:
    """The fixed list of pairs that both groups see."""
    count = config.participants * POLITE.answers
    return uniform_pairs(count, np.random.default_rng(derive(seed, "pairs")), pool)


def ask(
    config: StudyConfig,
    population: PopulationConfig,
    pool: SegmentPool,
    queries: list[Query],
    seed: int,
) -> list[Answer]:
    """Draw a group of simulated participants and let them answer."""
    rng = np.random.default_rng(seed)
    population = replace(population, highlight_length=config.reward_training.highlight_length)
    people = draw_population(population, config.participants, rng)
    return answer_queries(people, pool, queries, rng, population)


def train_reward_models(study: Study, k: int, report: Report) -> dict[str, Any]:
    """Train POLITE, the baseline and both null models from the same weights; score the map states.

    The null models are the baseline with its answers in another order, and POLITE with its
    highlights on other queries.

    After every epoch the models' rewards on the shared states are kept: that is what the
    divergence is computed from.
    """
    states, floor = MapStates.load(study.arrays_path("map_states")), floor_plan(study.config)
    held_out = study.feedback("held_out").pool
    pairs = held_out_pairs(study, held_out)
    arrays: dict[str, NDArray[Any]] = {}
    quality = {}
    for i, name in enumerate(MODELS):
        curve: list[NDArray[np.float32]] = []

        def keep(epoch: int, net: RewardNet, curve: list[Any] = curve, i: int = i) -> None:
            curve.append(predict(net, states.observations, states.actions))
            report((i + epoch / study.config.reward_training.epochs) / len(MODELS))

        feedback, answers = _answers_for(study, name, k)
        net = fit(
            study,
            feedback,
            answers,
            k,
            keep,
            highlights=name in ("polite", "null_shuffled"),
            order="other batches" if name == "null_seed" else "batches",
        )
        save_reward_model(study.model_path(name, k), net)
        arrays[f"{name}_epochs"] = np.stack(curve)
        arrays[f"{name}_floor"] = predict(net, floor.observations, floor.actions)
        quality[name] = judge_reward(net, held_out, pairs)
    save_arrays(study.arrays_path(f"rewards-{k}"), arrays)
    return quality


def fit(
    study: Study,
    feedback: Feedback,
    answers: list[Answer],
    k: int,
    keep: Callable[[int, RewardNet], object] | None = None,
    *,
    highlights: bool,
    order: str = "batches",
) -> RewardNet:
    """Train one reward model; training run k has the same first weights under every condition.

    Args:
        study: The run.
        feedback: Segments and pairs.
        answers: What to learn from.
        k: The training run.
        keep: Called before the first epoch, with 0, and after each.
        highlights: Whether highlights are learned from.
        order: Names the order of the batches, and the dropout.
    """
    config, pool = study.config, feedback.pool
    sizes = pool.observations.shape[-1], pool.actions.shape[-1]
    generator = torch.Generator().manual_seed(derive(study.seed, "weights", k))
    net = RewardNet(*sizes, config.reward_net, generator)
    net.standardise(pool)
    training = config.reward_training
    if not highlights:
        training = replace(training, alpha_positive=0.0, alpha_negative=0.0)
    if keep is not None:
        keep(0, net)
    data = stack_feedback(pool, feedback.queries, answers)
    generator.manual_seed(derive(study.seed, order, k))
    train_reward(net, data, training, generator, keep)
    return net


def train_policy(study: Study, name: str, k: int, report: Report) -> dict[str, Any]:
    """Train PPO on a frozen reward model, or on the true reward, and judge it by the true one."""
    config = study.config
    env = study_env(config, config.ppo.num_envs, derive(study.seed, "policy", "env", k))
    reward = None
    if name != "ground_truth":
        net = load_reward_model(study.model_path(name, k))
        reward = lambda observations, actions: predict(net, observations, actions)  # noqa: E731
    seed = derive(study.seed, "policy", k)
    trainer = PpoTrainer(env, config.ppo, seed, config.policy_steps, reward)
    trainer.train(config.policy_steps, lambda s: report(min(0.9, 0.9 * s / config.policy_steps)))
    policy = trainer.policy()
    save_policy(study.policy_path(name, k), policy)
    return {"curve": _curve(trainer.episodes)} | _judge(study, policy)


def _judge(study: Study, policy: GaussianPolicy) -> dict[str, Any]:
    """The policy's figures over evaluation episodes, under the true reward.

    They end at the end goal, so that the metrics tell of the way there and not of the waiting.
    """
    count = study.config.evaluation_episodes
    env = study_env(study.config, count, 0, terminate_on_goal=True).vector_env
    episodes = evaluate(env, policy.mean_action, derive(study.seed, "evaluation"))
    return {
        "return": float(episodes["return"].mean()),
        "success_rate": float(episodes["success"].mean()),
        "intermittent_rate": float(episodes["intermittent"].mean()),
        "collision_rate": float((episodes["collisions"] > 0).mean()),
        "metrics": {n: float(episodes[n].mean()) for n in METRICS if n not in RATES},
    }


def _curve(episodes: list[dict[str, float]]) -> dict[str, list[float]]:
    """True return, success and collisions of the episodes that ended at the same step."""
    steps = np.array([e["step"] for e in episodes])
    ends = np.unique(steps)

    def average(values: NDArray[Any]) -> list[float]:
        return [float(values[steps == end].mean()) for end in ends]

    return {
        "steps": ends.tolist(),
        "return": average(np.array([e["return"] for e in episodes])),
        "success_rate": average(np.array([e["success"] for e in episodes])),
        "collision_rate": average(np.array([e["collisions"] > 0 for e in episodes])),
    }


def _segments(study: Study, policy: GaussianPolicy, purpose: str) -> SegmentPool:
    """Roll the clip-making policy out and cut segments."""
    config = study.config
    rng = np.random.default_rng(derive(study.seed, purpose))
    trajectories = collect_along(config, policy, rng)
    return cut_segments(trajectories, config.segment_length, config.pool_segments, rng)


def _content_of(pool: SegmentPool) -> dict[str, Any]:
    """What the clips show: shares with a person near, goals being reached, and collisions."""
    world = CorridorConfig()
    near = people_of(pool.states)[1].min(axis=-1) < (
        world.robot_radius + world.human_radius + world.personal_space
    )
    flags = pool.states[..., FLAGS]
    gained = (flags[:, -1] > flags[:, 0]).mean(axis=0)
    # No other term of the reward comes near the penalty of a collision.
    collided = pool.rewards < -0.5 * world.collision_penalty
    return {
        "share_with_person": float(near.any(axis=1).mean()),
        "share_with_intermittent": float(gained[0]),
        "share_with_goal": float(gained[1]),
        "share_with_collision": float(collided.any(axis=1).mean()),
    }


def _answers_for(study: Study, name: str, k: int) -> tuple[Feedback, list[Answer]]:
    """What a model is trained on; the null model gets POLITE's highlights on other queries."""
    feedback = study.feedback("baseline" if name in ("baseline", "null_seed") else "polite")
    answers = list(feedback.answers)
    if name == "null_shuffled":
        rng = np.random.default_rng(derive(study.seed, "shuffle", k))
        answers = shuffle_highlights(answers, feedback.pool, feedback.queries, rng)
    return feedback, answers


def held_out_pairs(study: Study, pool: SegmentPool) -> NDArray[np.int64]:
    """(P, 2) held-out pairs."""
    rng = np.random.default_rng(derive(study.seed, "held-out pairs"))
    return np.array([(q.first, q.second) for q in uniform_pairs(HELD_OUT_PAIRS, rng, pool)])


def judge_reward(
    net: RewardNet, pool: SegmentPool, pairs: NDArray[np.int64]
) -> dict[str, float | None]:
    """How well a reward model orders held-out pairs and follows the true reward step by step."""
    rewards = predict(net, pool.observations, pool.actions).astype(np.float64)
    returns = np.where(pool.mask, rewards, 0.0).sum(axis=1)
    correlation = step_correlation(rewards[pool.mask], pool.rewards[pool.mask])
    return {
        "pair_accuracy": as_json(pair_accuracy(returns, pool.returns, pairs)),
        "correlation": as_json(correlation),
    }
