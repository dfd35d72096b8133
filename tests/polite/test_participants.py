from dataclasses import fields, replace

import numpy as np
import pytest

from polite.samplers import uniform_pairs
from polite.teachers.participants import (
    BASELINE,
    POLITE,
    Participant,
    PopulationConfig,
    answer_queries,
    calibrated_inputs,
    draw_population,
    total_minutes,
)
from polite.types import InvalidValueError, SegmentPool

STEPS = 30
MANY = 4000
PERFECT = Participant(
    rationality=1e9,
    slip_rate=0.0,
    skip_rate=0.0,
    positive_rate=1.0,
    negative_rate=1.0,
    seconds=60.0,
)


def make_pool(size=200, seed=0):
    rng = np.random.default_rng(seed)
    rewards = rng.normal(rng.normal(0.0, 0.2, size=(size, 1)), 1.0, (size, STEPS))
    return SegmentPool(
        observations=np.zeros((size, STEPS, 1)),
        actions=np.zeros((size, STEPS, 1)),
        rewards=rewards,
        states=np.zeros((size, STEPS, 1)),
        lengths=np.full(size, STEPS),
        trajectory=np.zeros(size),
        start=np.zeros(size),
    )


POOL = make_pool()
QUERIES = uniform_pairs(400, np.random.default_rng(1), POOL)
DIFFERENCES = np.array([POOL.returns[q.first] - POOL.returns[q.second] for q in QUERIES])


def study(config=POLITE, people=None, seed=0):
    rng = np.random.default_rng(seed)
    people = people or draw_population(config, 20, rng)
    return answer_queries(people, POOL, QUERIES, rng, config)


def everyone(config=POLITE, **traits):
    return study(config, [replace(PERFECT, **traits)] * 20)


def share(answers, of=lambda a: a.preferred is not None, among=None):
    counted = [a for a in answers if among is None or among(a)]
    return np.mean([of(a) for a in counted])


def expressed(answer):
    return answer.preferred is not None


def test_the_published_rates_are_the_means_of_the_population():
    assert POLITE.skip_rate == 28 / 400 and BASELINE.skip_rate == 66 / 400
    assert POLITE.positive_rate == pytest.approx(0.6344, abs=1e-4)
    assert POLITE.negative_rate == pytest.approx(0.4731, abs=1e-4)
    for config in (POLITE, BASELINE):
        people = draw_population(config, MANY, np.random.default_rng(0))
        for name in ("skip_rate", "positive_rate", "negative_rate", "slip_rate"):
            drawn = [getattr(person, name) for person in people]
            assert np.mean(drawn) == pytest.approx(getattr(config, name), abs=0.006), name
            assert np.std(drawn) > 0


def test_rationality_is_lognormal_around_its_median():
    betas = [p.rationality for p in draw_population(POLITE, MANY, np.random.default_rng(0))]
    assert np.median(betas) == pytest.approx(POLITE.rationality, rel=0.03)
    assert np.std(np.log(betas)) == pytest.approx(POLITE.rationality_spread, rel=0.05)


@pytest.mark.parametrize("config", [POLITE, BASELINE])
def test_whole_durations_have_the_published_mean_and_spread(config):
    rng = np.random.default_rng(0)
    queries = QUERIES * 10
    minutes = np.concatenate(
        [
            total_minutes(
                answer_queries(draw_population(config, 200, rng), POOL, queries, rng, config),
                config,
            )
            for _ in range(5)
        ]
    )
    assert minutes.mean() == pytest.approx(config.study_minutes, rel=0.04)
    assert minutes.std() == pytest.approx(config.study_minutes_sd, rel=0.12)
    assert minutes.min() > config.tutorial_minutes


@pytest.mark.parametrize("config", [POLITE, BASELINE])
def test_answered_rates_match_the_calibration(config):
    answers = [answer for seed in range(15) for answer in study(config, seed=seed)]
    assert 1 - share(answers) == pytest.approx(config.skip_rate, abs=0.015)
    expected = (config.positive_rate, config.negative_rate) if config.highlights else (0.0, 0.0)
    positive = share(answers, lambda a: a.positive is not None, among=expressed)
    negative = share(answers, lambda a: a.negative is not None, among=expressed)
    assert (positive, negative) == pytest.approx(expected, abs=0.04)
    equal = share(answers, lambda a: sum(a.preference) == 1, among=lambda a: not expressed(a))
    assert equal == pytest.approx(0.5, abs=0.06)


def test_the_pairs_that_differ_least_are_skipped():
    answers = everyone(skip_rate=0.25)
    skipped = np.array([answer.preferred is None for answer in answers])
    assert skipped.mean() == 0.25
    assert abs(DIFFERENCES[skipped]).max() < abs(DIFFERENCES[~skipped]).min()


def test_a_perfect_participant_prefers_the_higher_return():
    preferred = [answer.preferred for answer in everyone()]
    np.testing.assert_array_equal(preferred, (DIFFERENCES < 0).astype(int))


def test_choices_follow_boltzmann_and_are_really_stochastic():
    scale, beta = POOL.returns.std(), 2.0
    firsts = np.mean(
        [
            [a.preferred == 0 for a in study(POLITE, [replace(PERFECT, rationality=beta)] * 20, s)]
            for s in range(100)
        ],
        axis=0,
    )
    expected = 1 / (1 + np.exp(-beta * DIFFERENCES / scale))
    assert np.mean(firsts - expected) == pytest.approx(0, abs=0.01)
    assert np.sqrt(np.mean((firsts - expected) ** 2)) < 0.05
    undecided = abs(expected - 0.5) < 0.3
    assert ((firsts > 0) & (firsts < 1))[undecided].all()


def test_a_slip_is_a_coin_toss():
    preferred = [answer.preferred for answer in everyone(slip_rate=1.0)]
    right = np.array(preferred) == (DIFFERENCES < 0)
    assert right.mean() == pytest.approx(0.5, abs=0.08)


def test_marks_lie_near_the_right_moment_with_the_right_sign():
    config = replace(POLITE, highlight_length=4)
    for answer in everyone(config):
        query = QUERIES[answer.query]
        rewards = POOL.rewards[(query.first, query.second)[answer.preferred]]
        for sign, mark in ((1, answer.positive), (-1, answer.negative)):
            if mark is None:
                continue
            nearby = [mark.end + offset for offset in (-2, -1, 0, 1, 2)]
            windows = [rewards[max(0, j - 4) : j + 1].sum() for j in nearby if 0 <= j < STEPS]
            assert max(sign * np.array(windows)) > 0
            assert mark.length == 4 and 0 <= mark.end < STEPS


def test_the_more_willing_mark_more_and_keep_what_the_others_mark():
    few, many = everyone(positive_rate=0.3), everyone(positive_rate=0.6)
    marked = [{a.query for a in some if a.positive} for some in (few, many)]
    assert marked[0] < marked[1]
    assert len(marked[0]) / 400 == pytest.approx(0.3, abs=0.02)


def test_the_sign_test_caps_even_the_most_willing():
    pool = replace(POOL, rewards=abs(POOL.rewards))
    rng = np.random.default_rng(0)
    answers = answer_queries([PERFECT] * 20, pool, QUERIES, rng, POLITE)
    assert share(answers, lambda a: a.positive is not None) > 0.99
    assert share(answers, lambda a: a.negative is not None) == 0


def test_the_baseline_condition_has_no_highlights():
    assert not any(answer.positive or answer.negative for answer in everyone(BASELINE))


def test_participants_answer_blocks_of_twenty_in_order():
    answers = study()
    assert [answer.query for answer in answers] == list(range(400))
    assert [answer.participant for answer in answers] == [i // 20 for i in range(400)]


def test_equal_seeds_give_equal_answers():
    assert study(seed=5) == study(seed=5) != study(seed=6)


def test_a_pool_without_differences_is_skipped_not_divided_by():
    pool = replace(POOL, rewards=np.zeros_like(POOL.rewards))
    rng = np.random.default_rng(0)
    answers = answer_queries([replace(PERFECT, skip_rate=0.1)] * 20, pool, QUERIES, rng, POLITE)
    assert not any(map(expressed, answers))


def test_every_number_that_is_put_in_is_listed_with_its_source():
    polite, baseline = calibrated_inputs(POLITE), calibrated_inputs(BASELINE)
    settings = {field.name for field in fields(PopulationConfig)} - {"highlights"}
    assert set(polite) == settings
    assert settings - set(baseline) == {
        "positive_rate",
        "negative_rate",
        "jitter",
        "highlight_length",
    }
    for name, entry in polite.items():
        assert entry["value"] == getattr(POLITE, name) and entry["source"]


def test_queries_that_do_not_divide_among_participants_are_refused():
    rng = np.random.default_rng(0)
    with pytest.raises(InvalidValueError, match="20 queries for each of 3 participants, got 400"):
        answer_queries([PERFECT] * 3, POOL, QUERIES, rng, POLITE)


@pytest.mark.parametrize(
    "change",
    [
        {"skip_rate": 0.0},
        {"slip_rate": 1.0},
        {"equal_share": 1.2},
        {"concentration": 0.0},
        {"jitter": 0},
        {"answers": 0},
        {"tutorial_minutes": 30.0},
        {"pace_variation": 5.0},
    ],
)
def test_impossible_settings_are_refused(change):
    with pytest.raises(InvalidValueError, match="expected rates in"):
        replace(POLITE, **change)
