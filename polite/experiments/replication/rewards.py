"""The study's reward models: trained on what the participants said, judged on held-out clips."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from polite.analysis.numbers import as_json
from polite.analysis.quality import pair_accuracy, step_correlation
from polite.dataset import Feedback
from polite.experiments.replication.study import MODELS, Study, save_arrays
from polite.experiments.replication.world import MapStates, derive, floor_plan
from polite.experiments.runner import Report
from polite.rewards.data import stack_feedback
from polite.rewards.files import save_reward_model
from polite.rewards.network import RewardNet, predict
from polite.rewards.trainer import train_reward
from polite.samplers import uniform_pairs
from polite.teachers.highlights import shuffle_highlights
from polite.types import Answer, SegmentPool

HELD_OUT_PAIRS = 2000
"""Pairs of held-out clips on which a reward model is judged."""


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
        training = training.without_highlights()
    if keep is not None:
        keep(0, net)
    data = stack_feedback(Feedback(pool, feedback.queries, answers))
    generator.manual_seed(derive(study.seed, order, k))
    train_reward(net, data, training, generator, keep)
    return net


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
