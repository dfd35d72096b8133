"""Left and right become first and second; windows become highlights."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_up_study import (
    QUERIES,
    answer,
    consistent,
    made_up_design,
    made_up_pool,
    made_up_records,
    person,
    trial,
)

from polite.dataset import Feedback
from polite.study.records import RecordsError, StudyRecords
from polite.study.to_feedback import highlight, learner_answers
from polite.types import EQUAL, FIRST, SECOND, UNRELATED, Answer, Highlight

POOL = made_up_pool()


@pytest.fixture(scope="module")
def design(tmp_path_factory):
    return made_up_design(tmp_path_factory.mktemp("study"))


def learned(design, *people):
    return learner_answers(StudyRecords(people), design, POOL, QUERIES)


def test_answers_worked_out_by_hand(design):
    found = learned(design, consistent(7))
    assert found["polite"].participants == (7,)
    assert found["polite"].answers == [
        Answer(0, FIRST, Highlight(5, 3), Highlight(7, 3), participant=0, seconds=20.0),
        Answer(1, SECOND, Highlight(3, 3), participant=0, seconds=20.0),
        Answer(2, EQUAL, participant=0, seconds=20.0),
    ]
    assert found["baseline"].answers == []


def test_practice_catch_pairs_and_the_excluded_are_left_out(design):
    records = made_up_records()
    found = learner_answers(records, design, POOL, QUERIES)
    for condition, numbers in (("polite", (1, 2)), ("baseline", (11, 12))):
        assert found[condition].participants == numbers
        assert [a.participant for a in found[condition].answers] == [0, 0, 0, 1, 1, 1]
        Feedback(POOL, QUERIES, found[condition].answers)
    assert all(a.positive is a.negative is None for a in found["baseline"].answers)


def test_people_are_numbered_in_the_order_of_their_numbers(design):
    found = learned(design, consistent(30), consistent(4), consistent(9, finished_at=None))
    assert found["polite"].participants == (4, 30)


def test_a_changed_answer_counts_and_the_first_one_is_timed(design):
    changed = answer(1, "right", revision=2, received_at=9000.0, nothing=True)
    someone = person(1, changed, answer(1, "left", good=2))
    assert learned(design, someone)["polite"].answers == [Answer(0, SECOND, seconds=20.0)]


def test_a_clock_that_was_set_back_gives_no_negative_time(design):
    someone = person(1, answer(1, received_at=5.0))
    assert learned(design, someone)["polite"].answers[0].seconds == 0.0


@given(
    st.sampled_from(["left", "right", "equal", "incomparable"]),
    st.booleans(),
    st.none() | st.integers(0, 4),
    st.none() | st.integers(0, 4),
)
def test_the_segment_that_stood_where_one_pointed_is_preferred(design, choice, left, good, bad):
    chosen = choice in ("left", "right")
    given_answer = answer(0, choice, good=good if chosen else None, bad=bad if chosen else None)
    someone = person(1, given_answer, trials=(trial(0, "main", 3, left),))
    (found,) = learned(design, someone)["polite"].answers
    query = QUERIES[found.query]
    sides = (query.first, query.second) if left else (query.second, query.first)
    if chosen:
        preferred = (query.first, query.second)[found.preferred]
        assert preferred == sides[("left", "right").index(choice)]
        assert [found.positive, found.negative] == [highlight(x, 3, 8) for x in (good, bad)]
    else:
        assert found.preference == (EQUAL if choice == "equal" else UNRELATED)
        assert found.positive is found.negative is None


@given(st.integers(1, 60), st.integers(0, 70), st.data())
def test_a_window_begins_where_it_was_put_and_ends_in_the_clip(steps, length, data):
    start = data.draw(st.integers(0, max(0, steps - 1 - length)))
    mark = highlight(start, length, steps)
    assert (mark.start, mark.length) == (start, length)
    assert mark.end == min(start + length, steps - 1)
    window = range(steps)[mark.window]
    assert len(window) == min(length + 1, steps)


def test_no_window_is_no_highlight():
    assert highlight(None, 3, 8) is None


def test_marks_on_a_short_clip_are_cut_off(design):
    someone = person(1, answer(5, "left", good=0))  # segment 4 has two steps
    (found,) = learned(design, someone)["polite"].answers
    assert found.positive == Highlight(1, 3)


@pytest.mark.parametrize("start", [-1, 5, 8])
def test_a_window_outside_the_clip_is_refused(start):
    with pytest.raises(RecordsError, match=f"begins at step {start}"):
        highlight(start, 3, 8)


def test_a_query_that_the_pool_has_not_is_refused(design):
    someone = person(1, answer(0), trials=(trial(0, "main", 6),))
    with pytest.raises(RecordsError, match="number 6"):
        learned(design, someone)
    someone = replace(someone, trials=(trial(0, "main", -1),))
    with pytest.raises(RecordsError, match="number -1"):
        learned(design, someone)
