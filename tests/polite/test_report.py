"""The page: self-contained, honest about its participants, the same each time it is built."""

from __future__ import annotations

import itertools
import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from fake_results import fake_results, write_fake_run
from page_outline import Outline

from polite.analysis.statistics import Estimate
from polite.files import write_json
from polite.report.clips import read_clip
from polite.report.example import timeline
from polite.report.findings import findings
from polite.report.html import Markup, element, table
from polite.report.page import read_results, write_report
from polite.report.words import NBSP, estimate, number, over_seeds, p_value, percent
from polite.types import PoliteError


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = write_fake_run(tmp_path_factory.mktemp("run"), seeds=3)
    write_report(folder)
    return folder


@pytest.fixture(scope="module")
def page(run: Path) -> Outline:
    outline = Outline()
    outline.feed((run / "report.html").read_text(encoding="utf-8"))
    return outline


def test_every_figure_is_a_pdf_and_a_png(run: Path) -> None:
    png = {path.stem for path in (run / "figures").glob("*.png")}
    assert png == {path.stem for path in (run / "figures").glob("*.pdf")}
    assert {"fig5a_reward_map", "fig5b_goal_distance", "fig5c_divergence"} <= png
    assert {"fig5d_policy", "map_2d", "query_strip", "sensitivity"} <= png


def test_page_is_balanced_and_says_first_that_participants_are_simulated(page: Outline) -> None:
    assert page.open == []
    assert "The participants are simulated." in page.text
    assert page.text.index("participants are simulated") < page.text.index("What came out")


def test_page_needs_nothing_else(page: Outline) -> None:
    addresses = [
        value for _, attrs in page.tags for name, value in attrs.items() if name in ("src", "href")
    ]
    assert addresses
    assert all(value is not None and value.startswith("data:") for value in addresses)
    assert not any(tag == "script" for tag, _ in page.tags)


def test_every_picture_has_words(page: Outline) -> None:
    pictures = [attrs for tag, attrs in page.tags if tag == "img"]
    assert sum((a["src"] or "").startswith("data:image/gif") for a in pictures) == 2
    assert all(a.get("alt") for a in pictures)


def test_headings_and_identifiers_are_in_order(page: Outline) -> None:
    names = [attrs["id"] for tag, attrs in page.tags if "id" in attrs and tag != "pattern"]
    assert len(names) == len(set(names))
    levels = [int(tag[1]) for tag, _ in page.tags if re.fullmatch(r"h\d", tag)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after - before <= 1 for before, after in itertools.pairwise(levels))


def test_paper_stands_beside_ours(page: Outline) -> None:
    for published in ("66/400", "28/400", "236/372", "176/372", "24.83 ± 6.48", "χ² = 16.5"):
        assert published in page.text


def test_rebuilding_gives_the_same_page_and_figures(run: Path) -> None:
    before = {path.name: path.read_bytes() for path in (run / "figures").iterdir()}
    text = (run / "report.html").read_bytes()
    write_report(run)
    assert (run / "report.html").read_bytes() == text
    assert {path.name: path.read_bytes() for path in (run / "figures").iterdir()} == before


def test_summary_follows_the_numbers() -> None:
    results = fake_results(seeds=3)
    verdicts = [c["verdict"] for c in results["claims"] if c["kind"] == "emergent"]
    assert f"{verdicts.count('reproduced')} came out as the paper says" in findings(results)
    for claim in results["claims"]:
        claim["verdict"] = claim["parts"][0]["verdict"] = "not reproduced"
    turned = findings(results)
    assert f"0 came out as the paper says, {len(verdicts)} did not" in turned
    assert "✓" not in turned


def test_missing_numbers_are_one_line_errors(tmp_path: Path) -> None:
    with pytest.raises(PoliteError, match="cannot be read"):
        write_report(tmp_path)
    (tmp_path / "results.json").write_text("{", encoding="utf-8")
    with pytest.raises(PoliteError, match="expected JSON"):
        read_results(tmp_path)
    (tmp_path / "results.json").write_text("[]", encoding="utf-8")
    with pytest.raises(PoliteError, match="expected a JSON object, found list"):
        read_results(tmp_path)
    write_json(tmp_path / "results.json", {"simulated": True})
    with pytest.raises(PoliteError, match="expected the key"):
        write_report(tmp_path)
    assert not (tmp_path / "report.html").exists()


@pytest.mark.parametrize(
    ("key", "value"), [("reward_map", 3), ("kl", {"epochs": "x"}), ("claims", "x"), ("seeds", 5)]
)
def test_numbers_of_another_type_are_one_line_errors(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, key: str, value: object
) -> None:
    if key in ("claims", "seeds"):  # for the page alone
        monkeypatch.setattr("polite.report.page.draw_figures", lambda results, folder: [])
    results = json.loads((run / "results.json").read_text(encoding="utf-8"))
    write_json(tmp_path / "results.json", results | {key: value})
    with pytest.raises(PoliteError, match=r"results\.json: .*another version") as caught:
        write_report(tmp_path)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "report.html").exists()


@pytest.mark.parametrize("kept", [0, 7, 700])
def test_a_damaged_clip_is_a_one_line_error_that_names_it(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kept: int
) -> None:
    shutil.copytree(run / "clips", tmp_path / "clips")
    shutil.copy(run / "results.json", tmp_path)
    clip = tmp_path / "clips" / "query_second.gif"
    clip.write_bytes(clip.read_bytes()[:kept])
    monkeypatch.setattr("polite.report.page.draw_figures", lambda results, folder: [])
    with pytest.raises(PoliteError, match=r"query_second\.gif: not a readable clip") as caught:
        write_report(tmp_path)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "report.html").exists()


def test_a_folder_that_cannot_be_written_into_is_a_one_line_error(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copy(run / "results.json", tmp_path)
    (tmp_path / "figures").write_text("in the way")
    with pytest.raises(PoliteError, match=r"figures/.*cannot be written"):
        write_report(tmp_path)


def test_clip_frames_are_steps_even_where_the_file_merged_them(run: Path) -> None:
    first = read_clip(run / "clips" / "query_first.gif", 10)
    assert first.shape == (50, 96, 480, 3)
    example = json.loads((run / "results.json").read_text(encoding="utf-8"))["example"]
    assert example["fps"] == 10


def test_timeline_tells_by_colour_pattern_and_text() -> None:
    bar = timeline({"positive": (0, 9), "negative": (40, 49)}, 50, 10.0)
    assert "+ good: 0.0 to 1.0 s" in bar
    assert "− bad: 4.0 to 5.0 s" in bar
    assert "url(#positive-pattern)" in bar
    assert '<rect x="480.0"' in bar


def test_text_is_escaped_once() -> None:
    assert element("p", "a < b & c", title='"x"') == '<p title="&quot;x&quot;">a &lt; b &amp; c</p>'
    assert element("p", Markup("<b>bold</b>")) == "<p><b>bold</b></p>"
    assert "<script>" not in table("c", ["<script>"], [["<script>", "1"]])


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (-0.0004, "−0.000400"), (1234.5, "1,234"), (12.345, "12.3"), (None, "–")],
)
def test_numbers_in_words(value: float | None, text: str) -> None:
    assert number(value) == text


def test_estimates_show_what_their_interval_allows() -> None:
    assert estimate(Estimate(1.23456, 1.0, 1.46)) == f"1.23 [1.00,{NBSP}1.46]"
    assert estimate(Estimate(1.23456, 1.1, 1.36)) == f"1.23 [1.10,{NBSP}1.36]"
    assert estimate(Estimate(1.23456, -np.inf, np.inf), "m") == f"1.23{NBSP}m"
    assert percent(Estimate(0.165, 0.13, 0.2)) == f"16.5% [13.0,{NBSP}20.0]"
    assert estimate(Estimate(150_000, 120_000, np.inf)) == f"150,000 [120,000,{NBSP}∞)"
    assert estimate(Estimate(-1.0, -np.inf, 0.5), "m") == f"−1 (−∞,{NBSP}0.500]{NBSP}m"
    assert over_seeds([None, 2.0]) == "2"
    assert over_seeds([0.0, 0.0, 0.0]) == "0 (all 3)"
    assert over_seeds([0.1, 0.5, 1.0], share=True) == f"0.53 [0.00,{NBSP}1.00]"
    assert over_seeds([0.1, 0.5, 1.0]) == f"0.5 [−0.6,{NBSP}1.7]"
    assert over_seeds([]) == "–"


@pytest.mark.parametrize(
    ("p", "text"),
    [
        (0.027, "p = .027"),
        (4.857e-5, "p = 4.9 × 10⁻⁵"),
        (9.999e-5, "p = 1.0 × 10⁻⁴"),
        (0.0, "p < 10⁻³⁰⁰"),
    ],
)
def test_p_values_in_words(p: float, text: str) -> None:
    assert p_value(p) == text
