"""The participant's pages, in the order in which they come."""

from __future__ import annotations

from typing import Annotated, Any, Final

from fastapi import APIRouter, Form, Path, Query, Request
from fastapi.concurrency import run_in_threadpool
from starlette.responses import Response

from polite.study import stages
from polite.study.clips import Clip
from polite.study.database import NotStoredError
from polite.study.errors import RefusedError
from polite.study.invitations import NOT_ACCEPTED, panel_identities, same_person
from polite.study.participants import (
    add_identities,
    advance,
    completion_code,
    find,
    hashed,
    identities_of,
    invitation_is_open,
    join,
    new_token,
)
from polite.study.questionnaire import read_form, store_questionnaire
from polite.study.web.problems import RETRY_AFTER, note
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
from polite.study.withdrawal import CopyLeftError, by_code, has_code, withdraw_everywhere

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
    token = session.get("participant")
    with site.database.read() as connection:
        kept = identities_of(connection, token) if token else session.get("identities", {})
        # A link's names that contradict are somebody else's at the same computer.
        known = session.get("invitation") == invitation and same_person(kept, identities)
        if not known and not invitation_is_open(connection, invitation):
            raise RefusedError(410, "This invitation has been used already.")
    if not known:
        session.clear()
        session.update(invitation=invitation, joining=new_token(), identities=identities)
    elif not token:
        session["identities"] = kept | identities
    else:
        if identities.keys() - kept.keys():
            with site.database.write() as connection:
                add_identities(connection, token, identities)
        return to("/")
    return to("/consent?from=link")


@router.get("/consent")
def consent(
    request: Request, came_from: Annotated[str, Query(alias="from", max_length=10)] = ""
) -> Response:
    """What the participant agrees to."""
    if came_from == "link" and not request.session:
        return page(request, "landing.html", without_cookies=True)
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
    if session["identities"].get("assignmentId") == NOT_ACCEPTED:
        error = "Please accept the task on Mechanical Turk first, and open this page from there."
        return page(request, "consent.html", 409, error=error)
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
    shown = {"values": fields, "errors": filled.errors}
    try:
        with site.database.write() as connection:
            person = person_at(request, connection, stages.QUESTIONS, to_write=True)
            if not filled.errors:
                store_questionnaire(connection, person, site.design, filled.values, site.clock())
    except NotStoredError as error:  # a page of its own would lose what was entered
        note(request, error)
        answer = page(request, "questions.html", 503, **shown, unstored=True)
        answer.headers["Retry-After"] = RETRY_AFTER[503]
        return answer
    return page(request, "questions.html", 422, **shown) if filled.errors else to("/")


@router.get("/thanks")
def thanks(request: Request, site: TheSite) -> Response:
    """The end, with the codes."""
    with site.database.read() as connection:
        person = person_at(request, connection, stages.DONE)
        named = bool(identities_of(connection, session_token(request)))
    completion = site.design.completion
    return page(
        request,
        "thanks.html",
        code=completion.code or completion_code(person.code),
        withdrawal_code=person.code,
        named=named,
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
        try:
            known = withdraw_everywhere(site.folder, site.database, by_code(code), site.clock())
        except CopyLeftError as error:
            note(request, error)
            return page(request, "withdraw.html", state="left")
        state, status = ("done", 200) if known else ("unknown", 404)
        return page(request, "withdraw.html", status, state=state, code=code)
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
