"""Published statistics from their counts, and the tests and intervals they rest on."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polite.analysis.answers import chi_square_part, summarise, times_part
from polite.analysis.numbers import as_array, as_json, mean_of
from polite.analysis.published import PUBLISHED
from polite.analysis.statistics import (
    Summary,
    chi_square,
    mean_band,
    mean_interval,
    paired_difference,
    paired_ratio,
    permutation_test,
    ratio_of_means,
    share_interval,
    welch_difference,
    welch_test,
)
from polite.types import ShapeError


def test_published_chi_square_follows_from_its_counts() -> None:
    corrected = chi_square(66, 400, 28, 400, yates=True)
    assert corrected.statistic == pytest.approx(16.503, abs=5e-4)
    assert corrected.p_value == pytest.approx(4.9e-5, abs=5e-7)
    assert chi_square(66, 400, 28, 400, yates=False).statistic == pytest.approx(17.41, abs=5e-3)


def test_published_rates_follow_from_their_counts() -> None:
    expressed = 400 - PUBLISHED["no_preference"]["polite"]
    assert expressed == 372
    assert round(236 / expressed, 4) == PUBLISHED["highlight_rate"]["positive"] == 0.6344
    assert round(176 / expressed, 4) == PUBLISHED["highlight_rate"]["negative"] == 0.4731
    assert PUBLISHED["no_preference_rate"] == {"polite": 28 / 400, "baseline": 66 / 400}


def test_published_times_follow_from_their_means() -> None:
    polite, baseline = PUBLISHED["times"]["polite"], PUBLISHED["times"]["baseline"]
    assert round(polite["mean"] / baseline["mean"] - 1, 4) == PUBLISHED["times"]["increase"]
    test = welch_test(Summary(**polite, count=20), Summary(**baseline, count=20))
    assert test.statistic == pytest.approx(2.31, abs=5e-3)
    assert test.p_value == pytest.approx(0.027, abs=5e-4)


def test_chi_square_by_hand() -> None:
    # 10/20 against 5/20: expected 7.5 and 12.5 in each row, so every (O − E)² is 6.25.
    by_hand = 2 * 6.25 / 7.5 + 2 * 6.25 / 12.5
    assert chi_square(10, 20, 5, 20, yates=False).statistic == pytest.approx(by_hand)
    # Yates takes .5 off every |O − E| = 2.5: (2.0)² = 4.
    by_hand = 2 * 4 / 7.5 + 2 * 4 / 12.5
    assert chi_square(10, 20, 5, 20, yates=True).statistic == pytest.approx(by_hand)


@pytest.mark.parametrize("count", [0, 20])
def test_nothing_to_test_where_both_shares_are_zero_or_one(count: int) -> None:
    test = chi_square(count, 20, count, 20, yates=True)
    assert (test.statistic, test.p_value) == (0.0, 1.0)


def test_t_interval_by_hand() -> None:
    # Mean 2, sd 1, n = 3: t(.975, 2) = 4.302653, error 1/√3.
    estimate = mean_interval(np.array([1.0, 2.0, 3.0]))
    assert estimate.mean == 2.0
    assert estimate.high - estimate.mean == pytest.approx(4.302653 / np.sqrt(3), rel=1e-6)
    assert estimate.mean - estimate.low == pytest.approx(estimate.high - estimate.mean)


def test_one_seed_bounds_nothing() -> None:
    assert mean_interval(np.array([1.0])).low == -np.inf
    assert welch_difference(np.array([1.0]), np.array([0.0])).high == np.inf
    assert mean_interval(np.array([1.0])).as_json() == {"mean": 1.0, "low": None, "high": None}


def test_samples_without_spread_bound_nothing() -> None:
    three, four = np.full(5, 3.0), np.full(5, 4.0)
    assert welch_difference(four, three).as_json() == {"mean": 1.0, "low": None, "high": None}
    assert ratio_of_means(four, three).low == -np.inf
    assert np.isfinite(welch_difference(four, np.array([3.0, 3.1])).low)
    assert welch_test(Summary(3, 0, 5), Summary(3, 0, 5)).p_value == 1.0
    assert np.isnan(welch_test(Summary(4, 0, 5), Summary(3, 0, 5)).p_value)
    assert mean_interval(four).as_json() == {"mean": 4.0, "low": None, "high": None}
    assert paired_difference(four, three).low == -np.inf


@given(st.integers(1, 99), st.integers(1, 99), st.integers(2, 30))
def test_nor_do_equal_shares_whose_variance_rounds(one: int, other: int, count: int) -> None:
    """The variance of three values of .1 is 2e-34, and a verdict followed from it."""
    first, second = np.full(count, one / 100), np.full(count, other / 100)
    for estimate in (
        welch_difference(first, second),
        ratio_of_means(first, second),
        mean_interval(first),
    ):
        assert (estimate.low, estimate.high) == (-np.inf, np.inf)
    assert summarise(first).sd == 0.0


def test_too_few_values_test_nothing() -> None:
    rng = np.random.default_rng(0)
    for test in (
        welch_test(Summary(25, 0, 1), Summary(19, 2, 5)),
        permutation_test(np.zeros(0), np.array([0.1, 0.2]), rng),
        permutation_test(np.array([0.1, np.nan]), np.array([0.1, 0.2]), rng),
        chi_square(0, 0, 3, 10, yates=True),
    ):
        assert np.isnan([test.statistic, test.p_value]).all()


def test_pairs_are_of_one_length() -> None:
    with pytest.raises(ShapeError, match=r"expected pairs, got \(3,\) and \(1,\)"):
        paired_difference(np.ones(3), np.ones(1))
    with pytest.raises(ShapeError):
        paired_ratio(np.ones(3), np.ones(1))


def test_welch_interval_and_welch_test_agree() -> None:
    rng = np.random.default_rng(0)
    first, second = rng.normal(1.0, 2.0, 8), rng.normal(0.0, 0.5, 11)
    interval = welch_difference(first, second)
    test = welch_test(
        *(Summary(float(s.mean()), float(s.std(ddof=1)), s.size) for s in (first, second))
    )
    assert (test.p_value < 0.05) == (interval.low > 0 or interval.high < 0)


def test_t_interval_covers_as_promised() -> None:
    rng = np.random.default_rng(1)
    samples = rng.normal(0.0, 1.0, (2000, 5))
    inside = [e.low <= 0 <= e.high for e in map(mean_interval, samples)]
    assert np.mean(inside) == pytest.approx(0.95, abs=0.015)


def test_pairing_takes_the_shared_part_out() -> None:
    shared = np.array([0.0, 10.0, 20.0, 30.0])
    estimate = paired_difference(shared + np.array([1.0, 1.1, 0.9, 1.0]), shared)
    assert estimate.low > 0.8
    assert welch_difference(shared + 1, shared).low < 0


def test_ratio_of_pairs_is_geometric() -> None:
    estimate = paired_ratio(np.array([1.0, 4.0]), np.array([1.0, 1.0]))
    assert estimate.mean == pytest.approx(2.0)
    assert np.isnan(paired_ratio(np.array([1.0, 0.0]), np.array([1.0, 1.0])).mean)


def test_permutation_test_treats_participants_as_units() -> None:
    rng = np.random.default_rng(0)
    apart = permutation_test(np.ones(6), np.zeros(6), rng, draws=4000)
    assert apart.statistic == 1.0
    # 2 of the C(12, 6) = 924 regroupings are as far apart.
    assert apart.p_value == pytest.approx(2 / 924, abs=2e-3)
    assert permutation_test(np.ones(6), np.ones(6), rng).p_value == 1.0


def test_one_odd_participant_is_no_evidence_though_chi_square_thinks_so() -> None:
    polite, baseline = np.zeros(20), np.zeros(20)
    baseline[0] = 20  # one participant skips everything
    part = chi_square_part(polite, baseline, 20, np.random.default_rng(0))
    assert part["p_value"] < 1e-4
    assert part["cluster"]["p_value"] > 0.9


def test_chi_square_part_sees_the_paper_in_its_counts() -> None:
    polite, baseline = np.repeat([1, 2], [12, 8]), np.repeat([3, 4], [14, 6])  # 28 and 66
    part = chi_square_part(polite, baseline, 20, np.random.default_rng(0))
    assert part["statistic"] == pytest.approx(16.503, abs=5e-4)
    assert part["yates"] is True
    assert part["cluster"]["statistic"] == pytest.approx(0.095)


def test_times_part() -> None:
    part = times_part(np.array([10.0, 14.0]), np.array([8.0, 8.0]))
    assert part["polite"] == {"mean": 12.0, "sd": pytest.approx(np.sqrt(8)), "count": 2}
    assert part["increase"] == 0.5
    assert part["welch_t"] == pytest.approx(4 / 2)  # error √(8/2) = 2


def test_wilson_interval_stays_within_zero_and_one() -> None:
    assert share_interval(0, 20).low == 0.0
    assert 0.0 < share_interval(0, 20).high < 0.2
    assert np.isnan(share_interval(0, 0).mean)


def test_band_is_the_interval_of_every_column() -> None:
    values = np.array([[1.0, 5.0], [2.0, 5.0], [3.0, 5.0]])
    band = mean_band(values)
    assert band.mean.tolist() == [2.0, 5.0]
    assert band.low[0] == mean_interval(values[:, 0]).low
    assert band.low[1] == band.high[1] == 5.0


@given(st.lists(st.floats(allow_nan=True, allow_infinity=True), max_size=8))
def test_json_round_trip_keeps_numbers_and_turns_the_rest_into_null(values: list[float]) -> None:
    stored = as_json(values)
    back = as_array(stored)
    finite = np.isfinite(values) if values else np.array([], dtype=bool)
    assert [v is None for v in stored] == [not f for f in finite]
    np.testing.assert_array_equal(back[finite], np.asarray(values, dtype=float)[finite])


def test_mean_of_skips_empty_bins() -> None:
    values = np.array([[1.0, np.nan, 3.0], [np.nan, np.nan, 5.0]])
    np.testing.assert_array_equal(mean_of(values, np.array([True, True, False])), [1.0, np.nan])
    np.testing.assert_array_equal(mean_of(values, np.array([True, True, True])), [2.0, 5.0])
