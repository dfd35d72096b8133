"""One self-contained page from a run's stored numbers: `report.html`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from polite.files import read_json_object
from polite.report import tables
from polite.report.captions import CAPTIONS
from polite.report.example import example_clips
from polite.report.figures import draw_figures
from polite.report.findings import findings
from polite.report.html import Markup, document, element, figure, join, section
from polite.report.stored import reading, write_text
from polite.report.wording import wording

Results = Mapping[str, Any]


def write_report(folder: Path) -> Path:
    """Draw the figures of a run and write its page.

    Args:
        folder: A folder with `results.json` and, if the run kept them, `clips/`.

    Returns:
        The page, `folder/report.html`; it needs no other file and no network.

    Raises:
        PoliteError: When results.json is missing, is no JSON, lacks a key or has a value of
            another type, a clip is damaged, or the folder cannot be written into.
    """
    results = read_results(folder)
    with reading(folder / "results.json", "polite replicate"):
        page = render(results, folder, draw_figures(results, folder))
    return write_text(folder / "report.html", page)


def read_results(folder: Path) -> dict[str, Any]:
    """The stored numbers of a run.

    Raises:
        PoliteError: When the file is missing or is no JSON object.
    """
    remedy = "expected the folder of a finished run; one that was stopped goes on with --resume"
    return read_json_object(folder / "results.json", remedy)


def render(results: Results, folder: Path, pictures: list[Path]) -> str:
    """The whole page as text."""
    sections = [*_opening(results, folder), *_numbers(results), _closing(results)]
    sections.insert(3, _figures(pictures))
    return document(wording(results).title, _header(results), element("main", *sections))


def _header(results: Results) -> Markup:
    words = wording(results)
    strong = element("strong", words.banner)
    banner = element("p", strong, words.more, class_="banner", role="note")
    paper = element("p", f"After {results['published']['source']}.", class_="source")
    return element("header", element("h1", words.title), paper, banner)


def _opening(results: Results, folder: Path) -> list[Markup]:
    words = wording(results)
    clips = example_clips(results["example"], folder, words.no_mark)
    return [
        section("findings", "What came out", findings(results)),
        section("run", "What was run", _run(results)),
        section("example", "One query", _asked(results["example"], words.one), clips),
    ]


def _asked(example: Mapping[str, Any], one: str) -> Markup:
    chosen = ("first", "second")[example["preferred"]]
    text = f"Query {example['query']}: {one} of the POLITE group saw two clips, "
    text += f"preferred the {chosen}, and could mark one good and one bad window on it."
    return element("p", text)


def _run(results: Results) -> Markup:
    clips, counts, words = results["clip_policy"], results["counts"], wording(results)
    seen = (
        ("a person", "share_with_person"),
        ("the intermittent goal", "share_with_intermittent"),
        ("the end goal", "share_with_goal"),
        ("a collision", "share_with_collision"),
    )
    facts = {
        "Preset and seed": f"{results['preset']}, seed {results['seed']}, version "
        f"{results['version']}",
        "Training seeds": ", ".join(map(str, results["seeds"])),
        "Answers": f"{counts['polite']['answers']} for POLITE, "
        f"{counts['baseline']['answers']} for the baseline{words.pairs}",
        words.clips: f"PPO on the true reward, {clips['why']}",
        "Clips that show": ", ".join(f"{what} {clips[key]:.0%}" for what, key in seen),
    }
    if "people" in results:
        facts = _study(results) | facts
    rows = (join([element("dt", name), element("dd", text)]) for name, text in facts.items())
    return element("dl", *rows)


def _study(results: Results) -> dict[str, str]:
    """Which study's answers these are."""
    people, count = results["people"], results["participants"]
    return {
        "Study": f"“{people['title']}”, its export.json has the SHA-256 {people['export']}",
        "Participants": f"{count['polite']} in the POLITE group and {count['baseline']} in the "
        "baseline's, who finished and are not excluded",
    }


def _figures(pictures: list[Path]) -> Markup:
    return section("figures", "Figures", *(figure(path, *CAPTIONS[path.stem]) for path in pictures))


def _numbers(results: Results) -> list[Markup]:
    claims, words = results["claims"], wording(results)
    parts = [
        section(
            "claims",
            "Claims and verdicts",
            element("p", RULES + words.inputs),
            tables.claims_table(claims, "emergent", words.emergent),
            tables.claims_table(claims, "arithmetic", "Arithmetic on the paper's own numbers."),
            tables.claims_table(claims, "input", "Claims about inputs: shown, never judged."),
        ),
        section("statistics", "Statistics of the answers", tables.statistics_table(results)),
        section("policies", "Policies and their social metrics", tables.policy_table(results)),
    ]
    if results["sensitivity"]:
        table = tables.sensitivity_table(results["sensitivity"])
        parts.append(section("sensitivity-table", "Sensitivity", table))
    return parts


RULES = (
    "The rules are code that was written before the runs. Reproduced: the whole 95% interval "
    "satisfies the bound, for every part of the claim. Not reproduced: for some part the whole "
    "interval lies on the other side. Undecided: an interval straddles its bound. "
)


def _closing(results: Results) -> Markup:
    settings = element("summary", "All settings")
    details = element("details", settings, tables.config_table(results["config"]))
    calibrated = results["calibrated"]
    inputs = [tables.inputs_table(calibrated)] if calibrated else []
    return section("inputs", "Inputs", *inputs, details)
