"""A teacher who marks what is unusual among the clips around."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from polite.teachers.bpref import BPrefTeacher
from polite.teachers.highlights import released_candidate, trailing_means
from polite.teachers.oracle import Oracle
from polite.types import Answer, InvalidValueError, Query, SegmentPool

QUANTILES = (0.2, 0.8)
"""Of all moments' trailing means: what is below is bad, what is above good."""


@dataclass(frozen=True)
class QuantileOracle:
    """An oracle whose highlight thresholds are quantiles of the pool that it answers about.

    That is what its caller gives: all segments of the recent sessions in the loop with PPO, those
    that a session asks about in PEBBLE.

    Fixed thresholds belong to one reward and one stage of a policy: the released ones make nearly
    every answer carry h⁺ and hardly any h⁻ on Walker2d and HalfCheetah. People compare with
    what they know. For the same reason the sign of the true reward plays no part: a constant added
    to it changes no preference between clips of equal length, so it should change no highlight.
    """

    oracle: Oracle | BPrefTeacher = field(default_factory=Oracle)
    """Everything but the thresholds: ties, mistakes, window."""
    quantiles: tuple[float, float] = QUANTILES
    """A moment below the first is bad enough for h⁻, one above the second good enough for h⁺."""

    def __post_init__(self) -> None:
        """Check the settings.

        Raises:
            InvalidValueError: unless 0 ≤ first ≤ second ≤ 1 and moments are scored by trailing
                means, as in the release.
        """
        low, high = self.quantiles
        if not 0 <= low <= high <= 1 or self.oracle.rule is not released_candidate:
            raise InvalidValueError(
                "expected quantiles 0 ≤ first ≤ second ≤ 1 and the rule released_candidate, "
                f"got {self}"
            )

    def answer_queries(
        self, pool: SegmentPool, queries: Sequence[Query], rng: np.random.Generator
    ) -> list[Answer]:
        """Answer each query by the pool's true rewards."""
        low, high = moment_quantiles(pool, self.quantiles)
        marking = replace(
            self.oracle, negative_threshold=low, positive_threshold=high, sign_test=False
        )
        return marking.answer_queries(pool, queries, rng)


def moment_quantiles(pool: SegmentPool, quantiles: tuple[float, float]) -> tuple[float, float]:
    """Quantiles of the trailing mean of the true reward over all real steps of a pool."""
    moments = np.concatenate(
        [
            trailing_means(rewards[:length])
            for rewards, length in zip(pool.rewards, pool.lengths, strict=True)
        ]
    )
    low, high = np.quantile(moments, quantiles)
    return float(low), float(high)
