"""The data that flow through the learner, each checked where it is made.

Sizes: T steps of an episode, m steps of a segment, n observation entries, v action entries,
k entries of a state that a renderer can draw, S segments of a pool.
"""

from __future__ import annotations

import operator
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

Floats32 = NDArray[np.float32]
Floats64 = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]

FIRST, SECOND, EQUAL, UNRELATED = (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (0.0, 0.0)
PREFERENCES = (FIRST, SECOND, EQUAL, UNRELATED)
_LARGEST_32 = float(np.finfo(np.float32).max)


class PoliteError(Exception):
    """An error whose one-line message tells a user what to do."""


class InvalidValueError(PoliteError, ValueError):
    """A value outside its valid choices or range."""


class ShapeError(PoliteError, ValueError):
    """An array of another shape than expected."""


class NotFiniteError(PoliteError, ValueError):
    """NaN or infinity in the data."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """One episode, aligned: `rewards[t]` is what taking `actions[t]` in `observations[t]` paid."""

    observations: Floats32
    """What the agent saw, (T, n)."""
    actions: Floats32
    """What it did, (T, v)."""
    rewards: Floats64
    """The true reward, (T,)."""
    states: Floats64
    """Rows that a renderer can draw, the world at the moment of `observations[t]`, (T, k)."""
    terminated: bool
    """Whether the env ended the episode (False: cut off by a time limit)."""

    def __post_init__(self) -> None:
        """Check the arrays.

        Raises:
            ShapeError: if the arrays do not share T ≥ 1 rows.
            NotFiniteError: if any entry is NaN or infinite.
        """
        _check_steps(self)

    def __len__(self) -> int:
        """The number of steps T."""
        return len(self.rewards)


@dataclass(frozen=True, eq=False)
class Segment:
    """At most m consecutive steps of one trajectory, unpadded."""

    observations: Floats32
    """(t, n) with t ≤ m."""
    actions: Floats32
    """(t, v)."""
    rewards: Floats64
    """The true reward, (t,)."""
    states: Floats64
    """(t, k)."""
    trajectory: int
    """Index of the trajectory it was cut from."""
    start: int
    """The trajectory's step that is step 0 here."""

    def __post_init__(self) -> None:
        """Check the arrays.

        Raises:
            ShapeError: if the arrays do not share t ≥ 1 rows.
            NotFiniteError: if any entry is NaN or infinite.
        """
        _check_steps(self)

    def __len__(self) -> int:
        """The number of steps."""
        return len(self.rewards)


@dataclass(frozen=True)
class Highlight:
    """A marked window: the steps end − length … end, cut off at step 0 (POLITE, Eq. 3)."""

    end: int
    """The anchor j, the window's last step."""
    length: int
    """L, how many steps it reaches back, so it has at most L + 1 steps. A loss takes its own L for
    all (`RewardTrainingConfig.highlight_length`): mark with that one."""

    def __post_init__(self) -> None:
        """Check that both numbers are whole and none is negative.

        Raises:
            InvalidValueError: if one is not.
        """
        _whole_numbers(self, "end", "length")
        if self.end < 0 or self.length < 0:
            raise InvalidValueError(f"expected a highlight with end, length ≥ 0, got {self}")

    @property
    def start(self) -> int:
        """The window's first step."""
        return max(0, self.end - self.length)

    @property
    def window(self) -> slice:
        """The window as a slice over a segment's steps."""
        return slice(self.start, self.end + 1)


@dataclass(frozen=True)
class Query:
    """Two different segments to compare, by their places in a pool."""

    first: int
    """Index of σ₁."""
    second: int
    """Index of σ₂."""

    def __post_init__(self) -> None:
        """Check the indices.

        Raises:
            InvalidValueError: if an index is not whole or negative, or both are the same.
        """
        _whole_numbers(self, "first", "second")
        if min(self.first, self.second) < 0 or self.first == self.second:
            raise InvalidValueError(f"expected two different indices ≥ 0, got {self}")


@dataclass(frozen=True)
class Answer:
    """What a teacher said to one query."""

    query: int
    """Index of the query."""
    preference: tuple[float, float]
    """μ: (1, 0) first, (0, 1) second, (.5, .5) equal, (0, 0) unrelated."""
    positive: Highlight | None = None
    """h⁺, a window of the marked segment that speaks for it."""
    negative: Highlight | None = None
    """h⁻, a window of the marked segment that speaks against it."""
    participant: int = 0
    """Who answered."""
    seconds: float = 0.0
    """How long it took [s]."""
    marks_other: bool = False
    """The highlights lie on the segment that was *not* preferred: an ablation, in which a mistaken
    label leaves the marks on the truly better segment."""

    def __post_init__(self) -> None:
        """Check the answer.

        Raises:
            InvalidValueError: if μ is none of the four, if highlights come without an expressed
                preference, or if an index is not whole or an index or a time negative.
        """
        _whole_numbers(self, "query", "participant")
        object.__setattr__(self, "seconds", float(self.seconds))
        if list(self.preference) not in map(list, PREFERENCES):
            raise InvalidValueError(f"expected a preference in {PREFERENCES}, got {self}")
        object.__setattr__(self, "preference", tuple(map(float, self.preference)))
        if self.preferred is None and (self.positive or self.negative or self.marks_other):
            raise InvalidValueError(f"highlights need an expressed preference, got {self}")
        if min(self.query, self.participant) < 0 or not 0 <= self.seconds < np.inf:
            raise InvalidValueError(f"expected query, participant, seconds ≥ 0, got {self}")

    @property
    def preferred(self) -> int | None:
        """0 if the first segment was preferred, 1 if the second, None if neither."""
        return {FIRST: 0, SECOND: 1}.get(self.preference)

    @property
    def marked(self) -> int | None:
        """Which segment the highlights lie on: 0, 1, or None without a preference."""
        return None if self.preferred is None else self.preferred ^ self.marks_other


@dataclass(frozen=True, eq=False, repr=False)
class SegmentPool:
    """S segments as arrays, each padded with zeros after its last real step."""

    observations: Floats32
    """(S, m, n)."""
    actions: Floats32
    """(S, m, v)."""
    rewards: Floats64
    """The true reward, (S, m)."""
    states: Floats64
    """(S, m, k)."""
    lengths: Integers
    """Real steps of each segment, (S,), 1 … m."""
    trajectory: Integers
    """Index of the trajectory each was cut from, (S,)."""
    start: Integers
    """Its first step in that trajectory, (S,)."""

    def __post_init__(self) -> None:
        """Check the arrays.

        Raises:
            ShapeError: if the arrays disagree on S or m, or S or m is 0.
            InvalidValueError: if a length is not in 1 … m.
            NotFiniteError: if any entry is NaN or infinite.
        """
        rewards = _set(self, "rewards", np.float64, ("S", "m"), ())
        rows = rewards.shape
        _set(self, "observations", np.float32, ("S", "m", "n"), rows)
        _set(self, "actions", np.float32, ("S", "m", "v"), rows)
        _set(self, "states", np.float64, ("S", "m", "k"), rows)
        for name in ("lengths", "trajectory", "start"):
            _set(self, name, np.int64, ("S",), rows[:1])
        if self.lengths.min() < 1 or self.lengths.max() > rows[1]:
            raise InvalidValueError(f"lengths: expected 1 … {rows[1]}, got {self.lengths}")

    @classmethod
    def stack(cls, segments: Sequence[Segment], length: int) -> Self:
        """Copy segments into arrays padded to `length` steps.

        Raises:
            ShapeError: if there is no segment, one is longer than `length`, or their rows differ.
        """
        if not segments:
            raise ShapeError("segments: expected at least one, got none")
        return cls(
            observations=_pad([s.observations for s in segments], length, "observations"),
            actions=_pad([s.actions for s in segments], length, "actions"),
            rewards=_pad([s.rewards for s in segments], length, "rewards"),
            states=_pad([s.states for s in segments], length, "states"),
            lengths=np.array([len(s) for s in segments]),
            trajectory=np.array([s.trajectory for s in segments]),
            start=np.array([s.start for s in segments]),
        )

    def __len__(self) -> int:
        """The number of segments S."""
        return len(self.lengths)

    def __repr__(self) -> str:
        """Its sizes; the arrays would fill pages."""
        rows, n, v = self.rewards.shape, self.observations.shape[2], self.actions.shape[2]
        return f"SegmentPool(S={rows[0]}, m={rows[1]}, n={n}, v={v}, k={self.states.shape[2]})"

    def __getitem__(self, index: int) -> Segment:
        """A copy of one segment without its padding, so that it does not keep the pool alive."""
        steps = slice(int(self.lengths[index]))
        return Segment(
            observations=self.observations[index, steps].copy(),
            actions=self.actions[index, steps].copy(),
            rewards=self.rewards[index, steps].copy(),
            states=self.states[index, steps].copy(),
            trajectory=int(self.trajectory[index]),
            start=int(self.start[index]),
        )

    @property
    def mask(self) -> Booleans:
        """True at real steps, (S, m)."""
        mask: Booleans = np.arange(self.rewards.shape[1]) < self.lengths[:, None]
        return mask

    @property
    def returns(self) -> Floats64:
        """The true return of the real steps, (S,)."""
        returns: Floats64 = np.where(self.mask, self.rewards, 0.0).sum(axis=1)
        return returns


def _check_steps(steps: Trajectory | Segment) -> None:
    rewards = _set(steps, "rewards", np.float64, ("T",), ())
    rows = rewards.shape
    _set(steps, "observations", np.float32, ("T", "n"), rows)
    _set(steps, "actions", np.float32, ("T", "v"), rows)
    _set(steps, "states", np.float64, ("T", "k"), rows)


def _set(
    owner: object, name: str, dtype: DTypeLike, axes: tuple[str, ...], rows: tuple[int, ...]
) -> NDArray[np.generic]:
    """Convert a field to `dtype` and check it: its axes, its leading sizes, that it is finite."""
    array = np.asarray(getattr(owner, name), dtype=dtype)
    leading = array.shape[: len(rows)]
    if array.ndim != len(axes) or leading != rows or 0 in array.shape[: max(1, len(rows))]:
        sizes = ", ".join([*map(str, rows), *axes[len(rows) :]])
        raise ShapeError(f"{name}: expected ({sizes}) with at least one row, got {array.shape}")
    check_finite(name, array)
    object.__setattr__(owner, name, array)
    return array


def _whole_numbers(owner: object, *names: str) -> None:
    """Make plain integers of NumPy's, which JSON does not know."""
    for name in names:
        try:
            object.__setattr__(owner, name, operator.index(getattr(owner, name)))
        except TypeError:
            raise InvalidValueError(f"{name}: expected a whole number, got {owner}") from None


def check_finite(name: str, values: ArrayLike) -> None:
    """Refuse NaN and infinity.

    Raises:
        NotFiniteError: with the name of the array and how many of its entries are bad.
    """
    bad = ~np.isfinite(np.asarray(values))
    if bad.any():
        raise NotFiniteError(
            f"{name}: {bad.sum()} of {bad.size} values are NaN or infinite; check the env"
        )


def check_finite_32(name: str, values: ArrayLike) -> None:
    """Refuse NaN, infinity, and what becomes infinite in 32 bits, in which networks compute.

    Raises:
        NotFiniteError: as `check_finite`, or with the largest size that was seen.
    """
    largest = np.abs(np.asarray(values)).max(initial=0.0)
    if not largest <= _LARGEST_32:  # which NaN is not either
        check_finite(name, values)
        raise NotFiniteError(
            f"{name}: expected numbers that float32 can hold, got {largest:g}; scale them"
        )


def _pad(arrays: Sequence[NDArray[Any]], length: int, name: str) -> NDArray[Any]:
    """Stack arrays of (t, ...) as (S, length, ...) with zeros at the end."""
    shape = arrays[0].shape[1:]
    padded = np.zeros((len(arrays), length, *shape), dtype=arrays[0].dtype)
    for index, array in enumerate(arrays):
        if len(array) > length or array.shape[1:] != shape:
            raise ShapeError(f"{name}: expected ≤ {length} rows of {shape}, got {array.shape}")
        padded[index, : len(array)] = array
    return padded
