"""Do the conclusions stand when the simulated participants are other people?"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from polite.analysis.quality import sensitivity_row
from polite.dataset import Feedback
from polite.experiments.runner import Report
from polite.experiments.study_stages import (
    CONDITIONS,
    Study,
    ask,
    draw_queries,
    fit,
    held_out_pairs,
    judge_reward,
)
from polite.experiments.study_world import derive
from polite.rewards.network import FAST
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
EQUAL_EFFORT = 1.31
"""A highlighted answer takes 31% longer, so the baseline may answer as many more."""


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
    pairs = held_out_pairs(study, study.feedback("held_out").pool)
    seeds = study.config.sensitivity_seeds
    rows = []
    for k in range(seeds):
        rows.append(_one_draw(small, level, k, change, pairs, more=equal_effort))
        report((k + 1) / seeds)
    accuracy, correlation = (
        {name: [row[name][key] for row in rows] for name in CONDITIONS}
        for key in ("pair_accuracy", "correlation")
    )
    return sensitivity_row(factor, label, accuracy, correlation)


def _one_draw(
    study: Study, level: int, k: int, change: Change, pairs: Any, *, more: bool
) -> dict[str, Any]:
    """New participants in both groups, new reward models; their quality on held-out segments."""
    held_out = study.feedback("held_out").pool
    quality = {}
    for name, population in CONDITIONS.items():
        given = study.feedback(name)
        seed = derive(study.seed, "sensitivity", level, k, name)
        changed: PopulationConfig = replace(population, **change)  # type: ignore[arg-type]
        answers = ask(study.config, changed, given.pool, given.queries, seed)
        queries = list(given.queries)
        if more and name == "baseline":
            fresh = draw_queries(study.config, given.pool, seed)
            extra = ask(study.config, changed, given.pool, fresh, seed + 1)
            count = round((EQUAL_EFFORT - 1.0) * len(answers))
            answers += [replace(a, query=a.query + len(queries)) for a in extra[:count]]
            queries += fresh[:count]
        feedback = Feedback(given.pool, queries, answers)
        net = fit(study, feedback, answers, k, highlights=name == "polite")
        quality[name] = judge_reward(net, held_out, pairs)
    return quality
