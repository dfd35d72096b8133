"""The summary, written from the numbers: nothing here knows how a run came out."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from typing import Any

from polite.analysis.numbers import as_array
from polite.analysis.statistics import Estimate, paired_difference
from polite.report.html import Markup, element, join
from polite.report.tables import badge, measurement
from polite.report.words import estimate, over_seeds

Results = Mapping[str, Any]


def findings(results: Results) -> Markup:
    """How many claims came out which way, then one point for each claim that emerges."""
    emergent = [claim for claim in results["claims"] if claim["kind"] == "emergent"]
    points = [_point(claim) for claim in emergent]
    points += [element("li", text) for text in (_quality(results), _policies(results))]
    return join([element("p", _tally(emergent, len(results["seeds"]))), element("ul", *points)])


def _tally(claims: list[dict[str, Any]], seeds: int) -> str:
    count = Counter(claim["verdict"] for claim in claims)
    text = (
        f"Of the {len(claims)} claims that a run can test, {count['reproduced']} came out as the "
        f"paper says, {count['not reproduced']} did not, and {count['undecided']} "
        f"{'is' if count['undecided'] == 1 else 'are'} undecided with {seeds} "
        f"{'seed' if seeds == 1 else 'seeds'}."
    )
    if seeds < 2:
        text += " One seed gives no interval, so nothing can be decided: use more."
    return text


def _point(claim: Mapping[str, Any]) -> Markup:
    """The claim, its verdict, and the quantity that decided it."""
    decisive = next(part for part in claim["parts"] if part["verdict"] == claim["verdict"])
    figure = re.match(r"(\d[a-d]|H\d)(?=-|$)", claim["id"])
    name = element("strong", f"{figure[0]}. " if figure else "", f"{claim['text']}.")
    return element("li", badge(claim["verdict"]), " ", name, f" {measurement(decisive)}.")


def _quality(results: Results) -> str:
    quality = results["reward_quality"]
    texts = []
    for key, words in (("pair_accuracy", "pair accuracy"), ("correlation", "correlation")):
        polite, baseline, null = (quality[c][key] for c in ("polite", "baseline", "null_shuffled"))
        gap = paired_difference(as_array(polite), as_array(baseline))
        texts.append(
            f"{words} {over_seeds(polite)} for POLITE, {over_seeds(baseline)} for the baseline, "
            f"{over_seeds(null)} with shuffled highlights; POLITE is {_side(gap)} the baseline "
            f"(difference {estimate(gap)})"
        )
    return (
        "Agreement with the true reward on held-out segments: " + ". Step-wise ".join(texts) + "."
    )


def _policies(results: Results) -> str:
    names = {"polite": "POLITE", "baseline": "the baseline", "ground_truth": "the true reward"}
    rates = (
        f"{over_seeds(results['policy'][c]['success_rate'], share=True)} trained on {name}"
        for c, name in names.items()
        if c in results["policy"]
    )
    return f"Success rate of the policies: {'; '.join(rates)}."


def _side(gap: Estimate) -> str:
    if gap.low > 0:
        return "above"
    return "below" if gap.high < 0 else "not told apart from"
