"""Answers of somebody who cannot be asked again at no cost: kept for `resume=True`, by session."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path

import numpy as np

from polite.dataset import Feedback, load_feedback, save_feedback
from polite.files import read_json_object, write_json
from polite.methods.asking import only_asked
from polite.methods.history import Teacher
from polite.types import Answer, Query, SegmentPool

RANDOM = "random.json"
"""The state of the random generator after the answers."""


def remembered(teacher: Teacher, folder: Path) -> Teacher:
    """The same teacher, who is not asked again in a session that was answered whole before.

    A training that begins anew asks the same again, because everything follows from its seed, until
    it comes to what nobody has answered yet. Whether it is the same teacher is not looked at.

    Args:
        teacher: whose answers are kept, a data set for each session.
        folder: for them.

    Raises:
        DatasetError: when asked what was answered before, if that is damaged.
    """

    def answer(
        pool: SegmentPool, queries: Sequence[Query], rng: np.random.Generator
    ) -> list[Answer]:
        seen, pairs = only_asked(pool, queries)
        session = folder / _mark(seen, pairs, rng)
        if (session / RANDOM).exists():
            answers = load_feedback(session).answers
            rng.bit_generator.state = read_json_object(session / RANDOM, "delete its folder")
            return answers
        answers = list(teacher(pool, queries, rng))
        save_feedback(session, Feedback(seen, pairs, answers))
        write_json(session / RANDOM, rng.bit_generator.state)
        return answers

    return answer


def _mark(pool: SegmentPool, queries: Sequence[Query], rng: np.random.Generator) -> str:
    """Tells apart what is asked, and with which chance."""
    mark = hashlib.sha256()
    for field in fields(pool):
        mark.update(np.ascontiguousarray(getattr(pool, field.name)).tobytes())
    told = [[(query.first, query.second) for query in queries], rng.bit_generator.state]
    mark.update(json.dumps(told).encode())
    return mark.hexdigest()[:16]
