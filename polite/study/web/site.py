"""What every request needs, and who is asking."""

from __future__ import annotations

import hashlib
import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

from fastapi import Depends, Form, Header, Request
from fastapi.responses import RedirectResponse
from fastapi.templating import Jinja2Templates
from sqlalchemy import Connection
from starlette.responses import Response

from polite.study import stages
from polite.study.database import Database
from polite.study.design import Design
from polite.study.errors import RefusedError
from polite.study.material import Material
from polite.study.participants import Participant, find

HERE: Final = Path(__file__).parent
URLS: Final = {
    stages.CONSENT: "/consent",
    stages.GUIDE: "/guide",
    stages.PRACTICE: "/compare",
    stages.COMPARISONS: "/compare",
    stages.QUESTIONS: "/questions",
    stages.DONE: "/thanks",
}
"""The page of each stage."""

_TEMPLATES: Final = Jinja2Templates(HERE / "templates")


@dataclass(frozen=True, eq=False)
class Site:
    """A study that is being served."""

    folder: Path
    material: Material
    database: Database
    researcher_token: str
    clock: Callable[[], float] = time.time
    """The server's time [s since the epoch]."""

    @property
    def design(self) -> Design:
        """What the study consists of."""
        return self.material.design


class ElsewhereError(Exception):
    """The participant belongs on another page."""

    def __init__(self, url: str) -> None:
        """Remember where."""
        self.url = url


# What every request depends on is asynchronous: FastAPI sends the other kind through a thread.
async def _the_site(request: Request) -> Site:
    return _site(request)


def _site(request: Request) -> Site:
    site: Site = request.app.state.site
    return site


TheSite = Annotated[Site, Depends(_the_site)]


def csrf_token(request: Request) -> str:
    """The secret of this session that a page must send back with everything that changes data."""
    token: str | None = request.session.get("csrf")
    if token is None:
        token = request.session["csrf"] = secrets.token_urlsafe(16)
    return token


def check_csrf(request: Request, seen: str) -> None:
    """Refuse what another site makes a browser send.

    Raises:
        RefusedError: The secret is not this session's.
    """
    expected = request.session.get("csrf", "")
    if not expected or not secrets.compare_digest(expected.encode(), seen.encode()):
        raise RefusedError(403, "This page has become too old. Please load it again.")


async def _from_form(request: Request, csrf: Annotated[str, Form(max_length=100)] = "") -> None:
    check_csrf(request, csrf)


async def _from_header(
    request: Request, x_csrf_token: Annotated[str, Header(max_length=100)] = ""
) -> None:
    check_csrf(request, x_csrf_token)


OUR_FORM: Final = Depends(_from_form)
"""For a form's endpoint: it came from our own page."""
OUR_SCRIPT: Final = Depends(_from_header)
"""The same for the API."""


def session_token(request: Request) -> str:
    """The token of the participant whose session this is.

    Raises:
        RefusedError: There is none.
    """
    token: str | None = request.session.get("participant")
    if token is None:
        raise RefusedError(401, "Please open your invitation link again.")
    return token


def person_at(
    request: Request, connection: Connection, stage: str, *, to_write: bool = False
) -> Participant:
    """The participant, who is at this stage.

    Args:
        request: Theirs.
        connection: The transaction.
        stage: Another one with the same page is as good.
        to_write: Keep others from changing this participant's data until the transaction ends.

    Raises:
        ElsewhereError: They are elsewhere, or nobody yet.
        RefusedError: They have withdrawn.
    """
    if "participant" not in request.session:
        raise ElsewhereError("/")
    person = find(connection, session_token(request), to_write=to_write)
    if URLS[person.stage] != URLS[stage]:
        raise ElsewhereError(URLS[person.stage])
    return person


def to(url: str) -> RedirectResponse:
    """Send the browser to another page, with GET."""
    return RedirectResponse(url, status_code=303)


def page(request: Request, name: str, status: int = 200, **context: Any) -> Response:
    """Render a template with what all of them are given."""
    site = _site(request)
    common = {"design": site.design, "csrf": csrf_token(request), "status": status}
    return _TEMPLATES.TemplateResponse(request, name, common | context, status_code=status)


def is_researcher(request: Request) -> bool:
    """Whether this session has shown the researcher's token; a new token ends old sessions."""
    expected = fingerprint(_site(request).researcher_token)
    return secrets.compare_digest(str(request.session.get("researcher", "")), expected)


def fingerprint(token: str) -> str:
    """What a session keeps of the researcher's token."""
    return hashlib.sha256(b"researcher:" + token.encode()).hexdigest()
