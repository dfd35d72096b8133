"""The questionnaire: which answers are answers, and storing them."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from sqlalchemy import Connection, func, insert, select

from polite.study import schema
from polite.study.design import Design, Question
from polite.study.errors import RefusedError
from polite.study.participants import Participant, advance
from polite.study.stages import QUESTIONS

LONGEST: Final = 5000
"""Characters of a free answer."""
LARGEST: Final = 1_000_000.0
"""Of a number."""

Value = str | float | None


@dataclass(frozen=True)
class Filled:
    """A questionnaire as it was filled in."""

    values: dict[str, Value]
    """By question; None where nothing was answered."""
    errors: dict[str, str]
    """By question, what is wrong with the answer; empty if all is well."""


def read_form(design: Design, fields: Mapping[str, str]) -> Filled:
    """Check a form's fields against the questions; fields of no question are ignored."""
    values: dict[str, Value] = {}
    errors: dict[str, str] = {}
    for question in design.questions:
        text = fields.get(question.name, "").strip()
        try:
            values[question.name] = _value(question, text)
        except ValueError as error:
            errors[question.name] = str(error)
    return Filled(values, errors)


def store_questionnaire(
    connection: Connection,
    person: Participant,
    design: Design,
    values: Mapping[str, Value],
    now: float,
) -> None:
    """Store the answers and let the participant go on; found `to_write`.

    Raises:
        RefusedError: The participant is elsewhere in the study.
    """
    if person.stage != QUESTIONS:
        raise RefusedError(409, "The questions are not open now.", stage=person.stage)
    table = schema.questionnaires
    last = connection.scalar(
        select(func.max(table.c.revision)).where(table.c.participant == person.number)
    )
    row = {
        "participant": person.number,
        "revision": int(last or 0) + 1,
        "content": json.dumps(values, ensure_ascii=False, allow_nan=False),
        "received_at": now,
    }
    connection.execute(insert(table).values(row))
    advance(connection, person, design, now)


def _value(question: Question, text: str) -> Value:
    """What an answer says.

    Raises:
        ValueError: It is none; the message says what was expected.
    """
    if not text:
        if question.required:
            raise ValueError("Please answer this question.")
        return None
    if question.kind == "text":
        if len(text) > LONGEST or "\x00" in text:
            raise ValueError(f"Expected at most {LONGEST:,} characters of text.")
        return text
    if question.kind == "choice":
        if text not in question.options:
            raise ValueError("Expected one of the options.")
        return text
    low, high = (1.0, question.points) if question.kind == "scale" else (0.0, LARGEST)
    number = _number(text)
    if not low <= number <= high or (question.kind == "scale" and not number.is_integer()):
        raise ValueError(f"Expected a number from {low:g} to {high:,.0f}.")
    return number


def _number(text: str) -> float:
    """A number as people write it; NaN if it is none."""
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return math.nan
