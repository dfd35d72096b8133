"""Trials and answers in the database: serving, watching, answering once whatever happens.

Each function works within the transaction of the connection that it is given. `now` is the server's
time in seconds since the epoch.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal
from uuid import UUID

from pydantic import BaseModel, ConfigDict, Field
from sqlalchemy import Connection, Row, func, insert, select, update

from polite.study import schema
from polite.study.assignment import Trial
from polite.study.errors import RefusedError
from polite.study.material import Material
from polite.study.participants import Participant, advance
from polite.study.stages import COMPARISONS, PRACTICE

TOLERANCE: Final = 0.9
"""Clips count as watched after this share of the time that they take at the highest speed."""

Step = Annotated[int, Field(ge=0, le=1_000_000)] | None
Milliseconds = Annotated[float, Field(ge=0, le=1e14, allow_inf_nan=False)]


class AnswerForm(BaseModel):
    """What the page sends."""

    model_config = ConfigDict(extra="forbid", use_attribute_docstrings=True)

    submission: UUID
    """Made by the page for this answer; sent again, it is the same answer."""
    revision: Annotated[int, Field(ge=0, le=1000)]
    """How many answers to this place the page knows of."""
    choice: Literal["left", "right", "equal", "incomparable"]
    """Which clip is preferred, as they are shown."""
    good: Step = None
    """First step of the good window on the preferred clip."""
    bad: Step = None
    """First step of the bad window."""
    nothing: bool = False
    """Nothing stands out."""
    shown_at: Milliseconds
    """When the trial appeared, by the page's clock [ms since the epoch]."""
    watched_at: Milliseconds
    """When both clips had been watched."""
    chosen_at: Milliseconds
    """When the choice was made."""
    answered_at: Milliseconds
    """When the answer was sent."""
    replays: Annotated[int, Field(ge=0, le=1_000_000)] = 0
    """How often the clips were played again."""


@dataclass(frozen=True)
class Place:
    """A participant's trial, and what is stored of it."""

    place: int
    current: int
    """The first place without an answer; the number of trials if there is none."""
    trial: Trial
    served_at: float | None
    watched_at: float | None
    answer: Row[Any] | None
    """The last answer."""

    @property
    def revision(self) -> int:
        """How many answers there are."""
        return self.answer.revision if self.answer else 0


@dataclass(frozen=True)
class Stored:
    """An answer is stored."""

    trial: Trial
    """What it is an answer to."""
    revision: int
    """How many there are now."""
    next: int | None
    """Where the participant goes on; None where nothing is left to compare."""
    stage: str
    """The participant's stage now."""


def current_place(connection: Connection, person: Participant) -> int:
    """The first place without an answer; the number of trials if there is none."""
    last = connection.scalar(
        select(func.max(schema.answers.c.place)).where(
            schema.answers.c.participant == person.number
        )
    )
    return 0 if last is None else int(last) + 1


def read_place(
    connection: Connection, person: Participant, material: Material, place: int
) -> Place:
    """One trial of a participant; practice is over once the comparisons have begun.

    Raises:
        RefusedError: There is no such place, or it is not theirs to see now.
    """
    if person.stage not in (PRACTICE, COMPARISONS):
        raise RefusedError(409, "There is nothing to compare now.", stage=person.stage)
    in_phase = (place < material.practice) == (person.stage == PRACTICE)
    answers = schema.answers
    row = _trial_row(connection, person, place)
    current = current_place(connection, person)
    if row is None or not in_phase or place > current:
        raise RefusedError(404, "This comparison is not yours to make now.")
    last = connection.execute(
        select(answers)
        .where(answers.c.participant == person.number, answers.c.place == place)
        .order_by(answers.c.revision.desc())
        .limit(1)
    ).one_or_none()
    return Place(place, current, _trial(row), row.served_at, row.watched_at, last)


def mark_served(connection: Connection, person: Participant, place: int, now: float) -> None:
    """Note when a trial was first sent to the page."""
    _mark(connection, person, place, "served_at", now)


def mark_watched(
    connection: Connection, person: Participant, material: Material, place: int, now: float
) -> None:
    """Note when both clips had been watched for the first time.

    Raises:
        RefusedError: That is sooner than is possible, or the trial was not served.
    """
    at = read_place(connection, person, material, place)
    if at.watched_at is not None:
        return
    earliest = TOLERANCE * material.shortest_watch(at.trial)
    if at.served_at is None or now < at.served_at + earliest:
        raise RefusedError(422, "Please watch both clips to their end first.")
    _mark(connection, person, place, "watched_at", now)


def store_answer(
    connection: Connection,
    person: Participant,
    material: Material,
    place: int,
    form: AnswerForm,
    now: float,
) -> Stored:
    """Store an answer, once; the participant must have been found `to_write`.

    Raises:
        RefusedError: It is not an answer to this trial, or another page has answered it meanwhile.
    """
    earlier = _same_submission(connection, person, form)
    if earlier is not None and earlier.place != place:
        raise RefusedError(422, "submission: expected a new one for another comparison.")
    if earlier is not None:
        seen = _trial(_trial_row(connection, person, earlier.place))
        current = current_place(connection, person)
        return _stored(person, material, seen, earlier.revision, current)
    at = read_place(connection, person, material, place)
    if form.revision != at.revision:
        raise RefusedError(
            409,
            "This comparison has been answered in another window. You go on with the next one.",
            revision=at.revision,
            current=at.current,
        )
    _check(at, form, person, material)
    connection.execute(insert(schema.answers).values(_row(person, place, form, now)))
    current = max(at.current, place + 1)
    person = _go_on(connection, person, material, current, now)
    stored = _stored(person, material, at.trial, form.revision + 1, current)
    if stored.next is not None and at.trial.kind != "practice":  # practice shows feedback first
        mark_served(connection, person, stored.next, now)
    return stored


def _trial_row(connection: Connection, person: Participant, place: int) -> Row[Any] | None:
    trials = schema.trials
    return connection.execute(
        select(trials).where(trials.c.participant == person.number, trials.c.place == place)
    ).one_or_none()


def _trial(row: Any) -> Trial:
    return Trial(row.kind, row.query, row.first_is_left)


def _mark(connection: Connection, person: Participant, place: int, column: str, now: float) -> None:
    """Fill in a time, unless there is one already."""
    trials = schema.trials
    connection.execute(
        update(trials)
        .where(
            trials.c.participant == person.number,
            trials.c.place == place,
            trials.c[column].is_(None),
        )
        .values({column: now})
    )


def _same_submission(
    connection: Connection, person: Participant, form: AnswerForm
) -> Row[Any] | None:
    """This very answer, if it has been stored already: its confirmation was lost on the way."""
    answers = schema.answers
    return connection.execute(
        select(answers).where(
            answers.c.submission == str(form.submission),
            answers.c.participant == person.number,
        )
    ).one_or_none()


def _stored(
    person: Participant, material: Material, trial: Trial, revision: int, current: int
) -> Stored:
    end = material.practice if person.stage == PRACTICE else material.trials
    more = person.stage in (PRACTICE, COMPARISONS) and current < end
    return Stored(trial, revision, current if more else None, person.stage)


def _go_on(
    connection: Connection, person: Participant, material: Material, current: int, now: float
) -> Participant:
    """Let the participant enter the next stage if this was the last answer of theirs."""
    ends = {PRACTICE: material.practice, COMPARISONS: material.trials}
    if current >= ends[person.stage]:
        return advance(connection, person, material.design, now)
    people = schema.participants
    connection.execute(update(people).where(people.c.number == person.number).values(last_seen=now))
    return person


def _check(at: Place, form: AnswerForm, person: Participant, material: Material) -> None:
    """Refuse what is not a whole answer to this trial.

    Raises:
        RefusedError: Saying what was expected.
    """
    if at.watched_at is None:
        raise RefusedError(422, "Please watch both clips to their end before you answer.")
    marks = [mark for mark in (form.good, form.bad) if mark is not None]
    if not person.highlights or form.choice in ("equal", "incomparable"):
        if marks or form.nothing:
            raise RefusedError(422, "Passages can be marked on a preferred clip only.")
        return
    if form.nothing == bool(marks):
        raise RefusedError(422, "Expected a marked passage, or that nothing stands out.")
    left, right = material.sides(at.trial)
    clip = left if form.choice == "left" else right
    latest = max(0, clip.steps - 1 - material.design.highlight_length)
    if any(mark > latest for mark in marks):
        raise RefusedError(422, f"Expected passages that begin at step 0 to {latest} of the clip.")


def _row(person: Participant, place: int, form: AnswerForm, now: float) -> dict[str, Any]:
    return {
        "submission": str(form.submission),
        "participant": person.number,
        "place": place,
        "revision": form.revision + 1,
        "choice": form.choice,
        "good": form.good,
        "bad": form.bad,
        "nothing_marked": form.nothing,
        "received_at": now,
        "client_shown_at": form.shown_at / 1000.0,
        "client_watched_at": form.watched_at / 1000.0,
        "client_chosen_at": form.chosen_at / 1000.0,
        "client_answered_at": form.answered_at / 1000.0,
        "replays": form.replays,
    }
