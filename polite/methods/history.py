"""Feedback as it grows, session by session."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np

from polite.dataset import Feedback
from polite.samplers import uniform_pairs
from polite.types import Answer, Query, SegmentPool

Teacher = Callable[[SegmentPool, Sequence[Query], np.random.Generator], list[Answer]]
"""(segments, pairs of them, source of its mistakes) -> an answer to each pair, in their order."""


class FeedbackHistory:
    """All segments, pairs and answers so far."""

    def __init__(self, recent_sessions: int) -> None:
        """Begin with nothing.

        Args:
            recent_sessions: pairs are drawn from the segments of this many last sessions.
        """
        self._recent_sessions = recent_sessions
        self._pools: list[SegmentPool] = []
        self._queries: list[Query] = []
        self._answers: list[Answer] = []

    @property
    def feedback(self) -> Feedback:
        """Everything so far, ready to be trained on or saved; needs one pool at least."""
        return Feedback(join_pools(self._pools), list(self._queries), list(self._answers))

    def add_segments(self, pool: SegmentPool) -> None:
        """Keep a session's new segments."""
        self._pools.append(pool)

    def ask(self, count: int, teacher: Teacher, rng: np.random.Generator) -> None:
        """Draw pairs uniformly from the recent segments, and keep the teacher's answers.

        Args:
            count: queries to ask.
            teacher: answers them.
            rng: source of the pairs and of the teacher's mistakes.
        """
        recent = join_pools(self._pools[-self._recent_sessions :])
        pairs = uniform_pairs(count, rng, recent)
        answers = teacher(recent, pairs, rng)
        before = sum(map(len, self._pools)) - len(recent)
        self._answers += [replace(a, query=a.query + len(self._queries)) for a in answers]
        self._queries += [Query(q.first + before, q.second + before) for q in pairs]


def join_pools(pools: Sequence[SegmentPool]) -> SegmentPool:
    """One pool of all segments in order; trajectories are numbered on from pool to pool.

    Args:
        pools: at least one, all padded to the same number of steps.
    """
    columns: dict[str, Any] = {
        field.name: np.concatenate([getattr(pool, field.name) for pool in pools])
        for field in fields(SegmentPool)
    }
    counts = [int(pool.trajectory.max()) + 1 for pool in pools]
    shifts = np.cumsum([0, *counts[:-1]])
    columns["trajectory"] += np.repeat(shifts, [len(pool) for pool in pools])
    return SegmentPool(**columns)
