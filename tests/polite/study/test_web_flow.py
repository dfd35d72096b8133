"""Participants and the researcher go through the pages, without a browser."""

import csv
import io
import zipfile
from http.cookiejar import DefaultCookiePolicy

import pytest
from people import answer_body, row_counts, rows
from sites import FILLED_IN

from polite.study import schema
from polite.study.participants import completion_code
from polite.study.web.site import URLS

pytest_plugins = ["servers"]


@pytest.fixture
def both(open_site, database):
    """The study on SQLite and on PostgreSQL."""
    return open_site(database)


@pytest.mark.parametrize("condition", ["polite", "baseline"])
def test_a_whole_participant(both, condition):
    visitor = both.participant("guide", condition)
    highlights = condition == "polite"

    guide = visitor.load("/")
    assert guide.url.path == "/guide" and ("timeline" in guide.text) == highlights
    assert visitor.post("/guide").headers["location"] == "/"

    page = visitor.load("/")
    assert page.url.path == "/compare" and visitor.token not in page.text
    state = visitor.get("/api/state").json()
    trials = both.material.trials
    assert state == {"stage": "practice", "place": 0, "trials": trials}
    assert trials == 1 + 3 + 1 + 1

    phases = []
    for place in range(trials):
        trial = visitor.get(f"/api/trials/{place}").json()
        phases.append((trial["phase"], trial["number"], trial["of"]))
        assert trial["place"] == trial["current"] == place
        assert trial["highlight"] == ({"length": 3} if highlights else None)
        assert trial["answer"] is None and trial["revision"] == 0 and not trial["watched"]
        for side in ("left", "right"):
            assert trial[side]["steps"] == 12
            assert visitor.get(trial[side]["video"]).headers["content-type"] == "video/mp4"
            assert visitor.get(trial[side]["strip"]).headers["content-type"] == "image/png"
        values = {"good": 2, "bad": 8, "nothing": False} if highlights else {}
        said = visitor.answer(place, choice="right", **values).json()
        assert said["stored"] and said["revision"] == 1
        assert (said["feedback"] is not None) == (place == 0)
        assert said["next"] == (None if place == trials - 1 else place + 1)
        if place not in (0, trials - 1):
            kept = visitor.get(f"/api/trials/{place}").json()
            marks = {"good": 2, "bad": 8} if highlights else {"good": None, "bad": None}
            assert kept["answer"] == {"choice": "right", **marks, "nothing": False}
            assert kept["watched"] and kept["revision"] == 1 and kept["current"] == place + 1
    assert phases == [("practice", 1, 1)] + [("comparison", n, 5) for n in range(1, 6)]
    assert said["stage"] == "questions"

    assert visitor.load("/").url.path == "/questions"
    done = visitor.post("/questions", **FILLED_IN)
    assert done.headers["location"] == "/"
    thanks = visitor.load("/")
    code = visitor.person.code
    assert thanks.url.path == "/thanks"
    assert code in thanks.text and completion_code(code) in thanks.text
    assert "Nobody can find your answers for you without it." in thanks.text
    (row,) = rows(both.database, schema.participants, number=visitor.person.number)
    assert row["finished_at"] == both.now and row["stage"] == "done"
    assert row_counts(both.database)["questionnaires"] == 1


def test_practice_says_what_most_people_prefer(site):
    expected = site.design.practice[0]
    for choice in ("left", "right"):
        visitor = site.participant("practice")
        trial = rows(site.database, schema.trials, participant=visitor.person.number, place=0)[0]
        best = "left" if (expected.expected == "first") == trial["first_is_left"] else "right"
        feedback = visitor.answer(0, choice=choice).json()["feedback"]
        assert feedback == {
            "correct": choice == best,
            "expected": best,
            "text": expected.explanation,
        }


PAGES = ("/consent", "/guide", "/compare", "/questions", "/thanks")


@pytest.mark.parametrize("stage", ["guide", "practice", "comparisons", "questions", "done"])
def test_no_page_can_be_skipped_or_seen_again(site, stage):
    visitor = site.participant(stage)
    for url in PAGES:
        seen = visitor.get(url)
        if url == URLS[stage]:
            assert seen.status_code == 200
        else:
            assert seen.status_code == 303
            assert visitor.load(url).url.path == URLS[stage]
    assert visitor.load("/").url.path == URLS[stage]


@pytest.mark.parametrize("stage", ["guide", "practice", "comparisons", "questions", "done"])
def test_a_form_of_another_stage_changes_nothing(site, stage):
    visitor = site.participant(stage)
    before = (row_counts(site.database), visitor.person)
    forms = {"/consent": {"version": "1", "agree": "yes"}, "/guide": {}, "/questions": FILLED_IN}
    for url, fields in forms.items():
        if url != URLS[stage]:
            assert visitor.post(url, **fields).status_code == 303
            assert (row_counts(site.database), visitor.person) == before


@pytest.mark.parametrize("url", PAGES)
def test_without_an_invitation_every_page_leads_to_the_door(site, url):
    page = site.visitor().load(url)
    assert page.url.path == "/" and "You need an invitation" in page.text


def test_a_browser_that_keeps_no_cookies_is_told_so(site):
    """And is not sent in a circle to a page that asks for an invitation."""
    (link,) = site.invite(cap=1)
    visitor = site.visitor()
    visitor.client.cookies.jar.set_policy(DefaultCookiePolicy(allowed_domains=[]))
    page = visitor.load(f"/join/{link}")
    assert page.status_code == 200 and not visitor.session
    text = " ".join(page.text.split())
    assert "seems to keep no cookies" in text and "open your invitation link again" in text
    assert "You need an invitation" not in text


def test_the_consents_address_alone_is_no_invitation(site):
    visitor = site.visitor()
    visitor.load("/")
    page = visitor.load("/consent?from=link")
    assert page.url.path == "/" and "You need an invitation" in page.text


def test_a_link_that_is_opened_creates_nobody(site):
    """Programs look at links in advance."""
    (link,) = site.invite(cap=1)
    before = row_counts(site.database)
    for _ in range(3):
        scanner = site.visitor()
        assert scanner.load(f"/join/{link}").url.path == "/consent"
        assert scanner.client.head(f"/join/{link}").status_code < 500
    assert row_counts(site.database) == before
    site.visitor().join(link)


def test_a_used_link_says_so_and_lets_its_participant_go_on(site):
    (link,) = site.invite(cap=1)
    visitor = site.visitor()
    visitor.join(link)
    assert visitor.load(f"/join/{link}").url.path == "/guide"
    other = site.visitor().load(f"/join/{link}")
    assert other.status_code == 410 and "has been used" in other.text


def test_the_first_answer_to_the_consent_may_be_lost(site):
    """A double click: the browser shows the second answer. The link works for its owner still."""
    (link,) = site.invite(cap=1)
    visitor = site.visitor()
    visitor.load(f"/join/{link}")
    cookie = visitor.client.cookies[site.cookie]
    fields = {"version": site.design.consent.version, "agree": "yes"}
    visitor.post("/consent", **fields)
    number = visitor.person.number
    visitor.client.cookies.set(site.cookie, cookie, domain="testserver.local")
    assert visitor.session.get("participant") is None
    assert visitor.load(f"/join/{link}").url.path == "/consent"
    assert visitor.post("/consent", **fields).headers["location"] == "/"
    assert visitor.person.number == number
    assert visitor.load("/").url.path == "/guide"
    assert row_counts(site.database)["participants"] == 1


@pytest.mark.parametrize(
    ("fields", "status", "message"),
    [
        ({"version": "1"}, 422, "Please tick the box"),
        ({"version": "1", "agree": "no"}, 422, "Please tick the box"),
        ({"version": "0", "agree": "yes"}, 409, "has changed"),
        ({"agree": "yes"}, 409, "has changed"),
    ],
)
def test_no_consent_no_participant(site, fields, status, message):
    visitor = site.visitor()
    visitor.load(f"/join/{site.invite()[0]}")
    before = row_counts(site.database)
    page = visitor.post("/consent", **fields)
    assert page.status_code == status and message in page.text
    assert row_counts(site.database) == before


def test_a_questionnaire_that_is_not_filled_in_comes_back_with_what_was(site):
    visitor = site.participant("questions")
    page = visitor.post("/questions", demanding="9", comment="Well <b>done</b>")
    assert page.status_code == 422 and "1 to 7" in page.text and "Please answer" in page.text
    assert "Well &lt;b&gt;done&lt;/b&gt;" in page.text
    assert row_counts(site.database)["questionnaires"] == 0
    assert visitor.person.stage == "questions"


def test_two_tabs_answer_once(site):
    visitor = site.participant(condition="baseline")
    place = visitor.place
    assert visitor.answer(place, choice="left").status_code == 200
    late = visitor.answer(place, choice="right")
    assert late.status_code == 409
    assert late.json()["revision"] == 1 and late.json()["current"] == place + 1
    assert visitor.answer(place, choice="right", revision=1).json()["revision"] == 2


def test_an_answer_that_is_sent_again_is_confirmed_again(both):
    visitor = both.participant(condition="polite")
    place = visitor.place
    visitor.watch(place)
    body = answer_body(nothing=True)
    url = f"/api/trials/{place}/answers"
    first, second = (visitor.send(url, body) for _ in range(2))
    assert first.json() == second.json() and second.status_code == 200
    assert len(rows(both.database, schema.answers, submission=body["submission"])) == 1


def test_withdrawing(both):
    staying, visitor = both.participant(), both.participant("done")
    code, number = visitor.person.code, visitor.person.number
    assert code in visitor.load("/withdraw").text

    asked = visitor.post("/withdraw", code=code)
    assert asked.status_code == 200 and "Delete all your answers?" in asked.text
    assert "This cannot be taken back.</p>" in asked.text  # an open link can be used again
    assert rows(both.database, schema.participants, number=number)

    other_browser = both.visitor()
    other_browser.load("/withdraw")
    typed = code.lower().replace("-", " ")
    done = other_browser.post("/withdraw", code=typed, confirm="yes")
    assert "Your answers are deleted" in done.text
    assert not rows(both.database, schema.answers, participant=number)

    assert visitor.load("/").status_code == 410
    assert visitor.load("/").url.path == "/"
    assert "You need an invitation" in visitor.load("/").text
    again = other_browser.post("/withdraw", code=code, confirm="yes")
    assert again.status_code == 404 and "No participant has this code" in again.text
    assert staying.get("/api/state").status_code == 200


def test_who_has_withdrawn_is_told_so_by_the_page_that_is_still_open(site):
    visitor = site.participant()
    place, csrf = visitor.place, visitor.csrf
    visitor.post("/withdraw", code=visitor.person.code, confirm="yes")
    answer = visitor.send(f"/api/trials/{place}/answers", answer_body(), csrf)
    assert answer.status_code == 410 and "deleted" in answer.json()["message"]
    assert row_counts(site.database)["answers"] == 0


def test_who_has_withdrawn_may_join_by_another_link(site):
    visitor = site.participant()
    visitor.post("/withdraw", code=visitor.person.code, confirm="yes")
    visitor.load("/")
    visitor.join(site.invite()[0])
    assert visitor.load("/").url.path == "/guide"


def test_the_researcher(both):
    done = both.participant("done", "polite")
    researcher = both.researcher()
    page = researcher.load("/researcher")
    assert "The study so far" in page.text and "finished and not excluded" in page.text
    for kind, number, links, cap in (("personal", 3, 3, 1), ("open", 40, 1, 40)):
        before = len(rows(both.database, schema.invitations))
        made = researcher.post("/researcher/invitations", kind=kind, number=str(number))
        assert made.headers["location"] == "/researcher"
        all_links = rows(both.database, schema.invitations)
        assert len(all_links) == before + links
        assert sum(row["cap"] == cap for row in all_links) >= links
    token = rows(both.database, schema.invitations)[-1]["token"]
    assert f"http://testserver/join/{token}" in researcher.load("/researcher").text

    answer = researcher.get("/researcher/export.zip")
    assert answer.headers["content-type"] == "application/zip"
    with zipfile.ZipFile(io.BytesIO(answer.content)) as archive:
        answers = list(csv.DictReader(archive.read("answers.csv").decode().splitlines()))
    mine = [row for row in answers if row["participant"] == str(done.person.number)]
    assert len(mine) == both.material.trials
    assert {row["condition"] for row in mine} == {"polite"}
    assert researcher.post("/researcher/logout").headers["location"] == "/researcher"
    assert "For the researcher" in researcher.load("/researcher").text
