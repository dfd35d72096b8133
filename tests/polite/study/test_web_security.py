"""Nobody reaches what is not theirs."""

import io
import logging
import zipfile
from base64 import b64decode, b64encode
from types import SimpleNamespace

import pytest
from fastapi.routing import APIRoute
from hypothesis import given
from hypothesis import strategies as st
from people import a_choice, answer_body, row_counts, rows
from sites import FILLED_IN

from polite.study import schema
from polite.study.database import NotStoredError
from polite.study.web import protection

pytest_plugins = ["servers"]

FORMS = {
    "/consent": {"version": "1", "agree": "yes"},
    "/guide": {},
    "/questions": FILLED_IN,
    "/withdraw": {"confirm": "yes"},
    "/researcher/login": {},
    "/researcher/logout": {},
    "/researcher/invitations": {"kind": "personal", "number": "2"},
}
"""Each form's whole content; code and token are added where they are known."""
SCRIPTS = {"/api/trials/{place}/watched", "/api/trials/{place}/answers"}
"""What the page's script sends as JSON."""


def routes(app, method: str) -> set[str]:
    """The paths of an application; those of its routers are looked up in its description."""
    return {path for path, operations in app.openapi()["paths"].items() if method in operations}


def test_every_endpoint_that_changes_data_is_known_here(site):
    """A new one belongs into the table above, and so into the tests below."""
    assert routes(site.app, "post") == FORMS.keys() | SCRIPTS
    methods = {m for path in site.app.openapi()["paths"].values() for m in path}
    assert methods == {"get", "post"}
    hidden = [r for r in site.app.routes if isinstance(r, APIRoute) and not r.include_in_schema]
    assert hidden == []


def state(site) -> tuple:
    """All that a request could have changed."""
    tables = schema.metadata.sorted_tables
    with site.database.read() as connection:
        return tuple(tuple(connection.execute(table.select())) for table in tables)


def ready_for(site, url: str):
    """Somebody at the page of a form, and the fields that it would send."""
    fields = dict(FORMS[url])
    if url == "/consent":
        visitor = site.visitor()
        visitor.load(f"/join/{site.invite()[0]}")
    elif url.startswith("/researcher"):
        visitor = site.visitor() if url.endswith("login") else site.researcher()
        visitor.load("/researcher")
        if url.endswith("login"):
            fields["token"] = site.folder.secrets.researcher_token
    else:
        visitor = site.participant({"/guide": "guide", "/questions": "questions"}.get(url, "done"))
        visitor.load(url)
        if url == "/withdraw":
            fields["code"] = visitor.person.code
    return visitor, fields


@pytest.mark.parametrize("url", FORMS)
def test_a_form_from_another_site_is_refused(site, url):
    visitor, fields = ready_for(site, url)
    before, session = state(site), visitor.session
    other = site.visitor()
    other.load("/")
    for csrf in ("", "wrong", visitor.csrf[:-1], other.csrf, "x" * 100, "ü"):
        answer = visitor.post(url, csrf=csrf, **fields)
        assert answer.status_code == 403 and "load it again" in answer.text
    assert visitor.client.post(url, data=fields).status_code == 403
    assert visitor.client.post(url, params={"csrf": visitor.csrf}, data=fields).status_code == 403
    headers = {"X-CSRF-Token": visitor.csrf}
    assert visitor.client.post(url, data=fields, headers=headers).status_code == 403
    assert (state(site), visitor.session) == (before, session)
    assert visitor.post(url, **fields).status_code in (200, 303)
    if url not in ("/researcher/login", "/researcher/logout"):
        assert state(site) != before


@pytest.mark.parametrize("what", ["watched", "answers"])
def test_a_script_from_another_site_is_refused(site, what):
    visitor = site.participant()
    place = visitor.place
    body = {"client_time": 1.0}
    visitor.get(f"/api/trials/{place}")
    site.now += 60.0
    if what == "answers":
        visitor.watch(place)
        body = answer_body(**a_choice(visitor.person))
    before, url = state(site), f"/api/trials/{place}/{what}"
    for csrf in ("", "wrong", site.participant("guide").csrf):
        before = state(site)
        answer = visitor.send(url, body, csrf)
        assert answer.status_code == 403 and "load it again" in answer.json()["message"]
    assert visitor.client.post(url, json=body).status_code == 403
    assert state(site) == before
    assert visitor.send(url, body).status_code == 200
    assert state(site) != before


def test_nothing_is_changed_without_a_session(site):
    site.participant()
    stranger = site.visitor()
    stranger.load("/")
    before = state(site)
    assert stranger.get("/api/state").status_code == 401
    assert stranger.get("/api/trials/0").status_code == 401
    assert stranger.send("/api/trials/0/watched", {"client_time": 1.0}).status_code == 401
    assert stranger.send("/api/trials/0/answers", answer_body()).status_code == 401
    for url in ("/guide", "/questions", "/consent"):
        assert stranger.post(url, **FORMS[url]).headers["location"] == "/"
    answer = stranger.post("/researcher/invitations", kind="open", number="5")
    assert answer.status_code == 403
    assert state(site) == before


def test_cookies_are_out_of_reach_of_scripts_and_of_other_sites(open_site, sqlite_database):
    for https in (False, True):
        site = open_site(sqlite_database, https=https)
        visitor = site.visitor(base_url="https://testserver")
        cookies = [visitor.get("/").headers["set-cookie"]]
        visitor.load(f"/join/{site.invite()[0]}")
        consent = visitor.post("/consent", version="1", agree="yes")
        cookies.append(consent.headers["set-cookie"])
        for cookie in cookies:
            parts = [part.strip().lower() for part in cookie.split(";")]
            assert "httponly" in parts and "samesite=lax" in parts and "path=/" in parts
            assert ("secure" in parts) == https


def test_a_cookie_that_was_changed_is_no_session(site):
    victim, visitor = site.participant(), site.participant()
    cookie = visitor.client.cookies[site.cookie]
    content, rest = cookie.split(".", 1)
    forged = b64encode(b64decode(content).replace(visitor.token.encode(), victim.token.encode()))
    for value in (
        f"{forged.decode()}.{rest}",
        content,
        "",
        "x",
        cookie[:-1],
        "null.",
        f"{cookie}x",
    ):
        visitor.client.cookies.set(site.cookie, value, domain="testserver.local", path="/")
        assert visitor.get("/api/state").status_code == 401
        assert visitor.get("/compare").headers["location"] == "/"
    visitor.client.cookies.set(site.cookie, cookie, domain="testserver.local", path="/")
    assert visitor.get("/api/state").status_code == 200


def test_a_cookie_of_another_study_is_no_session(site, open_site, study_folder, sqlite_database):
    visitor = site.participant()
    secrets = type(study_folder.secrets)("k" * 40, "t" * 40)
    object.__setattr__(study_folder, "secrets", secrets)
    other = open_site(sqlite_database)
    stranger = other.visitor()
    stranger.client.cookies.set(other.cookie, visitor.client.cookies[site.cookie])
    assert stranger.get("/api/state").status_code == 401


def test_two_studies_on_one_host_do_not_lock_each_other_out(site, open_site, study_folder):
    """Browsers send a host's cookies to all of its ports."""
    secrets = type(study_folder.secrets)("k" * 40, "t" * 40)
    object.__setattr__(study_folder, "secrets", secrets)
    one, other = site.participant(), open_site(site.database).visitor()
    other.client.cookies.update(one.client.cookies)
    other.join()
    one.client.cookies.update(other.client.cookies)
    assert other.load("/").url.path == "/guide" and one.load("/").url.path == "/compare"


def test_every_kind_of_answer_carries_the_headers(site):
    visitor, stranger = site.participant(), site.visitor()
    trial = visitor.get(f"/api/trials/{visitor.place}").json()
    clip = trial["left"]["video"]
    answers = {
        200: [
            visitor.get("/compare"),
            visitor.get("/static/compare.js"),
            visitor.get("/api/state"),
            stranger.get("/researcher"),
            stranger.get(clip),
        ],
        206: [visitor.get(clip, headers={"Range": "bytes=0-9"})],
        303: [visitor.get("/"), stranger.get("/guide")],
        401: [stranger.get("/api/state")],
        403: [stranger.post("/withdraw", code="x"), stranger.get("/researcher/export.zip")],
        404: [
            stranger.get("/nothing"),
            stranger.get("/static/nothing"),
            stranger.get("/clips/nothing"),
            stranger.get("/api/nothing"),
            stranger.get("/join/nothing"),
        ],
        405: [stranger.client.put("/guide"), stranger.client.delete("/api/state")],
        413: [visitor.post("/questions", comment="x" * protection.LARGEST)],
        422: [visitor.send("/api/trials/0/watched", {})],
    }
    for status, seen in answers.items():
        for answer in seen:
            assert answer.status_code == status, answer.url
            for name, value in protection.HEADERS.items():
                assert answer.headers[name] == value, (answer.url, name)
            assert kept_as(answer) in answer.headers["cache-control"]
            assert len(answer.headers.get_list("content-security-policy")) == 1


def kept_as(answer):
    """How browsers may keep an answer: clips for good, our files if they ask, else not at all."""
    if "/static/" in str(answer.url):
        return "no-cache"
    found_clip = "/clips/" in str(answer.url) and answer.status_code < 300
    return "immutable" if found_clip else "no-store"


def test_a_mistake_of_ours_carries_the_headers_and_tells_nothing(site, monkeypatch, caplog):
    visitor = site.participant()
    visitor.client._transport.raise_server_exceptions = False
    monkeypatch.setattr("polite.study.web.api.current_place", lambda *_: 1 / 0)
    answer = visitor.get("/api/state")
    assert answer.status_code == 500 and "our mistake" in answer.json()["message"]
    assert "division" not in answer.text and "division" in caplog.text
    assert answer.headers["content-security-policy"] == protection.POLICY


@pytest.mark.parametrize("mistake", [NotStoredError("gone"), ZeroDivisionError("oh no")])
def test_no_invitation_is_logged(site, monkeypatch, caplog, mistake):
    def fail(*_):
        raise mistake

    link, visitor = site.invite()[0], site.visitor()
    visitor.client._transport.raise_server_exceptions = False
    monkeypatch.setattr(site.app.state.site.database, "read", fail)
    monkeypatch.setattr(site.app.state.site.database, "write", fail)
    assert visitor.get(f"/join/{link}?PROLIFIC_PID=somebody").status_code in (500, 503)
    written = [r for r in caplog.records if r.name == "polite.study"]
    assert [record.getMessage().split(":")[0] for record in written] == ["GET /join/{invitation}"]
    assert link not in caplog.text and "somebody" not in caplog.text


def test_the_policy_allows_no_script_or_style_in_pages(site):
    assert protection.POLICY.startswith("default-src 'none'")
    assert "unsafe" not in protection.POLICY and "*" not in protection.POLICY
    for stage in ("guide", "practice", "questions", "done"):
        page = site.participant(stage).load("/").text
        assert " style=" not in page and "<style" not in page and " onclick=" not in page
        assert all('src="/static/' in part.split(">")[0] for part in page.split("<script")[1:])
        assert "//" not in page.replace("<!--", "").replace("http://testserver", "")


def test_participants_see_their_own_trials_only(site):
    one, two = (site.participant(condition="baseline") for _ in range(2))
    place = one.place
    assert one.answer(place, choice="right").status_code == 200
    assert two.get(f"/api/trials/{place}").json()["answer"] is None
    for path in (f"/api/trials/{place + 1}?participant=1", f"/api/trials/{place + 1}/1"):
        assert two.get(path).status_code == 404
    mine = rows(site.database, schema.trials, participant=two.person.number)
    kinds = {row["place"]: row["kind"] for row in mine}
    page = two.get("/compare").text
    for visitor in (one, two):
        assert visitor.token not in page and visitor.person.code not in page
    for secret in ("mirrored", "repeated", "baseline", "block"):
        assert secret in kinds.values() or secret in ("baseline", "block")
        assert secret not in two.get(f"/api/trials/{place}").text


@pytest.mark.parametrize(
    "name",
    [
        "../study.toml",
        "..%2Fsecrets.json",
        "%2e%2e/secrets.json",
        "..%5Csecrets.json",
        "%2Fetc%2Fpasswd",
        "/etc/passwd",
        "..%252Fsecrets.json",
        "clips.json",
        "%2e",
        "%00",
        "x" * 99,
        "x" * 5000,
        "%F0%9F%99%82",
    ],
)
def test_no_path_leads_out_of_the_clips(site, name):
    visitor = site.participant()
    for url in (f"/clips/{name}", f"/static/{name}"):
        answer = visitor.get(url)
        assert answer.status_code in (404, 422), answer.url
        assert "session_key" not in answer.text and "root:" not in answer.text
        assert "openapi" not in answer.text


def test_the_description_of_the_api_is_not_served(site):
    for url in ("/docs", "/redoc", "/openapi.json"):
        assert site.visitor().get(url).status_code == 404


@pytest.mark.parametrize("known", [True, False])
def test_what_is_too_large_is_not_read(site, known):
    """Whether the length is announced or not."""
    visitor = site.participant()
    before = state(site)
    read = []

    def parts():
        for _ in range(100):
            read.append(1)
            yield b"x" * 16_384

    content = b"x" * (protection.LARGEST + 1) if known else parts()
    headers = {"X-CSRF-Token": visitor.csrf, "Content-Type": "application/json"}
    url = f"/api/trials/{visitor.place}/answers"
    answer = visitor.client.post(url, content=content, headers=headers)
    assert answer.status_code == 413 and "too long" in answer.json()["message"]
    form = {"Content-Type": "application/x-www-form-urlencoded"}
    page = visitor.client.post(
        "/withdraw", content=b"code=" + b"x" * protection.LARGEST, headers=form
    )
    assert page.status_code == 413 and "too long" in page.text
    assert state(site) == before


GUESSES = protection.GUESSES


@pytest.fixture
def minute(monkeypatch):
    """The clock of the limits; it stands still until it is set."""

    clock = SimpleNamespace(now=0.0)
    counter = protection.LastMinute
    monkeypatch.setattr(protection, "LastMinute", lambda: counter(lambda: clock.now))
    return clock


@given(st.lists(st.tuples(st.sampled_from("ab"), st.floats(0, 50)), max_size=60), st.integers(1, 5))
def test_in_no_minute_are_there_more_than_allowed(steps, limit):
    now = 0.0
    recent = protection.LastMinute(lambda: now)
    counted = {"a": [], "b": []}
    for who, pause in steps:
        now += pause
        of_minute = [time for time in counted[who] if time > now - 60.0]
        assert recent.count(who, limit) == (len(of_minute) < limit)
        if len(of_minute) < limit:
            counted[who].append(now)


@pytest.mark.parametrize(
    ("url", "wrong"),
    [("/withdraw", {"code": "AAAA-AAAA-AAAA-AAAA"}), ("/researcher/login", {"token": "x"})],
)
def test_guessing_is_slow(minute, site, url, wrong):
    visitor = site.visitor()
    visitor.load(url.removesuffix("/login"))
    seen = [visitor.post(url, **wrong).status_code for _ in range(GUESSES + 5)]
    assert 429 not in seen[:GUESSES] and set(seen[GUESSES:]) == {429}
    late = visitor.post(url, **wrong)
    assert late.headers["retry-after"] == "60" and "wait a minute" in late.text
    fresh = site.visitor()  # another browser is no other address
    fresh.load("/")
    assert fresh.post(url, **wrong).status_code == 429
    elsewhere = site.visitor(client=("192.0.2.7", 1))
    elsewhere.load("/")
    assert elsewhere.post(url, **wrong).status_code in (403, 404)
    minute.now += 61.0
    assert visitor.post(url, **wrong).status_code in (403, 404)


def test_guessing_with_an_address_that_is_spelt_differently(minute, site):
    visitor = site.visitor()
    visitor.load("/withdraw")
    urls = ["/withdraw", "/withdraw?x=1", "/%77ithdraw", "//withdraw", "/withdraw/", "/./withdraw"]
    for n in range(GUESSES + 1):
        visitor.post(urls[n % len(urls)], code="AAAA")
    for _ in range(GUESSES):
        visitor.post("/withdraw", code="AAAA")
    for url in urls:
        done = visitor.client.post(
            url, data={"csrf": visitor.csrf, "code": "AAAA"}, follow_redirects=True
        )
        assert done.status_code in (404, 405, 429) and "No participant" not in done.text


def test_nobody_can_write_without_end(minute, site, monkeypatch):
    monkeypatch.setattr(protection, "WRITES", 30)
    visitor, other = site.participant(), site.participant()
    url = f"/api/trials/{visitor.place}/watched"
    seen = [visitor.send(url, {"client_time": 1.0}).status_code for _ in range(40)]
    assert seen[0] != 429 and seen[-1] == 429
    limited = visitor.send(url, {"client_time": 1.0})
    assert "wait a minute" in limited.json()["message"]
    assert other.send(url, {"client_time": 1.0}).status_code != 429
    assert visitor.get("/api/state").status_code == 200


def test_a_wrong_token_opens_nothing(site, caplog):
    caplog.set_level(logging.DEBUG)
    token = site.folder.secrets.researcher_token
    visitor = site.visitor()
    visitor.load("/researcher")
    for wrong in ("x", token[:-1], token.swapcase(), "", " ", "ü" * 200, "\x00"):
        answer = visitor.post("/researcher/login", token=wrong)
        assert answer.status_code in (403, 422)
        assert "researcher" not in visitor.session
    assert visitor.get("/researcher/export.zip").status_code == 403
    assert "The study so far" not in visitor.load("/researcher").text
    assert token not in caplog.text


def test_the_token_is_in_no_answer_and_in_no_log(site, caplog):
    caplog.set_level(logging.DEBUG)
    researcher = site.researcher()
    token, key = site.folder.secrets.researcher_token, site.folder.secrets.session_key
    texts = [researcher.load("/researcher").text, researcher.load("/").text]
    texts += [str(researcher.session), researcher.get("/researcher/export.zip").text]
    texts += [site.participant("done").load("/").text, caplog.text, repr(site.folder.secrets)]
    for text in texts:
        assert token not in text and key not in text


def test_a_new_token_ends_the_researchers_sessions(site, open_site, study_folder):
    researcher = site.researcher()
    assert researcher.get("/researcher/export.zip").status_code == 200
    secrets = study_folder.secrets
    object.__setattr__(study_folder, "secrets", type(secrets)(secrets.session_key, "t" * 40))
    again = open_site(site.database).visitor()
    again.client.cookies.set(site.cookie, researcher.client.cookies[site.cookie])
    assert again.get("/researcher/export.zip").status_code == 403
    assert "For the researcher" in again.load("/researcher").text


def test_logging_out_ends_a_session(site):
    researcher = site.researcher()
    researcher.post("/researcher/logout")
    assert researcher.get("/researcher/export.zip").status_code == 403


def test_a_participant_is_no_researcher(site):
    visitor = site.participant("done")
    assert visitor.get("/researcher/export.zip").status_code == 403
    assert "The study so far" not in visitor.load("/researcher").text
    before = row_counts(site.database)
    assert visitor.post("/researcher/invitations", kind="open", number="5").status_code == 403
    assert row_counts(site.database) == before


PANEL = "5f3c9a77Kk"


def test_who_people_are_is_in_no_export_page_or_log(site, caplog):
    caplog.set_level(logging.DEBUG, logger="polite")
    visitor = site.visitor()
    visitor.join(query=f"?PROLIFIC_PID={PANEL}&SESSION_ID={PANEL}2")
    visitor.go_to("done")
    stored = {row["name"]: row["value"] for row in rows(site.database, schema.identities)}
    assert stored == {"PROLIFIC_PID": PANEL, "SESSION_ID": f"{PANEL}2"}
    assert "identities" not in visitor.session
    researcher = site.researcher()
    with zipfile.ZipFile(io.BytesIO(researcher.get("/researcher/export.zip").content)) as archive:
        content = b"".join(archive.read(name) for name in archive.namelist())
    assert len(content) > 1000
    texts = [content.decode(errors="replace"), researcher.load("/researcher").text, caplog.text]
    assert not any(PANEL in text for text in texts)


EVIL = "<script>alert(1)</script>\"'><b>"


def test_text_that_looks_like_html_stays_text(site):
    visitor = site.visitor()
    link = site.invite()[0]
    for name in ("PROLIFIC_PID", "workerId"):
        visitor.get(f"/join/{link}", params={name: EVIL})
    visitor.join(link)
    assert rows(site.database, schema.identities) == []
    visitor.go_to("questions")
    pages = [
        visitor.post("/questions", demanding=EVIL, group=EVIL, comment=EVIL),
        visitor.post("/withdraw", code=EVIL),
        visitor.get(f"/{EVIL}"),
        visitor.get(f"/clips/{EVIL}"),
        visitor.get(f"/join/{EVIL}"),
        site.researcher().post("/researcher/invitations", kind=EVIL, number=EVIL),
        visitor.client.get("/researcher", headers={"Host": EVIL}),
    ]
    assert [page.status_code for page in pages][:-1] == [422, 404, 404, 404, 404, 422]
    visitor.post("/questions", **(FILLED_IN | {"comment": EVIL}))
    pages += [visitor.load("/"), site.researcher().load("/researcher")]
    for page in pages:
        assert "<script>alert" not in page.text and "\"'><b>" not in page.text
    assert "&lt;script&gt;" in pages[0].text and "&lt;script&gt;" in pages[1].text
