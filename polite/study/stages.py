"""What a participant goes through, in order."""

from __future__ import annotations

from typing import Final

from polite.study.design import Design

CONSENT: Final = "consent"
GUIDE: Final = "guide"
PRACTICE: Final = "practice"
COMPARISONS: Final = "comparisons"
QUESTIONS: Final = "questions"
DONE: Final = "done"
STAGES: Final = (CONSENT, GUIDE, PRACTICE, COMPARISONS, QUESTIONS, DONE)
"""Nobody is stored before the consent."""
STILL_HERE: Final = 3600.0
"""Somebody who was last seen longer ago [s] and has not finished seems to have left."""


def after(stage: str, design: Design) -> str:
    """The stage that follows; those that the design leaves empty are passed over."""
    absent = {PRACTICE: not design.practice, QUESTIONS: not design.questions}
    following = STAGES[STAGES.index(stage) + 1 :]
    return next(name for name in following if not absent.get(name, False))
