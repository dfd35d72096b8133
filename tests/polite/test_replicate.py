"""The whole replication, end to end, at its smallest; one run serves most tests."""

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from polite.experiments.run_folder import LOCK, sole_run
from polite.files import MARKER

ROOT = Path(__file__).parents[2]
NEEDED = {
    "config", "seed", "simulated", "queries", "participants", "calibrated", "no_preference_rate",
    "highlight_rate", "chi_square", "reward_map", "reward_map_2d", "goal_distance", "kl", "policy",
    "curves", "claims", "published",
}  # fmt: skip


def run(*arguments, script="from polite.cli import main; main()"):
    return python("-c", script, *arguments)


def python(*arguments):
    return subprocess.run(
        [sys.executable, "-W", "error", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    out = tmp_path_factory.mktemp("study") / "run"
    done = run("replicate", "--preset", "smoke", "--seed", 0, "--out", out)
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"{out / 'report.html'}\n"  # and no bar, which a script would stumble on
    return out


@pytest.fixture(scope="module")
def results(finished):
    return json.loads((finished / "results.json").read_text("utf-8"))


def test_writes_what_the_design_lists(finished, results):
    assert results.keys() >= NEEDED
    assert results["simulated"] is True
    assert results["seed"] == 0
    for name in ("report.html", "figures/fig5a_reward_map.pdf", "models/reward-polite-0.pt"):
        assert (finished / name).stat().st_size > 0
    for name in ("segments.npz", "queries.json", "answers.jsonl"):
        assert (finished / "data" / "polite" / name).exists()
    assert [path.name for path in finished.rglob(".*") if path.is_file()] == [LOCK]


def test_both_conditions_answer_the_same_pairs(finished):
    polite, baseline = (
        (finished / "data" / name / "queries.json").read_bytes() for name in ("polite", "baseline")
    )
    assert polite == baseline


def test_only_the_polite_group_highlights(results):
    assert results["counts"]["baseline"]["positive"] == 0
    assert results["counts"]["polite"]["positive"] > 0


def test_models_start_from_the_same_weights(finished):
    import numpy as np

    with np.load(finished / "stages" / "rewards-0.npz") as arrays:
        first = {name: arrays[f"{name}_epochs"][0] for name in ("polite", "baseline")}
    np.testing.assert_array_equal(first["polite"], first["baseline"])


def test_divergence_starts_at_zero_and_has_an_entry_for_each_epoch(results):
    epochs = results["config"]["reward_training"]["epochs"]
    assert results["kl"]["epochs"] == list(range(epochs + 1))
    assert all(row[0] == pytest.approx(0.0, abs=1e-9) for row in results["kl"]["per_seed"])


def test_counts_add_up(results):
    for name in ("polite", "baseline"):
        counts = results["counts"][name]
        assert counts["expressed"] + counts["no_preference"] == counts["answers"]
        assert results["queries"][name] == counts["answers"]


def test_the_example_goes_on_with_a_finished_run_and_changes_nothing(finished, results):
    before = (finished / "results.json").read_bytes()
    times = {path: path.stat().st_mtime_ns for path in (finished / "stages").iterdir()}
    example = ROOT / "examples" / "replicate_study.py"
    done = python(example, "smoke", finished)
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) == len(results["claims"])
    assert (finished / "results.json").read_bytes() == before
    assert {path: path.stat().st_mtime_ns for path in (finished / "stages").iterdir()} == times


KILLED_WHILE = """
import os, signal
from polite.experiments.runner import Runner
from polite.cli import main

listen = Runner._listen

def listen_and_die(self):
    get = self._messages.get
    def watching():
        message = get()
        if message is not None and message[0] == {name!r} and message[1] > 0.0:
            os.kill(os.getpid(), signal.SIGKILL)
        return message
    self._messages.get = watching
    listen(self)

Runner._listen = listen_and_die
if __name__ == "__main__":
    main()
"""


def test_a_run_killed_in_mid_task_again_and_again_ends_with_the_same_results(finished, tmp_path):
    out = tmp_path / "run"
    arguments = ["replicate", "--preset", "smoke", "--seed", 0, "--out", out]
    for name in ("clips", "rewards-0", "policy-polite-1"):
        died = run(*arguments, script=KILLED_WHILE.format(name=name))
        assert died.returncode == -signal.SIGKILL, died.stderr
        assert not (out / "results.json").exists()
        if name == "clips":
            arguments += ["--resume"]
    done = run(*arguments)
    assert done.returncode == 0, done.stderr
    assert (out / "results.json").read_bytes() == (finished / "results.json").read_bytes()


@pytest.fixture
def mistake(command_line):
    """The only line that a mistaken command prints."""

    def call(*arguments):
        done = command_line(*arguments)
        assert done.returncode == 2
        assert len(done.stderr.strip().splitlines()) == 1
        assert "Traceback" not in done.stderr
        return done.stderr

    return call


def test_an_existing_folder_is_left_alone(mistake, finished):
    before = (finished / "results.json").read_bytes()
    assert "--resume" in mistake("replicate", "--preset", "smoke", "--out", finished)
    assert (finished / "results.json").read_bytes() == before


def test_a_folder_of_other_settings_is_not_gone_on_with(mistake, finished):
    assert "other settings" in mistake(
        "replicate", "--preset", "smoke", "--seed", 1, "--out", finished, "--resume"
    )


def test_two_runs_do_not_work_in_one_folder(mistake, finished):
    run = json.loads((finished / MARKER).read_text("utf-8"))
    with sole_run(finished, run, True):
        said = mistake("replicate", "--preset", "smoke", "--seed", 0, "--out", finished, "--resume")
    assert "another run" in said


def test_a_folder_that_holds_no_run_is_not_taken(mistake, tmp_path):
    (tmp_path / "letter.txt").write_text("precious")
    assert "no run" in mistake("replicate", "--preset", "smoke", "--out", tmp_path, "--resume")
    assert [path.name for path in tmp_path.iterdir()] == ["letter.txt"]


def test_an_unknown_preset_is_refused(command_line, tmp_path):
    done = command_line("replicate", "--preset", "huge", "--out", tmp_path / "run")
    assert done.returncode == 2
    assert "smoke" in done.stderr + done.stdout
    assert not (tmp_path / "run").exists()


def test_a_data_set_cut_short_is_named(command_line, finished, tmp_path):
    out = tmp_path / "run"
    shutil.copytree(finished, out)
    segments = out / "data" / "polite" / "segments.npz"
    with segments.open("r+b") as file:
        file.truncate(os.path.getsize(segments) // 2)
    for path in out.glob("stages/rewards-*"):
        path.unlink()
    done = command_line("replicate", "--preset", "smoke", "--seed", 0, "--out", out, "--resume")
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert "segments.npz" in done.stderr.splitlines()[-1]  # after the bars of what had begun


def test_a_report_without_numbers_is_refused(mistake, tmp_path):
    assert "results.json" in mistake("report", tmp_path)


def browser():
    return shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("chrome")


@pytest.mark.skipif(browser() is None, reason="no Chromium on this machine")
def test_the_report_opens_without_a_console_message(finished, tmp_path):
    options = (
        "--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking "
        "--disable-component-update --disable-sync --enable-logging=stderr --dump-dom"
    )
    done = subprocess.run(
        [browser(), *options.split(), f"--user-data-dir={tmp_path}", finished / "report.html"],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    assert "CONSOLE" not in done.stderr
    assert "The participants are simulated" in done.stdout
