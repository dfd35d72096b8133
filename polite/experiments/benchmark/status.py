"""How far a grid is, read from its folder: works from within and beside a running grid."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from polite.experiments.benchmark.grid import Run
from polite.experiments.benchmark.live import live_path, read_live
from polite.experiments.benchmark.record import is_damaged, read_record
from polite.experiments.workers import cores
from polite.files import read_json_object
from polite.types import PoliteError


@dataclass(frozen=True)
class Running:
    """A run that is being done."""

    run: Run
    """Which."""
    says: str
    """What it does."""
    share: float
    """How much of its training is done, in [0, 1]."""
    seconds: float
    """Since it was begun."""
    silent: float
    """Seconds since it said so: more than minutes if the grid was killed."""
    curve: dict[str, list[float]]
    """Of its finished episodes so far."""

    @property
    def last_return(self) -> float | None:
        """True return of its last finished episodes."""
        return self.curve["return"][-1] if self.curve["return"] else None


@dataclass(frozen=True)
class GridStatus:
    """How far a grid is."""

    total: int
    """Runs asked for."""
    done: int
    """Of them, those that have a record."""
    failed: tuple[Run, ...]
    """Those that were tried and have none."""
    running: tuple[Running, ...]
    """Those that are being done."""
    damaged: tuple[Run, ...]
    """Those whose record is none; they wait for their turn, too."""
    left: int
    """Those that wait for their turn."""
    seconds_left: float | None
    """Until all are done; None as long as no run has been finished."""


def times_path(folder: Path, run: Run) -> Path:
    """Where the seconds are kept that a run took."""
    return folder / "times" / f"{run.name}.json"


def failure_path(folder: Path, run: Run) -> Path:
    """Where it says why a run failed."""
    return folder / "failed" / f"{run.name}.txt"


def grid_status(folder: Path, runs: Sequence[Run]) -> GridStatus:
    """Read how far the runs are.

    Args:
        folder: the grid's.
        runs: those asked for.
    """
    open_runs = [run for run in runs if read_record(folder, run) is None]
    failed = tuple(run for run in open_runs if failure_path(folder, run).exists())
    told = {run: read_live(folder, run) for run in open_runs if run not in failed}
    running = tuple(_running(folder, run, content) for run, content in told.items() if content)
    waiting = [run for run, content in told.items() if not content]
    return GridStatus(
        total=len(runs),
        done=len(runs) - len(open_runs),
        failed=failed,
        running=running,
        damaged=tuple(run for run in open_runs if is_damaged(folder, run)),
        left=len(waiting),
        seconds_left=_seconds_left(_seconds_taken(folder, runs), running, waiting),
    )


def _running(folder: Path, run: Run, content: dict[str, Any]) -> Running:
    now = time.time()
    try:
        written = live_path(folder, run).stat().st_mtime
    except FileNotFoundError:  # it has just ended
        written = now
    return Running(
        run=run,
        says=content["says"],
        share=content["share"],
        seconds=content["seconds"],
        silent=now - written,
        curve=content["curve"],
    )


def _seconds_taken(folder: Path, runs: Iterable[Run]) -> dict[Run, float]:
    """Of the finished runs."""
    taken = {}
    for run in runs:
        try:
            taken[run] = float(read_json_object(times_path(folder, run), "ignore it")["total"])
        except (PoliteError, KeyError):
            continue
    return taken


def _seconds_left(
    taken: dict[Run, float], running: Sequence[Running], waiting: Sequence[Run]
) -> float | None:
    """From what runs of the same cell took; else of the same method and env; else of any."""
    if not taken:
        return None
    cells: dict[object, list[float]] = {}
    for run, seconds in taken.items():
        for key in _keys(run):
            cells.setdefault(key, []).append(seconds)

    def expected(run: Run) -> float:
        known = next(cells[key] for key in _keys(run) if key in cells)
        return sum(known) / len(known)

    work = sum(expected(run) for run in waiting)
    work += sum(max(0.0, expected(item.run) - item.seconds) for item in running)
    return work / max(1, len(running) or cores())


def _keys(run: Run) -> tuple[object, ...]:
    """What a run has in common with others, the closest first."""
    return replace(run, seed=0), (run.method, run.env), run.method, None
