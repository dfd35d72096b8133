from dataclasses import replace
from math import nan, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polite.teachers.bpref import BPrefTeacher
from polite.teachers.noise import (
    HighlightNoise,
    NoisyHighlights,
    ShuffledHighlights,
    perturb_highlights,
    shifted_end,
)
from polite.teachers.oracle import Oracle
from polite.types import (
    EQUAL,
    FIRST,
    SECOND,
    UNRELATED,
    Answer,
    Highlight,
    InvalidValueError,
    Query,
    Segment,
    SegmentPool,
)

COUNT = 4000
BOTH = Answer(0, FIRST, positive=Highlight(5, 3), negative=Highlight(12, 3))


def rng(seed=0):
    return np.random.default_rng(seed)


def pool_of(*lengths):
    segments = []
    for number, steps in enumerate(lengths):
        rewards = rng(number).normal(0.0, 1.0, size=steps)
        zeros = np.zeros((steps, 1))
        segments.append(Segment(zeros, zeros, rewards, zeros, 0, 0))
    return SegmentPool.stack(segments, max(lengths))


def perturbed(answer, noise, seed=1, lengths=(20, 20)):
    """Many copies of one answer, each with noise of its own."""
    return perturb_highlights([answer] * COUNT, pool_of(*lengths), [Query(0, 1)], noise, rng(seed))


def assert_rate(outcomes, probability):
    """Within four standard deviations of a binomial count."""
    count = len(outcomes)
    spread = sqrt(count * probability * (1 - probability))
    assert abs(sum(outcomes) - count * probability) <= 4 * spread


def test_without_noise_the_answers_stay_as_they_are():
    answers = [BOTH, Answer(0, EQUAL), Answer(0, UNRELATED), Answer(0, SECOND, seconds=3.0)]
    pool = pool_of(20, 20)
    assert perturb_highlights(answers, pool, [Query(0, 1)], HighlightNoise(), rng()) == answers
    assert perturb_highlights([], pool, [Query(0, 1)], HighlightNoise(), rng()) == []


def test_each_highlight_is_missed_at_its_rate_by_itself():
    answers = perturbed(BOTH, HighlightNoise(miss_probability=0.3))
    no_positive = [a.positive is None for a in answers]
    no_negative = [a.negative is None for a in answers]
    assert_rate(no_positive, 0.3)
    assert_rate(no_negative, 0.3)
    assert_rate([p and n for p, n in zip(no_positive, no_negative, strict=True)], 0.09)
    assert {a.positive for a in answers} == {None, BOTH.positive}


def test_signs_are_mixed_up_at_their_rate():
    noise = HighlightNoise(wrong_sign_probability=0.2)
    swapped = replace(BOTH, positive=BOTH.negative, negative=BOTH.positive)
    answers = perturbed(BOTH, noise)
    assert all(a in (BOTH, swapped) for a in answers)
    assert_rate([a == swapped for a in answers], 0.2)
    alone = replace(BOTH, negative=None)
    answers = perturbed(alone, noise, seed=2)
    assert_rate([a.negative == alone.positive and a.positive is None for a in answers], 0.2)


def test_windows_are_shifted_at_their_rate_to_every_step_within_reach():
    answers = perturbed(BOTH, HighlightNoise(shift_probability=0.4, shift=3))
    ends = np.array([a.positive.end for a in answers])
    assert_rate(ends != 5, 0.4)
    for end in (2, 3, 4, 6, 7, 8):
        assert_rate(ends == end, 0.4 / 6)
    assert {a.positive.length for a in answers} == {3}
    moved = [a.negative.end != 12 for a in answers]
    assert_rate(moved, 0.4)
    assert_rate([m and e != 5 for m, e in zip(moved, ends, strict=True)], 0.16)


def test_the_kinds_of_noise_are_independent():
    noise = HighlightNoise(
        miss_probability=0.2, wrong_sign_probability=0.3, shift_probability=0.5, shift=2
    )
    answers = perturbed(replace(BOTH, negative=None), noise)
    assert_rate([a.positive is None and a.negative is None for a in answers], 0.2)
    assert_rate([a.negative is not None for a in answers], 0.8 * 0.3)
    wrong_and_moved = [a.negative is not None and a.negative.end != 5 for a in answers]
    assert_rate(wrong_and_moved, 0.8 * 0.3 * 0.5)


def test_a_shift_stays_within_the_marked_segment_s_real_steps():
    always = HighlightNoise(shift_probability=1.0, shift=10)
    first = replace(BOTH, positive=Highlight(5, 3), negative=None)
    second = replace(first, preference=SECOND, positive=Highlight(2, 3))
    other = replace(second, preference=FIRST, marks_other=True)
    seen = {
        answer: {a.positive.end for a in perturbed(answer, always, lengths=(7, 3))}
        for answer in (first, second, other)
    }
    assert seen == {first: {0, 1, 2, 3, 4, 6}, second: {0, 1}, other: {0, 1}}


def test_a_segment_of_one_step_has_nowhere_to_shift_to():
    answer = Answer(0, FIRST, positive=Highlight(0, 3))
    noise = HighlightNoise(shift_probability=1.0)
    assert set(perturbed(answer, noise, lengths=(1, 4))) == {answer}


@given(
    last=st.integers(1, 60),
    shift=st.integers(1, 80),
    draw=st.floats(0, 1, exclude_max=True),
    data=st.data(),
)
def test_a_shifted_end_is_another_step_within_reach(last, shift, draw, data):
    end = data.draw(st.integers(0, last))
    moved = shifted_end(end, last, shift, draw)
    assert 0 <= moved <= last and 1 <= abs(moved - end) <= shift


@pytest.mark.parametrize(
    "teacher", [Oracle(), BPrefTeacher(rationality=1.0, epsilon_equal=0.5, average_return=2.0)]
)
def test_noise_over_any_teacher_leaves_the_preferences_alone(teacher):
    pool = pool_of(*[20] * 12)
    queries = [Query(i, j) for i in range(12) for j in range(12) if i != j]
    noise = HighlightNoise(
        miss_probability=0.5, wrong_sign_probability=0.5, shift_probability=0.5, shift=4
    )
    noisy = NoisyHighlights(teacher.answer_queries, noise)
    clean = teacher.answer_queries(pool, queries, rng(3))
    answers = noisy.answer_queries(pool, queries, rng(3))
    assert answers == noisy.answer_queries(pool, queries, rng(3))
    assert [(a.query, a.preference) for a in answers] == [(a.query, a.preference) for a in clean]
    assert answers != clean
    # And noise can be put over noise.
    nothing = NoisyHighlights(noisy.answer_queries, HighlightNoise(miss_probability=1.0))
    answers = nothing.answer_queries(pool, queries, rng(3))
    assert not any(a.positive or a.negative for a in answers)


@pytest.mark.parametrize(
    "change",
    [
        {"miss_probability": 1.1},
        {"miss_probability": nan},
        {"wrong_sign_probability": -0.1},
        {"shift_probability": 2.0},
        {"shift": 0},
    ],
    ids=str,
)
def test_impossible_settings_are_refused(change):
    with pytest.raises(InvalidValueError, match=r"probabilities in \[0, 1\]"):
        HighlightNoise(**change)


def test_shuffled_highlights_are_those_of_other_answers_and_preferences_stay():
    pool = pool_of(*[20] * 12)
    queries = [Query(i, j) for i in range(12) for j in range(12) if i != j]
    teacher = Oracle(positive_threshold=0.5, negative_threshold=-0.5, length=3)
    clean = teacher.answer_queries(pool, queries, rng(3))
    answers = ShuffledHighlights(teacher.answer_queries).answer_queries(pool, queries, rng(3))
    assert [(a.query, a.preference) for a in answers] == [(a.query, a.preference) for a in clean]
    before, after = ([(a.positive, a.negative) for a in some] for some in (clean, answers))
    assert sorted(before, key=str) == sorted(after, key=str)
    moved = [b != a for b, a in zip(before, after, strict=True)]
    assert sum(moved) > len(moved) / 2
    again = ShuffledHighlights(teacher.answer_queries).answer_queries(pool, queries, rng(3))
    assert answers == again
