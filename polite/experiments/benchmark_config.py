"""The settings of `polite benchmark`; the command line is made from them. Imports nothing heavy."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from polite.types import InvalidValueError

Preset = Literal["smoke", "fast", "paper"]


@dataclass(frozen=True, kw_only=True)
class BenchmarkConfig:
    """Run a grid of trainings: envs, methods, budgets, losses and seeds, each in its own process.

    Writes a record for each finished run, and from all of them results.json, figures/ and
    report.html. A folder can be given further parts of the same preset's grid later.
    """

    out: Path
    """Folder for everything; new, unless --resume."""
    preset: Preset = "fast"
    """smoke: two minutes, to see that it runs; fast: days on two cores; paper: the paper's own nets
    and PPO for the two cells that its claim compares."""
    env: tuple[str, ...] = ()
    """Only these envs."""
    method: tuple[str, ...] = ()
    """Only these methods; with a budget, as in polite-200, only that one."""
    seeds: tuple[int, ...] = ()
    """Only these seeds."""
    stage: tuple[int, ...] = ()
    """Only these stages of the grid, the first is 1."""
    highlights: tuple[str, ...] = ()
    """Only these forms of the highlight loss: paper, choice; none for runs without highlights."""
    loss: tuple[str, ...] = ()
    """Only these preference losses: pairwise, released; none for runs without answers."""
    jobs: int = 0
    """Runs at a time, one core each; 0 for as many as there are cores. Ray counts its own."""
    engine: Literal["local", "ray"] = "local"
    """Processes of this machine, or a Ray cluster (extra `ray`). Ray's nodes need this package;
    records and models come back from anywhere, but what running runs say, and the checkpoints of
    PEBBLE, need a file system that all nodes share."""
    address: str = "auto"
    """Of the Ray cluster: host:port, or auto for the one that this machine belongs to."""
    tensorboard: bool = False
    """Also write the curves for TensorBoard (extra `tensorboard`), into tensorboard/."""
    status: bool = False
    """Only say how far the grid in the folder is; may be asked while it runs."""
    resume: bool = False
    """Go on in a folder of the same preset; finished runs are not repeated."""

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            InvalidValueError: naming the one that is out of its range.
        """
        for name, values in (("jobs", (self.jobs,)), ("seeds", self.seeds)):
            if min(values, default=0) < 0:
                raise InvalidValueError(f"{name}: expected at least 0, got {values}")
