"""Who runs the runs."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, ExitStack, suppress
from functools import partial
from multiprocessing.context import BaseContext
from typing import Final, ParamSpec, Protocol, Self, TypeVar

from polite.experiments.workers import prepare_worker, single_threaded

P = ParamSpec("P")
T = TypeVar("T")

NEEDED: Final = ("polite.experiments.benchmark.run", "torch._dynamo")
"""What every run imports, for seconds; the second as soon as an optimizer is made."""
TRIES = 2
"""A run whose process dies is begun again once: it may have been another program's fault."""


class Engine(Protocol):
    """Calls functions elsewhere, each in a process of its own with one thread."""

    deaths: tuple[type[Exception], ...]
    """Errors that say that a call's process died."""

    def submit(self, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Call a function as soon as there is room.

        Args:
            function: importable, what it gives plain data.
            args: of the function.
            kwargs: of the function.

        Returns:
            What it gives; an error if its process died more than once.
        """


class LocalEngine(AbstractContextManager["LocalEngine"]):
    """Processes of this machine, so many at a time, one for each call.

    Each call has a process pool of one, because a pool is of no use any more after one of its
    processes has died, and does not tell whose call killed it.
    """

    deaths: tuple[type[Exception], ...] = (BrokenProcessPool,)

    def __init__(self, jobs: int) -> None:
        """Set up.

        Args:
            jobs: calls at a time.
        """
        self._threads = ThreadPoolExecutor(jobs)
        self._context = _ready_to_fork()
        self._settings = ExitStack()
        self._processes: set[int] = set()
        self._stopping = False

    def __enter__(self) -> Self:
        """Let no process have more than one thread."""
        self._settings.enter_context(single_threaded())
        return self

    def __exit__(self, *_: object) -> None:
        """Begin nothing more, and end what is still running."""
        self._stopping = True
        self._threads.shutdown(wait=False, cancel_futures=True)
        for process in list(self._processes):
            with suppress(ProcessLookupError):  # it has just ended by itself
                os.kill(process, signal.SIGTERM)
        self._threads.shutdown()
        self._settings.close()

    def submit(self, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """As `Engine.submit`."""
        return self._threads.submit(self._call, partial(function, *args, **kwargs))

    def _call(self, work: Callable[[], T]) -> T:
        """Call in a new process; twice, if the first one dies."""
        for _ in range(TRIES - 1):
            try:
                return self._call_once(work)
            except BrokenProcessPool:
                if self._stopping:
                    raise
        return self._call_once(work)

    def _call_once(self, work: Callable[[], T]) -> T:
        with ProcessPoolExecutor(1, self._context, _start_worker) as pool:
            process = pool.submit(os.getpid).result()
            self._processes.add(process)
            try:
                if self._stopping:
                    raise BrokenProcessPool("stopped")
                return pool.submit(work).result()
            finally:
                self._processes.discard(process)


def _ready_to_fork() -> BaseContext:
    """Each process is forked from one of a single thread that has imported what a run needs.

    On Linux; elsewhere it begins from nothing, since system libraries may not bear a fork. The
    environment of that process is the one at the first call of any engine.
    """
    if sys.platform != "linux":
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(list(NEEDED))
    return context


def _start_worker() -> None:
    """Prepare a worker; a keyboard's interrupt is for the process that started it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    prepare_worker()
