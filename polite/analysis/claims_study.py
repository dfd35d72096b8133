"""Claims about the policies (Fig. 5d, H3), about what was put in, and plain arithmetic."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from polite.analysis.claims_people import people_claims
from polite.analysis.numbers import as_array
from polite.analysis.published import PUBLISHED
from polite.analysis.respondents import respondents
from polite.analysis.statistics import (
    Estimate,
    Summary,
    chi_square,
    share_interval,
    welch_difference,
    welch_test,
)
from polite.analysis.verdicts import Claim, Part, above, given

Results = Mapping[str, Any]


def policy_return(results: Results) -> Claim:
    """5d: the policy trained on POLITE's reward earns more true return than the baseline's."""
    returns = (as_array(results["policy"][c]["return"]) for c in ("polite", "baseline"))
    return Claim(
        "5d",
        "emergent",
        "POLITE's policy ends above the baseline's",
        "shown in Fig. 5d, no number",
        "True return of the final policies, POLITE minus baseline: Welch's 95% t interval over "
        "seeds lies above 0.",
        (above("true return, POLITE minus baseline", welch_difference(*returns), 0),),
    )


def policies_differ(results: Results) -> Claim:
    """H3: the two policies differ by more than two baseline policies of different seeds."""
    part = results["policy_difference"]
    gaps = (as_array(part[name]) for name in ("per_seed", "null_per_seed"))
    return Claim(
        "H3-policy",
        "emergent",
        "POLITE derives a substantially different policy",
        "hypothesis H3, no number",
        "Mean L2 distance of the mean actions on shared states, POLITE to baseline minus baseline "
        "to baseline of another seed: Welch's 95% t interval over seeds lies above 0.",
        (above("action distance beyond that of two baselines", welch_difference(*gaps), 0),),
    )


def no_preference(results: Results) -> Claim:
    """The share of queries without a preference: calibrated, so never a finding."""
    counts = results["counts"]
    parts = (
        given(
            f'"no preference", {name}',
            share_interval(counts[key]["no_preference"], counts[key]["answers"]),
        )
        for key, name in (("baseline", "baseline"), ("polite", "POLITE"))
    )
    return Claim(
        "no-preference",
        "input",
        "Participants see no preference less often when they can highlight",
        "16.5% (66/400) against 7% (28/400)",
        _put_in(results, " of the simulated participants"),
        tuple(parts),
    )


def highlight_rates(results: Results) -> Claim:
    """Willingness to highlight, per expressed preference: calibrated."""
    counts = results["counts"]["polite"]
    parts = (
        given(f"{sign} highlights", share_interval(counts[sign], counts["expressed"]))
        for sign in ("positive", "negative")
    )
    return Claim(
        "highlights",
        "input",
        "Participants highlight when they may",
        "63.44% (236/372) positive, 47.31% (176/372) negative",
        f"Per expressed preference. {_put_in(results)} A rate below its input means that too few "
        "preferred clips had a moment of that sign.",
        tuple(parts),
    )


def effort(results: Results) -> Claim:
    """Minutes a participant: calibrated."""
    times = results["times"]
    gap = times["difference"]
    return Claim(
        "time",
        "input",
        "Highlighting costs 31.17% more time",
        "24.83 ± 6.48 against 18.93 ± 9.4 min",
        f"Minutes a participant, tutorial included. {_put_in(results)}",
        (
            given("POLITE minus baseline", Estimate(*_bounds(gap)), "min"),
            given("increase", Estimate(times["increase"], np.nan, np.nan)),
        ),
    )


def design(results: Results) -> Claim:
    """Answers collected in each condition, by design."""
    simulated = respondents(results) == "simulated"
    source = "the preset" if simulated else "the study's design and by who finished"
    parts = (
        given(f"answers, {name}", Estimate(results["counts"][key]["answers"], np.nan, np.nan))
        for key, name in (("polite", "POLITE"), ("baseline", "baseline"))
    )
    return Claim(
        "design",
        "input",
        "20 + 20 participants answer 20 queries each: 400 in each condition",
        "40 participants, 400 answers a condition",
        f"Set by {source}; shown, not judged.",
        tuple(parts),
    )


def published_chi_square() -> Claim:
    """The paper's own test, recomputed from its counts: arithmetic, no simulation."""
    counts = (66, 400, 28, 400)
    test = chi_square(*counts, yates=True)
    agrees = round(test.statistic, 1) == PUBLISHED["chi_square"]["statistic"]
    small = test.p_value < PUBLISHED["chi_square"]["p_value_below"]
    part = Part(
        "χ² with Yates' correction from 66/400 and 28/400",
        Estimate(test.statistic, np.nan, np.nan),
        "reproduced" if agrees and small else "not reproduced",
        "rounds to 16.5",
    )
    return Claim(
        "arithmetic-chi-square",
        "arithmetic",
        "Condition and no preference are related: χ² = 16.5, p < .001",
        "χ² = 16.5, p < .001",
        "Arithmetic on the published counts: Yates' χ² rounds to 16.5 and p < .001.",
        (part,),
    )


def published_times() -> Claim:
    """The paper's increase in time, recomputed from its two means."""
    polite, baseline = (PUBLISHED["times"][c] for c in ("polite", "baseline"))
    increase = polite["mean"] / baseline["mean"] - 1
    test = welch_test(Summary(**polite, count=20), Summary(**baseline, count=20))
    agrees = round(increase, 4) == PUBLISHED["times"]["increase"]
    return Claim(
        "arithmetic-time",
        "arithmetic",
        "Time rises by 31.17%",
        "31.17%",
        "Arithmetic on the published means. Welch's t is ours: it reads the ± as a standard "
        "deviation over 20 participants.",
        (
            Part(
                "increase from 18.93 to 24.83 min",
                Estimate(increase, np.nan, np.nan),
                "reproduced" if agrees else "not reproduced",
                "rounds to 0.3117",
            ),
            given(f"Welch's t (p = {test.p_value:.3f})", Estimate(test.statistic, np.nan, np.nan)),
        ),
    )


def study_claims(results: Results) -> list[Claim]:
    """Claims about policies first, then what participants did, then the arithmetic.

    What participants did is judged where they are people, and an input where they are not.
    """
    emergent = [policy_return(results), policies_differ(results)]
    if respondents(results) == "people":
        done = people_claims(results)
    else:
        done = [rule(results) for rule in (no_preference, highlight_rates, effort)]
    return [*emergent, *done, design(results), published_chi_square(), published_times()]


def _put_in(results: Results, whose: str = "") -> str:
    """The rule of a claim that was put in."""
    robots = respondents(results) == "robots"
    source = "the robots' program" if robots else f"calibration{whose}"
    return f"Put in by {source}; shown, not judged."


def _bounds(estimate: Mapping[str, Any]) -> tuple[float, float, float]:
    values = as_array([estimate[name] for name in ("mean", "low", "high")])
    return float(values[0]), float(values[1]), float(values[2])
