"""Participants in the database: how they join, are found again, and go on.

Each function works within the transaction of the connection that it is given. `now` is the server's
time in seconds since the epoch.
"""

from __future__ import annotations

import base64
import hashlib
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Self

from sqlalchemy import Connection, Row, Table, bindparam, func, insert, select, update
from sqlalchemy.dialects import postgresql, sqlite

from polite.study import schema
from polite.study.assignment import choose, sequence
from polite.study.design import Design
from polite.study.errors import RefusedError, WithdrawnError
from polite.study.invitations import NOT_ACCEPTED, PERSONAL_FIELDS
from polite.study.stages import CONSENT, DONE, STILL_HERE, after

_FIND: Final = select(schema.participants).where(
    schema.participants.c.session == bindparam("session")
)
_FIND_TO_WRITE: Final = _FIND.with_for_update()
"""Every request asks this, so it is put together once."""


@dataclass(frozen=True)
class Participant:
    """Somebody who has consented."""

    number: int
    condition: str
    block: int
    stage: str
    code: str
    """Withdraws their answers."""

    @classmethod
    def of(cls, row: Row[Any]) -> Self:
        """From a row of the table."""
        return cls(row.number, row.condition, row.block, row.stage, row.code)

    @property
    def highlights(self) -> bool:
        """Whether they are asked for highlights."""
        return self.condition == "polite"


def hashed(token: str) -> str:
    """What the database keeps of a session's token."""
    return hashlib.sha256(token.encode()).hexdigest()


def record_design(connection: Connection, design: Design, now: float) -> str:
    """Keep the design that somebody is about to take part in; returns its checksum."""
    sha = design.sha
    dialect = postgresql if connection.dialect.name == "postgresql" else sqlite
    row = {"sha": sha, "content": design.model_dump_json(), "first_used": now}
    connection.execute(dialect.insert(schema.designs).values(row).on_conflict_do_nothing())
    return sha


def invitation_is_open(connection: Connection, invitation: str) -> bool:
    """Whether one more may join by it.

    Raises:
        RefusedError: There is no such invitation.
    """
    table, people = schema.invitations, schema.participants
    free = connection.scalar(
        select(table.c.cap - table.c.withdrawn).where(table.c.token == invitation)
    )
    if free is None:
        raise RefusedError(404, "This invitation is not known. Please check the link.")
    here = connection.scalar(
        select(func.count()).select_from(people).where(people.c.invitation == invitation)
    )
    return int(here or 0) < int(free)


def new_token() -> str:
    """The token of a session; the database keeps its checksum only."""
    return secrets.token_urlsafe(32)


def join(
    connection: Connection,
    design: Design,
    invitation: str,
    identities: Mapping[str, str],
    token: str,
    now: float,
) -> None:
    """Take somebody in who has consented.

    Args:
        connection: The transaction.
        design: The study.
        invitation: By which they come.
        identities: What a panel calls them.
        token: Their session's. Who has joined with it is not taken in again: a form may be sent
            twice, and the answer to the first be lost.
        now: The server's time.

    Raises:
        RefusedError: The invitation is unknown or used up, or the panel's person is here already.
    """
    sha = record_design(connection, design, now)
    _one_at_a_time(connection)
    people = schema.participants
    joined = select(people.c.number).where(people.c.session == hashed(token))
    if connection.execute(joined).one_or_none() is not None:
        return
    _refuse_again(connection, identities)
    if not invitation_is_open(connection, invitation):
        raise RefusedError(410, "This invitation has been used. Thank you for your interest.")
    row = {
        "session": hashed(token),
        "code": _new_code(),
        "invitation": invitation,
        "condition": "",
        "block": -1,
        "design": sha,
        "consent_version": design.consent.version,
        "stage": after(CONSENT, design),
        "joined_at": now,
        "last_seen": now,
    }
    taken = _taken(connection, now)
    number = connection.execute(insert(people).values(row).returning(people.c.number)).scalar_one()
    condition, block = choose(design, number, taken)
    connection.execute(
        update(people).where(people.c.number == number).values(condition=condition, block=block)
    )
    _insert_all(connection, schema.trials, _trial_rows(design, number, block))
    _insert_identities(connection, number, identities)


def identities_of(connection: Connection, token: str) -> dict[str, str]:
    """What a panel calls a session's participant; nothing, if no panel sent them."""
    people, said = schema.participants, schema.identities
    rows = connection.execute(
        select(said.c.name, said.c.value)
        .join(people, people.c.number == said.c.participant)
        .where(people.c.session == hashed(token))
    )
    return {row.name: row.value for row in rows}


def add_identities(connection: Connection, token: str, identities: Mapping[str, str]) -> None:
    """Keep what a link says of a session's participant, beside what is known of them.

    Raises:
        WithdrawnError: There is no such participant (any more).
        RefusedError: The panel's person is in the study as another participant.
    """
    person = find(connection, token, to_write=True)
    _one_at_a_time(connection)
    kept = identities_of(connection, token)
    new = {name: value for name, value in identities.items() if name not in kept}
    _refuse_again(connection, new)
    _insert_identities(connection, person.number, new)


def find(connection: Connection, token: str, *, to_write: bool = False) -> Participant:
    """The participant of a session.

    Args:
        connection: The transaction.
        token: The session's.
        to_write: Keep others from changing this participant's data until the transaction ends.

    Raises:
        WithdrawnError: There is none (any more).
    """
    query = _FIND_TO_WRITE if to_write else _FIND
    row = connection.execute(query, {"session": hashed(token)}).one_or_none()
    if row is None:
        raise WithdrawnError
    return Participant.of(row)


def advance(connection: Connection, person: Participant, design: Design, now: float) -> Participant:
    """Let a participant go on to the next stage."""
    stage = after(person.stage, design)
    values: dict[str, Any] = {"stage": stage, "last_seen": now}
    if stage == DONE:
        values["finished_at"] = now
    people = schema.participants
    connection.execute(update(people).where(people.c.number == person.number).values(values))
    return Participant(person.number, person.condition, person.block, stage, person.code)


def completion_code(code: str) -> str:
    """The code that shows a panel that somebody has finished; does not tell how to withdraw."""
    digest = hashlib.sha256(f"completion:{code}".encode()).digest()
    return base64.b32encode(digest)[:8].decode()


def clean_code(code: str) -> str:
    """A code as it is stored, whatever spaces and letters it is typed with."""
    letters = "".join(letter for letter in code.upper() if letter.isalnum())
    return "-".join(letters[start : start + 4] for start in range(0, len(letters), 4))[:32]


def _new_code() -> str:
    """80 random bits in letters that are hard to confuse."""
    return clean_code(base64.b32encode(secrets.token_bytes(10)).decode())


def _one_at_a_time(connection: Connection) -> None:
    """Wait for others who join or say who they are, until the transaction ends.

    Or two could be given the same place in the balance or an invitation's last, or be one person.
    """
    sha = schema.designs.c.sha
    connection.execute(select(sha).order_by(sha).with_for_update())


def _refuse_again(connection: Connection, identities: Mapping[str, str]) -> None:
    """Let nobody take part twice, by another browser.

    Raises:
        RefusedError: A panel's person is in the study.
    """
    said = schema.identities
    for name in PERSONAL_FIELDS:
        same = select(said.c.participant).where(
            said.c.name == name, said.c.value == identities.get(name, "")
        )
        if connection.execute(same).first() is not None:
            raise RefusedError(
                409,
                "You take part in this study already. Please go on in the browser in which you "
                "started, or ask the people who run the study.",
            )


def _taken(connection: Connection, now: float) -> dict[tuple[str, int], int]:
    """(condition, block) -> how many have finished or may still."""
    people = schema.participants
    counted = (people.c.stage == DONE) | (people.c.last_seen >= now - STILL_HERE)
    rows = connection.execute(
        select(people.c.condition, people.c.block, func.count())
        .where(counted)
        .group_by(people.c.condition, people.c.block)
    )
    return {(row[0], row[1]): row[2] for row in rows}


def _insert_identities(connection: Connection, number: int, identities: Mapping[str, str]) -> None:
    """Store what a panel calls a participant; what it says before it knows them is no name."""
    rows = [
        {"participant": number, "name": name, "value": value}
        for name, value in identities.items()
        if value != NOT_ACCEPTED
    ]
    _insert_all(connection, schema.identities, rows)


def _trial_rows(design: Design, number: int, block: int) -> list[dict[str, Any]]:
    return [
        {
            "participant": number,
            "place": place,
            "kind": trial.kind,
            "query": trial.query,
            "first_is_left": trial.first_is_left,
        }
        for place, trial in enumerate(sequence(design, number, block))
    ]


def _insert_all(connection: Connection, table: Table, rows: list[dict[str, Any]]) -> None:
    """Insert rows; none is no error."""
    if rows:
        connection.execute(insert(table), rows)
