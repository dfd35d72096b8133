"""The settings of `polite benchmark`; the command line is made from them. Imports nothing heavy."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from polite.types import InvalidValueError

Preset = Literal["smoke", "fast", "paper"]
_ALL = tyro.conf.arg(help_behavior_hint="(default: all)")
Names = Annotated[tuple[str, ...], _ALL]
Numbers = Annotated[tuple[int, ...], _ALL]


@dataclass(frozen=True, kw_only=True)
class BenchmarkConfig:
    """Run a grid of trainings: envs, methods, budgets, losses and seeds, each in its own process.

    Writes a record for each finished run, and from all of them results.json, figures/ and
    report.html. A folder can be given further parts of the same preset's grid later.
    """

    out: Path
    """Folder for everything; new, unless --resume."""
    preset: Preset = "fast"
    """smoke: one or two minutes, to see that it runs; fast: a day on two cores, and PEBBLE's
    hours; paper: the paper's own nets and PPO for the cells that its first claim compares, under
    both losses, with floor and ceiling. With --status the folder's own."""
    env: Names = ()
    """Only these envs: Walker2d-v5, HalfCheetah-v5; smoke has the first."""
    method: Names = ()
    """Only these methods: ground-truth, untrained, polite, preferences, highlights, pebble; with a
    budget, as in polite-200, only that one."""
    seeds: Numbers = ()
    """Only these seeds."""
    stage: Numbers = ()
    """Only these stages of the grid, the most important first; smoke and paper have one. Of fast:
    1: pairwise loss: POLITE and baseline with 200 to 800 queries, our form, floor and ceiling
    2: equal effort (262, 525), our form with 100 and 400, the released loss; controls of the bar
    with shuffled highlights, with equal updates of the reward model and with few epochs of it
    3: highlights alone, careless ones too; another level of the reward model on Walker2d, and
    Walker2d without its early end
    4: PEBBLE, and POLITE with 100
    5: five more seeds of the headline, on Walker2d ten more of POLITE-200 and baseline-262, on
    HalfCheetah five more with shuffled highlights; with the reward model raised more seeds on
    Walker2d, and HalfCheetah"""
    highlights: Names = ()
    """Only these forms of the highlight loss: paper, choice; none for runs without highlights."""
    loss: Names = ()
    """Only these preference losses: pairwise, released; none for runs without answers."""
    variant: Names = ()
    """Only these variants: no-termination (Walker2d without its early end), shuffled (highlights
    dealt out anew among the answers of a session), noisy (some missed, some misplaced, some good
    and bad mixed up), equal-updates (the reward model is updated as often as with 200 queries),
    few-epochs (it is trained for an eighth of the released epochs), raised (what it pays is
    normalised, and raised by 2); none for runs that are none of these."""
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
    """Go on in a folder of the same preset; finished runs are not repeated, unless their settings
    have changed since."""

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            InvalidValueError: naming the one that is out of its range.
        """
        for name, values in (("jobs", (self.jobs,)), ("seeds", self.seeds)):
            if min(values, default=0) < 0:
                raise InvalidValueError(f"{name}: expected at least 0, got {values}")
