"""Who participants are to a panel, for paying them; kept apart from what they answered."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from sqlalchemy import Connection, Row, select

from polite.files import write_atomically, write_private
from polite.study import schema
from polite.study.columns import Column
from polite.study.design import Design
from polite.study.participants import completion_code
from polite.study.stages import DONE
from polite.study.tables import as_csv


def write_identities(connection: Connection, design: Design, path: Path) -> None:
    """Write a table: a row for each thing that a panel's link said of somebody.

    Those of whom no link said anything have one row, for their completion code. Nobody else on the
    machine can read the file.

    Args:
        connection: A transaction.
        design: The study.
        path: The table, .csv; written whole or not at all.

    Raises:
        PoliteError: The file cannot be written.
    """
    people, said = schema.participants, schema.identities
    rows = connection.execute(
        select(people.c.number, people.c.stage, people.c.code, said.c.name, said.c.value)
        .outerjoin(said, said.c.participant == people.c.number)
        .order_by(people.c.number, said.c.name)
    ).all()
    own = design.completion.code == ""
    columns = (*_COLUMNS, _OWN_CODE) if own else _COLUMNS
    text = as_csv(columns, rows)
    write_atomically(path, lambda temporary: write_private(temporary, text))


_COLUMNS: Final[tuple[Column[Row[Any]], ...]] = (
    Column("participant", "integer", "", "The participant's number.", lambda r: r.number),
    Column("finished", "true/false", "", "Came to the end.", lambda r: r.stage == DONE),
    Column("field", "text", "", "As in the panel's link.", lambda r: r.name),
    Column("value", "text", "", "What the link said.", lambda r: r.value),
)
_OWN_CODE: Final[Column[Row[Any]]] = Column(
    "completion_code",
    "text",
    "",
    "What the page showed at the end.",
    lambda r: completion_code(r.code) if r.stage == DONE else None,
)
