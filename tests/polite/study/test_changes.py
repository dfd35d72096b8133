"""A study stays what its participants were asked."""

import socket
from dataclasses import replace
from pathlib import Path

import pytest
from alembic import command
from alembic.config import Config
from made_up_study import consistent, made_up_folder
from people import World
from sqlalchemy import inspect

from polite.dataset import MANIFEST, Feedback, save_feedback
from polite.files import sha256
from polite.study import schema
from polite.study.changes import ChangedError, check_unchanged
from polite.study.commands import Export, Status, Withdraw
from polite.study.database import Database
from polite.study.design import parse_design
from polite.study.export import export
from polite.study.folder import StudyFolder
from polite.study.reading import read_records, read_shown
from polite.study.records import Shown, StudyRecords
from polite.study.web.serve import serve
from polite.types import PoliteError

pytest_plugins = ["servers"]

POOL = "a" * 64


@pytest.fixture
def text(study_folder):
    return (study_folder.path / "study.toml").read_text("utf-8")


def check(before: str, now: str, pool: str = POOL) -> None:
    earlier = parse_design(before)
    check_unchanged(parse_design(now), pool, Shown({earlier.sha: earlier}, frozenset({POOL})))


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("participants = 2", "participants = 1", "participants: expected 2"),
        ("comparisons = 3", "comparisons = 2", "comparisons: expected 3"),
        ("repeated = 1", "repeated = 0", "repeated"),
        ("mirrored = 1", "mirrored = 0", "mirrored"),
        ("highlight_length = 3", "highlight_length = 4", "highlight_length"),
        ("participants = 2", "participants = 2\nseed = 1", "seed"),
        ("participants = 2", 'participants = 2\nanswered_by = "robots"', "answered_by"),
        ("participants = 2", "participants = 2\nspeeds = [1.0]", "speeds"),
        ("render_width = 96", "render_width = 98", "env_settings"),
        ("first = 0", "first = 2", "practice"),
        ('expected = "first"', 'expected = "second"', "practice"),
        ('name = "demanding"', 'name = "difficult"', "questions"),
        ('options = ["one", "another"]', 'options = ["one", "other"]', "questions"),
        ("[consent]", "[exclusion]\nfast_seconds = 2.0\n[consent]", "exclusion"),
    ],
)
def test_what_answers_refer_to_may_not_change(text, old, new, named):
    assert text.count(old) == 1
    with pytest.raises(ChangedError, match=f"{named}.*restore it, or make another folder"):
        check(text, text.replace(old, new))


def test_words_may_change(text):
    changed = text
    for old, new in [
        ("How a robot should move", "How robots should move"),
        ("ada@example.org", "bob@example.org"),
        ("It keeps its distance", "It keeps away"),
        ("The second one drives", "The second robot drives"),
        ("segment = 0, start = 2", "segment = 2, start = 1"),
    ]:
        assert changed.count(old) == 1
        changed = changed.replace(old, new)
    check(text, changed + '[completion]\ncode = "C0DE"\n')


def test_a_consent_that_says_something_else_needs_a_new_version(text):
    changed = text.replace("You can stop at any time.", "You can stop.")
    assert changed != text
    with pytest.raises(ChangedError, match=r"consent\.text.*'1'; give the new text a new version"):
        check(text, changed)
    check(text, changed.replace('version = "1"', 'version = "2"'))


def test_a_version_of_long_ago_keeps_its_text(text):
    """A new version must not get a number that an older text has."""
    first = parse_design(text)
    second = parse_design(text.replace('version = "1"', 'version = "2"'))
    other = parse_design(text.replace("You can stop at any time.", "You can stop."))
    shown = Shown({each.sha: each for each in (first, second)}, frozenset({POOL}))
    with pytest.raises(ChangedError, match="'1'"):
        check_unchanged(other, POOL, shown)


def test_the_pool_may_not_change(text):
    with pytest.raises(ChangedError, match="pool: people have compared other segments"):
        check(text, text, "b" * 64)


def test_nobody_has_seen_anything(text):
    check_unchanged(parse_design(text), "b" * 64, Shown({}, frozenset({POOL})))


def test_what_was_shown_is_remembered_until_everybody_has_withdrawn(study_folder, database):
    world = World(study_folder, database)
    with database.write() as connection:
        connection.execute(schema.pools.insert().values(sha=POOL))
    with database.read() as connection:
        assert read_shown(connection) == Shown({}, frozenset({POOL}))
    token = world.join()
    with database.read() as connection:
        shown = read_shown(connection)
        assert read_records(connection).shown == shown
    assert shown == Shown({world.design.sha: world.design}, frozenset({POOL}))
    Withdraw(
        folder=study_folder.path,
        database=database.engine.url.render_as_string(hide_password=False),
        code=world.person(token).code,
    ).run()
    with database.read() as connection:
        assert read_shown(connection).designs == {}


@pytest.fixture
def edited(study_folder, text):
    """The folder of a study that somebody has taken part in, with fewer comparisons than then."""
    database = Database(f"sqlite:///{study_folder.database_path}")
    database.migrate()
    world = World(study_folder, database)
    code = world.person(world.join()).code
    database.close()
    path = study_folder.path / "study.toml"
    path.write_text(text.replace("comparisons = 3", "comparisons = 2"), encoding="utf-8")
    return study_folder.path, code


def test_an_edited_study_is_not_served_or_exported(edited, tmp_path):
    folder, _ = edited
    for run in (
        lambda: serve(StudyFolder(folder), "127.0.0.1", 0, 1, "", False),
        Status(folder=folder).run,
        Export(folder=folder, out=tmp_path / "out").run,
    ):
        with pytest.raises(ChangedError, match="comparisons: expected 3"):
            run()
    assert not (tmp_path / "out").exists()


def test_serving_remembers_the_pool(study_folder, text):
    """It is begun on a port that is taken, so that it ends at once."""

    def try_to_serve() -> str:
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
            with pytest.raises(PoliteError) as refused:
                serve(StudyFolder(study_folder.path), "127.0.0.1", port, 1, "", False)
        return str(refused.value)

    def turn_pairs() -> None:
        feedback = StudyFolder(study_folder.path).feedback
        save_feedback(study_folder.pool_path, Feedback(feedback.pool, feedback.queries[::-1]))

    assert "cannot be served on" in try_to_serve()
    turn_pairs()
    assert "cannot be served on" in try_to_serve()  # nobody has seen the other pairs
    database = Database(f"sqlite:///{study_folder.database_path}")
    World(study_folder, database).join()
    with database.read() as connection:
        pools = read_shown(connection).pools
    database.close()
    assert pools == {StudyFolder(study_folder.path).pool_checksum}
    turn_pairs()
    assert "people have compared other segments" in try_to_serve()


def test_the_command_says_it_in_a_sentence(edited, command_line):
    folder, _ = edited
    done = command_line("serve", folder, "--port", 0)
    assert done.returncode == 2
    assert "comparisons: expected 3" in done.stderr


def test_one_can_withdraw_from_a_study_that_is_damaged(edited):
    folder, code = edited
    for path in (folder / "clips").iterdir():
        path.unlink()
    assert "deleted" in Withdraw(folder=folder, code=code).run()
    with pytest.raises(PoliteError, match="nobody has the code"):
        Withdraw(folder=folder, code=code).run()
    with pytest.raises(PoliteError, match="expected a study's folder, found none"):
        Withdraw(folder=folder / "elsewhere", code=code).run()


def test_the_researchers_page_says_that_the_folder_was_edited(site):
    site.participant("guide")
    researcher = site.researcher()
    assert researcher.get("/researcher/export.zip").status_code == 200
    path = site.folder.path / "study.toml"
    path.write_text(path.read_text("utf-8").replace("comparisons = 3", "comparisons = 2"), "utf-8")
    refused = researcher.get("/researcher/export.zip")
    assert refused.status_code == 409
    assert "comparisons: expected 3" in refused.text


def test_an_export_is_of_the_pool_that_was_shown(tmp_path):
    folder = made_up_folder(tmp_path / "study")
    design = StudyFolder(folder).design
    kept = Shown({design.sha: design}, frozenset({sha256(folder / "pool" / MANIFEST)}))
    records = StudyRecords((consistent(1),), {}, kept)
    export(folder, records, tmp_path / "out")
    feedback = StudyFolder(folder).feedback
    save_feedback(folder / "pool", Feedback(feedback.pool, feedback.queries[::-1]))
    with pytest.raises(ChangedError, match="pool"):
        export(folder, records, tmp_path / "out")
    export(folder, replace(records, shown=Shown()), tmp_path / "out")  # nobody knows what it was


def test_a_database_of_the_first_version_is_brought_up_to_date(empty_url, study_folder):
    config = Config()
    scripts = Path(schema.__file__).parent / "migrations"
    config.set_main_option("script_location", str(scripts))
    old = Database(empty_url)
    with old.write() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, "0001")
        assert not inspect(connection).has_table("pools")
    token = World(study_folder, old).join()
    old.migrate()
    world = World(study_folder, old)
    assert world.person(token).stage == "guide"
    with old.read() as connection:
        assert list(read_shown(connection).designs) == [world.design.sha]
    old.close()
