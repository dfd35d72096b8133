"""The application: a study's folder and database become a site."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable
from typing import Annotated, Final

from fastapi import FastAPI
from fastapi import Path as PathParameter
from starlette.middleware.body_limit import RequestBodyLimitMiddleware
from starlette.middleware.sessions import SessionMiddleware
from starlette.responses import FileResponse, Response
from starlette.staticfiles import StaticFiles

from polite.study.clips import clip_files
from polite.study.database import Database
from polite.study.errors import RefusedError
from polite.study.folder import StudyFolder
from polite.study.material import Material
from polite.study.web import api, pages, researcher
from polite.study.web.problems import handle_problems, refusal
from polite.study.web.protection import LARGEST, Headers, Limits
from polite.study.web.site import HERE, Site

SESSION_DAYS: Final = 60
FOREVER: Final = "private, max-age=31536000, immutable"
"""A clip's name changes with its content."""


def create_app(
    folder: StudyFolder,
    database: Database,
    *,
    https: bool = False,
    clock: Callable[[], float] = time.time,
) -> FastAPI:
    """Make the application.

    Args:
        folder: The study; has been checked.
        database: Its tables are there.
        https: Browsers reach it by https only, so cookies are sent by https only.
        clock: The server's time [s since the epoch].
    """
    app = FastAPI(title=folder.design.title, docs_url=None, redoc_url=None, openapi_url=None)
    app.state.site = Site(
        folder=folder.path,
        material=Material(folder.design, folder.queries, folder.clips),
        database=database,
        researcher_token=folder.secrets.researcher_token,
        clock=clock,
    )
    for part in (pages, api, researcher):
        app.include_router(part.router)
    _serve_files(app, folder)
    handle_problems(app)
    app.add_middleware(RequestBodyLimitMiddleware, max_body_size=LARGEST)
    app.add_middleware(Limits, problem=refusal)
    app.add_middleware(
        SessionMiddleware,
        secret_key=folder.secrets.session_key,
        session_cookie=cookie_name(folder.secrets.session_key),
        max_age=SESSION_DAYS * 24 * 3600,
        same_site="lax",  # strict would lose the participant who comes back by the link
        https_only=https,
    )
    app.add_middleware(Headers)
    return app


def cookie_name(session_key: str) -> str:
    """The name of a study's own cookie.

    Browsers send a host's cookies to all of its ports: another study there would find one of the
    same name signed by somebody else, and replace it.
    """
    return f"study-{hashlib.sha256(session_key.encode()).hexdigest()[:8]}"


def _serve_files(app: FastAPI, folder: StudyFolder) -> None:
    """Serve our scripts and styles, and the study's clips by their names."""
    app.mount("/static", StaticFiles(directory=HERE / "static"), name="static")
    files = {
        path.name: (path, path.stat())  # now, or each request would do it in a thread
        for clip in folder.clips.values()
        for path in clip_files(folder.path, clip)
    }

    @app.get("/clips/{name}")
    async def clip(name: Annotated[str, PathParameter(max_length=100)]) -> Response:
        """A clip or its film strip; no name leads anywhere else."""
        if name not in files:
            raise RefusedError(404, "There is no such clip.")
        path, facts = files[name]
        return FileResponse(path, headers={"Cache-Control": FOREVER}, stat_result=facts)
