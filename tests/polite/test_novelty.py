import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from polite.methods import novelty
from polite.methods.novelty import Spread, StateEntropy, neighbour_distances
from polite.types import InvalidValueError


def randn(*shape, seed=0):
    return torch.randn(*shape, generator=torch.Generator().manual_seed(seed))


def brute_force(states, among, k):
    """By sorting all differences, in double precision."""
    gaps = states.double().numpy()[:, None] - among.double().numpy()
    return np.sort(np.linalg.norm(gaps, axis=2), axis=1)[:, k]  # place 0 is the state itself


def test_distances_on_a_line_worked_out_by_hand():
    line = torch.tensor([[0.0], [1.0], [3.0], [7.0]])
    assert neighbour_distances(line, line, 1).tolist() == [1, 1, 2, 4]
    assert neighbour_distances(line, line, 2).tolist() == [3, 2, 3, 6]
    assert neighbour_distances(line[:1], line, 3).tolist() == [7]


@pytest.mark.parametrize("size", [30, 7, 8, 6])  # in whole parts of seven, and not
@pytest.mark.parametrize("k", [1, 5])
def test_parts_do_not_matter(monkeypatch, size, k):
    monkeypatch.setattr(novelty, "ROWS_AT_ONCE", 7)
    among = randn(size, 4)
    found = neighbour_distances(among[:5], among, k)
    np.testing.assert_allclose(found, brute_force(among[:5], among, k), rtol=1e-5)


def test_far_from_the_origin_small_distances_are_still_right():
    among = 1000.0 + randn(500, 3)
    found = neighbour_distances(among, among, 5)
    np.testing.assert_allclose(found, brute_force(among, among, 5), rtol=1e-3)


def test_the_order_of_states_does_not_matter():
    among = randn(60, 3)
    order = torch.randperm(60, generator=torch.Generator().manual_seed(1))
    torch.testing.assert_close(
        neighbour_distances(among[:9], among, 5), neighbour_distances(among[:9], among[order], 5)
    )


def test_few_and_equal_states():
    assert neighbour_distances(torch.zeros(1, 2), torch.zeros(1, 2), 5).tolist() == [0]
    two = torch.tensor([[0.0, 0.0], [3.0, 4.0]])
    assert neighbour_distances(two, two, 5).tolist() == [5, 5]
    same = torch.ones(20, 2)
    assert neighbour_distances(same[:3], same, 5).tolist() == [0, 0, 0]


@pytest.mark.parametrize(("k", "size"), [(0, 3), (1, 0)])
def test_impossible_neighbours_are_refused(k, size):
    with pytest.raises(InvalidValueError, match="k ≥ 1"):
        neighbour_distances(torch.zeros(1, 2), torch.zeros(size, 2), k)


@given(st.lists(st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=8), min_size=1, max_size=6))
def test_the_running_spread_is_that_of_all_values(batches):
    spread = Spread()
    for batch in batches:
        spread = spread.joined(torch.tensor(batch, dtype=torch.float64))
    everything = np.concatenate(batches)
    assert spread.count == len(everything)
    assert spread.mean == pytest.approx(everything.mean(), abs=1e-9)
    expected = everything.std()
    if expected > 1e-6:
        assert spread.std == pytest.approx(expected, rel=1e-6)


def test_equal_values_are_not_divided_by_zero():
    assert Spread().joined(torch.ones(4)).std == 1.0


def test_the_reward_is_the_logarithm_over_its_running_spread():
    among = randn(50, 3)
    entropy = StateEntropy(5)
    first, second = among[:20], among[20:]
    expected = [np.log(brute_force(part, among, 5)) for part in (first, second)]
    np.testing.assert_allclose(entropy(first, among), expected[0] / expected[0].std(), rtol=1e-4)
    both = np.concatenate(expected)
    np.testing.assert_allclose(entropy(second, among), expected[1] / both.std(), rtol=1e-4)


def test_a_repeated_state_is_not_minus_infinitely_new():
    states = torch.cat([torch.zeros(10, 2), randn(10, 2)])
    rewards = StateEntropy(5)(states, states)
    assert torch.isfinite(rewards).all()
    assert rewards[:10].max() < rewards[10:].min()
