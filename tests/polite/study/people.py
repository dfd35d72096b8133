"""Participants who go through a study below the web pages, for tests."""

from itertools import count
from uuid import UUID

from sqlalchemy import func, select

from polite.study import schema
from polite.study.answering import (
    AnswerForm,
    current_place,
    mark_served,
    mark_watched,
    store_answer,
)
from polite.study.invitations import invite
from polite.study.material import Material
from polite.study.participants import advance, find, join, new_token

_numbers = count(1)


def new_uuid() -> str:
    """Another one each time, and the same ones in each run."""
    return str(UUID(int=next(_numbers), version=4))


def answer_body(**values) -> dict:
    """What the page sends; a whole answer of somebody who is asked for preferences only."""
    given = {
        "submission": new_uuid(),
        "revision": 0,
        "choice": "left",
        "shown_at": 1000.0,
        "watched_at": 5000.0,
        "chosen_at": 6000.0,
        "answered_at": 7000.0,
        "replays": 1,
    }
    return given | values


def answer_form(**values) -> AnswerForm:
    return AnswerForm(**answer_body(**values))


def a_choice(person, **values) -> dict:
    """A whole answer in a participant's condition."""
    return {"choice": "left"} | ({"nothing": True} if person.highlights else {}) | values


def row_counts(database) -> dict[str, int]:
    """How many rows each table has."""
    with database.read() as connection:
        return {
            name: connection.scalar(select(func.count()).select_from(table)) or 0
            for name, table in schema.metadata.tables.items()
        }


def rows(database, table, **values) -> list[dict]:
    """Rows of a table in which columns have these values."""
    query = select(table).where(*(table.c[name] == value for name, value in values.items()))
    with database.read() as connection:
        return [dict(row) for row in connection.execute(query).mappings()]


class World:
    """A study's folder and its database, and a clock that moves when it is told to."""

    def __init__(self, folder, database) -> None:
        self.design = folder.design
        self.material = Material(folder.design, folder.queries, folder.clips)
        self.database = database
        self.now = 1_700_000_000.0

    def invite(self, links: int = 1, cap: int = 100) -> list[str]:
        with self.database.write() as connection:
            return [each.token for each in invite(connection, links, cap, self.now)]

    def join(self, invitation: str | None = None, **identities: str) -> str:
        """Somebody consents; returns their session's token."""
        invitation = invitation or self.invite()[0]
        token = new_token()
        with self.database.write() as connection:
            join(connection, self.design, invitation, identities, token, self.now)
        return token

    def join_as(self, condition: str) -> str:
        """Somebody joins in a condition; somebody else may have to join before."""
        while self.person(token := self.join()).condition != condition:
            pass
        return token

    def person(self, token: str):
        with self.database.read() as connection:
            return find(connection, token)

    def advance(self, token: str) -> None:
        with self.database.write() as connection:
            advance(connection, find(connection, token, to_write=True), self.design, self.now)

    def current(self, token: str) -> int:
        with self.database.read() as connection:
            return current_place(connection, find(connection, token))

    def watch(self, token: str, place: int, seconds: float = 60.0) -> None:
        """A trial is sent to the page, and watched."""
        with self.database.write() as connection:
            mark_served(connection, find(connection, token), place, self.now)
        self.now += seconds
        with self.database.write() as connection:
            person = find(connection, token, to_write=True)
            mark_watched(connection, person, self.material, place, self.now)

    def store(self, token: str, place: int, form: AnswerForm):
        with self.database.write() as connection:
            person = find(connection, token, to_write=True)
            return store_answer(connection, person, self.material, place, form, self.now)

    def answer(self, token: str, place: int, **values):
        """Watch a trial and answer it; `values` say otherwise than a whole answer would."""
        self.watch(token, place)
        return self.store(token, place, answer_form(**a_choice(self.person(token), **values)))

    def go_to(self, token: str, stage: str) -> None:
        """Do what is asked until a stage is reached."""
        while (person := self.person(token)).stage != stage:
            if person.stage in ("practice", "comparisons"):
                self.answer(token, self.current(token))
            else:
                self.advance(token)
