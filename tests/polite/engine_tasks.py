"""What engines are asked to call in their tests: importable, and nothing heavy with it."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path


def where(number: int) -> tuple[int, int, str]:
    """The number, this process, and how many threads it is allowed."""
    return number, os.getpid(), os.environ["OMP_NUM_THREADS"]


def loaded(names: Sequence[str]) -> list[bool]:
    """Whether modules are there that this one does not import."""
    return [name in sys.modules for name in names]


def die(tries: Path, times: int) -> int:
    """Be killed so many times; returns how often it was called."""
    count = len(tries.read_text()) if tries.exists() else 0
    tries.write_text("x" * (count + 1))
    if count < times:
        os.kill(os.getpid(), signal.SIGKILL)
    return count + 1


def wait_for_ever(started: Path) -> None:
    """Say that it has begun, by a file that is whole once it is there, and never end."""
    unfinished = started.with_suffix(".unfinished")
    unfinished.write_text(str(os.getpid()))
    unfinished.rename(started)
    signal.pause()
