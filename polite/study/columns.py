"""Every column of an export: what it is called, what it means, and how it is worked out.

The files and their data dictionary are both written from these tables.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Generic, Literal, TypeVar

from polite.study.design import Design, Question
from polite.study.export_names import QUESTIONNAIRE
from polite.study.quality import (
    COUNTED,
    answered,
    catch_results,
    choice_seconds,
    decision_seconds,
    fast_share,
    is_fast,
    left_rate,
    same_choice_share,
)
from polite.study.records import AnswerRecord, ParticipantRecord, TrialRecord, said

Cell = str | int | float | bool | None
Type = Literal["integer", "number", "true/false", "category", "text"]
"""Only text is what somebody wrote freely."""
Row = TypeVar("Row")

EPOCH: Final = "s since 1970-01-01 UTC"


@dataclass(frozen=True)
class Column(Generic[Row]):
    """One column of one file."""

    name: str
    type: Type
    unit: str
    """Empty where there is none."""
    meaning: str
    value: Callable[[Row], Cell]
    """Works a row's cell out; None is an empty cell."""


@dataclass(frozen=True)
class PersonRow:
    """A participant with what the export found out about them."""

    person: ParticipantRecord
    design: Design
    reasons: tuple[str, ...]
    """Why they are excluded."""
    learner: int | None
    """Their number in the learner's data."""


@dataclass(frozen=True)
class AnswerRow:
    """One revision of one answer."""

    by: PersonRow
    trial: TrialRecord
    answer: AnswerRecord
    is_last: bool
    segments: tuple[int, int]
    """The query's first and second segment."""
    windows: tuple[tuple[int, int] | None, tuple[int, int] | None]
    """First and last step of the good and of the bad window."""


def minutes_total(person: ParticipantRecord) -> float | None:
    """From consent to the end of the study [min]; None before."""
    return None if person.finished_at is None else (person.finished_at - person.joined_at) / 60


def minutes_tasks(person: ParticipantRecord) -> float | None:
    """From consent to the first answer of the last comparison [min]; None without any answer."""
    received = [revisions[0].received_at for _, revisions in answered(person, COUNTED)]
    return (max(received) - person.joined_at) / 60 if received else None


def questionnaire_columns(design: Design) -> tuple[Column[PersonRow], ...]:
    """The questionnaire's columns: who, then one for each question."""
    who = (column for column in PARTICIPANTS if column.name in QUESTIONNAIRE)
    return (*who, *(_question(question) for question in design.questions))


def _question(question: Question) -> Column[PersonRow]:
    types: dict[str, Type] = {"scale": "number", "number": "number"}
    scale = f" (1: {question.low}, {question.points}: {question.high})"
    of_scale = question.kind == "scale"
    return Column(
        question.name,
        types.get(question.kind, "text"),
        f"1 to {question.points}" if of_scale else "",
        question.text + (scale if of_scale else "") + " / ".join(["", *question.options]),
        lambda row: row.person.questions.get(question.name),
    )


_DESCRIBED: Final[tuple[Column[PersonRow], ...]] = (
    Column(
        "participant",
        "integer",
        "",
        "The participant's number in this study; it says nothing about who they are.",
        lambda row: row.person.number,
    ),
    Column(
        "condition",
        "category",
        "",
        "polite: preferences and highlights; baseline: preferences only.",
        lambda row: row.person.condition,
    ),
    Column(
        "block",
        "integer",
        "",
        "Which block of comparisons they saw; a block is seen in both conditions.",
        lambda row: row.person.block,
    ),
    Column(
        "consent_version",
        "text",
        "",
        "Version of the consent text that they agreed to.",
        lambda row: row.person.consent_version,
    ),
    Column(
        "design_sha",
        "category",
        "",
        "SHA-256 of the study's design when they joined.",
        lambda row: row.person.design_sha,
    ),
)
_EXCLUSION: Final[tuple[Column[PersonRow], ...]] = (
    Column(
        "excluded",
        "true/false",
        "",
        "Whether the participant's answers are left out of the learner's data (data/).",
        lambda row: bool(row.reasons),
    ),
    Column(
        "exclusion_reasons",
        "category",
        "",
        "Why, by the rules of study.toml, separated by semicolons.",
        lambda row: "; ".join(row.reasons),
    ),
    Column(
        "robot",
        "true/false",
        "",
        "Whether a program answered, to try the study out, and no person.",
        lambda row: row.person.robot or row.design.by_robots,
    ),
)


def _catch(outcome: str) -> Callable[[PersonRow], Cell]:
    return lambda row: [result.outcome for result in catch_results(row.person)].count(outcome)  # type: ignore[arg-type]


PARTICIPANTS: Final[tuple[Column[PersonRow], ...]] = (
    *_DESCRIBED,
    Column(
        "stage",
        "category",
        "",
        "How far they came: guide, practice, comparisons, questions or done.",
        lambda row: row.person.stage,
    ),
    Column("joined_at", "number", EPOCH, "When they consented.", lambda row: row.person.joined_at),
    Column(
        "finished_at",
        "number",
        EPOCH,
        "When they came to the end; empty if they did not.",
        lambda row: row.person.finished_at,
    ),
    Column(
        "last_seen",
        "number",
        EPOCH,
        "When the server last heard from them.",
        lambda row: row.person.last_seen,
    ),
    Column(
        "minutes_total",
        "number",
        "min",
        "From consent to the end, questionnaire and pauses included.",
        lambda row: minutes_total(row.person),
    ),
    Column(
        "minutes_tasks",
        "number",
        "min",
        "From consent to the first answer of the last comparison: guide, practice and pauses "
        "included, the questionnaire not.",
        lambda row: minutes_tasks(row.person),
    ),
    Column(
        "comparisons",
        "integer",
        "",
        "Comparisons answered, catch pairs included, practice not.",
        lambda row: len(answered(row.person)),
    ),
    Column(
        "changed",
        "integer",
        "",
        "How many of these answers were changed later.",
        lambda row: sum(len(revisions) > 1 for _, revisions in answered(row.person)),
    ),
    Column("catch_agreed", "integer", "", "Catch pairs answered alike.", _catch("agreed")),
    Column(
        "catch_contradicted",
        "integer",
        "",
        "Catch pairs in which the other segment was preferred the second time.",
        _catch("contradicted"),
    ),
    Column(
        "catch_undecided",
        "integer",
        "",
        "Catch pairs answered differently without a contradiction, such as a side and then equal.",
        _catch("undecided"),
    ),
    Column(
        "fast_share",
        "number",
        "share",
        "Too fast answers among the first answers to comparisons; see `fast` in answers.csv.",
        lambda row: fast_share(row.person, row.design),
    ),
    Column(
        "left_rate",
        "number",
        "share",
        "Left among the expressed preferences.",
        lambda row: left_rate(row.person),
    ),
    Column(
        "same_choice_share",
        "number",
        "share",
        "The most frequent of left, right, equal and incomparable among the main comparisons; the "
        "last answer of each.",
        lambda row: same_choice_share(row.person),
    ),
    *_EXCLUSION,
    Column(
        "learner_participant",
        "integer",
        "",
        "Their number in data/<condition>, which counts from 0; empty if excluded.",
        lambda row: row.learner,
    ),
)


def _of_person(column: Column[PersonRow]) -> Column[AnswerRow]:
    """A participant's column, for each of their answers."""
    value = column.value
    return Column(column.name, column.type, column.unit, column.meaning, lambda row: value(row.by))


def _stored(
    name: str, kind: Type, unit: str, meaning: str, field: str | None = None
) -> Column[AnswerRow]:
    """A column that is a field of the stored answer."""
    return Column(name, kind, unit, meaning, lambda row: _cell(row.answer, field or name))


def _cell(record: AnswerRecord, name: str) -> Any:
    return getattr(record, name)


def _side(row: AnswerRow, left: bool) -> int:
    """The segment that was shown on a side."""
    return row.segments[row.trial.first_is_left != left]


def _preferred(row: AnswerRow) -> int | None:
    place = {"first": 0, "second": 1}.get(said(row.trial, row.answer.choice))
    return None if place is None else row.segments[place]


def _edge(which: int, edge: int) -> Callable[[AnswerRow], Cell]:
    """First or last step of the good or the bad window."""

    def value(row: AnswerRow) -> Cell:
        window = row.windows[which]
        return None if window is None else window[edge]

    return value


ANSWERS: Final[tuple[Column[AnswerRow], ...]] = (
    *map(_of_person, _DESCRIBED),
    Column(
        "place",
        "integer",
        "",
        "Where the comparison stood in their sequence, from 0; practice comes first.",
        lambda row: row.trial.place,
    ),
    Column(
        "kind",
        "category",
        "",
        "practice; main; repeated: a main one again as it was; mirrored: again with left and right "
        "exchanged.",
        lambda row: row.trial.kind,
    ),
    Column(
        "query",
        "integer",
        "",
        "Line of data/<condition>/queries.json, from 0; empty in practice.",
        lambda row: None if row.trial.kind == "practice" else row.trial.query,
    ),
    Column(
        "segment_left",
        "integer",
        "",
        "Segment shown on the left: its row in segments.npz.",
        lambda row: _side(row, True),
    ),
    Column(
        "segment_right",
        "integer",
        "",
        "Segment shown on the right.",
        lambda row: _side(row, False),
    ),
    _stored(
        "revision", "integer", "", "1 for the first answer to this comparison, 2 for a changed one."
    ),
    Column(
        "is_last",
        "true/false",
        "",
        "Whether this is the answer that counts.",
        lambda row: row.is_last,
    ),
    _stored("choice", "category", "", "left, right, equal or incomparable, as it was shown."),
    Column(
        "says",
        "category",
        "",
        "The same in terms of the query: first, second, equal or incomparable.",
        lambda row: said(row.trial, row.answer.choice),
    ),
    Column(
        "segment_preferred",
        "integer",
        "",
        "The preferred segment; empty if there is none.",
        _preferred,
    ),
    Column(
        "good_start",
        "integer",
        "step",
        "First step of the good window on the preferred segment, from 0; empty if none.",
        _edge(0, 0),
    ),
    Column("good_end", "integer", "step", "Its last step.", _edge(0, 1)),
    Column(
        "bad_start",
        "integer",
        "step",
        "First step of the bad window on the preferred segment, from 0; empty if none.",
        _edge(1, 0),
    ),
    Column("bad_end", "integer", "step", "Its last step.", _edge(1, 1)),
    _stored(
        "nothing", "true/false", "", "Whether they said that nothing stands out in the segment."
    ),
    _stored("served_at", "number", EPOCH, "Server: the comparison was first sent."),
    _stored(
        "watched_at", "number", EPOCH, "Server: the page said that both clips had been watched."
    ),
    _stored("received_at", "number", EPOCH, "Server: this revision arrived."),
    _stored("client_shown_at", "number", EPOCH, "Page: the comparison appeared."),
    _stored("client_watched_at", "number", EPOCH, "Page: both clips had been watched."),
    _stored("client_chosen_at", "number", EPOCH, "Page: a preference was chosen."),
    _stored("client_answered_at", "number", EPOCH, "Page: the answer was sent."),
    _stored("replays", "integer", "", "How often the clips were played again."),
    Column(
        "seconds",
        "number",
        "s",
        "received_at minus served_at; the learner's data have that of the first revision.",
        lambda row: row.answer.received_at - row.answer.served_at,
    ),
    Column(
        "decision_seconds",
        "number",
        "s",
        "From having watched both clips to the answer, marking included: by the page's clock, or "
        "by the server's where the page's times cannot be right; empty if unknown.",
        lambda row: decision_seconds(row.answer),
    ),
    Column(
        "choice_seconds",
        "number",
        "s",
        "From having watched both clips to the choice, marking not included: by the page's clock; "
        "where its times cannot be right, to the answer by the server's; empty if unknown.",
        lambda row: choice_seconds(row.answer),
    ),
    Column(
        "fast",
        "true/false",
        "",
        "Whether choice_seconds is below the study's fast_seconds.",
        lambda row: is_fast(row.answer, row.by.design),
    ),
    *map(_of_person, _EXCLUSION),
)

DICTIONARY: Final[tuple[Column[tuple[str, Column[Any]]], ...]] = (
    Column("file", "category", "", "The file, or files.", lambda row: row[0]),
    Column("column", "category", "", "The column, or key.", lambda row: row[1].name),
    Column("type", "category", "", "What its cells are.", lambda row: row[1].type),
    Column("unit", "category", "", "Their unit.", lambda row: row[1].unit),
    Column("meaning", "text", "", "What it means.", lambda row: row[1].meaning),
)


def dictionary(design: Design) -> list[tuple[str, Sequence[Column[Any]]]]:
    """The files of an export that have columns, with these."""
    return [
        ("answers.csv, answers.jsonl", ANSWERS),
        ("participants.csv", PARTICIPANTS),
        ("questionnaire.csv", questionnaire_columns(design)),
        ("data_dictionary.csv", DICTIONARY),
    ]
