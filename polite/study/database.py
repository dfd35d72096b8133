"""The study's database: SQLite by default, PostgreSQL by its URL."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from alembic.util.exc import CommandError
from sqlalchemy import Connection, Engine, create_engine, event
from sqlalchemy.engine import make_url
from sqlalchemy.exc import (
    ArgumentError,
    DBAPIError,
    IntegrityError,
    NoSuchModuleError,
    TimeoutError,
)

from polite.files import one_line
from polite.types import PoliteError

BUSY: Final = 5.0
"""How long to wait for somebody else's write [s]."""
_PRAGMAS: Final = (
    "journal_mode = WAL",  # readers and the writer do not wait for each other
    "synchronous = FULL",  # a confirmed answer is on disk, whatever dies then
    "foreign_keys = ON",
    "secure_delete = ON",  # what somebody withdrew is overwritten
)


class DatabaseError(PoliteError):
    """The database cannot be reached, or is not one of ours."""


class NotStoredError(PoliteError):
    """The database is locked, full or gone; nothing was stored, and trying again may help."""


class Database:
    """Connections to a study's database, each a transaction that is stored whole or not at all."""

    def __init__(self, url: str, *, busy: float = BUSY) -> None:
        """Prepare connections; `migrate` makes the tables.

        Args:
            url: As SQLAlchemy reads it: `sqlite:///study.db`, `postgresql+psycopg://…`.
            busy: How long to wait for somebody else's write [s].

        Raises:
            DatabaseError: The URL is none, or its driver is not installed.
        """
        self.engine = _engine(url, busy)

    @contextmanager
    def read(self) -> Iterator[Connection]:
        """A connection that sees one state of the data.

        Raises:
            NotStoredError: The database cannot be read now.
        """
        with _translated(), self.engine.connect() as connection:
            yield connection

    @contextmanager
    def write(self) -> Iterator[Connection]:
        """A transaction; committed, and on disk, when the block ends without an error.

        Raises:
            NotStoredError: The database is locked, full or gone; nothing was stored.
        """
        writer = self.engine.execution_options(writes=True)
        with _translated(), writer.begin() as connection:
            yield connection

    def migrate(self) -> None:
        """Make the tables, or bring those of an older version up to date; nothing is dropped.

        Raises:
            DatabaseError: The database cannot be reached, or a newer version has made it.
        """
        config = Config()
        scripts = Path(__file__).parent / "migrations"
        config.set_main_option("script_location", str(scripts).replace("%", "%%"))
        try:
            with self.write() as connection:
                _refuse_newer(config, connection)
                config.attributes["connection"] = connection
                command.upgrade(config, "head")
        except (NotStoredError, CommandError) as error:
            raise DatabaseError(f"{self.name}: cannot be used ({one_line(error)})") from error

    def forget_traces(self) -> None:
        """Overwrite what SQLite's log still holds of deleted rows; PostgreSQL's vacuum does it."""
        if self.engine.dialect.name == "sqlite":
            with self.engine.connect() as connection:
                connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")

    @property
    def name(self) -> str:
        """The URL without a password."""
        return self.engine.url.render_as_string(hide_password=True)

    def close(self) -> None:
        """Give all connections back."""
        self.engine.dispose()


def sqlite_url(path: Path) -> str:
    """The URL of a database in a file."""
    return f"sqlite:///{path.absolute()}"


def _engine(url: str, busy: float) -> Engine:
    try:
        sqlite = make_url(url).get_backend_name() == "sqlite"
        settings: dict[str, Any] = {"connect_args": {"timeout": busy}} if sqlite else {}
        engine = create_engine(url, pool_pre_ping=not sqlite, **settings)
    except (ArgumentError, NoSuchModuleError, ImportError) as error:
        raise DatabaseError(
            f"expected a database's URL, sqlite:///FILE or postgresql+psycopg://USER@HOST/NAME "
            f"(extra `postgresql`), got one that cannot be used ({one_line(error)})"
        ) from error
    if sqlite:
        _set_up_sqlite(engine)
    return engine


def _set_up_sqlite(engine: Engine) -> None:
    """Set the pragmas, and begin transactions ourselves: Python's sqlite3 would begin them late."""

    @event.listens_for(engine, "connect")
    def connect(raw: sqlite3.Connection, _: object) -> None:
        raw.isolation_level = None
        for pragma in _PRAGMAS:
            raw.execute(f"PRAGMA {pragma}").close()

    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        # A transaction that reads first and writes then could find that it may not write any more.
        writes = connection.get_execution_options().get("writes", False)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


@contextmanager
def _translated() -> Iterator[None]:
    """Turn the drivers' errors into ours; a broken rule of the schema is a bug and stays one."""
    try:
        yield
    except IntegrityError:
        raise
    except (DBAPIError, TimeoutError) as error:
        reason = getattr(error, "orig", None) or error
        raise NotStoredError(f"the database says: {one_line(reason)}") from error


def _refuse_newer(config: Config, connection: Connection) -> None:
    """Refuse a database whose version is not among ours.

    Raises:
        DatabaseError: With what to do.
    """
    current = MigrationContext.configure(connection).get_current_revision()
    known = {script.revision for script in ScriptDirectory.from_config(config).walk_revisions()}
    if current is not None and current not in known:
        raise DatabaseError(
            f"the database has schema version {current}, which this version of socialnav-polite "
            f"does not know (newest known: {max(known)}); install the version that made it"
        )
