"""From the database to plain records, for exports and summaries; who people are is not read."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Callable
from typing import Any, TypeVar

from sqlalchemy import Connection, Row, func, select

from polite.study import schema
from polite.study.database import Database
from polite.study.design import Condition, Design
from polite.study.records import (
    AnswerRecord,
    ParticipantRecord,
    Shown,
    StudyRecords,
    TrialRecord,
)

Made = TypeVar("Made")


def make_of_records(database: Database, make: Callable[[StudyRecords], Made]) -> Made:
    """What `make` makes of everybody who took part; anew, if somebody withdraws meanwhile."""
    while True:
        with database.read() as connection:
            records = read_records(connection)
        made = make(records)
        with database.read() as connection:
            if read_withdrawn(connection) == records.withdrawn:
                return made


def read_records(connection: Connection) -> StudyRecords:
    """Everybody who took part and did not withdraw, in the order in which they joined."""
    shown = read_shown(connection)
    trials = _by_participant(connection, schema.trials, schema.trials.c.place)
    answers = _by_participant(connection, schema.answers, schema.answers.c.id)
    filled = _by_participant(connection, schema.questionnaires, schema.questionnaires.c.revision)
    people = connection.execute(
        select(schema.participants).order_by(schema.participants.c.number)
    ).all()
    return StudyRecords(
        participants=tuple(
            _participant(
                row,
                trials[row.number],
                answers[row.number],
                json.loads(filled[row.number][-1].content) if filled[row.number] else {},
                shown.designs[row.design].by_robots,
            )
            for row in people
        ),
        withdrawn=read_withdrawn(connection),
        shown=shown,
    )


def read_withdrawn(connection: Connection) -> dict[Condition, int]:
    """How many have withdrawn, by condition."""
    condition = schema.withdrawals.c.condition
    rows = connection.execute(select(condition, func.count()).group_by(condition))
    return {row[0]: row[1] for row in rows}


def read_shown(connection: Connection) -> Shown:
    """What those who are in the study have been shown."""
    designs = schema.designs
    used = designs.c.sha.in_(select(schema.participants.c.design))
    return Shown(
        designs={
            row.sha: Design.model_validate_json(row.content)
            for row in connection.execute(select(designs).where(used))
        },
        pools=frozenset(connection.scalars(select(schema.pools.c.sha))),
    )


def _by_participant(connection: Connection, table: Any, order: Any) -> dict[int, list[Row[Any]]]:
    rows: dict[int, list[Row[Any]]] = defaultdict(list)
    for row in connection.execute(select(table).order_by(order)):
        rows[row.participant].append(row)
    return rows


def _participant(
    row: Row[Any],
    trials: list[Row[Any]],
    answers: list[Row[Any]],
    questions: dict[str, str | float | None],
    robot: bool,
) -> ParticipantRecord:
    served = {trial.place: trial for trial in trials}
    return ParticipantRecord(
        number=row.number,
        condition=row.condition,
        block=row.block,
        consent_version=row.consent_version,
        design_sha=row.design,
        joined_at=row.joined_at,
        finished_at=row.finished_at,
        stage=row.stage,
        trials=tuple(TrialRecord(t.place, t.kind, t.query, t.first_is_left) for t in trials),
        answers=tuple(_answer(answer, served[answer.place]) for answer in answers),
        questions=questions,
        last_seen=row.last_seen,
        robot=robot,
    )


def _answer(row: Row[Any], trial: Row[Any]) -> AnswerRecord:
    return AnswerRecord(
        place=row.place,
        revision=row.revision,
        choice=row.choice,
        good=row.good,
        bad=row.bad,
        nothing=row.nothing_marked,
        served_at=trial.served_at,
        watched_at=trial.watched_at,
        received_at=row.received_at,
        client_shown_at=row.client_shown_at,
        client_watched_at=row.client_watched_at,
        client_chosen_at=row.client_chosen_at,
        client_answered_at=row.client_answered_at,
        replays=row.replays,
    )
