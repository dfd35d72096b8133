"""The examples run, at their smallest."""

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

from polite.policies.policy import GaussianPolicy, save_policy

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


def test_drive(tmp_path):
    told = run("drive.py", "--autopilot", "--seed", 1, "--out", tmp_path / "drive.npz")
    assert "you, seed 1: goal reached" in told
    assert "social force, same start: success 1" in told
    with np.load(tmp_path / "drive.npz", allow_pickle=False) as recording:
        assert len(recording["observations"]) == len(recording["actions"]) + 1 > 100


def test_train_sb3(tmp_path):
    out = tmp_path / "ppo.zip"
    small = ["--steps", 1024, "--num-envs", 8, "--scenario", "empty", "--episodes", 10]
    told = run("train_sb3.py", *small, "--out", out)
    assert "| success |" in told and "1024 steps" in told
    assert out.exists()
    with np.load(tmp_path / "ppo.scale.npz", allow_pickle=False) as scale:
        assert scale["mean"].shape == scale["var"].shape == (24,)


@pytest.mark.skipif(
    not all(map(importlib.util.find_spec, ("minari", "h5py", "jax"))),
    reason="needs minari[create,hdf5]",
)
def test_record_minari(tmp_path):
    told = run("record_minari.py", "--out", tmp_path, "--episodes", 2)
    assert "2 episodes" in told and "replayed exactly: True" in told
    assert (tmp_path / "social-corridor" / "social-force-v0").is_dir()


def test_compare_scenarios(tmp_path):
    some = ["--scenarios", "paper", "queue", "--episodes", 4]
    told = run("compare_scenarios.py", *some, "--out", tmp_path)
    assert "| metric | straight | social-force | dynamic-window |" in told
    assert told.strip() == (tmp_path / "comparison.md").read_text("utf-8").strip()
    assert iio.imread(tmp_path / "comparison.png").ndim == 3


def test_make_gifs(tmp_path):
    run("make_gifs.py", "--out", tmp_path, "--only", "empty", "doorway", "--width", 320)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["doorway.gif", "empty.gif"]
    assert len(iio.imread(tmp_path / "empty.gif")) > 50


def test_vector_or_single(tmp_path):
    told = run("vector_or_single.py", "--steps", 2048, "--seeds", 1, "--out", tmp_path)
    assert "single envs, seed 0" in told
    curves = json.loads((tmp_path / "curves.json").read_text("utf-8"))["curves"]
    one, many = (curve[0]["success"] for curve in curves.values())
    assert one == many  # the same training, only faster
    assert iio.imread(tmp_path / "success.png").ndim == 3


def test_replicate_study(tmp_path):
    told = run("replicate_study.py", "smoke", tmp_path / "run")
    assert "POLITE" in told
    assert (tmp_path / "run" / "report.html").exists()


def test_draw_reward_map(tmp_path):
    run("draw_reward_map.py", tmp_path / "run", 2000)
    assert iio.imread(tmp_path / "run" / "reward_map.png").ndim == 3


def test_compare_policies(tmp_path):
    (tmp_path / "results.json").write_text('{"config": {"anchor_jitter": 0.5}}')
    ahead = GaussianPolicy(
        weights=(np.zeros((2, 36), np.float32), np.array([1.0, 0.0], np.float32)),
        activation="tanh",
        log_std=np.zeros(2, np.float32),
        mean=np.zeros(36),
        variance=np.ones(36),
        low=np.full(2, -1.0, np.float32),
        high=np.full(2, 1.0, np.float32),
    )
    save_policy(tmp_path / "models" / "policy-polite-3.pt", ahead)
    run("compare_policies.py", tmp_path, "--episodes", 2, "--out", tmp_path / "out")
    table = (tmp_path / "out" / "policies.md").read_text("utf-8")
    assert "dynamic-window | PPO, POLITE's reward 3 |" in table
    assert "50 episodes each" in table


def test_every_example_is_run_here():
    tests = {name.removeprefix("test_") for name in globals() if name.startswith("test_")}
    assert {path.stem for path in EXAMPLES.glob("*.py")} <= tests


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.name)
def test_an_example_is_short_and_tells_what_it_is(path):
    text = path.read_text("utf-8")
    assert text.startswith('"""')
    assert text.count("\n") < 80
