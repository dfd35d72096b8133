"""Claims that only people can decide: rules on values worked out by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fake_results import fake_results

from polite.analysis.answers import chi_square_part
from polite.analysis.claims import judge
from polite.analysis.claims_people import effort, highlight_rates, no_preference
from polite.analysis.respondents import respondents
from polite.analysis.verdicts import Claim


def results(**changes: dict[str, list[float]]) -> dict[str, Any]:
    """Four in each condition with ten answers each; `polite` and `baseline` can be changed."""
    people = {
        "polite": {
            "answers": [10.0] * 4,
            "no_preference": [0.0, 1.0, 0.0, 1.0],
            "positive": [6.0, 7.0, 6.0, 7.0],
            "negative": [5.0, 4.0, 5.0, 4.0],
            "minutes": [24.0, 25.0, 26.0, 25.0],
        },
        "baseline": {
            "answers": [10.0] * 4,
            "no_preference": [3.0, 4.0, 3.0, 4.0],
            "positive": [0.0] * 4,
            "negative": [0.0] * 4,
            "minutes": [20.0, 19.0, 21.0, 20.0],
        },
    }
    people = {name: group | changes.get(name, {}) for name, group in people.items()}
    counts = {}
    for name, group in people.items():
        total = {key: int(sum(values)) for key, values in group.items() if key != "minutes"}
        counts[name] = total | {"expressed": total["answers"] - total["no_preference"]}
    return {"simulated": False, "people": {"per_participant": people}, "counts": counts}


def verdict(claim: Claim) -> str:
    return str(claim.as_json()["verdict"])


def part(claim: Claim, index: int = 0) -> Any:
    return claim.parts[index].estimate


def test_no_preference() -> None:
    claim = no_preference(results())
    assert part(claim).mean == pytest.approx(0.35 - 0.05)
    assert part(claim, 1).mean == pytest.approx(14 / 40)
    assert verdict(claim) == "reproduced"
    same = [3.0, 4.0, 3.0, 4.0]
    assert verdict(no_preference(results(polite={"no_preference": same}))) == "undecided"
    more = [8.0, 9.0, 8.0, 9.0]
    assert verdict(no_preference(results(polite={"no_preference": more}))) == "not reproduced"


def test_participants_are_weighted_alike_however_many_answers_they_gave() -> None:
    few = {"answers": [10.0, 10.0, 10.0, 2.0], "no_preference": [0.0, 0.0, 0.0, 2.0]}
    assert part(no_preference(results(polite=few))).mean == pytest.approx(0.35 - 0.25)


def test_highlights_are_judged_against_half_of_the_papers_rates() -> None:
    claim = highlight_rates(results())
    assert verdict(claim) == "reproduced"
    assert [p.bound for p in claim.parts] == ["> 0.3172", "", "> 0.23655", ""]
    assert part(claim).mean == pytest.approx(np.mean([6 / 10, 7 / 9, 6 / 10, 7 / 9]))
    assert part(claim, 3).mean == pytest.approx(18 / 38)
    seldom = {"negative": [0.0, 1.0, 0.0, 1.0]}
    assert verdict(highlight_rates(results(polite=seldom))) == "not reproduced"
    split = {"positive": [9.0, 0.0, 9.0, 0.0]}
    assert verdict(highlight_rates(results(polite=split))) == "undecided"


def test_who_prefers_nothing_has_no_rate_of_highlights() -> None:
    nothing = {"no_preference": [0.0, 1.0, 0.0, 10.0], "positive": [6.0, 9.0, 6.0, 0.0]}
    claim = highlight_rates(results(polite=nothing))
    assert part(claim).mean == pytest.approx(np.mean([0.6, 1.0, 0.6]))


def test_effort() -> None:
    claim = effort(results())
    assert part(claim).mean == pytest.approx(5.0)
    assert part(claim, 1).mean == pytest.approx(0.25)
    assert verdict(claim) == "reproduced"
    quick = {"minutes": [9.0, 10.0, 11.0, 10.0]}
    assert verdict(effort(results(polite=quick))) == "not reproduced"
    slow = {"minutes": [2.0, 60.0, 2.0, 30.0]}
    assert verdict(effort(results(polite=slow))) == "undecided"


def test_simulated_runs_are_judged_as_before() -> None:
    simulated = fake_results(seeds=3)
    assert respondents(simulated) == "simulated"
    inputs = {c["id"]: c["rule"] for c in judge(simulated) if c["kind"] == "input"}
    assert set(inputs) == {"no-preference", "highlights", "time", "design"}
    assert inputs["no-preference"].startswith("Put in by calibration of the simulated")


def test_chi_square_of_unequal_numbers_of_answers() -> None:
    """With one number each it is that of equal numbers; else totals and rates are each one's."""
    polite, baseline = np.array([1.0, 2.0, 0.0]), np.array([3.0, 4.0])
    draw = [np.random.default_rng(1) for _ in range(3)]
    equal = chi_square_part(polite, baseline, 10, draw[0])
    arrays = chi_square_part(polite, baseline, (np.full(3, 10.0), np.full(2, 10.0)), draw[1])
    assert arrays == equal
    unequal = chi_square_part(
        polite, baseline, (np.array([10.0, 4.0, 6.0]), np.array([6.0, 8.0])), draw[2]
    )
    # 7 of 14 against 3 of 20: 34 (7·17 − 7·3)² / (14·20·10·24), without correction.
    assert unequal["uncorrected"]["statistic"] == pytest.approx(34 * 98**2 / (14 * 20 * 10 * 24))
    assert unequal["cluster"]["statistic"] == pytest.approx(0.5 - np.mean([0.1, 0.5, 0.0]))
