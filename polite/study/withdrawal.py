"""Withdrawing from a study: everything that somebody answered is deleted, wherever we keep it."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Final

from sqlalchemy import ColumnElement, Connection, insert, select, update

from polite.files import system_says
from polite.study import schema
from polite.study.database import Database
from polite.study.participants import clean_code
from polite.types import PoliteError

EXPORT: Final = "export"
"""Where exports go unless another folder is given, in the study's folder."""


class CopyLeftError(PoliteError):
    """Somebody's answers are deleted from the database, but an export could not be removed."""


def by_code(code: str) -> ColumnElement[bool]:
    """The participant whose withdrawal code this is."""
    return schema.participants.c.code == clean_code(code)


def by_number(number: int) -> ColumnElement[bool]:
    """The participant with this number."""
    return schema.participants.c.number == number


def by_identity(name: str, value: str) -> ColumnElement[bool]:
    """The participants whom a panel calls so."""
    said = schema.identities
    called = select(said.c.participant).where(said.c.name == name, said.c.value == value)
    return schema.participants.c.number.in_(called)


def withdraw(connection: Connection, who: ColumnElement[bool], now: float) -> bool:
    """Delete everything of a participant; whether there was one.

    Raises:
        PoliteError: There are several.
    """
    people, invitations = schema.participants, schema.invitations
    # An answer that is being stored now must be there to be deleted.
    found = select(people).where(who).order_by(people.c.number).with_for_update()
    rows = connection.execute(found).all()
    if not rows:
        return False
    if len(rows) > 1:
        numbers = ", ".join(str(row.number) for row in rows)
        raise PoliteError(f"participants {numbers} are meant; give the number of one of them")
    (row,) = rows
    for table in (schema.answers, schema.questionnaires, schema.trials, schema.identities):
        connection.execute(table.delete().where(table.c.participant == row.number))
    connection.execute(people.delete().where(people.c.number == row.number))
    connection.execute(
        update(invitations)
        .where(invitations.c.token == row.invitation)
        .values(withdrawn=invitations.c.withdrawn + 1)
    )
    connection.execute(
        insert(schema.withdrawals).values(condition=row.condition, stage=row.stage, at=now)
    )
    return True


def has_code(connection: Connection, code: str) -> bool:
    """Whether there is a participant whose code this is."""
    found = select(schema.participants.c.number).where(by_code(code))
    return connection.execute(found).one_or_none() is not None


def withdraw_everywhere(
    folder: Path, database: Database, who: ColumnElement[bool], now: float
) -> bool:
    """Delete a participant's answers from the database and the study's own export.

    The export is removed as a whole, since every file of it may tell of the participant; it can be
    made again. Of exports elsewhere we do not know.

    Args:
        folder: The study's.
        database: Where the answers are.
        who: The participant: `by_code` and the like.
        now: Seconds since the epoch.

    Returns:
        Whether there was such a participant.

    Raises:
        CopyLeftError: They are deleted, but the study's own export could not be removed.
        PoliteError: Several participants are meant; nobody is deleted.
    """
    with database.write() as connection:
        known = withdraw(connection, who, now)
    if known:
        try:
            _remove(folder / EXPORT)
        finally:
            database.forget_traces()
    return known


def _remove(export: Path) -> None:
    """Remove an export, or as much of it as the system lets us.

    Raises:
        CopyLeftError: Something is left.
    """
    shutil.rmtree(export, ignore_errors=True)
    try:
        shutil.rmtree(export)  # again, to hear why
    except FileNotFoundError:
        return
    except OSError as error:
        raise CopyLeftError(
            f"all that is stored is deleted, but {export} could not be removed "
            f"({system_says(error)}); delete it by hand"
        ) from error
