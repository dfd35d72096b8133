"""The commands around a study with people; what they need is loaded when one of them runs."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro
from rich.console import Console

from polite.types import PoliteError

if TYPE_CHECKING:
    from sqlalchemy import ColumnElement

    from polite.study.database import Database
    from polite.study.folder import StudyFolder
    from polite.study.records import StudyRecords

Folder = Annotated[Path, tyro.conf.Positional]


@dataclass(frozen=True, kw_only=True)
class _Stored:
    """Where a study's answers are."""

    folder: Folder
    """The study's folder, as `polite study new` makes it."""
    database: str = ""
    """URL of the database, as postgresql+psycopg://user@host/name (extra `postgresql`); else the
    environment's POLITE_DATABASE, and without that the file study.db in the folder."""

    @contextmanager
    def opened(self, *, whole: bool = True) -> Iterator[tuple[StudyFolder, Database]]:
        """The study, and its database as long as it is needed.

        Args:
            whole: All parts must be there, and be those that people took part in.

        Raises:
            PoliteError: They are not, or the database cannot be used.
        """
        with web_extra():
            from polite.study.folder import StudyFolder
            from polite.study.opening import check_study, open_database

        folder = StudyFolder(self.folder)
        (folder.check if whole else folder.check_there)()
        database = open_database(folder, self.database)
        try:
            if whole:
                check_study(folder, database)
            yield folder, database
        finally:
            database.close()


@dataclass(frozen=True, kw_only=True)
class Serve(_Stored):
    """Serve a study's pages to participants and to the researcher, until Ctrl+C."""

    port: int = 8000
    """Port to listen on."""
    host: str = "127.0.0.1"
    """Address to listen on; 0.0.0.0 for every network that this machine is in."""
    workers: int = 1
    """Processes that answer; several are worth it with PostgreSQL."""
    https: bool = False
    """Browsers reach the pages by https only, through a proxy on this machine: cookies are then
    sent by https only."""

    def run(self) -> str:
        """Serve; returns what to print at the end."""
        if self.workers < 1:
            raise PoliteError(f"workers: expected at least 1, got {self.workers}")
        with web_extra():
            from polite.study.folder import StudyFolder
            from polite.study.web.serve import serve

        folder = StudyFolder(self.folder)
        serve(folder, self.host, self.port, self.workers, self.database, self.https)
        return "stopped; go on with the same command"


@dataclass(frozen=True, kw_only=True)
class Status(_Stored):
    """Say how a study stands: progress, dropout, catch pairs, answers, times."""

    def run(self) -> str:
        """Print the tables; returns what to print after them."""
        with self.opened() as (folder, database):
            from polite.study.reading import read_records
            from polite.study.summary import summarise
            from polite.study.terminal import print_sections

            with database.read() as connection:
                records = read_records(connection)
            print_sections(summarise(records, folder.design, time.time()), Console())
            return f"{folder.path}, {database.name}"


@dataclass(frozen=True, kw_only=True)
class Invite(_Stored):
    """Make invitation links, one for each participant or one for many, and print them."""

    links: int = 1
    """How many links."""
    people: int = 1
    """How many people may join by each."""
    base: str = "http://localhost:8000"
    """How participants reach the server."""

    def run(self) -> str:
        """Make them; returns the links, one a line."""
        with self.opened() as (_, database):
            from polite.study.invitations import invite

            with database.write() as connection:
                made = invite(connection, self.links, self.people, time.time())
            return "\n".join(self.base.rstrip("/") + invitation.path for invitation in made)


@dataclass(frozen=True, kw_only=True)
class Export(_Stored):
    """Write all answers into a folder: the learner's data, tables, and a data dictionary.

    What panels call the participants is in none of these files.
    """

    out: Path | None = None
    """The folder; else `export` in the study's, which is removed when somebody withdraws."""
    identities: Path | None = None
    """Also write what panels call the participants, and their completion codes, to this file
    (.csv), to pay them. Keep it apart from the answers."""

    def run(self) -> Path:
        """Write; returns the folder."""
        with self.opened() as (folder, database):
            from polite.study.export import export
            from polite.study.identities import write_identities
            from polite.study.reading import make_of_records
            from polite.study.withdrawal import EXPORT

            def write(records: StudyRecords) -> Path:
                if self.identities:
                    with database.read() as connection:
                        write_identities(connection, folder.design, self.identities)
                return export(folder.path, records, self.out or folder.path / EXPORT)

            return make_of_records(database, write)


@dataclass(frozen=True, kw_only=True)
class Withdraw(_Stored):
    """Delete everything that a participant answered.

    Give their withdrawal code, or, for somebody who has lost it, --identity or --participant.
    """

    code: Annotated[str | None, tyro.conf.Positional] = None
    """The participant's code."""
    identity: str | None = None
    """What their panel calls them: NAME=VALUE, as PROLIFIC_PID=5f3c or workerId=A1B2."""
    participant: int | None = None
    """Their number in this study, as in the exported tables."""

    def run(self) -> str:
        """Delete; returns what to print.

        Raises:
            PoliteError: Nobody or not only one is meant, or an export could not be removed.
        """
        with self.opened(whole=False) as (folder, database):  # a damaged clip is no obstacle
            from polite.study.withdrawal import withdraw_everywhere

            who, said = self._who()
            if not withdraw_everywhere(folder.path, database, who, time.time()):
                raise PoliteError(f"nobody has {said}; compare it with the person's")
            return "deleted; export again, and delete older exports that you keep elsewhere"

    def _who(self) -> tuple[ColumnElement[bool], str]:
        """Who is meant, and by what.

        Raises:
            PoliteError: That is not said in exactly one way.
        """
        from polite.study.invitations import PANEL_FIELDS
        from polite.study.withdrawal import by_code, by_identity, by_number

        if (self.code, self.identity, self.participant).count(None) != 2:
            raise PoliteError("expected one of CODE, --identity and --participant")
        if self.code is not None:
            return by_code(self.code), f"the code {self.code}"
        if self.participant is not None:
            return by_number(self.participant), f"the number {self.participant}"
        name, _, value = str(self.identity).partition("=")
        if name not in PANEL_FIELDS or not value:
            names = ", ".join(PANEL_FIELDS)
            raise PoliteError(
                f"--identity: expected NAME=VALUE with a name of {names}, got {self.identity}"
            )
        return by_identity(name, value), f"{name}={value}"


@contextmanager
def web_extra() -> Iterator[None]:
    """Say what to install where a package of the extra `web` is missing.

    Raises:
        PoliteError: One is.
    """
    try:
        yield
    except ImportError as error:
        if (error.name or "").partition(".")[0] == "polite":
            raise
        raise PoliteError(
            f"this needs the package {error.name}; "
            "install it with: pip install 'socialnav-polite[web]'"
        ) from error
