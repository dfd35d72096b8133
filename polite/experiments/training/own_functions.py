"""A teacher or sampler of the caller's own: what it is called, and what has to come from it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from functools import partial
from typing import Any

import numpy as np

from polite.experiments.training.config import TrainConfig
from polite.experiments.training.settings import learning_config
from polite.methods.history import Teacher
from polite.methods.pairs import PairSampler
from polite.methods.pebble_config import PEBBLE_METHODS
from polite.methods.presets import EnvPreset
from polite.types import Answer, InvalidValueError, Query, SegmentPool

SIMULATED_ONLY = ("marks", "highlights_missed", "highlights_wrong_sign", "highlights_shifted")
"""Settings that say where simulated teachers place highlights."""


def as_function(teacher: Any) -> Teacher:
    """The function that answers: the teacher itself, or its method `answer_queries`.

    Raises:
        InvalidValueError: if it has neither.
    """
    function = getattr(teacher, "answer_queries", teacher)
    if not callable(function):
        raise InvalidValueError(
            "teacher: expected a name, a function (segments, pairs, random generator) -> answers, "
            f"or an object with such a method answer_queries, got {teacher!r}"
        )
    return function  # type: ignore[no-any-return]


def name_of(function: Callable[..., Any]) -> str:
    """Module and name, for the record; a partial function goes by what it calls."""
    while isinstance(function, partial):
        function = function.func
    named: Any = function if hasattr(function, "__qualname__") else type(function)
    return f"{named.__module__}.{named.__qualname__}"


def as_sampler(sampler: Any) -> PairSampler:
    """The function that chooses pairs.

    Raises:
        InvalidValueError: if it is none.
    """
    if not callable(sampler):
        raise InvalidValueError(
            "sampler: expected a name, or a function (request, reward model) -> pairs, got "
            f"{sampler!r}"
        )
    return sampler  # type: ignore[no-any-return]


def check_sampler(config: TrainConfig, preset: EnvPreset, sampler: PairSampler) -> None:
    """Check that the training will ask it.

    Raises:
        InvalidValueError: if the method asks nobody, or chooses its pairs itself, or there is no
            second session.
    """
    if why := _why_unasked(config, preset):
        raise InvalidValueError(f"sampler: {why}; leave it out, got {name_of(sampler)}")


def _why_unasked(config: TrainConfig, preset: EnvPreset) -> str:
    """Why no sampler of one's own would be asked; empty if it would."""
    if not config.uses("sampler"):
        return f"{config.method} asks nobody"
    if config.method in PEBBLE_METHODS:
        return f"{config.method} has its own"
    learning = learning_config(config, preset)
    if len(learning.schedule.plan(learning.queries, learning.steps)) < 2:
        return "the first session's pairs are drawn uniformly, and there is no second one"
    return ""


def check_heard(config: TrainConfig, teacher: Teacher) -> None:
    """Check that the method asks somebody, and that nothing was set for another teacher.

    Raises:
        InvalidValueError: naming what would go unheard.
    """
    if not config.uses("teacher"):
        raise InvalidValueError(
            f"teacher: {config.method} asks nobody; leave it out, got {name_of(teacher)}"
        )
    defaults = {field.name: field.default for field in fields(config)}
    for name in SIMULATED_ONLY:
        if getattr(config, name) != defaults[name]:
            raise InvalidValueError(
                f"{name}: for simulated teachers only; {name_of(teacher)} places its highlights "
                f"itself, got {getattr(config, name)!r}"
            )


def checked(teacher: Teacher, length: int | None) -> Teacher:
    """The same teacher, whose answers are looked at before anything is learned from them.

    Args:
        teacher: whose.
        length: L, how many steps a highlight reaches back to the loss; None if none reads it.

    Returns:
        A teacher that raises InvalidValueError unless there is an answer to each query, in their
        order, with highlights of that length.
    """

    def answer(
        pool: SegmentPool, queries: Sequence[Query], rng: np.random.Generator
    ) -> list[Answer]:
        answers = list(teacher(pool, queries, rng) or ())
        asked = range(len(queries))
        if not all(isinstance(each, Answer) for each in answers) or [
            each.query for each in answers
        ] != list(asked):
            raise InvalidValueError(
                f"teacher: expected {len(asked)} Answers, one to each query in their order (query "
                f"= 0, 1, …), got {len(answers)} of {name_of(teacher)}: {answers[:3]} …"
            )
        for each in answers:
            for highlight in (each.positive, each.negative):
                if highlight and length is not None and highlight.length != length:
                    raise InvalidValueError(
                        f"teacher: expected highlights of length {length}, as the loss reads them "
                        f"(highlight_length), got {highlight} of {name_of(teacher)}"
                    )
        return answers

    return answer
