"""Databases for tests: SQLite in a file, and a PostgreSQL server that the tests start themselves.

A test module that needs them says `pytest_plugins = ["servers"]`; every test that asks for
`database` runs on both.
"""

import os
import pwd
import shutil
import subprocess
import tempfile
from contextlib import contextmanager
from itertools import count
from pathlib import Path

import psycopg
import pytest
from sites import Site

from polite.study import schema
from polite.study.database import Database, sqlite_url

KINDS = ("sqlite", "postgresql")
STUDY = "study"
"""The database that has all tables; emptied after each test, which is quicker than a new one."""
QUICK = ("fsync=off", "synchronous_commit=off", "full_page_writes=off", "shared_buffers=16MB")
"""Nothing here needs to survive a power failure."""


class PostgreSQL:
    """A running server that listens on a socket in its own folder."""

    def __init__(self, socket: Path) -> None:
        self.socket = socket
        self._names = count()

    def url(self, name: str) -> str:
        return f"postgresql+psycopg://postgres@/{name}?host={self.socket}"

    def run(self, statement: str) -> list[tuple]:
        """Run a statement as the server's owner, outside a transaction."""
        where = {"host": str(self.socket), "user": "postgres", "dbname": "postgres"}
        with psycopg.connect(**where, autocommit=True) as connection:
            cursor = connection.execute(statement)
            return cursor.fetchall() if cursor.description else []

    def create(self) -> str:
        """Make a database; returns its name."""
        name = f"test{next(self._names)}"
        self.run(f"CREATE DATABASE {name}")
        return name

    def disconnect(self, name: str = STUDY) -> int:
        """Cut all connections to a database, as a server that restarts would; returns how many."""
        return len(
            self.run(
                f"SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = '{name}'"
            )
        )


def _programs() -> Path | None:
    """The folder of the server's programs; Debian keeps them off the PATH."""
    found = shutil.which("initdb")
    newest = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"), key=lambda p: p.parts[-3])
    return Path(found).resolve().parent if found else newest[-1].parent if newest else None


def _owner() -> dict:
    """PostgreSQL refuses to run as root."""
    if os.geteuid() != 0:
        return {}
    try:
        entry = pwd.getpwnam("postgres")
    except KeyError:
        pytest.skip("PostgreSQL does not run as root, and there is no user named postgres")
    return {"user": entry.pw_uid, "group": entry.pw_gid, "extra_groups": []}


@contextmanager
def _running(programs: Path, folder: Path, owner: dict, settings: tuple[str, ...] = QUICK):
    """Make a cluster in a folder and run it."""
    data, log = folder / "data", folder / "log"

    def call(program: str, *arguments: str) -> None:
        done = subprocess.run(
            [programs / program, "-D", data, *arguments],
            cwd=folder,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE if program == "initdb" else subprocess.DEVNULL,
            text=True,
            check=False,
            **owner,
        )
        if done.returncode:
            said = log.read_text() if log.exists() else done.stderr
            raise RuntimeError(f"{program} failed: {said}")

    call("initdb", "-U", "postgres", "-A", "trust", "-E", "UTF8", "--no-locale", "--no-sync")
    given = " ".join(f"-c {setting}" for setting in settings)
    options = f"-k {folder} -c listen_addresses='' {given}"
    call("pg_ctl", "start", "-w", "-l", str(log), "-o", options)
    try:
        yield PostgreSQL(folder)
    finally:
        call("pg_ctl", "stop", "-w", "-m", "immediate")


@pytest.fixture(scope="session")
def postgresql_server():
    """A server of this run's (of this worker's, if there are several); skips without PostgreSQL."""
    with postgresql() as server:
        _migrate(server)
        yield server


@contextmanager
def postgresql(settings: tuple[str, ...] = QUICK):
    """A server as long as it is needed; with no settings it is as safe as PostgreSQL is."""
    programs = _programs()
    if programs is None:
        pytest.skip("PostgreSQL is not installed (Debian: apt-get install postgresql)")
    owner = _owner()
    # Not in pytest's folder: the server's user may not look into it, and its path can be too long
    # for a socket.
    folder = Path(tempfile.mkdtemp(prefix="polite-pg-"))
    try:
        if owner:
            os.chown(folder, owner["user"], owner["group"])
        with _running(programs, folder, owner, settings) as server:
            yield server
    finally:
        shutil.rmtree(folder)


def _migrate(server: PostgreSQL) -> None:
    server.run(f"CREATE DATABASE {STUDY}")
    database = Database(server.url(STUDY))
    database.migrate()
    database.close()


@pytest.fixture(params=KINDS)
def empty_url(request, tmp_path):
    """The URL of a database without any table."""
    if request.param == "sqlite":
        yield sqlite_url(tmp_path / "empty.db")
        return
    server = request.getfixturevalue("postgresql_server")
    name = server.create()
    yield server.url(name)
    server.run(f"DROP DATABASE {name} WITH (FORCE)")


@pytest.fixture(scope="session")
def _sqlite_template(tmp_path_factory):
    path = tmp_path_factory.mktemp("sqlite") / "migrated.db"
    database = Database(sqlite_url(path))
    database.migrate()
    database.forget_traces()
    database.close()
    return path


@pytest.fixture
def sqlite_path(_sqlite_template, tmp_path):
    """A migrated SQLite database without rows."""
    path = tmp_path / "study.db"
    shutil.copyfile(_sqlite_template, path)
    return path


@pytest.fixture
def sqlite_database(sqlite_path):
    """The same, opened."""
    database = Database(sqlite_url(sqlite_path))
    yield database
    database.close()


@pytest.fixture
def postgresql_database(postgresql_server):
    """A migrated PostgreSQL database without rows."""
    database = Database(postgresql_server.url(STUDY))
    yield database
    tables = ", ".join(schema.metadata.tables)
    with database.write() as connection:
        connection.exec_driver_sql(f"TRUNCATE {tables} RESTART IDENTITY")
    database.close()


@pytest.fixture(params=KINDS)
def database(request):
    """A migrated database without rows, of each kind that we support."""
    return request.getfixturevalue(f"{request.param}_database")


@pytest.fixture
def open_site(study_folder, request):
    """Serve the study: `open_site(database, https=…)`."""
    opened = []

    def make(database, **settings) -> Site:
        opened.append(Site(study_folder, database, **settings))
        return opened[-1]

    yield make
    for site in opened:
        site.close()


@pytest.fixture
def site(open_site, sqlite_database):
    """The study on SQLite."""
    return open_site(sqlite_database)
