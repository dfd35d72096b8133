"""The local engine: a process for each call, and what happens when one dies."""

from __future__ import annotations

import os
import sys
import threading
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pytest
from engine_tasks import die, loaded, wait_for_ever, where

from polite.experiments.benchmark.engines import NEEDED, TRIES, LocalEngine

DEADLINE = 60.0
"""Seconds after which something hangs."""


def test_a_call_that_dies_is_tried_again_and_harms_no_other(tmp_path: Path) -> None:
    before = os.environ.get("OMP_NUM_THREADS")
    with LocalEngine(2) as engine:
        lost = engine.submit(die, tmp_path / "always", 99)
        calls = [engine.submit(where, number) for number in range(2)]
        once = engine.submit(die, tmp_path / "once", 1)
        with pytest.raises(BrokenProcessPool):
            lost.result(DEADLINE)
        assert once.result(DEADLINE) == 2
        numbers, processes, threads = zip(*(call.result(DEADLINE) for call in calls), strict=True)
    assert (tmp_path / "always").read_text() == "x" * TRIES
    assert numbers == (0, 1)
    assert len({os.getpid(), *processes}) == 3
    assert threads == ("1", "1")
    assert os.environ.get("OMP_NUM_THREADS") == before


@pytest.mark.skipif(sys.platform != "linux", reason="processes begin from nothing elsewhere")
def test_a_process_has_what_a_run_needs_when_it_begins() -> None:
    with LocalEngine(1) as engine:
        assert engine.submit(loaded, NEEDED).result(DEADLINE) == [True] * len(NEEDED)


def test_leaving_ends_what_is_running_and_begins_nothing_more(tmp_path: Path) -> None:
    futures: list[Future[object]] = []

    def work() -> None:
        with pytest.raises(KeyboardInterrupt), LocalEngine(1) as engine:
            futures.extend(engine.submit(wait_for_ever, tmp_path / name) for name in "ab")
            while not (tmp_path / "a").exists():
                threading.Event().wait(0.01)
            raise KeyboardInterrupt

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(DEADLINE)
    assert not thread.is_alive()
    assert isinstance(futures[0].exception(0), BrokenProcessPool)
    assert futures[1].cancelled()
    assert not (tmp_path / "b").exists()
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "a").read_text()), 0)
