"""The researcher's page: how the study stands, invitations, the export."""

from __future__ import annotations

import secrets
from typing import Annotated, Final, Literal

from fastapi import APIRouter, Depends, Form, Request
from starlette.responses import Response

from polite.study.errors import RefusedError
from polite.study.export import export_zip
from polite.study.invitations import MOST, invite, list_invitations
from polite.study.reading import make_of_records, read_records
from polite.study.records import StudyRecords
from polite.study.summary import summarise
from polite.study.web.site import OUR_FORM, TheSite, fingerprint, is_researcher, page, to
from polite.types import PoliteError


async def _only_researcher(request: Request) -> None:
    """Keep everybody else out.

    Raises:
        RefusedError: The session has not shown the token.
    """
    if not is_researcher(request):
        raise RefusedError(403, "Only the researcher can do this. Please log in.")


router: Final = APIRouter(prefix="/researcher")
ONLY_RESEARCHER: Final = Depends(_only_researcher)


@router.get("")
def overview(request: Request, site: TheSite) -> Response:
    """How the study stands, or the door."""
    if not is_researcher(request):
        return page(request, "researcher_login.html")
    with site.database.read() as connection:
        records = read_records(connection)
        invitations = list_invitations(connection)
    base = str(request.base_url).rstrip("/")
    return page(
        request,
        "researcher.html",
        sections=summarise(records, site.design, site.clock()),
        invitations=[
            {"url": base + each.path, "kind": each.kind, "used": each.used, "cap": each.cap}
            for each in invitations
        ],
    )


@router.post("/login", dependencies=[OUR_FORM])
def log_in(
    request: Request, site: TheSite, token: Annotated[str, Form(max_length=200)]
) -> Response:
    """Let the researcher in; the comparison takes as long whatever was entered."""
    if not secrets.compare_digest(token.strip().encode(), site.researcher_token.encode()):
        error = "This is not the study's token."
        return page(request, "researcher_login.html", 403, error=error)
    request.session["researcher"] = fingerprint(site.researcher_token)
    return to("/researcher")


@router.post("/logout", dependencies=[OUR_FORM])
def log_out(request: Request) -> Response:
    """Forget that this was the researcher."""
    request.session.pop("researcher", None)
    return to("/researcher")


@router.post("/invitations", dependencies=[ONLY_RESEARCHER, OUR_FORM])
def more_invitations(
    site: TheSite,
    kind: Annotated[Literal["personal", "open"], Form()],
    number: Annotated[int, Form(ge=1, le=MOST)],
) -> Response:
    """Make links: so many personal ones, or an open one for so many people."""
    links, cap = (number, 1) if kind == "personal" else (1, number)
    with site.database.write() as connection:
        invite(connection, links, cap, site.clock())
    return to("/researcher")


@router.get("/export.zip", dependencies=[ONLY_RESEARCHER])
def export_all(site: TheSite) -> Response:
    """All answers, for the learner and for tables.

    Raises:
        RefusedError: The study's folder does not fit them.
    """

    def pack(records: StudyRecords) -> bytes:
        try:
            return export_zip(site.folder, records)
        except PoliteError as error:  # somebody has changed the folder since it was served
            raise RefusedError(409, str(error)) from error

    return Response(
        make_of_records(site.database, pack),
        media_type="application/zip",
        headers={"Content-Disposition": 'attachment; filename="answers.zip"'},
    )
