"""Runs tasks in parallel processes, each finished one kept on disk and never repeated."""

from __future__ import annotations

import json
import multiprocessing
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.queues import SimpleQueue
from pathlib import Path
from typing import Any

import torch
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from polite.files import write_json

Report = Callable[[float], None]
"""Called with the share of a task that is done, in [0, 1]."""
Work = Callable[[Report], dict[str, Any]]
"""A task's work: importable, its result plain data."""

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_messages: SimpleQueue[tuple[str, float] | None] | None = None


@dataclass(frozen=True)
class Task:
    """One unit of work.

    Attributes:
        name: Unique within a run; names the result's file.
        says: What is happening, for the progress display.
        weight: How long it takes compared with the others.
        work: Does it. Whatever else it writes must be written before it returns.
    """

    name: str
    says: str
    weight: float
    work: Work


def result_path(folder: Path, name: str) -> Path:
    """Where a task's result is kept."""
    return folder / "stages" / f"{name}.json"


def run_tasks(folder: Path, tasks: Sequence[Task], progress: Progress) -> list[dict[str, Any]]:
    """Run the tasks that have no result yet, one process a core and one thread a process.

    Args:
        folder: The run's folder.
        tasks: Independent of each other.
        progress: Shows what is happening.

    Returns:
        The results, in the order of the tasks.

    Raises:
        Exception: Whatever a task raises; the other tasks' results are kept.
    """
    waiting = [task for task in tasks if not result_path(folder, task.name).exists()]
    if waiting:
        _run_waiting(folder, waiting, progress)
    return [json.loads(result_path(folder, task.name).read_text("utf-8")) for task in tasks]


def make_progress() -> Progress:
    """Bars that say what is happening, how far it is and how long is left."""
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f}%"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )


def _run_waiting(folder: Path, tasks: list[Task], progress: Progress) -> None:
    """Run tasks in worker processes, and show how far they are."""
    context = multiprocessing.get_context("spawn")
    messages: SimpleQueue[tuple[str, float] | None] = context.SimpleQueue()
    bars = {
        task.name: progress.add_task(task.says, total=task.weight, start=False) for task in tasks
    }
    weights = {task.name: task.weight for task in tasks}

    def listen() -> None:
        while (message := messages.get()) is not None:
            name, share = message
            progress.start_task(bars[name])
            progress.update(bars[name], completed=share * weights[name])

    listener = threading.Thread(target=listen, daemon=True)
    listener.start()
    workers = min(len(tasks), os.cpu_count() or 1)
    try:
        with (
            _single_threaded(),
            ProcessPoolExecutor(workers, context, _start_worker, (messages,)) as pool,
        ):
            futures = [pool.submit(_do, folder, task) for task in tasks]
            try:
                for future in as_completed(futures):
                    future.result()
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                raise
    finally:
        messages.put(None)
        listener.join()


@contextmanager
def _single_threaded() -> Iterator[None]:
    """Workers started within use one thread each, or two of them would slow each other down."""
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _start_worker(messages: SimpleQueue[tuple[str, float] | None]) -> None:
    """Prepare a worker process."""
    global _messages
    _messages = messages
    torch.set_num_threads(1)


def _do(folder: Path, task: Task) -> None:
    """Do one task in a worker process and keep its result."""

    def report(share: float) -> None:
        if _messages is not None:
            _messages.put((task.name, share))

    report(0.0)
    result = task.work(report)
    write_json(result_path(folder, task.name), result)
    report(1.0)
