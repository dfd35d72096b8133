"""Profiles and maps against values worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from polite.analysis.reward_map import (
    map_2d_part,
    profile,
    reward_map_part,
    spread,
    standardise,
)
from polite.types import ShapeError


def test_profile_by_hand() -> None:
    position = np.array([0.0, 0.5, 1.5, 2.0, 9.0])  # the last lies outside
    rewards = np.array([[0.0, 1.0, 2.0, 4.0, 99.0], [0.0, 0.0, 0.0, 0.0, -99.0]])
    found = profile(position, rewards, np.array([0.0, 1.0, 2.0]))
    np.testing.assert_allclose(found.centre, [0.5, 1.5])
    np.testing.assert_allclose(found.per_seed, [[0.5, 3.0], [0.0, 0.0]])  # 2.0 is the last edge
    np.testing.assert_allclose(found.mean, [0.25, 1.5])
    np.testing.assert_allclose(found.std, [0.25, 0.5])  # sds .5 and 1 of seed 0, 0 of seed 1


def test_empty_bin_is_null_in_json() -> None:
    found = profile(np.array([0.5]), np.array([[2.0]]), np.array([0.0, 1.0, 2.0]))
    assert found.as_json("z") == {
        "z": [0.5, 1.5],
        "mean": [2.0, None],
        "std": [0.0, None],
        "per_seed": [[2.0, None]],
    }


def test_wrong_shapes_are_named() -> None:
    with pytest.raises(ShapeError, match=r"expected \(S, M\) with M = 3 positions, got \(2, 2\)"):
        profile(np.zeros(3), np.zeros((2, 2)), np.array([0.0, 1.0]))


def test_standardised_rewards_have_mean_0_and_sd_1() -> None:
    rewards = np.random.default_rng(0).normal(3.0, 7.0, (2, 500))
    scaled = standardise(rewards)
    np.testing.assert_allclose(scaled.mean(axis=1), 0.0, atol=1e-12)
    np.testing.assert_allclose(scaled.std(axis=1), 1.0)
    assert not standardise(np.full((1, 4), 2.0)).any()


def test_standardised_map_ignores_scale_and_offset() -> None:
    rng = np.random.default_rng(0)
    z, edges = rng.uniform(-15, 15, 300), np.linspace(-15, 15, 7)
    rewards = rng.normal(size=(3, 300))
    one = reward_map_part(z, rewards, edges)
    other = reward_map_part(z, 0.1 * rewards - 2.0, edges)
    np.testing.assert_allclose(one["standardised"]["mean"], other["standardised"]["mean"])
    assert other["spread"] == pytest.approx(0.1 * one["spread"])
    assert other["standardised_spread"] == pytest.approx(one["standardised_spread"])


def test_spread_leaves_empty_bins_out() -> None:
    assert spread(np.array([1.0, np.nan, 3.0])) == 1.0


def test_map_2d_has_rows_along_and_columns_across() -> None:
    part = map_2d_part(
        x=np.array([-1.0, 1.0, 1.0]),
        z=np.array([0.5, 0.5, 1.5]),
        rewards=np.array([[1.0, 2.0, 3.0], [3.0, 4.0, 5.0]]),
        x_edges=np.array([-2.0, 0.0, 2.0]),
        z_edges=np.array([0.0, 1.0, 2.0]),
    )
    assert part == {"x": [-1.0, 1.0], "z": [0.5, 1.5], "mean": [[2.0, 3.0], [None, 4.0]]}
