"""What is kept of a run: numbers that depend on nothing but the run and the type of machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from polite.analysis.learning_curve import learning_curve
from polite.dataset import Feedback
from polite.experiments.benchmark.grid import Run
from polite.experiments.benchmark.settings import fingerprint
from polite.files import read_json_object
from polite.types import Answer, PoliteError, SegmentPool

Record = dict[str, Any]
KEYS: Final = frozenset(
    {
        "run",
        "settings",
        "curve",
        "final_return",
        "evaluation",
        "answers",
        "quality",
        "policy_steps",
        "collection_steps",
        "sessions",
    }
)
"""Of a record."""
_KINDS: Final = {
    "curve": dict | None,
    "final_return": float | int | None,
    "evaluation": dict | None,
    "answers": dict | None,
    "quality": dict | None,
    "sessions": list | None,
}
"""What some of them have to be."""
POINTS = 50
"""At most so many points a curve."""
LAST = 0.1
"""The final return is that of the episodes which ended in this last share of the training."""


def record_path(folder: Path, run: Run) -> Path:
    """Where a run's record is kept."""
    return folder / "runs" / f"{run.name}.json"


def read_record(folder: Path, run: Run) -> Record | None:
    """A finished run's record; None if there is none, or it is damaged or not of these settings."""
    record = _whole_record(folder, run)
    return record if record and record.get("settings") == fingerprint(run) else None


def made_otherwise(folder: Path, run: Run) -> bool:
    """Whether a run was finished with other settings than it has now, or with unknown ones."""
    return _whole_record(folder, run) is not None and read_record(folder, run) is None


def is_damaged(folder: Path, run: Run) -> bool:
    """Whether a file stands where the run's record should, and is no record of it."""
    return record_path(folder, run).exists() and _whole_record(folder, run) is None


def _whole_record(folder: Path, run: Run) -> Record | None:
    """A run's record, whatever made it; None if there is none, or it is damaged or another's."""
    try:
        record = read_json_object(record_path(folder, run), "run it again")
    except PoliteError:
        return None
    whole = record.keys() >= KEYS - {"settings"}
    whole = whole and all(isinstance(record[name], kind) for name, kind in _KINDS.items())
    return record if whole and record.get("run") == run.as_dict() else None


def read_records(folder: Path, runs: Sequence[Run]) -> list[Record]:
    """The records of those runs that are finished, in the runs' order."""
    found = (read_record(folder, run) for run in runs)
    return [record for record in found if record is not None]


def curve_of(episodes: Sequence[Mapping[str, float]], steps: int) -> dict[str, list[float]]:
    """Return and length over the training.

    Args:
        episodes: the finished training episodes.
        steps: policy steps of the whole training.
    """
    kept = [{name: episode[name] for name in ("step", "return", "length")} for episode in episodes]
    return {"return": [], "length": []} | learning_curve(kept, steps, POINTS)


def final_return(episodes: Sequence[Mapping[str, float]], steps: int) -> float | None:
    """Mean true return of the last episodes, or the very last one; None if none was finished."""
    if not episodes:
        return None
    last = [e["return"] for e in episodes if e["step"] > (1 - LAST) * steps]
    return float(np.mean(last or [episodes[-1]["return"]]))


def answers_part(feedback: Feedback | None) -> dict[str, Any]:
    """What the teacher said, and how often the labels agree with the true returns."""
    answers = feedback.answers if feedback else []
    return {
        "asked": len(answers),
        "no_preference": sum(answer.preferred is None for answer in answers),
        "positive": sum(answer.positive is not None for answer in answers),
        "negative": sum(answer.negative is not None for answer in answers),
        "label_accuracy": _label_accuracy(feedback) if feedback else None,
    }


def _label_accuracy(feedback: Feedback) -> float | None:
    """Share of the expressed preferences for the truly better segment; equal ones are left out."""
    returns = feedback.pool.returns
    right = []
    for answer in feedback.answers:
        query = feedback.queries[answer.query]
        gap = returns[query.first] - returns[query.second]
        if answer.preferred is not None and gap != 0:
            right.append((gap > 0) == (answer.preferred == 0))
    return float(np.mean(right)) if right else None


def highlighted_reward(feedback: Feedback) -> dict[str, float | None]:
    """Mean true reward of the marked steps, and of all steps of the marked segments."""
    pool = feedback.pool
    marked = [a for a in feedback.answers if a.positive is not None or a.negative is not None]
    windows = {
        "positive": [_rewards(pool, feedback, a)[a.positive.window] for a in marked if a.positive],
        "negative": [_rewards(pool, feedback, a)[a.negative.window] for a in marked if a.negative],
        "all": [_rewards(pool, feedback, a) for a in marked],
    }
    return {
        name: float(np.mean(np.concatenate(parts))) if parts else None
        for name, parts in windows.items()
    }


def _rewards(pool: SegmentPool, feedback: Feedback, answer: Answer) -> Any:
    """True rewards of the real steps of the segment that an answer's highlights lie on."""
    query = feedback.queries[answer.query]
    segment = (query.first, query.second)[answer.marked or 0]
    return pool.rewards[segment, : pool.lengths[segment]]
