"""The participant's pages, in the order in which they come."""

from __future__ import annotations

from typing import Annotated, Any, Final

from fastapi import APIRouter, Form, Path, Request
from fastapi.concurrency import run_in_threadpool
from starlette.responses import Response

from polite.study import stages
from polite.study.clips import Clip
from polite.study.errors import RefusedError
from polite.study.invitations import panel_identities
from polite.study.participants import (
    advance,
    completion_code,
    find,
    has_code,
    hashed,
    invitation_is_open,
    join,
    may_be,
    new_token,
)
from polite.study.questionnaire import read_form, store_questionnaire
from polite.study.web.site import (
    OUR_FORM,
    URLS,
    Site,
    TheSite,
    page,
    person_at,
    session_token,
    to,
)
from polite.study.withdrawal import withdraw_everywhere

router: Final = APIRouter()

Token = Annotated[str, Path(max_length=64, pattern=r"^[A-Za-z0-9_-]+$")]
Code = Annotated[str, Form(max_length=200)]


@router.get("/")
def landing(request: Request, site: TheSite) -> Response:
    """Go on where the participant is, or say that an invitation is needed."""
    if "participant" in request.session:
        with site.database.read() as connection:
            return to(URLS[find(connection, session_token(request)).stage])
    return to("/consent") if "invitation" in request.session else page(request, "landing.html")


@router.get("/join/{invitation}")
def follow_invitation(request: Request, site: TheSite, invitation: Token) -> Response:
    """Keep the invitation, and what a panel calls the person, until the consent.

    Nobody is stored yet: programs that look at links in advance must not use invitations up.
    """
    session, identities = request.session, panel_identities(request.query_params)
    with site.database.read() as connection:
        known = session.get("invitation") == invitation
        if known and "participant" in session:
            if may_be(connection, session["participant"], identities):
                return to("/")
            known = False  # somebody else at the same computer
        if not known and not invitation_is_open(connection, invitation):
            raise RefusedError(410, "This invitation has been used already.")
    if not known:
        session.clear()
        session.update(invitation=invitation, joining=new_token())
    session["identities"] = identities
    return to("/consent")


@router.get("/consent")
def consent(request: Request) -> Response:
    """What the participant agrees to."""
    if "participant" in request.session or "invitation" not in request.session:
        return to("/")
    return page(request, "consent.html")


@router.post("/consent", dependencies=[OUR_FORM])
def give_consent(
    request: Request,
    site: TheSite,
    version: Annotated[str, Form(max_length=300)] = "",
    agree: Annotated[str, Form(max_length=10)] = "",
) -> Response:
    """Take the participant in."""
    if "participant" in request.session or "invitation" not in request.session:
        return to("/")
    if version != site.design.consent.version:
        error = "This text has changed since you opened the page. Please read it again."
        return page(request, "consent.html", 409, error=error)
    if agree != "yes":
        error = "Please tick the box if you agree; without it you cannot take part."
        return page(request, "consent.html", 422, error=error)
    session = request.session
    invitation, token = session["invitation"], session["joining"]
    with site.database.write() as connection:
        join(connection, site.design, invitation, session["identities"], token, site.clock())
    session["participant"] = session.pop("joining")
    session.pop("identities")
    return to("/")


@router.get("/guide")
def guide(request: Request, site: TheSite) -> Response:
    """What to look for, with a good and a bad example."""
    with site.database.read() as connection:
        person = person_at(request, connection, stages.GUIDE)
    examples = {"good": site.design.guide.good, "bad": site.design.guide.bad}
    clips = {name: clip_facts(site.material.clips[e.segment]) for name, e in examples.items()}
    return page(
        request,
        "guide.html",
        highlights=person.highlights,
        clips=clips,
        withdrawal_code=person.code,
    )


@router.post("/guide", dependencies=[OUR_FORM])
def leave_guide(request: Request, site: TheSite) -> Response:
    """Go on to the practice."""
    return _advance(request, site, stages.GUIDE)


@router.get("/compare")
def compare(request: Request, site: TheSite) -> Response:
    """Practice and comparisons; the page's script asks the API for the rest."""
    with site.database.read() as connection:
        person = person_at(request, connection, stages.COMPARISONS)
    filed_under = hashed(session_token(request))[:16]
    return page(request, "compare.html", highlights=person.highlights, participant=filed_under)


@router.get("/questions")
def questions(request: Request, site: TheSite) -> Response:
    """The questionnaire."""
    with site.database.read() as connection:
        person_at(request, connection, stages.QUESTIONS)
    return page(request, "questions.html", values={}, errors={})


@router.post("/questions", dependencies=[OUR_FORM])
async def answer_questions(request: Request, site: TheSite) -> Response:
    """Store the questionnaire, or show what is missing."""
    form = await request.form()
    fields = {name: value for name, value in form.items() if isinstance(value, str)}
    return await run_in_threadpool(_fill_in, request, site, fields)


def _fill_in(request: Request, site: Site, fields: dict[str, str]) -> Response:
    filled = read_form(site.design, fields)
    with site.database.write() as connection:
        person = person_at(request, connection, stages.QUESTIONS, to_write=True)
        if not filled.errors:
            store_questionnaire(connection, person, site.design, filled.values, site.clock())
    if filled.errors:
        return page(request, "questions.html", 422, values=fields, errors=filled.errors)
    return to("/")


@router.get("/thanks")
def thanks(request: Request, site: TheSite) -> Response:
    """The end, with the codes."""
    with site.database.read() as connection:
        person = person_at(request, connection, stages.DONE)
    completion = site.design.completion
    return page(
        request,
        "thanks.html",
        code=completion.code or completion_code(person.code),
        withdrawal_code=person.code,
        url=completion.url,
    )


@router.get("/withdraw")
def withdrawal(request: Request, site: TheSite) -> Response:
    """Where a participant can withdraw; whoever is one in this browser finds their code there."""
    code = ""
    if "participant" in request.session:
        with site.database.read() as connection:
            code = find(connection, session_token(request)).code
    return page(request, "withdraw.html", state="form", code=code)


@router.post("/withdraw", dependencies=[OUR_FORM])
def withdraw(
    request: Request,
    site: TheSite,
    code: Code,
    confirm: Annotated[str, Form(max_length=10)] = "",
) -> Response:
    """Ask once more, then delete everything."""
    if confirm == "yes":
        if not withdraw_everywhere(site.folder, site.database, code, site.clock()):
            return page(request, "withdraw.html", 404, state="unknown", code=code)
        return page(request, "withdraw.html", state="done", code=code)
    with site.database.read() as connection:
        known = has_code(connection, code)
    state, status = ("confirm", 200) if known else ("unknown", 404)
    return page(request, "withdraw.html", status, state=state, code=code)


def clip_facts(clip: Clip) -> dict[str, Any]:
    """A clip as pages and API describe it."""
    return {
        "video": f"/clips/{clip.name}.mp4",
        "strip": f"/clips/{clip.name}.png",
        "steps": clip.steps,
        "fps": clip.fps,
        "width": clip.width,
        "height": clip.height,
    }


def _advance(request: Request, site: Site, stage: str) -> Response:
    with site.database.write() as connection:
        person = person_at(request, connection, stage, to_write=True)
        advance(connection, person, site.design, site.clock())
    return to("/")
