"""A run's folder is taken only where nothing is lost by it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest

from polite.experiments.run_folder import LOCK, claim_folder, sole_run
from polite.types import PoliteError

RUN: dict[str, Any] = {"preset": "smoke", "seed": 3, "config": {"hidden": (32, 32)}}


def leave_temporary(path: Path) -> Path:
    """What a process leaves that was killed before it renamed its temporary file to `path`."""
    left = path.with_name(f".{path.stem}-{uuid4().hex}{path.suffix}")
    left.parent.mkdir(parents=True, exist_ok=True)
    left.write_text("half")
    return left


def refusal(out: Path, run: dict[str, Any], resume: bool) -> str:
    """The message, one line, of a claim that changes nothing."""
    root = out.parent
    before = sorted(root.rglob("*"))
    with pytest.raises(PoliteError) as caught:
        claim_folder(out, run, resume)
    assert "\n" not in str(caught.value)
    assert sorted(root.rglob("*")) == before
    return str(caught.value)


@pytest.mark.parametrize("resume", [False, True])
def test_a_new_or_empty_folder_is_taken(tmp_path: Path, resume: bool) -> None:
    new, empty = tmp_path / "new" / "run", tmp_path / "empty"
    empty.mkdir()
    for out in (new, empty):
        claim_folder(out, RUN, resume)
        assert [path.name for path in out.iterdir()] == ["run.json"]
        assert json.loads((out / "run.json").read_text("utf-8"))["seed"] == 3


def test_the_same_run_is_gone_on_with_only_when_asked(tmp_path: Path) -> None:
    claim_folder(tmp_path / "run", RUN, False)
    assert "--resume" in refusal(tmp_path / "run", RUN, False)
    claim_folder(tmp_path / "run", RUN, True)
    assert "other settings (seed: 3 there, 4 now)" in refusal(
        tmp_path / "run", RUN | {"seed": 4}, True
    )


def test_what_differs_is_told(tmp_path: Path) -> None:
    claim_folder(tmp_path / "run", {"a": 1, "b": "x\ny", "c": {"deep": list(range(99))}}, False)
    now = {"b": "x", "c": {"deep": []}, "d": None}
    said = refusal(tmp_path / "run", now, True)
    assert '(a: 1 there, nothing now, b: "x\\ny" there, "x" now, c, …)' in said
    assert "(d: nothing there, null now)" in refusal(
        tmp_path / "run", {"a": 1, "b": "x\ny", "c": {"deep": list(range(99))}, "d": None}, True
    )


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "letter.txt").write_text("precious")
    left = leave_temporary(tmp_path / "run" / "a.json")
    assert "not empty" in refusal(tmp_path / "run", RUN, False)
    assert "no run" in refusal(tmp_path / "run", RUN, True)
    assert left.exists()


@pytest.mark.parametrize("seed", [-1, 1.0, "1", None])
@pytest.mark.parametrize("resume", [False, True])
def test_what_is_no_seed_is_refused(tmp_path: Path, seed: object, resume: bool) -> None:
    message = refusal(tmp_path / "run", RUN | {"seed": seed}, resume)
    assert message == f"seed: expected a whole number of at least 0, got {seed!r}"


@pytest.mark.parametrize("resume", [False, True])
def test_a_place_that_cannot_be_a_folder_is_refused(tmp_path: Path, resume: bool) -> None:
    (tmp_path / "file").write_text("mine")
    assert "Not a directory" in refusal(tmp_path / "file", RUN, resume)
    assert "Not a directory" in refusal(tmp_path / "file" / "run", RUN, resume)
    assert (tmp_path / "file").read_text() == "mine"


def test_a_system_that_refuses_is_a_one_line_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "exists", refuse)
        with pytest.raises(PoliteError, match=r"Permission denied.*another folder"):
            claim_folder(tmp_path / "run", RUN, False)
    monkeypatch.setattr(Path, "mkdir", refuse)
    assert "Permission denied" in refusal(tmp_path / "run", RUN, False)


@pytest.mark.parametrize("resume", [False, True])
def test_a_claim_that_was_killed_can_be_made_again(tmp_path: Path, resume: bool) -> None:
    leave_temporary(tmp_path / "run" / "run.json")
    claim_folder(tmp_path / "run", RUN, resume)
    assert [path.name for path in (tmp_path / "run").iterdir()] == ["run.json"]


def test_going_on_removes_what_was_left_half_written(tmp_path: Path) -> None:
    out = tmp_path / "run"
    claim_folder(out, RUN, False)
    (out / "stages").mkdir()
    (out / "stages" / "clips.json").write_text("{}")
    for name in ("run.json", "stages/rewards-0.npz", "data/polite/answers.jsonl"):
        leave_temporary(out / name)
    claim_folder(out, RUN, True)
    files = {str(path.relative_to(out)) for path in out.rglob("*") if path.is_file()}
    assert files == {"run.json", "stages/clips.json"}


@pytest.mark.parametrize("content", ["", '{"preset": "sm', "[]", "\x00"])
def test_a_damaged_marker_is_named(tmp_path: Path, content: str) -> None:
    claim_folder(tmp_path / "run", RUN, False)
    (tmp_path / "run" / "run.json").write_text(content)
    assert "run.json: expected" in refusal(tmp_path / "run", RUN, True)


BUSY = "process {process} works in {folder}"
HOLDS = """
import sys
from pathlib import Path
from polite.experiments.run_folder import sole_run
with sole_run(Path(sys.argv[1]), {"seed": 3}, True, ""):
    print("held", flush=True)
    sys.stdin.read()
"""
"""A process that works in a folder until it is killed."""
LOCKS = pytest.mark.skipif(os.name == "nt", reason="Windows has no such lock")


@LOCKS
def test_one_process_at_a_time_works_in_a_folder(tmp_path: Path) -> None:
    out = tmp_path / "run"
    with sole_run(out, RUN, False, BUSY):
        left = leave_temporary(out / "live" / "a.json")  # the first one is just writing it
        for resume in (False, True):
            with pytest.raises(PoliteError) as caught, sole_run(out, RUN, resume, BUSY):
                raise AssertionError
        assert str(caught.value) == f"process {os.getpid()} works in {out}"
        assert left.exists()
    with sole_run(out, RUN, True, BUSY):
        assert not left.exists()
    with pytest.raises(PoliteError, match="--resume"), sole_run(out, RUN, False, BUSY):
        raise AssertionError


@LOCKS
def test_a_process_that_is_killed_leaves_no_lock(tmp_path: Path) -> None:
    out = tmp_path / "run"
    command = [sys.executable, "-c", HOLDS, str(out)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == b"held\n"
        says = f"process {holder.pid} works"
        with pytest.raises(PoliteError, match=says), sole_run(out, {"seed": 3}, True, BUSY):
            raise AssertionError
        holder.kill()
    with sole_run(out, {"seed": 3}, True, BUSY):
        assert json.loads((out / "run.json").read_text("utf-8")) == {"seed": 3}


def test_no_lock_is_left_in_a_folder_of_something_else(tmp_path: Path) -> None:
    (tmp_path / "letter.txt").write_text("precious")
    for resume in (False, True):
        with pytest.raises(PoliteError), sole_run(tmp_path, RUN, resume, BUSY):
            raise AssertionError
    assert [path.name for path in tmp_path.iterdir()] == ["letter.txt"]
    (tmp_path / "letter.txt").unlink()
    (tmp_path / LOCK).write_text("killed before it had claimed the folder")
    with sole_run(tmp_path, RUN, False, BUSY):
        assert (tmp_path / LOCK).read_text("utf-8") == f"{os.getpid()}\n"
