"""A grid of runs, from its settings to its report."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from polite.experiments.benchmark.board import Board, view
from polite.experiments.benchmark.config import BenchmarkConfig
from polite.experiments.benchmark.engines import Engine, LocalEngine
from polite.experiments.benchmark.grid import Run, select
from polite.experiments.benchmark.live import live_folder, live_path
from polite.experiments.benchmark.page import identity, preset_in, report_grid
from polite.experiments.benchmark.record import made_otherwise, read_record, record_path
from polite.experiments.benchmark.run import Outcome, carry_out, checkpoint_path
from polite.experiments.benchmark.status import GridStatus, failure_path, grid_status, times_path
from polite.experiments.run_folder import is_left, sole_run
from polite.experiments.workers import cores
from polite.files import one_line, write_atomically, write_json
from polite.types import PoliteError

if TYPE_CHECKING:
    from polite.experiments.benchmark.tensorboard import TensorBoard

BUSY = (
    "another `polite benchmark` (process {process}) works in {folder}; wait for it, or ask with "
    "--status how far it is"
)
UPDATE_EVERY = 2.0
"""Seconds between two looks at the running runs."""


def benchmark(config: BenchmarkConfig) -> Path:
    """Run what is not done yet of the part of the grid that was asked for.

    Returns:
        The path of what can be looked at.

    Raises:
        PoliteError: if nothing is asked for, the folder is another's or another process works in
            it, or runs failed.
    """
    if config.status:
        return show_status(config)
    runs = select(config)
    engine = engine_of(config)  # before the folder is made: there may be none
    with sole_run(config.out, identity(config.preset), config.resume, BUSY):
        with log_of(config, runs) as log, engine as workers:
            failures = run_grid(config.out, runs, workers, log)
        page = report_grid(config.out)
    if failures:
        raise PoliteError(
            f"{len(failures)} of {len(runs)} runs failed, see {config.out / 'failed'}; --resume "
            "tries them again"
        )
    return page


def engine_of(config: BenchmarkConfig) -> AbstractContextManager[Engine]:
    """The engine that was asked for.

    Raises:
        PoliteError: if it is not installed, or there is no cluster at the address.
    """
    if config.engine == "local":
        return LocalEngine(config.jobs or cores())
    try:
        from polite.experiments.benchmark.ray_engine import RayEngine
    except ModuleNotFoundError as error:
        raise PoliteError("--engine ray needs Ray: pip install 'socialnav-polite[ray]'") from error
    return RayEngine(config.address)


def log_of(
    config: BenchmarkConfig, runs: Sequence[Run]
) -> AbstractContextManager[TensorBoard | None]:
    """Who is told the curves beside the records, if that was asked for."""
    if not config.tensorboard:
        return nullcontext()
    try:
        from polite.experiments.benchmark.tensorboard import TensorBoard
    except ModuleNotFoundError as error:
        raise PoliteError(
            "--tensorboard needs it: pip install 'socialnav-polite[tensorboard]'"
        ) from error
    return TensorBoard(config.out, runs)


def show_status(config: BenchmarkConfig) -> Path:
    """Print how far a grid is, of whichever preset; nothing is changed.

    Raises:
        PoliteError: if the folder holds no grid, or nothing of it is asked for.
    """
    preset: Any = preset_in(config.out)
    runs = select(replace(config, preset=preset))
    now, console = grid_status(config.out, runs), Console(soft_wrap=True)
    console.print(view(now))
    if now.done < now.total and is_left(config.out):
        console.print("no process works on it; go on with --resume", highlight=False)
    return config.out


def run_grid(
    folder: Path, runs: Sequence[Run], engine: Engine, log: TensorBoard | None = None
) -> Mapping[Run, str]:
    """Run those that have no record yet, and keep what comes back.

    Only this process writes records, one for each run, wherever it was done.

    Args:
        folder: the grid's.
        runs: what to do, in this order.
        engine: does it.
        log: is told the curves.

    Returns:
        The failed runs, and why.
    """
    left = [run for run in runs if read_record(folder, run) is None]
    console = Console(stderr=True, soft_wrap=True, highlight=False)
    others = sum(made_otherwise(folder, run) for run in left)
    if others:
        console.print(f"{others} finished runs were made with other settings and are repeated")
    _clear(folder, left)
    futures = {engine.submit(carry_out, run, folder.absolute()): run for run in left}
    waiting, failures = dict[Run, Outcome](), dict[Run, str]()

    def look() -> GridStatus:
        now = grid_status(folder, runs)
        if log is not None:
            log.follow(now)
        return now

    with Board(look, console) as board:
        for future in _finished(futures, board.update):
            waiting[futures[future]] = _outcome(future, engine)
            for run, outcome, failure in _kept(folder, waiting):
                if failure is not None:
                    failures[run] = failure
                    console.print(f"failed: {run.name}: {failure}", markup=False)
                    continue
                failures.pop(run, None)
                if log is not None and outcome.record is not None:
                    log.finish(run, outcome.record)
    return failures


def _kept(folder: Path, waiting: dict[Run, Outcome]) -> Iterator[tuple[Run, Outcome, str | None]]:
    """Write down what came back, and say of each whether it failed.

    What cannot be written, as on a full disk, goes on waiting, and is tried again with the next
    one: the other runs go on, and hours are not lost for a moment.
    """
    for run, outcome in list(waiting.items()):
        try:
            _keep(folder, run, outcome)
        except PoliteError as error:
            yield run, outcome, str(error)
        else:
            del waiting[run]
            yield run, outcome, outcome.failure if outcome.record is None else None


def _clear(folder: Path, left: Sequence[Run]) -> None:
    """Remove what these runs left when they failed, and what any runs said when they were killed.

    Nothing runs in the folder yet. A record that other settings made stays until its run has
    another: days of work are not thrown away by a `--resume` that is stopped again at once.
    """
    told = live_folder(folder)
    told.mkdir(parents=True, exist_ok=True)
    for path in told.iterdir():
        path.unlink(missing_ok=True)
    for run in left:
        failure_path(folder, run).unlink(missing_ok=True)


def _finished(
    futures: Mapping[Future[Outcome], Run], update: Callable[[], None]
) -> Iterator[Future[Outcome]]:
    """The futures as they are done; meanwhile `update` is called every now and then."""
    open_futures = set(futures)
    while open_futures:
        update()
        done, open_futures = wait(open_futures, UPDATE_EVERY, FIRST_COMPLETED)
        yield from done


def _outcome(future: Future[Outcome], engine: Engine) -> Outcome:
    """A run's outcome; that its process died, or could not be begun, is one too."""
    try:
        return future.result()
    except Exception as error:
        reason = f"{type(error).__name__}: {one_line(error)}"
        if isinstance(error, engine.deaths):
            reason = f"its process died, as when memory runs out ({one_line(error)})"
        return Outcome(None, {}, {}, failure=reason, details=traceback.format_exc())


def _keep(folder: Path, run: Run, outcome: Outcome) -> None:
    """Write down what came back, the record last."""
    if outcome.record is None:
        text = f"{outcome.failure}\n\n{outcome.details}"
        write_atomically(failure_path(folder, run), lambda path: path.write_text(text, "utf-8"))
    else:
        for name, content in outcome.models.items():
            write_atomically(folder / "models" / run.name / name, _writer(content))
        times = {**outcome.seconds, "machine": outcome.machine}
        write_json(times_path(folder, run), times)
        write_json(record_path(folder, run), outcome.record)
        checkpoint_path(folder, run).unlink(missing_ok=True)
    live_path(folder, run).unlink(missing_ok=True)


def _writer(content: bytes) -> Callable[[Path], int]:
    return lambda path: path.write_bytes(content)
