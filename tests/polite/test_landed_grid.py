"""The grid that is landed in this repository: its README says exactly which runs it holds."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import tyro

from polite.experiments.benchmark.config import BenchmarkConfig
from polite.experiments.benchmark.grid import planned, select
from polite.experiments.benchmark.record import made_otherwise, read_record

LANDED = Path(__file__).parents[2] / "assets" / "results" / "benchmark"
README = (LANDED / "README.md").read_text("utf-8")


def test_every_record_is_of_today_s_settings_and_none_is_of_no_run() -> None:
    runs = planned("fast")
    names = {run.name for run in runs if read_record(LANDED, run)}
    assert names == {path.stem for path in (LANDED / "runs").iterdir()}
    assert not any(made_otherwise(LANDED, run) for run in runs)


def test_the_commands_of_its_readme_choose_these_runs() -> None:
    lines = re.findall(r"^--(?:stage|env|method) .*$", README, re.MULTILINE)
    chosen = set()
    for line in lines:
        arguments = ["--out", "folder", *shlex.split(line)]
        chosen |= {run.name for run in select(tyro.cli(BenchmarkConfig, args=arguments))}
    assert chosen == {path.stem for path in (LANDED / "runs").iterdir()}


def test_its_readme_and_the_first_page_count_them() -> None:
    done, every = len(list((LANDED / "runs").iterdir())), len(planned("fast"))
    assert f"{every - done} of {every} runs" in README
    front = (LANDED.parents[2] / "README.md").read_text("utf-8")
    assert f"{done} of the {every} runs" in front
