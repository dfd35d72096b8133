"""The tables of a benchmark's page: claims, cells, comparisons, queries to reach, gaps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from polite.analysis.benchmark_records import NAMES
from polite.report.benchmark_words import (
    condition_words,
    form_words,
    reached_words,
    verdict_badge,
)
from polite.report.html import Markup, element, join, table
from polite.report.tables import BADGES, measurement
from polite.report.words import NBSP, number, stored

Results = Mapping[str, Any]
Parts = Sequence[Mapping[str, Any]]


def benchmark_claims_table(claims: Parts, kind: str, caption: str) -> Markup:
    """The claims of one kind: a row for each env, in it a paragraph for each condition."""
    rows: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for claim in claims:
        if claim["kind"] == kind:
            rows.setdefault((claim["id"], claim["env"]), []).append(claim)
    head = ("Claim", "Env", "Paper", "Rule", "Here, by condition")
    body = (
        (c[0]["text"], c[0]["env"], c[0]["published"], _rule(c), join(map(_judged, c)))
        for c in rows.values()
    )
    return table(caption, head, body)


def _rule(claims: Parts) -> str:
    """The rule of a claim's conditions, with what is to be known of some of them at its end."""
    return max((str(claim["rule"]) for claim in claims), key=len)


def cells_table(cells: Parts) -> Markup:
    """Every cell with its returns."""
    caption = (
        "Final true return of every cell. Brackets: 95% t intervals of a mean over runs; of the "
        "interquartile mean a bootstrap's, which is too narrow for few runs. Evaluation: the "
        "finished policy's most likely actions. Score: 0 is the untrained reward, 1 the true one; "
        "both means are taken as known, their own error is not in the interval. "
        "Collection: steps spent on clips, on top of the policy's own."
    )
    head = ["Cell", "Highlights", "Runs", "Mean", "sd", "Interquartile mean"]
    head += ["Evaluation", "Score", "Policy steps", "Collection steps"]
    rows = (
        (
            _where(cell),
            form_words(cell["highlights"]),
            str(cell["n"]),
            stored(cell["interval"]),
            number(cell["sd"]),
            stored(cell["iqm"]),
            stored(cell["evaluation"]),
            stored(cell["normalised"]),
            f"{cell['steps']:,}",
            number(cell["collection_steps"]["mean"]),
        )
        for cell in cells
    )
    return table(caption, head, rows)


def reward_table(cells: Parts) -> Markup:
    """What the simulated teacher answered, and how the learned reward agrees with the true one."""
    caption = (
        "Answers of the simulated teacher, and the learned reward against the true one on held-out "
        "segments of the final policy (at the last feedback session in the second line). Means "
        "over runs. Highlights: share of the expressed preferences that carry one. Highlighted "
        "steps: mean true reward of the steps within good and within bad highlights, of all steps. "
        "Of an ensemble the mean is judged, which saturates only where all members do."
    )
    head = ["Cell", "Highlights", "Right answers", "No preference", "Highlights +, −"]
    head += ["Pair accuracy", "Pearson", "Spearman", "Saturation", "Highlighted steps +, −, all"]
    rows = (
        (
            _where(cell),
            form_words(cell["highlights"]),
            number(cell["answers"]["label_accuracy"]["mean"]),
            number(cell["answers"]["no_preference"]),
            _joined(cell["answers"][sign] for sign in ("positive", "negative")),
            *(_stages(cell, name) for name in ("pair_accuracy", "pearson", "spearman")),
            _stages(cell, "saturation"),
            _joined(
                cell["highlighted_reward"][sign]["mean"] for sign in ("positive", "negative", "all")
            ),
        )
        for cell in cells
        if cell["queries"]
    )
    return table(caption, head, rows)


def comparisons_table(comparisons: Parts) -> Markup:
    """Every pair that was compared."""
    caption = (
        "Pairs of cells. Difference: Welch's 95% t interval; ratio of means: Fieller's; "
        "probability of improvement: a bootstrap's over runs, too narrow for few of them. All are "
        "read after the given number of policy steps, the longer training off its curve: where PPO "
        "is read at PEBBLE's 250,000 steps, it is in mid-schedule of its learning rate (which "
        "falls to 0 over a million), and would stand elsewhere had it been trained for that long "
        "only."
    )
    head = ("Pair", "Env and condition", "Runs", "Policy steps", "Difference", "Ratio")
    rows = (
        (
            f"{part['first']} against {part['second']}",
            f"{part['env']}, {condition_words(part)}",
            f"{part['n'][0]},{NBSP}{part['n'][1]}",
            f"{part['steps']:,}",
            stored(part["difference"]),
            stored(part["ratio"]),
            stored(part["improvement"]),
        )
        for part in comparisons
    )
    return table(caption, (*head, "Probability of improvement"), rows)


def reach_table(rows: Parts) -> Markup:
    """Queries to reach a return: a row for each method and condition, a column for each target."""
    caption = (
        "Queries until the mean final return reaches a target, linear in log2(queries) between the "
        "budgets that were run, nothing beyond them: > the largest, ≤ the smallest. Brackets: 95% "
        "bootstrap intervals over runs, too narrow for few of them, and none where a budget has a "
        "single run; they begin at 0 where the smallest budget may do, ∞ was not reached. A target "
        "is taken as known: the error of the mean that it comes from is not in the interval. "
        "PEBBLE's targets are the returns after its own number of steps, at which PPO is in "
        "mid-schedule."
    )
    targets = list(dict.fromkeys(row["what"] for row in rows))
    found: dict[tuple[str, str], dict[str, str]] = {}
    for row in rows:
        where = (NAMES[row["method"]], f"{row['env']}, {condition_words(row)}")
        found.setdefault(where, {})[row["what"]] = reached_words(row)
    body = ((*where, *(cells.get(t, "–") for t in targets)) for where, cells in found.items())
    return table(caption, ("Method", "Env and condition", *targets), body)


def missing_table(missing: Parts) -> Markup:
    """Planned runs that are not finished."""
    rows = (
        (
            _where(cell),
            form_words(cell["highlights"]),
            str(cell["done"]),
            ", ".join(map(str, cell["seeds"])),
        )
        for cell in missing
    )
    head = ("Cell", "Highlights", "Finished runs", "Missing seeds")
    return table("Runs that are planned and not finished.", head, rows)


def _judged(claim: Mapping[str, Any]) -> Markup:
    parts = [
        element("div", f"{BADGES[part['verdict']]} {measurement(part)}") for part in claim["parts"]
    ]
    missing = (
        [element("div", f"missing: {', '.join(claim['missing'])}")] if claim["missing"] else []
    )
    where = element("div", verdict_badge(claim), f" {condition_words(claim)}")
    return element("div", where, *parts, *missing, class_="part")


def _where(cell: Mapping[str, Any]) -> str:
    more = [cell["variant"]] if cell["variant"] else []
    loss = [f"{cell['loss']} loss"] if cell["loss"] else []
    return ", ".join([cell["label"], cell["env"], *loss, *more, f"preset {cell['preset']}"])


def _stages(cell: Mapping[str, Any], name: str) -> Markup:
    late, early = (number(cell["quality"][stage][name]["mean"]) for stage in ("late", "early"))
    return join([element("div", late), element("div", early)])


def _joined(values: Iterator[float | None]) -> str:
    return ", ".join(number(value) for value in values)
