"""The user-study replication, from the corridor to the report."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from rich.progress import Progress

from polite.experiments.runner import Task, make_progress, run_tasks
from polite.experiments.sensitivity import LEVELS, sensitivity
from polite.experiments.study_clips import draw_example
from polite.experiments.study_config import as_dict, preset
from polite.experiments.study_results import assemble
from polite.experiments.study_stages import (
    POLICIES,
    Study,
    ask_participants,
    train_clip_policy,
    train_policy,
    train_reward_models,
)
from polite.files import write_json
from polite.report.page import write_report
from polite.types import PoliteError

REWARD_WEIGHT, POLICY_WEIGHT = 1.0, 4.0
"""How long the kinds of task take, roughly, for the progress display."""


def replicate(preset_name: str, seed: int, out: Path, *, resume: bool = False) -> Path:
    """Run the study with simulated participants and write everything into a folder.

    Args:
        preset_name: "smoke", "fast" or "paper".
        seed: Everything random follows from it.
        out: The folder; `results.json`, `report.html`, `figures/`, `clips/`, `data/`, `models/`.
        resume: Go on in a folder that was begun with the same preset and seed. Finished stages
            are not repeated; the result is that of an uninterrupted run.

    Returns:
        The path of the report.

    Raises:
        PoliteError: The preset is unknown, or the folder is in use by something else.
    """
    config = preset(preset_name)
    study = Study(out, config, seed)
    claim_folder(out, {"preset": preset_name, "seed": seed, "config": as_dict(config)}, resume)
    with make_progress() as progress:
        stages = _run_stages(study, progress)
        bar = progress.add_task("putting the numbers together", total=None)
        results = assemble(study, preset_name, stages)
        results["example"] = draw_example(study)
        write_json(out / "results.json", results)
        progress.update(bar, description="drawing figures and report", total=1.0)
        report = write_report(out)
        progress.update(bar, completed=1.0)
    return report


def claim_folder(out: Path, run: dict[str, Any], resume: bool) -> None:
    """Make the folder of a run, or recognise it.

    Args:
        out: The folder.
        run: What makes the run what it is.
        resume: Whether an existing folder may be gone on with.

    Raises:
        PoliteError: The folder holds something, and is not to be gone on with or is another run's.
    """
    marker = out / "run.json"
    run = json.loads(json.dumps(run))
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        if not resume:
            raise PoliteError(f"{out} is not empty; give another --out, or --resume to go on there")
        if not marker.exists():
            raise PoliteError(f"{out} holds no run to go on with; give another --out")
        if json.loads(marker.read_text("utf-8")) != run:
            raise PoliteError(f"{out} holds a run with other settings; give another --out")
    write_json(marker, run)


def _run_stages(study: Study, progress: Progress) -> dict[str, Any]:
    """Run what is not done yet, as parallel as the stages depend on each other."""
    config = study.config
    seeds = range(config.seeds)
    share = config.clip_steps / config.policy_steps
    clips = Task(
        "clips", "clip-making policy", POLICY_WEIGHT * share, partial(train_clip_policy, study)
    )
    ceiling = [_policy_task(study, "ground_truth", k) for k in seeds]
    first, *_ = run_tasks(study.folder, [clips], progress)
    asked, *_ = run_tasks(
        study.folder,
        [Task("study", "clips, participants, answers", 0.3, partial(ask_participants, study))],
        progress,
    )
    rewards = [
        Task(
            f"rewards-{k}",
            f"reward models, run {k + 1} of {config.seeds}",
            REWARD_WEIGHT,
            partial(train_reward_models, study, k),
        )
        for k in seeds
    ]
    rewarded = run_tasks(study.folder, rewards, progress)
    policies = ceiling + [
        _policy_task(study, name, k) for name in POLICIES if name != "ground_truth" for k in seeds
    ]
    changes = [
        Task(
            f"sensitivity-{level}",
            f"sensitivity, {level + 1} of {len(LEVELS) + 1}",
            REWARD_WEIGHT,
            partial(sensitivity, study, level),
        )
        for level in (range(len(LEVELS) + 1) if config.sensitivity_seeds else ())
    ]
    last = run_tasks(study.folder, policies + changes, progress)
    trained = last[: len(policies)]
    return {
        "clips": first,
        "study": asked,
        "rewards": rewarded,
        "policies": _by_name(policies, trained),
        "sensitivity": last[len(policies) :],
    }


def _policy_task(study: Study, name: str, k: int) -> Task:
    """Train and judge one policy."""
    says = f"policy on {_CALLED[name]}, run {k + 1} of {study.config.seeds}"
    return Task(f"policy-{name}-{k}", says, POLICY_WEIGHT, partial(train_policy, study, name, k))


_CALLED = {
    "polite": "POLITE's reward",
    "baseline": "the baseline's reward",
    "ground_truth": "the true reward",
}


def _by_name(tasks: Sequence[Task], results: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Group the policies' results by condition, in the order of the seeds."""
    return {
        name: [
            result
            for task, result in zip(tasks, results, strict=True)
            if task.name.startswith(f"policy-{name}-")
        ]
        for name in POLICIES
    }
