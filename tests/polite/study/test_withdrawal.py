import json
import os
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import pytest
from people import World, row_counts, rows
from sqlalchemy import event

import polite.study.export
from polite.study import schema
from polite.study.commands import Export
from polite.study.database import Database, sqlite_url
from polite.study.errors import RefusedError
from polite.study.invitations import list_invitations
from polite.study.participants import find
from polite.study.questionnaire import store_questionnaire
from polite.study.reading import read_records
from polite.study.withdrawal import EXPORT, CopyLeftError, by_code, withdraw_everywhere

pytest_plugins = ["servers"]

SECRET = "Mx-4711-Qy: what only one person wrote"
PANEL = "Zz5f3c9a77Kk"


@pytest.fixture
def world(study_folder, database):
    return World(study_folder, database)


def finish(world, token: str, comment: str = SECRET) -> None:
    """Go to the end, the questionnaire included."""
    world.go_to(token, "questions")
    values = {"demanding": 3.0, "group": "one", "comment": comment}
    with world.database.write() as connection:
        person = find(connection, token, to_write=True)
        store_questionnaire(connection, person, world.design, values, world.now)


def withdraw(world, folder, code: str) -> bool:
    return withdraw_everywhere(folder, world.database, by_code(code), world.now)


def everything_of(world, number: int) -> list[dict]:
    """All rows, of all tables, that belong to a participant."""
    tables = [t for t in schema.metadata.sorted_tables if "participant" in t.c]
    assert len(tables) == 4
    found = [row for table in tables for row in rows(world.database, table, participant=number)]
    return found + rows(world.database, schema.participants, number=number)


def test_every_row_goes_and_nobody_elses_is_touched(world, tmp_path):
    leaving, staying = world.join(PROLIFIC_PID=PANEL), world.join(PROLIFIC_PID="other")
    for token in (leaving, staying):
        finish(world, token)
    person, other = world.person(leaving), world.person(staying)
    kept = everything_of(world, other.number)
    assert len(everything_of(world, person.number)) == len(kept) > 10

    assert withdraw(world, tmp_path, person.code)

    assert everything_of(world, person.number) == []
    assert everything_of(world, other.number) == kept
    (left,) = rows(world.database, schema.withdrawals)
    assert (left["condition"], left["stage"], left["at"]) == (person.condition, "done", world.now)
    with pytest.raises(RefusedError, match="deleted"):
        world.person(leaving)


def test_nothing_left_tells_of_them(world, tmp_path):
    token = world.join(PROLIFIC_PID=PANEL)
    finish(world, token)
    code = world.person(token).code
    withdraw(world, tmp_path, code)
    with world.database.read() as connection:
        text = json.dumps(
            [
                [str(value) for value in row]
                for table in schema.metadata.sorted_tables
                for row in connection.execute(table.select())
            ]
        )
    for trace in (SECRET, PANEL, code, token):
        assert trace not in text


def test_sqlites_files_hold_no_trace(study_folder, sqlite_database, sqlite_path):
    world = World(study_folder, sqlite_database)
    tokens = [world.join(PROLIFIC_PID=f"{PANEL}{n}") for n in range(4)]
    for n, token in enumerate(tokens):
        finish(world, token, f"{SECRET} {n}. " + "And more. " * 400)

    def traces() -> set[str]:
        files = sorted(sqlite_path.parent.glob("study.db*"))
        assert {path.name for path in files} >= {"study.db", "study.db-wal"}
        content = b"".join(path.read_bytes() for path in files)
        marks = [f"{SECRET} {n}" for n in range(4)] + [f"{PANEL}{n}" for n in range(4)]
        return {mark for mark in marks if mark.encode() in content}

    assert len(traces()) == 8
    for n in (1, 3):
        assert withdraw(world, sqlite_path.parent, world.person(tokens[n]).code)
    assert traces() == {f"{what}{n}" for n in (0, 2) for what in (f"{SECRET} ", PANEL)}


def test_the_log_is_cut_when_the_readers_have_left(study_folder, sqlite_database, sqlite_path):
    """Somebody who reads meanwhile still sees the old rows, in SQLite's log."""
    world = World(study_folder, sqlite_database)
    token = world.join()
    finish(world, token)
    code = world.person(token).code
    reading, cutting = threading.Event(), threading.Event()

    def read() -> None:
        with sqlite_database.read() as connection:
            connection.execute(schema.questionnaires.select()).all()
            reading.set()
            assert cutting.wait(30)

    @event.listens_for(sqlite_database.engine, "before_cursor_execute")
    def notice(connection, cursor, statement, *more) -> None:
        if "wal_checkpoint" in statement:
            cutting.set()

    with ThreadPoolExecutor(1) as pool:
        reader = pool.submit(read)
        assert reading.wait(30)
        assert withdraw(world, sqlite_path.parent, code)
        reader.result()
    assert SECRET.encode() not in (sqlite_path.parent / "study.db-wal").read_bytes()
    assert SECRET.encode() not in sqlite_path.read_bytes()


def test_a_code_is_read_however_it_is_typed(world, tmp_path):
    code = world.person(world.join()).code
    assert not withdraw(world, tmp_path, code[:-1])
    assert withdraw(world, tmp_path, f" {code.lower().replace('-', ' ')} ")
    assert not withdraw(world, tmp_path, code)


def test_an_unknown_code_changes_nothing(world, tmp_path):
    world.join()
    before = row_counts(world.database)
    (tmp_path / EXPORT).mkdir()
    for code in ("", "AAAA-AAAA-AAAA-AAAA", "%", "' OR 1=1 --", "\x00", "é" * 300):
        assert not withdraw(world, tmp_path, code)
    assert row_counts(world.database) == before and (tmp_path / EXPORT).is_dir()


def test_the_studys_own_export_goes_too(world, tmp_path):
    (tmp_path / EXPORT).mkdir()
    (tmp_path / EXPORT / "answers.csv").write_text(SECRET)
    assert withdraw(world, tmp_path, world.person(world.join()).code)
    assert not (tmp_path / EXPORT).exists()


@pytest.fixture
def stubborn(monkeypatch):
    """A file of this name cannot be removed, by anybody."""
    unlink = os.unlink

    def refuse(path, **where):
        if os.fspath(path).endswith("open elsewhere.csv"):
            raise PermissionError(13, "Permission denied", path)
        unlink(path, **where)

    monkeypatch.setattr(os, "unlink", refuse)


def an_export(folder):
    """The study's own export, with a file that the researcher has put there."""
    (folder / EXPORT / "data").mkdir(parents=True)
    for name in ("answers.csv", "open elsewhere.csv", "data/answers.jsonl"):
        (folder / EXPORT / name).write_text(SECRET)
    return folder / EXPORT


def test_a_copy_that_cannot_be_removed_is_not_passed_over(world, tmp_path, stubborn):
    export, token = an_export(tmp_path), world.join()
    number, code = world.person(token).number, world.person(token).code
    message = f"all that is stored is deleted, but {export} could not be removed .Permission denied"
    with pytest.raises(CopyLeftError, match=message):
        withdraw(world, tmp_path, code)
    assert everything_of(world, number) == []
    assert [path.name for path in export.iterdir()] == ["open elsewhere.csv"]
    assert not withdraw(world, tmp_path, code)


def test_an_export_that_is_kept_elsewhere_is_not_passed_over(world, tmp_path):
    """`export` can lead to a folder that many use; we delete nothing there."""
    (tmp_path / "shared").mkdir()
    (tmp_path / EXPORT).symlink_to(tmp_path / "shared")
    with pytest.raises(CopyLeftError, match=r"could not be removed .*symbolic link"):
        withdraw(world, tmp_path, world.person(world.join()).code)


def test_the_page_says_so_and_the_researcher_is_told(site, stubborn, caplog):
    visitor, export = site.participant("done"), an_export(site.folder.path)
    code, number = visitor.person.code, visitor.person.number
    visitor.load("/withdraw")
    page = visitor.post("/withdraw", code=code, confirm="yes")
    assert page.status_code == 200
    text = " ".join(page.text.split())
    assert "What is stored of you is deleted, but a copy" in text
    assert f"Please write to {site.design.contact}" in text
    assert "Everything that you answered is deleted" not in text
    assert everything_of(site, number) == []
    (said,) = (record for record in caplog.records if record.name == "polite.study")
    assert said.levelname == "ERROR" and f"{export} could not be removed" in said.getMessage()
    assert code not in caplog.text


def test_the_command_says_what_to_delete_by_hand(study_folder, stubborn, refused):
    export = an_export(study_folder.path)
    with opened(study_folder) as world:
        code = world.person(world.join()).code
    said = refused(study_folder.path, code)
    assert f"{export} could not be removed (Permission denied); delete it by hand" in said


@contextmanager
def opened(folder):
    """The database of the study's folder, which the commands use."""
    database = Database(sqlite_url(folder.database_path))
    database.migrate()
    yield World(folder, database)
    database.close()


@pytest.fixture
def refused(command_line):
    """What `polite study withdraw` says when it cannot."""

    def call(*arguments):
        done = command_line("study", "withdraw", *arguments)
        assert done.returncode == 2
        return done.stderr

    return call


@pytest.mark.parametrize("how", [["--identity", f"PROLIFIC_PID={PANEL}"], ["--participant", "2"]])
def test_somebody_who_has_lost_their_code_can_be_deleted(study_folder, command_line, refused, how):
    with opened(study_folder) as world:
        world.join(PROLIFIC_PID=f"{PANEL}2", STUDY_ID="s")
        world.join(PROLIFIC_PID=PANEL, STUDY_ID="s")
        world.join()
    assert "deleted" in command_line("study", "withdraw", study_folder.path, *how).stdout
    assert "nobody has" in refused(study_folder.path, *how)
    with opened(study_folder) as world:
        left = [row["number"] for row in rows(world.database, schema.participants)]
    assert left == [1, 3]


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ([], "expected one of CODE, --identity and --participant"),
        (["AAAA", "--participant", "1"], "expected one of CODE, --identity and --participant"),
        (["--identity", "workerId"], "--identity: expected NAME=VALUE with a name of PROLIFIC_PID"),
        (["--identity", "name=Ada"], "--identity: expected NAME=VALUE with a name of PROLIFIC_PID"),
        (["--identity", "hitId="], "--identity: expected NAME=VALUE with a name of PROLIFIC_PID"),
        (["--identity", "workerId=nobody"], "nobody has workerId=nobody"),
        (["--participant", "7"], "nobody has the number 7"),
        (["--identity", "STUDY_ID=s"], "participants 1, 2 are meant; give the number of one"),
    ],
)
def test_who_is_meant_must_be_clear(study_folder, refused, how, message):
    with opened(study_folder) as world:
        for name in "ab":
            world.join(PROLIFIC_PID=name, STUDY_ID="s")
        before = row_counts(world.database)
        assert message in refused(study_folder.path, *how)
        assert row_counts(world.database) == before


def test_who_withdraws_while_an_export_is_written_is_not_in_it(study_folder, monkeypatch):
    def write(folder, records, out):
        seen.append([person.number for person in records.participants])
        made = export(folder, records, out)
        if len(seen) == 1:
            assert withdraw(world, folder, codes[0])
        return made

    export, seen = polite.study.export.export, []
    monkeypatch.setattr(polite.study.export, "export", write)
    paying = study_folder.path / "paying.csv"
    with opened(study_folder) as world:
        tokens = [world.join(PROLIFIC_PID=f"{PANEL}{n}") for n in (1, 2)]
        codes = [world.person(token).code for token in tokens]
        out = Export(folder=study_folder.path, identities=paying).run()
    assert seen == [[1, 2], [2]]
    assert out == study_folder.path / EXPORT
    table = (out / "participants.csv").read_text("utf-8").splitlines()
    assert [line.split(",")[0] for line in table] == ["participant", "2"]
    assert f"{PANEL}1" not in paying.read_text("utf-8")


def test_nor_in_the_one_of_the_researchers_page(site, monkeypatch):
    def pack(folder, records):
        seen.append(len(records.participants))
        if len(seen) == 1:
            assert withdraw(site, folder, code)
        return export_zip(folder, records)

    export_zip, seen = polite.study.export.export_zip, []
    monkeypatch.setattr("polite.study.web.researcher.export_zip", pack)
    code = site.participant("guide").person.code
    site.participant("guide")
    assert site.researcher().get("/researcher/export.zip").status_code == 200
    assert seen == [2, 1]


def test_their_block_is_free_again_and_their_number_is_not(world, tmp_path):
    tokens = [world.join() for _ in range(2 * world.design.participants)]
    people = [world.person(token) for token in tokens]
    assert withdraw(world, tmp_path, people[-1].code)
    new = world.person(world.join())
    assert (new.condition, new.block) == (people[-1].condition, people[-1].block)
    assert new.number == people[-1].number + 1


def test_a_link_stays_used_by_who_withdrew(world, tmp_path):
    """As the page says before it deletes anything."""
    (personal,), (shared,) = world.invite(cap=1), world.invite(cap=2)
    for link in (personal, shared):
        assert withdraw(world, tmp_path, world.person(world.join(link)).code)
    with pytest.raises(RefusedError, match="has been used"):
        world.join(personal)
    world.join(shared)
    with pytest.raises(RefusedError, match="has been used"):
        world.join(shared)
    with world.database.read() as connection:
        used = {each.token: each.used for each in list_invitations(connection)}
    assert used == {personal: 1, shared: 2}


def test_records_count_them_and_say_no_more(world, tmp_path):
    tokens = [world.join() for _ in range(3)]
    gone = [world.person(token) for token in tokens[:2]]
    for person in gone:
        withdraw(world, tmp_path, person.code)
    with world.database.read() as connection:
        records = read_records(connection)
    assert [p.number for p in records.participants] == [3]
    assert sum(records.withdrawn.values()) == 2
    assert set(records.withdrawn) == {person.condition for person in gone}
