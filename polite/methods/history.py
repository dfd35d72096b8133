"""Feedback as it grows, session by session."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np

from polite.dataset import Feedback
from polite.methods.pairs import PairRequest, check_pairs
from polite.types import Answer, Query, SegmentPool

Teacher = Callable[[SegmentPool, Sequence[Query], np.random.Generator], list[Answer]]
"""(segments, pairs of them, source of its mistakes) -> an answer to each pair, in their order."""
ChoosePairs = Callable[[PairRequest], list[Query]]
"""What a session needs -> the pairs that it asks about."""


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
        return Feedback(self.pool, list(self._queries), list(self._answers))

    @property
    def pool(self) -> SegmentPool:
        """All segments so far; needs one pool at least."""
        return join_pools(self._pools)

    def add_segments(self, pool: SegmentPool) -> None:
        """Keep a session's new segments."""
        self._pools.append(pool)

    def ask(
        self,
        count: int,
        teacher: Teacher,
        rng: np.random.Generator,
        choose: ChoosePairs = PairRequest.draw,
    ) -> None:
        """Choose pairs of the recent segments, and keep the teacher's answers.

        Args:
            count: queries to ask.
            teacher: answers them.
            rng: source of the pairs and of the teacher's mistakes.
            choose: the pairs; drawn uniformly if not given.

        Raises:
            InvalidValueError: if these are no pairs of theirs, or fewer or more.
        """
        recent = join_pools(self._pools[-self._recent_sessions :])
        before = sum(map(len, self._pools)) - len(recent)
        request = PairRequest(recent, self._asked_since(before), count, rng)
        pairs = check_pairs(choose(request), request)
        answers = teacher(recent, pairs, rng)
        self._answers += [replace(a, query=a.query + len(self._queries)) for a in answers]
        self._queries += [Query(q.first + before, q.second + before) for q in pairs]

    def _asked_since(self, segment: int) -> list[Query]:
        """Pairs asked about, both of whose segments come from `segment` on, counted from there."""
        return [
            Query(query.first - segment, query.second - segment)
            for query in self._queries
            if min(query.first, query.second) >= segment
        ]


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
