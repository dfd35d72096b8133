"""Agreement of rewards and distance of policies, by hand."""

from __future__ import annotations

import numpy as np
import pytest

from polite.analysis.quality import (
    action_distance,
    pair_accuracy,
    policy_difference_part,
    sensitivity_row,
    step_correlation,
)


def test_pair_accuracy_leaves_true_ties_out() -> None:
    learned, true = np.array([0.0, 1.0, 2.0]), np.array([0.0, 5.0, 5.0])
    pairs = np.array([[0, 1], [2, 0], [1, 2]])  # right, right, a tie
    assert pair_accuracy(learned, true, pairs) == 1.0
    assert pair_accuracy(-learned, true, pairs) == 0.0
    assert np.isnan(pair_accuracy(learned, true, pairs[2:]))


def test_a_learned_tie_is_no_hit() -> None:
    assert pair_accuracy(np.zeros(2), np.array([0.0, 1.0]), np.array([[0, 1]])) == 0.0


def test_correlation_ignores_scale_and_is_undefined_for_a_constant() -> None:
    true = np.array([0.0, 1.0, 4.0])
    assert step_correlation(3 * true - 1, true) == pytest.approx(1.0)
    assert np.isnan(step_correlation(np.ones(3), true))


def test_action_distance_is_a_mean_of_lengths() -> None:
    first = np.zeros((1, 2, 2))
    second = np.array([[[3.0, 4.0], [0.0, 1.0]]])
    assert action_distance(first, second).tolist() == [3.0]


def test_null_of_the_policies_needs_two_seeds() -> None:
    actions = np.zeros((2, 5, 2))
    actions[1] = 1.0
    part = policy_difference_part(actions, actions)
    assert part["per_seed"] == [0.0, 0.0]
    assert part["null_per_seed"] == pytest.approx([np.sqrt(2)] * 2)
    assert policy_difference_part(actions[:1], actions[:1])["null_per_seed"] == []


def test_sensitivity_is_paired_by_seed() -> None:
    row = sensitivity_row(
        "slips",
        "double",
        {"polite": [0.8, 0.9], "baseline": [0.7, 0.78]},
        {"polite": [0.5, float("nan")], "baseline": [0.4, 0.4]},
        [0.5, 0.7],
    )
    assert row["spread_ratio"] == [0.5, 0.7]
    assert row["difference"] == pytest.approx(0.11)
    assert row["low"] == pytest.approx(0.11 - 12.7062 * 0.01, rel=1e-4)  # t(.975, 1), error .01
    assert row["correlation"]["polite"] == [0.5, None]
    assert row["correlation_difference"]["mean"] is None
