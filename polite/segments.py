"""From trajectories to segments, and from segments to pairs: pure samplers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from polite.types import (
    Floats64,
    InvalidValueError,
    Query,
    Segment,
    SegmentPool,
    ShapeError,
    Trajectory,
)


def count_starts(steps: int, length: int) -> int:
    """How many segments an episode of `steps` steps has; one, shorter, if it ends before m."""
    return max(1, steps - length + 1)


def cut_segment(trajectory: Trajectory, index: int, start: int, length: int) -> Segment:
    """Copy at most `length` steps out of trajectory number `index`, from `start` on.

    A copy, because a view would keep the whole trajectory in memory.
    """
    steps = slice(start, start + length)
    return Segment(
        observations=trajectory.observations[steps].copy(),
        actions=trajectory.actions[steps].copy(),
        rewards=trajectory.rewards[steps].copy(),
        states=trajectory.states[steps].copy(),
        trajectory=index,
        start=start,
    )


def cut_segments(
    trajectories: Sequence[Trajectory], length: int, count: int, rng: np.random.Generator
) -> SegmentPool:
    """Draw segments uniformly from every start that an episode has, the last one included.

    No segment spans a reset. An episode shorter than `length` has one segment, itself. A segment
    is drawn twice only if there are fewer than `count`.

    Args:
        trajectories: episodes.
        length: m, steps of a segment.
        count: S, segments to draw.
        rng: source of the draws.

    Raises:
        InvalidValueError: if there is no trajectory, or `length` or `count` is below 1.
    """
    if not trajectories or length < 1 or count < 1:
        raise InvalidValueError(
            "expected at least one trajectory, length ≥ 1 and count ≥ 1, got "
            f"{len(trajectories)} trajectories, length {length}, count {count}"
        )
    starts = np.array([count_starts(len(t), length) for t in trajectories])
    ends = starts.cumsum()
    drawn = rng.choice(ends[-1], size=count, replace=bool(count > ends[-1]))
    owners = np.searchsorted(ends, drawn, side="right")
    first_steps = drawn - (ends - starts)[owners]
    return SegmentPool.stack(
        [
            cut_segment(trajectories[owner], int(owner), int(start), length)
            for owner, start in zip(owners, first_steps, strict=True)
        ],
        length,
    )


def uniform_pairs(count: int, rng: np.random.Generator, pool: SegmentPool) -> list[Query]:
    """Draw pairs of different segments uniformly, each pair once before any comes again.

    Args:
        count: Q, pairs to draw.
        rng: source of the draws.
        pool: the segments, at least two.

    Raises:
        InvalidValueError: if the pool has fewer than two segments.
    """
    if len(pool) < 2:
        raise InvalidValueError(f"expected a pool of at least 2 segments, got {len(pool)}")
    pairs = len(pool) * (len(pool) - 1) // 2
    rounds = [
        rng.choice(pairs, size=min(pairs, count - done), replace=False)
        for done in range(0, count, pairs)
    ]
    numbers = np.concatenate([np.zeros(0, dtype=np.int64), *rounds])
    # Pair number k of (0,1), (0,2), (1,2), (0,3), … is (k − j(j−1)/2, j).
    larger = ((1 + np.sqrt(1 + 8 * numbers)) // 2).astype(np.int64)
    smaller = numbers - larger * (larger - 1) // 2
    swapped = rng.random(count) < 0.5  # left and right mean nothing
    return [
        Query(int(b), int(a)) if swap else Query(int(a), int(b))
        for a, b, swap in zip(smaller, larger, swapped, strict=True)
    ]


def disagreement_pairs(
    candidates: Sequence[Query], member_probabilities: Floats64, count: int
) -> list[Query]:
    """Choose the pairs on which an ensemble disagrees most (Christiano et al. 2017; PEBBLE).

    Args:
        candidates: C pairs to choose from.
        member_probabilities: P[σ₁ ≻ σ₂] of each of K members, (K, C).
        count: pairs to choose, at most C.

    Returns:
        The pairs with the highest standard deviation over members, most disputed first.

    Raises:
        ShapeError: if there is not one column for each candidate.
        InvalidValueError: if fewer candidates than `count` are given.
    """
    probabilities = np.asarray(member_probabilities)
    if probabilities.ndim != 2 or probabilities.shape[1] != len(candidates):
        raise ShapeError(
            f"member_probabilities: expected (K, {len(candidates)}), got {probabilities.shape}"
        )
    if count > len(candidates):
        raise InvalidValueError(f"expected at least {count} candidates, got {len(candidates)}")
    order = np.argsort(-probabilities.std(axis=0), kind="stable")
    return [candidates[index] for index in order[:count]]
