"""The command line: a user's mistake is one line and exit code 2, and changes nothing."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import torch

from polite import cli
from polite.experiments.training.config import TrainConfig
from polite.rewards.files import save_reward_model
from polite.rewards.network import FAST, RewardNet

Command = Callable[..., subprocess.CompletedProcess[str]]
Mistake = Callable[..., str]


@pytest.fixture
def mistake(command_line: Command, tmp_path: Path) -> Mistake:
    """The only line that a mistaken command prints; the test's folder stays as it is."""

    def call(*arguments: object) -> str:
        before = sorted(tmp_path.rglob("*"))
        line = the_only_line(command_line(*arguments))
        assert sorted(tmp_path.rglob("*")) == before
        return line

    return call


def the_only_line(done: subprocess.CompletedProcess[str]) -> str:
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    (line,) = done.stderr.splitlines()
    assert line.startswith("polite: ")
    return line


def test_an_unknown_env(tmp_path: Path) -> None:
    """In a process of its own, as a shell begins it: nothing that is imported says anything."""
    arguments = ["train", "--env", "NoSuchEnv-v0", "--out", str(tmp_path / "run")]
    done = subprocess.run(
        [sys.executable, "-W", "error", "-m", "polite", *arguments],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert "NoSuchEnv-v0" in the_only_line(done)
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("option", "value"),
    [("queries", -1), ("steps", 0), ("seed", -1), ("evaluation-episodes", 0)],
)
def test_impossible_numbers_of_a_training(
    mistake: Mistake, tmp_path: Path, option: str, value: int
) -> None:
    line = mistake("train", f"--{option}", value, "--out", tmp_path / "run")
    assert line.startswith(f"polite: {option.replace('-', '_')}: expected at least")


def test_a_seed_below_zero(mistake: Mistake, tmp_path: Path) -> None:
    line = mistake("replicate", "--preset", "smoke", "--seed", -1, "--out", tmp_path / "run")
    assert line == "polite: seed: expected a whole number of at least 0, got -1"


@pytest.mark.parametrize("command", ["replicate", "train"])
def test_a_folder_beneath_a_file(mistake: Mistake, tmp_path: Path, command: str) -> None:
    (tmp_path / "file").write_text("mine")
    assert "Not a directory" in mistake(command, "--out", tmp_path / "file" / "run")


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs a folder that nobody may fill")
def test_a_folder_that_cannot_be_written_into(mistake: Mistake, tmp_path: Path) -> None:
    assert "/proc/run" in mistake("replicate", "--out", "/proc/run")


def test_a_map_of_no_model(mistake: Mistake, tmp_path: Path) -> None:
    line = mistake("map", tmp_path / "reward.pt", "--out", tmp_path / "map.png")
    assert "no such reward model" in line


def test_a_map_of_a_model_of_other_shapes(mistake: Mistake, tmp_path: Path) -> None:
    net = RewardNet(17, 6, FAST, torch.Generator().manual_seed(0))
    save_reward_model(tmp_path / "reward.pt", net)
    line = mistake("map", tmp_path / "reward.pt", "--out", tmp_path / "map.png")
    assert "17 and 6" in line


def test_watching_an_empty_folder(mistake: Mistake, tmp_path: Path) -> None:
    assert "holds no trained policy" in mistake("watch", tmp_path)


def test_a_report_on_an_empty_folder(mistake: Mistake, tmp_path: Path) -> None:
    assert "results.json" in mistake("report", tmp_path)


def test_a_report_on_a_training(mistake: Mistake, tmp_path: Path) -> None:
    """It was taken for a comparison of highlights, because its settings name a form of them."""
    settings = dataclasses.asdict(TrainConfig(out=tmp_path)) | {"out": ""}
    (tmp_path / "run.json").write_text(json.dumps(settings))
    assert "`polite watch` shows an episode" in mistake("report", tmp_path)


def test_an_env_of_ones_own_is_looked_for_where_one_is(
    command_line: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "envs_of_mine.py").write_text("raise ValueError('found')\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [p for p in sys.path if p])  # as the installed command has it
    done = command_line("train", "--env", "envs_of_mine:Mine-v0", "--out", tmp_path / "run")
    assert done.returncode == 2 and "found" in done.stderr


def test_the_package_is_a_command_too() -> None:
    command = [sys.executable, "-m", "polite", "--help"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0
    assert "usage: polite " in done.stdout


@pytest.mark.parametrize(
    "arguments", [["train", "--colour", "red"], ["train", "--steps", "many"], ["fly"], []]
)
def test_a_command_that_cannot_be_parsed(command_line: Command, arguments: list[str]) -> None:
    done = command_line(*arguments)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("kind", "arguments", "says"),
    [
        (cli.Replicate, ["replicate", "--out", "run"], "polite: stopped; go on with --resume"),
        (cli.Train, ["train", "--out", "run"], "polite: stopped; go on with --resume"),
        (cli.Map, ["map", "reward.pt", "--out", "map.png"], "polite: stopped"),
        (cli.Report, ["report", "run"], "polite: stopped"),
    ],
)
def test_resuming_is_offered_only_where_it_can_be_done(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    kind: type,
    arguments: list[str],
    says: str,
) -> None:
    def stop(_: object) -> Path:
        raise KeyboardInterrupt

    monkeypatch.setattr(kind, "run", stop)
    monkeypatch.setattr(sys, "argv", ["polite", *arguments])
    with pytest.raises(SystemExit) as caught:
        cli.main()
    assert caught.value.code == 130
    assert capsys.readouterr().err.strip() == says
