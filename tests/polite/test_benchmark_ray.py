"""The same grid on a Ray cluster of two nodes, of which one is killed while it works."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from ray_grid import RUNS

from polite.experiments.benchmark.engines import LocalEngine
from polite.experiments.benchmark.execution import run_grid
from polite.experiments.benchmark.ray_engine import RayEngine
from polite.types import PoliteError

DEADLINE = 300.0
"""Seconds after which something hangs."""
SETTINGS = {
    "RAY_USAGE_STATS_ENABLED": "0",  # tells nobody anything
    "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0",  # listens on the loopback address only, as on macOS
    "RAY_worker_niceness": "0",  # else the runs get 3% of a core beside any other test
}


@pytest.mark.skipif(os.name == "nt", reason="Ray makes no cluster of several nodes on Windows")
def test_a_node_that_is_killed_loses_and_doubles_no_run(tmp_path: Path) -> None:
    tests = Path(__file__).parent
    with TemporaryDirectory(prefix="ray-") as its_own:  # short: sockets are in there
        paths = {"PYTHONPATH": str(tests), "RAY_TMPDIR": its_own}
        done = subprocess.run(
            [sys.executable, str(tests / "ray_grid.py"), str(tmp_path / "ray")],
            env=os.environ | SETTINGS | paths,
            capture_output=True,
            text=True,
            timeout=DEADLINE,
            check=False,
        )
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["failures"] == []
    (victim,) = told["killed"]
    with LocalEngine(2) as engine:
        assert run_grid(tmp_path / "local", RUNS, engine) == {}
    ray, local = (
        {path.name: path.read_bytes() for path in (tmp_path / name / "runs").iterdir()}
        for name in ("ray", "local")
    )
    assert f"{victim}.json" in ray
    assert ray == local
    assert ray.keys() == {f"{run.name}.json" for run in RUNS}


@pytest.mark.parametrize("address", ["127.0.0.1:1", "nowhere"])
def test_no_cluster_is_a_line_that_says_what_to_do(address: str) -> None:
    with pytest.raises(PoliteError, match="ray start --head") as caught, RayEngine(address):
        raise AssertionError
    assert address in str(caught.value)
    assert "\n" not in str(caught.value)
