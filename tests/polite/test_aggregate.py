"""Numbers over runs: hand-computed values, symmetries, and coverage of the intervals."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from polite.analysis.aggregate import (
    bootstrap_interval,
    interquartile_mean,
    normalised,
    probability_of_improvement,
)
from polite.analysis.query_budget import queries_to_reach
from polite.analysis.run_curves import (
    areas,
    common_grid,
    mean_curve,
    on_grid,
    return_at,
    steps_to_reach,
)
from polite.analysis.statistics import (
    ratio_of_means,
    welch_contrast,
    welch_difference,
)
from polite.experiments.benchmark.record import curve_of, final_return
from polite.report.benchmark_words import reached_words

VALUES = st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=8)


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


def curve(returns: list[float], episodes: list[int] | None = None) -> dict[str, list[float]]:
    """Points at 100, 200, … steps."""
    steps = [100.0 * (k + 1) for k in range(len(returns))]
    return {"steps": steps, "return": returns, "episodes": episodes or [1] * len(returns)}


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([3.0], 3.0),
        ([1.0, 2.0, 9.0], 4.0),  # fewer than four: the plain mean
        ([100.0, 1.0, 2.0, 3.0, -50.0], 2.0),  # one cut off at each end
        ([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 700.0], 3.5),  # two at each end
    ],
)
def test_interquartile_mean_by_hand(values: list[float], expected: float) -> None:
    assert interquartile_mean(np.array(values)) == pytest.approx(expected)


def test_interquartile_mean_of_nothing_and_of_rows() -> None:
    assert np.isnan(interquartile_mean(np.zeros(0)))
    rows = np.array([[4.0, 1.0, 2.0, 3.0], [0.0, 0.0, 8.0, 8.0]])
    np.testing.assert_allclose(interquartile_mean(rows), [2.5, 4.0])


def test_bootstrap_resamples_within_strata() -> None:
    far = [np.array([0.0, 0.0, 0.0]), np.array([100.0, 100.0, 100.0])]
    estimate = bootstrap_interval(far, lambda values: values.mean(axis=-1), rng())
    # every sample keeps three runs of each task, so that its mean cannot move
    assert (estimate.mean, estimate.low, estimate.high) == (50.0, 50.0, 50.0)


def test_bootstrap_needs_two_runs_and_is_the_same_for_equal_generators() -> None:
    lone = bootstrap_interval([np.array([1.0])], interquartile_mean, rng())
    assert (lone.mean, lone.low, lone.high) == (1.0, -np.inf, np.inf)
    assert np.isnan(bootstrap_interval([], interquartile_mean, rng()).mean)
    values = [np.arange(6.0)]
    first, second = (bootstrap_interval(values, interquartile_mean, rng()) for _ in range(2))
    assert first == second
    assert first.low < first.mean < first.high


def test_bootstrap_covers_less_than_welch_as_its_docstring_says() -> None:
    # 400 differences of two means of five normal values: about 88% against about 95%.
    draw, inside = np.random.default_rng(5), np.zeros(2)
    for _ in range(400):
        x, y = draw.normal(size=(2, 5))
        samples = [draw.choice(v, (400, 5)).mean(axis=1) for v in (x, y)]
        low, high = np.quantile(samples[0] - samples[1], [0.025, 0.975])
        welch = welch_difference(x, y)
        inside += [low <= 0 <= high, welch.low <= 0 <= welch.high]
    bootstrap, welch_share = inside / 400
    assert 0.82 < bootstrap < 0.92
    assert 0.92 < welch_share < 0.98


def test_probability_of_improvement_by_hand() -> None:
    x, y = np.array([1.0, 3.0]), np.array([1.0, 2.0, 0.0])
    # 1 > 0 and 1 = 1: 1.5 of 3; 3 is above all: 3 of 3
    assert probability_of_improvement([(x, y)], rng()).mean == pytest.approx(4.5 / 6)
    sure = probability_of_improvement([(x + 10, y)], rng())
    assert (sure.mean, sure.low, sure.high) == (1.0, 1.0, 1.0)
    both = probability_of_improvement([(x + 10, y), (y, x + 10)], rng())
    assert both.mean == pytest.approx(0.5)
    assert np.isnan(probability_of_improvement([(x, np.zeros(0))], rng()).mean)
    assert probability_of_improvement([(x, y[:1])], rng()).low == -np.inf


@given(VALUES, VALUES)
def test_probability_of_improvement_and_its_reverse_add_up_to_one(
    x: list[float], y: list[float]
) -> None:
    forth = probability_of_improvement([(np.array(x), np.array(y))], rng(), draws=20)
    back = probability_of_improvement([(np.array(y), np.array(x))], rng(), draws=20)
    assert forth.mean + back.mean == pytest.approx(1.0)
    assert 0.0 <= forth.low <= forth.high <= 1.0


def test_normalised_score_is_0_untrained_and_1_at_the_ceiling() -> None:
    scores = normalised(np.array([100.0, 600.0, 1100.0]), np.array([50.0, 150.0]), np.array([1100]))
    np.testing.assert_allclose(scores, [0.0, 0.5, 1.0])
    assert np.isnan(normalised(np.ones(2), np.ones(2), np.zeros(0))).all()
    assert np.isnan(normalised(np.ones(2), np.ones(2), np.ones(2))).all()


@given(VALUES, VALUES)
def test_a_contrast_of_two_is_their_difference(x: list[float], y: list[float]) -> None:
    first, second = np.array(x), np.array(y)
    assert welch_contrast([first, second], [1, -1]) == welch_difference(first, second)


def test_contrast_of_four_by_hand() -> None:
    cells = [np.array([m - 1.0, m, m + 1.0]) for m in (10.0, 6.0, 3.0, 1.0)]
    estimate = welch_contrast(cells, [1, -1, -1, 1])
    # variance 1/3 each, so a standard error of sqrt(4/3) and 8 degrees of freedom (t = 2.306)
    assert estimate.mean == pytest.approx(2.0)
    assert estimate.high - estimate.mean == pytest.approx(2.306004 * np.sqrt(4 / 3), rel=1e-5)
    assert welch_contrast([cells[0], cells[1][:1]], [1, 1]).low == -np.inf


def test_ratio_interval_solves_fiellers_equation() -> None:
    x, y = np.array([9.0, 10.0, 11.0, 12.0]), np.array([4.0, 5.0, 6.0, 6.0])
    estimate = ratio_of_means(x, y)
    assert estimate.mean == pytest.approx(10.5 / 5.25)
    errors = [v.var(ddof=1) / 4 for v in (x, y)]
    squares = [
        (10.5 - bound * 5.25) ** 2 / (errors[0] + bound**2 * errors[1])
        for bound in (estimate.low, estimate.high)
    ]
    assert squares[0] == pytest.approx(squares[1])  # both are t²
    assert estimate.low < estimate.mean < estimate.high


def test_a_ratio_to_nothing_says_nothing() -> None:
    x = np.array([1.0, 2.0])
    assert np.isnan(ratio_of_means(x, np.array([-1.0, -2.0])).mean)
    assert np.isnan(ratio_of_means(x, np.zeros(0)).mean)
    near_zero = ratio_of_means(x, np.array([-1.0, 1.5]))
    assert (near_zero.low, near_zero.high) == (-np.inf, np.inf)
    assert ratio_of_means(x, np.array([3.0])).low == -np.inf
    below = ratio_of_means(np.array([-3.0, -2.9, -3.1]), np.array([10.0, 10.1, 9.9]))
    assert below.high < 0  # a clear failure is no "undecided"


def test_ratio_interval_covers_the_true_ratio() -> None:
    draw = np.random.default_rng(1)
    inside = 0
    for _ in range(500):
        estimate = ratio_of_means(18 + 2 * draw.normal(size=5), 10 + 2 * draw.normal(size=5))
        inside += estimate.low <= 1.8 <= estimate.high
    assert 0.92 < inside / 500 < 0.985


def test_curves_meet_on_one_grid() -> None:
    np.testing.assert_allclose(common_grid(1000, 4), [250, 500, 750, 1000])
    gap = {"steps": [100, 300], "return": [0.0, 4.0], "episodes": [1, 1]}
    np.testing.assert_allclose(on_grid(gap, np.array([50.0, 200.0, 400.0])), [0, 2, 4])
    assert np.isnan(on_grid(curve([]), np.array([1.0]))).all()


def test_mean_curve_by_hand() -> None:
    part = mean_curve([curve([0.0, 2.0]), curve([4.0, 4.0]), curve([])], np.array([100.0, 200.0]))
    assert part["n"] == 2
    assert part["mean"] == [2.0, 3.0]
    assert part["error"] == pytest.approx([2.0, 1.0])  # sd 2√2 and √2, over √2
    assert mean_curve([curve([1.0])], np.array([100.0]))["error"] == [None]
    assert mean_curve([], np.array([100.0])) == {"steps": [], "mean": [], "error": [], "n": 0}


def test_area_is_the_mean_return_over_the_steps() -> None:
    level = curve([7.0] * 10)
    np.testing.assert_allclose(areas([level, curve([])], 1000), [7.0])
    rising = curve([100.0 * (k + 1) for k in range(10)])
    # level at 100 up to step 100, then return = steps: the grid is 20, 40, …, 1000
    grid = np.maximum(common_grid(1000), 100.0)
    np.testing.assert_allclose(areas([rising], 1000), [grid.mean()])


def test_steps_to_reach_interpolates_and_says_never() -> None:
    rising, flat = curve([0.0, 10.0, 20.0, 30.0]), curve([1.0] * 4)
    found = steps_to_reach([rising, flat, curve([50.0] * 4)], 400, 15.0)
    # The mean of five points, 8 steps apart, on a line lags by two of them.
    np.testing.assert_allclose(found, [250.0 + 16.0, np.inf, 40.0])  # no mean before a tenth


def test_a_lucky_stretch_is_no_convergence() -> None:
    returns = [0.0] * 50
    returns[40:] = [100.0] * 10
    for lucky in (0, 9):  # the first stretch is one like any other
        found = steps_to_reach(
            [curve([*returns[:lucky], 100.0, *returns[lucky + 1 :]])], 5000, 80.0
        )
        np.testing.assert_allclose(found, [4400.0])  # four of the last five points


def test_return_after_fewer_steps_is_read_off_the_curve() -> None:
    training = curve([1.0, 2.0, 3.0, 4.0], episodes=[1, 1, 3, 1])
    assert return_at(training, 300) == 3.0
    # (288, 320]: 12 steps of the third stretch with its 3 episodes, 20 of the fourth with its 1
    assert return_at(training, 320) == pytest.approx((0.36 * 3 + 0.2 * 4) / 0.56)
    gap = {"steps": [100.0, 200.0, 500.0], "return": [1.0, 2.0, 9.0], "episodes": [1, 1, 1]}
    assert return_at(gap, 300) == 2.0  # no episode in the last tenth: the point before
    assert np.isnan(return_at(curve([]), 50))


@given(st.integers(0, 2**31), st.sampled_from([0.2, 0.4, 0.6, 0.8, 1.0]))
@example(744336771, 0.2)  # nobody finishes in the last tenth
def test_a_return_read_off_a_curve_is_the_final_one_of_these_episodes(
    seed: int, share: float
) -> None:
    """Where none ends in the last tenth, a final return is the last one's; a curve has its point's.

    That is the mean over the last stretch in which any ended.
    """
    draw = np.random.default_rng(seed)
    ends = np.sort(draw.integers(1, 10_001, 300))
    episodes = [{"step": float(e), "return": draw.normal(), "length": 1.0} for e in ends]
    steps = round(share * 10_000)  # ends of stretches, and so are nine tenths of them
    before = [episode for episode in episodes if episode["step"] <= steps]
    expected = final_return(before, steps)
    if before[-1]["step"] <= 0.9 * steps:
        assert expected == before[-1]["return"]
        last = np.ceil(before[-1]["step"] / 200)
        expected = np.mean([e["return"] for e in before if np.ceil(e["step"] / 200) == last])
    assert return_at(curve_of(episodes, 10_000), steps) == pytest.approx(expected)


def test_queries_to_reach_interpolates_over_log2() -> None:
    finals = {100: np.array([0.0, 0.0]), 400: np.array([10.0, 10.0]), 200: np.zeros(0)}
    halfway = queries_to_reach(finals, 5.0, rng())
    assert (halfway.reached, halfway.queries) == ("at", pytest.approx(200.0))
    assert (halfway.low, halfway.high) == (pytest.approx(200.0), pytest.approx(200.0))
    first = queries_to_reach(finals, -1.0, rng())
    assert (first.reached, first.queries) == ("at or before", pytest.approx(100.0))
    assert first.low == 0.0  # fewer than the smallest budget may do
    never = queries_to_reach(finals, 11.0, rng())
    assert (never.reached, never.queries, never.high) == ("not reached", 400, np.inf)
    assert queries_to_reach({}, 1.0, rng()).reached == "not reached"
    assert never.as_json()["high"] is None
    assert reached_words(never.as_json()) == ">\u00a0400 [∞,\u00a0∞)"
    single = queries_to_reach({400: np.array([10.0])}, 11.0, rng())
    assert reached_words(single.as_json()) == ">\u00a0400"  # a single run has no interval
    assert first.as_json()["queries"] == 100.0  # not 100.00000000000004


def test_queries_to_reach_takes_the_first_crossing() -> None:
    finals = {100: np.array([0.0]), 200: np.array([10.0]), 400: np.array([2.0])}
    found = queries_to_reach(finals, 10.0, rng())
    assert found.queries == pytest.approx(200.0)
    assert np.isnan([found.low, found.high]).all()  # one run a budget


@given(
    st.dictionaries(st.sampled_from([50, 100, 200, 400]), VALUES, min_size=1),
    st.floats(-1e6, 1e6),
)
def test_queries_to_reach_stay_within_the_budgets(
    finals: dict[int, list[float]], target: float
) -> None:
    arrays = {queries: np.array(values) for queries, values in finals.items()}
    found = queries_to_reach(arrays, target, rng(), draws=20)
    assert min(finals) * 0.999 <= found.queries <= max(finals) * 1.001
    assert found.low <= found.high or np.isnan([found.low, found.high]).all()
