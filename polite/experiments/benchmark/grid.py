"""Which runs a benchmark consists of, in the order of their importance."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Final, Literal

from polite.experiments.benchmark.config import BenchmarkConfig
from polite.types import InvalidValueError, PoliteError


@dataclass(frozen=True)
class Run:
    """One training; everything that its numbers depend on."""

    env: str
    """Id of the env."""
    method: str
    """A key of `METHODS`, "pebble" or "polite-pebble"."""
    queries: int
    """The budget; 0 where nobody is asked."""
    loss: Literal["pairwise", "released"] | None
    """Preference loss, "pairwise" or "released"; None where nobody is asked."""
    highlights: str | None
    """Form of the highlight loss, "paper" or "choice"; None where the method uses none."""
    preset: str
    """Of the grid: "smoke", "fast" or "paper"."""
    steps: int
    """Policy steps."""
    variant: str = ""
    """"" or another way to train. "no-termination": the env ends no episode that has gone wrong.
    "shuffled": the highlights of a session are dealt out anew among its answers. "noisy": three in
    ten are missed, as many misplaced, and in one answer of ten good and bad are mixed up.
    "equal-updates": the reward model gets as many gradient updates after each session as with 200
    queries. "few-epochs": it is trained for an eighth of the release's epochs. "raised": what it
    pays is normalised over the clips so far and raised, so that steps two standard deviations below
    the average are paid nothing."""
    seed: int = 0
    """Everything random follows from it."""

    def __post_init__(self) -> None:
        """Check that nobody is asked without queries, or the other way round.

        Raises:
            InvalidValueError: with what was seen.
        """
        if (self.queries > 0) != (self.loss is not None) or min(self.queries, self.seed) < 0:
            raise InvalidValueError(f"expected queries with a loss, neither without, got {self}")

    @property
    def name(self) -> str:
        """Unique, and fit to name a file."""
        parts = [
            self.env,
            self.label,
            self.loss,
            self.highlights and f"{self.highlights}-highlights",
            self.variant,
            self.preset,
            str(self.steps),
            f"seed{self.seed}",
        ]
        return re.sub(r"[^A-Za-z0-9._-]", "-", "_".join(part for part in parts if part))

    @property
    def label(self) -> str:
        """The method and its budget, as "polite-200"."""
        return f"{self.method}-{self.queries}" if self.queries else self.method

    def as_dict(self) -> dict[str, Any]:
        """As it stands in the record."""
        return asdict(self)


@dataclass(frozen=True)
class Block:
    """Runs that are as important as each other: all of one seed before the next seed."""

    cells: tuple[Run, ...]
    """What is run, in this order, with seed 0."""
    seeds: Sequence[int]
    """With which seeds."""

    def runs(self) -> list[Run]:
        """All runs in their order."""
        return [replace(cell, seed=seed) for seed in self.seeds for cell in self.cells]


def grid(preset: str) -> list[list[Run]]:
    """The runs of each stage.

    Raises:
        PoliteError: if there is no such preset.
    """
    if preset not in GRIDS:
        raise PoliteError(f"expected a preset of {', '.join(GRIDS)}, got {preset}")
    return [[run for block in stage for run in block.runs()] for stage in GRIDS[preset]]


def planned(preset: str) -> list[Run]:
    """All runs of a grid, the most important first."""
    return [run for stage in grid(preset) for run in stage]


def select(config: BenchmarkConfig) -> list[Run]:
    """The runs that were asked for, in the grid's order.

    Raises:
        PoliteError: if a filter names what is not there, or the others have left nothing of it.
    """
    runs = [(number, run) for number, stage in enumerate(grid(config.preset), 1) for run in stage]
    for name, tags in _FILTERS.items():
        wanted = set(getattr(config, name))
        known = set().union(*(tags(*numbered) for numbered in runs))
        if not wanted <= known:
            raise PoliteError(f"{name}: expected some of {_listed(known)}; got {_listed(wanted)}")
        runs = [numbered for numbered in runs if not wanted or wanted & tags(*numbered)]
    return [run for _, run in runs]


_FILTERS: Final[Mapping[str, Callable[[int, Run], set[Any]]]] = {
    "stage": lambda number, run: {number},
    "env": lambda number, run: {run.env},
    "method": lambda number, run: {run.method, run.label},
    "seeds": lambda number, run: {run.seed},
    "highlights": lambda number, run: {run.highlights or "none"},
    "loss": lambda number, run: {run.loss or "none"},
    "variant": lambda number, run: {run.variant or "none"},
}
"""Each filter's name -> what a run of a stage answers to."""


def _listed(values: set[Any]) -> str:
    return ", ".join(map(str, sorted(values)))


WITH_HIGHLIGHTS: Final = ("polite", "highlights", "polite-pebble")
"""Methods that learn from highlights."""

BOTH: Final = ("Walker2d-v5", "HalfCheetah-v5")
"""The envs of the paper's Fig. 4."""


def _cell(
    method: str,
    queries: int = 0,
    *,
    envs: tuple[str, ...] = BOTH,
    preset: str = "fast",
    steps: int = 1_000_000,
    loss: Literal["pairwise", "released"] = "pairwise",
    form: str = "paper",
    variant: str = "",
) -> tuple[Run, ...]:
    """A run in each env; loss and form only where they mean something."""
    return tuple(
        Run(
            env=env,
            method=method,
            queries=queries,
            loss=loss if queries else None,
            highlights=form if method in WITH_HIGHLIGHTS else None,
            preset=preset,
            steps=steps,
            variant=variant,
        )
        for env in envs
    )


_SMOKE: Final[Mapping[str, Any]] = {
    "preset": "smoke",
    "steps": 6_144,
    "envs": ("Walker2d-v5",),
}
_FREE: Final[Mapping[str, Any]] = {"variant": "no-termination", "envs": ("Walker2d-v5",)}
"""Walker2d alone: HalfCheetah has no early end, so that nothing would change."""
_RAISED: Final[Mapping[str, Any]] = {"variant": "raised", "envs": ("Walker2d-v5",)}
"""Walker2d first: where no episode ends early, no level of r̂ is better than another."""
_RAISED_TOO: Final[Mapping[str, Any]] = {"variant": "raised", "envs": ("HalfCheetah-v5",)}

GRIDS: Final[Mapping[str, tuple[tuple[Block, ...], ...]]] = {
    "smoke": (
        (
            Block(
                cells=(
                    *_cell("ground-truth", **_SMOKE),
                    *_cell("untrained", **_SMOKE),
                    *_cell("polite", 20, **_SMOKE),
                    *_cell("polite", 20, form="choice", **_SMOKE),
                    *_cell("preferences", 20, **_SMOKE),
                    *_cell("highlights", 20, **_SMOKE),
                    *_cell("pebble", 20, preset="smoke", steps=1_500, envs=("Walker2d-v5",)),
                ),
                seeds=range(2),
            ),
        ),
    ),
    "fast": (
        (
            Block(
                cells=(
                    *_cell("ground-truth"),
                    *_cell("polite", 200),
                    *_cell("preferences", 800),
                    *_cell("polite", 200, form="choice"),
                    *_cell("preferences", 400),
                    *_cell("preferences", 200),
                    *_cell("polite", 400),
                    *_cell("untrained"),
                ),
                seeds=range(5),
            ),
        ),
        (
            Block(
                cells=(
                    *_cell("preferences", 262),
                    *_cell("polite", 200, form="choice", variant="shuffled"),
                    *_cell("preferences", 800, variant="equal-updates"),
                    *_cell("preferences", 262, variant="equal-updates"),
                    *_cell("polite", 200, form="choice", variant="few-epochs"),
                    *_cell("preferences", 262, variant="few-epochs"),
                    *_cell("preferences", 800, variant="few-epochs"),
                    *_cell("polite", 100, form="choice"),
                    *_cell("polite", 400, form="choice"),
                    *_cell("preferences", 525),
                    *_cell("polite", 200, loss="released"),
                    *_cell("preferences", 800, loss="released"),
                    *_cell("polite", 400, loss="released"),
                    *_cell("preferences", 400, loss="released"),
                ),
                seeds=range(5),
            ),
        ),
        (
            Block(
                cells=(
                    *_cell("highlights", 400),
                    *_cell("highlights", 400, form="choice"),
                    *_cell("highlights", 200, form="choice"),
                    *_cell("highlights", 200, form="choice", variant="noisy"),
                    *_cell("polite", 200, form="choice", variant="noisy"),
                    *_cell("highlights", 200, form="choice", **_RAISED),
                    *_cell("preferences", 800, **_RAISED),
                    *_cell("preferences", 262, **_RAISED),
                    *_cell("polite", 200, form="choice", **_RAISED),
                    *_cell("untrained", **_RAISED),
                    *_cell("ground-truth", **_FREE),
                    *_cell("polite", 200, **_FREE),
                    *_cell("polite", 200, form="choice", **_FREE),
                    *_cell("preferences", 800, **_FREE),
                ),
                seeds=range(5),
            ),
        ),
        (
            Block(
                cells=(
                    *_cell("pebble", 200, steps=250_000),
                    *_cell("pebble", 400, steps=250_000),
                ),
                seeds=range(3),
            ),
            Block(cells=_cell("polite", 100), seeds=range(5)),
        ),
        (
            Block(
                cells=(
                    *_cell("polite", 200),
                    *_cell("polite", 200, form="choice"),
                    *_cell("preferences", 262),
                    *_cell("preferences", 800),
                    *_cell("ground-truth"),
                ),
                seeds=range(5, 10),
            ),
            Block(  # ten seeds left this comparison undecided
                cells=(
                    *_cell("polite", 200, form="choice", envs=("Walker2d-v5",)),
                    *_cell("preferences", 262, envs=("Walker2d-v5",)),
                ),
                seeds=range(10, 20),
            ),
            Block(  # five seeds left what highlights say undecided on HalfCheetah
                cells=_cell(
                    "polite", 200, form="choice", variant="shuffled", envs=("HalfCheetah-v5",)
                ),
                seeds=range(5, 10),
            ),
            # Five seeds left the raised bar undecided at equal effort; the baseline spreads more.
            Block(cells=_cell("highlights", 200, form="choice", **_RAISED), seeds=range(5, 10)),
            Block(cells=_cell("preferences", 262, **_RAISED), seeds=range(5, 15)),
            Block(  # whether one way to train, the raised one, will do in both envs
                cells=(
                    *_cell("highlights", 200, form="choice", **_RAISED_TOO),
                    *_cell("preferences", 262, **_RAISED_TOO),
                    *_cell("preferences", 800, **_RAISED_TOO),
                ),
                seeds=range(5),
            ),
        ),
    ),
    "paper": (
        (
            Block(
                cells=(
                    *_cell("polite", 200, preset="paper"),
                    *_cell("preferences", 800, preset="paper"),
                    *_cell("polite", 200, preset="paper", loss="released"),
                    *_cell("preferences", 800, preset="paper", loss="released"),
                    *_cell("ground-truth", preset="paper"),
                    *_cell("untrained", preset="paper"),
                ),
                seeds=range(5),
            ),
        ),
    ),
}
"""Of each preset its stages, the most important first."""
