"""Whose answers can be used: catch pairs, haste, and the rules of exclusion. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

from polite.study.design import Design, Kind
from polite.study.records import (
    AnswerRecord,
    Choice,
    ParticipantRecord,
    Said,
    TrialRecord,
    said,
)

Outcome = Literal["agreed", "contradicted", "undecided", "unanswered"]
"""Of a catch pair: the same said twice; the other segment preferred; anything else, such as a side
and then "equal"; not both comparisons answered yet."""
OUTCOMES: Final[tuple[Outcome, ...]] = ("agreed", "contradicted", "undecided", "unanswered")

NOT_FINISHED: Final = "not finished"
FAILED_CATCH_PAIRS: Final = "failed catch pairs"
TOO_FAST: Final = "too fast"
SAME_CHOICE: Final = "same choice"
REASONS: Final = (NOT_FINISHED, FAILED_CATCH_PAIRS, TOO_FAST, SAME_CHOICE)
"""Why a participant's answers are left out of the learner's data, in the order they are named."""

COUNTED: Final[tuple[Kind, ...]] = ("main", "repeated", "mirrored")
"""All comparisons but practice."""


@dataclass(frozen=True)
class CatchResult:
    """What came of one catch pair."""

    place: int
    """Of the repeated or mirrored trial."""
    kind: Kind
    outcome: Outcome


def answered(
    participant: ParticipantRecord, kinds: Sequence[Kind] = COUNTED
) -> list[tuple[TrialRecord, list[AnswerRecord]]]:
    """The answered trials of some kinds, in order, each with its revisions; the last one counts."""
    revisions = participant.revisions()
    trials = sorted(participant.trials, key=lambda trial: trial.place)
    return [(t, revisions[t.place]) for t in trials if t.kind in kinds and t.place in revisions]


def catch_results(participant: ParticipantRecord) -> list[CatchResult]:
    """How each repeated or mirrored comparison compares with the main one of the same segments."""
    says = {
        (trial.kind, trial.query): said(trial, revisions[-1].choice)
        for trial, revisions in answered(participant)
    }
    return [
        CatchResult(
            trial.place,
            trial.kind,
            _compare(says.get(("main", trial.query)), says.get((trial.kind, trial.query))),
        )
        for trial in sorted(participant.trials, key=lambda trial: trial.place)
        if trial.kind in ("repeated", "mirrored")
    ]


def decision_seconds(answer: AnswerRecord) -> float | None:
    """Time from having watched both clips to this answer, marking included [s]; None if unknown.

    By the page's clock, since a slow connection delays what the server hears; by the server's where
    the page's times are missing, run backwards, or last longer than the server can have waited.
    A clock that was set back tells nothing.
    """
    return _since_watched(answer, answer.client_answered_at)


def choice_seconds(answer: AnswerRecord) -> float | None:
    """Time from having watched both clips to the choice, before any marking [s]; None if unknown.

    By the same clocks as `decision_seconds`; the server hears of no choice before the answer.
    """
    return _since_watched(answer, answer.client_chosen_at)


def _since_watched(answer: AnswerRecord, done: float | None) -> float | None:
    """From having watched both clips to a time of the page's clock, or else to the arrival [s]."""
    watched = answer.client_watched_at
    if watched is not None and done is not None:
        seconds = done - watched
        if 0.0 <= seconds <= answer.received_at - answer.served_at:
            return seconds
    if answer.watched_at is None or answer.received_at < answer.watched_at:
        return None
    return answer.received_at - answer.watched_at


def is_fast(answer: AnswerRecord, design: Design) -> bool | None:
    """Whether the choice came too soon after the clips were watched; None if that is unknown.

    Marking does not count: only one of the conditions is asked for it.
    """
    seconds = choice_seconds(answer)
    return None if seconds is None else seconds < design.exclusion.fast_seconds


def fast_share(participant: ParticipantRecord, design: Design) -> float | None:
    """Share of too fast answers among those whose time is known; None if there are none.

    By the first answer to each comparison: who changes one later has watched the clips before.
    """
    fast = [is_fast(revisions[0], design) for _, revisions in answered(participant)]
    return _share([value for value in fast if value is not None])


def left_rate(participant: ParticipantRecord) -> float | None:
    """Share of "left" among the expressed preferences; None if there are none."""
    choices = [revisions[-1].choice for _, revisions in answered(participant)]
    return _share([choice == "left" for choice in choices if choice in ("left", "right")])


def same_choice_share(participant: ParticipantRecord) -> float | None:
    """Share of the most frequent choice, as it was shown, among main comparisons; None without."""
    choices = _main_choices(participant)
    return max(Counter(choices).values()) / len(choices) if choices else None


def exclusion(participant: ParticipantRecord, design: Design) -> tuple[str, ...]:
    """Why the participant's answers are left out, by the design's rules; empty if they are not."""
    contradicted = [r.outcome for r in catch_results(participant)].count("contradicted")
    fast, same = fast_share(participant, design), same_choice_share(participant)
    enough = len(_main_choices(participant)) >= design.exclusion.same_choice_answers
    applies = {
        NOT_FINISHED: participant.finished_at is None,
        FAILED_CATCH_PAIRS: contradicted >= design.exclusion.failed_catch_pairs,
        TOO_FAST: fast is not None and fast >= design.exclusion.fast_share,
        SAME_CHOICE: enough and same is not None and same >= design.exclusion.same_choice_share,
    }
    return tuple(reason for reason in REASONS if applies[reason])


def _main_choices(participant: ParticipantRecord) -> list[Choice]:
    return [revisions[-1].choice for _, revisions in answered(participant, ("main",))]


def _compare(before: Said | None, again: Said | None) -> Outcome:
    if before is None or again is None:
        return "unanswered"
    if before == again:
        return "agreed"
    return "contradicted" if {before, again} == {"first", "second"} else "undecided"


def _share(values: Sequence[bool]) -> float | None:
    return sum(values) / len(values) if values else None
