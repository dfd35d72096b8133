"""Divergences against closed forms and their invariants."""

from __future__ import annotations

import numpy as np
import pytest

from polite.analysis.divergence import gaussian_kl, histogram_kl, kl_part
from polite.types import InvalidValueError


def test_gaussian_kl_by_hand() -> None:
    p, q = np.array([-1.0, 1.0]), np.array([-1.0, 3.0])  # N(0, 1) and N(1, 4)
    assert gaussian_kl(p, q) == pytest.approx(np.log(2) + 2 / 8 - 0.5)
    assert gaussian_kl(q, p) == pytest.approx(-np.log(2) + (4 + 1) / 2 - 0.5)


def test_a_sample_does_not_diverge_from_itself() -> None:
    sample = np.random.default_rng(0).uniform(-1, 1, 100)
    assert gaussian_kl(sample, sample) == pytest.approx(0.0, abs=1e-12)
    assert histogram_kl(sample, sample, np.linspace(-1, 1, 11)) == 0.0


def test_gaussian_kl_is_never_negative_nor_infinite() -> None:
    rng = np.random.default_rng(0)
    scale = rng.uniform(0, 2, (50, 1))
    p, q = scale * rng.normal(size=(50, 20)), rng.normal(size=(50, 20))
    assert (gaussian_kl(p, q) >= -1e-12).all()
    assert np.isfinite(gaussian_kl(np.ones(5), np.zeros(5)))


def test_gaussian_kl_does_not_see_a_common_shift_and_scale() -> None:
    rng = np.random.default_rng(0)
    p, q = rng.normal(0, 1, 200), rng.normal(1, 2, 200)
    assert gaussian_kl(3 * p + 5, 3 * q + 5) == pytest.approx(gaussian_kl(p, q))


def test_histogram_kl_by_hand() -> None:
    # Counts (2, 0) and (1, 1), .5 added to each: shares (5/6, 1/6) and (1/2, 1/2).
    found = histogram_kl(np.array([0.1, 0.2]), np.array([0.1, 0.9]), np.array([0.0, 0.5, 1.0]))
    assert found == pytest.approx(5 / 6 * np.log(5 / 3) + 1 / 6 * np.log(1 / 3))


def test_histogram_kl_wants_edges_that_cover_the_samples() -> None:
    with pytest.raises(
        InvalidValueError, match=r"expected all 2 samples within \[0, 1\], got only 1"
    ):
        histogram_kl(np.array([0.5, 2.0]), np.array([0.5]), np.array([0.0, 1.0]))


def test_kl_part_has_a_row_a_seed_and_zero_where_the_models_are_one() -> None:
    rng = np.random.default_rng(0)
    start = rng.uniform(-0.5, 0.5, (3, 1, 50))
    later = (
        rng.uniform(-0.5, 0.5, (4, 3, 1, 50)) * np.array([1.0, 0.5, 0.6, 0.9])[:, None, None, None]
    )
    models = [np.concatenate([start, model], axis=1) for model in later]
    part = kl_part(np.array([0, 1]), *models)
    assert part["epochs"] == [0.0, 1.0]
    assert np.shape(part["per_seed"]) == np.shape(part["null_shuffled"]) == (3, 2)
    np.testing.assert_allclose(np.array(part["per_seed"])[:, 0], 0.0, atol=1e-12)
    assert part["mean"][1] > 0
    assert part["low"][1] <= part["mean"][1] <= part["high"][1]
    assert part["reverse"]["mean"][1] != part["mean"][1]
