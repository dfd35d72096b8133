import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from polite.teachers.highlights import (
    paper_candidate,
    passes_sign_test,
    place_highlight,
    released_candidate,
    shuffle_highlights,
    trailing_means,
    trailing_sums,
)
from polite.types import Answer, Highlight, Query, Segment, SegmentPool

REWARDS = np.array([3.0, 0.0, -1.0, 4.0, 2.0, 1.0, -6.0])
SOME_REWARDS = arrays(float, st.integers(1, 20), elements=st.integers(-50, 50).map(float))


def test_trailing_sums_and_means_by_hand():
    np.testing.assert_allclose(trailing_sums(REWARDS, 3), [3, 3, 2, 3, 5, 7, -3])
    np.testing.assert_allclose(trailing_means(REWARDS), [3, 1.5, 2 / 3, 1, 5 / 3, 7 / 3, -1])


def test_released_form_by_hand():
    # Best mean: 3 at step 0. Without that step it is 7/3 at step 5 (4, 2, 1), whose largest is 4.
    assert released_candidate(REWARDS, +1, 5) == (0, 3.0)
    assert released_candidate(REWARDS[1:], +1, 5) == (2, pytest.approx(7 / 3))
    # Worst mean: −1 at step 6 (2, 1, −6), whose smallest is −6.
    assert released_candidate(REWARDS, -1, 5) == (6, pytest.approx(-1.0))


def test_paper_form_by_hand():
    assert paper_candidate(REWARDS, +1, 2) == (5, 7.0)
    assert paper_candidate(REWARDS, -1, 2) == (6, -3.0)
    assert paper_candidate(REWARDS, +1, 0) == (3, 4.0)


@given(SOME_REWARDS, st.integers(0, 10), st.sampled_from([released_candidate, paper_candidate]))
def test_both_forms_are_symmetric_in_the_sign(rewards, length, rule):
    best, worst = rule(rewards, +1, length), rule(-rewards, -1, length)
    assert best.end == worst.end and best.score == pytest.approx(-worst.score)
    assert 0 <= best.end < len(rewards)


@given(SOME_REWARDS, st.integers(0, 10))
def test_the_paper_form_finds_the_best_window_of_all(rewards, length):
    windows = [rewards[Highlight(j, length).window].sum() for j in range(len(rewards))]
    assert paper_candidate(rewards, +1, length).score == pytest.approx(max(windows))
    assert paper_candidate(rewards, -1, length).score == pytest.approx(min(windows))


@pytest.mark.parametrize("rule", [released_candidate, paper_candidate])
def test_a_highlight_needs_a_score_past_the_threshold(rule):
    score = rule(REWARDS, +1, 2).score
    below, barely = score - 1e-6, np.nextafter(score, -np.inf)
    for at in (score, barely, np.inf):  # past it by rounding alone is not past it
        assert place_highlight(REWARDS, +1, 2, at, rule) is None
        assert place_highlight(-REWARDS, -1, 2, -at, rule) is None
    assert place_highlight(REWARDS, +1, 2, below, rule) is not None
    assert place_highlight(-REWARDS, -1, 2, -below, rule) is not None


@pytest.mark.parametrize("pay", [0.1, 0.7, -0.1, -0.02])
def test_where_the_reward_is_flat_rounding_marks_nothing(pay):
    """Differences of a running sum put h⁻ on every clip of an env that pays .1 a step."""
    flat, goal = np.full(50, pay), np.full(50, pay)
    goal[30] += 1.0
    for threshold in (pay, np.mean([pay] * 3), trailing_means(flat)[-1]):
        how = {"length": 5, "threshold": threshold, "rule": released_candidate, "sign_test": False}
        assert place_highlight(flat, +1, **how) is place_highlight(flat, -1, **how) is None
        assert place_highlight(goal, +1, **how) == Highlight(30, 5)
        assert place_highlight(goal, -1, **how) is None
    assert len(set(trailing_sums(goal, 3)[2:30])) == 1


def test_a_highlight_needs_the_right_sign_over_its_own_window():
    # The best three rewards are good, but the window of 6 steps that ends there is not.
    rewards = np.array([-9.0, -9.0, 0.0, 1.0, 1.0, 1.0])
    assert place_highlight(rewards, +1, 5, 0.3, released_candidate) is None
    assert place_highlight(rewards, +1, 0, 0.3, released_candidate) == Highlight(3, 0)
    assert not passes_sign_test(np.zeros(3), Highlight(2, 2), +1)
    assert not passes_sign_test(np.zeros(3), Highlight(2, 2), -1)


def _pool(lengths):
    segments = [
        Segment(np.zeros((n, 1)), np.zeros((n, 1)), np.zeros(n), np.zeros((n, 1)), 0, 0)
        for n in lengths
    ]
    return SegmentPool.stack(segments, max(lengths))


def test_shuffling_deals_the_same_marks_to_the_expressed_answers():
    pool, queries = _pool([50] * 40), [Query(i, i + 1) for i in range(0, 40, 2)]
    answers = [
        Answer(i, (0.0, 0.0), participant=i, seconds=i)
        if i % 5 == 0
        else Answer(i, (1.0, 0.0), Highlight(i, 3), Highlight(i + 20, 3), i, float(i))
        for i in range(20)
    ]
    shuffled = shuffle_highlights(answers, pool, queries, np.random.default_rng(0))

    def marks(some):
        return [(a.positive, a.negative) for a in some if a.preferred is not None]

    assert marks(shuffled) != marks(answers)
    assert sorted(marks(shuffled), key=str) == sorted(marks(answers), key=str)
    for before, after in zip(answers, shuffled, strict=True):
        assert (before.query, before.preference, before.participant, before.seconds) == (
            after.query,
            after.preference,
            after.participant,
            after.seconds,
        )


def test_shuffled_marks_stay_inside_shorter_segments():
    pool, queries = _pool([50, 50, 4, 4]), [Query(0, 1), Query(2, 3)]
    answers = [Answer(0, (1.0, 0.0), Highlight(49, 5)), Answer(1, (0.0, 1.0))]
    ends = set()
    for seed in range(20):
        shuffled = shuffle_highlights(answers, pool, queries, np.random.default_rng(seed))
        ends |= {(a.query, a.positive.end) for a in shuffled if a.positive}
    assert ends == {(0, 49), (1, 3)}


def test_shuffling_nothing_gives_nothing():
    assert shuffle_highlights([], _pool([5, 5]), [Query(0, 1)], np.random.default_rng(0)) == []
