"""One run of the grid, from its description to its record."""

from __future__ import annotations

import json
import time
import traceback
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import socialnav_env  # noqa: F401 (registers the corridor)
from polite.experiments.benchmark.grid import WITH_HIGHLIGHTS, Run
from polite.experiments.benchmark.live import Live
from polite.experiments.benchmark.machine import machine
from polite.experiments.benchmark.record import (
    Record,
    answers_part,
    curve_of,
    final_return,
    highlighted_reward,
)
from polite.experiments.benchmark.settings import (
    env_maker,
    fingerprint,
    learning_config,
    pebble_settings,
)
from polite.experiments.training.held_out import SEGMENTS, held_out_quality
from polite.experiments.training.judge import judge
from polite.experiments.training.models import save_models
from polite.experiments.workers import one_torch_thread
from polite.files import one_line
from polite.methods.pebble import learn_pebble
from polite.methods.pebble_config import PEBBLE_METHODS
from polite.methods.preference_learning import Learned, MakeEnv, learn
from polite.types import NotFiniteError

EPISODES = 20
"""On which the finished policy is judged."""
SMOKE_SEGMENTS = 40
"""Fresh ones on which a reward model is judged where it shall end in seconds."""


def checkpoint_path(folder: Path, run: Run) -> Path:
    """Where a long run keeps what it needs to go on, with the same settings, until it ends."""
    return folder / "checkpoints" / f"{run.name}_{fingerprint(run)}.pt"


@dataclass(frozen=True)
class Outcome:
    """What comes back of a run, from whichever machine it was on."""

    record: Record | None
    """None if it failed."""
    models: dict[str, bytes]
    """File names and their content."""
    seconds: dict[str, float]
    """By part, with `total` and, of it, the processor's `cpu`."""
    failure: str | None = None
    """Why it failed, in one line."""
    details: str = ""
    """The traceback."""
    machine: dict[str, str | None] = field(default_factory=dict)
    """What it was done with: versions and the processor."""


def carry_out(run: Run, folder: Path) -> Outcome:
    """Train, judge and describe; an error becomes part of the outcome.

    Args:
        run: what to do.
        folder: the grid's, where the run says how far it is.
    """
    live = Live(folder, run)
    cpu = time.process_time()
    record, models, failure, details = None, dict[str, bytes](), None, ""
    try:
        with one_torch_thread():
            record, models = _carry_out(run, folder, live)
        _check_finite(record)
    except Exception as error:  # other runs go on, whatever happened to this one
        record, failure, details = None, one_line(error), traceback.format_exc()
    live.report("done", 1.0)
    seconds = live.parts | {"total": live.seconds, "cpu": time.process_time() - cpu}
    return Outcome(record, models, seconds, failure, details, machine())


def _check_finite(record: Record) -> None:
    """Refuse a record that cannot be written as JSON, while that is still this run's own failure.

    Raises:
        NotFiniteError: if it has NaN or infinity.
    """
    try:
        json.dumps(record, allow_nan=False)
    except ValueError as error:
        raise NotFiniteError(
            f"expected finite numbers in the record, got NaN or infinity ({error})"
        ) from error


def _carry_out(run: Run, folder: Path, live: Live) -> tuple[Record, dict[str, bytes]]:
    live.report("beginning", 0.0)
    if run.method in PEBBLE_METHODS:
        learned, make_env = _learn_by_pebble(run, checkpoint_path(folder, run), live)
    else:
        learned, make_env = _learn_by_ppo(run, live)
    return _describe(run, learned, make_env, live), _models(learned)


def _learn_by_ppo(run: Run, live: Live) -> tuple[Learned, MakeEnv]:
    config, preset = learning_config(run)
    make_env = env_maker(run, preset)
    make_teacher = preset.make_teacher
    return learn(make_env, make_teacher, config, run.seed, live.report, live.follow), make_env


def _learn_by_pebble(run: Run, checkpoint: Path, live: Live) -> tuple[Learned, MakeEnv]:
    """Hours long, so it goes on from its last session if it was stopped."""
    config, preset = pebble_settings(run)
    make_env = env_maker(run, preset)
    learned = learn_pebble(
        make_env, preset.make_teacher, config, run.seed, live.report, checkpoint, live.follow
    )
    return learned, make_env


def _describe(run: Run, learned: Learned, make_env: MakeEnv, live: Live) -> Record:
    """The record of a finished training."""
    live.report("judging the policy", 1.0)
    evaluation = judge(make_env, learned.policy, EPISODES, run.seed)
    live.report("judging the reward", 1.0)
    asked = learned.session_policy is not None  # a random reward model's order tells nothing
    segments = SMOKE_SEGMENTS if run.preset == "smoke" else SEGMENTS
    quality = held_out_quality(make_env, learned, run.seed, segments) if asked else None
    if quality is not None:
        feedback = learned.feedback if run.method in WITH_HIGHLIGHTS else None
        quality["highlighted_reward"] = highlighted_reward(feedback) if feedback else None
    return {
        "run": run.as_dict(),
        "settings": fingerprint(run),
        "curve": curve_of(learned.episodes, learned.policy_steps),
        "final_return": final_return(learned.episodes, learned.policy_steps),
        "evaluation": evaluation,
        "answers": answers_part(learned.feedback),
        "quality": quality,
        "policy_steps": learned.policy_steps,
        "collection_steps": learned.collection_steps,
        "sessions": learned.sessions,
    }


def _models(learned: Learned) -> dict[str, bytes]:
    """The models' files, which are small enough to be sent."""
    with TemporaryDirectory() as folder:
        save_models(Path(folder), learned.policy, learned.reward)
        return {path.name: path.read_bytes() for path in sorted(Path(folder).iterdir())}
