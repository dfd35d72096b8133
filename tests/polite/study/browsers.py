"""A study that is really served, and a real browser that visits it; fixtures for tests."""

import shutil
import socket
import threading
import time

import pytest
import uvicorn
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import expect, sync_playwright
from sqlalchemy import select, update

from polite.study import schema
from polite.study.database import Database, sqlite_url
from polite.study.invitations import invite
from polite.study.web.app import create_app

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "chrome"))), None)
needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
OPTIONS = (
    "--no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync"
)
PATIENCE = 20_000
"""How long a page may take [ms]; only a broken one does."""
TOO_WIDE = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
TOO_SMALL = """
[...document.querySelectorAll("button, .button, .radio, input[type=range], [role=slider]")]
  .filter((element) => element.checkVisibility())
  .map((element) => [element.textContent.trim(), element.getBoundingClientRect()])
  .filter(([, box]) => box.height < 43.5 || box.width < 43.5)
  .map(([text, box]) => `${text}: ${box.width} x ${box.height}`)
"""


class ServedStudy:
    """A study on a free port, which can be stopped and started again."""

    def __init__(self, folder):
        self.folder = folder
        self.database = Database(sqlite_url(folder.database_path))
        self.database.migrate()
        self._port = 0
        self.start()

    @property
    def base(self):
        return f"http://127.0.0.1:{self._port}"

    def start(self):
        listener = socket.create_server(("127.0.0.1", self._port))  # who comes early waits
        self._port = listener.getsockname()[1]
        config = uvicorn.Config(
            create_app(self.folder, self.database),
            log_level="error",
            lifespan="off",
            timeout_graceful_shutdown=1,
        )
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._server.run, kwargs={"sockets": [listener]})
        self._thread.start()

    def stop(self):
        self._server.should_exit = True
        self._thread.join()

    def invitation(self):
        """The address of a new personal link."""
        with self.database.write() as connection:
            (made,) = invite(connection, 1, 1, time.time())
        return self.base + made.path

    def rows(self, table, **where):
        """All rows of a table, with these values, in their order."""
        query = select(table).filter_by(**where).order_by(*table.primary_key)
        with self.database.read() as connection:
            return connection.execute(query).all()

    def answers(self, number):
        """A participant's answers."""
        return self.rows(schema.answers, participant=number)

    def put_at(self, number, stage):
        """Let a participant be at a stage."""
        people = schema.participants
        with self.database.write() as connection:
            connection.execute(update(people).where(people.c.number == number).values(stage=stage))


@pytest.fixture(name="served")
def a_served_study(study_folder):
    study = ServedStudy(study_folder)
    yield study
    study.stop()
    study.database.close()


@pytest.fixture(name="browser", scope="module")
def a_browser():
    with sync_playwright() as playwright:
        expect.set_options(timeout=PATIENCE)
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=OPTIONS.split())
        yield browser
        browser.close()


@pytest.fixture(name="visit")
def a_visit(browser, served):
    """Open a page with settings of Playwright's contexts; fails if the browser had a complaint.

    A test appends to `visit.expected` the parts of complaints that it provokes.
    """
    contexts, complaints = [], []

    def listen(page):
        page.on(
            "console",
            lambda said: said.type in ("error", "warning") and complaints.append(said.text),
        )
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("requestfailed", failed)

    def failed(request):
        # What is not needed any more, as a clip or a page that is left, is not loaded to its end.
        if request.failure != "net::ERR_ABORTED":
            complaints.append(f"{request.failure}: {request.url}")

    def visit(**settings):
        context = browser.new_context(base_url=served.base, **settings)
        context.set_default_timeout(PATIENCE)
        context.on("page", listen)
        contexts.append(context)
        return context.new_page()

    visit.expected = []
    yield visit
    for context in contexts:
        context.close()
    left = [text for text in complaints if not any(part in text for part in visit.expected)]
    assert not left, left


def check(page):
    """No violation, nothing wider than the window, nothing too small for a finger."""
    found = Axe().run(page).response["violations"]
    assert not [(each["id"], [node["html"] for node in each["nodes"]]) for each in found]
    assert page.evaluate(TOO_WIDE) <= 0
    assert not page.evaluate(TOO_SMALL)
