"""The analysis on people's answers, at its smallest; one run serves most tests."""

from __future__ import annotations

import copy
import csv
import json
import shutil
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from made_up_study import corridor_export
from page_outline import Outline

from polite.analysis.claims import judge
from polite.dataset import Feedback, load_feedback, save_feedback
from polite.experiments.replication.config import PRESETS
from polite.experiments.replication.people import read_people
from polite.experiments.replication.replicate import replicate
from polite.files import read_json_object, sha256, write_json
from polite.report.page import render
from polite.types import EQUAL, PoliteError

SMOKE = PRESETS["smoke"]


@pytest.fixture(scope="module")
def export(tmp_path_factory):
    return corridor_export(tmp_path_factory.mktemp("answers"))


@pytest.fixture(scope="module")
def finished(export, tmp_path_factory):
    out = tmp_path_factory.mktemp("study") / "run"
    command = "from polite.cli import main; main()"
    given = ("replicate", "--preset", "smoke", "--seed", 3, "--out", out, "--answers", export)
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", command, *map(str, given)],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return out


@pytest.fixture(scope="module")
def results(finished):
    return json.loads((finished / "results.json").read_text("utf-8"))


def test_results_are_of_people(results, export):
    assert results["simulated"] is False
    assert results["calibrated"] == {}
    assert results["sensitivity"] == []
    assert results["participants"] == {"polite": 3, "baseline": 2}
    assert results["people"]["export"] == sha256(export / "export.json")
    assert "participants" not in results["config"]
    assert results["config"]["segment_length"] == 20
    assert results["config"]["reward_training"]["highlight_length"] == 5


def test_counts_and_times_are_those_of_the_export(results, export):
    for name in ("polite", "baseline"):
        answers = load_feedback(export / "data" / name).answers
        assert results["counts"][name]["answers"] == len(answers)
        assert results["people"]["per_participant"][name]["answers"] == (
            [8, 8, 7] if name == "polite" else [8, 7]
        )
        with (export / "participants.csv").open(encoding="utf-8", newline="") as file:
            rows = [row for row in csv.DictReader(file) if row["condition"] == name]
        minutes = [float(row["minutes_tasks"]) for row in rows]
        assert results["people"]["per_participant"][name]["minutes"] == minutes
        assert results["times"][name]["mean"] == pytest.approx(np.mean(minutes))
    marked = [a for a in load_feedback(export / "data" / "polite").answers if a.positive]
    assert results["counts"]["polite"]["positive"] == len(marked) > 0


def test_run_keeps_the_answers_it_was_made_from(finished, export):
    for name in ("polite", "baseline"):
        kept, given = (load_feedback(folder / "data" / name) for folder in (finished, export))
        assert kept.answers == given.answers
        assert kept.queries == given.queries


def page_of(results, folder):
    outline = Outline()
    outline.feed(render(results, folder, []))
    assert outline.open == []
    return outline.text


def test_page_is_of_people_throughout(finished, results):
    text = page_of(results, finished)
    assert "People answered." in text
    assert "simul" not in text.lower() and "calibrat" not in text.lower()
    assert (finished / "report.html").read_text("utf-8").count("People answered.") == 1


def test_page_of_robots_says_so(finished, results):
    robots = copy.deepcopy(results) | {"simulated": True}
    robots["claims"] = judge(robots)
    text = page_of(robots, finished)
    assert "robots that answer as the oracle" in text
    assert "People answered" not in text and "calibrat" not in text.lower()
    inputs = {claim["id"] for claim in robots["claims"] if claim["kind"] == "input"}
    assert inputs == {"no-preference", "highlights", "time", "design"}
    verdicts = {claim["verdict"] for claim in robots["claims"] if claim["id"] in inputs}
    assert verdicts == {"input"}


def test_only_the_design_is_an_input_where_people_answered(results):
    kinds = {claim["id"]: claim["kind"] for claim in results["claims"]}
    assert [name for name, kind in kinds.items() if kind == "input"] == ["design"]
    assert {kinds[name] for name in ("no-preference", "highlights", "time")} == {"emergent"}


def test_going_on_changes_nothing(finished, export):
    kept = [finished / "results.json", finished / "report.html"]
    before = [path.read_bytes() for path in kept]
    times = {path: path.stat().st_mtime_ns for path in (finished / "stages").iterdir()}
    replicate("smoke", 3, finished, resume=True, answers=export)
    assert [path.read_bytes() for path in kept] == before
    assert {path: path.stat().st_mtime_ns for path in (finished / "stages").iterdir()} == times


def test_going_on_with_other_answers_is_refused(finished, tmp_path):
    other = corridor_export(tmp_path, sizes=(2, 2))
    for answers in (other, None):
        with pytest.raises(PoliteError, match="other settings"):
            replicate("smoke", 3, finished, resume=True, answers=answers)


def mistake(export, match):
    with pytest.raises(PoliteError, match=match):
        read_people(export, SMOKE)


@pytest.mark.parametrize("sizes", [(2, 0), (1, 2)])
def test_too_few_participants_are_said_before_anything_runs(tmp_path, sizes):
    answers = corridor_export(tmp_path, sizes=sizes)
    mistake(answers, "at least 2 participants in each condition")
    with pytest.raises(PoliteError, match="at least 2"):
        replicate("smoke", 3, tmp_path / "run", answers=answers)
    assert not (tmp_path / "run").exists()


def test_another_env_is_told_where_to_go(tmp_path):
    mistake(corridor_export(tmp_path, env="HalfCheetah-v5"), r"people_to_reward\.py")


@pytest.fixture
def altered(export, tmp_path):
    """A copy of the export, and a way to change what its summary says."""
    folder = shutil.copytree(export, tmp_path / "export")

    def change(**values):
        summary = read_json_object(folder / "export.json", "")
        files = {name: sha256(folder / name) for name in summary["sha256"]}
        write_json(folder / "export.json", summary | {"sha256": files} | values)
        return folder

    return change


def test_another_corridor_is_refused(altered):
    same = {
        "render_width": 320,
        "camera": "robot",
        "anchor_jitter": 1.0,
        "num_humans": 3,
        "scenario": "paper",
    }
    name = "socialnav_env:SocialCorridor-v0"
    assert read_people(altered(env_settings=same, env=name), SMOKE).minutes
    mistake(altered(env_settings={"num_humans": 9}), "num_humans = 3, got 9")
    mistake(altered(env_settings={"scenario": "doorway"}), "scenario")


def test_files_that_were_altered_are_named(altered):
    folder = altered()
    with (folder / "participants.csv").open("a", encoding="utf-8") as file:
        file.write("\n")
    mistake(folder, r"participants\.csv: altered")
    (folder / "answers.csv").unlink()
    mistake(folder, r"answers\.csv: altered.*no file")


def test_an_export_of_another_version_is_refused(altered):
    mistake(altered(version=2), "expected version 1, got 2")


@pytest.mark.parametrize("content", [{"sha256": []}, {"title": None, "highlight_length": "x"}])
def test_a_summary_of_another_form_is_one_line(altered, content):
    mistake(altered(**content), "not an export of a study")


def test_a_folder_without_an_export_is_named(tmp_path):
    mistake(tmp_path, r"export\.json: cannot be read")


def test_answers_without_a_preference_are_refused(altered):
    data = altered() / "data" / "baseline"
    feedback = load_feedback(data)
    answers = [replace(answer, preference=EQUAL) for answer in feedback.answers]
    save_feedback(data, Feedback(feedback.pool, feedback.queries, answers))
    mistake(altered(), "expected a preference in baseline")


def test_clips_of_another_version_of_the_corridor_are_refused(altered):
    data = altered() / "data" / "polite"
    feedback = load_feedback(data)
    pool = replace(feedback.pool, observations=feedback.pool.observations[..., :-1])
    save_feedback(data, Feedback(pool, feedback.queries, feedback.answers))
    mistake(altered(), "another version of SocialCorridor-v0")


def test_robots_are_robots(tmp_path):
    assert read_people(corridor_export(tmp_path, robots=True), SMOKE).robots
