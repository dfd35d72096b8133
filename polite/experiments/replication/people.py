"""People's answers in place of simulated ones: an export of the web study, checked before use."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from polite.dataset import Feedback, load_feedback
from polite.experiments.replication.config import StudyConfig
from polite.experiments.replication.world import ENV_ID, scene_settings
from polite.files import one_line, read_json_object, sha256
from polite.study.export_names import DATA, PARTICIPANTS_TABLE, SUMMARY, VERSION
from polite.types import PoliteError
from socialnav_env import CorridorConfig, SocialCorridorEnv

CONDITIONS: Final = ("polite", "baseline")
FEWEST: Final = 2
"""Participants that each condition needs, or there is no interval over them."""
ELSEWHERE: Final = (
    "to train a reward model on other envs' answers, see examples/people_to_reward.py"
)
FREE: Final = (
    *("anchor_jitter", "max_episode_steps", "start_z", "terminate_"),
    *("render", "camera", "overlays"),
)
"""How settings begin that change where clips come from, or how they look, and not the world."""
AGAIN: Final = "export the study again"


@dataclass(frozen=True)
class People:
    """An export whose participants' answers are analysed."""

    folder: Path
    """The export's."""
    checksum: str
    """SHA-256 of its export.json, which holds those of all other files."""
    title: str
    """The study's."""
    robots: bool
    """Whether programs answered, to try the study out."""
    highlight_length: int
    """L."""
    segment_length: int
    """m."""
    minutes: Mapping[str, tuple[float, ...]]
    """Each included participant's time from consent to the last comparison [min]."""

    def feedback(self, condition: str) -> Feedback:
        """The answers of a condition's included participants."""
        return load_feedback(self.folder / DATA / condition)

    def configure(self, config: StudyConfig) -> StudyConfig:
        """A preset with what the study's design fixes, and without what needs simulation."""
        training = replace(config.reward_training, highlight_length=self.highlight_length)
        return replace(
            config,
            segment_length=self.segment_length,
            pool_steps=max(config.pool_steps, self.segment_length),
            reward_training=training,
            sensitivity_seeds=0,
        )


def read_people(folder: Path, config: StudyConfig) -> People:
    """Read an export and check that the replication can be run on it.

    Args:
        folder: The export's.
        config: The preset.

    Raises:
        PoliteError: The export is not whole, of another version or env, or has too few answers.
    """
    summary = read_json_object(folder / SUMMARY, AGAIN)
    try:
        _check_summary(folder, summary)
        _check_world(summary, config)
        people = People(
            folder=folder.resolve(),
            checksum=sha256(folder / SUMMARY),
            title=str(summary["title"]),
            robots=bool(summary["simulated"]),
            highlight_length=int(summary["highlight_length"]),
            segment_length=int(summary["segment_length"]),
            minutes=_minutes(folder / PARTICIPANTS_TABLE),
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        if isinstance(error, PoliteError):
            raise
        raise PoliteError(f"{folder}: not an export of a study ({one_line(error)})") from error
    for condition in CONDITIONS:
        _check_answers(people, condition)
    return people


def _check_summary(folder: Path, summary: Mapping[str, Any]) -> None:
    """Version and checksums.

    Raises:
        PoliteError: if one is not as expected.
    """
    if summary.get("version") != VERSION:
        raise PoliteError(
            f"{folder / SUMMARY}: expected version {VERSION}, got {summary.get('version')!r}; "
            f"{AGAIN}"
        )
    for name, expected in summary["sha256"].items():
        path = folder / name
        seen = sha256(path) if path.is_file() else "no file"
        if seen != expected:
            raise PoliteError(
                f"{path}: altered since the export: expected SHA-256 {expected}, got {seen}; "
                f"{AGAIN}"
            )


def _check_world(summary: Mapping[str, Any], config: StudyConfig) -> None:
    """Whether the clips show the corridor that the policies are trained in.

    Raises:
        PoliteError: if not.
    """
    env = summary["env"]
    if env.rpartition(":")[2] != ENV_ID:  # a module that registers it may stand before it
        raise PoliteError(
            f"expected answers about {ENV_ID}, which the study's maps and policies need, got "
            f"{env}; {ELSEWHERE}"
        )
    ours = asdict(CorridorConfig()) | {"scenario": "paper"} | scene_settings(config)
    for name, value in summary["env_settings"].items():
        expected = ours.get(name)
        if not name.startswith(FREE) and value != expected:
            raise PoliteError(
                f"expected answers about the study's corridor with {name} = {expected!r}, got "
                f"{value!r}; {ELSEWHERE}"
            )


def _minutes(path: Path) -> dict[str, tuple[float, ...]]:
    """Minutes of each included participant, in the order of the learner's numbers."""
    found: dict[str, dict[int, float]] = {condition: {} for condition in CONDITIONS}
    with path.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            if row["learner_participant"]:
                minutes = float(row["minutes_tasks"])
                found[row["condition"]][int(row["learner_participant"])] = minutes
    return {name: tuple(group[i] for i in range(len(group))) for name, group in found.items()}


def _check_answers(people: People, condition: str) -> None:
    """Whether there is enough to analyse, from the corridor that the policies are trained in.

    Raises:
        PoliteError: if not.
    """
    count, feedback = len(people.minutes[condition]), people.feedback(condition)
    if count < FEWEST:
        raise PoliteError(
            f"{people.folder}: expected at least {FEWEST} participants in each condition who "
            f"finished and are not excluded, got {count} in {condition}; wait for more, then "
            f"{AGAIN}"
        )
    given = np.bincount([a.participant for a in feedback.answers], minlength=count)
    if len(given) != count or not given.all():
        raise PoliteError(
            f"{people.folder}: expected answers of each of {count} participants in {condition}, "
            f"got {given.tolist()}; {AGAIN}"
        )
    if all(answer.preferred is None for answer in feedback.answers):
        raise PoliteError(
            f"{people.folder}: expected a preference in {condition}, got none in "
            f"{len(feedback.answers)} answers, so there is nothing to learn from"
        )
    pool, env = feedback.pool, SocialCorridorEnv()
    env.reset(seed=0)
    spaces = (env.observation_space.shape, env.action_space.shape, env.state_row().shape)
    seen = (pool.observations.shape[2:], pool.actions.shape[2:], pool.states.shape[2:])
    if seen != spaces:
        raise PoliteError(
            f"{people.folder}: expected observations, actions and states of sizes {spaces}, got "
            f"{seen}: the clips are from another version of {ENV_ID}"
        )
