"""What a benchmark found, in sentences that are written from its numbers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from polite.analysis.benchmark_records import PAPER_FORM, Condition
from polite.report.html import Markup, element, join, matrix
from polite.report.tables import badge
from polite.report.words import NBSP, number, stored

Results = Mapping[str, Any]

HEADLINE = ("POLITE-200", "baseline-800")
BAR, CONTROLS = "bar-", ("control-", "more-answers")
ALONE = ("highlights-for-preferences", "alone-")
"""How the names of claims begin that are about our form. (The paper's claims are judged under it as
well, by the same numbers; their table has them.)"""
ADDED = (
    "Where seeds were added after a verdict had been read, the interval is not widened for it; "
    "what that costs is said under the claims."
)
HOLDS = {"reproduced": "holds", "not reproduced": "does not hold"}
"""Verdicts on what the paper does not claim."""


def benchmark_findings(results: Results) -> Markup:
    """The tally, then a table for each question, with a column for each env."""
    envs = results["envs"]
    parts = [
        element("p", _tally(results)),
        element("p", ADDED),
        _answer(
            "Does POLITE with 200 queries match the baseline with 800?",
            "Final true return; Welch's 95% interval of the difference, Fieller's of the ratio.",
            ("Condition", *envs),
            _headlines(results),
        ),
        _answer(
            "Does our own form of the highlights meet its bar?",
            "Highlights beside preferences. Its rules are below, with all others.",
            ("Criterion", *envs),
            _judged(results, BAR),
        ),
        _answer(
            "Do highlights in our form do alone, without the preferences?",
            "Their rules are below, with all others.",
            ("Criterion", *envs),
            _judged(results, *ALONE),
        ),
        _answer(
            "Is it what highlights say, or how much the reward model is trained?",
            "Controls: the same training but for what their name says.",
            ("Control", *envs),
            _judged(results, *CONTROLS),
        ),
        _answer(
            "What do highlights buy at equal queries?",
            "Final true return, POLITE minus the baseline.",
            ("Queries and condition", *envs),
            _gains(results),
        ),
    ]
    return join(parts)


def _answer(
    question: str, words: str, head: Sequence[str], entries: Iterator[tuple[str, str, str]]
) -> Markup:
    found = list(entries)
    none = element("p", "Undecided: no such pair of cells has runs yet.")
    return join([element("h3", question), matrix(words, head, found) if found else none])


def condition_words(part: Mapping[str, Any]) -> str:
    """The condition of a claim or comparison in words."""
    names = (part[name] for name in ("preset", "variant", "loss", "highlights"))
    return Condition(*names).title


def verdict_badge(claim: Mapping[str, Any]) -> Markup:
    """The verdict of a claim, "so far" while runs are missing.

    What is not the paper's own holds or does not hold.
    """
    verdict = claim["verdict"]
    words = HOLDS.get(verdict, verdict) if claim["kind"] == "comparison" else verdict
    return badge(verdict, f"so far: {words}" if claim["missing"] else words)


def _tally(results: Results) -> str:
    runs = results["runs"]
    text = f"{_count(runs['finished'], 'run')} finished"
    if runs["plan_known"]:
        text += f", {runs['missing']} missing"
    if runs["made_otherwise"]:
        text += f", {runs['made_otherwise']} left out that other settings made"
    if damaged := runs.get("damaged"):  # older results do not tell
        text += f", {_count(len(damaged), 'record')} damaged ({', '.join(damaged)})"
    paper = [claim for claim in results["claims"] if claim["kind"] == "emergent"]
    own = [claim for claim in results["claims"] if claim["id"].startswith((BAR, *ALONE, *CONTROLS))]
    for claims, title, holds in (
        (paper, "The paper's claims, with its highlights, once for each loss", "reproduced"),
        (own, "Our form's bar, beside preferences and alone, and its controls", "hold"),
    ):
        text += f". {title}: {_verdicts([c for c in claims if not c['missing']], holds)}"
        waiting = [claim for claim in claims if claim["missing"]]
        text += f"; so far, with runs missing: {_verdicts(waiting, holds)}" if waiting else ""
    return f"{text}."


def _verdicts(claims: Sequence[Mapping[str, Any]], holds: str) -> str:
    """How many claims have each verdict."""
    count = Counter(claim["verdict"] for claim in claims)
    return (
        f"{count['reproduced']} {holds}, {count['not reproduced']} "
        f"{'not' if holds == 'reproduced' else 'do not'}, {count['undecided']} undecided"
    )


def _headlines(results: Results) -> Iterator[tuple[str, str, str]]:
    for part in results["comparisons"]:
        if (part["first"], part["second"]) == HEADLINE:
            counts = f"{part['n'][0]} and {_count(part['n'][1], 'run')}"
            polite, baseline = part["means"]
            yield (
                condition_words(part),
                part["env"],
                f"POLITE-200 {_relation(part['difference'])} baseline-800: {number(polite)} "
                f"against {number(baseline)} (difference {stored(part['difference'])}, ratio "
                f"{stored(part['ratio'])}, {counts}).",
            )


def _judged(results: Results, *groups: str) -> Iterator[tuple[str, str, str]]:
    """The claims whose names begin so, with each part that is judged."""
    for claim in results["claims"]:
        if claim["id"].startswith(groups):
            judged = [part for part in claim["parts"] if part["verdict"] != "shown"]
            numbers = "; ".join(f"{p['what']}: {stored(p, 'measured')}" for p in judged)
            missing = f" Missing: {', '.join(claim['missing'])}." if claim["missing"] else ""
            text = f" {condition_words(claim)}. {numbers}.{missing}"
            yield claim["text"], claim["env"], join([verdict_badge(claim), text])


def _gains(results: Results) -> Iterator[tuple[str, str, str]]:
    for part in results["comparisons"]:
        first, second = (part[name].rsplit("-", 1) for name in ("first", "second"))
        if (first[0], second[0]) == ("POLITE", "baseline") and first[1:] == second[1:]:
            text = f"{stored(part['difference'])}. POLITE {_relation(part['difference'])}"
            row = f"{first[1]}, {condition_words(part)}"
            yield row, part["env"], f"{text} the baseline."


def _relation(difference: Mapping[str, Any]) -> str:
    if difference["low"] is None or difference["high"] is None:
        return "has too few runs to be told apart from"
    if difference["low"] > 0:
        return "beats"
    return "falls short of" if difference["high"] < 0 else "is not told apart from"


def _count(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def form_words(form: str | None) -> str:
    """A form of highlights in words."""
    if form is None:
        return "–"
    return "the paper's" if form == PAPER_FORM else form


def reached_words(row: Mapping[str, Any]) -> str:
    """Queries to reach a return with their interval; > the largest budget, ≤ the smallest."""
    sign = {"at": "", "at or before": "≤" + NBSP, "not reached": ">" + NBSP}[row["reached"]]
    if not row.get("interval", row["low"] is not None):  # older results do not tell
        return f"{sign}{row['queries']:.0f}"
    low = "[∞" if row["low"] is None else f"[{row['low']:.0f}" if row["low"] else "(0"
    high = "∞)" if row["high"] is None else f"{row['high']:.0f}]"
    return f"{sign}{row['queries']:.0f} {low},{NBSP}{high}"
