"""What is kept of the pairs that a teacher was asked about, out of many candidates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from polite.dataset import Feedback
from polite.methods.history import join_pools
from polite.types import Query, SegmentPool


def only_asked(pool: SegmentPool, pairs: Sequence[Query]) -> tuple[SegmentPool, list[Query]]:
    """Keep the segments that pairs are about, once each, and the pairs with their new places."""
    ends = [end for pair in pairs for end in (pair.first, pair.second)]
    rows = np.array(list(dict.fromkeys(ends)))
    places = {int(index): place for place, index in enumerate(rows)}
    kept = SegmentPool(**{f.name: getattr(pool, f.name)[rows] for f in fields(SegmentPool)})
    return kept, [Query(places[pair.first], places[pair.second]) for pair in pairs]


def joined_feedback(before: Feedback | None, new: Feedback) -> Feedback:
    """All feedback so far and a session's."""
    if before is None:
        return new
    segments, queries = len(before.pool), len(before.queries)
    return Feedback(
        join_pools([before.pool, new.pool]),
        before.queries + [Query(q.first + segments, q.second + segments) for q in new.queries],
        before.answers + [replace(a, query=a.query + queries) for a in new.answers],
    )
