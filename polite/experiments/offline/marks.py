"""Several highlights of one sign in an answer, which `Answer` itself has no room for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

import torch

from polite.rewards.data import PreferenceData
from polite.types import Answer, Highlight, Query, SegmentPool


def hide_marked(
    pool: SegmentPool, queries: Sequence[Query], answers: Sequence[Answer]
) -> SegmentPool:
    """The pool with the true reward of every marked step replaced by its segment's mean.

    What a teacher marks in it is the next best, and the next worst, moment.
    """
    rewards = pool.rewards.copy()
    for answer in answers:
        if answer.marked is None:
            continue
        query = queries[answer.query]
        segment = (query.first, query.second)[answer.marked]
        for highlight in (answer.positive, answer.negative):
            if highlight is not None:
                steps = around(highlight)
                rewards[segment, steps] = pool.rewards[segment, : pool.lengths[segment]].mean()
    rewards[~pool.mask] = 0.0
    return replace(pool, rewards=rewards)


def around(highlight: Highlight) -> slice:
    """The steps whose windows would overlap the highlight's, L either way."""
    return slice(highlight.start, highlight.end + highlight.length + 1)


def joined(parts: Sequence[PreferenceData]) -> PreferenceData:
    """All answers of several data sets about the same segments."""
    columns = {
        field.name: torch.cat([getattr(part, field.name) for part in parts])
        for field in fields(PreferenceData)
        if field.name not in ("inputs", "mask")
    }
    return replace(parts[0], **columns)
