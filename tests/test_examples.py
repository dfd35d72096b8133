"""The examples run, at their smallest."""

import subprocess
import sys
from pathlib import Path

import imageio.v3 as iio

EXAMPLES = Path(__file__).parents[1] / "examples"


def run(name, *arguments):
    done = subprocess.run(
        [sys.executable, "-W", "error", EXAMPLES / name, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_watch(tmp_path):
    out = tmp_path / "corridor.gif"
    assert "success" in run("watch.py", out)
    assert len(iio.imread(out)) > 10


def test_replicate_study(tmp_path):
    told = run("replicate_study.py", "smoke", tmp_path / "run")
    assert "POLITE" in told
    assert (tmp_path / "run" / "report.html").exists()


def test_draw_reward_map(tmp_path):
    run("draw_reward_map.py", tmp_path / "run", 2000)
    assert iio.imread(tmp_path / "run" / "reward_map.png").ndim == 3


def test_every_example_is_run_here():
    tested = {"watch.py", "replicate_study.py", "draw_reward_map.py"}
    assert {path.name for path in EXAMPLES.glob("*.py")} == tested
