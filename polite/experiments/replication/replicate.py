"""The user-study replication, from the corridor to the report."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from polite.experiments.replication.clips import draw_example
from polite.experiments.replication.config import as_dict, preset
from polite.experiments.replication.people import read_people
from polite.experiments.replication.results import assemble
from polite.experiments.replication.rewards import train_reward_models
from polite.experiments.replication.sensitivity import LEVELS, sensitivity
from polite.experiments.replication.stages import ask_participants, train_clip_policy, train_policy
from polite.experiments.replication.study import Study
from polite.experiments.run_folder import sole_run
from polite.experiments.runner import Runner, Task, make_progress
from polite.files import write_json
from polite.report.page import write_report


def replicate(
    preset_name: str, seed: int, out: Path, *, resume: bool = False, answers: Path | None = None
) -> Path:
    """Run the study, with simulated participants or on people's answers, into a folder.

    Args:
        preset_name: "smoke", "fast" or "paper".
        seed: Everything random follows from it.
        out: The folder; `results.json`, `report.html`, `figures/`, `clips/`, `data/`, `models/`.
        resume: Go on in a folder that was begun with the same preset and seed. Finished stages
            are not repeated; the result is that of an uninterrupted run.
        answers: Folder of an export of the web study; its answers, pairs and clips take the place
            of simulated ones, and the folder of the run can be gone on with only by the same.

    Returns:
        The path of the report.

    Raises:
        PoliteError: The preset is unknown, the answers cannot be used, or the folder is in use by
            something else.
    """
    config, people = preset(preset_name), None
    run: dict[str, Any] = {"preset": preset_name, "seed": seed}
    if answers is not None:
        people = read_people(answers, config)
        config = people.configure(config)
        run["answers"] = people.checksum
    study = Study(out, config, seed, people)
    run["config"] = as_dict(config)
    with sole_run(out, run, resume), make_progress() as progress:
        with Runner(out, progress) as runner:
            stages = _run_stages(study, runner)
        bar = progress.add_task("putting the numbers together", total=None)
        results = assemble(study, preset_name, stages)
        results["example"] = draw_example(study)
        write_json(out / "results.json", results)
        progress.update(bar, description="drawing figures and report", total=1.0)
        report = write_report(out)
        progress.update(bar, completed=1.0)
    return report


def _run_stages(study: Study, runner: Runner) -> dict[str, Any]:
    """Run what is not done yet, as parallel as the stages depend on each other."""
    seeds = range(study.config.seeds)
    clips, *ceiling = runner.run(
        [Task("clips", "clip-making policy", partial(train_clip_policy, study))]
        + [_policy_task(study, "ground_truth", k) for k in seeds]
    )
    asked, *_ = runner.run(
        [Task("study", "clips, participants, answers", partial(ask_participants, study))]
    )
    rewards = runner.run([_reward_task(study, k) for k in seeds])
    polite = [_policy_task(study, "polite", k) for k in seeds]
    baseline = [_policy_task(study, "baseline", k) for k in seeds]
    changes = _sensitivity_tasks(study)
    last = iter(runner.run(polite + baseline + changes))
    policies = {name: [next(last) for _ in seeds] for name in ("polite", "baseline")}
    return {
        "clips": clips,
        "study": asked,
        "rewards": rewards,
        "policies": policies | {"ground_truth": ceiling},
        "sensitivity": list(last),
    }


def _reward_task(study: Study, k: int) -> Task:
    """Train the reward models of one training run."""
    says = f"reward models, run {k + 1} of {study.config.seeds}"
    return Task(f"rewards-{k}", says, partial(train_reward_models, study, k))


def _policy_task(study: Study, name: str, k: int) -> Task:
    """Train and judge one policy."""
    says = f"policy on {_CALLED[name]}, run {k + 1} of {study.config.seeds}"
    return Task(f"policy-{name}-{k}", says, partial(train_policy, study, name, k))


_CALLED = {
    "polite": "POLITE's reward",
    "baseline": "the baseline's reward",
    "ground_truth": "the true reward",
}


def _sensitivity_tasks(study: Study) -> list[Task]:
    """One task for each level of the sensitivity analysis, and one at equal effort."""
    if not study.config.sensitivity_seeds:
        return []
    count = len(LEVELS) + 1
    return [
        Task(
            f"sensitivity-{level}",
            f"sensitivity, {level + 1} of {count}",
            partial(sensitivity, study, level),
        )
        for level in range(count)
    ]
