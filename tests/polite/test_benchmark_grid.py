"""The grid: what it consists of, in which order, and which part of it a filter leaves."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import tyro

from polite.experiments.benchmark.config import BenchmarkConfig
from polite.experiments.benchmark.grid import GRIDS, Run, grid, planned, select
from polite.types import InvalidValueError, PoliteError

RUN = Run("Walker2d-v5", "polite", 200, "pairwise", "paper", "fast", 1_000_000)
CONTROLS = (
    ("polite-200", "choice", "shuffled"),
    ("preferences-800", None, "equal-updates"),
    ("preferences-262", None, "equal-updates"),
    ("polite-200", "choice", "few-epochs"),
    ("preferences-262", None, "few-epochs"),
    ("preferences-800", None, "few-epochs"),
)
HEADLINE = replace(RUN, method="preferences", queries=800, highlights=None)


def chosen(preset: Any = "fast", **filters: Any) -> list[Run]:
    return select(BenchmarkConfig(out=Path("out"), preset=preset, **filters))


@pytest.mark.parametrize("preset", GRIDS)
def test_names_are_unique_and_fit_for_files(preset: str) -> None:
    runs = planned(preset)
    assert len({run.name for run in runs}) == len(set(runs)) == len(runs)
    assert all(re.fullmatch(r"[A-Za-z0-9._-]+", run.name) for run in runs)
    assert {run.preset for run in runs} == {preset}


@pytest.mark.parametrize(
    "change",
    [
        {"env": "HalfCheetah-v5"},
        {"method": "highlights"},
        {"queries": 100},
        {"loss": "released"},
        {"highlights": "choice"},
        {"preset": "paper"},
        {"steps": 1000},
        {"variant": "no-termination"},
        {"variant": "shuffled"},
        {"variant": "noisy"},
        {"variant": "equal-updates"},
        {"variant": "few-epochs"},
        {"variant": "raised"},
        {"seed": 1},
    ],
)
def test_a_name_tells_every_setting(change: dict[str, Any]) -> None:
    assert replace(RUN, **change).name != RUN.name


def test_a_run_is_the_same_after_it_was_written() -> None:
    keys = {"env", "method", "queries", "loss", "highlights", "preset", "steps", "variant", "seed"}
    assert RUN.as_dict().keys() == keys
    assert Run(**json.loads(json.dumps(RUN.as_dict()))) == RUN


@pytest.mark.parametrize("wrong", [{"queries": 0}, {"loss": None}, {"queries": -1}, {"seed": -1}])
def test_what_is_no_run_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match="Run"):
        replace(RUN, **wrong)


def test_a_stage_is_done_seed_by_seed_and_the_first_has_the_headline() -> None:
    first, *_ = grid("fast")
    assert [run.seed for run in first] == sorted(run.seed for run in first)
    cells = {(run.env, run.label, run.highlights) for run in first if run.seed == 0}
    envs = ("Walker2d-v5", "HalfCheetah-v5")
    labels = [("ground-truth", None), ("untrained", None)]
    labels += [("polite-200", "paper"), ("polite-400", "paper"), ("polite-200", "choice")]
    labels += [(f"preferences-{queries}", None) for queries in (200, 400, 800)]
    assert cells == {(env, *label) for env in envs for label in labels}
    assert {run.seed for run in first} == set(range(5))
    assert {run.loss for run in first} == {"pairwise", None}


def test_everything_that_was_asked_for_is_in_the_grid() -> None:
    cells = {(r.label, r.loss, r.highlights, r.variant, r.steps) for r in planned("fast")}
    million, quarter = 1_000_000, 250_000
    for label in ("polite-200", "polite-400"):
        assert (label, "released", "paper", "", million) in cells
    for queries in (100, 200, 400):
        assert (f"polite-{queries}", "pairwise", "choice", "", million) in cells
    for label in ("preferences-262", "preferences-525"):
        assert (label, "pairwise", None, "", million) in cells
    for label in ("pebble-200", "pebble-400"):
        assert (label, "pairwise", None, "", quarter) in cells
    assert ("highlights-400", "pairwise", "paper", "", million) in cells
    assert ("polite-200", "pairwise", "choice", "no-termination", million) in cells
    for label, form, variant in CONTROLS:
        assert (label, "pairwise", form, variant, million) in cells
    headline = {run.seed for run in planned("fast") if run == replace(HEADLINE, seed=run.seed)}
    assert headline == set(range(10))
    later = {(r.env, r.label, r.highlights, r.variant) for r in planned("fast") if r.seed >= 10}
    assert later == {
        ("Walker2d-v5", "polite-200", "choice", ""),
        ("Walker2d-v5", "preferences-262", None, ""),
        ("Walker2d-v5", "preferences-262", None, "raised"),
    }


def test_every_grid_has_a_floor_and_a_ceiling() -> None:
    for preset in GRIDS:
        for env in {run.env for run in planned(preset)}:
            methods = {run.method for run in planned(preset) if run.env == env}
            assert {"ground-truth", "untrained"} < methods


def test_the_help_lists_what_can_be_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        tyro.cli(BenchmarkConfig, args=["--help"])
    text = " ".join(re.sub("[│\\s]+", " ", capsys.readouterr().out).split())
    for preset in GRIDS:
        for run in planned(preset):
            named = {run.env, run.method, *(v or "none" for v in (run.loss, run.highlights))}
            assert named | {run.variant or "none"} <= set(re.split(r"[ ,;:()]+", text))
    described = re.findall(r" (\d): ", text)
    assert described == [str(number) for number in range(1, len(grid("fast")) + 1)]
    assert text.count("(default: all)") == 7
    assert "(default: )" not in text


def test_filters_keep_the_order_and_narrow_together() -> None:
    runs = chosen(env=("HalfCheetah-v5",), method=("preferences-800", "polite"), seeds=(1, 0))
    assert {run.env for run in runs} == {"HalfCheetah-v5"}
    assert {run.label for run in runs if run.method == "preferences"} == {"preferences-800"}
    assert {run.queries for run in runs if run.method == "polite"} == {100, 200, 400}
    assert runs == [run for run in planned("fast") if run in runs]
    assert chosen(stage=(2,)) == grid("fast")[1]
    assert {r.highlights for r in chosen(highlights=("choice",))} == {"choice"}
    assert {r.method for r in chosen(loss=("none",))} == {"ground-truth", "untrained"}


def test_the_controls_of_the_bar_can_be_chosen_alone() -> None:
    runs = chosen(variant=("shuffled", "equal-updates", "few-epochs"))
    ordered = [run for stage in (1, 4) for run in grid("fast")[stage] if run.variant]
    assert runs == [run for run in ordered if run.variant != "raised"]
    envs = ("Walker2d-v5", "HalfCheetah-v5")
    cells = [(run.env, run.label, run.highlights, run.variant, run.seed) for run in runs]
    every = [(env, *c, seed) for seed in range(5) for c in CONTROLS for env in envs]
    anew = [("HalfCheetah-v5", *CONTROLS[0], seed) for seed in range(5, 10)]
    assert cells == every + anew
    plain = chosen(stage=(2,), method=("preferences-262",), variant=("none",))
    assert {run.variant for run in plain} == {""} and len(plain) == 10


@pytest.mark.parametrize(
    ("filters", "says"),
    [
        ({"env": ("Walker2d-v5", "Walker-v5")}, "env: .*Walker-v5"),
        ({"method": ("polite-201",)}, "method: .*polite-201"),
        ({"seeds": (20,)}, "seeds: .*20"),
        ({"stage": (0,)}, "stage: .*0"),
        ({"highlights": ("best",)}, "highlights: .*best"),
        (
            {"variant": ("no",)},
            "variant: .*few-epochs, no-termination, noisy, none, raised, shuffled; got no",
        ),
        ({"stage": (1,), "seeds": (9,)}, "seeds: .*got 9"),
    ],
)
def test_a_filter_that_means_nothing_is_refused(filters: dict[str, Any], says: str) -> None:
    with pytest.raises(PoliteError, match=says) as caught:
        chosen(**filters)
    assert "\n" not in str(caught.value)
