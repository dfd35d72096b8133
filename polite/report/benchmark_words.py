"""What a benchmark found, in sentences that are written from its numbers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from polite.analysis.benchmark_records import PAPER_FORM, Condition
from polite.report.html import Markup, element, join
from polite.report.tables import badge
from polite.report.words import NBSP, number, stored

Results = Mapping[str, Any]

HEADLINE = ("POLITE-200", "baseline-800")
BAR, CONTROLS = "bar-", ("control-", "more-answers")
ALONE = ("highlights-for-preferences", "alone-")
"""How the names of claims begin that are about our form. (The paper's claims are judged under it as
well, by the same numbers; their table has them.)"""
HOLDS = {"reproduced": "holds", "not reproduced": "does not hold"}
"""Verdicts on what the paper does not claim."""


def benchmark_findings(results: Results) -> Markup:
    """The headline for each env and condition, our form's claims, gains, and the tally."""
    parts = [
        element("p", _tally(results)),
        element("h3", "Does POLITE with 200 queries match the baseline with 800?"),
        _list(_headlines(results), "No env has two runs of both yet: undecided."),
        element("h3", "Does our own form of the highlights meet its bar?"),
        element(
            "p",
            "Where seeds were added after a verdict had been read, the interval is not widened for "
            "it; what that costs is said under the claims.",
        ),
        _list(_judged(results, BAR), "No such cell is finished or planned."),
        element("h3", "Is it what highlights say, or how much the reward model is trained?"),
        _list(_judged(results, *CONTROLS), "The controls are neither finished nor planned."),
        element("h3", "Do highlights in our form do alone, without the preferences?"),
        _list(_judged(results, *ALONE), "No such cell is finished or planned."),
        element("h3", "What do highlights buy at equal queries?"),
        _list(_gains(results), "No pair of cells with equal queries is finished."),
    ]
    return join(parts)


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
    paper = [claim for claim in results["claims"] if claim["kind"] == "emergent"]
    own = [claim for claim in results["claims"] if claim["id"].startswith((BAR, *CONTROLS))]
    for claims, title, holds in (
        (paper, "The paper's claims, with its highlights, once for each loss", "reproduced"),
        (own, "Our form's bar and its controls", "hold"),
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


def _headlines(results: Results) -> Iterator[Markup]:
    for part in results["comparisons"]:
        if (part["first"], part["second"]) != HEADLINE:
            continue
        counts = f"{part['n'][0]} and {_count(part['n'][1], 'run')}"
        polite, baseline = part["means"]
        text = (
            f": POLITE-200 {_relation(part['difference'])} baseline-800: {number(polite)} against "
            f"{number(baseline)} (difference {stored(part['difference'])}, ratio "
            f"{stored(part['ratio'])}, {counts})."
        )
        where = element("strong", f"{part['env']}, {condition_words(part)}")
        yield element("li", where, text)


def _judged(results: Results, *groups: str) -> Iterator[Markup]:
    """The claims whose names begin so, with each part that is judged."""
    for claim in results["claims"]:
        if claim["id"].startswith(groups):
            text = f" {claim['env']}, {condition_words(claim)}: {claim['text']}"
            judged = [part for part in claim["parts"] if part["verdict"] != "shown"]
            numbers = "; ".join(f"{p['what']}: {stored(p, 'measured')}" for p in judged)
            missing = f" Missing: {', '.join(claim['missing'])}." if claim["missing"] else ""
            yield element("li", verdict_badge(claim), f"{text}. {numbers}.{missing}")


def _gains(results: Results) -> Iterator[Markup]:
    for part in results["comparisons"]:
        first, second = (part[name].rsplit("-", 1) for name in ("first", "second"))
        if (first[0], second[0]) == ("POLITE", "baseline") and first[1:] == second[1:]:
            text = f"{part['env']}, {condition_words(part)}, {first[1]} queries: POLITE minus "
            text += f"baseline {stored(part['difference'])}. POLITE {_relation(part['difference'])}"
            yield element("li", f"{text} the baseline.")


def _relation(difference: Mapping[str, Any]) -> str:
    if difference["low"] is None or difference["high"] is None:
        return "has too few runs to be told apart from"
    if difference["low"] > 0:
        return "beats"
    return "falls short of" if difference["high"] < 0 else "is not told apart from"


def _list(points: Iterator[Markup], otherwise: str) -> Markup:
    found = list(points)
    return element("ul", *found) if found else element("p", otherwise)


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
