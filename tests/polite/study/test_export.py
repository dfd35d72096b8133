"""What is exported is what was recorded."""

from __future__ import annotations

import csv
import io
import json
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_up_study import (
    QUERIES,
    answer,
    consistent,
    made_up_folder,
    made_up_pool,
    made_up_records,
    person,
)

from polite.dataset import load_feedback
from polite.files import sha256
from polite.study.columns import Column
from polite.study.design import Design, read_design
from polite.study.export import export, export_zip
from polite.study.records import Shown, StudyRecords
from polite.study.tables import as_csv
from polite.study.to_feedback import learner_answers
from polite.types import PoliteError

FILES = {
    "answers.csv", "answers.jsonl", "participants.csv", "questionnaire.csv", "data_dictionary.csv",
    "data_dictionary.md", "study.toml", "designs.json", "export.json",
} | {
    f"data/{condition}/{name}"
    for condition in ("polite", "baseline")
    for name in ("segments.npz", "queries.json", "answers.jsonl", "manifest.json")
}  # fmt: skip


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    return made_up_folder(tmp_path_factory.mktemp("study"))


@pytest.fixture(scope="module")
def exported(study, tmp_path_factory):
    return export(study, made_up_records(), tmp_path_factory.mktemp("export") / "new")


def table(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def files(folder):
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def test_has_every_file_and_its_checksum(exported, study):
    assert files(exported) == FILES
    checksums = json.loads((exported / "export.json").read_text("utf-8"))["sha256"]
    assert checksums == {name: sha256(exported / name) for name in FILES - {"export.json"}}
    assert (exported / "study.toml").read_bytes() == (study / "study.toml").read_bytes()


def test_learner_reads_what_the_records_say(exported, study):
    design = read_design(study / "study.toml")
    wanted = learner_answers(made_up_records(), design, made_up_pool(), QUERIES)
    for condition, learner in wanted.items():
        feedback = load_feedback(exported / "data" / condition)
        assert feedback.answers == learner.answers
        assert feedback.queries == QUERIES
        np.testing.assert_array_equal(feedback.pool.observations, made_up_pool().observations)


def test_answers_have_a_row_for_each_revision_of_everybody(exported):
    rows = table(exported / "answers.csv")
    records = made_up_records()
    assert len(rows) == sum(len(p.answers) for p in records.participants) == 28
    by_place = {(row["participant"], row["place"]): row for row in rows}
    for someone in records.participants:
        for given_answer in someone.answers:
            row = by_place[str(someone.number), str(given_answer.place)]
            assert row["choice"] == given_answer.choice
            assert row["consent_version"] == "'=1+1"
            assert float(row["received_at"]) == given_answer.received_at
            assert float(row["client_answered_at"]) == given_answer.client_answered_at
            assert (row["choice_seconds"], row["decision_seconds"]) == ("2.0", "5.0")
            assert (row["excluded"] == "true") == (someone.finished_at is None)
    first = by_place["1", "1"]
    assert [first[f"segment_{side}"] for side in ("left", "right", "preferred")] == ["0", "1", "0"]
    assert [first[f"{sign}_{edge}"] for sign in ("good", "bad") for edge in ("start", "end")] == [
        "2", "5", "4", "7",
    ]  # fmt: skip
    second = by_place["1", "2"]  # its first segment was on the right
    assert [second[f"segment_{s}"] for s in ("left", "right", "preferred")] == ["3", "2", "3"]
    assert second["says"] == "second"
    practice = by_place["1", "0"]
    assert (practice["kind"], practice["query"], practice["segment_left"]) == ("practice", "", "2")


def test_jsonl_says_the_same_as_csv(exported):
    lines = (exported / "answers.jsonl").read_text("utf-8").splitlines()
    rows = table(exported / "answers.csv")
    assert len(lines) == len(rows)
    for line, row in zip(map(json.loads, lines), rows, strict=True):
        assert line.keys() == row.keys()
        assert line["consent_version"] == "=1+1"
        for name in line.keys() - {"consent_version"}:
            assert written(line[name]) == row[name]


def written(value):
    if value is None:
        return ""
    return str(value).lower() if isinstance(value, bool) else str(value)


def test_participants_are_described(exported):
    rows = {row["participant"]: row for row in table(exported / "participants.csv")}
    assert set(rows) == {"1", "2", "3", "11", "12", "13"}
    assert rows["2"]["minutes_total"] == "30.0"
    assert float(rows["2"]["minutes_tasks"]) == (1520 - 940) / 60
    assert rows["12"]["learner_participant"] == "1"
    assert rows["2"]["catch_agreed"] == "2"
    assert rows["2"]["left_rate"] == "0.75"
    assert float(rows["2"]["same_choice_share"]) == 2 / 3  # of left, left and equal
    stopped = rows["13"]
    assert (stopped["stage"], stopped["finished_at"]) == ("comparisons", "")
    assert (stopped["excluded"], stopped["exclusion_reasons"]) == ("true", "not finished")
    assert stopped["learner_participant"] == stopped["minutes_total"] == ""


def test_questionnaire_is_escaped_and_read_back(exported):
    rows = table(exported / "questionnaire.csv")
    assert rows[0]["clear"] == "6.0"
    assert rows[0]["comment"] == '\'=HYPERLINK(1)\nüñ, "quoted"'
    assert rows[2]["clear"] == rows[2]["comment"] == ""


def test_dictionary_describes_every_column_and_no_other(exported):
    described = table(exported / "data_dictionary.csv")
    page = (exported / "data_dictionary.md").read_text("utf-8")
    for name in ("answers.csv", "participants.csv", "questionnaire.csv", "data_dictionary.csv"):
        columns = [row["column"] for row in described if name in row["file"]]
        assert columns == list(table(exported / name)[0])
        assert len(set(columns)) == len(columns)
    assert all(row["meaning"] for row in described)
    assert all(f"| `{row['column']}` |" in page for row in described)
    (comment,) = (row for row in described if row["column"] == "comment")
    assert comment["meaning"] == "'-anything | else?"
    assert "-anything \\| else?" in page


def test_summary_counts(exported):
    summary = json.loads((exported / "export.json").read_text("utf-8"))
    assert summary["simulated"] is False
    assert summary["simulated_by"] is None
    assert summary["conditions"]["polite"] == {
        "joined": 3,
        "finished": 2,
        "included": 2,
        "excluded": {"not finished": 1, "failed catch pairs": 0, "too fast": 0, "same choice": 0},
        "withdrawn": 1,
        "answers": 6,
    }
    assert summary["conditions"]["baseline"]["withdrawn"] == 0
    assert summary["consent_versions"] == {"=1+1": 6}
    assert summary["env"] == "Made-up-v0"


def test_every_design_that_was_joined_can_be_read_again(study, tmp_path):
    """Words may change while a study runs; each participant's are found by their checksum."""
    now = read_design(study / "study.toml")
    consent = now.consent.model_copy(update={"version": "0", "text": "Was früher galt."})
    earlier = now.model_copy(update={"consent": consent})
    people = (consistent(1, design_sha=earlier.sha), consistent(2, design_sha=now.sha))
    shown = Shown({now.sha: now, earlier.sha: earlier})
    out = export(study, StudyRecords(people, shown=shown), tmp_path)
    designs = json.loads((out / "designs.json").read_text("utf-8"))
    assert {sha: Design(**content) for sha, content in designs.items()} == shown.designs
    first, second = table(out / "participants.csv")
    assert designs[first["design_sha"]]["consent"]["text"] == "Was früher galt."
    assert designs[second["design_sha"]]["consent"]["text"] == now.consent.text
    assert "designs.json" in (out / "data_dictionary.md").read_text("utf-8")


def test_changed_answers_are_all_there(study, tmp_path):
    someone = person(1, answer(1, "left", good=1), answer(1, "right", revision=2, bad=0))
    rows = table(export(study, StudyRecords((someone,)), tmp_path / "out") / "answers.csv")
    assert [(r["revision"], r["is_last"], r["choice"]) for r in rows] == [
        ("1", "false", "left"),
        ("2", "true", "right"),
    ]


def test_robots_are_called_robots(study, tmp_path):
    records = StudyRecords((replace(consistent(1), robot=True), consistent(2)))
    out = export(study, records, tmp_path)
    summary = json.loads((out / "export.json").read_text("utf-8"))
    assert (summary["simulated"], summary["simulated_by"]) == (True, "robots")
    assert [row["robot"] for row in table(out / "participants.csv")] == ["true", "false"]


def test_zip_has_the_same_files(study, exported):
    content = export_zip(study, made_up_records())
    assert content == export_zip(study, made_up_records())
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert set(archive.namelist()) == FILES
        assert all(archive.read(name) == (exported / name).read_bytes() for name in FILES)


def test_an_empty_study_can_be_exported(study, tmp_path):
    out = export(study, StudyRecords(()), tmp_path)
    assert files(out) == FILES
    assert load_feedback(out / "data" / "polite").answers == []


def test_an_earlier_export_is_replaced(study, tmp_path):
    export(study, made_up_records(), tmp_path)
    fewer = StudyRecords(made_up_records().participants[:1])
    export(study, fewer, tmp_path)
    assert [row["participant"] for row in table(tmp_path / "participants.csv")] == ["1"]
    assert files(tmp_path) == FILES


def test_records_that_do_not_fit_leave_an_earlier_export_alone(study, tmp_path):
    export(study, made_up_records(), tmp_path)
    before = {name: (tmp_path / name).read_bytes() for name in FILES}
    with pytest.raises(PoliteError, match="window"):
        export(study, StudyRecords((person(1, answer(1, good=6)),)), tmp_path)
    assert {name: (tmp_path / name).read_bytes() for name in FILES} == before


def test_an_export_that_breaks_off_has_no_summary(study, tmp_path, monkeypatch):
    export(study, made_up_records(), tmp_path)

    def full_disk(path, write):
        raise PoliteError(f"{path}: cannot be written (No space left on device)")

    monkeypatch.setattr("polite.study.export.write_atomically", full_disk)
    with pytest.raises(PoliteError, match="No space left"):
        export(study, made_up_records(), tmp_path)
    assert not (tmp_path / "export.json").exists()


def test_a_file_cannot_be_the_folder(study, tmp_path):
    (tmp_path / "out").write_text("precious")
    with pytest.raises(PoliteError, match="cannot be written into"):
        export(study, made_up_records(), tmp_path / "out")


@given(st.lists(st.text(st.characters(codec="utf-8")), min_size=1))
def test_any_text_can_be_read_back_and_none_is_a_formula(texts):
    column = Column("text", "text", "", "What was said.", lambda row: row)
    head, *rows = csv.reader(io.StringIO(as_csv((column,), texts), newline=""))
    assert head == ["text"]
    assert not any(cell.startswith(("=", "+", "-", "@")) for (cell,) in rows)
    assert [cell.removeprefix("'") for (cell,) in rows] == texts
