"""A grid as a whole: failures, what is shown of it, and what becomes of its folder."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from importlib.metadata import version
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from polite.dataset import Feedback
from polite.experiments.benchmark import board, execution, settings
from polite.experiments.benchmark import run as run_module
from polite.experiments.benchmark.board import Board, summary_line, view
from polite.experiments.benchmark.config import BenchmarkConfig
from polite.experiments.benchmark.execution import benchmark, run_grid
from polite.experiments.benchmark.grid import Run, planned
from polite.experiments.benchmark.live import Live, live_path
from polite.experiments.benchmark.machine import machine
from polite.experiments.benchmark.page import GRID, identity, report_grid
from polite.experiments.benchmark.record import (
    KEYS,
    answers_part,
    curve_of,
    final_return,
    highlighted_reward,
    made_otherwise,
    read_record,
    read_records,
    record_path,
)
from polite.experiments.benchmark.run import Outcome, carry_out
from polite.experiments.benchmark.settings import (
    canonical,
    env_preset,
    fingerprint,
    learning_config,
    pebble_settings,
)
from polite.experiments.benchmark.status import failure_path, grid_status, times_path
from polite.experiments.benchmark.tensorboard import TensorBoard
from polite.experiments.run_folder import claim_folder, is_left, sole_run
from polite.files import marks, write_json
from polite.methods.presets import PRESETS
from polite.methods.schedules import EqualUpdates, Schedule
from polite.teachers.noise import HighlightNoise
from polite.types import (
    FIRST,
    SECOND,
    UNRELATED,
    Answer,
    Highlight,
    InvalidValueError,
    PoliteError,
    Query,
    Segment,
    SegmentPool,
)

FIRST_RUN = Run("Walker2d-v5", "polite", 200, "pairwise", "paper", "fast", 1000)
RUNS = [replace(FIRST_RUN, seed=seed) for seed in range(4)]
EPISODES = [{"step": s, "return": r, "length": 5.0} for s, r in ((50.0, 1.0), (95.0, 3.0))]


def record_of(run: Run) -> dict[str, Any]:
    rest: dict[str, Any] = dict.fromkeys(KEYS)
    return rest | {"run": run.as_dict(), "settings": fingerprint(run)}


def outcome_of(run: Run, _: Path) -> Outcome:
    """A run that takes no time; seed 1 fails."""
    if run.seed == 1:
        return Outcome(None, {}, {}, failure="it did not work", details="line 1\nline 2")
    return Outcome(record_of(run), {"policy.pt": b"weights"}, {"total": 10.0 + run.seed})


class Here:
    """An engine that calls at once; the process of the run with seed 2 dies."""

    deaths: tuple[type[Exception], ...] = (BrokenProcessPool,)

    def __init__(self) -> None:
        self.runs: list[Run] = []

    def submit(self, _: Callable[..., Any], run: Run, folder: Path) -> Future[Any]:
        future: Future[Any] = Future()
        self.runs.append(run)
        if run.seed == 2:
            future.set_exception(BrokenProcessPool("terminated abruptly"))
        else:
            future.set_result(outcome_of(run, folder))
        return future


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    claim_folder(tmp_path / "run", identity("fast"), False)
    return tmp_path / "run"


def test_a_failing_run_and_a_dead_process_stop_no_other(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    failures = run_grid(folder, RUNS, Here())
    assert set(failures) == {RUNS[1], RUNS[2]}
    assert read_records(folder, RUNS) == [record_of(RUNS[0]), record_of(RUNS[3])]
    assert failure_path(folder, RUNS[1]).read_text() == "it did not work\n\nline 1\nline 2"
    assert "memory" in failure_path(folder, RUNS[2]).read_text()
    assert (folder / "models" / RUNS[0].name / "policy.pt").read_bytes() == b"weights"
    told = capsys.readouterr().err
    assert f"failed: {RUNS[1].name}: it did not work" in told
    assert "2 of 4 runs done, 0 running, 0 left, 2 failed" in told


@pytest.mark.parametrize("times", [1, 99])
def test_a_record_that_cannot_be_written_stops_no_other_run_and_is_tried_again(
    folder: Path, monkeypatch: pytest.MonkeyPatch, times: int
) -> None:
    refused: list[Path] = []

    def full_disk(path: Path, content: object) -> None:
        if path.parent.name == "runs" and path in (refused or [path]) and len(refused) < times:
            refused.append(path)
            raise PoliteError(f"{path}: cannot be written (No space left on device)")
        write_json(path, content)

    monkeypatch.setattr(execution, "write_json", full_disk)
    runs = [RUNS[0], RUNS[3], replace(FIRST_RUN, seed=4)]
    failures = run_grid(folder, runs, Here())
    written = {run for run in runs if read_record(folder, run) is not None}
    if times == 1:
        assert not failures and written == set(runs)
    else:
        (failed,) = set(runs) - written
        assert failures.keys() == {failed} and "No space left" in failures[failed]


def test_only_what_has_no_sound_record_is_run_again(folder: Path) -> None:
    run_grid(folder, RUNS, Here())
    record_path(folder, RUNS[3]).write_text("{")
    write_json(record_path(folder, RUNS[0]), record_of(RUNS[1]))
    other = record_path(folder, replace(FIRST_RUN, seed=9))
    write_json(other, {"kept": True})
    write_json(live_path(folder, RUNS[0]), {"left": "by a run that was killed"})
    again = Here()
    assert set(run_grid(folder, RUNS, again)) == {RUNS[1], RUNS[2]}
    assert again.runs == RUNS
    last = Here()
    run_grid(folder, RUNS, last)
    assert last.runs == RUNS[1:3]
    assert read_record(folder, RUNS[3]) == record_of(RUNS[3])
    assert json.loads(other.read_text()) == {"kept": True}
    assert not any((folder / "live").iterdir())


def test_a_killed_run_that_is_not_asked_for_again_no_longer_counts_as_running(folder: Path) -> None:
    killed = replace(FIRST_RUN, seed=9)
    said = {"says": "", "share": 0, "seconds": 0, "curve": {"return": []}}
    write_json(live_path(folder, killed), said)
    assert len(grid_status(folder, [killed]).running) == 1
    run_grid(folder, RUNS[:1], Here())
    assert not grid_status(folder, [killed]).running


def test_an_error_within_a_run_is_its_outcome(tmp_path: Path) -> None:
    outcome = carry_out(replace(FIRST_RUN, variant="on-the-moon"), tmp_path)
    assert outcome.record is None
    assert outcome.failure is not None and "on-the-moon" in outcome.failure
    assert "Traceback" in outcome.details


def test_an_error_that_is_no_death_is_said_as_it_is(folder: Path) -> None:
    class Refuses(Here):
        def submit(self, _: Callable[..., Any], run: Run, folder: Path) -> Future[Any]:
            future: Future[Any] = Future()
            future.set_exception(KeyError("a result that cannot be read"))
            return future

    failures = run_grid(folder, RUNS[:1], Refuses())
    assert failures == {RUNS[0]: "KeyError: 'a result that cannot be read'"}
    assert "died" not in failure_path(folder, RUNS[0]).read_text()
    assert "Traceback" in failure_path(folder, RUNS[0]).read_text()


def test_a_live_file_that_cannot_be_written_does_not_stop_its_run(folder: Path) -> None:
    (folder / "live").mkdir()
    live_path(folder, FIRST_RUN).mkdir()  # so that no file can take its place
    live = Live(folder, FIRST_RUN)
    live.report("training the policy", 0.5)
    live.report("done", 1.0)
    assert live.parts.keys() == {"beginning", "training the policy"}
    assert live_path(folder, FIRST_RUN).is_dir()


def test_a_record_that_json_cannot_hold_is_its_own_runs_failure(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spoiled = {**record_of(FIRST_RUN), "final_return": float("nan")}
    monkeypatch.setattr(run_module, "_carry_out", lambda *_: (spoiled, {}))
    outcome = carry_out(FIRST_RUN, folder)
    assert outcome.record is None
    assert outcome.failure is not None and "NaN" in outcome.failure


def test_records_of_other_settings_are_repeated_and_that_is_said(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    first, last = RUNS[0], RUNS[3]
    run_grid(folder, [first, last], Here())
    assert grid_status(folder, [first, last]).done == 2
    unnamed = record_of(first)
    del unnamed["settings"]
    write_json(record_path(folder, first), unnamed)
    write_json(record_path(folder, last), record_of(last) | {"settings": "0123456789abcdef"})
    assert read_records(folder, RUNS) == []
    assert grid_status(folder, [first, last]).done == 0
    run_grid(folder, [first, last], Here())
    assert "2 finished runs were made with other settings and are repeated" in (
        capsys.readouterr().err
    )
    assert read_records(folder, RUNS) == [record_of(first), record_of(last)]
    run_grid(folder, [first, last], Here())
    assert "other settings" not in capsys.readouterr().err


def test_a_record_of_other_settings_stays_until_its_run_has_another(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Days of work went at the first second of a --resume that was stopped again."""
    run_grid(folder, RUNS[:2], Here())
    for run in RUNS[:2]:
        write_json(record_path(folder, run), record_of(run) | {"settings": "0123456789abcdef"})

    def stop(self: object, work: object, *arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Here, "submit", stop)
    with pytest.raises(KeyboardInterrupt):
        run_grid(folder, RUNS[:2], Here())
    assert all(made_otherwise(folder, run) for run in RUNS[:2])


@pytest.mark.parametrize(
    "change",
    [
        {"env": "HalfCheetah-v5"},
        {"method": "highlights"},
        {"method": "polite-pebble", "steps": 10_000},
        {"queries": 100},
        {"loss": "released"},
        {"highlights": "choice"},
        {"preset": "paper"},
        {"steps": 2000},
        {"variant": "no-termination"},
        {"variant": "shuffled"},
        {"variant": "noisy"},
        {"variant": "equal-updates"},
        {"variant": "few-epochs"},
        {"variant": "raised"},
    ],
)
def test_a_fingerprint_tells_settings_but_not_seeds_apart(change: dict[str, Any]) -> None:
    assert fingerprint(replace(FIRST_RUN, **change)) != fingerprint(FIRST_RUN)
    assert fingerprint(RUNS[3]) == fingerprint(FIRST_RUN)
    text = canonical(replace(FIRST_RUN, **change))
    assert " at 0x" not in text  # an address would differ in the next process
    assert "ask_" in text


def test_a_fingerprint_sees_what_has_no_place_in_the_name(monkeypatch: pytest.MonkeyPatch) -> None:
    before = fingerprint(FIRST_RUN)
    other = fingerprint(replace(FIRST_RUN, env="HalfCheetah-v5"))
    preset = PRESETS["Walker2d"]
    assert preset.oracle is not None
    for change in (
        {"oracle": replace(preset.oracle, flip_probability=0.2)},
        {"training": replace(preset.training, learning_rate=1e-3)},
        {"ppo": replace(preset.ppo, gae_lambda=0.9)},
        {"settings": {"healthy_reward": 0.5}},
    ):
        with monkeypatch.context() as patch:
            patch.setitem(PRESETS, "Walker2d", replace(preset, **change))  # type: ignore[arg-type, misc]
            patch.setattr(settings, "_digest", settings._digest.__wrapped__)  # without its cache
            assert fingerprint(FIRST_RUN) != before
            assert fingerprint(replace(FIRST_RUN, env="HalfCheetah-v5")) == other
    assert fingerprint(FIRST_RUN) == before


def test_what_a_run_was_done_with_is_known() -> None:
    facts = machine()
    assert facts["torch"] == version("torch")
    assert facts["polite"] == version("socialnav-polite")
    assert facts["processor"]
    json.dumps(facts)


def begin(folder: Path) -> None:
    """Of four runs one is done, one failed, one is running, one waits."""
    write_json(record_path(folder, RUNS[0]), record_of(RUNS[0]))
    write_json(times_path(folder, RUNS[0]), {"total": 100.0})
    failure_path(folder, RUNS[1]).parent.mkdir()
    failure_path(folder, RUNS[1]).write_text("no")
    content = {"says": "training the policy", "share": 0.25, "seconds": 40.0}
    write_json(live_path(folder, RUNS[2]), content | {"curve": {"return": [1.0, 1234.0]}})


def test_how_far_a_grid_is_can_be_read_from_its_folder(folder: Path) -> None:
    begin(folder)
    now = grid_status(folder, RUNS)
    assert (now.total, now.done, now.left) == (4, 1, 1)
    assert now.failed == (RUNS[1],)
    assert [item.run for item in now.running] == [RUNS[2]]
    assert now.seconds_left == 100.0 + 60.0  # one process does the rest of one run, then another
    text = "1 of 4 runs done, 1 running, 1 left, 1 failed; time to go 0:02:40"
    assert summary_line(now) == text
    console = Console(file=StringIO(), width=200)
    console.print(view(now))
    shown = console.file.getvalue()  # type: ignore[attr-defined]
    for part in (text, RUNS[2].name, "25%", "1,234", "training the policy", RUNS[1].name):
        assert part in shown
    assert "ago" not in shown
    long_ago = live_path(folder, RUNS[2]).stat().st_mtime - 3600
    os.utime(live_path(folder, RUNS[2]), (long_ago, long_ago))
    console.print(view(grid_status(folder, RUNS)))
    assert "training the policy, said 1:00:" in console.file.getvalue()  # type: ignore[attr-defined]


def test_a_new_cell_takes_as_long_as_the_likest_one_that_is_known(folder: Path) -> None:
    slow, quick = replace(FIRST_RUN, env="HalfCheetah-v5"), FIRST_RUN
    for run, seconds in ((slow, 300.0), (quick, 100.0)):
        write_json(record_path(folder, run), record_of(run))
        write_json(times_path(folder, run), {"total": seconds})

    def left(run: Run) -> float | None:
        write_json(
            live_path(folder, run), {"says": "", "share": 0, "seconds": 0, "curve": {"return": []}}
        )
        now = grid_status(folder, [slow, quick, run])
        live_path(folder, run).unlink()
        return now.seconds_left

    assert left(replace(slow, seed=1)) == 300.0
    assert left(replace(quick, queries=400)) == 100.0
    assert left(replace(quick, env="Hopper-v5")) == 200.0
    assert left(replace(quick, env="Hopper-v5", method="pebble")) == 200.0


def test_status_prints_and_changes_nothing(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = planned("fast")[0]
    write_json(record_path(folder, run), record_of(run))
    before = sorted(folder.rglob("*"))
    config = BenchmarkConfig(out=folder, status=True, seeds=(0,), method=("ground-truth",))
    assert benchmark(config) == folder
    assert "1 of 3 runs done" in capsys.readouterr().out
    assert sorted(folder.rglob("*")) == before
    benchmark(replace(config, preset="smoke"))  # the folder knows better
    said = capsys.readouterr().out
    assert "1 of 3 runs done" in said and "--resume" not in said  # nothing was begun
    with sole_run(folder, identity("fast"), True):
        benchmark(config)
    assert "--resume" not in capsys.readouterr().out
    benchmark(config)
    assert "no process works on it; go on with --resume" in capsys.readouterr().out
    with pytest.raises(PoliteError, match=r"run\.json"):
        benchmark(replace(config, out=folder / "runs"))


def test_without_a_terminal_a_line_is_printed_now_and_then(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begin(folder)
    clock = iter([0.0, 0.0, 29.0, 31.0, 31.0, 40.0, 40.0])
    monkeypatch.setattr(board.time, "monotonic", lambda: next(clock))
    console = Console(file=StringIO(), width=200)
    with Board(lambda: grid_status(folder, RUNS), console) as shown:
        for _ in range(3):
            shown.update()
    lines = console.file.getvalue().splitlines()  # type: ignore[attr-defined]
    assert len(lines) == 3  # at once, after half a minute, and at the end
    assert set(lines) == {summary_line(grid_status(folder, RUNS))}


def scalars(folder: Path, run: Run) -> dict[str, list[tuple[int, float]]]:
    """What TensorBoard would show of a run: steps and values of each tag."""
    found = EventAccumulator(str(folder / "tensorboard" / run.name))
    found.Reload()
    return {
        tag: [(event.step, event.value) for event in found.Scalars(tag)]
        for tag in found.Tags()["scalars"]
    }


def test_tensorboard_is_told_each_point_once(folder: Path) -> None:
    done, running = RUNS[0], RUNS[2]
    curve = {"steps": [10.0, 20.0, 30.0], "return": [1.0, 2.0, 4.0], "length": [5.0, 6.0, 7.0]}
    begun = {name: values[:2] for name, values in curve.items()}
    rest = {"curve": curve, "evaluation": {"return": 8.0}, "policy_steps": 32}
    write_json(record_path(folder, done), record_of(done) | rest)
    says = {"says": "", "share": 0.5, "seconds": 1.0}
    write_json(live_path(folder, running), says | {"curve": begun})
    for _ in range(2):  # the second time as after a kill: the unfinished run begins anew
        with TensorBoard(folder, [done, running]) as log:
            log.follow(grid_status(folder, RUNS))
            log.follow(grid_status(folder, RUNS))
            live_path(folder, running).unlink()
            write_json(live_path(folder, running), says | {"curve": curve})
            log.follow(grid_status(folder, RUNS))
    whole = {
        "true return": [(10, 1.0), (20, 2.0), (30, 4.0)],
        "episode length": [(10, 5.0), (20, 6.0), (30, 7.0)],
    }
    assert scalars(folder, done) == whole | {"return of the finished policy": [(32, 8.0)]}
    assert scalars(folder, running) == {tag: points[:2] for tag, points in whole.items()}
    live_path(folder, running).unlink()  # it ends while nobody tells TensorBoard
    write_json(record_path(folder, running), record_of(running) | rest)
    with TensorBoard(folder, [done, running]):
        pass
    assert scalars(folder, running) == scalars(folder, done)


def test_a_folder_takes_further_parts_of_the_same_preset_only(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Engine(Here):
        def __enter__(self) -> Engine:
            return self

        def __exit__(self, *_: object) -> None: ...

    engine = Engine()
    monkeypatch.setattr(execution, "engine_of", lambda _: engine)
    monkeypatch.setattr(execution, "report_grid", lambda folder: folder / "report.html")
    config = BenchmarkConfig(out=folder, method=("ground-truth",), seeds=(3, 4), stage=(1,))
    with pytest.raises(PoliteError, match="--resume"):
        benchmark(config)
    with pytest.raises(PoliteError, match="other settings"):
        benchmark(BenchmarkConfig(out=folder, preset="paper", resume=True))
    assert not engine.runs
    assert benchmark(replace(config, resume=True)) == folder / "report.html"
    benchmark(replace(config, resume=True, seeds=(0,)))
    assert [run.seed for run in engine.runs] == [3, 3, 4, 4, 0, 0]
    assert len(list((folder / "runs").iterdir())) == 6
    with pytest.raises(PoliteError, match="2 of 2 runs failed"):
        benchmark(replace(config, resume=True, seeds=(1,)))
    assert marks(folder) >= {GRID} and not marks(folder / "runs")


def test_without_an_engine_no_folder_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(_: BenchmarkConfig) -> Any:
        raise PoliteError("no Ray cluster")

    monkeypatch.setattr(execution, "engine_of", none)
    with pytest.raises(PoliteError, match="no Ray cluster"):
        benchmark(BenchmarkConfig(out=tmp_path / "run", preset="smoke"))
    assert not (tmp_path / "run").exists()


def test_the_folder_is_let_go_of_after_the_engine_has_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    free = []

    class Engine(Here):
        def __enter__(self) -> Engine:
            return self

        def __exit__(self, *_: object) -> None:
            free.append(is_left(tmp_path / "run"))

    def fail(*_: object) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr(execution, "engine_of", lambda _: Engine())
    monkeypatch.setattr(execution, "run_grid", fail)
    with pytest.raises(KeyboardInterrupt):
        benchmark(BenchmarkConfig(out=tmp_path / "run", preset="smoke"))
    assert free == [False] and is_left(tmp_path / "run")


@pytest.mark.parametrize("spoil", [lambda text: text[:200], lambda text: "{}", lambda text: "[1]"])
def test_a_damaged_record_is_named(folder: Path, spoil) -> None:
    path = record_path(folder, RUNS[0])
    write_json(path, record_of(RUNS[0]))
    path.write_text(spoil(path.read_text("utf-8")), encoding="utf-8")
    now = grid_status(folder, RUNS)
    assert (now.damaged, now.left) == ((RUNS[0],), 4)
    console = Console(file=StringIO(), width=200)
    console.print(view(now))
    assert f"no record of it, though a file is there: {RUNS[0].name}" in console.file.getvalue()  # type: ignore[attr-defined]


@pytest.mark.parametrize("spoiled", [{"final_return": "abc"}, {"curve": "abc"}, {"quality": 3}])
def test_a_damaged_record_is_on_the_page(folder: Path, capsys, spoiled) -> None:
    run = planned("fast")[0]
    write_json(record_path(folder, run), record_of(run) | spoiled)
    page = report_grid(folder)
    name = record_path(folder, run).name
    assert f"1 record damaged ({name})" in page.read_text("utf-8")
    assert f"{name} is no record of its run and left out" in capsys.readouterr().err


@pytest.mark.parametrize("preset", ["smoke", "fast", "paper"])
def test_every_run_of_a_grid_has_settings(preset: str) -> None:
    for run in planned(preset):
        if run.method == "pebble":
            config, _ = pebble_settings(run)
            assert config.training.preference == run.loss
        else:
            learning, env = learning_config(run)
            assert (learning.queries, learning.steps) == (run.queries, run.steps)
            assert run.loss in (None, learning.training.preference)
            assert run.highlights in (None, learning.training.highlights)
            assert (run.variant == "no-termination") == ("terminate_when_unhealthy" in env.settings)
        assert env_preset(run).oracle is not None


def test_a_control_changes_what_it_is_about_and_nothing_else() -> None:
    for run in planned("fast"):
        if run.variant not in ("", "no-termination"):
            config, preset = learning_config(run)
            plain, plain_preset = learning_config(replace(run, variant=""))
            asked: dict[str, dict[str, Any]] = {
                "shuffled": {"shuffled": True},
                "noisy": {"noise": HighlightNoise(0.3, 0.1, 0.3)},
            }
            assert preset == replace(plain_preset, **asked.get(run.variant, {}))
            changes: dict[str, dict[str, Any]] = {
                "equal-updates": {"schedule": EqualUpdates(reference=200)},
                "few-epochs": {"schedule": Schedule(first_epochs=25, later_epochs=6)},
                "raised": {"normalise": True, "reward_offset": 2.0},
            }
            assert config == replace(plain, **changes.get(run.variant, {}))
            assert run.variant in {*asked, *changes}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"variant": "shuffled", "method": "preferences", "highlights": None}, "can be shuffled"),
        ({"variant": "noisy", "method": "preferences", "highlights": None}, "can be noisy"),
        ({"variant": "equal-updates", "method": "polite-pebble"}, "trainings by PPO"),
        ({"variant": "raised", "method": "polite-pebble"}, "trainings by PPO"),
    ],
)
def test_a_control_that_would_change_nothing_is_refused(change: dict[str, Any], says: str) -> None:
    with pytest.raises(InvalidValueError, match=says):
        fingerprint(replace(FIRST_RUN, **change))


def test_a_shuffled_session_has_the_same_highlights_at_other_answers_a_noisy_one_fewer() -> None:
    run = Run("HalfCheetah-v5", "polite", 200, "pairwise", "choice", "fast", 1000)
    random = np.random.default_rng(0)
    segments = [
        replace(_constant(50, 0.0), rewards=random.normal(k, 1.0, 50)) for k in np.linspace(0, 2, 9)
    ]
    pool = SegmentPool.stack(segments, 50)
    queries = [Query(i, j) for i in range(9) for j in range(i)]
    asked = {}
    for variant in ("", "shuffled", "noisy"):
        teacher = env_preset(replace(run, variant=variant)).make_teacher(pool)
        asked[variant] = teacher(pool, queries, np.random.default_rng(1))
    plain, shuffled = asked[""], asked["shuffled"]
    assert [a.preference for a in plain] == [a.preference for a in shuffled]
    marks = [sorted(str((a.positive, a.negative)) for a in some) for some in (plain, shuffled)]
    assert marks[0] == marks[1] and plain != shuffled
    given = [sum(a.positive is not None for a in some) for some in (plain, asked["noisy"])]
    assert given[0] > 10 and 0 < given[1] < given[0]
    assert [a.preference for a in plain] == [a.preference for a in asked["noisy"]]


def feedback() -> Feedback:
    """Segments of three 1s, three 2s and two 3s: returns 3, 6 and 6."""
    segments = [_constant(3, 1.0), _constant(3, 2.0), _constant(2, 3.0)]
    mark = Highlight(end=1, length=0)
    answers = [
        Answer(0, SECOND, positive=mark),
        Answer(1, SECOND, positive=mark, negative=mark),
        Answer(2, FIRST),
        Answer(3, UNRELATED),
    ]
    queries = [Query(0, 1), Query(1, 2), Query(0, 2), Query(0, 1)]
    return Feedback(SegmentPool.stack(segments, 3), queries, answers)


def _constant(steps: int, reward: float) -> Segment:
    rows = np.zeros((steps, 1))
    return Segment(rows, rows, np.full(steps, reward), rows, trajectory=0, start=0)


def test_answers_are_counted_and_compared_with_the_true_returns() -> None:
    assert answers_part(feedback()) == {
        "asked": 4,
        "no_preference": 1,
        "positive": 2,
        "negative": 1,
        "label_accuracy": 0.5,  # the first is right, the third wrong, the second has no winner
    }
    assert answers_part(None)["label_accuracy"] is None


def test_the_reward_of_highlighted_steps_is_the_true_one() -> None:
    # The first answer marks a step of the segment of twos (3 steps), the second one of the threes.
    assert highlighted_reward(feedback()) == {
        "positive": 2.5,
        "negative": 3.0,
        "all": (3 * 2.0 + 2 * 3.0) / 5,
    }


def test_the_final_return_is_that_of_the_last_tenth() -> None:
    assert final_return(EPISODES, 100) == 3.0
    assert final_return(EPISODES, 1000) == 3.0  # none ended in the last tenth: the very last one
    assert final_return([*EPISODES, EPISODES[1] | {"return": 5.0}], 100) == 4.0
    assert final_return([], 100) is None
    assert curve_of(EPISODES, 100)["return"] == [1.0, 3.0]
    assert curve_of([], 100) == {"steps": [], "episodes": [], "return": [], "length": []}
