"""Those whom a panel sends take part once each."""

from concurrent.futures import ThreadPoolExecutor

import pytest
from people import World, row_counts, rows

from polite.study import schema
from polite.study.errors import RefusedError
from polite.study.participants import add_identities

pytest_plugins = ["servers"]


@pytest.mark.parametrize("name", ["PROLIFIC_PID", "workerId"])
def test_nobody_takes_part_twice(study_folder, database, name):
    world = World(study_folder, database)
    world.join(**{name: "somebody", "STUDY_ID": "one study"})

    def join(who: str) -> int:
        try:
            world.join(**{name: who, "STUDY_ID": "one study"})
        except RefusedError as error:
            return error.status
        return 200

    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(join, ["somebody"] * 4)) == [409] * 4
        assert sorted(pool.map(join, ["another"] * 4)) == [200, 409, 409, 409]
    assert join("third") == 200
    world.join()
    world.join()  # of whom no link says anything may be many
    assert row_counts(database)["participants"] == 5


def test_who_comes_by_another_browser_is_told_where_to_go_on(site):
    link = site.invite()[0]
    site.visitor().join(link, "?PROLIFIC_PID=5f")
    again = site.visitor()
    again.load(f"/join/{link}?PROLIFIC_PID=5f&SESSION_ID=new")
    refused = again.post("/consent", version="1", agree="yes")
    assert refused.status_code == 409
    assert "go on in the browser in which you started" in refused.text.replace("\n", " ")
    assert len(rows(site.database, schema.participants)) == 1


def test_the_same_person_goes_on_by_any_form_of_the_link(site):
    link = site.invite()[0]
    visitor = site.visitor()
    visitor.join(link, "?PROLIFIC_PID=5f&SESSION_ID=1")
    for query in ("", "?PROLIFIC_PID=5f&SESSION_ID=1", "?PROLIFIC_PID=5f&SESSION_ID=2"):
        assert visitor.load(f"/join/{link}{query}").url.path == "/guide"
    assert len(rows(site.database, schema.participants)) == 1


def test_somebody_else_at_the_same_computer_is_somebody_else(site):
    """Or they would see the codes of the one before."""
    link = site.invite()[0]
    visitor = site.visitor()
    visitor.join(link, "?PROLIFIC_PID=5f")
    first = visitor.person
    visitor.join(link, "?PROLIFIC_PID=6a")
    assert visitor.person.number != first.number
    said = {row["participant"]: row["value"] for row in rows(site.database, schema.identities)}
    assert said == {first.number: "5f", visitor.person.number: "6a"}


def test_somebody_else_by_a_link_that_is_used_up_does_not_end_the_session(site):
    link = site.invite(cap=1)[0]
    visitor = site.visitor()
    visitor.join(link, "?PROLIFIC_PID=5f")
    assert visitor.get(f"/join/{link}?PROLIFIC_PID=6a").status_code == 410
    assert visitor.load("/").url.path == "/guide"


def named(site, number=1) -> dict:
    """What a panel calls a participant."""
    stored = rows(site.database, schema.identities, participant=number)
    return {row["name"]: row["value"] for row in stored}


def test_a_link_without_names_takes_none_away(site):
    link = site.invite()[0]
    visitor = site.visitor()
    visitor.load(f"/join/{link}?workerId=A1&hitId=h")
    visitor.load(f"/join/{link}?assignmentId=a&hitId=h2")
    visitor.join(link)
    assert named(site) == {"workerId": "A1", "hitId": "h2", "assignmentId": "a"}


def test_somebody_else_before_the_consent_is_somebody_else(site):
    link = site.invite()[0]
    visitor = site.visitor()
    visitor.load(f"/join/{link}?workerId=A1&hitId=h&PROLIFIC_PID=5f")
    first = visitor.session["joining"]
    visitor.load(f"/join/{link}?workerId=A2")
    assert visitor.session["joining"] != first
    visitor.join(link)
    assert named(site) == {"workerId": "A2"}


def test_a_task_that_is_only_looked_at_is_to_be_accepted_first(site):
    """Mechanical Turk says who somebody is only then."""
    link = site.invite()[0]
    visitor = site.visitor()
    visitor.load(f"/join/{link}?assignmentId=ASSIGNMENT_ID_NOT_AVAILABLE&hitId=h")
    refused = visitor.post("/consent", version="1", agree="yes")
    assert refused.status_code == 409 and "Please accept the task" in refused.text
    assert row_counts(site.database)["participants"] == 0
    visitor.join(link, "?assignmentId=a&hitId=h&workerId=A1")
    assert named(site) == {"assignmentId": "a", "hitId": "h", "workerId": "A1"}


def test_what_a_link_says_after_the_consent_is_added(site):
    link = site.invite()[0]
    visitor = site.visitor()
    visitor.join(link, "?hitId=h")
    preview = f"/join/{link}?assignmentId=ASSIGNMENT_ID_NOT_AVAILABLE&hitId=h"
    assert visitor.load(preview).url.path == "/guide"
    assert named(site) == {"hitId": "h"}
    for _ in range(2):
        page = visitor.load(f"/join/{link}?assignmentId=a&hitId=h2&workerId=A1")
        assert page.url.path == "/guide"
        assert named(site) == {"assignmentId": "a", "hitId": "h", "workerId": "A1"}
    assert row_counts(site.database)["participants"] == 1


def test_who_is_in_the_study_already_is_not_added_a_second_time(site):
    link = site.invite()[0]
    site.visitor().join(link, "?workerId=A1")
    visitor = site.visitor()
    visitor.join(link)
    refused = visitor.get(f"/join/{link}?workerId=A1&hitId=h")
    assert refused.status_code == 409 and "You take part in this study already" in refused.text
    assert named(site, 2) == {}


def test_two_who_are_found_to_be_the_same_at_once(study_folder, database):
    world = World(study_folder, database)
    tokens = [world.join() for _ in range(4)]

    def say(token: str) -> int:
        try:
            with database.write() as connection:
                add_identities(connection, token, {"workerId": "A1", "hitId": "h"})
        except RefusedError as error:
            return error.status
        return 200

    with ThreadPoolExecutor(4) as pool:
        assert sorted(pool.map(say, tokens)) == [200, 409, 409, 409]
    assert row_counts(database)["identities"] == 2


def test_the_last_page_says_who_can_find_the_answers(site):
    visitor = site.visitor()
    visitor.join(query="?PROLIFIC_PID=5f")
    visitor.go_to("done")
    thanks = " ".join(visitor.load("/thanks").text.split())
    assert "Nobody can find" not in thanks
    assert "can find your answers by what the panel calls you" in thanks


def test_a_link_that_is_used_up_takes_nobodys_session_away(site):
    mine, used = site.invite(2, cap=1)
    site.visitor().join(used)
    visitor = site.visitor()
    visitor.join(mine)
    assert visitor.get(f"/join/{used}").status_code == 410
    assert visitor.load("/").url.path == "/guide"
