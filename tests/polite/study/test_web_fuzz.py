"""Whatever is sent: no mistake of ours, a message that helps, and nothing stored that is wrong."""

import json
import re
from html import unescape
from urllib.parse import quote, urlencode

import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from people import a_choice, answer_body, row_counts, rows
from sites import FILLED_IN
from sqlalchemy import delete, update

from polite.study import schema
from polite.study.web import protection

pytest_plugins = ["servers"]

STEPS, LENGTH = 12, 3
"""Of the study's clips and highlights."""
ANY = st.text(st.characters(exclude_categories=()), max_size=30)
"""Halves of characters, zeros and signs of other directions included."""
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | ANY,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(ANY, inner, max_size=3),
    max_leaves=6,
)
NUMBERS = st.integers(-3, STEPS + 3) | st.floats(-3, STEPS + 3) | st.none()
TIMES = st.floats() | st.integers().map(str) | JSON
FIELDS = {
    "submission": JSON,
    "revision": NUMBERS | JSON,
    "choice": st.sampled_from(["left", "right", "equal", "incomparable", "Left"]) | JSON,
    "good": NUMBERS | JSON,
    "bad": NUMBERS | JSON,
    "nothing": st.booleans() | JSON,
    "shown_at": TIMES,
    "watched_at": TIMES,
    "chosen_at": TIMES,
    "answered_at": TIMES,
    "replays": st.integers() | JSON,
    "participant": JSON,
}
"""What may be sent instead of a whole answer's values."""


def changes(fields: dict, most: int):
    """A few fields and what they are changed to."""
    names = st.sets(st.sampled_from(sorted(fields)), max_size=most)
    return names.flatmap(lambda chosen: st.fixed_dictionaries({n: fields[n] for n in chosen}))


@pytest.fixture
def site(site, monkeypatch):
    """A study that lets one visitor send as much as they like."""
    monkeypatch.setattr(protection, "WRITES", 10**9)
    monkeypatch.setattr(protection, "GUESSES", 10**9)
    return site


def everything(site) -> list:
    with site.database.read() as connection:
        tables = schema.metadata.sorted_tables
        return [connection.execute(table.select()).all() for table in tables]


def post_json(visitor, url: str, content: bytes | str):
    headers = {"X-CSRF-Token": visitor.csrf, "Content-Type": "application/json"}
    return visitor.client.post(url, content=content, headers=headers)


def post_form(visitor, url: str, fields: dict):
    content = urlencode({"csrf": visitor.csrf} | fields, errors="surrogatepass")
    headers = {"Content-Type": "application/x-www-form-urlencoded"}
    return visitor.client.post(url, content=content, headers=headers)


def message_of(answer) -> str:
    """The sentence for the participant: of JSON, and of pages that show an error."""
    if answer.headers["content-type"] == "application/json":
        return answer.json()["message"]
    shown = re.findall(
        r'<(?:p class="lead"|p class="wrong"[^>]*|p id="[a-z-]+")>(.*?)</p>', answer.text
    )
    alerts = re.findall(r'role="alert"[^>]*><p>(.*?)</p>', answer.text)
    return unescape(" ".join(shown + alerts))


OUR_WORDS = ("Expected", "Passages can be marked", "This comparison has been answered in another")


@pytest.mark.parametrize("condition", ["polite", "baseline"])
def test_answers(site, condition):
    visitor = site.participant(condition=condition)
    place = visitor.place
    visitor.watch(place)
    url, number = f"/api/trials/{place}/answers", visitor.person.number
    whole = answer_body(**a_choice(visitor.person))

    def stored() -> list[dict]:
        return rows(site.database, schema.answers, participant=number, place=place)

    @given(changes(FIELDS, 3), st.sampled_from(["", "", "", *sorted(whole)]))
    @settings(max_examples=120)
    def check(wrong, missing):
        before = stored()
        body = answer_body(**a_choice(visitor.person), revision=len(before)) | wrong
        body.pop(missing, None)
        answer = post_json(visitor, url, json.dumps(body))
        after = stored()
        if answer.status_code == 200:
            assert after[:-1] == before
            assert_whole(after[-1], condition)
            return
        assert answer.status_code in (409, 422) and after == before
        message = message_of(answer)
        assert message.startswith((*OUR_WORDS, *wrong, missing or "Expected"))
        assert len(message) < 300

    check()


def assert_whole(row: dict, condition: str) -> None:
    """What may be stored of an answer."""
    assert row["choice"] in ("left", "right", "equal", "incomparable")
    marks = [mark for mark in (row["good"], row["bad"]) if mark is not None]
    if condition == "polite" and row["choice"] in ("left", "right"):
        assert row["nothing_marked"] != bool(marks)
    else:
        assert marks == [] and not row["nothing_marked"]
    assert all(0 <= mark <= STEPS - 1 - LENGTH for mark in marks)
    times = [row[f"client_{what}_at"] for what in ("shown", "watched", "chosen", "answered")]
    assert all(0.0 <= time <= 1e11 for time in times)
    assert 0 <= row["replays"] <= 1_000_000


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"null",
        b"[]",
        b"{",
        b"\xff\xfe",
        b"[" * 100_000,
        b'{"a":' * 20_000,
        b'"\\ud800"',
        b'{"\\ud800": 1}',
        b'{"choice": "\\ud800"}',
        b'{"revision": ' + b"9" * 10_000 + b"}",
        b'{"good": 1e999}',
        b'{"good": NaN}',
    ],
)
@pytest.mark.parametrize("what", ["answers", "watched"])
def test_what_is_no_json_object(site, content, what):
    visitor = site.participant()
    before = everything(site)
    answer = post_json(visitor, f"/api/trials/{visitor.place}/{what}", content)
    assert answer.status_code in (400, 422) and answer.json()["message"]
    assert everything(site) == before


def test_when_both_clips_had_been_watched(site):
    visitor = site.participant()
    place = visitor.place
    visitor.get(f"/api/trials/{place}")
    before = everything(site)  # the clock stands still, so that nothing has been watched

    @given(st.dictionaries(st.just("client_time") | ANY, st.floats() | JSON, max_size=2))
    @settings(max_examples=60)
    def check(body):
        answer = post_json(visitor, f"/api/trials/{place}/watched", json.dumps(body))
        assert answer.status_code == 422 and everything(site) == before
        message = message_of(answer)
        assert message.startswith(("client_time: ", "Please watch both")) or len(body) >= 1

    check()


def test_addresses(site):
    visitor = site.participant()
    before = everything(site)
    names = st.sampled_from(["api/trials", "join", "clips", "static", "", "researcher", "api"])

    @given(names, ANY | st.integers().map(str), st.dictionaries(ANY, ANY, max_size=2))
    @settings(max_examples=150)
    def check(name, rest, query):
        url = f"/{name}/{quote(rest, safe='', errors='surrogatepass')}"
        answer = visitor.get(f"{url}?{urlencode(query, errors='surrogatepass')}")
        assert answer.status_code < 500
        if answer.status_code >= 400:
            assert message_of(answer)

    check()
    assert everything(site) == before


VALUES = st.sampled_from(["", "0", "1", "7", "8", "2.5", "one", "One", "nan", "yes"]) | ANY
QUESTIONS = {
    "demanding": VALUES | st.integers(-1, 9).map(str),
    "group": VALUES,
    "comment": ANY | st.integers(4990, 5010).map(lambda n: "x" * n),
    "other": ANY,
}


def test_the_questionnaire(site):
    visitor = site.participant("questions")
    number, people = visitor.person.number, schema.participants
    before = row_counts(site.database)

    def again() -> None:
        with site.database.write() as connection:
            connection.execute(delete(schema.questionnaires))
            connection.execute(
                update(people).where(people.c.number == number).values(stage="questions")
            )

    @given(changes(QUESTIONS, 2))
    @settings(max_examples=150)
    def check(fields):
        answer = post_form(visitor, "/questions", FILLED_IN | fields)
        if answer.status_code == 303:
            (row,) = rows(site.database, schema.questionnaires)
            values = json.loads(row["content"])
            assert values.keys() == {"demanding", "group", "comment"}
            assert values["demanding"] in range(1, 8) and values["group"] in ("one", "another")
            assert values["comment"] is None or 0 < len(values["comment"]) <= 5000
            again()
            return
        assert answer.status_code == 422 and row_counts(site.database) == before
        named = re.findall(
            r'<p class="wrong" id="(\w+)-error"><b>Error:</b> (.+?)</p>', answer.text
        )
        assert named and all(name in ("demanding", "group", "comment") for name, _ in named)
        assert all(re.match("Expected|Please answer", text) for _, text in named)

    check()


def test_the_consent(site):
    visitor = site.visitor()
    visitor.load(f"/join/{site.invite()[0]}")
    before = everything(site)

    @given(st.fixed_dictionaries({}, optional={"version": VALUES, "agree": VALUES}))
    @settings(max_examples=60)
    def check(fields):
        if fields.get("version") == "1" and fields.get("agree") == "yes":
            return
        answer = post_form(visitor, "/consent", fields)
        assert answer.status_code in (409, 422) and everything(site) == before
        assert re.search("has changed|tick the box|agree: |version: ", message_of(answer))

    check()


def test_codes_and_tokens(site):
    visitor = site.participant("done")
    before = everything(site)

    @given(ANY | st.text("ABCDEFGHIJKLMNOPQRSTUVWXYZ234567- ", max_size=300), VALUES)
    @settings(max_examples=100)
    def check(guess, confirm):
        answers = [
            post_form(visitor, "/withdraw", {"code": guess, "confirm": confirm}),
            post_form(visitor, "/researcher/login", {"token": guess}),
        ]
        for answer, name in zip(answers, ("code", "token"), strict=True):
            assert answer.status_code in (403, 404, 422)
            assert name in message_of(answer) or "confirm" in message_of(answer)
        assert everything(site) == before

    check()


def test_more_invitations(site):
    researcher = site.researcher()
    researcher.load("/researcher")
    kinds = st.sampled_from(["personal", "open"]) | ANY

    @given(kinds, st.integers(-5, 30).map(str) | st.sampled_from(["10001", "1.0", "1e3", ""]) | ANY)
    @settings(max_examples=80)
    def check(kind, number):
        before = row_counts(site.database)["invitations"]
        answer = post_form(researcher, "/researcher/invitations", {"kind": kind, "number": number})
        made = row_counts(site.database)["invitations"] - before
        if answer.status_code == 303:
            assert made == (int(float(number)) if kind == "personal" else 1) > 0
        else:
            assert answer.status_code == 422 and made == 0
            assert re.match("kind: |number: ", message_of(answer))

    check()


@pytest.mark.parametrize("charset", ["unicode_escape", "raw_unicode_escape", "utf-7", "nonsense"])
def test_a_form_in_a_strange_character_set(site, charset):
    visitor = site.participant("questions")
    before = row_counts(site.database)
    fields = {"csrf": visitor.csrf} | FILLED_IN | {"comment": r"\ud800 and \x00"}
    parts = [
        f'--b\r\nContent-Disposition: form-data; name="{name}"\r\n\r\n{value}\r\n'
        for name, value in fields.items()
    ]
    headers = {"Content-Type": f"multipart/form-data; boundary=b; charset={charset}"}
    content = "".join([*parts, "--b--\r\n"])
    answer = visitor.client.post("/questions", content=content, headers=headers)
    assert answer.status_code in (303, 400, 422)
    if answer.status_code != 303:
        assert row_counts(site.database) == before


@pytest.mark.parametrize("name", ["csrf", "demanding", "comment"])
def test_a_file_where_text_is_expected(site, name):
    visitor = site.participant("questions")
    before = row_counts(site.database)
    fields = {"csrf": visitor.csrf} | FILLED_IN
    del fields[name]
    answer = visitor.client.post("/questions", data=fields, files={name: ("x.txt", b"3")})
    if name == "comment":  # is optional, and a file is no answer
        assert answer.status_code == 303
        (row,) = rows(site.database, schema.questionnaires)
        assert json.loads(row["content"])["comment"] is None
    else:
        assert answer.status_code in (403, 422) and row_counts(site.database) == before


@pytest.mark.parametrize("stage", ["nobody", "comparisons", "researcher"])
def test_everything_that_the_description_allows(site, stage):
    """Requests that schemathesis makes from the description of the API: no mistake of ours."""
    visitor = site.visitor() if stage == "nobody" else site.participant()
    if stage == "researcher":
        visitor = site.researcher()
    visitor.load("/researcher")
    described = schemathesis.openapi.from_dict(site.app.openapi())
    for result in described.get_all_operations():
        operation = result.ok()

        @given(operation.as_strategy())
        @settings(
            max_examples=8,
            phases=[Phase.explicit, Phase.generate],
            suppress_health_check=list(HealthCheck),
        )
        def check(case):
            send(visitor, case)

        check()


def send(visitor, case) -> None:
    """Send a request that schemathesis has made, with the session's secret in its place."""
    headers = {str(name): str(value) for name, value in (case.headers or {}).items()}
    headers = {
        name: value
        for name, value in headers.items()
        if name.lower() not in ("x-csrf-token", "cookie") and sendable(name + value)
    }
    body = case.body
    if "place" in (case.path_parameters or {}) and "participant" in visitor.session:
        case.path_parameters["place"] = visitor.place
    given = {"headers": headers | {"X-CSRF-Token": visitor.csrf}, "params": case.query or {}}
    if isinstance(body, dict) and case.media_type != "application/json":
        given["data"] = {str(k): str(v) for k, v in body.items()} | {"csrf": visitor.csrf}
    elif case.media_type == "application/json":
        given["content"] = json.dumps(body, default=str)
        given["headers"]["Content-Type"] = "application/json"
    answer = visitor.client.request(case.method, case.formatted_path, **given)
    assert answer.status_code < 500


def sendable(text: str) -> bool:
    return text.isascii() and text.isprintable()
