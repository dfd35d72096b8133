"""The grids that are landed in this repository: their READMEs say exactly which runs they hold."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
import tyro

from polite.experiments.benchmark.config import BenchmarkConfig
from polite.experiments.benchmark.grid import planned, select
from polite.experiments.benchmark.record import made_otherwise, read_record

ROOT = Path(__file__).parents[2]
LANDED = {"fast": "benchmark", "paper": "benchmark_paper"}
grids = pytest.mark.parametrize(
    ("preset", "folder"),
    [(preset, ROOT / "assets" / "results" / name) for preset, name in LANDED.items()],
    ids=list(LANDED),
)


@grids
def test_every_record_is_of_today_s_settings_and_none_is_of_no_run(preset, folder) -> None:
    runs = planned(preset)
    names = {run.name for run in runs if read_record(folder, run)}
    assert names == {path.stem for path in (folder / "runs").iterdir()}
    assert not any(made_otherwise(folder, run) for run in runs)


@grids
def test_the_commands_of_its_readme_choose_these_runs(preset, folder) -> None:
    readme = (folder / "README.md").read_text("utf-8")
    lines = re.findall(r"^--(?:stage|env|method) .*$", readme, re.MULTILINE)
    chosen = set()
    for line in lines:
        arguments = ["--preset", preset, "--out", "folder", *shlex.split(line)]
        chosen |= {run.name for run in select(tyro.cli(BenchmarkConfig, args=arguments))}
    assert chosen == {path.stem for path in (folder / "runs").iterdir()}


@grids
def test_its_readme_and_the_first_page_count_them(preset, folder) -> None:
    done, every = len(list((folder / "runs").iterdir())), len(planned(preset))
    assert f"{every - done} of {every} runs" in (folder / "README.md").read_text("utf-8")
    assert f"{done} of the {every} runs" in (ROOT / "README.md").read_text("utf-8")
