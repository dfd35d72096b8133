"""What the paper says of Walker2d and HalfCheetah."""

from __future__ import annotations

from typing import Final

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
from polite.analysis.comparisons import SHARE_OF_FINAL, View, Wanted
from polite.analysis.verdicts import Part, above, below, between, shown

NEARLY_DOUBLE = (1.6, 2.2)
"""Ratios that "nearly double" means (our threshold)."""
AT_EQUAL_STEPS: Final = (
    "at equal policy steps (a longer training is read off its curve where the shorter one ends; "
    "PPO's learning rate is then in the middle of its fall)"
)
POLITE_400, PEBBLE_400 = Wanted("polite", 400), Wanted("pebble", 400)
UNTRAINED = Wanted("untrained", 0)


def _double(view: View) -> tuple[Part, ...]:
    ratio = view.ratio(POLITE_400, BASELINE_800)
    return (between("POLITE-400 / baseline-800", ratio, *NEARLY_DOUBLE),)


def _near(view: View) -> tuple[Part, ...]:
    return (above("POLITE-200 / baseline-800", view.ratio(POLITE_200, BASELINE_800), NEAR),)


def _above_both(view: View) -> tuple[Part, ...]:
    baseline, pebble = (view.difference(POLITE_400, c) for c in (BASELINE_400, PEBBLE_400))
    return (
        above("POLITE-400 minus baseline-400", baseline, 0),
        above("POLITE-400 minus PEBBLE-400", pebble, 0),
    )


def _faster(view: View) -> tuple[Part, ...]:
    area = view.area_difference(POLITE_400, BASELINE_400)
    steps = view.speed_difference(POLITE_400, BASELINE_400)
    share = f"steps to {SHARE_OF_FINAL:.0%} of baseline-400's final return"
    return (
        above("mean return over all steps, POLITE-400 minus baseline-400", area, 0),
        below(f"{share}, POLITE-400 minus baseline-400", steps, 0, "steps"),
    )


def _synergy(view: View) -> tuple[Part, ...]:
    alone = view.difference(HIGHLIGHTS_400, UNTRAINED)
    together = view.difference(POLITE_400, BASELINE_400)
    return (
        above("(both − preferences) − (highlights − untrained), 400", view.synergy(400), 0),
        shown("both minus preferences", together),
        shown("highlights alone minus untrained", alone),
    )


PAPER_RULES: Final[tuple[Rule, ...]] = (
    Rule(
        "walker2d-fewer-queries",
        "POLITE with 200 queries beats the baseline with 800, 75% fewer",
        "Fig. 4, no number",
        f"Final true return, POLITE-200 minus baseline-800: {ABOVE_0}",
        (POLITE_200, BASELINE_800),
        is_above("POLITE-200 minus baseline-800", POLITE_200, BASELINE_800),
        env="Walker2d",
    ),
    Rule(
        "walker2d-nearly-double",
        "POLITE with 400 queries nearly doubles the baseline with 800",
        '"nearly double"',
        f"Ratio of the mean final true returns: Fieller's 95% interval lies within "
        f"{NEARLY_DOUBLE[0]:g} to {NEARLY_DOUBLE[1]:g}.",
        (POLITE_400, BASELINE_800),
        _double,
        env="Walker2d",
    ),
    Rule(
        "walker2d-pebble-baseline",
        "PEBBLE improves on the baseline",
        "Fig. 4, no number",
        f"True return with 400 queries each, PEBBLE minus baseline, {AT_EQUAL_STEPS}: {ABOVE_0}",
        (PEBBLE_400, BASELINE_400),
        is_above("PEBBLE-400 minus baseline-400", PEBBLE_400, BASELINE_400),
        env="Walker2d",
    ),
    Rule(
        "walker2d-polite-pebble",
        "POLITE beats PEBBLE with half the queries",
        "Fig. 4, no number",
        f"True return, POLITE-200 minus PEBBLE-400, {AT_EQUAL_STEPS}: {ABOVE_0}",
        (POLITE_200, PEBBLE_400),
        is_above("POLITE-200 minus PEBBLE-400", POLITE_200, PEBBLE_400),
        env="Walker2d",
    ),
    Rule(
        "halfcheetah-above-both",
        "POLITE is above the baseline and PEBBLE at equal queries (400)",
        "Fig. 4, no number",
        f"True return, POLITE-400 minus each; {AT_EQUAL_STEPS}: {ABOVE_0}",
        (POLITE_400, BASELINE_400, PEBBLE_400),
        _above_both,
        env="HalfCheetah",
    ),
    Rule(
        "halfcheetah-near",
        "POLITE comes near the baseline's convergence with 75% fewer queries",
        "Fig. 4, no number",
        "Read as POLITE-200 against baseline-800; ratio of the mean final true returns: Fieller's "
        f"95% interval lies above {NEAR:g}.",
        (POLITE_200, BASELINE_800),
        _near,
        env="HalfCheetah",
    ),
    Rule(
        "H2",
        "POLITE converges faster than the baseline at equal queries (400)",
        "hypothesis H2, no number",
        "Area under the learning curve: Welch's 95% interval of the difference lies above 0; steps "
        f"to {SHARE_OF_FINAL:.0%} of baseline-400's mean final return, each curve read as its mean "
        "over the last tenth of all steps: it lies below 0. The error of that target is ignored. A "
        "run that never gets there counts as its whole training, and leaves its side of the "
        "interval open.",
        (POLITE_400, BASELINE_400),
        _faster,
    ),
    Rule(
        "fig4c",
        "Preferences and highlights together give more than the sum of both (synergy)",
        "shown in Fig. 4c, no number",
        "(both − preferences) − (highlights − untrained), final true returns at 400 queries: "
        f"{ABOVE_0}",
        (POLITE_400, BASELINE_400, HIGHLIGHTS_400, UNTRAINED),
        _synergy,
    ),
)
"""One for each claim of the paper's Fig. 4 and its hypothesis H2."""
