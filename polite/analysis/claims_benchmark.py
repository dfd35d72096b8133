"""The paper's claims about Walker2d and HalfCheetah, and our own, judged by rules that are code.

The rules were written before the runs, but for one that says so. Seeds were added to some cells
after their verdicts had been read, and no interval is widened for it. Every claim is judged once
for each combination of loss, form of the highlights and variant of which all its cells are finished
or planned. It is the paper's own claim only under the paper's form of the highlights (or none) in
the env itself; under anything else the same rule makes a comparison. Differences have Welch's
interval, ratios Fieller's. A cell with fewer than two runs decides nothing, and runs that are
missing are named.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

from polite.analysis.benchmark_records import (
    EQUAL_UPDATES,
    FEW_EPOCHS,
    HIGHLIGHTED,
    PAIRWISE,
    PAPER_FORM,
    SHUFFLED,
    Condition,
    Grid,
    label,
)
from polite.analysis.comparisons import SHARE_OF_FINAL, View, Wanted
from polite.analysis.verdicts import Claim, Kind, Part, above, at_least, below, between, shown

NEAR = 0.9
"""Share of another mean from which on a return is "near" it, or no worse (our threshold)."""
NEARLY_DOUBLE = (1.6, 2.2)
"""Ratios that "nearly double" means (our threshold)."""
EQUAL_EFFORT: Final = {200: 262, 400: 525}
"""Queries without highlights that take people as long as those with them: 31% more, rounded."""

POLITE_200, POLITE_400 = Wanted("polite", 200), Wanted("polite", 400)
BASELINE_262, BASELINE_400 = Wanted("preferences", 262), Wanted("preferences", 400)
BASELINE_800 = Wanted("preferences", 800)
PEBBLE_400 = Wanted("pebble", 400)
UNTRAINED, HIGHLIGHTS_400 = Wanted("untrained", 0), Wanted("highlights", 400)
SHUFFLED_200 = Wanted("polite", 200, SHUFFLED)
UPDATED_262 = Wanted("preferences", 262, EQUAL_UPDATES)
UPDATED_800 = Wanted("preferences", 800, EQUAL_UPDATES)
BRIEF_200 = Wanted("polite", 200, FEW_EPOCHS)
BRIEF_262 = Wanted("preferences", 262, FEW_EPOCHS)
BRIEF_800 = Wanted("preferences", 800, FEW_EPOCHS)
NOT_IN_PAPER = "not in the paper"
ABOVE_0 = "Welch's 95% t interval over runs lies above 0."
NO_WORSE = (
    "The mean final true return as measured is at least baseline-800's (its interval may straddle "
    f"that), and Fieller's 95% interval of the ratio lies above {NEAR:g}."
)
AT_EQUAL_UPDATES = (
    "In this control the reward model is updated as often after each session as POLITE-200's, "
    "however many answers there are."
)
AT_FEW_EPOCHS = (
    "On both sides the reward model is trained for an eighth of the released epochs, near the best "
    "of both on fixed segments."
)
AT_EQUAL_STEPS = (
    "at equal policy steps (a longer training is read off its curve where the shorter one ends; "
    "PPO's learning rate is then in the middle of its fall)"
)


@dataclass(frozen=True)
class Rule:
    """A claim before it meets any record."""

    id: str
    text: str
    published: str
    rule: str
    wanted: tuple[Wanted, ...]
    """The cells that it reads."""
    judge: Callable[[View], tuple[Part, ...]]
    env: str = ""
    """What the env's name begins with; empty for a claim about any env."""
    kind: Kind = "emergent"
    """Under the paper's own conditions."""
    own: bool = False
    """Whether it is about our form, under the pairwise loss and without a variant, alone."""
    first_seed: int = 0
    """Runs of lower seeds are left out: for seeds that were added after others had been read."""

    def applies(self, env: str, condition: Condition) -> bool:
        """Whether the claim is about this env under this condition."""
        ours = condition.highlights not in (PAPER_FORM, None) and not condition.variant
        meant = not self.own or (ours and condition.loss == PAIRWISE)
        return env.startswith(self.env) and meant

    @property
    def highlighted(self) -> bool:
        """Whether any cell that it reads depends on the form of the highlights."""
        return any(which.method in HIGHLIGHTED for which in self.wanted)


def judge_grid(grid: Grid) -> list[dict[str, Any]]:
    """The entries of `claims` in a benchmark's results.json.

    Args:
        grid: finished runs, any number of any cells, and planned ones.

    Returns:
        For each claim, env and condition what `polite.analysis.claims.judge` returns, with `env`,
        `preset`, `variant`, `loss`, `highlights` (null where the claim reads no highlighted cell)
        and `missing`, a list of what runs are missing in words.
    """
    views = (
        (View(part, env, condition), rule)
        for env in grid.envs
        for rule in RULES
        for part in (grid.since(rule.first_seed),)
        for condition in _conditions(part, env, rule)
    )
    return [_entry(view, rule) for view, rule in views if view.known(*rule.wanted)]


def _conditions(grid: Grid, env: str, rule: Rule) -> list[Condition]:
    fitting = [c for c in grid.conditions(env) if rule.applies(env, c)]
    if rule.highlighted:
        return [c for c in fitting if c.highlights is not None]
    return list(dict.fromkeys(replace(c, highlights=None) for c in fitting))


def _entry(view: View, rule: Rule) -> dict[str, Any]:
    condition = view.condition
    of_paper = condition.highlights in (PAPER_FORM, None) and not condition.variant
    kind = rule.kind if of_paper else "comparison"
    claim = Claim(rule.id, kind, rule.text, rule.published, rule.rule, rule.judge(view))
    return claim.as_json() | {
        "env": view.env,
        "preset": condition.preset,
        "variant": condition.variant,
        "loss": condition.loss,
        "highlights": condition.highlights,
        "missing": view.missing(*rule.wanted),
    }


def _above(what: str, first: Wanted, second: Wanted) -> Callable[[View], tuple[Part, ...]]:
    return lambda view: (above(what, view.difference(first, second), 0),)


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


def _no_worse(baseline: Wanted, ours: Wanted = POLITE_200) -> Callable[[View], tuple[Part, ...]]:
    name, own = label(*baseline), label(*ours)
    return lambda view: (
        at_least(f"{own} minus {name}", view.difference(ours, baseline), 0),
        above(f"{own} / {name}", view.ratio(ours, baseline), NEAR),
    )


def _fewer_epochs(view: View) -> tuple[Part, ...]:
    pairs = ((few, few._replace(variant="")) for few in (BRIEF_200, BRIEF_262, BRIEF_800))
    return tuple(
        above(f"{label(*few)} minus {label(*plain)}", view.difference(few, plain), 0)
        for few, plain in pairs
    )


RULES: Final[tuple[Rule, ...]] = (
    Rule(
        "walker2d-fewer-queries",
        "POLITE with 200 queries beats the baseline with 800, 75% fewer",
        "Fig. 4, no number",
        f"Final true return, POLITE-200 minus baseline-800: {ABOVE_0}",
        (POLITE_200, BASELINE_800),
        _above("POLITE-200 minus baseline-800", POLITE_200, BASELINE_800),
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
        _above("PEBBLE-400 minus baseline-400", PEBBLE_400, BASELINE_400),
        env="Walker2d",
    ),
    Rule(
        "walker2d-polite-pebble",
        "POLITE beats PEBBLE with half the queries",
        "Fig. 4, no number",
        f"True return, POLITE-200 minus PEBBLE-400, {AT_EQUAL_STEPS}: {ABOVE_0}",
        (POLITE_200, PEBBLE_400),
        _above("POLITE-200 minus PEBBLE-400", POLITE_200, PEBBLE_400),
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
    *(
        Rule(
            f"equal-effort-{queries}",
            f"POLITE-{queries} beats the baseline at equal effort of people ({more} queries)",
            NOT_IN_PAPER,
            f"A query with highlights takes 31% more time. Final true return, POLITE-{queries} "
            f"minus baseline-{more}: {ABOVE_0}",
            (Wanted("polite", queries), Wanted("preferences", more)),
            _above(
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
        NO_WORSE,
        (POLITE_200, BASELINE_800),
        _no_worse(BASELINE_800),
        kind="comparison",
        own=True,
    ),
    Rule(
        "bar-equal-effort",
        "Our bar: with our form of the highlights, POLITE-200 beats the baseline at equal effort",
        NOT_IN_PAPER,
        f"Final true return, POLITE-200 minus baseline-262: {ABOVE_0}",
        (POLITE_200, BASELINE_262),
        _above("POLITE-200 minus baseline-262", POLITE_200, BASELINE_262),
        kind="comparison",
        own=True,
    ),
    Rule(
        "bar-equal-effort-anew",
        "The same on ten new seeds alone: POLITE-200 in our form beats the baseline at equal "
        "effort on Walker2d",
        NOT_IN_PAPER,
        "Seeds 0 to 9 had left it undecided, so that ten more were run. Final true return of seeds "
        f"10 and later, POLITE-200 minus baseline-262: {ABOVE_0}",
        (POLITE_200, BASELINE_262),
        _above("POLITE-200 minus baseline-262", POLITE_200, BASELINE_262),
        env="Walker2d",
        kind="comparison",
        own=True,
        first_seed=10,
    ),
    Rule(
        "more-answers",
        "More answers help the baseline: with 800 it beats itself with 262",
        NOT_IN_PAPER,
        f"Final true return, baseline-800 minus baseline-262: {ABOVE_0} (Written when its "
        "means in the landed grid were the other way round.)",
        (BASELINE_800, BASELINE_262),
        _above("baseline-800 minus baseline-262", BASELINE_800, BASELINE_262),
        kind="comparison",
    ),
    Rule(
        "control-shuffled",
        "What highlights say counts: POLITE-200 in our form beats itself with shuffled highlights",
        NOT_IN_PAPER,
        "In this control the highlights of each session are dealt out anew among its answers. "
        f"Final true return, POLITE-200 minus {label(*SHUFFLED_200)}: {ABOVE_0}",
        (POLITE_200, SHUFFLED_200),
        _above(f"POLITE-200 minus {label(*SHUFFLED_200)}", POLITE_200, SHUFFLED_200),
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
        _above(f"POLITE-200 minus {label(*SHUFFLED_200)}", POLITE_200, SHUFFLED_200),
        env="HalfCheetah",
        kind="comparison",
        own=True,
        first_seed=5,
    ),
    Rule(
        "control-fewer-queries",
        "At equal updates too, POLITE-200 in our form is no worse than baseline-800",
        NOT_IN_PAPER,
        f"{AT_EQUAL_UPDATES} {NO_WORSE}",
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
        _above(f"POLITE-200 minus {label(*UPDATED_262)}", POLITE_200, UPDATED_262),
        kind="comparison",
        own=True,
    ),
    Rule(
        "few-epochs-fewer-queries",
        "With few epochs too, POLITE-200 in our form is no worse than baseline-800",
        NOT_IN_PAPER,
        f"{AT_FEW_EPOCHS} {NO_WORSE}",
        (BRIEF_200, BRIEF_800),
        _no_worse(BRIEF_800, BRIEF_200),
        kind="comparison",
        own=True,
    ),
    Rule(
        "few-epochs-equal-effort",
        "With few epochs too, POLITE-200 in our form beats the baseline at equal effort",
        NOT_IN_PAPER,
        f"{AT_FEW_EPOCHS} Final true return, {label(*BRIEF_200)} minus {label(*BRIEF_262)}: "
        f"{ABOVE_0}",
        (BRIEF_200, BRIEF_262),
        _above(f"{label(*BRIEF_200)} minus {label(*BRIEF_262)}", BRIEF_200, BRIEF_262),
        kind="comparison",
        own=True,
    ),
    Rule(
        "few-epochs-help",
        "The released epochs are too many: with an eighth of them POLITE-200 in our form, "
        "baseline-262 and baseline-800 do better",
        NOT_IN_PAPER,
        f"Final true return, each with few epochs minus itself with all: {ABOVE_0}",
        (BRIEF_200, POLITE_200, BRIEF_262, BASELINE_262, BRIEF_800, BASELINE_800),
        _fewer_epochs,
        kind="comparison",
        own=True,
    ),
)
"""What the paper says of the two envs, what it does not compare, and what we ask of ourselves."""
