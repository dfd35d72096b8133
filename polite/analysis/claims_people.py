"""Claims about what people do, where people answered; simulation has them as inputs.

Answers of one participant depend on one another, so each rule counts participants, not answers.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from polite.analysis.numbers import Array, as_array
from polite.analysis.published import PUBLISHED
from polite.analysis.statistics import (
    Estimate,
    mean_interval,
    ratio_of_means,
    share_interval,
    welch_difference,
)
from polite.analysis.verdicts import Claim, above, shown

Results = Mapping[str, Any]

HALF = 0.5
"""People are as willing to highlight as the paper's if they do at least this share of it (our
threshold)."""


def no_preference(results: Results) -> Claim:
    """The share of comparisons without a preference is smaller where people can highlight."""
    rates = {c: _rates(results, c, "no_preference", _answers(results, c)) for c in _CALLED}
    counts = results["counts"]
    shares = (
        shown(
            f'"no preference", {name}, all answers',
            share_interval(counts[c]["no_preference"], counts[c]["answers"]),
        )
        for c, name in _CALLED.items()
    )
    gap = welch_difference(rates["baseline"], rates["polite"])
    return Claim(
        "no-preference",
        "emergent",
        "Participants see no preference less often when they can highlight",
        "16.5% (66/400) against 7% (28/400)",
        "Each participant's share of \"no preference\", baseline minus POLITE: Welch's 95% t "
        "interval over participants lies above 0.",
        (above('share of "no preference", baseline minus POLITE', gap, 0), *shares),
    )


def highlight_rates(results: Results) -> Claim:
    """People highlight when they may, at least half as often as the paper's participants."""
    expressed = _answers(results, "polite") - _of(results, "polite", "no_preference")
    counts = results["counts"]["polite"]
    parts = []
    for sign in ("positive", "negative"):
        bound = HALF * PUBLISHED["highlight_rate"][sign]
        rates = _rates(results, "polite", sign, expressed)
        parts += [
            above(f"{sign} highlights, mean over participants", mean_interval(rates), bound),
            shown(
                f"{sign} highlights, all preferences",
                share_interval(counts[sign], counts["expressed"]),
            ),
        ]
    return Claim(
        "highlights",
        "emergent",
        "Participants highlight when they may",
        "63.44% (236/372) positive, 47.31% (176/372) negative",
        "Each participant's highlights per expressed preference: the 95% t interval of their mean "
        f"over participants lies above {HALF:g} times the paper's rate, for both signs.",
        tuple(parts),
    )


def effort(results: Results) -> Claim:
    """Highlighting costs time."""
    polite, baseline = (_of(results, c, "minutes") for c in ("polite", "baseline"))
    ratio = ratio_of_means(polite, baseline)
    increase = Estimate(*(float(x) - 1.0 for x in (ratio.mean, ratio.low, ratio.high)))
    return Claim(
        "time",
        "emergent",
        "Highlighting costs more time",
        "24.83 ± 6.48 against 18.93 ± 9.4 min, 31.17% more",
        "Minutes a participant, from consent to the last comparison, tutorial and pauses included: "
        "Welch's 95% t interval of POLITE minus baseline lies above 0. How much more is shown, "
        "with Fieller's interval.",
        (
            above("POLITE minus baseline", welch_difference(polite, baseline), 0, "min"),
            shown("increase", increase),
        ),
    )


def people_claims(results: Results) -> list[Claim]:
    """All that only people's answers can decide."""
    return [no_preference(results), highlight_rates(results), effort(results)]


_CALLED = {"baseline": "baseline", "polite": "POLITE"}


def _of(results: Results, condition: str, name: str) -> Array:
    """(N,) one number for each participant of a condition."""
    return as_array(results["people"]["per_participant"][condition][name])


def _answers(results: Results, condition: str) -> Array:
    return _of(results, condition, "answers")


def _rates(results: Results, condition: str, name: str, of: Array) -> Array:
    """(≤ N,) each participant's share; without those who have nothing to take a share of."""
    some = of > 0
    return np.asarray(_of(results, condition, name)[some] / of[some], dtype=float)
