from dataclasses import replace
from math import exp, inf, nan, sqrt

import numpy as np
import pytest

from polite.teachers.bpref import (
    BPREF_TEACHERS,
    BPrefTeacher,
    adaptive_threshold,
    myopic_return,
    prefers_first,
)
from polite.teachers.highlights import paper_candidate
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

ORACLE = BPrefTeacher()
GOOD = np.array([0.0, 1.0, 2.0, 1.0, 0.0, 0.0])
BAD = np.array([0.0, 0.0, -1.0, -2.0, -1.0, 0.0])


def rng(seed=0):
    return np.random.default_rng(seed)


def pool_of(*rewards):
    segments = [
        Segment(np.zeros((len(r), 1)), np.zeros((len(r), 1)), r, np.zeros((len(r), 1)), 0, 0)
        for r in rewards
    ]
    return SegmentPool.stack(segments, max(map(len, rewards)))


def answers_to(teacher, pool, query, count, seed):
    return teacher.answer_queries(pool, [query] * count, rng(seed))


def assert_rate(outcomes, probability):
    """Within four standard deviations of a binomial count."""
    count = len(outcomes)
    spread = sqrt(count * probability * (1 - probability))
    assert abs(sum(outcomes) - count * probability) <= 4 * spread


def test_the_oracle_is_polite_s_without_ties_and_flips():
    polite = Oracle(tie_threshold=0.0, flip_probability=0.0)
    rewards = [rng(seed).normal(0.1, 1.0, size=20) for seed in range(30)]
    pool = pool_of(*rewards)
    queries = [Query(i, (i + 7) % 30) for i in range(30)]
    answers = ORACLE.answer_queries(pool, queries, rng())
    assert answers == polite.answer_queries(pool, queries, rng())
    assert {a.preferred for a in answers} == {0, 1} and any(a.positive for a in answers)


def test_the_benchmark_s_teachers_differ_from_the_oracle_by_one_number_each():
    expected = {
        "oracle": ORACLE,
        "stochastic": replace(ORACLE, rationality=1.0),
        "myopic": replace(ORACLE, discount=0.9),
        "skip": replace(ORACLE, epsilon_skip=0.1),
        "equal": replace(ORACLE, epsilon_equal=0.1),
        "mistake": replace(ORACLE, mistake_probability=0.1),
    }
    assert expected == BPREF_TEACHERS


@pytest.mark.parametrize("teacher", BPREF_TEACHERS.values(), ids=BPREF_TEACHERS)
def test_equal_generators_give_equal_answers(teacher):
    pool = pool_of(*[rng(seed).normal(0.2, 0.3, size=10) for seed in range(12)])
    queries = [Query(i, j) for i in range(12) for j in range(12) if i != j]
    one = teacher.answer_queries(pool, queries, rng(3))
    assert one == teacher.answer_queries(pool, queries, rng(3))
    assert [answer.query for answer in one] == list(range(len(queries)))


# Boltzmann choice


@pytest.mark.parametrize("rationality", [0.0, 0.5, 1.0, 3.0])
def test_the_stochastic_teacher_prefers_as_often_as_its_equation_says(rationality):
    pool = pool_of(np.array([0.5, 0.4]), np.array([0.1, 0.1]))
    returns = 0.9, 0.2
    weights = [exp(rationality * r) for r in returns]
    teacher = BPrefTeacher(rationality=rationality)
    answers = answers_to(teacher, pool, Query(0, 1), 2000, seed=1)
    assert_rate([a.preference == FIRST for a in answers], weights[0] / sum(weights))
    answers = answers_to(teacher, pool, Query(1, 0), 2000, seed=2)
    assert_rate([a.preference == FIRST for a in answers], weights[1] / sum(weights))


def test_a_choice_neither_overflows_nor_meets_infinity_times_zero():
    assert prefers_first(1e308, 1e10, rng()) and not prefers_first(-1e308, 1e10, rng())
    assert prefers_first(1e-300, inf, rng()) and not prefers_first(-1e-300, inf, rng())
    generator = rng(4)
    assert_rate([prefers_first(0.0, inf, generator) for _ in range(2000)], 0.5)


def test_a_coin_decides_exact_ties_of_the_oracle():
    answers = answers_to(ORACLE, pool_of(GOOD, GOOD), Query(0, 1), 2000, seed=5)
    assert all(a.preferred is not None for a in answers)
    assert_rate([a.preference == FIRST for a in answers], 0.5)


# Mistakes


@pytest.mark.parametrize("probability", [0.1, 0.35])
def test_mistakes_come_at_their_rate(probability):
    teacher = BPrefTeacher(mistake_probability=probability)
    for query, right in ((Query(0, 1), FIRST), (Query(1, 0), SECOND)):
        answers = answers_to(teacher, pool_of(GOOD, BAD), query, 2000, seed=6)
        assert_rate([a.preference != right for a in answers], probability)


def test_mistakes_are_made_on_top_of_the_stochastic_choice():
    teacher = BPrefTeacher(rationality=1.0, mistake_probability=0.2)
    right = 1 / (1 + exp(-1.0))
    pool = pool_of(np.array([1.0]), np.array([0.0]))
    answers = answers_to(teacher, pool, Query(0, 1), 2000, seed=7)
    assert_rate([a.preference == FIRST for a in answers], 0.8 * right + 0.2 * (1 - right))


def test_who_always_errs_marks_the_segment_labelled_the_winner():
    wrong = BPrefTeacher(mistake_probability=1.0)
    pool, query = pool_of(GOOD, BAD), [Query(0, 1)]
    (answer,) = wrong.answer_queries(pool, query, rng())
    assert answer == Answer(0, SECOND, negative=Highlight(3, 5))
    (answer,) = replace(wrong, marks_labelled=False).answer_queries(pool, query, rng())
    assert answer == Answer(0, SECOND, positive=Highlight(2, 5), marks_other=True)


def test_settings_change_only_the_answers_that_they_concern():
    rewards = [rng(seed).normal(0.5, 0.5, size=10) for seed in range(20)]
    pool = pool_of(*rewards)
    queries = [Query(i, j) for i in range(20) for j in range(20) if i != j]
    stochastic = BPrefTeacher(rationality=0.3)
    plain = stochastic.answer_queries(pool, queries, rng(8))
    picky = replace(stochastic, epsilon_skip=0.8, epsilon_equal=0.2)
    answers = picky.answer_queries(pool, queries, rng(8))
    changed = [a for a, b in zip(answers, plain, strict=True) if a != b]
    assert 0 < len(changed) < len(queries)
    assert all(a.preferred is None for a in changed)


# Skipped and equal


@pytest.mark.parametrize(
    ("returns", "preference"),
    [
        ((1.0, 1.5), UNRELATED),
        ((1.5, 1.75), UNRELATED),
        ((1.0, 2.0), SECOND),  # the larger is not below .2 · 10
        ((2.5, 1.0), FIRST),
        ((-9.0, 1.0), UNRELATED),
        ((1.0, 1.0), UNRELATED),
    ],
)
def test_a_pair_is_skipped_if_both_returns_are_below_the_threshold(returns, preference):
    teacher = BPrefTeacher(epsilon_skip=0.2, average_return=10.0)
    (answer,) = teacher.answer_queries(pool_of(*_single(returns)), [Query(0, 1)], rng())
    assert answer.preference == preference


@pytest.mark.parametrize(
    ("returns", "preference"),
    [
        ((5.0, 5.0), EQUAL),
        ((5.0, 6.75), EQUAL),
        ((-6.75, -5.0), EQUAL),
        ((5.0, 7.0), SECOND),  # the difference is not below .2 · 10
        ((7.25, 5.0), FIRST),
    ],
)
def test_a_pair_is_equal_if_its_returns_differ_by_less_than_the_threshold(returns, preference):
    teacher = BPrefTeacher(epsilon_equal=0.2, average_return=10.0)
    (answer,) = teacher.answer_queries(pool_of(*_single(returns)), [Query(0, 1)], rng())
    assert answer.preference == preference


def test_skipping_comes_before_equality_and_neither_is_ever_mistaken():
    teacher = BPrefTeacher(
        epsilon_skip=0.5, epsilon_equal=0.5, mistake_probability=1.0, average_return=4.0
    )
    pool = pool_of(*_single([1.0, 1.5, 3.0, 3.5]))
    answers = teacher.answer_queries(pool, [Query(0, 1), Query(2, 3)], rng())
    assert answers == [Answer(0, UNRELATED), Answer(1, EQUAL)]


def test_skipped_and_equal_pairs_are_as_frequent_as_the_returns_imply():
    returns = rng(9).uniform(0.0, 2.0, size=400)  # R̄ = 1
    pool = pool_of(*_single(returns))
    pairs = rng(10).permuted(np.tile(np.arange(400), (2000, 1)), axis=1)[:, :2]
    queries = [Query(int(a), int(b)) for a, b in pairs]
    teacher = BPrefTeacher(epsilon_skip=0.4, average_return=1.0)
    answers = teacher.answer_queries(pool, queries, rng())
    assert_rate([a.preference == UNRELATED for a in answers], np.mean(returns < 0.4) ** 2)
    teacher = BPrefTeacher(epsilon_equal=0.4, average_return=1.0)
    answers = teacher.answer_queries(pool, queries, rng())
    apart = abs(returns[:, None] - returns)
    equal = (np.sum(apart < 0.4) - 400) / (400 * 399)
    assert_rate([a.preference == EQUAL for a in answers], equal)


def test_thresholds_follow_the_average_return_of_the_pool():
    teacher = BPrefTeacher(epsilon_skip=0.5)
    query = [Query(0, 1)]
    poor = pool_of(*_single([1.0, 1.5, 2.0]))  # R̄ = 1.5
    rich = pool_of(*_single([1.0, 1.5, 9.5]))  # R̄ = 4
    assert teacher.answer_queries(poor, query, rng())[0].preference == SECOND
    assert teacher.answer_queries(rich, query, rng())[0].preference == UNRELATED
    assert replace(teacher, average_return=1.0).answer_queries(rich, query, rng())[0].preferred == 1


def test_a_negative_average_return_switches_both_thresholds_off():
    assert adaptive_threshold(0.5, 4.0) == 2.0
    assert adaptive_threshold(0.5, -4.0) == adaptive_threshold(0.0, 4.0) == -inf
    teacher = BPrefTeacher(epsilon_skip=1.0, epsilon_equal=1.0)
    (answer,) = teacher.answer_queries(pool_of(*_single([-5.0, -4.0])), [Query(0, 1)], rng())
    assert answer.preference == SECOND


# Myopia


def test_the_last_step_counts_in_full_and_earlier_ones_less():
    rewards = np.array([3.0, 5.0, 7.0])
    assert myopic_return(rewards, 0.5) == 0.25 * 3 + 0.5 * 5 + 7
    assert myopic_return(rewards, 1.0) == 15.0
    assert myopic_return(rewards[:1], 0.5) == 3.0


def test_the_myopic_teacher_may_prefer_the_lower_return():
    early, late = np.array([3.0, 0.0, 0.0]), np.array([0.0, 0.0, 2.0])
    pool, query = pool_of(early, late), [Query(0, 1)]
    assert ORACLE.answer_queries(pool, query, rng())[0].preferred == 0
    myopic = BPrefTeacher(discount=0.5)
    assert myopic.answer_queries(pool, query, rng())[0].preferred == 1
    # Whether a pair is skipped or equal is a matter of the plain returns.
    myopic = replace(myopic, epsilon_skip=0.25, average_return=10.0)
    assert myopic.answer_queries(pool, query, rng())[0].preferred == 1
    myopic = replace(myopic, epsilon_equal=0.125)
    assert myopic.answer_queries(pool, query, rng())[0].preference == EQUAL


def test_boltzmann_choice_is_between_myopic_returns():
    pool = pool_of(np.array([1.0, 0.0]), np.array([0.0, 1.0]))
    teacher = BPrefTeacher(rationality=2.0, discount=0.5)
    answers = answers_to(teacher, pool, Query(0, 1), 2000, seed=11)
    assert_rate([a.preference == FIRST for a in answers], 1 / (1 + exp(1.0)))


# Padding and highlights


@pytest.mark.parametrize("discount", [1.0, 0.5])
def test_padding_is_not_seen(discount):
    teacher = BPrefTeacher(discount=discount, epsilon_skip=0.9, epsilon_equal=0.4)
    pool = pool_of(np.array([1.0, 1.0, 1.0, 1.0]), np.array([4.0, 2.5]))
    clean = teacher.answer_queries(pool, [Query(0, 1)], rng())
    pool.rewards[1, 2:] = 99.0
    assert teacher.answer_queries(pool, [Query(0, 1)], rng()) == clean
    # γ counts back from the last real step: 4 γ + 2.5, whatever the padding.
    assert clean[0].preference == SECOND and clean[0].positive == Highlight(0, 5)


def test_no_preference_no_highlights_and_no_queries_no_answers():
    teacher = BPrefTeacher(epsilon_equal=1.0, average_return=100.0)
    pool = pool_of(GOOD, BAD)
    assert teacher.answer_queries(pool, [Query(0, 1)], rng()) == [Answer(0, EQUAL)]
    assert teacher.answer_queries(pool, [], rng()) == []


def test_highlights_are_placed_like_those_of_an_oracle():
    oracle = Oracle(positive_threshold=2.5, negative_threshold=-9.0, length=1, rule=paper_candidate)
    teacher = BPREF_TEACHERS["mistake"].marking_like(oracle)
    assert teacher.mistake_probability == 0.1
    teacher = replace(teacher, mistake_probability=0.0)
    (answer,) = teacher.answer_queries(pool_of(GOOD, BAD), [Query(0, 1)], rng())
    assert answer == Answer(0, FIRST, positive=Highlight(2, 1))
    assert not ORACLE.marking_like(replace(oracle, marks_labelled=False)).marks_labelled


@pytest.mark.parametrize(
    "change",
    [
        {"rationality": -1.0},
        {"rationality": nan},
        {"discount": 0.0},
        {"discount": 1.01},
        {"discount": nan},
        {"mistake_probability": 1.1},
        {"mistake_probability": nan},
        {"epsilon_skip": -0.1},
        {"epsilon_skip": 1.5},
        {"epsilon_equal": -0.1},
        {"epsilon_equal": 1.5},
        {"average_return": -1.0},
        {"average_return": inf},
        {"average_return": nan},
    ],
    ids=str,
)
def test_impossible_settings_are_refused(change):
    with pytest.raises(InvalidValueError, match="expected rationality ≥ 0"):
        BPrefTeacher(**change)


@pytest.mark.parametrize("teacher", [BPrefTeacher, Oracle])
@pytest.mark.parametrize(
    "change", [{"positive_threshold": nan}, {"negative_threshold": nan}, {"length": -1}], ids=str
)
def test_impossible_marking_is_refused(teacher, change):
    with pytest.raises(InvalidValueError, match="expected length ≥ 0"):
        teacher(**change)


def _single(returns):
    return [np.array([value]) for value in returns]
