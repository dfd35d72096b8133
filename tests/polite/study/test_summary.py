"""The researcher's tables, worked out by hand."""

from __future__ import annotations

from dataclasses import replace

import pytest
from made_up_study import answer, consistent, made_up_design, made_up_records, person

from polite.study.design import CONDITIONS
from polite.study.records import StudyRecords
from polite.study.summary import summarise

NOW = 1200.0 + 3601.0


@pytest.fixture(scope="module")
def design(tmp_path_factory):
    return made_up_design(tmp_path_factory.mktemp("study"))


def cells(design, records, title, now=NOW):
    (section,) = (s for s in summarise(records, design, now) if s.title == title)
    assert section.columns[1:] == CONDITIONS
    return {row[0]: row[1:] for row in section.rows}


def plain(text):
    return text.replace("\N{NO-BREAK SPACE}", " ")


def test_progress(design):
    rows = cells(design, made_up_records(), "Participants")
    assert rows == {
        "wanted": ("2", "2"),
        "consented": ("4", "3"),
        "withdrawn since": ("1", "0"),
        "now: guide": ("0", "0"),
        "now: practice": ("0", "0"),
        "now: comparisons": ("1", "1"),
        "now: questions": ("0", "0"),
        "now: finished": ("2", "2"),
        "excluded: failed catch pairs": ("0", "0"),
        "excluded: too fast": ("0", "0"),
        "excluded: same choice": ("0", "0"),
        "finished and not excluded": ("2 of 2", "2 of 2"),
    }


def test_dropout_names_stage_and_place(design):
    records = made_up_records()  # each third one answered a practice and a main comparison
    assert cells(design, records, "Not finished") == {"comparisons 2": ("1 (1 silent)",) * 2}
    assert cells(design, records, "Not finished", now=1300.0) == {
        "comparisons 2": ("1 (0 silent)",) * 2
    }
    waiting = person(5, finished_at=None, stage="guide", last_seen=NOW)
    done = replace(consistent(6), finished_at=None, stage="questions", last_seen=NOW)
    rows = cells(design, StudyRecords((waiting, done)), "Not finished")
    assert rows == {"guide": ("1 (0 silent)", "0"), "questions": ("1 (0 silent)", "0")}


def test_catch_pairs_and_their_exclusions(design):
    wrong = (answer(1, "left"), answer(2, "left"), answer(3, "right"), answer(4, "left"))
    records = StudyRecords((consistent(1), person(2, *wrong), person(3, answer(1))))
    rows = cells(design, records, "Catch pairs")
    assert rows["repeated: agreed"][0].endswith("(1/2)")
    assert rows["mirrored: contradicted"][0].endswith("(1/2)")
    assert rows["repeated: undecided"][1] == "–"
    progress = cells(design, records, "Participants")
    assert progress["excluded: failed catch pairs"] == ("1", "0")
    assert progress["finished and not excluded"] == ("2 of 2", "0 of 2")


def test_shares_have_wilson_intervals(design):
    rows = cells(design, made_up_records(), "Answers")
    assert rows["answers"] == ("7", "7")
    # Wilson's interval of 2 of 7, and of 4 of 5, worked out by its formula.
    assert plain(rows["equal"][0]) == "28.6% [8.2, 64.1] (2/7)"
    assert plain(rows["left, of the preferences"][0]) == "80.0% [37.6, 96.4] (4/5)"
    assert rows["good window, of the preferences"][0].endswith("(4/5)")
    assert rows["bad window, of the preferences"][0].endswith("(2/5)")
    assert rows["nothing stands out, of the preferences"][1] == "not asked"


def test_times(design):
    quick = answer(2, received_at=1210.0, watched_at=1209.5, client_watched_at=None)
    records = StudyRecords((person(1, answer(1), quick, answer(3), answer(3, revision=2)),))
    rows = cells(design, records, "Times")
    assert rows["seconds an answer"] == ("20.0 [15.0, 20.0]", "–")
    assert rows["of these, after watching"][0] == "5.0 [2.8, 5.0]"
    assert rows["chosen less than 1 s after watching"][0].endswith("(1/3)")
    assert rows["minutes in total"][0] == "30.0 [30.0, 30.0]"
    assert rows["minutes to the last comparison"][0] == "6.3 [6.3, 6.3]"  # (1320 − 940) / 60


def test_a_study_without_anybody(design):
    sections = summarise(StudyRecords(()), design, NOW)
    assert all(len(row) == len(s.columns) for s in sections for row in s.rows)
    assert cells(design, StudyRecords(()), "Answers")["equal"] == ("–", "–")
