"""Invitation links: one for each participant, or one for many with a cap."""

from __future__ import annotations

import re
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from sqlalchemy import Connection, func, insert, select

from polite.study import schema
from polite.types import InvalidValueError

MOST: Final = 10_000
"""Links made at once, and people on one link."""
PANEL_FIELDS: Final = (
    "PROLIFIC_PID",
    "STUDY_ID",
    "SESSION_ID",
    "workerId",
    "assignmentId",
    "hitId",
)
"""What Prolific's and Mechanical Turk's links say of a person."""
PERSONAL_FIELDS: Final = ("PROLIFIC_PID", "workerId")
"""Those of them that are one person's, whatever they take part in."""
NOT_ACCEPTED: Final = "ASSIGNMENT_ID_NOT_AVAILABLE"
"""What Mechanical Turk says in an assignment's place while a task is only looked at."""
_PANEL_VALUE: Final = re.compile(r"[A-Za-z0-9_.:-]{1,100}")


@dataclass(frozen=True)
class Invitation:
    """A link."""

    token: str
    cap: int
    """How many may join by it."""
    used: int
    """How many have, those included who withdrew."""

    @property
    def kind(self) -> str:
        """For one person, or for many."""
        return "personal" if self.cap == 1 else "open"

    @property
    def path(self) -> str:
        """Of the page that it opens."""
        return f"/join/{self.token}"


def invite(connection: Connection, links: int, cap: int, now: float) -> list[Invitation]:
    """Make links.

    Args:
        connection: The transaction.
        links: How many links.
        cap: How many people may join by each.
        now: Seconds since the epoch.

    Raises:
        InvalidValueError: A number is not in 1 … MOST.
    """
    for name, value in (("links", links), ("cap", cap)):
        if not 1 <= value <= MOST:
            raise InvalidValueError(f"{name}: expected 1 to {MOST:,}, got {value}")
    made = [Invitation(secrets.token_urlsafe(16), cap, 0) for _ in range(links)]
    rows = [{"token": each.token, "cap": cap, "withdrawn": 0, "created": now} for each in made]
    connection.execute(insert(schema.invitations), rows)
    return made


def list_invitations(connection: Connection) -> list[Invitation]:
    """All links, the oldest first."""
    table, people = schema.invitations, schema.participants
    used = func.count(people.c.number) + table.c.withdrawn
    rows = connection.execute(
        select(table.c.token, table.c.cap, used)
        .outerjoin(people, people.c.invitation == table.c.token)
        .group_by(table.c.token, table.c.cap, table.c.withdrawn, table.c.created)
        .order_by(table.c.created, table.c.token)
    )
    return [Invitation(*row) for row in rows]


def panel_identities(query: Mapping[str, str]) -> dict[str, str]:
    """Who a person is to a panel, from the query of the link that the panel made; else empty."""
    return {
        name: query[name]
        for name in PANEL_FIELDS
        if name in query and _PANEL_VALUE.fullmatch(query[name])
    }


def same_person(kept: Mapping[str, str], said: Mapping[str, str]) -> bool:
    """Whether what two links say may be said of one person."""
    both = [name for name in PERSONAL_FIELDS if name in kept and name in said]
    return all(kept[name] == said[name] for name in both)
