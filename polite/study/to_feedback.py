"""From what participants saw and said to what the learner learns from. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from polite.study.design import CONDITIONS, Condition, Design
from polite.study.quality import answered, exclusion
from polite.study.records import (
    AnswerRecord,
    ParticipantRecord,
    RecordsError,
    StudyRecords,
    TrialRecord,
    said,
)
from polite.types import EQUAL, FIRST, SECOND, UNRELATED, Answer, Highlight, Query, SegmentPool

PREFERENCE: Final = {"first": FIRST, "second": SECOND, "equal": EQUAL, "incomparable": UNRELATED}


@dataclass(frozen=True)
class LearnerAnswers:
    """The answers of one condition that the learner gets."""

    answers: list[Answer]
    """To main comparisons, one participant after another, in the order they were asked."""
    participants: tuple[int, ...]
    """Their numbers in the study; the answers' `participant` is the place in this tuple."""


def learner_answers(
    records: StudyRecords, design: Design, pool: SegmentPool, queries: Sequence[Query]
) -> dict[Condition, LearnerAnswers]:
    """The last answer to every main comparison, of everybody who is not excluded.

    Practice and catch pairs are no training data. An answer's `seconds` is the server's time from
    sending the trial to receiving its first answer: watching, choosing and marking; a later change
    of mind adds nothing.

    Raises:
        RecordsError: If an answer does not fit the queries or the pool.
    """
    found: dict[Condition, LearnerAnswers] = {}
    for condition in CONDITIONS:
        people = included(records, design, condition)
        answers = [
            _answer(index, trial, revisions, design, pool, queries)
            for index, person in enumerate(people)
            for trial, revisions in answered(person, ("main",))
        ]
        found[condition] = LearnerAnswers(answers, tuple(person.number for person in people))
    return found


def included(
    records: StudyRecords, design: Design, condition: Condition
) -> list[ParticipantRecord]:
    """A condition's participants that are not excluded, by number."""
    people = sorted(records.participants, key=lambda person: person.number)
    return [p for p in people if p.condition == condition and not exclusion(p, design)]


def highlight(start: int | None, length: int, steps: int) -> Highlight | None:
    """A window by its first step, on a clip of some steps; a clip shorter than it cuts it off.

    Args:
        start: Its first step.
        length: L; the window has L + 1 steps.
        steps: Of the clip.

    Raises:
        RecordsError: If the window does not begin, or on a longer clip does not end, within it.
    """
    if start is None:
        return None
    if not 0 <= start <= max(0, steps - 1 - length):
        raise RecordsError(
            f"expected a window of {length + 1} steps within a clip of {steps}, got one that "
            f"begins at step {start}; restore the study's pool and design"
        )
    return Highlight(min(start + length, steps - 1), length)


def segments_of(trial: TrialRecord, design: Design, queries: Sequence[Query]) -> tuple[int, int]:
    """The query's first and second segment; practice comes from the design, by its place.

    Raises:
        RecordsError: If there is no such query or practice.
    """
    pairs = (
        [(practice.first, practice.second) for practice in design.practice]
        if trial.kind == "practice"
        else [(query.first, query.second) for query in queries]
    )
    index = trial.place if trial.kind == "practice" else trial.query
    if not 0 <= index < len(pairs):
        raise RecordsError(
            f"expected one of {len(pairs)} pairs of segments, got number {index} ({trial.kind}); "
            "restore the study's pool and design"
        )
    return pairs[index]


def _answer(
    index: int,
    trial: TrialRecord,
    revisions: Sequence[AnswerRecord],
    design: Design,
    pool: SegmentPool,
    queries: Sequence[Query],
) -> Answer:
    """One answer for the learner; `index` is the participant's new number."""
    first, last = revisions[0], revisions[-1]
    preference = said(trial, last.choice)
    pair = segments_of(trial, design, queries)
    marks: list[Highlight | None] = [None, None]
    if preference in ("first", "second"):
        steps = int(pool.lengths[pair[preference == "second"]])
        marks = [highlight(at, design.highlight_length, steps) for at in (last.good, last.bad)]
    return Answer(
        query=trial.query,
        preference=PREFERENCE[preference],
        positive=marks[0],
        negative=marks[1],
        participant=index,
        seconds=max(0.0, first.received_at - first.served_at),
    )
