"""A made-up study and its records, for tests. Nobody said any of this."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from polite.dataset import Feedback, save_feedback
from polite.study.design import CONDITIONS, Design, read_design
from polite.study.export import export
from polite.study.records import AnswerRecord, ParticipantRecord, StudyRecords, TrialRecord
from polite.types import Query, SegmentPool

TOML = """
title = "Robots in a corridor"
contact = "study@example.org"
env = "{env}"
participants = 2
comparisons = {comparisons}
highlight_length = {length}

[consent]
version = "=1+1"
text = "I agree."

[guide]
text = "Look."
good = {{segment = 0, start = 0, text = "good"}}
bad = {{segment = 1, start = 0, text = "bad"}}

[[practice]]
first = 2
second = 3
expected = "first"
explanation = "It is calm."

[[questions]]
name = "clear"
text = "Was it clear?"
kind = "scale"

[[questions]]
name = "comment"
text = "-anything | else?"
kind = "text"
required = false
"""


def made_up_design(folder: Path, **values: Any) -> Design:
    """The design, written into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    given = {"env": "Made-up-v0", "comparisons": 3, "length": 3} | values
    (folder / "study.toml").write_text(TOML.format(**given), encoding="utf-8")
    return read_design(folder / "study.toml")


def made_up_pool(lengths: Any = (8, 8, 8, 8, 2, 8)) -> SegmentPool:
    """Segments of random numbers, some of them short."""
    rng, shape = np.random.default_rng(5), (len(lengths), 8)
    real = (np.arange(8) < np.asarray(lengths)[:, None])[..., None]
    return SegmentPool(
        observations=rng.normal(size=(*shape, 3)) * real,
        actions=rng.normal(size=(*shape, 2)) * real,
        rewards=rng.normal(size=shape) * real[..., 0],
        states=rng.normal(size=(*shape, 4)) * real,
        lengths=np.asarray(lengths),
        trajectory=np.zeros(len(lengths)),
        start=np.zeros(len(lengths)),
    )


QUERIES = [Query(0, 1), Query(2, 3), Query(4, 5), Query(1, 2), Query(3, 4), Query(5, 0)]
"""Two blocks of three."""


def made_up_folder(folder: Path, pool: SegmentPool | None = None, **values: Any) -> Path:
    """A study's folder with its design and its pool."""
    made_up_design(folder, **values)
    save_feedback(folder / "pool", Feedback(pool or made_up_pool(), values.get("queries", QUERIES)))
    return folder


def trial(place: int, kind: str, query: int, first_is_left: bool = True) -> TrialRecord:
    return TrialRecord(place, kind, query, first_is_left)  # type: ignore[arg-type]


TRIALS = (
    trial(0, "practice", -1),
    trial(1, "main", 0),
    trial(2, "main", 1, first_is_left=False),
    trial(3, "repeated", 0),
    trial(4, "mirrored", 1, first_is_left=True),
    trial(5, "main", 2),
)


def answer(place: int, choice: str = "left", **values: Any) -> AnswerRecord:
    """An answer that took 20 s, 5 of them after both clips had been watched."""
    at = 1000.0 + 100.0 * place
    given: dict[str, Any] = {
        "revision": 1,
        "good": None,
        "bad": None,
        "nothing": False,
        "served_at": at,
        "watched_at": at + 15.0,
        "received_at": at + 20.0,
        "client_shown_at": at + 1.0,
        "client_watched_at": at + 15.0,
        "client_chosen_at": at + 17.0,
        "client_answered_at": at + 20.0,
        "replays": 0,
    }
    return AnswerRecord(place=place, choice=choice, **(given | values))  # type: ignore[arg-type]


def person(number: int, *answers: AnswerRecord, **values: Any) -> ParticipantRecord:
    """A participant who finished, half an hour after they had begun."""
    given: dict[str, Any] = {
        "condition": "polite",
        "block": 0,
        "consent_version": "=1+1",
        "design_sha": "ab" * 32,
        "joined_at": 940.0,
        "finished_at": 2740.0,
        "stage": "done",
        "trials": TRIALS,
        "questions": {"clear": 6.0, "comment": '=HYPERLINK(1)\nüñ, "quoted"'},
        "last_seen": 2740.0,
    }
    return ParticipantRecord(number=number, answers=answers, **(given | values))


def consistent(number: int, **values: Any) -> ParticipantRecord:
    """One who answers everything and contradicts themselves nowhere."""
    given = (
        answer(0, "right"),
        answer(1, "left", good=2, bad=4),
        answer(2, "left", good=0),
        answer(3, "left", good=1),
        answer(4, "right", nothing=True),
        answer(5, "equal"),
    )
    if values.get("condition") == "baseline":
        given = tuple(answer(a.place, a.choice) for a in given)
    return person(number, *given, **values)


def made_up_records() -> StudyRecords:
    """Two who count and one who did not finish in each condition, and one who withdrew."""
    people = []
    for index, condition in enumerate(CONDITIONS):
        first = 10 * index
        people += [consistent(first + n, condition=condition, block=n % 2) for n in (1, 2)]
        part = (answer(0), answer(1, "right"))
        people.append(
            person(
                first + 3,
                *part,
                condition=condition,
                finished_at=None,
                stage="comparisons",
                questions={},
                last_seen=1200.0,
            )
        )
    return StudyRecords(tuple(people), {"polite": 1})


def corridor_pool(segments: int = 24, length: int = 20) -> SegmentPool:
    """Clips of a corridor in which a robot drives about at random."""
    from polite.experiments.replication.config import PRESETS
    from polite.experiments.replication.world import study_env
    from polite.rollouts import collect
    from polite.segments import cut_segments

    rng = np.random.default_rng(2)
    env = study_env(PRESETS["smoke"], 8, 0, start_z=-4.0).vector_env
    trajectories = collect(
        env, lambda observations: rng.uniform(-1, 1, (len(observations), 2)), 3 * length, 1
    )
    return cut_segments(trajectories, length, segments, rng)


def corridor_export(folder: Path, *, sizes: tuple[int, int] = (3, 2), **values: Any) -> Path:
    """An export of a study about the corridor: `sizes` made-up people in the two conditions.

    They prefer the clip with the higher return, on which the first two thirds mark something; the
    last of each condition answers a comparison less.
    """
    pool, comparisons = corridor_pool(), 8
    rng = np.random.default_rng(4)
    queries = [Query(*map(int, rng.choice(len(pool), 2, False))) for _ in range(2 * comparisons)]
    given = {"env": "SocialCorridor-v0", "comparisons": comparisons, "length": 5} | values
    study = made_up_folder(folder / "study", pool, **given, queries=queries)
    people = []
    for condition, size in zip(CONDITIONS, sizes, strict=True):
        for n in range(size):
            block = n % 2
            trials = tuple(
                trial(i, "main", block * comparisons + i, bool(rng.integers(2)))
                for i in range(comparisons)
            )
            kept = trials[: comparisons - (n == size - 1)]
            answers = [_knowing(t, pool, queries, condition) for t in kept]
            number, end = 1 + len(people), 2000.0 + 60.0 * len(people)
            people.append(
                person(
                    number, *answers, condition=condition, block=block, trials=trials,
                    finished_at=end, joined_at=940.0 - 30.0 * n,
                )
            )  # fmt: skip
    robots = values.get("robots", False)
    records = StudyRecords(tuple(replace(someone, robot=robots) for someone in people))
    return export(study, records, folder / "export")


def _knowing(
    shown: TrialRecord, pool: SegmentPool, queries: list[Query], condition: str
) -> AnswerRecord:
    """Prefers the higher return; does not tell every eighth pair apart."""
    query = queries[shown.query]
    if shown.query % 8 == 7:
        return answer(shown.place, "equal")
    first = pool.returns[query.first] > pool.returns[query.second]
    choice = "left" if first == shown.first_is_left else "right"
    if condition == "baseline":
        return answer(shown.place, choice)
    marks = {"good": 3} if shown.query % 3 else {"nothing": True}
    return answer(shown.place, choice, **marks, bad=9 if shown.query % 3 == 1 else None)
