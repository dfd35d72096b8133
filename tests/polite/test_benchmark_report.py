"""The benchmark's figures and page, on synthetic records; no partial grid may break them."""

from __future__ import annotations

import re
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from page_outline import Outline
from synthetic_records import synthetic_grid, synthetic_plan, synthetic_record, synthetic_run

from polite.analysis.benchmark_summary import summarise
from polite.plots.benchmark import (
    draw_cells,
    draw_learning_curves,
    draw_returns_by_queries,
    in_order,
)
from polite.plots.benchmark_effects import draw_ablation, draw_improvement, pair_name
from polite.plots.methods import HUES, look_of
from polite.plots.style import STYLE, WIDTH
from polite.report import benchmark
from polite.report.benchmark import CAPTIONS, render, write_benchmark_report
from polite.report.benchmark_figures import (
    FIGURES,
    improvement_figure,
    learning_figure,
    queries_figure,
)
from polite.report.benchmark_selection import compared_variants, seen_cells
from polite.report.benchmark_words import (
    benchmark_findings,
    condition_words,
    verdict_badge,
)
from polite.types import PoliteError

GRID, PLAN = synthetic_grid(3), synthetic_plan(4)


@pytest.fixture(scope="module")
def results() -> dict[str, Any]:
    return summarise(GRID, PLAN)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, results: dict[str, Any]) -> Path:
    folder = tmp_path_factory.mktemp("benchmark")
    assert write_benchmark_report(folder, results) == folder / "report.html"
    return folder


@pytest.fixture(scope="module")
def page(folder: Path) -> Outline:
    outline = Outline()
    outline.feed((folder / "report.html").read_text(encoding="utf-8"))
    return outline


@pytest.fixture
def ax() -> Axes:
    return Figure().subplots()


def test_every_figure_is_drawn_and_has_a_caption(folder: Path) -> None:
    png = {path.stem for path in (folder / "figures").glob("*.png")}
    assert png == {path.stem for path in (folder / "figures").glob("*.pdf")}
    assert png == set(FIGURES) == set(CAPTIONS)


def test_page_is_balanced_alone_and_says_first_that_the_teacher_is_simulated(page: Outline) -> None:
    assert page.open == []
    assert "from a simulated teacher" in page.text
    assert page.text.index("simulated teacher") < page.text.index("What came out")
    addresses = [v for _, attrs in page.tags for n, v in attrs.items() if n in ("src", "href")]
    assert all(value is not None and value.startswith("data:") for value in addresses)
    assert all(attrs.get("alt") for tag, attrs in page.tags if tag == "img")
    names = [attrs["id"] for _, attrs in page.tags if "id" in attrs]
    assert len(names) == len(set(names))


def test_page_answers_the_headline_for_every_loss_and_form(
    page: Outline, results: dict[str, Any]
) -> None:
    asked = [c for c in results["comparisons"] if c["second"] == "baseline-800"]
    asked = [c for c in asked if c["first"] == "POLITE-200"]
    assert len(asked) == 11  # two envs: pairwise, released, our form, two variants; one raised
    words = ("beats baseline-800", "falls short of baseline-800", "not told apart from baseline-8")
    assert sum(page.text.count(text) for text in words) == len(asked)


def test_missing_runs_and_rules_are_on_the_page(page: Outline, results: dict[str, Any]) -> None:
    assert results["runs"]["missing"] > 0
    assert "planned and not finished" in page.text
    for claim in results["claims"]:
        assert claim["rule"] in page.text
        for text in claim["missing"]:
            assert text in page.text


def test_headline_follows_the_numbers() -> None:
    def say(polite: float, baseline: float, seeds: int = 3) -> str:
        records = [
            synthetic_record(synthetic_run(method, queries, seed=k), mean + 5 * k)
            for method, queries, mean in (
                ("polite", 200, polite),
                ("preferences", 800, baseline),
            )
            for k in range(seeds)
        ]
        return str(benchmark_findings(summarise(records)))

    assert "POLITE-200 beats baseline-800" in say(900.0, 700.0)
    assert "POLITE-200 falls short of baseline-800" in say(500.0, 700.0)
    assert "POLITE-200 is not told apart from baseline-800" in say(702.0, 700.0)
    assert "has too few runs to be told apart from" in say(900.0, 700.0, seeds=1)
    assert "undecided" in str(benchmark_findings(summarise([])))


def test_verdicts_while_runs_are_missing_are_told_apart(results: dict[str, Any]) -> None:
    waiting = [claim for claim in results["claims"] if claim["missing"]]
    assert waiting  # the plan has a seed more than the grid
    for claim in waiting:
        assert "so far: " in verdict_badge(claim)
        assert "so far" not in verdict_badge(claim | {"missing": []})
    assert "so far, with runs missing" in benchmark_findings(results)
    whole = benchmark_findings(summarise(GRID, synthetic_plan(3)))
    assert "so far" not in whole
    ours = next(c for c in results["claims"] if c["highlights"] == "choice")
    assert "so far: holds<" in verdict_badge(ours | {"verdict": "reproduced"})


def test_our_claims_tell_every_part_that_is_judged(results: dict[str, Any]) -> None:
    text = benchmark_findings(results)
    ours = ("bar-", "control-", "alone-", "highlights-for-preferences")
    bars = [c for c in results["claims"] if c["id"].startswith(ours)]
    assert {name for name in ours if any(c["id"].startswith(name) for c in bars)} == set(ours)
    assert any(len(claim["parts"]) > 1 for claim in bars)
    assert all(f"{part['what']}: " in text for claim in bars for part in claim["parts"])
    rows = re.findall(r'<tr><th scope="row">(.*?)</th>(.*?)</tr>', text)
    for claim in bars:  # in the row of its text, in the column of its env, once a condition
        (cells,) = [cells for said, cells in rows if said == escape(claim["text"], quote=False)]
        column = re.findall("<td>(.*?)</td>", cells)[results["envs"].index(claim["env"])]
        assert column.count(f"</span> {condition_words(claim)}. ") == 1


def test_each_env_has_tables_of_its_own(results: dict[str, Any], folder: Path) -> None:
    text = (folder / "report.html").read_text(encoding="utf-8")
    assert "Preset fast." in text
    for env in results["envs"]:
        for what, part in (
            ("cells", "cells"),
            ("pairs", "comparisons"),
            ("missing runs", "missing"),
        ):
            (table,) = re.findall(f"<caption>{env}: {what}</caption>(.*?)</table>", text, re.DOTALL)
            rows = table.count('<th scope="row">')
            assert rows == sum(row["env"] == env for row in results[part]) > 0


def test_what_one_env_lacks_has_a_dash(results: dict[str, Any]) -> None:
    raised = [c["text"] for c in results["claims"] if c["id"] == "alone-raised"]
    text = benchmark_findings(results)
    assert f'<tr><th scope="row">{raised[0]}</th><td>–</td><td><div' in text


def test_records_of_other_settings_are_counted_on_the_page() -> None:
    assert "2 left out that other settings made" in benchmark_findings(
        summarise(GRID, PLAN, made_otherwise=2)
    )


def test_an_empty_grid_has_a_page(tmp_path: Path) -> None:
    text = write_benchmark_report(tmp_path, summarise([], PLAN)).read_text(encoding="utf-8")
    assert "0 runs finished" in text
    assert "simulated teacher" in text
    assert not (tmp_path / "figures").exists()


@settings(max_examples=6, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.sets(st.integers(0, len(GRID) - 1), min_size=1, max_size=12))
def test_no_partial_grid_breaks_figures_or_page(kept: set[int]) -> None:
    results = summarise([GRID[k] for k in sorted(kept)], PLAN)
    for draw in FIGURES.values():
        figure = draw(results)
        assert figure is None or figure.axes
    outline = Outline()
    outline.feed(render(results, []))
    assert outline.open == []


def test_the_same_numbers_give_the_same_page(results: dict[str, Any]) -> None:
    assert render(results, []) == render(summarise(GRID[::-1], PLAN), [])


@pytest.mark.parametrize(("key", "value"), [("cells", 3), ("claims", [{}]), ("missing", None)])
def test_numbers_of_another_type_are_one_line_errors(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    results: dict[str, Any],
    key: str,
    value: object,
) -> None:
    monkeypatch.setattr(benchmark, "draw_benchmark_figures", lambda results, folder: [])
    broken = {k: v for k, v in results.items() if k != key}
    with pytest.raises(PoliteError, match=f"expected the key '{key}'"):
        write_benchmark_report(tmp_path, broken)
    if value is not None:
        with pytest.raises(PoliteError, match=r"results\.json: .*another version") as caught:
            write_benchmark_report(tmp_path, broken | {key: value})
        assert "\n" not in str(caught.value)
    assert not (tmp_path / "report.html").exists()


def test_looks_of_methods_and_budgets_differ_in_more_than_colour() -> None:
    assert len({colour for colour, _ in HUES.values()}) == len(HUES)
    assert len({marker for _, marker in HUES.values()}) == len(HUES)
    cells = [
        {"method": method, "highlights": form, "queries": queries, "label": ""}
        for method, form in (("polite", "paper"), ("polite", "choice"), ("highlights", "choice"))
        for queries in (100, 200, 262, 400, 525, 800)
    ]
    looks = [look_of(cell) for cell in cells]
    assert len({(look.line, look.marker) for look in looks}) == len(looks)
    assert len({look.colour for look in looks}) == len(looks)


def test_learning_curves_draw_the_mean_with_its_standard_error(
    ax: Axes, results: dict[str, Any]
) -> None:
    cell = next(c for c in results["cells"] if c["label"] == "POLITE-200")
    draw_learning_curves(ax, [cell])
    line = next(line for line in ax.lines if line.get_label() == "POLITE-200")
    np.testing.assert_allclose(line.get_ydata(), cell["curve"]["mean"])
    np.testing.assert_allclose(line.get_xdata(), np.array(cell["curve"]["steps"]) / 1000)
    edges = [line for line in ax.lines if str(line.get_label()).startswith("_")]
    mean, error = (np.array(cell["curve"][name]) for name in ("mean", "error"))
    np.testing.assert_allclose(edges[0].get_ydata(), mean - error)


def test_each_form_stands_beside_its_own_baselines(results: dict[str, Any]) -> None:
    with rc_context(STYLE):
        figure = learning_figure(results)
    assert figure is not None
    shown: dict[bool, set[str]] = {True: set(), False: set()}
    for ax in figure.axes:
        labels = {str(line.get_label()) for line in ax.lines}
        shown["choice" in ax.get_title("left")] |= {name for name in labels if "baseline" in name}
    assert shown == {
        True: {"baseline-262", "baseline-525", "baseline-800"},
        False: {"baseline-400", "baseline-800"},
    }


def test_a_variant_that_compares_has_curves_of_its_own(results: dict[str, Any]) -> None:
    assert compared_variants(results, ("pairwise", "choice")) == ["few-epochs", "raised"]
    assert compared_variants(results, ("released", "paper")) == []
    with rc_context(STYLE):
        figure = learning_figure(results)
    assert figure is not None
    titles = {ax.get_title("left"): ax for ax in figure.axes}
    (ax,) = (ax for says, ax in titles.items() if "Walker2d" in says and "few-epochs" in says)
    lines = {str(line.get_label()): line.get_ydata() for line in ax.lines}
    cells = seen_cells(results, "Walker2d-v5", ("pairwise", "choice"), "few-epochs")
    floor_and_ceiling = {"true reward", "untrained reward"}
    asked = {"POLITE-200", "baseline-262", "baseline-800"}
    assert {cell["label"] for cell in cells} == asked | floor_and_ceiling
    for cell in cells:
        name = cell["label"] + (" (choice)" if cell["highlights"] == "choice" else "")
        np.testing.assert_allclose(lines[name], cell["curve"]["mean"])


def test_a_variant_of_one_env_leaves_no_panel_in_the_other_and_axes_keep_their_names(
    results: dict[str, Any],
) -> None:
    for envs in (results["envs"], results["envs"][::-1]):
        with rc_context(STYLE):
            figure = learning_figure(results | {"envs": envs})
        assert figure is not None and figure.get_figwidth() > WIDTH
        raised = [ax for ax in figure.axes if "raised" in ax.get_title("left")]
        (shown,) = (ax for ax in raised if ax.get_visible())
        assert len(raised) == 2 and "Walker2d" in shown.get_title("left")
        assert shown.get_xlabel() and shown.xaxis.get_tick_params()["labelbottom"]
        letters = [ax.get_title("left")[:3] for ax in figure.axes if ax.get_visible()]
        assert letters == [f"({letter})" for letter in "abcdefghi"[: len(letters)]]


def test_returns_by_queries_are_on_a_log2_axis(ax: Axes, results: dict[str, Any]) -> None:
    cells = [c for c in results["cells"] if c["env"] == "Walker2d-v5" and not c["variant"]]
    cells = [c for c in cells if c["loss"] in (None, "pairwise")]
    draw_returns_by_queries(ax, cells)
    assert ax.get_xscale() == "log"
    _, labels = ax.get_legend_handles_labels()
    assert labels[0] == "true reward"
    assert {"POLITE", "POLITE (choice)", "baseline", "PEBBLE"} <= set(labels)
    assert {200, 262, 800} <= set(ax.get_xticks())
    assert not len(ax.get_xticks(minor=True))


def test_two_runs_that_say_little_leave_the_others_their_height() -> None:
    """Their t interval is thirteen times as wide as they are apart."""
    records = [
        synthetic_record(synthetic_run(method, queries, seed=seed), final)
        for method, queries, finals in (
            ("polite", 200, (0.0, 1000.0)),
            ("preferences", 800, (400.0, 500.0, 600.0)),
        )
        for seed, final in enumerate(finals)
    ]
    results = summarise(records)
    assert min(cell["interval"]["low"] for cell in results["cells"]) < -5000
    figure = queries_figure(results)
    assert figure is not None
    for shown in figure.axes:
        low, high = shown.get_ylim()
        assert -200 < low < 0 < 1000 < high < 1200


def test_cells_have_a_dot_a_run(ax: Axes, results: dict[str, Any]) -> None:
    cells = [c for c in results["cells"] if c["env"] == "Walker2d-v5"][:3]
    draw_cells(ax, [("group", cells)])
    dots = [line for line in ax.lines if line.get_marker() == "."]
    assert [len(line.get_xdata()) for line in dots] == [len(c["runs"]) for c in cells]
    assert ax.get_yticklabels()[0].get_text() == "group"


def test_improvement_marks_lie_in_their_rows(ax: Axes, results: dict[str, Any]) -> None:
    part = results["comparisons"][0]
    name = f"{part['first']} > {part['second']}"
    draw_improvement(ax, {"pairwise": [part]}, ["other", name])
    mark = next(line for line in ax.lines if line.get_label() == "pairwise")
    assert mark.get_ydata() == [1.0]
    assert mark.get_xdata() == [part["improvement"]["mean"]]


def test_improvement_shows_every_pair_where_only_our_form_was_run() -> None:
    own = [r for r in GRID if r["run"]["highlights"] != "paper" and r["run"]["loss"] == "pairwise"]
    results = summarise(own)
    figure = improvement_figure(results)
    assert figure is not None
    rows = {label.get_text() for label in figure.axes[0].get_yticklabels()}
    names = [pair_name(part) for part in results["comparisons"]]
    assert rows == set(names)
    for env in results["envs"]:
        told = [pair_name(part) for part in results["comparisons"] if part["env"] == env]
        assert len(told) == len(set(told))  # one loss and one form: every pair is told once
    pairs = {name for name in names if ": " not in name}
    assert "raised: highlights-200 > baseline-262" in rows
    assert any(pair.startswith("baseline-800, equal-updates") for pair in pairs)


def test_ablation_says_where_there_is_no_run(ax: Axes, results: dict[str, Any]) -> None:
    cell = next(c for c in results["cells"] if c["label"] == "highlights-400")
    draw_ablation(ax, [("pairwise", {"highlights": cell})])
    assert [text.get_text() for text in ax.texts] == ["no run"] * 3
    assert [bar.get_height() for bar in ax.patches] == [cell["mean"]]


def test_legends_list_the_ceiling_first_and_the_floor_last(results: dict[str, Any]) -> None:
    cells = [c for c in results["cells"] if c["env"] == "Walker2d-v5"]
    order = [cell["method"] for cell in in_order(cells)]
    assert order[0] == "ground-truth"
    assert order[-1] == "untrained"
