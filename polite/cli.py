"""The command `polite`."""

from __future__ import annotations

import sys
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro
from rich.console import Console

from polite.experiments.benchmark.config import BenchmarkConfig
from polite.experiments.new_study.config import NewStudyConfig
from polite.experiments.plan_config import PlanConfig
from polite.experiments.training.config import TrainConfig
from polite.study.commands import Export, Invite, Serve, Status, Withdraw, web_extra
from polite.types import PoliteError


@dataclass(frozen=True)
class Replicate:
    """Replicate the user study: clips, answers, rewards, policies.

    Simulated participants answer, or people did: in a study of `polite serve`, and --answers.

    Writes results.json, report.html, figures/, clips/, data/ and models/ into a folder.
    """

    out: Path
    """Folder for everything; new, unless --resume."""
    preset: Literal["smoke", "fast", "paper"] = "fast"
    """smoke: half a minute, to see that it runs; fast: a few minutes; paper: the one to cite."""
    seed: int = 0
    """Everything random follows from it."""
    resume: bool = False
    """Go on in a folder that was begun with the same preset and seed."""
    answers: Path | None = None
    """Folder of an export of a study with people: its answers in place of simulated ones."""

    def run(self) -> Path:
        """Run the study; returns the report's path."""
        from polite.experiments.replication.replicate import replicate

        return replicate(self.preset, self.seed, self.out, resume=self.resume, answers=self.answers)


@dataclass(frozen=True)
class Report:
    """Draw a run's figures and page again from its stored numbers."""

    folder: Annotated[Path, tyro.conf.Positional]
    """The folder of a replication, of a benchmark or of a comparison of highlights."""

    def run(self) -> Path:
        """Draw; returns the report's path."""
        from polite.experiments.benchmark.page import GRID, report_grid
        from polite.files import marks
        from polite.report.offline import BENCH, report_bench
        from polite.report.page import write_report

        held = marks(self.folder)
        if GRID in held:
            return report_grid(self.folder)
        if BENCH in held:
            return report_bench(self.folder)
        if {"env", "method"} <= held:
            raise PoliteError(
                f"{self.folder} is of `polite train`, which draws its learning curve itself; "
                "`polite watch` shows an episode"
            )
        return write_report(self.folder)


@dataclass(frozen=True)
class Map:
    """Draw where a reward model pays: along the corridor and on its floor."""

    model: Annotated[Path, tyro.conf.Positional]
    """A saved reward model (.pt)."""
    out: Path
    """The picture, .png or .pdf."""

    def run(self) -> Path:
        """Draw; returns the picture's path."""
        from polite.experiments.map import draw_map

        return draw_map(self.model, self.out)


@dataclass(frozen=True, kw_only=True)
class Train(TrainConfig):
    """Train a policy from the answers of a simulated teacher, by one of the methods.

    Writes results.json, models/, data/ and figures/ into a folder.
    """

    def __post_init__(self) -> None:
        """Check nothing yet: tyro would show a mistake in a box of its own."""

    def run(self) -> Path:
        """Train; returns the path of the results."""
        from polite.experiments.training.train import run_train

        return run_train(TrainConfig(**vars(self)))


@dataclass(frozen=True)
class Watch:
    """Watch a trained policy: an episode, and under its frames what every step paid.

    Beside the true reward stands r̂, where a reward model paid the policy. Any env will do that
    makes pictures (render_mode="rgb_array"); one that cannot go back to a recorded state plays the
    episode once more, which has to follow from its seed.
    """

    folder: Annotated[Path, tyro.conf.Positional]
    """Folder of `polite train`, or models/RUN in the folder of `polite benchmark`."""
    out: Path | None = None
    """A clip in real time (.webp, .gif; .mp4 with the extra `video`), or a picture of some frames
    (.png, .pdf); episode_SEED.webp beside the models if not given."""
    seed: int = 0
    """Which episode."""

    def run(self) -> Path:
        """Draw; returns the path of the clip or picture."""
        from polite.experiments.watch import watch

        return watch(self.folder, self.out, self.seed)


@dataclass(frozen=True, kw_only=True)
class Benchmark(BenchmarkConfig):
    """Run a grid of trainings: envs, methods, budgets, losses and seeds, each in its own process.

    Writes a record for each finished run, and from all of them results.json, figures/ and
    report.html. A folder can be given further parts of the same preset's grid later.
    """

    def __post_init__(self) -> None:
        """Check nothing yet: tyro would show a mistake in a box of its own."""

    def run(self) -> Path:
        """Run the grid; returns the path of its report."""
        from polite.experiments.benchmark.execution import benchmark

        return benchmark(BenchmarkConfig(**vars(self)))


@dataclass(frozen=True)
class Highlights:
    """Compare forms of the highlight loss offline: fixed segments, held-out pairs, many seeds.

    Writes results.json, table.md, report.html and figures/ into a folder.
    """

    out: Path
    """Folder for everything; new, unless --resume."""
    preset: Literal["smoke", "full"] = "full"
    """smoke: three candidates in two envs, a minute; full: all of them in three envs, an hour."""
    seed: int = 0
    """Everything random follows from it."""
    resume: bool = False
    """Go on in a folder that was begun with the same preset and seed."""

    def run(self) -> Path:
        """Compare; returns the report's path."""
        from polite.experiments.offline.bench import compare

        return compare(self.preset, self.seed, self.out, resume=self.resume)


@dataclass(frozen=True, kw_only=True)
class Plan(PlanConfig):
    """Plan a study with people: how many queries, participants and hours it takes."""

    def run(self) -> str:
        """Plan; returns what to print."""
        from polite.experiments.plan import run_plan

        return run_plan(PlanConfig(**vars(self)))


@dataclass(frozen=True, kw_only=True)
class New(NewStudyConfig):
    """Make the folder of a study with people: clips, comparisons, texts.

    Without --pool and --env it is the demo, in which a robot drives past people in a corridor.
    """

    def run(self) -> str:
        """Make it; returns what to do next."""
        with web_extra():
            from polite.experiments.new_study.folder import describe, new_study

        return describe(new_study(NewStudyConfig(**vars(self))))


StudyCommand = (
    Annotated[New, tyro.conf.subcommand("new")]
    | Annotated[Status, tyro.conf.subcommand("status")]
    | Annotated[Invite, tyro.conf.subcommand("invite")]
    | Annotated[Export, tyro.conf.subcommand("export")]
    | Annotated[Withdraw, tyro.conf.subcommand("withdraw")]
)


@dataclass(frozen=True)
class Study:
    """A study with people: invite, see how it stands, export. `polite serve` serves its pages."""

    command: tyro.conf.OmitSubcommandPrefixes[StudyCommand]
    """What to do."""

    def run(self) -> Path | str:
        """Do it; returns what to print."""
        return self.command.run()


Command = (
    Annotated[Replicate, tyro.conf.subcommand("replicate")]
    | Annotated[Train, tyro.conf.subcommand("train")]
    | Annotated[Watch, tyro.conf.subcommand("watch")]
    | Annotated[Benchmark, tyro.conf.subcommand("benchmark")]
    | Annotated[Highlights, tyro.conf.subcommand("highlights")]
    | Annotated[Plan, tyro.conf.subcommand("plan")]
    | Annotated[Study, tyro.conf.subcommand("study")]
    | Annotated[Serve, tyro.conf.subcommand("serve")]
    | Annotated[Map, tyro.conf.subcommand("map")]
    | Annotated[Report, tyro.conf.subcommand("report")]
)


def main() -> None:
    """Run the command line; a user's mistake is one line and exit code 2."""
    with suppress(OSError):  # the folder may be gone
        sys.path.append(str(Path.cwd()))  # as `python -m polite` has it: --env MODULE:ID
    command: Command | None = None
    try:
        command = tyro.cli(Command, prog="polite", description="Rewards learned from people.")
        outcome = command.run()
    except PoliteError as error:
        Console(stderr=True, soft_wrap=True).print(f"polite: {error}", markup=False)
        sys.exit(2)
    except KeyboardInterrupt:
        what = command.command if isinstance(command, Study) else command
        resumes = isinstance(what, Replicate | Train | Benchmark | Highlights | New)
        hint = "; go on with --resume" if resumes else ""
        Console(stderr=True).print(f"polite: stopped{hint}")
        sys.exit(130)
    Console(soft_wrap=True).print(f"{outcome}", markup=False, highlight=False)
