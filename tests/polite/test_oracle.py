from dataclasses import replace

import numpy as np
import pytest

from polite.teachers.highlights import paper_candidate
from polite.teachers.oracle import Oracle
from polite.types import Answer, Highlight, InvalidValueError, Query, Segment, SegmentPool

SURE = Oracle(flip_probability=0.0)
ALWAYS_WRONG = Oracle(flip_probability=1.0)
GOOD = np.array([0.0, 1.0, 2.0, 1.0, 0.0, 0.0])
BAD = np.array([0.0, 0.0, -1.0, -2.0, -1.0, 0.0])


def rng(seed=0):
    return np.random.default_rng(seed)


def test_the_higher_return_wins_and_its_extremes_are_marked():
    answer = SURE.answer(4, GOOD, BAD, rng())
    assert answer == Answer(4, (1.0, 0.0), positive=Highlight(2, 5))
    # Even where the winner is bad, only its own moments are marked.
    worse = BAD - 1
    answer = SURE.answer(0, worse, BAD, rng())
    assert answer == Answer(0, (0.0, 1.0), negative=Highlight(3, 5))


def test_swapping_the_segments_swaps_the_preference_only():
    one, two = SURE.answer(0, GOOD, BAD, rng()), SURE.answer(0, BAD, GOOD, rng())
    assert two == replace(one, preference=one.preference[::-1])


@pytest.mark.parametrize("tie", [(0.0, 0.0), (0.5, 0.5)])
def test_returns_within_epsilon_are_a_tie_without_highlights(tie):
    oracle = replace(SURE, tie=tie, tie_threshold=0.5)
    exactly, more = np.append(GOOD, 0.5), np.append(GOOD, 0.625)
    assert oracle.answer(0, GOOD, exactly, rng()) == Answer(0, tie)
    assert oracle.answer(0, GOOD, more, rng()).preferred == 1


def test_the_threshold_does_not_wear_off():
    oracle = replace(SURE, tie_threshold=0.5)
    pool = _pool([GOOD, GOOD + 0.07, BAD])
    queries = [Query(0, 1), Query(0, 2)]
    sessions = [oracle.answer_queries(pool, queries, rng()) for _ in range(3)]
    assert sessions[0] == sessions[1] == sessions[2]
    assert [a.preferred for a in sessions[0]] == [None, 0]


def test_a_flip_takes_its_highlights_from_the_segment_labelled_the_winner():
    answer = ALWAYS_WRONG.answer(0, GOOD, BAD, rng())
    assert answer == Answer(0, (0.0, 1.0), negative=Highlight(3, 5))


def test_the_ablation_leaves_highlights_on_the_better_segment():
    answer = replace(ALWAYS_WRONG, marks_labelled=False).answer(0, GOOD, BAD, rng())
    assert answer == Answer(0, (0.0, 1.0), positive=Highlight(2, 5), marks_other=True)
    assert answer.marked == 0


def test_a_tenth_of_the_preferences_is_flipped_and_ties_never_are():
    generator = rng(1)
    wrong = [Oracle().answer(0, GOOD, BAD, generator).preferred for _ in range(5000)]
    assert np.mean(wrong) == pytest.approx(0.1, abs=0.015)
    assert ALWAYS_WRONG.answer(0, GOOD, GOOD, rng()).preferred is None


def test_one_query_s_highlights_do_not_leak_into_the_next():
    pool = _pool([GOOD, BAD, np.full(6, 0.2), np.zeros(6)])
    marked, plain = SURE.answer_queries(pool, [Query(0, 1), Query(2, 3)], rng())
    assert marked.positive and plain.preferred == 0
    assert plain.positive is None and plain.negative is None


def test_padding_is_not_seen():
    long, short = np.full(6, -0.5), np.array([-0.6, -0.6])
    pool = _pool([long, short])
    pool.rewards[1, 2:] = 99.0
    answer = SURE.answer_queries(pool, [Query(0, 1)], rng())[0]
    assert answer == Answer(0, (0.0, 1.0), negative=Highlight(0, 5))


def test_no_thresholds_no_highlights():
    silent = replace(SURE, positive_threshold=np.inf, negative_threshold=-np.inf)
    assert silent.answer(0, GOOD, BAD, rng()) == Answer(0, (1.0, 0.0))


def test_the_paper_s_form_by_option():
    oracle = replace(SURE, rule=paper_candidate, length=1, positive_threshold=2.5)
    assert oracle.answer(0, GOOD, BAD, rng()).positive == Highlight(2, 1)


@pytest.mark.parametrize(
    "change", [{"tie_threshold": -1.0}, {"flip_probability": 1.1}, {"tie": (1.0, 0.0)}]
)
def test_impossible_settings_are_refused(change):
    with pytest.raises(InvalidValueError, match="flip_probability in"):
        Oracle(**change)


def _pool(rewards):
    segments = [
        Segment(np.zeros((len(r), 1)), np.zeros((len(r), 1)), r, np.zeros((len(r), 1)), 0, 0)
        for r in rewards
    ]
    return SegmentPool.stack(segments, max(map(len, rewards)))
