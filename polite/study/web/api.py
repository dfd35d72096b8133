"""The API of the page on which clips are compared."""

from __future__ import annotations

from typing import Annotated, Any, Final

from fastapi import APIRouter, Path, Request
from pydantic import BaseModel, ConfigDict

from polite.study.answering import (
    AnswerForm,
    Milliseconds,
    Place,
    current_place,
    mark_served,
    mark_watched,
    read_place,
    store_answer,
)
from polite.study.assignment import Trial
from polite.study.material import Material
from polite.study.participants import Participant, find
from polite.study.web.pages import clip_facts
from polite.study.web.site import OUR_SCRIPT, TheSite, session_token

router: Final = APIRouter(prefix="/api")

Number = Annotated[int, Path(ge=0, le=10_000)]


class Watched(BaseModel):
    """Both clips have been watched."""

    model_config = ConfigDict(extra="forbid")

    client_time: Milliseconds


@router.get("/state")
def state(request: Request, site: TheSite) -> dict[str, Any]:
    """Where the participant is."""
    with site.database.read() as connection:
        person = find(connection, session_token(request))
        place = current_place(connection, person)
    return {"stage": person.stage, "place": place, "trials": site.material.trials}


@router.get("/trials/{place}")
def trial(request: Request, site: TheSite, place: Number) -> dict[str, Any]:
    """What is compared at a place, and the last answer there."""
    with site.database.read() as connection:
        person = find(connection, session_token(request))
        found = read_place(connection, person, site.material, place)
    if found.served_at is None:
        with site.database.write(at_once=False) as connection:
            mark_served(connection, person, place, site.clock())
    return _trial(site.material, person, found)


@router.post("/trials/{place}/watched", dependencies=[OUR_SCRIPT])
def watched(request: Request, site: TheSite, place: Number, body: Watched) -> dict[str, Any]:
    """Note that both clips have been watched to their end."""
    del body  # when that was by the page's clock comes again with the answer
    with site.database.write(at_once=False) as connection:  # the answer brings it to the disk
        person = find(connection, session_token(request), to_write=True)
        mark_watched(connection, person, site.material, place, site.clock())
    return {"watched": True}


@router.post("/trials/{place}/answers", dependencies=[OUR_SCRIPT])
def answer(request: Request, site: TheSite, place: Number, body: AnswerForm) -> dict[str, Any]:
    """Store an answer; it is on disk when this is confirmed."""
    with site.database.write() as connection:
        person = find(connection, session_token(request), to_write=True)
        stored = store_answer(connection, person, site.material, place, body, site.clock())
    return {
        "stored": True,
        "revision": stored.revision,
        "next": stored.next,
        "stage": stored.stage,
        "feedback": _feedback(site.material, stored.trial, body),
    }


def _trial(material: Material, person: Participant, at: Place) -> dict[str, Any]:
    left, right = material.sides(at.trial)
    practising = at.trial.kind == "practice"
    before, of = (
        (0, material.practice)
        if practising
        else (material.practice, material.trials - material.practice)
    )
    design = material.design
    return {
        "place": at.place,
        "trials": material.trials,
        "current": at.current,
        "phase": "practice" if practising else "comparison",
        "number": at.place - before + 1,
        "of": of,
        "left": clip_facts(left),
        "right": clip_facts(right),
        "fps": left.fps,
        "highlight": {"length": design.highlight_length} if person.highlights else None,
        "speeds": design.speeds,
        "watched": at.watched_at is not None,
        "answer": at.answer
        and {
            "choice": at.answer.choice,
            "good": at.answer.good,
            "bad": at.answer.bad,
            "nothing": at.answer.nothing_marked,
        },
        "revision": at.revision,
    }


def _feedback(material: Material, trial: Trial, form: AnswerForm) -> dict[str, Any] | None:
    """In practice, what most people would have answered."""
    if trial.kind != "practice":
        return None
    item = material.design.practice[trial.query]
    expected = "left" if (item.expected == "first") == trial.first_is_left else "right"
    return {
        "correct": form.choice == expected,
        "expected": expected,
        "text": item.explanation,
    }
