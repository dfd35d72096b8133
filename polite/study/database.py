"""The study's database: SQLite by default, PostgreSQL by its URL."""

from __future__ import annotations

import sqlite3
import threading
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
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
_AGAIN: Final = 0.01
"""Between two attempts to open a new database that somebody else is writing [s]."""
CONNECTIONS: Final = 20
"""Kept open by each process at the most; PostgreSQL allows 100 in all unless it is told more."""
_PRAGMAS: Final = (
    "synchronous = FULL",  # a confirmed answer is on disk, whatever dies then
    "foreign_keys = ON",
    "secure_delete = ON",  # what somebody withdrew is overwritten
)
_MIGRATING: Final = 0x706F6C697465  # a number of our own among a server's advisory locks


class DatabaseError(PoliteError):
    """The database cannot be reached, or is not one of ours."""


class NotStoredError(PoliteError):
    """The database is locked, full or gone; nothing was stored, and trying again may help."""


class _Turn:
    """One writer at a time in this process.

    SQLite would let the others look again and again, at intervals of up to 0.1 s in which nobody
    writes, and give up on those who were unlucky.
    """

    def __init__(self, patience: float) -> None:
        self._patience = patience
        self._lock = threading.Lock()

    def __enter__(self) -> None:
        if not self._lock.acquire(timeout=self._patience):
            raise NotStoredError(f"no turn to write within {self._patience:g} s")

    def __exit__(self, *error: object) -> None:
        self._lock.release()


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
        sqlite = self.engine.dialect.name == "sqlite"
        # PostgreSQL would let each statement see another state.
        same = {} if sqlite else {"isolation_level": "REPEATABLE READ"}
        self._reader = self.engine.execution_options(**same)
        self._turn: AbstractContextManager[None] = _Turn(busy) if sqlite else nullcontext()

    @contextmanager
    def read(self) -> Iterator[Connection]:
        """A connection that sees one state of the data.

        Raises:
            NotStoredError: The database cannot be read now.
        """
        with _translated(), self._reader.connect() as connection:
            yield connection

    @contextmanager
    def write(self, *, at_once: bool = True) -> Iterator[Connection]:
        """A transaction; committed, and on disk, when the block ends without an error.

        Args:
            at_once: Without it SQLite may bring it to the disk with a later transaction. It
                outlives this process all the same, but perhaps not a power failure.

        Raises:
            NotStoredError: The database is locked, full or gone; nothing was stored.
        """
        writer = self.engine.execution_options(writes=True, at_once=at_once)
        with self._turn, _translated(), writer.begin() as connection:
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
                _keep_others_from_migrating(connection)
                _refuse_newer(config, connection)
                config.attributes["connection"] = connection
                command.upgrade(config, "head")
        except (NotStoredError, CommandError) as error:
            raise DatabaseError(f"{self.name}: cannot be used ({one_line(error)})") from error

    def forget_traces(self) -> None:
        """Overwrite what SQLite's log still holds of deleted rows; PostgreSQL's vacuum does it.

        Raises:
            NotStoredError: The disk refuses; the rows are deleted all the same.
        """
        if self.engine.dialect.name == "sqlite":
            with _translated(), self.engine.connect() as connection:
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
        if sqlite and make_url(url).database in (None, "", ":memory:"):
            raise ArgumentError("without a file nothing would be kept")
        settings: dict[str, Any] = {"connect_args": {"timeout": busy}} if sqlite else {}
        engine = create_engine(
            url,
            pool_size=CONNECTIONS,
            max_overflow=0,
            pool_timeout=busy,
            pool_pre_ping=not sqlite,
            hide_parameters=True,  # errors are logged, and hold codes and a panel's names else
            **settings,
        )
    except (ArgumentError, NoSuchModuleError, ImportError) as error:
        raise DatabaseError(
            f"expected a database's URL, sqlite:///FILE or postgresql+psycopg://USER@HOST/NAME "
            f"(extra `postgresql`), got one that cannot be used ({one_line(error)})"
        ) from error
    if sqlite:
        _set_up_sqlite(engine, busy)
    return engine


def _set_up_sqlite(engine: Engine, busy: float) -> None:
    """Set the pragmas, and begin transactions ourselves: Python's sqlite3 would begin them late."""

    @event.listens_for(engine, "connect")
    def connect(raw: sqlite3.Connection, _: object) -> None:
        raw.isolation_level = None
        _keep_a_log(raw, busy)
        for pragma in _PRAGMAS:
            raw.execute(f"PRAGMA {pragma}").close()

    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        # A transaction that reads first and writes then could find that it may not write any more.
        options = connection.get_execution_options()
        if not options.get("writes", False):
            connection.exec_driver_sql("BEGIN")
            return
        level = "FULL" if options["at_once"] else "NORMAL"
        connection.exec_driver_sql(f"PRAGMA synchronous = {level}")
        connection.exec_driver_sql("BEGIN IMMEDIATE")


def _keep_a_log(raw: sqlite3.Connection, busy: float) -> None:
    """Write ahead, so that readers and the writer do not wait for each other.

    A new database is switched to it once, and SQLite gives up at once on whoever meets a writer
    there, however long its timeout is: two processes that open it together would.
    """
    until = time.monotonic() + busy
    while True:
        try:
            raw.execute("PRAGMA journal_mode = WAL").close()
            return
        except sqlite3.OperationalError as error:
            locked = error.sqlite_errorcode & 0xFF == sqlite3.SQLITE_BUSY  # extended codes too
            if not locked or time.monotonic() >= until:
                raise
        time.sleep(_AGAIN)


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


def _keep_others_from_migrating(connection: Connection) -> None:
    """Let the others wait until this transaction ends; SQLite has one writer at a time anyhow."""
    if connection.dialect.name == "postgresql":
        connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({_MIGRATING})")


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
