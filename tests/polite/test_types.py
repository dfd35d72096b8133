import gc
import weakref
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polite.types import (
    FIRST,
    Answer,
    Highlight,
    InvalidValueError,
    NotFiniteError,
    PoliteError,
    Query,
    Segment,
    SegmentPool,
    ShapeError,
    Trajectory,
)


def trajectory(steps=4, **changes):
    arrays = {
        "observations": np.arange(steps * 3.0).reshape(steps, 3),
        "actions": np.ones((steps, 2)),
        "rewards": np.arange(1.0, steps + 1),
        "states": np.zeros((steps, 5)),
        "terminated": False,
    }
    return Trajectory(**{**arrays, **changes})


def segment(steps, value=1.0):
    return Segment(
        observations=np.full((steps, 3), value),
        actions=np.full((steps, 2), value),
        rewards=np.full(steps, value),
        states=np.full((steps, 5), value),
        trajectory=7,
        start=2,
    )


def test_a_trajectory_keeps_its_arrays_in_the_promised_types():
    steps = trajectory()
    assert len(steps) == 4
    assert steps.observations.dtype == steps.actions.dtype == np.float32
    assert steps.rewards.dtype == steps.states.dtype == np.float64
    with pytest.raises(FrozenInstanceError):
        steps.terminated = True


@pytest.mark.parametrize(
    ("name", "array"),
    [
        ("observations", np.zeros((5, 3))),
        ("actions", np.zeros(4)),
        ("states", np.zeros((4, 5, 1))),
        ("rewards", np.zeros((4, 1))),
    ],
)
def test_a_wrong_shape_is_named_with_what_was_expected_and_seen(name, array):
    with pytest.raises(ShapeError, match=rf"^{name}: expected \(.*got \({array.shape[0]}"):
        trajectory(**{name: array})


def test_an_empty_trajectory_is_refused():
    with pytest.raises(ShapeError, match="at least one row"):
        trajectory(0)


@pytest.mark.parametrize("name", ["observations", "actions", "rewards", "states"])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_nan_and_infinity_are_refused_by_name(name, bad):
    array = np.array(getattr(trajectory(), name))
    array.flat[0] = bad
    with pytest.raises(NotFiniteError, match=f"^{name}: 1 of {array.size} values"):
        trajectory(**{name: array})


def test_every_error_is_one_that_the_command_line_can_print():
    for error in (ShapeError, NotFiniteError, InvalidValueError):
        assert issubclass(error, PoliteError) and issubclass(error, ValueError)


def test_a_highlight_reaches_back_to_step_0_at_most():
    assert Highlight(end=7, length=5).window == slice(2, 8)
    assert Highlight(end=2, length=5).start == 0
    assert Highlight(end=0, length=0).window == slice(0, 1)


@given(st.integers(-3, 60), st.integers(-3, 60))
def test_a_highlight_is_valid_or_refused(end, length):
    if end < 0 or length < 0:
        with pytest.raises(InvalidValueError):
            Highlight(end, length)
    else:
        window = Highlight(end, length).window
        assert 1 <= window.stop - window.start <= length + 1


@pytest.mark.parametrize("pair", [(3, 3), (-1, 2), (0, -1)])
def test_a_query_needs_two_different_segments(pair):
    with pytest.raises(InvalidValueError, match="two different indices"):
        Query(*pair)


@pytest.mark.parametrize(
    "make", [lambda n: Highlight(n, 1), lambda n: Query(9, n), lambda n: Answer(n, FIRST)]
)
@pytest.mark.parametrize("number", [np.int64(3), np.uint8(3), np.array(3)])
def test_integers_of_numpy_become_plain_ones(make, number):
    assert make(number) == make(3)
    assert all(type(value) is not type(number) for value in vars(make(number)).values())
    for bad in (3.5, "3", None):
        with pytest.raises(InvalidValueError, match="expected a whole number"):
            make(bad)


@pytest.mark.parametrize("preference", [[1, 0], np.array([1.0, 0.0], np.float32)])
def test_a_preference_may_be_any_sequence(preference):
    assert Answer(0, preference).preference == FIRST


def test_an_answer_knows_what_was_preferred_and_where_its_marks_lie():
    assert [Answer(0, p).preferred for p in ((1, 0), (0, 1), (0.5, 0.5), (0, 0))] == [
        0,
        1,
        None,
        None,
    ]
    assert Answer(0, (0.0, 1.0)).marked == 1
    assert Answer(0, (0.0, 1.0), marks_other=True).marked == 0
    assert Answer(0, (0.0, 0.0)).marked is None


@pytest.mark.parametrize("preference", [(1.0, 1.0), (0.3, 0.7), (0.0, 0.5), (1.0,)])
def test_an_unknown_preference_is_refused(preference):
    with pytest.raises(InvalidValueError, match="expected a preference in"):
        Answer(0, preference)


@pytest.mark.parametrize("preference", [(0.5, 0.5), (0.0, 0.0)])
@pytest.mark.parametrize("name", ["positive", "negative"])
def test_highlights_need_an_expressed_preference(preference, name):
    with pytest.raises(InvalidValueError, match="highlights need an expressed preference"):
        Answer(0, preference, **{name: Highlight(3, 2)})


@pytest.mark.parametrize("change", [{"query": -1}, {"participant": -1}, {"seconds": np.nan}])
def test_an_answer_refuses_impossible_numbers(change):
    with pytest.raises(InvalidValueError, match="≥ 0"):
        replace(Answer(0, (1.0, 0.0)), **change)


def test_a_pool_pads_at_the_end_and_sums_real_steps_only():
    pool = SegmentPool.stack([segment(2, 5.0), segment(4, 1.0)], length=4)
    assert len(pool) == 2
    np.testing.assert_array_equal(pool.lengths, [2, 4])
    np.testing.assert_array_equal(pool.mask, [[True, True, False, False], [True] * 4])
    np.testing.assert_array_equal(pool.rewards, [[5, 5, 0, 0], [1, 1, 1, 1]])
    np.testing.assert_array_equal(pool.returns, [10, 4])
    junk_in_padding = np.array([[5.0, 5.0, 99.0, 99.0], [1.0] * 4])
    np.testing.assert_array_equal(replace(pool, rewards=junk_in_padding).returns, [10, 4])


def test_a_pool_gives_back_what_was_stacked():
    original = segment(3, 2.5)
    back = SegmentPool.stack([segment(5), original], length=6)[1]
    for name in ("observations", "actions", "rewards", "states", "trajectory", "start"):
        np.testing.assert_array_equal(getattr(back, name), getattr(original, name))


def test_a_segment_taken_from_a_pool_does_not_keep_the_pool_alive():
    pool = SegmentPool.stack([segment(5)], length=5)
    kept, watched = pool[0], weakref.ref(pool.observations)
    del pool
    gc.collect()
    assert watched() is None and len(kept) == 5


def test_a_pool_refuses_what_does_not_fit():
    pool = SegmentPool.stack([segment(2)], length=4)
    with pytest.raises(ShapeError, match="at least one, got none"):
        SegmentPool.stack([], length=4)
    with pytest.raises(ShapeError, match="observations: expected ≤ 3 rows"):
        SegmentPool.stack([segment(4)], length=3)
    with pytest.raises(ShapeError, match=r"actions: expected \(1, 4, v\)"):
        replace(pool, actions=np.zeros((1, 3, 2)))
    with pytest.raises(ShapeError, match=r"lengths: expected \(1\)"):
        replace(pool, lengths=np.array([1, 1]))
    for length in (0, 5):
        with pytest.raises(InvalidValueError, match=r"lengths: expected 1 … 4"):
            replace(pool, lengths=np.array([length]))
