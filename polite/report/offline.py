"""The offline bench's page, tables and figures from its stored numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from matplotlib.figure import Figure

from polite.analysis.offline import deciding_budget
from polite.files import read_json_object
from polite.plots.offline import draw_gains, draw_ladder
from polite.plots.style import WIDTH, shared_legend
from polite.report.html import Markup, document, element, figure, section, table
from polite.report.stored import draw_all, reading, write_text
from polite.report.words import number, stored

Results = Mapping[str, Any]

BENCH = "highlight_bench"
"""Marks the folder of a bench, in its run.json."""
TITLE = "What a highlight says: forms of the highlight loss, compared offline"
SIMULATED = (
    "Answers and highlights are from a simulated teacher. Segments: policies trained on the true "
    "reward, stopped at several stages; asked about are those of the first 16% of the training "
    "(early), judged is also what comes later (late)."
)
MEASURES: Final = {
    "pair_accuracy": "pair accuracy",
    "spearman": "rank correlation of steps",
    "saturation": "saturated steps",
    "calibration_error": "calibration error",
}
STAGES: Final = {"early": "held-out segments of the early stages", "late": "later stages"}


def write_offline_report(folder: Path, results: Results) -> Path:
    """Draw the figures, and write `table.md` and `report.html`.

    Args:
        folder: the bench's folder.
        results: the content of its results.json.

    Returns:
        The page; it needs no other file.

    Raises:
        PoliteError: if a key is missing or a value is of another type, or the folder cannot be
            written into.
    """
    with reading(folder / "results.json", "polite highlights --resume"):
        tables = as_markdown(results)
        page = _page(results, draw_all(FIGURES, results, folder / "figures"))
    write_text(folder / "table.md", tables)
    return write_text(folder / "report.html", page)


def report_bench(folder: Path) -> Path:
    """Draw a bench's figures and page again from its stored numbers.

    Raises:
        PoliteError: if it has no results yet, and as in `write_offline_report`.
    """
    results = read_json_object(folder / "results.json", "go on with `polite highlights --resume`")
    return write_offline_report(folder, results)


def as_markdown(results: Results) -> str:
    """Every candidate in every env at every budget, as tables that a repository shows."""
    parts = [f"# {TITLE}\n\n{SIMULATED} Means over {results['seeds']} trials, 95% t intervals.\n"]
    for env, queries in _blocks(results):
        head = _head()
        lines = [f"## {env}, {queries} queries", "", _line(head), _line(["---"] * len(head))]
        lines += [_line(_cells(row)) for row in _rows(results, env, queries)]
        parts.append("\n".join(lines) + "\n")
    return "\n".join(parts)


def _page(results: Results, pictures: list[Path]) -> str:
    captions = {
        "gains": "Difference from preferences alone on segments of later stages, at "
        f"{deciding_budget(results['rows'])} queries, paired by trial, with its 95% t interval. "
        "Filled: the interval excludes 0. All trials of an env have the same segments, so that the "
        "intervals cover queries, mistakes and first weights, not other policies.",
        "queries": "Held-out quality against the number of queries, segments of later stages.",
    }
    pieces = [figure(path, path.stem.capitalize(), captions[path.stem]) for path in pictures]
    tables = [
        table(f"{env}, {queries} queries", _head(), map(_cells, _rows(results, env, queries)))
        for env, queries in _blocks(results)
    ]
    header = element("header", element("h1", TITLE), element("p", SIMULATED))
    body = (
        section("ranking", "Ranking", element("p", results["rule"]), _ranking(results)),
        section("figures", "Figures", *pieces),
        section("tables", "All candidates", *tables),
    )
    return document(TITLE, header, element("main", *body))


def _ranking(results: Results) -> Markup:
    head = ("Candidate", "What it is", "Mean rank correlation", "Eligible")
    rows = (
        (
            entry["candidate"],
            results["candidates"][entry["candidate"]],
            number(entry["score"]),
            "yes" if entry["eligible"] else "no",
        )
        for entry in results["ranking"]
    )
    return table("The candidates in their order by the rule above.", head, rows)


def _head() -> list[str]:
    measures = [f"{says}, {stage}" for stage in STAGES for says in MEASURES.values()]
    return ["candidate", "highlights +, −", *measures]


def _cells(row: Mapping[str, Any]) -> list[str]:
    marks = f"{number(row['positive'], 2)}, {number(row['negative'], 2)}"
    values = [stored(row[stage][measure]) for stage in STAGES for measure in MEASURES]
    return [row["candidate"], marks, *values]


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def _blocks(results: Results) -> list[tuple[str, int]]:
    return list(dict.fromkeys((row["env"], row["queries"]) for row in results["rows"]))


def _rows(results: Results, env: str, queries: int) -> list[Mapping[str, Any]]:
    return [r for r in results["rows"] if (r["env"], r["queries"]) == (env, queries)]


def _gains(results: Results) -> Figure:
    envs = list(dict.fromkeys(row["env"] for row in results["rows"]))
    names = list(results["candidates"])[1:]
    shown = {"pair_accuracy": "gain in pair accuracy", "spearman": "gain in rank correlation"}
    picture = Figure(figsize=(WIDTH, 2 * (0.8 + 0.17 * len(names))))
    grid = picture.subplots(2, len(envs), squeeze=False, sharey=True, sharex="row")
    for line, (measure, says) in zip(grid, shown.items(), strict=True):
        for ax, env in zip(line, envs, strict=True):
            found = _rows(results, env, deciding_budget(results["rows"]))
            rows = [row for row in found if row["candidate"] in names]
            draw_gains(ax, rows, "late", measure, names)
            ax.set_title(env)
            ax.set_xlabel(says)
    return picture


def _ladder(results: Results) -> Figure:
    envs = list(dict.fromkeys(row["env"] for row in results["rows"]))
    picture = Figure(figsize=(WIDTH, 4.2))
    grid = picture.subplots(2, len(envs), squeeze=False, sharex=True)
    for line, measure in zip(grid, ("pair_accuracy", "spearman"), strict=True):
        for ax, env in zip(line, envs, strict=True):
            rows = [row for row in results["rows"] if row["env"] == env]
            draw_ladder(ax, rows, "late", measure, MEASURES[measure])
            ax.set_title(env)
    shared_legend(picture, grid[0][0], "95% t interval over trials", columns=3)
    return picture


FIGURES: Final = {"gains": _gains, "queries": _ladder}
"""File names and who draws them, in the order of the page."""
