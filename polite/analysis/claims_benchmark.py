"""The paper's claims about Walker2d and HalfCheetah, and our own, judged by rules that are code.

The rules were written before the runs, but for one that says so, and some that were written when
one of the sides that they compare had been read, which say so too. Seeds were added to some cells
after their verdicts had been read, and no interval is widened for it. Every claim is judged once
for each combination of loss, form of the highlights and variant of which all its cells are finished
or planned. It is the paper's own claim only under the paper's form of the highlights (or none) in
the env itself; under anything else the same rule makes a comparison. Differences have Welch's
interval, ratios Fieller's. A cell with fewer than two runs decides nothing, and runs that are
missing are named.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

from polite.analysis.benchmark_records import PAPER_FORM, RAISED, Condition, Grid
from polite.analysis.benchmark_rules import Rule
from polite.analysis.benchmark_rules_own import OWN_RULES, RAISING
from polite.analysis.benchmark_rules_paper import PAPER_RULES
from polite.analysis.comparisons import View
from polite.analysis.verdicts import Claim

RULES: Final = (*PAPER_RULES, *OWN_RULES)


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
        for rule in RULES
        for part in (grid.since(rule.first_seed),)
        for env in grid.envs
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
    # A rule for seeds that were added says itself what had been read before them.
    raising = condition.variant == RAISED and not rule.first_seed
    words = f"{rule.rule} {RAISING}" if raising else rule.rule
    claim = Claim(rule.id, kind, rule.text, rule.published, words, rule.judge(view))
    return claim.as_json() | {
        "env": view.env,
        "preset": condition.preset,
        "variant": condition.variant,
        "loss": condition.loss,
        "highlights": condition.highlights,
        "missing": view.missing(*rule.wanted),
    }
