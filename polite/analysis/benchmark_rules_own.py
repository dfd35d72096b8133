"""What the paper does not compare, and what we ask of ourselves: the bar, and its controls."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from polite.analysis.benchmark_records import (
    EQUAL_UPDATES,
    FEW_EPOCHS,
    NOISY,
    RAISED,
    SHUFFLED,
    label,
)
from polite.analysis.benchmark_rules import (
    ABOVE_0,
    BASELINE_400,
    BASELINE_800,
    HIGHLIGHTS_400,
    NEAR,
    POLITE_200,
    Rule,
    is_above,
)
from polite.analysis.comparisons import View, Wanted
from polite.analysis.verdicts import Part, above, at_least

EQUAL_EFFORT: Final = {200: 262, 400: 525}
"""Queries without highlights that take people as long as those with them: 31% more, rounded."""
POLITE_100 = Wanted("polite", 100)
BASELINE_262 = Wanted("preferences", 262)
ALONE_200 = Wanted("highlights", 200)
NOISY_200, NOISY_ALONE_200 = (w._replace(variant=NOISY) for w in (POLITE_200, ALONE_200))
RAISED_ALONE_200 = ALONE_200._replace(variant=RAISED)
SHUFFLED_200 = Wanted("polite", 200, SHUFFLED)
UPDATED_262 = Wanted("preferences", 262, EQUAL_UPDATES)
UPDATED_800 = Wanted("preferences", 800, EQUAL_UPDATES)
PLAIN: Final = (POLITE_200, BASELINE_800, BASELINE_262)
WITH_FEW_EPOCHS: Final = tuple(which._replace(variant=FEW_EPOCHS) for which in PLAIN)
NOT_IN_PAPER: Final = "not in the paper"
AFTER_400: Final = (
    "(Written before the runs of highlights alone with 200 queries; the first ones with 400, and "
    "those of what they are compared with, had been read.)"
)
RAISING: Final = (
    "(For 'raised' written before any run under it; what is not raised had been read, and of two "
    "other seeds two trial runs each, at two levels of the reward model, one of them about the "
    "same. That HalfCheetah is judged under it too was decided when Walker2d had been read.)"
)
AT_EQUAL_UPDATES: Final = (
    "In this control the reward model is updated as often after each session as POLITE-200's, "
    "however many answers there are."
)


def _no_worse_than(name: str) -> str:
    return (
        f"The mean final true return as measured is at least {name}'s (the interval of the "
        f"difference may straddle 0), and Fieller's 95% interval of the ratio lies above {NEAR:g}."
    )


def _no_worse(baseline: Wanted, ours: Wanted = POLITE_200) -> Callable[[View], tuple[Part, ...]]:
    names = label(*ours), label(*baseline)
    return lambda view: (
        at_least(" minus ".join(names), view.difference(ours, baseline), 0),
        above(" / ".join(names), view.ratio(ours, baseline), NEAR),
    )


def _few_epochs(view: View) -> tuple[Part, ...]:
    pairs = ((few, few._replace(variant="")) for few in WITH_FEW_EPOCHS)
    return tuple(
        above(f"{label(*few)} minus {label(*plain)}", view.difference(few, plain), 0)
        for few, plain in pairs
    )


OWN_RULES: Final[tuple[Rule, ...]] = (
    *(
        Rule(
            f"equal-effort-{queries}",
            f"POLITE-{queries} beats the baseline at equal effort of people ({more} queries)",
            NOT_IN_PAPER,
            f"A query with highlights takes 31% more time. Final true return, POLITE-{queries} "
            f"minus baseline-{more}: {ABOVE_0}",
            (Wanted("polite", queries), Wanted("preferences", more)),
            is_above(
                f"POLITE-{queries} minus baseline-{more}",
                Wanted("polite", queries),
                Wanted("preferences", more),
            ),
            kind="comparison",
        )
        for queries, more in EQUAL_EFFORT.items()
    ),
    Rule(
        "bar-fewer-queries",
        "Our bar: with our form of the highlights, POLITE-200 is no worse than baseline-800",
        NOT_IN_PAPER,
        _no_worse_than("baseline-800"),
        (POLITE_200, BASELINE_800),
        _no_worse(BASELINE_800),
        kind="comparison",
        own=True,
        variants=("", FEW_EPOCHS, RAISED),
    ),
    Rule(
        "bar-equal-effort",
        "Our bar: with our form of the highlights, POLITE-200 beats the baseline at equal effort",
        NOT_IN_PAPER,
        f"Final true return, POLITE-200 minus baseline-262: {ABOVE_0}",
        (POLITE_200, BASELINE_262),
        is_above("POLITE-200 minus baseline-262", POLITE_200, BASELINE_262),
        kind="comparison",
        own=True,
        variants=("", FEW_EPOCHS, RAISED),
    ),
    Rule(
        "bar-equal-effort-anew",
        "The same on ten new seeds alone: POLITE-200 in our form beats the baseline at equal "
        "effort on Walker2d",
        NOT_IN_PAPER,
        "Seeds 0 to 9 had left it undecided, so that ten more were run. Final true return of seeds "
        f"10 and later, POLITE-200 minus baseline-262: {ABOVE_0}",
        (POLITE_200, BASELINE_262),
        is_above("POLITE-200 minus baseline-262", POLITE_200, BASELINE_262),
        env="Walker2d",
        kind="comparison",
        own=True,
        first_seed=10,
    ),
    Rule(
        "half-effort",
        "With our form of the highlights half of people's time is enough: POLITE-100 is no worse "
        "than baseline-262",
        NOT_IN_PAPER,
        "A query with highlights takes 31% more time, so that 100 take half as long as 262 "
        f"without. {_no_worse_than('baseline-262')} (Written before the runs of POLITE-100; those "
        "of baseline-262 had been read.)",
        (POLITE_100, BASELINE_262),
        _no_worse(BASELINE_262, POLITE_100),
        kind="comparison",
        own=True,
    ),
    Rule(
        "highlights-for-preferences",
        "With our form of the highlights the preferences can be left out: highlights alone are no "
        "worse than preferences alone (400 queries)",
        NOT_IN_PAPER,
        f"{_no_worse_than('baseline-400')} (Written before the runs of highlights alone in our "
        "form; those of baseline-400 had been read.)",
        (HIGHLIGHTS_400, BASELINE_400),
        _no_worse(BASELINE_400, HIGHLIGHTS_400),
        kind="comparison",
        own=True,
    ),
    Rule(
        "alone-fewer-queries",
        "The bar without preferences: with our form of the highlights, highlights alone with 200 "
        "queries are no worse than baseline-800",
        NOT_IN_PAPER,
        f"{_no_worse_than('baseline-800')} {AFTER_400}",
        (ALONE_200, BASELINE_800),
        _no_worse(BASELINE_800, ALONE_200),
        kind="comparison",
        own=True,
        variants=("", RAISED),
    ),
    Rule(
        "alone-equal-effort",
        "The bar without preferences: with our form of the highlights, highlights alone with 200 "
        "queries beat the baseline at equal effort",
        NOT_IN_PAPER,
        f"Final true return, highlights-200 minus baseline-262: {ABOVE_0} {AFTER_400}",
        (ALONE_200, BASELINE_262),
        is_above("highlights-200 minus baseline-262", ALONE_200, BASELINE_262),
        kind="comparison",
        own=True,
        variants=("", RAISED),
    ),
    Rule(
        "alone-equal-effort-anew",
        "The same on new seeds alone: with our form and the reward model raised, highlights alone "
        "with 200 queries beat the baseline at equal effort on Walker2d",
        NOT_IN_PAPER,
        "Seeds 0 to 4 had left it undecided, so that five more of highlights alone were run, and "
        "ten of the baseline, whose returns spread more. Final true return of seeds 5 and later, "
        f"highlights-200 minus baseline-262: {ABOVE_0}",
        (ALONE_200, BASELINE_262),
        is_above("highlights-200 minus baseline-262", ALONE_200, BASELINE_262),
        env="Walker2d",
        kind="comparison",
        own=True,
        variants=(RAISED,),
        first_seed=5,
    ),
    Rule(
        "alone-or-both",
        "Preferences spoil what our form of the highlights teaches: highlights alone beat "
        "POLITE, 200 queries each",
        NOT_IN_PAPER,
        f"Final true return, highlights-200 minus POLITE-200: {ABOVE_0} {AFTER_400}",
        (ALONE_200, POLITE_200),
        is_above("highlights-200 minus POLITE-200", ALONE_200, POLITE_200),
        kind="comparison",
        own=True,
        variants=("", RAISED),
    ),
    Rule(
        "alone-noisy",
        "Careless highlights are enough: with our form, highlights alone with 200 queries, many of "
        "them wrong, beat the baseline at equal effort",
        NOT_IN_PAPER,
        "Three in ten highlights are missed, as many misplaced, and in one answer of ten good and "
        f"bad are mixed up. Final true return, {label(*NOISY_ALONE_200)}, minus baseline-262: "
        f"{ABOVE_0} {AFTER_400}",
        (NOISY_ALONE_200, BASELINE_262),
        is_above(f"{label(*NOISY_ALONE_200)}, minus baseline-262", NOISY_ALONE_200, BASELINE_262),
        kind="comparison",
        own=True,
    ),
    Rule(
        "alone-raised",
        "The level of the reward model is what highlights alone lack on Walker2d: normalised and "
        "raised by 2, with 200 queries in our form, they beat themselves",
        NOT_IN_PAPER,
        f"Final true return, {label(*RAISED_ALONE_200)}, minus highlights-200: {ABOVE_0} {RAISING}",
        (RAISED_ALONE_200, ALONE_200),
        is_above(f"{label(*RAISED_ALONE_200)}, minus highlights-200", RAISED_ALONE_200, ALONE_200),
        env="Walker2d",
        kind="comparison",
        own=True,
    ),
    Rule(
        "more-answers",
        "More answers help the baseline: with 800 it beats itself with 262",
        NOT_IN_PAPER,
        f"Final true return, baseline-800 minus baseline-262: {ABOVE_0} (Written when its "
        "means in the landed grid were the other way round.)",
        (BASELINE_800, BASELINE_262),
        is_above("baseline-800 minus baseline-262", BASELINE_800, BASELINE_262),
        kind="comparison",
    ),
    Rule(
        "control-shuffled",
        "What highlights say counts: POLITE-200 in our form beats itself with shuffled highlights",
        NOT_IN_PAPER,
        "In this control the highlights of each session are dealt out anew among its answers. "
        f"Final true return, POLITE-200 minus {label(*SHUFFLED_200)}: {ABOVE_0}",
        (POLITE_200, SHUFFLED_200),
        is_above(f"POLITE-200 minus {label(*SHUFFLED_200)}", POLITE_200, SHUFFLED_200),
        kind="comparison",
        own=True,
    ),
    Rule(
        "control-shuffled-anew",
        "The same on five new seeds alone: POLITE-200 in our form beats itself with shuffled "
        "highlights on HalfCheetah",
        NOT_IN_PAPER,
        "Seeds 0 to 4 of the control had left it undecided, so that five more were run; those of "
        "POLITE-200 itself had been read by then. Final true return of seeds 5 and later, "
        f"POLITE-200 minus {label(*SHUFFLED_200)}: {ABOVE_0}",
        (POLITE_200, SHUFFLED_200),
        is_above(f"POLITE-200 minus {label(*SHUFFLED_200)}", POLITE_200, SHUFFLED_200),
        env="HalfCheetah",
        kind="comparison",
        own=True,
        first_seed=5,
    ),
    Rule(
        "control-fewer-queries",
        "At equal updates too, POLITE-200 in our form is no worse than baseline-800",
        NOT_IN_PAPER,
        f"{AT_EQUAL_UPDATES} {_no_worse_than('baseline-800')}",
        (POLITE_200, UPDATED_800),
        _no_worse(UPDATED_800),
        kind="comparison",
        own=True,
    ),
    Rule(
        "control-equal-effort",
        "At equal updates too, POLITE-200 in our form beats the baseline at equal effort",
        NOT_IN_PAPER,
        f"{AT_EQUAL_UPDATES} Final true return, POLITE-200 minus {label(*UPDATED_262)}: {ABOVE_0}",
        (POLITE_200, UPDATED_262),
        is_above(f"POLITE-200 minus {label(*UPDATED_262)}", POLITE_200, UPDATED_262),
        kind="comparison",
        own=True,
    ),
    Rule(
        "control-few-epochs",
        "The released epochs are too many: with an eighth of them POLITE-200 in our form, "
        "baseline-262 and baseline-800 do better",
        NOT_IN_PAPER,
        f"Final true return, each with few epochs minus itself with all: {ABOVE_0} (Written before "
        "the runs with few epochs; those with all had been read.)",
        (*WITH_FEW_EPOCHS, *PLAIN),
        _few_epochs,
        kind="comparison",
        own=True,
    ),
)
"""The comparisons at equal effort, the bar, and the controls that say what it is worth."""
