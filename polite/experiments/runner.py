"""Runs tasks in parallel processes, each finished one kept on disk and never repeated."""

from __future__ import annotations

import multiprocessing
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing.queues import SimpleQueue
from pathlib import Path
from typing import Any, Self

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from polite.experiments.workers import cores, prepare_worker, single_threaded
from polite.files import read_json_object, write_json
from polite.types import PoliteError

Report = Callable[[float], None]
"""Called with the share of a task that is done, in [0, 1]."""
Work = Callable[[Report], dict[str, Any]]
"""A task's work: importable, its result plain data."""

_BARS = 20  # of more tasks than a screen has room for only the running ones are shown
_LISTEN_EVERY = 0.1  # seconds
_LISTENER_STOPS_WITHIN = 5.0  # seconds
_messages: SimpleQueue[tuple[str, float]] | None = None


@dataclass(frozen=True)
class Task:
    """One unit of work.

    Attributes:
        name: Unique within a run; names the result's file.
        says: What is happening, for the progress display.
        work: Does it. Whatever else it writes must be written before it returns.
    """

    name: str
    says: str
    work: Work


def result_path(folder: Path, name: str) -> Path:
    """Where a task's result is kept."""
    return folder / "stages" / f"{name}.json"


class Runner:
    """Worker processes, one a core and one thread each, that are kept for all tasks of a run."""

    def __init__(self, folder: Path, progress: Progress) -> None:
        """Set up; the processes start with the first task.

        Args:
            folder: The run's folder.
            progress: Shows what is happening.
        """
        self._folder = folder
        self._progress = progress
        self._bars: dict[str, TaskID] = {}
        self._many = False
        context = multiprocessing.get_context("spawn")
        self._messages: SimpleQueue[tuple[str, float]] = context.SimpleQueue()
        self._pool = ProcessPoolExecutor(cores(), context, _start_worker, (self._messages,))
        self._stopping = threading.Event()
        self._listener = threading.Thread(target=self._listen, daemon=True)

    def __enter__(self) -> Self:
        """Begin to listen to what the workers say."""
        self._listener.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Let running tasks finish, drop the others, stop."""
        self._pool.shutdown(cancel_futures=True)
        self._stopping.set()
        self._listener.join(_LISTENER_STOPS_WITHIN)  # longer only if a message was cut short

    def run(self, tasks: Sequence[Task]) -> list[dict[str, Any]]:
        """Run the tasks that have no result yet.

        Args:
            tasks: Independent of each other.

        Returns:
            The results, in the order of the tasks.

        Raises:
            PoliteError: A result on disk is damaged, or a worker process died.
            Exception: Whatever a task raises; finished tasks' results are kept.
        """
        paths = {task.name: result_path(self._folder, task.name) for task in tasks}
        kept = {name: _read(path) for name, path in paths.items() if path.exists()}
        self._work([task for task in tasks if task.name not in kept])
        return [kept[name] if name in kept else _read(path) for name, path in paths.items()]

    def _work(self, tasks: list[Task]) -> None:
        """Do tasks, as many at once as there are workers."""
        self._many = len(tasks) > _BARS
        for task in tasks:
            self._bars[task.name] = self._progress.add_task(
                task.says, total=1.0, start=False, visible=not self._many
            )
        try:
            with single_threaded():
                futures = {self._pool.submit(_do, self._folder, task): task for task in tasks}
                for number, future in enumerate(as_completed(futures), 1):
                    future.result()
                    if not moves(self._progress.console):
                        done = f"{futures[future].says}: done, {number} of {len(tasks)}"
                        self._progress.console.print(done, highlight=False, soft_wrap=True)
        except BrokenProcessPool as error:
            raise PoliteError(
                "a worker process died, as when the system runs out of memory; free memory, then "
                "--resume"
            ) from error

    def _listen(self) -> None:
        """Move the bars as the workers report, until told to stop.

        It looks from time to time, rather than wait for a last message from `__exit__`: a worker
        that was killed may have left the queue locked for writers.
        """
        stopping = False
        while not stopping:
            stopping = self._stopping.wait(_LISTEN_EVERY)
            while not self._messages.empty():
                name, share = self._messages.get()
                self._progress.start_task(self._bars[name])
                shown = not self._many or share < 1.0
                self._progress.update(self._bars[name], completed=share, visible=shown)


def moves(console: Console) -> bool:
    """Whether a bar moves there; in a log file it would be seen at the end only."""
    return console.is_terminal or console.is_jupyter


def make_progress() -> Progress:
    """Bars that say what is happening, how far it is and how long is left.

    On the error stream, so that what a command prints is its outcome alone.
    """
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f}%"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=Console(stderr=True),
    )


def _read(path: Path) -> dict[str, Any]:
    """A task's result."""
    return read_json_object(path, "delete it and --resume")


def _start_worker(messages: SimpleQueue[tuple[str, float]]) -> None:
    """Prepare a worker process."""
    global _messages
    _messages = messages
    prepare_worker()


def _do(folder: Path, task: Task) -> None:
    """Do one task in a worker process and keep its result."""

    def report(share: float) -> None:
        if _messages is not None:
            _messages.put((task.name, share))

    report(0.0)
    result = task.work(report)
    write_json(result_path(folder, task.name), result)
    report(1.0)
