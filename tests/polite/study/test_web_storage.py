"""What participants see while the database cannot store, and that nothing is lost by it."""

import re
import sqlite3
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing

import pytest
from people import a_choice, answer_body, row_counts
from sites import FILLED_IN
from sqlalchemy import event

from polite.study.database import Database, sqlite_url

pytest_plugins = ["servers"]


@pytest.fixture
def impatient(sqlite_path):
    """A database that waits for others no longer than a blink."""
    database = Database(sqlite_url(sqlite_path), busy=0.05)
    yield database
    database.close()


def an_answer(site):
    """Somebody who has watched, where their answer goes, and the answer, which is not sent yet."""
    visitor = site.participant()
    place = visitor.place
    visitor.watch(place)
    return visitor, f"/api/trials/{place}/answers", answer_body(**a_choice(visitor.person))


def assert_refused_for_now(answer) -> None:
    assert answer.status_code == 503 and int(answer.headers["retry-after"]) >= 1
    assert "cannot store anything just now. Please try again" in answer.text


def assert_kept(visitor, **fields: str) -> None:
    """The questionnaire is not stored, and is shown again with what was filled in."""
    page = visitor.post("/questions", **fields)
    assert page.status_code == 503 and int(page.headers["retry-after"]) >= 1
    assert "Your answers are not stored yet" in page.text and "send it again" in page.text
    assert re.search(r'name="demanding" value="3"[^>]* checked>', page.text)
    assert f">{fields['comment']}</textarea>" in page.text


def test_a_locked_database(open_site, impatient, sqlite_path):
    site = open_site(impatient)
    visitor, url, body = an_answer(site)
    filling, joining = site.participant("questions"), site.visitor()
    link = site.invite()[0]
    joining.load(f"/join/{link}")
    before = row_counts(site.database)
    with closing(sqlite3.connect(sqlite_path, isolation_level=None)) as other:
        other.execute("BEGIN EXCLUSIVE").close()
        for _ in range(2):
            answer = visitor.send(url, body)
            assert_refused_for_now(answer)
            assert answer.json().keys() == {"message"}
        assert_kept(filling, **FILLED_IN)
        assert_kept(filling, **(FILLED_IN | {"group": ""}))
        assert_refused_for_now(joining.post("/consent", version="1", agree="yes"))
        code = visitor.person.code
        assert_refused_for_now(visitor.post("/withdraw", code=code, confirm="yes"))
        assert visitor.get("/api/state").status_code == 200  # reading goes on
    assert row_counts(site.database) == before
    assert visitor.send(url, body).json()["stored"]
    assert filling.post("/questions", **FILLED_IN).status_code == 303
    assert joining.post("/consent", version="1", agree="yes").status_code == 303
    after = row_counts(site.database)
    for table in ("answers", "questionnaires", "participants"):
        assert after[table] == before[table] + 1


def test_a_full_disk(open_site, sqlite_database):
    site = open_site(sqlite_database)
    most = {"pages": 2**30}

    @event.listens_for(sqlite_database.engine, "begin")
    def keep_within(connection) -> None:
        connection.exec_driver_sql(f"PRAGMA max_page_count = {most['pages']}")

    visitor, url, body = an_answer(site)
    filling, researcher = site.participant("questions"), site.researcher()
    before = row_counts(site.database)
    with sqlite_database.read() as connection:
        most["pages"] = connection.exec_driver_sql("PRAGMA page_count").scalar()

    long = FILLED_IN | {"comment": "I have much to say. " * 240}
    assert_kept(filling, **long)
    many = {"kind": "personal", "number": "10000"}
    assert_refused_for_now(researcher.post("/researcher/invitations", **many))
    assert row_counts(site.database) == before
    confirmed = 0  # until the last page is full
    while (seen := visitor.send(url, body | {"revision": confirmed})).status_code == 200:
        confirmed += 1
        body = answer_body(**a_choice(visitor.person))
    assert_refused_for_now(seen)
    assert row_counts(site.database) == before | {"answers": before["answers"] + confirmed}

    most["pages"] = 2**30
    assert visitor.send(url, body | {"revision": confirmed}).json()["revision"] == confirmed + 1
    assert filling.post("/questions", **long).status_code == 303


def test_postgresql_cuts_all_connections(open_site, postgresql_database, postgresql_server):
    site = open_site(postgresql_database)
    visitor, url, body = an_answer(site)
    before = row_counts(site.database)
    assert postgresql_server.disconnect() >= 1
    seen = [visitor.send(url, body).status_code for _ in range(2)]
    assert seen[0] in (200, 503) and seen[1] == 200
    assert row_counts(site.database) == before | {"answers": before["answers"] + 1}


def test_postgresql_is_stopped_amid_an_answer(open_site, postgresql_database, postgresql_server):
    """The connection is cut after the answer was inserted and before it was committed."""
    site = open_site(postgresql_database)
    visitor, url, body = an_answer(site)
    before = row_counts(site.database)
    cut = []

    @event.listens_for(postgresql_database.engine, "after_cursor_execute")
    def cut_it(connection, cursor, statement, *more) -> None:
        if statement.startswith("INSERT INTO answers") and not cut:
            cut.append(postgresql_server.disconnect())

    assert_refused_for_now(visitor.send(url, body))
    assert len(cut) == 1 and cut[0] >= 1 and row_counts(site.database) == before
    assert visitor.send(url, body).json()["stored"]
    assert row_counts(site.database) == before | {"answers": before["answers"] + 1}


def test_no_server_at_all(open_site, postgresql_database, postgresql_server, monkeypatch):
    site = open_site(postgresql_database)
    visitor, url, body = an_answer(site)
    researcher = site.researcher()

    @event.listens_for(postgresql_database.engine, "do_connect")
    def nobody_listens(dialect, record, arguments, settings) -> None:
        if gone:
            settings["host"] = "/nowhere"

    gone = [True]
    postgresql_server.disconnect()
    for _ in range(2):
        assert_refused_for_now(visitor.send(url, body))
        assert visitor.get("/compare").status_code == 503
        assert researcher.get("/researcher/export.zip").status_code == 503
    gone.clear()
    assert visitor.send(url, body).json()["stored"]


def test_many_answer_at_once_over_http(open_site, database):
    """Twenty participants, and each answer sent twice at the same time."""
    site = open_site(database)
    waiting = [an_answer(site) for _ in range(20)]
    before = row_counts(site.database)["answers"]
    together = threading.Barrier(40)

    def send(index: int) -> dict:
        visitor, url, body = waiting[index // 2]
        together.wait()
        answer = visitor.send(url, body)
        assert answer.status_code == 200, answer.text
        return answer.json()

    with ThreadPoolExecutor(40) as pool:
        said = list(pool.map(send, range(40)))
    assert said[::2] == said[1::2]
    assert row_counts(site.database)["answers"] == before + 20
