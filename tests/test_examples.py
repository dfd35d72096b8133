"""The examples run, at their smallest; `replicate_study.py` in tests/polite/test_replicate.py."""

import importlib.util
import json
import os
import runpy
import subprocess
import sys
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pygame
import pytest
from made_up_study import corridor_export

from polite.dataset import load_feedback
from polite.policies.policy import GaussianPolicy, save_policy
from polite.rewards.files import load_reward_model
from socialnav_env.rendering import Window

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


@pytest.fixture
def stop(monkeypatch, capsys):
    """Runs an example that ends early, in this process: its status and its last line."""

    def start(name, *arguments):
        monkeypatch.setattr(sys, "argv", [name, *map(str, arguments)])
        with pytest.raises(SystemExit) as caught:
            runpy.run_path(str(EXAMPLES / name), run_name="__main__")
        told = capsys.readouterr()
        return caught.value.code, (told.err or told.out).splitlines()[-1]

    return start


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


class Hands(Window):
    """A real window in which events happen as a script says: a list of them for each frame."""

    def __init__(self, *script):
        super().__init__()
        self.script = list(script)

    def show(self, frame, fps):
        super().show(frame, 100_000)  # at no particular pace

    def keys(self):
        for kind, *key in self.script.pop(0) if self.script else ():
            pygame.event.post(pygame.event.Event(kind, **({"key": key[0]} if key else {})))
        return super().keys()


@pytest.fixture
def drive(monkeypatch):
    """The example as a module, on SDL's dummy display."""
    monkeypatch.setitem(os.environ, "SDL_VIDEODRIVER", "dummy")
    spec = importlib.util.spec_from_file_location("drive", EXAMPLES / "drive.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    yield module
    pygame.display.quit()


UP, LEFT = (pygame.KEYDOWN, pygame.K_UP), (pygame.KEYDOWN, pygame.K_LEFT)
ESCAPE, QUIT = (pygame.KEYDOWN, pygame.K_ESCAPE), (pygame.QUIT,)


def test_drive_in_a_window_ends_with_its_episode(drive, tmp_path, capsys):
    script = [[UP, LEFT], *[[]] * 14, [(pygame.KEYUP, pygame.K_LEFT)]]  # to the left, into the wall
    drive.main(tmp_path / "drive.npz", 0, Hands(*script))
    told = capsys.readouterr().out
    assert "you, seed 0: collision after" in told and "social force, same start" in told
    assert drive.load_recording(tmp_path / "drive.npz").terminated
    assert not pygame.display.get_init()


@pytest.mark.parametrize("end", [ESCAPE, QUIT])
def test_drive_in_a_window_keeps_what_was_broken_off(drive, tmp_path, capsys, end):
    drive.main(tmp_path / "drive.npz", 0, Hands([UP], [], [], [end]))
    assert "you, seed 0: no goal after 0.3 s" in capsys.readouterr().out
    assert len(drive.load_recording(tmp_path / "drive.npz").actions) == 3


@pytest.mark.parametrize("end", [ESCAPE, QUIT])
def test_drive_in_a_window_that_is_closed_at_once(drive, tmp_path, capsys, end):
    drive.main(tmp_path / "drive.npz", 0, Hands([end]))
    assert capsys.readouterr().out == "nothing was driven, so nothing is kept\n"
    assert os.listdir(tmp_path) == []


def test_drive_without_a_display(tmp_path, monkeypatch, stop):
    monkeypatch.setitem(os.environ, "SDL_VIDEODRIVER", "moon")  # there is none of that name
    status, line = stop("drive.py", "--out", tmp_path / "drive.npz")
    assert status == 2 and line.startswith("drive.py: error: no display was found")


def test_train_sb3(tmp_path):
    out = tmp_path / "ppo.zip"
    small = ["--steps", 1000, "--num-envs", 8, "--scenario", "empty", "--episodes", 10]
    told = run("train_sb3.py", *small, "--out", out)
    assert "| success |" in told and "1024 steps in" in told  # whole rollouts of 8 * 64
    assert out.exists()
    with np.load(tmp_path / "ppo.scale.npz", allow_pickle=False) as scale:
        assert scale["mean"].shape == scale["var"].shape == (24,)


def test_record_minari(tmp_path):
    told = run("record_minari.py", "--out", tmp_path, "--episodes", 2)
    assert "2 episodes" in told and "replayed exactly: True" in told
    assert (tmp_path / "social-corridor" / "social-force-v0").is_dir()


def test_record_minari_wants_an_episode(stop):
    status, line = stop("record_minari.py", "--episodes", 0)
    assert status == 2 and line.endswith("error: --episodes 0: expected at least 1")


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


def test_make_gifs_draws_the_still(tmp_path):
    run("make_gifs.py", "--still", tmp_path / "new" / "corridor.png")
    assert iio.imread(tmp_path / "new" / "corridor.png").shape[1:] == (960, 3)
    assert os.listdir(tmp_path) == ["new"]


def test_vector_or_single(tmp_path):
    told = run("vector_or_single.py", "--steps", 2048, "--seeds", 1, "--out", tmp_path)
    assert "single envs, seed 0" in told
    curves = json.loads((tmp_path / "curves.json").read_text("utf-8"))["curves"]
    one, many = (curve[0]["success"] for curve in curves.values())
    assert one == many  # the same training, only faster
    assert iio.imread(tmp_path / "success.png").ndim == 3


def test_own_teacher(tmp_path):
    told = run("own_teacher.py", "Pendulum-v1", 4096, "--out", tmp_path / "smooth")
    answers, correlation = told.splitlines()[-1].split(" answers; r̂ and smoothness correlate: ")
    assert answers == "50" and float(correlation) > 0.0


def test_people_to_reward(tmp_path):
    export = corridor_export(tmp_path)
    told = run("people_to_reward.py", export, "--epochs", 20, "--out", tmp_path / "reward.pt")
    # Three people answered 8, 8 and 7 comparisons, the last one each with a preference.
    assert told.startswith("learned from 16 answers; foresees ") and " of 7 preferences" in told
    assert load_reward_model(tmp_path / "reward.pt").observation_size == 36
    again = ["--condition", "baseline", "--epochs", 1, "--out", tmp_path / "other.pt"]
    assert run("people_to_reward.py", export, *again).startswith("learned from 8 answers")


def test_people_to_reward_wants_two_people(tmp_path, stop):
    export = corridor_export(tmp_path, sizes=(1, 0))
    for condition in ("polite", "baseline"):
        status, line = stop("people_to_reward.py", export, "--condition", condition)
        assert status == 2
        assert f"error: {export}: expected answers of at least two people" in line
    assert stop("people_to_reward.py", tmp_path / "none")[0] == 2


def test_make_study_demo(tmp_path):
    run("make_study_demo.py", "--out", tmp_path / "demo", "--work", tmp_path / "work")
    made = load_feedback(tmp_path / "demo" / "pool")
    assert (len(made.pool), len(made.queries), made.answers) == (40, 32, [])
    compared = {index for query in made.queries for index in (query.first, query.second)}
    assert max(compared) < 34  # the last six are kept for guide and practice


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


@pytest.mark.parametrize("content", ["nothing", "results.json", "models"])
def test_compare_policies_wants_a_finished_study(tmp_path, stop, content):
    run = tmp_path / "run"
    if content == "results.json":
        run.mkdir()
        (run / content).write_text("{}")
    elif content == "models":
        (run / content).mkdir(parents=True)
    status, line = stop("compare_policies.py", run, "--out", tmp_path / "out")
    assert status == 2
    assert f"error: {run}: expected the folder of a finished `polite replicate`" in line
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.name)
def test_help_is_all_that_help_does(path, tmp_path, monkeypatch, stop):
    monkeypatch.chdir(tmp_path)
    status, _ = stop(path.name, "--help")
    assert status == 0
    assert os.listdir(tmp_path) == []


def test_every_example_is_run_here():
    tests = {name.removeprefix("test_") for name in globals() if name.startswith("test_")}
    elsewhere = {"replicate_study"}  # on a finished study, in tests/polite/test_replicate.py
    assert {path.stem for path in EXAMPLES.glob("*.py")} <= tests | elsewhere


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.name)
def test_an_example_is_short_and_tells_what_it_is(path):
    text = path.read_text("utf-8")
    assert text.startswith('"""')
    assert text.count("\n") < 80
