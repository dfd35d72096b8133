"""The curves of a grid for TensorBoard (extra `tensorboard`), a folder for each run."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path

from torch.utils.tensorboard import SummaryWriter

from polite.experiments.benchmark.grid import Run
from polite.experiments.benchmark.record import Record, read_record
from polite.experiments.benchmark.status import GridStatus

SHOWN = {"return": "true return", "length": "episode length"}
"""Columns of a curve and what they are called."""
WHOLE = "whole"
"""A file beside a curve that has been written to its end, and not followed in part only."""


class TensorBoard(AbstractContextManager["TensorBoard"]):
    """Writes what is new in the curves of running and finished runs."""

    def __init__(self, folder: Path, runs: Sequence[Run]) -> None:
        """Write the curves of finished runs that are not there in whole, and begin the others anew.

        Args:
            folder: the grid's.
            runs: those asked for.
        """
        self._folder = folder / "tensorboard"
        self._writers: dict[Run, SummaryWriter] = {}
        self._points: dict[Run, int] = {}
        for run in runs:
            record = read_record(folder, run)
            if record is not None and (self._folder / run.name / WHOLE).exists():
                continue
            shutil.rmtree(self._folder / run.name, ignore_errors=True)
            if record is not None:
                self.finish(run, record)

    def __exit__(self, *_: object) -> None:
        """Close the files."""
        for writer in self._writers.values():
            writer.close()

    def follow(self, now: GridStatus) -> None:
        """Write what running runs have added to their curves; the last point may still change."""
        for item in now.running:
            self._write(item.run, item.curve, len(item.curve["steps"]) - 1)

    def finish(self, run: Run, record: Record) -> None:
        """Write the rest of a run's curve, and how its policy was judged."""
        writer = self._write(run, record["curve"], len(record["curve"]["steps"]))
        writer.add_scalar(
            "return of the finished policy", record["evaluation"]["return"], record["policy_steps"]
        )
        self._writers.pop(run).close()
        (self._folder / run.name / WHOLE).touch()

    def _write(self, run: Run, curve: dict[str, list[float]], count: int) -> SummaryWriter:
        """Write the points up to this one that are not written yet."""
        if run not in self._writers:
            self._writers[run] = SummaryWriter(str(self._folder / run.name))
        writer = self._writers[run]
        for point in range(self._points.get(run, 0), count):
            for column, shown in SHOWN.items():
                writer.add_scalar(shown, curve[column][point], round(curve["steps"][point]))
        self._points[run] = max(count, self._points.get(run, 0))
        return writer
