"""Errors as participants see them: a sentence, as JSON for the page's script and else as a page."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any, Final

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException
from starlette.responses import Response

from polite.files import one_line
from polite.study.database import NotStoredError
from polite.study.errors import RefusedError, WithdrawnError
from polite.study.web.protection import HEADERS
from polite.study.web.site import ElsewhereError, page, to

log: Final = logging.getLogger("polite.study")

RETRY_AFTER: Final = {429: "60", 503: "2"}
"""When trying again may help [s]."""
NOT_STORED: Final = "The server cannot store anything just now. Please try again in a moment."


def handle_problems(app: FastAPI) -> None:
    """Register what turns errors into answers."""
    app.add_exception_handler(RefusedError, _refused)
    app.add_exception_handler(ElsewhereError, _elsewhere)
    app.add_exception_handler(NotStoredError, _not_stored)
    app.add_exception_handler(RequestValidationError, _invalid)
    app.add_exception_handler(UnicodeEncodeError, _no_text)
    app.add_exception_handler(HTTPException, _http)
    app.add_exception_handler(Exception, _unexpected)


def problem(
    request: Request,
    status: int,
    message: str,
    more: Mapping[str, Any] | None = None,
    headers: Mapping[str, str] | None = None,
) -> Response:
    """The answer to a request that is refused."""
    if request.url.path.startswith("/api/"):
        content = {"message": message, **(more or {})}
        answer: Response = JSONResponse(content, status_code=status)
    else:
        answer = page(request, "error.html", status, message=message)
    answer.headers.update(headers or {})
    if status in RETRY_AFTER:
        answer.headers["Retry-After"] = RETRY_AFTER[status]
    return answer


def refusal(request: Request, error: RefusedError) -> Response:
    """The answer to a request that we refuse."""
    if isinstance(error, WithdrawnError):
        for name in ("participant", "invitation"):
            request.session.pop(name, None)
    return problem(request, error.status, error.message, error.more)


def _refused(request: Request, error: Exception) -> Response:
    assert isinstance(error, RefusedError)
    return refusal(request, error)


def _elsewhere(request: Request, error: Exception) -> Response:
    assert isinstance(error, ElsewhereError)
    return to(error.url)


def note(request: Request, error: Exception) -> None:
    """Tell the researcher of something that a request could not do."""
    log.error("%s %s: %s", request.method, _route(request), error)


def _not_stored(request: Request, error: Exception) -> Response:
    note(request, error)
    return problem(request, 503, NOT_STORED)


def _invalid(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    where = ".".join(str(part) for part in first["loc"][1:]) or "request"
    message = f"{where}: {one_line(Exception(first['msg']))}"
    return problem(request, 422, message.encode(errors="replace").decode())


def _no_text(request: Request, error: Exception) -> Response:
    del error  # JSON can hold halves of characters, which nothing can store or send back
    return problem(request, 422, "Expected text that consists of whole characters.")


def _http(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    said = {
        404: "Please check the address.",
        413: "That was too long.",
        405: "This page cannot be used that way.",
    }
    message = said.get(error.status_code) or HTTPStatus(error.status_code).phrase
    return problem(request, error.status_code, message, headers=error.headers)


def _unexpected(request: Request, error: Exception) -> Response:
    log.error("%s %s", request.method, _route(request), exc_info=error)
    message = "This is our mistake, and it has been noted. Please try again."
    # This is answered outside the application that adds the headers.
    return problem(request, 500, message, headers=HEADERS)


def _route(request: Request) -> str:
    """Which page it was, as /join/{invitation}: addresses themselves hold invitations."""
    return getattr(request.scope.get("route"), "path", "a page that there is not")
