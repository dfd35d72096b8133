"""One trial of the offline bench: ask, train, judge."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import torch
from scipy.special import expit

from polite.analysis.quality import calibration_error, reward_quality
from polite.dataset import Feedback
from polite.experiments.offline.candidates import Candidate
from polite.experiments.offline.marks import hide_marked, joined
from polite.methods.presets import EnvPreset
from polite.rewards.data import PreferenceData, stack_feedback
from polite.rewards.model import make_model, train_model
from polite.rewards.network import RewardModel, predict
from polite.samplers import uniform_pairs
from polite.teachers.highlights import shuffle_highlights
from polite.teachers.noise import perturb_highlights
from polite.types import Answer, Query, SegmentPool

PAIRS = 2000
"""Held-out pairs on which r̂ is judged."""
JUDGED = ("early", "late")
"""The held-out pools."""

Measures = dict[str, dict[str, float | None]]


def run_trial(
    candidate: Candidate,
    preset: EnvPreset,
    pools: Mapping[str, SegmentPool],
    queries: int,
    seed: int,
) -> Measures:
    """Ask a budget of queries, train one candidate's reward model, judge it on held-out segments.

    All candidates of a seed are asked the same pairs and begin with the same weights, so that they
    can be compared seed by seed.

    Args:
        candidate: what is tried.
        preset: of the env.
        pools: by their names in `offline.pools.POOLS`.
        queries: the budget.
        seed: everything random follows from it.

    Returns:
        Measures on each held-out pool, and under "answers" the shares of answers with a highlight.
    """
    pool = pools["asked"]
    pairs, teacher, marks = (np.random.default_rng([seed, k]) for k in range(3))
    asked = uniform_pairs(queries, pairs, pool)
    preset = replace(preset, marks_unusual=candidate.unusual)
    answers = ask(candidate, preset, pool, asked, teacher, marks)
    generator = torch.Generator().manual_seed(seed)
    sizes = pool.observations.shape[-1], pool.actions.shape[-1]
    model = make_model(sizes, candidate.net, candidate.members, generator)
    model.standardise(pool)
    data = stack_answers(pool, asked, answers)
    if candidate.alone:
        data = data.without_preferences()
    train_model(model, data, candidate.training(preset), generator)
    measures: Measures = {name: judge_model(model, pools[name]) for name in JUDGED}
    return measures | {"answers": _shares(answers[0], used=candidate.form is not None)}


def ask(
    candidate: Candidate,
    preset: EnvPreset,
    pool: SegmentPool,
    asked: list[Query],
    teacher: np.random.Generator,
    marks: np.random.Generator,
) -> list[list[Answer]]:
    """The answers, and for each further window of the candidate the same with the next moments."""
    answer_queries = preset.make_teacher(pool)
    seen, rounds = pool, list[list[Answer]]()
    state = teacher.bit_generator.state
    for _ in range(candidate.windows):
        teacher.bit_generator.state = state  # the same mistakes
        answers = answer_queries(seen, asked, teacher)
        if rounds:
            answers = _relabel(answers, rounds[0])
        rounds.append(answers)
        seen = hide_marked(seen, asked, answers)
    if candidate.shuffled:
        return [shuffle_highlights(answers, pool, asked, marks) for answers in rounds]
    return [perturb_highlights(a, pool, asked, candidate.noise, marks) for a in rounds]


def stack_answers(
    pool: SegmentPool, asked: list[Query], rounds: list[list[Answer]]
) -> PreferenceData:
    """For training: every preference counts once, every highlight counts."""
    first, *others = (stack_feedback(Feedback(pool, asked, answers)) for answers in rounds)
    return joined([first, *(data.without_preferences() for data in others)])


def judge_model(model: RewardModel, pool: SegmentPool) -> dict[str, float | None]:
    """How well r̂ orders, and how well it predicts, what it was not trained on."""
    learned = predict(model, pool.observations, pool.actions).astype(np.float64)
    pairs = np.array(
        [(q.first, q.second) for q in uniform_pairs(PAIRS, np.random.default_rng(0), pool)]
    )
    returns = np.where(pool.mask, learned, 0.0).sum(axis=1)
    gaps, truth = (values[pairs[:, 0]] - values[pairs[:, 1]] for values in (returns, pool.returns))
    error = calibration_error(expit(gaps), (np.sign(truth) + 1) / 2)
    return reward_quality(learned, pool, pairs) | {"calibration_error": error}


def _relabel(answers: list[Answer], first: list[Answer]) -> list[Answer]:
    """Further moments, but only of the segments that the first answers prefer."""
    return [
        replace(answer, positive=None, negative=None)
        if answer.preference != kept.preference
        else answer
        for answer, kept in zip(answers, first, strict=True)
    ]


def _shares(answers: list[Answer], *, used: bool) -> dict[str, float | None]:
    """Shares of the expressed preferences that carry each highlight; None if none is used."""
    expressed = [answer for answer in answers if answer.preferred is not None]
    marks = {
        "positive": [answer.positive is not None for answer in expressed],
        "negative": [answer.negative is not None for answer in expressed],
    }
    return {sign: float(np.mean(given)) if used else None for sign, given in marks.items()}
