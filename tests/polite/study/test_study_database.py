import sqlite3
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from importlib.resources import files

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from sqlalchemy import MetaData, inspect, select, text

from polite.study import schema
from polite.study.database import CONNECTIONS, Database, DatabaseError, NotStoredError, sqlite_url

pytest_plugins = ["servers"]

DESIGN = {"sha": "a" * 64, "content": "{}", "first_used": 1.0}

FIRST = {
    "designs": DESIGN,
    "invitations": {"token": "t", "cap": 2, "withdrawn": 1, "created": 1.0},
    "participants": {
        "number": 5,
        "session": "s",
        "code": "c",
        "invitation": "t",
        "condition": "polite",
        "block": 3,
        "design": "a" * 64,
        "consent_version": "1",
        "stage": "done",
        "joined_at": 1.0,
        "last_seen": 3.0,
        "finished_at": 2.0,
    },
    "identities": {"participant": 5, "name": "PROLIFIC_PID", "value": "p"},
    "trials": {
        "participant": 5,
        "place": 0,
        "kind": "main",
        "query": 7,
        "first_is_left": True,
        "served_at": 1.0,
        "watched_at": None,
    },
    "answers": {
        "id": 9,
        "submission": "u",
        "participant": 5,
        "place": 0,
        "revision": 1,
        "choice": "left",
        "good": 4,
        "bad": None,
        "nothing_marked": False,
        "received_at": 2.0,
        "replays": 0,
    },
    "questionnaires": {"participant": 5, "revision": 1, "content": "{}", "received_at": 2.0},
    "withdrawals": {"id": 1, "condition": "baseline", "stage": "guide", "at": 1.0},
}
"""A row of each table as the first version had it."""


@pytest.fixture
def empty(empty_url):
    database = Database(empty_url)
    yield database
    database.close()


def differences(database: Database) -> list:
    with database.read() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        return compare_metadata(context, schema.metadata)


def test_migrating_makes_the_tables_that_the_code_describes(empty):
    empty.migrate()
    assert differences(empty) == []


def test_a_missing_column_would_be_seen(empty):
    empty.migrate()
    with empty.write() as connection:
        connection.execute(text("ALTER TABLE withdrawals DROP COLUMN stage"))
    assert [kind for kind, *_ in differences(empty)] == ["add_column"]


def test_migrating_again_changes_nothing_and_keeps_rows(database):
    with database.write() as connection:
        connection.execute(schema.designs.insert().values(DESIGN))
    database.migrate()
    with database.read() as connection:
        rows = connection.execute(select(schema.designs)).mappings().all()
    assert [dict(row) for row in rows] == [DESIGN]


def test_the_first_version_is_brought_up_to_date_and_keeps_its_rows(empty):
    """Whatever versions come: of a row that was stored then, every value is still there."""
    config = Config()
    config.set_main_option("script_location", str(files("polite.study") / "migrations"))
    with empty.write() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, "0001")
        tables = MetaData()
        tables.reflect(connection, only=FIRST.keys())
        for name, row in FIRST.items():
            connection.execute(tables.tables[name].insert().values(row))
    empty.migrate()
    assert differences(empty) == []
    with empty.read() as connection:
        for name, row in FIRST.items():
            kept = connection.execute(select(schema.metadata.tables[name])).mappings().one()
            assert {column: kept[column] for column in row} == row


def test_a_newer_version_is_refused(empty):
    empty.migrate()
    with empty.write() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    with pytest.raises(DatabaseError, match=r"9999.*install the version that made it"):
        empty.migrate()


def test_four_may_migrate_at_once(empty_url):
    """Worker processes do so; each has connections of its own."""
    databases = [Database(empty_url) for _ in range(4)]
    together = threading.Barrier(4)

    def migrate(database: Database) -> None:
        together.wait()
        database.migrate()

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(migrate, databases))
    assert differences(databases[0]) == []
    for database in databases:
        database.close()


@pytest.fixture
def new_file(tmp_path):
    """A database without a log yet, and somebody who is writing to it."""
    writer = sqlite3.connect(tmp_path / "new.db", isolation_level=None)
    writer.execute("CREATE TABLE first (x)")
    writer.execute("BEGIN IMMEDIATE")
    yield sqlite_url(tmp_path / "new.db"), writer
    writer.close()


def test_whoever_opens_a_new_file_waits_for_its_writer(new_file, monkeypatch):
    """SQLite itself would not: it cannot switch to a log meanwhile."""
    url, writer = new_file
    waited = []

    def writer_ends(seconds):
        waited.append(seconds)
        writer.execute("COMMIT")

    monkeypatch.setattr("polite.study.database.time.sleep", writer_ends)
    database = Database(url)
    with database.read() as connection:
        assert connection.exec_driver_sql("PRAGMA journal_mode").scalar() == "wal"
    assert len(waited) == 1
    database.close()


def test_nobody_waits_for_ever_to_open_a_new_file(new_file):
    database = Database(new_file[0], busy=0.05)
    with pytest.raises(NotStoredError, match="locked"), database.read():
        pass
    database.close()


def test_a_transaction_is_stored_whole_or_not_at_all(database):
    with pytest.raises(ZeroDivisionError), database.write() as connection:
        connection.execute(schema.designs.insert().values(DESIGN))
        1 / 0  # noqa: B018
    with database.read() as connection:
        assert connection.execute(select(schema.designs)).all() == []


def test_a_row_must_belong_to_somebody(database):
    """Foreign keys are enforced, on SQLite too."""
    row = {"participant": 7, "name": "PROLIFIC_PID", "value": "x"}
    with pytest.raises(Exception, match=r"(?i)foreign key"), database.write() as connection:
        connection.execute(schema.identities.insert().values(row))


def test_forty_threads_find_a_connection(database):
    """As many as the server has; they wait for each other's transactions only."""
    together = threading.Barrier(40)

    def use(index: int) -> None:
        together.wait()
        with database.write() as connection:
            row = {"token": str(index), "cap": 1, "withdrawn": 0, "created": 0.0}
            connection.execute(schema.invitations.insert().values(row))
        with database.read() as connection:
            assert connection.execute(select(schema.invitations)).first()

    with ThreadPoolExecutor(40) as pool:
        list(pool.map(use, range(40)))
    with database.read() as connection:
        assert len(connection.execute(select(schema.invitations)).all()) == 40


def test_sqlite_is_set_up_to_keep_what_it_confirms(sqlite_database):
    with sqlite_database.read() as connection:
        seen = {
            name: connection.exec_driver_sql(f"PRAGMA {name}").scalar()
            for name in ("journal_mode", "synchronous", "foreign_keys", "secure_delete")
        }
    assert seen == {"journal_mode": "wal", "synchronous": 2, "foreign_keys": 1, "secure_delete": 1}


def test_who_waits_for_a_connection_too_long_is_told_so(sqlite_path):
    database = Database(sqlite_url(sqlite_path), busy=0.05)
    with ExitStack() as held:
        for _ in range(CONNECTIONS):
            held.enter_context(database.read())
        with pytest.raises(NotStoredError, match="QueuePool"), database.read():
            pass
    with database.read() as connection:
        assert connection.execute(select(schema.designs)).all() == []
    database.close()


@pytest.mark.parametrize(
    "url",
    ["", "study.db", "nosuch://here", "sqlite+nosuch:///x", "sqlite://", "sqlite:///:memory:"],
)
def test_a_url_that_is_none_is_refused(url):
    with pytest.raises(DatabaseError, match="expected a database's URL"):
        Database(url)


def test_a_password_is_not_shown(tmp_path):
    database = Database("postgresql+psycopg://ada:geheim@localhost:1/study?connect_timeout=1")
    with pytest.raises(DatabaseError) as caught:
        database.migrate()
    assert "geheim" not in str(caught.value) and "localhost" in str(caught.value)
    database.close()


def test_a_file_that_is_no_database_is_refused(tmp_path):
    (tmp_path / "study.db").write_bytes(b"This is a letter, not a database. " * 50)
    database = Database(sqlite_url(tmp_path / "study.db"))
    with pytest.raises(DatabaseError, match="not a database"):
        database.migrate()
    database.close()


def test_a_locked_database_says_so(sqlite_path):
    holder, other = (Database(sqlite_url(sqlite_path), busy=0.05) for _ in range(2))
    with holder.write(), pytest.raises(NotStoredError, match="locked"), other.write():
        pass
    holder.close()
    other.close()


def test_tables_are_those_of_the_code(database):
    names = set(inspect(database.engine).get_table_names())
    assert names == {"alembic_version", *schema.metadata.tables}
