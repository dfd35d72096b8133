"""From trajectories to segments: pure functions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from polite.types import InvalidValueError, Segment, SegmentPool, Trajectory


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
    trajectories: Sequence[Trajectory],
    length: int,
    count: int,
    rng: np.random.Generator,
    *,
    show_ends: bool = False,
) -> SegmentPool:
    """Draw segments uniformly from every start that an episode has, the last one included.

    No segment spans a reset. An episode shorter than `length` has one segment, itself. A segment
    is drawn twice only if there are fewer than `count`.

    Segments of one length say nothing of the level of a reward: a constant added to r̂ cancels in
    Eq. 1. Where the env ends an episode, the level decides whether the end pays. With `show_ends`
    such an episode has a start at each of its steps, so that segments near its end are shorter,
    and who prefers by the return says what an end costs.

    Args:
        trajectories: episodes.
        length: m, steps of a segment.
        count: S, segments to draw.
        rng: source of the draws.
        show_ends: whether segments of episodes that the env ended may be cut short by the end.

    Raises:
        InvalidValueError: if there is no trajectory, or `length` or `count` is below 1.
    """
    if not trajectories or length < 1 or count < 1:
        raise InvalidValueError(
            "expected at least one trajectory, length ≥ 1 and count ≥ 1, got "
            f"{len(trajectories)} trajectories, length {length}, count {count}"
        )
    starts = np.array(
        [
            len(t) if show_ends and t.terminated else count_starts(len(t), length)
            for t in trajectories
        ]
    )
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
