"""From the stages' results to the numbers of `results.json`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polite.analysis.answers import chi_square_part, times_part
from polite.analysis.claims import judge
from polite.analysis.divergence import kl_part
from polite.analysis.published import PUBLISHED
from polite.analysis.quality import policy_difference_part
from polite.analysis.reward_map import map_2d_part, profile, reward_map_part
from polite.experiments.replication.config import as_dict
from polite.experiments.replication.people import People
from polite.experiments.replication.study import CONDITIONS, MODELS, POLICIES, Study, load_arrays
from polite.experiments.replication.world import (
    FLOOR_X,
    FLOOR_Z,
    MapStates,
    derive,
    floor_plan,
    scene_of,
)
from polite.policies.policy import load_policy
from polite.teachers.participants import calibrated_inputs, total_minutes
from polite.types import Answer
from socialnav_env import CorridorConfig

Results = dict[str, Any]
DISTANCES = np.linspace(0.0, 26.0, 27)
"""Bins of the distance to a goal [m]."""
OFFSETS = np.linspace(-5.0, 5.0, 41)
"""Bins of the signed distance along z to a person or a goal [m]."""


def assemble(study: Study, preset: str, stages: Results) -> Results:
    """All of `results.json`.

    Args:
        study: The run, with its stages' files on disk.
        preset: Its preset's name.
        stages: The stages' results: `clips`, `study`, `rewards` (per seed), `policies`
            (per condition and seed), `sensitivity`.
    """
    config = study.config
    results: Results = {
        "version": _version(),
        "preset": preset,
        "config": _settings(study),
        "seed": study.seed,
        "seeds": list(range(config.seeds)),
        "simulated": study.people is None or study.people.robots,
        "published": PUBLISHED,
        "scene": scene_of(config.anchor_jitter),
        "clip_policy": _clip_policy(stages),
        "sensitivity": stages["sensitivity"],
        "reward_quality": {
            name: {key: [row[name][key] for row in stages["rewards"]] for key in _QUALITY}
            for name in MODELS
        },
    }
    results |= _answers(study) | _maps(study) | _policies(study, stages["policies"])
    if study.people is not None:
        results["people"] = _people(study, study.people)
    results["claims"] = judge(results)
    return results


_QUALITY = ("pair_accuracy", "correlation")


def _version() -> str:
    """The installed version of this project."""
    try:
        return version("socialnav-polite")
    except PackageNotFoundError:
        return "not installed"


def _clip_policy(stages: Results) -> Results:
    """How far the clip-making policy was trained, and what its clips show."""
    clips: Results = stages["clips"]
    shown: Results = stages["study"]
    why = (
        f"stopped at {clips['steps']:,} steps, where it reaches the end goal in "
        f"{clips['success_rate']:.0%} of episodes, the intermittent one in "
        f"{clips['intermittent_rate']:.0%} and collides in {clips['collision_rate']:.0%}; its "
        "clips start from places along the whole corridor, so that goals and people are shown"
    )
    return {
        "steps": clips["steps"],
        "why": why,
        "success_rate": clips["success_rate"],
        "collision_rate": clips["collision_rate"],
    } | shown


def _settings(study: Study) -> Results:
    """The config; how many would be simulated says nothing where people answered."""
    settings = as_dict(study.config)
    return {k: v for k, v in settings.items() if study.people is None or k != "participants"}


def _answers(study: Study) -> Results:
    """What the participants said, and what had been put into simulated ones."""
    answers = {name: study.feedback(name).answers for name in CONDITIONS}
    counts = {name: _count(group) for name, group in answers.items()}
    if study.people is None:
        sizes = dict.fromkeys(CONDITIONS, study.config.participants)
        minutes = {name: total_minutes(answers[name], CONDITIONS[name]) for name in CONDITIONS}
        inputs = {name: calibrated_inputs(population) for name, population in CONDITIONS.items()}
    else:
        minutes = {name: np.array(study.people.minutes[name]) for name in CONDITIONS}
        sizes = {name: len(group) for name, group in minutes.items()}
        inputs = {}
    skipped, given = (
        {name: _each(answers[name], sizes[name], test) for name in CONDITIONS}
        for test in (_no_preference, _any)
    )
    rng = np.random.default_rng(derive(study.seed, "permutation"))
    expressed = max(counts["polite"]["expressed"], 1)
    return {
        "queries": {name: len(group) for name, group in answers.items()},
        "participants": sizes,
        "calibrated": {
            f"{name}: {key}": value
            for name, group in inputs.items()
            for key, value in group.items()
        },
        "counts": counts,
        "no_preference_rate": {
            name: count["no_preference"] / count["answers"] for name, count in counts.items()
        },
        "highlight_rate": {
            sign: counts["polite"][sign] / expressed for sign in ("positive", "negative")
        },
        "chi_square": chi_square_part(
            skipped["polite"], skipped["baseline"], (given["polite"], given["baseline"]), rng
        ),
        "times": times_part(minutes["polite"], minutes["baseline"]),
    }


def _people(study: Study, people: People) -> Results:
    """Where people's answers are from, and how often each of them did what."""
    tests = {
        "answers": _any,
        "no_preference": _no_preference,
        "positive": lambda answer: answer.positive is not None,
        "negative": lambda answer: answer.negative is not None,
    }
    return {
        "title": people.title,
        "export": people.checksum,
        "per_participant": {
            name: {
                key: _each(study.feedback(name).answers, len(minutes), test).tolist()
                for key, test in tests.items()
            }
            | {"minutes": list(minutes)}
            for name, minutes in people.minutes.items()
        },
    }


def _each(
    answers: Sequence[Answer], participants: int, test: Callable[[Answer], bool]
) -> NDArray[np.float64]:
    """(participants,) how many of each one's answers pass a test."""
    who = [answer.participant for answer in answers if test(answer)]
    return np.bincount(who, minlength=participants).astype(np.float64)


def _any(_: Answer) -> bool:
    return True


def _no_preference(answer: Answer) -> bool:
    return answer.preferred is None


def _count(answers: Sequence[Answer]) -> dict[str, int]:
    """How often what was answered."""
    expressed = sum(answer.preferred is not None for answer in answers)
    return {
        "answers": len(answers),
        "expressed": expressed,
        "no_preference": len(answers) - expressed,
        "positive": sum(answer.positive is not None for answer in answers),
        "negative": sum(answer.negative is not None for answer in answers),
    }


def _maps(study: Study) -> Results:
    """Reward against place and distance, and the divergence over the epochs."""
    states, floor = MapStates.load(study.arrays_path("map_states")), floor_plan(study.config)
    runs = [load_arrays(study.arrays_path(f"rewards-{k}")) for k in range(study.config.seeds)]
    epochs = {name: np.stack([run[f"{name}_epochs"] for run in runs]) for name in MODELS}
    on_floor = {name: np.stack([run[f"{name}_floor"] for run in runs]) for name in CONDITIONS}
    final = {name: epochs[name][:, -1].astype(np.float64) for name in CONDITIONS}
    world = CorridorConfig()
    z_edges = np.linspace(-world.half_length, world.half_length, FLOOR_Z + 1)
    x_edges = np.linspace(-world.half_width, world.half_width, FLOOR_X + 1)
    offsets = {
        "person_offset": states.person_offset,
        "intermittent_offset": states.goal_offset(0),
        "goal_offset": states.goal_offset(1),
    }
    distances = {
        "goal_distance": states.goal_distance(1),
        "nearest_goal_distance": np.minimum(states.goal_distance(0), states.goal_distance(1)),
    }
    parts: Results = {
        "reward_map": {c: reward_map_part(states.z, r, z_edges) for c, r in final.items()},
        "reward_map_2d": {
            c: map_2d_part(floor.x, floor.z, r, x_edges, z_edges) for c, r in on_floor.items()
        },
    }
    for name, offset in offsets.items():
        parts[name] = {c: profile(offset, r, OFFSETS).as_json("offset") for c, r in final.items()}
    for name, distance in distances.items():
        parts[name] = {
            c: profile(distance, (r + 1.0) / 2.0, DISTANCES).as_json("distance")
            for c, r in final.items()
        }
    parts["kl"] = kl_part(
        np.arange(epochs["polite"].shape[1], dtype=np.float64),
        epochs["polite"],
        epochs["baseline"],
        epochs["null_seed"],
        epochs["null_shuffled"],
    )
    return parts


def _policies(study: Study, stages: dict[str, list[Results]]) -> Results:
    """The policies' figures, learning curves, and how far their actions differ."""
    seeds = list(range(study.config.seeds))
    rates = ("return", "success_rate", "collision_rate", "intermittent_rate")
    policy: Results = {}
    curves: Results = {}
    for name in POLICIES:
        rows = stages[name]
        policy[name] = {"seeds": seeds} | {rate: [row[rate] for row in rows] for rate in rates}
        policy[name]["metrics"] = {
            metric: [row["metrics"][metric] for row in rows] for metric in rows[0]["metrics"]
        }
        curves[name] = {
            key: [row["curve"][key] for row in rows]
            for key in ("return", "success_rate", "collision_rate")
        }
        curves[name]["steps"] = rows[0]["curve"]["steps"]
    states = MapStates.load(study.arrays_path("map_states"))
    actions = {name: _mean_actions(study, name, states) for name in CONDITIONS}
    difference = policy_difference_part(actions["polite"], actions["baseline"])
    return {"policy": policy, "curves": curves, "policy_difference": difference}


def _mean_actions(study: Study, name: str, states: MapStates) -> NDArray[np.float64]:
    """(S, M, v) the policies' most likely actions on the shared states."""
    return np.stack(
        [
            load_policy(study.policy_path(name, k)).mean_action(states.observations)
            for k in range(study.config.seeds)
        ]
    ).astype(np.float64)
