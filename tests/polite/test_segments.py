import gc
import weakref
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
import torch

from polite.losses import preference_loss
from polite.segments import count_starts, cut_segment, cut_segments
from polite.types import InvalidValueError, Trajectory


def trajectory(steps, first=0.0):
    """Every array tells its step, so that a cut shows where it came from."""
    values = first + np.arange(steps, dtype=float)
    return Trajectory(values[:, None], values[:, None], values, values[:, None], False)


@pytest.mark.parametrize(("steps", "starts"), [(1, 1), (4, 1), (5, 1), (6, 2), (9, 5)])
def test_an_episode_has_one_start_for_each_whole_segment_and_at_least_one(steps, starts):
    assert count_starts(steps, 5) == starts


def test_every_start_is_drawn_the_last_one_included():
    pool = cut_segments([trajectory(9)], 5, 5, np.random.default_rng(0))
    assert sorted(pool.start) == [0, 1, 2, 3, 4]
    assert pool.rewards.max() == 8


def test_starts_are_drawn_uniformly():
    trajectories, rng = [trajectory(6), trajectory(3), trajectory(5)], np.random.default_rng(0)
    drawn = Counter(
        (int(pool.trajectory[0]), int(pool.start[0]))
        for pool in (cut_segments(trajectories, 5, 1, rng) for _ in range(4000))
    )
    assert set(drawn) == {(0, 0), (0, 1), (1, 0), (2, 0)}
    assert all(abs(count / 4000 - 1 / 4) < 0.03 for count in drawn.values())


def test_rows_stay_aligned():
    pool = cut_segments([trajectory(30), trajectory(40, 100.0)], 5, 20, np.random.default_rng(1))
    expected = (pool.start + 100 * pool.trajectory)[:, None] + np.arange(5)
    np.testing.assert_array_equal(pool.rewards, expected)
    for array in (pool.observations, pool.actions, pool.states):
        np.testing.assert_array_equal(array[..., 0], expected)


def test_an_episode_that_ends_early_gives_one_short_segment():
    pool = cut_segments([trajectory(3, 10.0)], 5, 1, np.random.default_rng(0))
    np.testing.assert_array_equal(pool.lengths, [3])
    np.testing.assert_array_equal(pool.rewards, [[10, 11, 12, 0, 0]])
    np.testing.assert_array_equal(pool.returns, [33])


def test_where_ends_are_shown_only_an_episode_that_the_env_ended_starts_at_every_step():
    ended = replace(trajectory(9), terminated=True)
    pool = cut_segments([ended], 5, 9, np.random.default_rng(0), show_ends=True)
    lengths = dict(zip(pool.start.tolist(), pool.lengths.tolist(), strict=True))
    assert lengths == {start: min(5, 9 - start) for start in range(9)}
    assert pool.returns.tolist() == [sum(range(s, min(s + 5, 9))) for s in pool.start]
    for other, ends in ((trajectory(9), True), (ended, False)):
        pool = cut_segments([other], 5, 50, np.random.default_rng(0), show_ends=ends)
        assert set(pool.lengths.tolist()) == {5}


def test_a_level_is_learned_where_ends_are_shown_and_only_there():
    """r̂ = level, alike at every step: Eq. 1 tells levels apart only by clips of other lengths."""
    ended = [replace(trajectory(9), terminated=True)]

    def gradient(ends):
        pool = cut_segments(ended, 5, 40, np.random.default_rng(0), show_ends=ends)
        level = torch.zeros((), requires_grad=True)
        returns = torch.from_numpy(pool.lengths) * level
        longer = torch.from_numpy(pool.lengths[::2] > pool.lengths[1::2]).float()
        mu = torch.stack([longer, 1 - longer], dim=1)
        preference_loss(returns[::2], returns[1::2], mu).backward()
        return level.grad.item()

    assert gradient(False) == 0 and gradient(True) < 0  # a higher level, a smaller loss


def test_more_segments_than_there_are_repeat():
    pool = cut_segments([trajectory(5)], 4, 10, np.random.default_rng(0))
    assert len(pool) == 10 and set(pool.start) == {0, 1}


def test_equal_seeds_cut_equal_segments():
    pools = [cut_segments([trajectory(50)], 5, 9, np.random.default_rng(3)) for _ in range(2)]
    np.testing.assert_array_equal(pools[0].start, pools[1].start)


def test_a_segment_does_not_keep_its_trajectory_alive():
    source = trajectory(100)
    watched = [weakref.ref(getattr(source, n)) for n in ("observations", "actions", "rewards")]
    segment = cut_segment(source, 0, 10, 5)
    del source
    gc.collect()
    assert [reference() for reference in watched] == [None] * 3 and len(segment) == 5


@pytest.mark.parametrize(("length", "count"), [(0, 1), (5, 0), (-1, 1)])
def test_impossible_cuts_are_refused(length, count):
    with pytest.raises(InvalidValueError, match=f"length {length}, count {count}"):
        cut_segments([trajectory(5)], length, count, np.random.default_rng(0))
    with pytest.raises(InvalidValueError, match="0 trajectories"):
        cut_segments([], 5, 1, np.random.default_rng(0))
