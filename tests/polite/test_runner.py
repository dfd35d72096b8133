"""Tasks in worker processes: their order, what is kept, and what happens when one dies."""

from __future__ import annotations

import json
import os
import signal
import threading
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from polite.experiments import runner as module
from polite.experiments.runner import Report, Runner, Task, make_progress, result_path
from polite.experiments.workers import cores
from polite.files import write_json
from polite.types import PoliteError

DEADLINE = 60.0
"""Seconds after which something hangs."""


def answer(number: int, work: int, report: Report) -> dict[str, Any]:
    sum(range(work))
    report(0.5)
    return {"number": number, "process": os.getpid()}


def fail(report: Report) -> dict[str, Any]:
    raise PoliteError("this task cannot be done")


def die(report: Report) -> dict[str, Any]:
    """Be killed in the middle of a report, with the queue locked."""
    assert module._messages is not None
    module._messages._wlock.acquire()  # type: ignore[attr-defined]
    os.kill(os.getpid(), signal.SIGKILL)
    return {}


def numbered(number: int, work: int = 0) -> Task:
    return Task(f"task-{number}", f"task {number}", partial(answer, number, work))


def run(folder: Path, tasks: Sequence[Task]) -> list[dict[str, Any]]:
    with Runner(folder, make_progress()) as runner:
        return runner.run(tasks)


def in_time(work: Callable[[], object]) -> None:
    """Do some work, and fail rather than hang."""
    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(DEADLINE)
    assert not thread.is_alive()


def test_results_are_in_the_order_of_the_tasks_and_not_computed_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tasks = [numbered(n, work) for n, work in enumerate((20_000_000, 0, 5_000_000))]
    progress = make_progress()
    with Runner(tmp_path, progress) as runner:
        first = runner.run(tasks)
        again = runner.run([tasks[2], numbered(3), tasks[0]])
    assert [result["number"] for result in first] == [0, 1, 2]
    assert [result["number"] for result in again] == [2, 3, 0]
    assert again[0] == first[2] and again[2] == first[0]  # the same process: not done again
    assert os.getpid() not in {result["process"] for result in first}
    assert [task.completed for task in progress.tasks] == [1.0] * 4
    lines = capsys.readouterr().err.splitlines()  # no terminal, so no bar moves
    assert sorted(line.split(": ")[1] for line in lines) == [
        "done, 1 of 1", "done, 1 of 3", "done, 2 of 3", "done, 3 of 3"
    ]  # fmt: skip


def test_a_result_on_disk_is_taken_as_it_is(tmp_path: Path) -> None:
    write_json(result_path(tmp_path, "task-7"), {"number": "from before"})
    assert run(tmp_path, [numbered(7)]) == [{"number": "from before"}]


def test_an_error_is_passed_on_and_finished_results_stay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "cores", lambda: 1)  # one worker does them in order
    done = result_path(tmp_path, "task-0")
    with pytest.raises(PoliteError, match="this task cannot be done"):
        run(tmp_path, [numbered(0), Task("bad", "a bad task", fail)])
    kept = json.loads(done.read_text("utf-8"))
    assert not result_path(tmp_path, "bad").exists()
    assert run(tmp_path, [numbered(0)]) == [kept]


def test_a_worker_that_is_killed_is_a_one_line_error_and_nothing_hangs(tmp_path: Path) -> None:
    messages = []

    def work() -> None:
        try:
            run(tmp_path, [Task("dies", "dies", die)])
        except PoliteError as error:
            messages.append(str(error))

    in_time(work)
    (message,) = messages
    assert "--resume" in message and "\n" not in message
    assert not result_path(tmp_path, "dies").exists()


@pytest.mark.parametrize("content", ["", "{", "[]"])
def test_a_damaged_result_is_named_before_anything_is_done(tmp_path: Path, content: str) -> None:
    path = result_path(tmp_path, "task-1")
    path.parent.mkdir()
    path.write_text(content)
    with pytest.raises(PoliteError, match=r"task-1\.json: .*delete it and --resume") as caught:
        run(tmp_path, [numbered(0), numbered(1)])
    assert "\n" not in str(caught.value)
    assert not result_path(tmp_path, "task-0").exists()


def test_no_more_workers_than_cores_that_may_be_used(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {3, 5}, raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 64)
    assert cores() == 2
    monkeypatch.delattr(os, "sched_getaffinity")
    assert cores() == 64
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert cores() == 1
