"""Do the conclusions stand when the simulated participants are other people?"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polite.analysis.quality import sensitivity_row
from polite.analysis.reward_map import profile, spread
from polite.dataset import Feedback
from polite.experiments.replication.rewards import fit, held_out_pairs, judge_reward
from polite.experiments.replication.stages import ask, draw_queries
from polite.experiments.replication.study import CONDITIONS, Study
from polite.experiments.replication.world import MapStates, derive
from polite.experiments.runner import Report
from polite.rewards.network import FAST, predict
from polite.teachers.participants import PopulationConfig

Change = dict[str, float]

LEVELS: tuple[tuple[str, str, Change], ...] = (
    ("as calibrated", "-", {}),
    ("willingness to highlight", "half", {"positive_rate": 0.32, "negative_rate": 0.24}),
    ("willingness to highlight", "nearly always", {"positive_rate": 0.95, "negative_rate": 0.71}),
    ("attention slips", "none to speak of", {"slip_rate": 0.005}),
    ("attention slips", "four times", {"slip_rate": 0.2}),
    ("rationality", "half", {"rationality": 2.0}),
    ("rationality", "double", {"rationality": 8.0}),
)
"""What is changed in both groups, to what, and the fields of PopulationConfig."""
EQUAL_EFFORT = 1.3117
"""A highlighted answer takes 31.17% longer, so the baseline may have 525 answers for POLITE's 400;
further participants give them, on further pairs."""


def sensitivity(study: Study, level: int, report: Report) -> dict[str, Any]:
    """Draw new participants with one input changed, and train both reward models on each draw.

    Each of the config's `sensitivity_seeds` draws its own participants, so that the interval
    covers their chance as well. The small reward network is used, whatever the study's is.

    Args:
        study: The run.
        level: Index into LEVELS; one past the end is the comparison at equal effort.
        report: Told how far it is.
    """
    equal_effort = level == len(LEVELS)
    factor, label, change = (
        ("effort", "baseline with 31% more answers", {}) if equal_effort else LEVELS[level]
    )
    small = replace(study, config=replace(study.config, reward_net=FAST))
    states = MapStates.load(study.arrays_path("map_states"))
    given = {name: study.feedback(name) for name in CONDITIONS}
    held_out = study.feedback("held_out").pool
    pairs = held_out_pairs(study, held_out)
    seeds = study.config.sensitivity_seeds
    quality: dict[str, list[Any]] = {name: [] for name in CONDITIONS}
    spreads: dict[str, list[float]] = {name: [] for name in CONDITIONS}
    for k in range(seeds):
        for name in CONDITIONS:
            seed = derive(study.seed, "sensitivity", level, k, name)
            more = equal_effort and name == "baseline"
            feedback = _new_answers(small, given[name], name, change, seed, more=more)
            net = fit(small, feedback, feedback.answers, k, highlights=name == "polite")
            quality[name].append(judge_reward(net, held_out, pairs))
            rewards = predict(net, states.observations, states.actions)
            spreads[name].append(_spread_over_z(states, rewards.astype(np.float64)))
        report((k + 1) / seeds)
    accuracy, correlation = (
        {name: [row[key] for row in rows] for name, rows in quality.items()}
        for key in ("pair_accuracy", "correlation")
    )
    ratio = [b / p for p, b in zip(spreads["polite"], spreads["baseline"], strict=True)]
    return sensitivity_row(factor, label, accuracy, correlation, ratio)


def _new_answers(
    study: Study, given: Feedback, name: str, change: Change, seed: int, *, more: bool
) -> Feedback:
    """What new participants say to the study's pairs, and to further ones if `more` is wanted."""
    population: PopulationConfig = replace(CONDITIONS[name], **change)  # type: ignore[arg-type]
    queries = list(given.queries)
    answers = ask(study.config, population, given.pool, queries, seed)
    if more:
        fresh = draw_queries(study.config, given.pool, seed)
        extra = ask(study.config, population, given.pool, fresh, seed + 1)
        count = round((EQUAL_EFFORT - 1.0) * len(answers))
        answers += [replace(a, query=a.query + len(queries)) for a in extra[:count]]
        queries += fresh[:count]
    return Feedback(given.pool, queries, answers)


def _spread_over_z(states: MapStates, rewards: NDArray[np.float64]) -> float:
    """How much the mean reward varies along the corridor, metre by metre."""
    curve = profile(states.z, rewards[None], np.arange(-15.0, 16.0)).mean
    return float(spread(curve))
