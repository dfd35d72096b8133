"""How a study stands, as tables for the terminal and for the researcher's page. Pure.

Nothing here tells who a participant is, or what the pool's clips pay.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from polite.analysis.statistics import share_interval
from polite.report.words import number, percent
from polite.study.columns import minutes_tasks, minutes_total
from polite.study.design import CONDITIONS, Condition, Design
from polite.study.quality import (
    COUNTED,
    OUTCOMES,
    REASONS,
    answered,
    catch_results,
    decision_seconds,
    exclusion,
    is_fast,
)
from polite.study.records import AnswerRecord, ParticipantRecord, StudyRecords
from polite.study.stages import COMPARISONS, DONE, PRACTICE, STAGES, STILL_HERE

People = Sequence[ParticipantRecord]
Row = tuple[str, ...]


@dataclass(frozen=True)
class Section:
    """One table, in words."""

    title: str
    caption: str
    """How to read it."""
    columns: Row
    rows: tuple[Row, ...]


def summarise(records: StudyRecords, design: Design, now: float) -> list[Section]:
    """All tables of a study.

    Args:
        records: Everybody who did not withdraw.
        design: The study.
        now: The time [s since the epoch]; tells who seems to have left.
    """
    people = {c: [p for p in records.participants if p.condition == c] for c in CONDITIONS}
    return [
        _progress(people, records, design),
        _left(people, now),
        _catch_pairs(people),
        _answers(people),
        _times(people, design),
    ]


def _table(
    title: str,
    caption: str,
    rows: Iterable[tuple[str, Callable[[Condition], str]]],
    first: str = "",
) -> Section:
    """A table with a column for each condition."""
    cells = tuple((name, *(value(c) for c in CONDITIONS)) for name, value in rows)
    return Section(title, caption, (first, *CONDITIONS), cells)


def _progress(
    people: dict[Condition, list[ParticipantRecord]], records: StudyRecords, design: Design
) -> Section:
    reasons = {c: [exclusion(p, design) for p in group] for c, group in people.items()}

    def at(stage: str) -> Callable[[Condition], str]:
        return lambda c: str(sum(p.stage == stage for p in people[c]))

    def excluded(reason: str) -> Callable[[Condition], str]:
        return lambda c: str(sum(reason in given for given in reasons[c]))

    rows: list[tuple[str, Callable[[Condition], str]]] = [
        ("wanted", lambda c: str(design.participants)),
        ("consented", lambda c: str(len(people[c]) + records.withdrawn.get(c, 0))),
        ("withdrawn since", lambda c: str(records.withdrawn.get(c, 0))),
        *((f"now: {'finished' if s == DONE else s}", at(s)) for s in STAGES[1:]),
        *((f"excluded: {reason}", excluded(reason)) for reason in REASONS[1:]),
        (
            "finished and not excluded",
            lambda c: f"{sum(not given for given in reasons[c])} of {design.participants}",
        ),
    ]
    caption = "Participants by condition. The answers of those who withdrew are deleted. "
    caption += "Somebody can be excluded for two reasons, and before they have finished."
    return _table("Participants", caption, rows)


def _left(people: dict[Condition, list[ParticipantRecord]], now: float) -> Section:
    unfinished = {c: [p for p in group if p.finished_at is None] for c, group in people.items()}
    places = sorted({_where(p) for group in unfinished.values() for p in group})

    def at(where: tuple[int, int]) -> Callable[[Condition], str]:
        def value(condition: Condition) -> str:
            here = [p for p in unfinished[condition] if _where(p) == where]
            silent = sum(now - p.last_seen > STILL_HERE for p in here)
            return f"{len(here)} ({silent} silent)" if here else "0"

        return value

    caption = "Where those are who have not finished; silent: not heard of for an hour, so that "
    caption += "they seem to have left. Comparisons are counted from 1, catch pairs included."
    return _table("Not finished", caption, ((_called(w), at(w)) for w in places), "stage")


def _where(person: ParticipantRecord) -> tuple[int, int]:
    """A participant's stage and, within practice and comparisons, the first unanswered one."""
    stage = STAGES.index(person.stage)
    if person.stage not in (PRACTICE, COMPARISONS):
        return stage, 0
    kinds = ("practice",) if person.stage == PRACTICE else COUNTED
    return stage, len(answered(person, kinds)) + 1


def _called(where: tuple[int, int]) -> str:
    stage, place = where
    return f"{STAGES[stage]} {place}" if place else STAGES[stage]


def _catch_pairs(people: dict[Condition, list[ParticipantRecord]]) -> Section:
    results = {c: [r for p in group for r in catch_results(p)] for c, group in people.items()}

    def share(kind: str, outcome: str) -> Callable[[Condition], str]:
        def value(condition: Condition) -> str:
            done = [
                r.outcome == outcome
                for r in results[condition]
                if r.kind == kind and r.outcome != "unanswered"
            ]
            return _share(done)

        return value

    rows = (
        (f"{kind}: {outcome}", share(kind, outcome))
        for kind in ("repeated", "mirrored")
        for outcome in OUTCOMES
        if outcome != "unanswered"
    )
    caption = "Comparisons that came again, as they were or with left and right exchanged. "
    caption += "Contradicted: the other clip was preferred; undecided: no preference one time, or "
    caption += "no preference of another kind."
    return _table("Catch pairs", caption, rows)


def _answers(people: dict[Condition, list[ParticipantRecord]]) -> Section:
    last = {c: _last_answers(group) for c, group in people.items()}
    expressed = {c: [a for a in group if a.choice in _SIDES] for c, group in last.items()}

    def all_of(test: Callable[[AnswerRecord], bool]) -> Callable[[Condition], str]:
        return lambda c: _share([test(a) for a in last[c]])

    def preferred(test: Callable[[AnswerRecord], bool]) -> Callable[[Condition], str]:
        return lambda c: _share([test(a) for a in expressed[c]])

    def marked(test: Callable[[AnswerRecord], bool]) -> Callable[[Condition], str]:
        return lambda c: preferred(test)(c) if c == "polite" else "not asked"

    rows: list[tuple[str, Callable[[Condition], str]]] = [
        ("answers", lambda c: str(len(last[c]))),
        ("equal", all_of(lambda a: a.choice == "equal")),
        ("cannot compare", all_of(lambda a: a.choice == "incomparable")),
        ("left, of the preferences", preferred(lambda a: a.choice == "left")),
        ("good window, of the preferences", marked(lambda a: a.good is not None)),
        ("bad window, of the preferences", marked(lambda a: a.bad is not None)),
        ("nothing stands out, of the preferences", marked(lambda a: a.nothing)),
    ]
    caption = "Main comparisons of everybody, the excluded too; the last answer of each. Brackets "
    caption += "hold Wilson's 95% intervals, which take the answers as independent."
    return _table("Answers", caption, rows)


_SIDES: Final = ("left", "right")


def _times(people: dict[Condition, list[ParticipantRecord]], design: Design) -> Section:
    first = {
        c: [revisions[0] for p in group for _, revisions in answered(p)]
        for c, group in people.items()
    }

    def quartiles(value: Callable[[AnswerRecord], float | None]) -> Callable[[Condition], str]:
        return lambda c: _quartiles([value(a) for a in first[c]])

    def minutes(value: Callable[[ParticipantRecord], float | None]) -> Callable[[Condition], str]:
        return lambda c: _quartiles([value(p) for p in people[c] if p.finished_at is not None])

    def fast(condition: Condition) -> str:
        flags = [is_fast(answer, design) for answer in first[condition]]
        return _share([flag for flag in flags if flag is not None])

    rows: list[tuple[str, Callable[[Condition], str]]] = [
        ("seconds an answer", quartiles(lambda a: a.received_at - a.served_at)),
        ("of these, after watching", quartiles(decision_seconds)),
        (f"chosen less than {number(design.exclusion.fast_seconds)} s after watching", fast),
        ("minutes to the last comparison", minutes(minutes_tasks)),
        ("minutes in total", minutes(minutes_total)),
    ]
    caption = "Median [quartiles]. Answers: all comparisons, catch pairs included, up to the first "
    caption += "answer to each. Minutes: those who finished, from consent on, pauses included."
    return _table("Times", caption, rows)


def _last_answers(people: People) -> list[AnswerRecord]:
    return [revisions[-1] for p in people for _, revisions in answered(p, ("main",))]


def _share(values: Sequence[bool]) -> str:
    """`12.5% [2.2, 47.1] (1/8)`, or a dash where there is nothing to count."""
    if not values:
        return "–"
    return f"{percent(share_interval(sum(values), len(values)))} ({sum(values)}/{len(values)})"


def _quartiles(values: Sequence[float | None]) -> str:
    """Median and quartiles, by linear interpolation."""
    known = [value for value in values if value is not None]
    if not known:
        return "–"
    low, median, high = (f"{value:.1f}" for value in np.percentile(known, [25, 50, 75]))
    return f"{median} [{low}, {high}]"
