"""What a running run says of itself: a small file beside its record, and how its time was spent."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from polite.experiments.benchmark.grid import Run
from polite.experiments.benchmark.record import curve_of
from polite.files import read_json_object, write_json
from polite.types import PoliteError

EVERY = 3.0
"""Seconds between two writings, at least."""


def live_folder(folder: Path) -> Path:
    """Where all running runs of a grid say how far they are."""
    return folder / "live"


def live_path(folder: Path, run: Run) -> Path:
    """Where a running run says how far it is."""
    return live_folder(folder) / f"{run.name}.json"


def read_live(folder: Path, run: Run) -> dict[str, Any] | None:
    """What a running run said last; None if it is not running or has said nothing yet."""
    try:
        return read_json_object(live_path(folder, run), "ignore it")
    except PoliteError:
        return None


class Live:
    """Writes how far a run is, and adds up the seconds that each of its parts took."""

    def __init__(self, folder: Path, run: Run) -> None:
        """Begin.

        Args:
            folder: the grid's; where a node of a cluster does not have it, nothing is written.
            run: what is running.
        """
        self._path, self._run = live_path(folder, run), run
        self._begun = self._since = time.monotonic()
        self._says, self._share = "beginning", 0.0
        self._episodes: Sequence[Mapping[str, float]] = ()
        self._written = -EVERY
        self.parts: dict[str, float] = {}

    def follow(self, episodes: Sequence[Mapping[str, float]]) -> None:
        """Take note of the training's finished episodes."""
        self._episodes = episodes

    def report(self, says: str, share: float) -> None:
        """Take note of what is being done and how far the policy's training is, in [0, 1]."""
        now = time.monotonic()
        part = self._says.rpartition(": ")[2].partition(",")[0]
        self.parts[part] = self.parts.get(part, 0.0) + now - self._since
        self._since, self._says, self._share = now, says, share
        if now - self._written >= EVERY:
            self._write(now)
            self._written = now

    @property
    def seconds(self) -> float:
        """Since the beginning."""
        return time.monotonic() - self._begun

    def _write(self, now: float) -> None:
        if not self._path.parent.is_dir():
            return
        content = {
            "says": self._says,
            "share": self._share,
            "seconds": now - self._begun,
            "process": os.getpid(),
            "curve": curve_of(self._episodes, self._run.steps),
        }
        with suppress(PoliteError):  # a full disk for a moment is no reason to lose hours
            write_json(self._path, content)
