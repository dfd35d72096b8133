"""The study's clips, answers and policies; each function is a task that can be done again."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polite.dataset import Feedback, save_feedback
from polite.experiments.replication.config import StudyConfig
from polite.experiments.replication.study import CONDITIONS, Study
from polite.experiments.replication.world import (
    FLAGS,
    collect_along,
    collect_map_states,
    derive,
    people_of,
    study_env,
)
from polite.experiments.runner import Report
from polite.policies.policy import Policy, load_policy, save_policy
from polite.policies.ppo import PpoTrainer
from polite.rewards.files import load_reward_model
from polite.rewards.network import predict
from polite.rollouts import evaluate
from polite.samplers import uniform_pairs
from polite.segments import cut_segments
from polite.teachers.participants import (
    POLITE,
    PopulationConfig,
    answer_queries,
    draw_population,
)
from polite.types import Answer, Query, SegmentPool
from socialnav_env import CorridorConfig
from socialnav_env.metrics import METRICS

RATES = ("success", "intermittent", "collisions")
"""Metrics that are told as rates over episodes."""


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
    """Let both groups answer, or take people's answers, and keep states for the maps."""
    config, seed = study.config, study.seed
    policy = load_policy(study.folder / "models" / "policy-clips.pt")
    pool = _simulate_answers(study, policy) if study.people is None else _take_answers(study)
    report(0.3)
    held_out = _segments(study, policy, "held-out")
    save_feedback(study.folder / "data" / "held_out", Feedback(held_out, [Query(0, 1)]))
    report(0.6)
    rng = np.random.default_rng(derive(seed, "map"))
    states = collect_map_states(config, policy, rng)
    states.save(study.arrays_path("map_states"))
    return _content_of(pool)


def _simulate_answers(study: Study, policy: Policy) -> SegmentPool:
    """Roll out the pool, draw the pairs and let simulated participants answer; returns the pool."""
    config, seed = study.config, study.seed
    pool = _segments(study, policy, "pool")
    queries = draw_queries(config, pool, seed)
    for name, population in CONDITIONS.items():
        answers = ask(config, population, pool, queries, derive(seed, "ask", name))
        save_feedback(study.folder / "data" / name, Feedback(pool, queries, answers))
    return pool


def _take_answers(study: Study) -> SegmentPool:
    """Copy the answers of an export, with its pool and pairs; returns the pool."""
    assert study.people is not None
    for name in CONDITIONS:
        given = study.people.feedback(name)
        save_feedback(study.folder / "data" / name, given)
    return given.pool


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


def train_policy(study: Study, name: str, k: int, report: Report) -> dict[str, Any]:
    """Train PPO on a frozen reward model, or on the true reward, and judge it by the true one."""
    config = study.config
    env = study_env(config, config.ppo.num_envs, derive(study.seed, "policy", "env", k))
    learned = name != "ground_truth"
    reward = partial(predict, load_reward_model(study.model_path(name, k))) if learned else None
    seed = derive(study.seed, "policy", k)
    trainer = PpoTrainer(env, config.ppo, seed, config.policy_steps, reward)
    trainer.train(config.policy_steps, lambda s: report(min(0.9, 0.9 * s / config.policy_steps)))
    policy = trainer.policy()
    save_policy(study.policy_path(name, k), policy)
    return {"curve": _curve(trainer.episodes)} | _judge(study, policy)


def _judge(study: Study, policy: Policy) -> dict[str, Any]:
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


def _segments(study: Study, policy: Policy, purpose: str) -> SegmentPool:
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
    near &= pool.mask
    flags = pool.states[..., FLAGS]
    gained = (flags[np.arange(len(pool)), pool.lengths - 1] > flags[:, 0]).mean(axis=0)
    # No other term of the reward comes near the penalty of a collision.
    collided = pool.rewards < -0.5 * world.collision_penalty
    return {
        "share_with_person": float(near.any(axis=1).mean()),
        "share_with_intermittent": float(gained[0]),
        "share_with_goal": float(gained[1]),
        "share_with_collision": float(collided.any(axis=1).mean()),
    }
