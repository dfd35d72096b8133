"""A grid's runs in processes of their own: their records, and going on after a kill."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from polite.experiments.benchmark import execution, grid
from polite.experiments.benchmark.config import BenchmarkConfig
from polite.experiments.benchmark.engines import LocalEngine
from polite.experiments.benchmark.execution import BUSY, benchmark, run_grid
from polite.experiments.benchmark.grid import Block, Run
from polite.experiments.benchmark.machine import machine
from polite.experiments.benchmark.page import identity
from polite.experiments.benchmark.record import KEYS, read_record, record_path
from polite.experiments.benchmark.status import times_path
from polite.experiments.run_folder import claim_folder, sole_run
from polite.types import PoliteError

POINT = "registered_envs:Point-v0"
TRUE = Run(POINT, "ground-truth", 0, None, None, "smoke", 2048)
POLITE = Run(POINT, "polite", 10, "pairwise", "paper", "smoke", 2048)
PEBBLE = Run(POINT, "pebble", 10, "pairwise", None, "smoke", 300)
RUNS = [POLITE, TRUE, PEBBLE]
DEADLINE = 120.0
"""Seconds after which something hangs."""

DIES = """
import os, signal, sys
from pathlib import Path
from polite.experiments.benchmark import execution
from polite.experiments.benchmark.engines import LocalEngine
from polite.experiments.benchmark.status import grid_status
from test_benchmark_runs import RUNS

folder, pattern, number = Path(sys.argv[1]), sys.argv[2], int(sys.argv[3])

def look(folder, runs):
    if list(folder.glob(pattern)):
        os.kill(os.getpid(), number)
    return grid_status(folder, runs)

if __name__ == "__main__":
    # A shell's background job, and so the tests that it runs, ignores what Ctrl-C sends.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    execution.UPDATE_EVERY, execution.grid_status = 0.02, look
    execution.Board.update = lambda self: self._look()
    with LocalEngine(1) as engine:
        execution.run_grid(folder, RUNS, engine)
"""
"""A driver that is killed as soon as its folder has a file."""


def go(folder: Path) -> None:
    """Run what is left in this process's workers."""
    with LocalEngine(2) as engine:
        assert run_grid(folder, RUNS, engine) == {}


def records(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted((folder / "runs").iterdir())}


TINY = {"smoke": ((Block(cells=(POLITE, TRUE, PEBBLE), seeds=range(1)),),)}
"""The grid of this file's runs."""


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a benchmark from the command to its page."""
    folder = tmp_path_factory.mktemp("grid") / "run"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(grid, "GRIDS", TINY)
        page = benchmark(BenchmarkConfig(out=folder, preset="smoke", jobs=2))
    assert page == folder / "report.html"
    return folder


def found(folder: Path, run: Run) -> dict[str, Any]:
    record = read_record(folder, run)
    assert record is not None
    return record


def test_a_benchmark_ends_with_its_numbers_and_its_page(finished: Path) -> None:
    results = json.loads((finished / "results.json").read_text("utf-8"))
    assert results["runs"] | {"finished": 3, "missing": 0, "made_otherwise": 0} == results["runs"]
    assert {cell["label"] for cell in results["cells"]} == {"true reward", "POLITE-10", "PEBBLE-10"}
    assert "3 runs finished, 0 missing" in (finished / "report.html").read_text("utf-8")
    assert list((finished / "figures").glob("*.png"))


def test_a_finished_benchmark_that_goes_on_repeats_nothing(
    finished: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(grid, "GRIDS", TINY)
    monkeypatch.setattr(execution, "report_grid", lambda folder: folder)
    before = {path: path.stat().st_mtime_ns for path in (finished / "runs").iterdir()}
    config = BenchmarkConfig(out=finished, preset="smoke", resume=True)
    assert benchmark(config) == finished
    assert {path: path.stat().st_mtime_ns for path in before} == before
    busy = BUSY.format(process=os.getpid(), folder=finished)
    with sole_run(finished, identity("smoke"), True, BUSY):
        with pytest.raises(PoliteError, match=re.escape(busy)):
            benchmark(config)
        benchmark(replace(config, status=True))  # may be asked all the same
    assert "3 of 3 runs done" in capsys.readouterr().out


def test_every_run_leaves_one_record_and_its_models(finished: Path) -> None:
    assert list(records(finished)) == sorted(f"{run.name}.json" for run in RUNS)
    for run in RUNS:
        record = found(finished, run)
        assert record.keys() == KEYS
        assert record["run"] == run.as_dict()
        assert record["policy_steps"] >= run.steps
        assert set(record["curve"]["length"]) == {20.0}
        assert record["answers"]["asked"] == run.queries
        names = {path.name for path in (finished / "models" / run.name).iterdir()}
        assert names == {"policy.pt"} | ({"reward.pt"} if run is not TRUE else set())
    assert not any((finished / "live").iterdir())
    assert not any((finished / "checkpoints").iterdir())


def test_the_parts_of_a_run_take_all_of_its_time(finished: Path) -> None:
    for run in RUNS:
        times = json.loads(times_path(finished, run).read_text("utf-8"))
        assert times.pop("machine") == machine()
        assert {"training the policy", "judging the policy", "cpu"} < times.keys()
        parts = sum(seconds for name, seconds in times.items() if name not in ("total", "cpu"))
        assert parts == pytest.approx(times["total"], rel=0.01)


def test_a_record_tells_what_the_answers_and_the_reward_are_worth(finished: Path) -> None:
    record = found(finished, POLITE)
    for part in (record["quality"]["early"], record["quality"]["late"]):
        assert part.keys() == {"pair_accuracy", "pearson", "spearman", "saturation"}
        assert part["pair_accuracy"] > 0.5  # the reward is nothing but the place
    assert record["quality"]["highlighted_reward"].keys() == {"positive", "negative", "all"}
    assert 0.5 < record["answers"]["label_accuracy"] <= 1.0
    assert record["evaluation"]["episodes"] == 20
    assert found(finished, TRUE)["quality"] is None
    assert found(finished, TRUE)["answers"]["label_accuracy"] is None
    assert found(finished, PEBBLE)["quality"]["highlighted_reward"] is None


@pytest.mark.parametrize(
    ("run", "pattern", "number"),
    [
        (POLITE, "live/[!.]*polite*.json", signal.SIGKILL),
        (PEBBLE, "checkpoints/[!.]*.pt", signal.SIGINT),
    ],
)
def test_a_grid_that_is_killed_ends_with_the_same_records(
    finished: Path, tmp_path: Path, run: Run, pattern: str, number: int
) -> None:
    folder = tmp_path / "run"
    shutil.copytree(finished, folder)
    record_path(folder, run).unlink()
    before = {path: path.stat().st_mtime_ns for path in (folder / "runs").iterdir()}
    died = subprocess.run(
        [sys.executable, "-W", "error", "-c", DIES, str(folder), pattern, str(int(number))],
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parent)},
        capture_output=True,
        text=True,
        timeout=DEADLINE,
        check=False,
    )
    assert died.returncode == -number, died.stderr
    assert not record_path(folder, run).exists()
    assert list(folder.glob(pattern))
    claim_folder(folder, identity("smoke"), True)
    go(folder)
    assert records(folder) == records(finished)
    assert {path: path.stat().st_mtime_ns for path in before} == before
    assert not any((folder / "live").iterdir())
    if run is PEBBLE:  # it went on after its first session, and did not explore once more
        times = json.loads(times_path(folder, run).read_text("utf-8"))
        assert "gathering new states" not in times
