"""The tables of a benchmark's page: claims, cells, comparisons, queries to reach, gaps."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from polite.analysis.benchmark_records import NAMES
from polite.report.benchmark_words import (
    condition_words,
    form_words,
    reached_words,
    verdict_badge,
)
from polite.report.html import Markup, element, join, matrix, table
from polite.report.tables import BADGES, measurement
from polite.report.words import NBSP, number, stored

Results = Mapping[str, Any]
Parts = Sequence[Mapping[str, Any]]


def benchmark_claims_table(claims: Parts, kind: str, caption: str, envs: Sequence[str]) -> Markup:
    """The claims of one kind: a row for each, in each env's column a paragraph a condition."""
    found: dict[str, list[Mapping[str, Any]]] = {}
    for claim in claims:
        if claim["kind"] == kind:
            found.setdefault(claim["id"], []).append(claim)
    entries = (
        (_stated(every), claim["env"], _judged(claim))
        for every in found.values()
        for claim in every
    )
    return matrix(caption, ("Claim, where the paper has it, and its rule", *envs), entries)


def _stated(claims: Parts) -> Markup:
    """A claim and its rule, with what is to be known of some of its conditions at the end."""
    rule = max((str(claim["rule"]) for claim in claims), key=len)
    text = element("div", f"{claims[0]['text']} ({claims[0]['published']})")
    return join([text, element("div", rule, class_="rule")])


def cells_table(cells: Parts) -> Markup:
    """Every cell with its returns."""
    words = (
        "Final true return of every cell. Brackets: 95% t intervals of a mean over runs; of the "
        "interquartile mean a bootstrap's, which is too narrow for few runs. Evaluation: the "
        "finished policy's most likely actions. Score: 0 is the untrained reward, 1 the true one; "
        "both means are taken as known, their own error is not in the interval. "
        "Collection: steps spent on clips, on top of the policy's own."
    )
    head = ["Cell", "Highlights", "Runs", "Mean", "sd", "Interquartile mean"]
    head += ["Evaluation", "Score", "Policy steps", "Collection steps"]
    return _by_env(
        words,
        "cells",
        head,
        cells,
        lambda cell: (
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
        ),
    )


def reward_table(cells: Parts) -> Markup:
    """What the simulated teacher answered, and how the learned reward agrees with the true one."""
    words = (
        "Answers of the simulated teacher, and the learned reward against the true one on held-out "
        "segments of the final policy (at the last feedback session in the second line). Means "
        "over runs. Highlights: share of the expressed preferences that carry one. Highlighted "
        "steps: mean true reward of the steps within good and within bad highlights, of all steps. "
        "Of an ensemble the mean is judged, which saturates only where all members do."
    )
    head = ["Cell", "Highlights", "Right answers", "No preference", "Highlights +, −"]
    head += ["Pair accuracy", "Pearson", "Spearman", "Saturation", "Highlighted steps +, −, all"]
    return _by_env(
        words,
        "answers and learned rewards",
        head,
        [cell for cell in cells if cell["queries"]],
        lambda cell: (
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
        ),
    )


def comparisons_table(comparisons: Parts) -> Markup:
    """Every pair that was compared."""
    words = (
        "Pairs of cells. Difference: Welch's 95% t interval; ratio of means: Fieller's; "
        "probability of improvement: a bootstrap's over runs, too narrow for few of them. All are "
        "read after the given number of policy steps, the longer training off its curve: where PPO "
        "is read at PEBBLE's 250,000 steps, it is in mid-schedule of its learning rate (which "
        "falls to 0 over a million), and would stand elsewhere had it been trained for that long "
        "only."
    )
    head = ("Pair", "Condition", "Runs", "Policy steps", "Difference", "Ratio")
    return _by_env(
        words,
        "pairs",
        (*head, "Probability of improvement"),
        comparisons,
        lambda part: (
            f"{part['first']} against {part['second']}",
            condition_words(part),
            f"{part['n'][0]},{NBSP}{part['n'][1]}",
            f"{part['steps']:,}",
            stored(part["difference"]),
            stored(part["ratio"]),
            stored(part["improvement"]),
        ),
    )


def reach_table(rows: Parts) -> Markup:
    """Queries to reach a return: a row for each method and condition, a column for each target."""
    words = (
        "Queries until the mean final return reaches a target, linear in log2(queries) between the "
        "budgets that were run, nothing beyond them: > the largest, ≤ the smallest. Brackets: 95% "
        "bootstrap intervals over runs, too narrow for few of them, and none where a budget has a "
        "single run; they begin at 0 where the smallest budget may do, ∞ was not reached. A target "
        "is taken as known: the error of the mean that it comes from is not in the interval. "
        "PEBBLE's targets are the returns after its own number of steps, at which PPO is in "
        "mid-schedule."
    )
    targets = list(dict.fromkeys(row["what"] for row in rows))
    found: dict[tuple[str, str, str], dict[str, str]] = {}
    for row in rows:
        where = (row["env"], NAMES[row["method"]], condition_words(row))
        found.setdefault(where, {})[row["what"]] = reached_words(row)
    return _by_env(
        words,
        "queries to reach a return",
        ("Method", "Condition", *targets),
        [{"env": where[0], "where": where[1:], "cells": cells} for where, cells in found.items()],
        lambda row: (*row["where"], *(row["cells"].get(target, "–") for target in targets)),
    )


def missing_table(missing: Parts) -> Markup:
    """Planned runs that are not finished."""
    return _by_env(
        "Runs that are planned and not finished.",
        "missing runs",
        ("Cell", "Highlights", "Finished runs", "Missing seeds"),
        missing,
        lambda cell: (
            _where(cell),
            form_words(cell["highlights"]),
            str(cell["done"]),
            ", ".join(map(str, cell["seeds"])),
        ),
    )


def _by_env(
    words: str,
    what: str,
    head: Sequence[str],
    parts: Parts,
    row: Callable[[Mapping[str, Any]], Sequence[str]],
) -> Markup:
    """What the columns are, then a table for each env."""
    envs = dict.fromkeys(part["env"] for part in parts)
    tables = (
        table(f"{env}: {what}", head, (row(part) for part in parts if part["env"] == env))
        for env in envs
    )
    return join([element("p", words), *tables])


def _judged(claim: Mapping[str, Any]) -> Markup:
    parts = [
        element("div", f"{BADGES[part['verdict']]} {measurement(part)}") for part in claim["parts"]
    ]
    missing = (
        [element("div", f"missing: {', '.join(claim['missing'])}")] if claim["missing"] else []
    )
    where = element("div", verdict_badge(claim), f" {condition_words(claim)}")
    return join([where, *parts, *missing])


def _where(cell: Mapping[str, Any]) -> str:
    more = [cell["variant"]] if cell["variant"] else []
    loss = [f"{cell['loss']} loss"] if cell["loss"] else []
    return ", ".join([cell["label"], *loss, *more])


def _stages(cell: Mapping[str, Any], name: str) -> Markup:
    late, early = (number(cell["quality"][stage][name]["mean"]) for stage in ("late", "early"))
    return join([element("div", late), element("div", early)])


def _joined(values: Iterator[float | None]) -> str:
    return ", ".join(number(value) for value in values)
