"""What is stored of people is for nobody else on the machine, and in no log."""

import os
from pathlib import Path

import pytest
from people import World
from sqlalchemy import insert
from sqlalchemy.exc import IntegrityError

from polite.study import schema
from polite.study.identities import write_identities
from polite.study.opening import open_database

pytest_plugins = ["servers"]


def test_nobody_else_on_the_machine_can_read_answers(study_folder):
    database = open_database(study_folder, "")
    World(study_folder, database).join(PROLIFIC_PID="somebody")
    files = list(study_folder.path.glob("study.db*"))
    assert len(files) == 3  # its log, and what its readers share, too
    assert {path.stat().st_mode & 0o777 for path in files} == {0o600}
    database.close()


@pytest.mark.parametrize("before", [None, "an earlier one, open to all"])
def test_nobody_else_on_the_machine_can_read_who_people_are(
    study_folder, sqlite_database, tmp_path, monkeypatch, before
):
    path = tmp_path / "paying.csv"
    if before:
        path.write_text(before, encoding="utf-8")
        path.chmod(0o666)
    opened = []
    monkeypatch.setattr(os, "replace", _noting_modes(opened))
    World(study_folder, sqlite_database).join(PROLIFIC_PID="somebody")
    with sqlite_database.read() as connection:
        write_identities(connection, study_folder.design, path)
    assert "somebody" in path.read_text(encoding="utf-8")
    assert opened == [0o600] and path.stat().st_mode & 0o777 == 0o600


def _noting_modes(modes):
    """`os.replace` that notes how open a file is before it gets its name."""
    replace = os.replace

    def noting(source, target):
        modes.append(Path(source).stat().st_mode & 0o777)
        replace(source, target)

    return noting


def test_an_error_holds_nothing_that_somebody_sent(database):
    row = {"participant": 7, "name": "PROLIFIC_PID", "value": "somebody"}
    with pytest.raises(IntegrityError) as failed, database.write() as connection:
        connection.execute(insert(schema.identities).values(row))
    assert "INSERT INTO identities" in str(failed.value)
    assert "somebody" not in str(failed.value)


def test_who_reads_sees_one_state(study_folder, database):
    """An export that is begun while somebody joins has all of them or nothing."""
    world = World(study_folder, database)
    world.join()
    with database.read() as connection:
        before = [connection.execute(table.select()).all() for table in TABLES]
        world.join()
        assert [connection.execute(table.select()).all() for table in TABLES] == before
    with database.read() as connection:
        assert len(connection.execute(schema.participants.select()).all()) == 2


TABLES = (schema.trials, schema.participants)
