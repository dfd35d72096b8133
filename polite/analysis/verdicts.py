"""How a claim is judged: by where a 95% interval lies against a bound that was set beforehand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from polite.analysis.numbers import as_json
from polite.analysis.statistics import Estimate

Verdict = Literal["reproduced", "not reproduced", "undecided", "input", "shown"]
"""Of a claim, or of a part; a part that is only shown decides nothing."""
Kind = Literal["emergent", "input", "arithmetic", "comparison"]
"""What a claim rests on: on what the run computed, on what was put in, or on printed numbers. A
comparison rests on what the run computed too, but the paper does not make it."""


@dataclass(frozen=True)
class Part:
    """One measured quantity of a claim."""

    what: str
    """The quantity, in words that a caption could use."""
    estimate: Estimate
    verdict: Verdict
    bound: str = ""
    """What the whole interval has to satisfy, e.g. "> 0"; empty where nothing is judged."""
    unit: str = ""

    def as_json(self) -> dict[str, Any]:
        """The part as one flat dictionary; an unbounded side of the interval is null."""
        return {
            "what": self.what,
            "measured": as_json(self.estimate.mean),
            "low": as_json(self.estimate.low),
            "high": as_json(self.estimate.high),
            "unit": self.unit,
            "bound": self.bound,
            "verdict": self.verdict,
        }


@dataclass(frozen=True)
class Claim:
    """A statement of the paper, the rule that judges it, and the quantities that the rule reads."""

    id: str
    kind: Kind
    text: str
    published: str
    rule: str
    parts: tuple[Part, ...]

    def as_json(self) -> dict[str, Any]:
        """An entry of `claims` in results.json; the numbers on top are the deciding part's."""
        verdict = combine([part.verdict for part in self.parts])
        decisive = next(part for part in self.parts if part.verdict == verdict).as_json()
        heading = {name: asdict(self)[name] for name in ("id", "kind", "text", "published", "rule")}
        numbers = {name: decisive[name] for name in ("measured", "low", "high", "unit")}
        parts = [part.as_json() for part in self.parts]
        return heading | {"verdict": verdict} | numbers | {"parts": parts}


def above(what: str, estimate: Estimate, bound: float, unit: str = "") -> Part:
    """Reproduced when the whole interval lies above the bound; not when all of it lies below."""
    verdict = _place(estimate, bound, "reproduced", "not reproduced")
    return Part(what, estimate, verdict, f"> {bound:g}", unit)


def below(what: str, estimate: Estimate, bound: float, unit: str = "") -> Part:
    """Reproduced when the whole interval lies below the bound; not when all of it lies above."""
    verdict = _place(estimate, bound, "not reproduced", "reproduced")
    return Part(what, estimate, verdict, f"< {bound:g}", unit)


def given(what: str, estimate: Estimate, unit: str = "") -> Part:
    """A quantity that calibration or design put in: shown, never judged."""
    return Part(what, estimate, "input", "", unit)


def at_least(what: str, estimate: Estimate, bound: float, unit: str = "") -> Part:
    """Reproduced when the measured value is at least the bound; not when the interval is below it.

    The value itself is judged, not its interval: a weak rule, to be put beside a stricter one.
    """
    verdict = _place(estimate, bound, "reproduced", "not reproduced")
    if verdict == "undecided" and estimate.mean >= bound and np.isfinite(estimate.low):
        verdict = "reproduced"
    return Part(what, estimate, verdict, f"value ≥ {bound:g}", unit)


def between(what: str, estimate: Estimate, low: float, high: float, unit: str = "") -> Part:
    """Reproduced when the whole interval lies within the bounds; not when it lies outside them."""
    over = _place(estimate, low, "reproduced", "not reproduced")
    under = _place(estimate, high, "not reproduced", "reproduced")
    return Part(what, estimate, combine([over, under]), f"{low:g} to {high:g}", unit)


def shown(what: str, estimate: Estimate, unit: str = "") -> Part:
    """A measured quantity that explains another one, and is not judged."""
    return Part(what, estimate, "shown", "", unit)


def combine(verdicts: Sequence[Verdict]) -> Verdict:
    """A claim holds when all its judged parts do, and fails when any one fails.

    Requiring every part to pass its own 5% test keeps the whole at 5% (intersection–union test).
    Where nothing is judged, all is only shown.
    """
    judged = [verdict for verdict in verdicts if verdict != "shown"]
    if not judged:
        return "shown"
    if "not reproduced" in judged:
        return "not reproduced"
    if "undecided" in judged:
        return "undecided"
    return "input" if set(judged) == {"input"} else "reproduced"


def _place(estimate: Estimate, bound: float, over: Verdict, under: Verdict) -> Verdict:
    if np.isnan([estimate.mean, estimate.low, estimate.high]).any():
        return "undecided"
    if estimate.low > bound:
        return over
    return under if estimate.high < bound else "undecided"
