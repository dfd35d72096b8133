"""One self-contained page from a benchmark's stored numbers: `report.html`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from polite.report.benchmark_figures import draw_benchmark_figures
from polite.report.benchmark_tables import (
    benchmark_claims_table,
    cells_table,
    comparisons_table,
    missing_table,
    reach_table,
    reward_table,
)
from polite.report.benchmark_words import benchmark_findings
from polite.report.html import Markup, document, element, figure, section
from polite.report.stored import reading, write_text

Results = Mapping[str, Any]

TITLE = "POLITE benchmark: highlights, preferences and PEBBLE"
SIMULATED = "The answers are from a simulated teacher."
RULES = (
    "The rules are code that was written before the runs, where a rule does not say "
    "otherwise. Reproduced, or holds: the whole 95% "
    "interval satisfies the bound, for every part of the claim that is judged. Not reproduced, or "
    "does not hold: for some part the whole interval lies on the other side. Undecided: an "
    "interval straddles its bound, or a cell has fewer than two runs. “No worse” (value ≥) is "
    "judged by the measured value itself, unless its whole interval lies below, and never alone: a "
    "ratio whose interval has to lie above a bound stands beside it. “So far”: planned runs are "
    "missing, which are named; the verdict may change with them. Seeds that were added after a "
    "verdict had been read are judged with the others without a wider interval: a difference that "
    "is not there is then found in 8% of the cases after a second look, in 11% after a third. A "
    "dot (·) marks what is shown and not judged."
)
CAPTIONS: Final[dict[str, tuple[str, str]]] = {
    "learning_curves": (
        "Learning curves (Fig. 4)",
        "True return of training episodes against policy steps, mean ± standard error over runs "
        "(n: runs of each cell). The learner never sees the true reward, except where it is named. "
        "Baselines have as many queries as the paper's form, or the effort of another one's. "
        "PEBBLE's trainings are shorter. Steps spent on collecting clips are not in the axis; the "
        "table of cells has them.",
    ),
    "return_by_queries": (
        "Final return against queries",
        "Mean final true return and its 95% t interval over runs, by method, after each method's "
        "longest training; points are drawn a little aside from their budget so that intervals "
        "do not overlap. Level lines ask no queries. The panels' height is that of all runs; the "
        "interval of two runs or three may go beyond it.",
    ),
    "cells": (
        "Every run of every cell",
        "A dot is a run, the bar the interquartile mean, shaded its 95% bootstrap interval, which "
        "is too narrow for few runs.",
    ),
    "aggregate": (
        "All envs together",
        "Interquartile mean of the normalised final return over runs and envs, with its 95% "
        "bootstrap interval, stratified by env, with as many runs of each (those of the lowest "
        "seeds). The returns that are 0 and 1, of the untrained and "
        "the true reward, are taken as known: their own error is not in the intervals. PEBBLE's "
        "score is taken at its own number of steps. Methods with one run an env are left out.",
    ),
    "improvement": (
        "Probability of improvement",
        "Probability that a run of the first cell ends above a run of the second, ties counted "
        "half, with its 95% bootstrap interval, which is too narrow for few runs: without a "
        "difference it excludes one half in 8% of the cases with five runs against five, in 7% "
        "with ten. A mark without a line at 0 or 1: every run of one cell lies above every run of "
        "the other. Cells with one run are left out. Pairs without highlights are drawn in the "
        "first colour of their loss.",
    ),
    "fig4c_ablation": (
        "Ablation (Fig. 4c)",
        "Final true return by what the reward model is trained on: mean, 95% t interval and runs. "
        "Synergy would be a step from preferences to both that is larger than the one from "
        "untrained to highlights.",
    ),
    "quality": (
        "Quality of the learned reward and the return that it leads to",
        "A mark is a run. The learned reward is compared with the true one on held-out segments of "
        "the final policy.",
    ),
}


def write_benchmark_report(folder: Path, results: Results) -> Path:
    """Draw the figures of a benchmark and write its page.

    Args:
        folder: the benchmark's folder; `figures/` and `report.html` are written into it.
        results: the content of results.json, as `summarise` makes it.

    Returns:
        The page; it needs no other file and no network.

    Raises:
        PoliteError: when a key is missing or a value is of another type, or the folder cannot be
            written into.
    """
    with reading(folder / "results.json", "polite benchmark --resume"):
        page = render(results, draw_benchmark_figures(results, folder))
    return write_text(folder / "report.html", page)


def render(results: Results, pictures: list[Path]) -> str:
    """The whole page as text."""
    sections = [
        section("findings", "What came out", benchmark_findings(results)),
        section("figures", "Figures", *(figure(path, *CAPTIONS[path.stem]) for path in pictures)),
        section("claims", "Claims and verdicts", element("p", RULES), *_claims(results)),
        section("cell-table", "Cells", cells_table(results["cells"])),
        section("pairs", "Comparisons", comparisons_table(results["comparisons"])),
        section("reach", "Queries to reach a return", reach_table(results["queries_to_reach"])),
        section("rewards", "Answers and learned rewards", reward_table(results["cells"])),
        section("missing", "What is missing", _missing(results)),
    ]
    return document(TITLE, _header(results), element("main", *sections))


def _header(results: Results) -> Markup:
    text = (
        " No human answered a query: an oracle compares the true returns of two clips and marks "
        "their best and worst moments, with the mistakes that the settings give it."
    )
    banner = element("p", element("strong", SIMULATED), text, class_="banner", role="note")
    presets = sorted({part["preset"] for part in (*results["cells"], *results["missing"])})
    source = f"After Holk, Marta and Leite: POLITE, ICRA 2024. Preset {', '.join(presets)}."
    paper = element("p", source, class_="source")
    return element("header", element("h1", TITLE), paper, banner)


def _missing(results: Results) -> Markup:
    if results["missing"]:
        return missing_table(results["missing"])
    if results["runs"]["plan_known"]:
        return element("p", "Nothing: every planned run is finished.")
    return element("p", "The plan of the grid is not known, only its finished runs.")


def _claims(results: Results) -> list[Markup]:
    captions = {
        "emergent": "Claims of the paper, under its own form of the highlights or without any.",
        "comparison": "Comparisons that the paper lacks: its claims under our form of the "
        "highlights and in controls, equal effort, and what we ask of our own form.",
    }
    return [
        benchmark_claims_table(results["claims"], kind, text, results["envs"])
        for kind, text in captions.items()
    ]
