"""A study's site and visitors without a browser, for tests; `servers` has the fixtures."""

import re
from html import unescape

from people import World, a_choice, answer_body
from starlette.testclient import TestClient

from polite.study.web.app import cookie_name, create_app

CSRF = re.compile(r'<meta name="csrf-token" content="([^"]+)">')


class Site(World):
    """A study that is served; its clock moves when it is told to."""

    def __init__(self, folder, database, **settings) -> None:
        super().__init__(folder, database)
        self.folder = folder
        self.cookie = cookie_name(folder.secrets.session_key)
        self.app = create_app(folder, database, clock=lambda: self.now, **settings)
        self.visitors = []

    def visitor(self, **settings) -> "Visitor":
        """Somebody with a browser of their own."""
        self.visitors.append(Visitor(self, **settings))
        return self.visitors[-1]

    def participant(self, stage: str = "comparisons", condition: str = "") -> "Visitor":
        """Somebody who has come so far; in a condition, where it matters."""
        while True:
            visitor = self.visitor()
            visitor.join()
            if condition in ("", visitor.person.condition):
                visitor.go_to(stage)
                return visitor

    def researcher(self) -> "Visitor":
        visitor = self.visitor()
        visitor.load("/researcher")
        visitor.post("/researcher/login", token=self.folder.secrets.researcher_token)
        return visitor

    def close(self) -> None:
        for visitor in self.visitors:
            visitor.client.close()


class Visitor:
    """A browser that keeps cookies and the secret of its forms, and follows no redirect."""

    def __init__(self, site: Site, base_url: str = "http://testserver", **settings) -> None:
        self.site = site
        self.client = TestClient(site.app, base_url, follow_redirects=False, **settings)
        self.csrf = ""

    def get(self, url: str, **settings):
        return self.client.get(url, **settings)

    def load(self, url: str):
        """Open a page, with all redirects."""
        page = self.client.get(url, follow_redirects=True)
        if found := CSRF.search(page.text):
            self.csrf = unescape(found[1])
        return page

    def post(self, url: str, csrf: str | None = None, **fields: str):
        """Send a form."""
        csrf = self.csrf if csrf is None else csrf
        return self.client.post(url, data={"csrf": csrf, **fields})

    def send(self, url: str, body, csrf: str | None = None):
        """Send JSON, as the page's script does."""
        csrf = self.csrf if csrf is None else csrf
        return self.client.post(url, json=body, headers={"X-CSRF-Token": csrf})

    def join(self, link: str | None = None, query: str = "") -> None:
        """Follow an invitation and consent."""
        page = self.load(f"/join/{link or self.site.invite()[0]}{query}")
        assert page.url.path == "/consent", page.text
        done = self.post("/consent", version=self.site.design.consent.version, agree="yes")
        assert done.status_code == 303, done.text

    @property
    def session(self) -> dict:
        """What the cookie holds; it is signed, not secret."""
        from base64 import b64decode
        from json import loads

        cookie = self.client.cookies.get(self.site.cookie)
        return loads(b64decode(cookie.split(".")[0])) if cookie else {}

    @property
    def token(self) -> str:
        return self.session["participant"]

    @property
    def person(self):
        return self.site.person(self.token)

    @property
    def place(self) -> int:
        return self.site.current(self.token)

    def watch(self, place: int) -> None:
        """Look at a comparison's clips."""
        assert self.get(f"/api/trials/{place}").status_code == 200
        self.site.now += 60.0
        done = self.send(f"/api/trials/{place}/watched", {"client_time": 1.0})
        assert done.json() == {"watched": True}

    def answer(self, place: int, **values):
        """Watch and answer; a whole answer unless `values` say otherwise."""
        self.watch(place)
        body = answer_body(**a_choice(self.person, **values))
        return self.send(f"/api/trials/{place}/answers", body)

    def go_to(self, stage: str) -> None:
        """Do what the pages ask until a stage is reached."""
        while (now := self.person.stage) != stage:
            if now in ("practice", "comparisons"):
                assert self.answer(self.place).status_code == 200
            elif now == "guide":
                self.load("/guide")
                assert self.post("/guide").status_code == 303
            else:
                assert self.post("/questions", **FILLED_IN).status_code == 303


FILLED_IN = {"demanding": "3", "group": "one", "comment": "It was fine."}
"""The study's questionnaire."""
