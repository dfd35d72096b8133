"""B-Pref's simulated teachers, who are irrational in known ways.

Lee, Smith, Dragan, Abbeel, B-Pref: Benchmarking preference-based reinforcement learning, NeurIPS
Datasets and Benchmarks 2021, and its released code. One model has them all, each a setting of its
own:

    skip        max(R₁, R₂) < ε_skip · R̄                       → (0, 0)
    equal       |R₁ − R₂| < ε_equal · R̄                        → (.5, .5)
    myopic      G = Σ_t γ^(H−t) r_t, so recent steps count more
    stochastic  P[σ₁ ≻ σ₂] = exp(β G₁) / (exp(β G₁) + exp(β G₂))
    mistake     the choice is reversed with probability ε

taken in this order. R is the undiscounted return of a segment and R̄ that of an average segment.
The oracle is the model with β → ∞, γ = 1 and every ε = 0. On an exact tie of G a coin decides, the
limit of the Boltzmann choice; the released code takes σ₂ only if it is larger. B-Pref has no
highlights; they are placed as by POLITE's oracle.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf
from typing import Final

import numpy as np

from polite.teachers.marking import Marking
from polite.teachers.oracle import rewards_of
from polite.types import (
    EQUAL,
    UNRELATED,
    Answer,
    Floats64,
    InvalidValueError,
    Query,
    SegmentPool,
)


def adaptive_threshold(epsilon: float, average_return: float) -> float:
    """How large a return, or a difference of returns, must be to count.

    B-Pref's δ = ε · (H / T) · R_avg(π), the average return of the policy in H of T steps. −∞, which
    is below everything, unless δ > 0: with ε = 0 nothing is skipped or equal, and neither is it in
    the released code while returns are negative on average.

    Args:
        epsilon: ε in [0, 1].
        average_return: R̄ = (H / T) · R_avg(π), the return of an average segment.
    """
    threshold = epsilon * average_return
    return threshold if threshold > 0 else -inf


def myopic_return(rewards: Floats64, discount: float) -> float:
    """G = Σ_t γ^(H−t) r_t over the steps t = 1 … H, the last of which counts in full.

    Args:
        rewards: reward of each real step, (H,).
        discount: γ; 1 gives the plain return.
    """
    weights = discount ** np.arange(len(rewards) - 1, -1, -1.0)
    return float((weights * rewards).sum())


def prefers_first(difference: float, rationality: float, rng: np.random.Generator) -> bool:
    """Boltzmann choice: True with probability 1 / (1 + exp(−β ΔG)), one draw.

    Args:
        difference: ΔG = G₁ − G₂.
        rationality: β; 0 tosses a coin, infinity always takes the larger (a coin decides a tie).
        rng: source of the choice.
    """
    # A logistic number is below x with probability 1 / (1 + exp(−x)), and never overflows.
    logit = rationality * difference if difference else 0.0  # ∞ · 0 is no number
    return bool(rng.logistic() < logit)


@dataclass(frozen=True)
class BPrefTeacher(Marking):
    """B-Pref's model of a teacher (equations above); the defaults are its oracle.

    The same number of random draws goes into every answer, so that teachers of different settings
    who start from equal generators differ only where the setting matters.
    """

    rationality: float = inf
    """β, per unit of return: how surely the larger return is preferred."""
    discount: float = 1.0
    """γ in (0, 1]: weight of a step relative to the next one."""
    mistake_probability: float = 0.0
    """ε: how often a preference is reversed."""
    epsilon_skip: float = 0.0
    """The pair is skipped if both returns are below this share of the average return."""
    epsilon_equal: float = 0.0
    """The pair is equal if its returns differ by less than this share of the average return."""
    average_return: float | None = None
    """R̄; None for the mean return of the segments in the pool that is asked about. Where that is
    negative nobody skips or calls equal, so an env with negative returns needs a number here."""

    def __post_init__(self) -> None:
        """Check the settings.

        Raises:
            InvalidValueError: if one is out of its range or NaN.
        """
        super().__post_init__()
        rates = (self.mistake_probability, self.epsilon_skip, self.epsilon_equal)
        average = 0.0 if self.average_return is None else self.average_return
        if (
            not self.rationality >= 0
            or not 0 < self.discount <= 1
            or not all(0 <= rate <= 1 for rate in rates)
            or not 0 <= average < inf
        ):
            raise InvalidValueError(
                "expected rationality ≥ 0, discount in (0, 1], mistake_probability, epsilon_skip "
                "and epsilon_equal in [0, 1], and average_return finite and ≥ 0 or None, got "
                f"{self}"
            )

    def answer(
        self,
        query: int,
        rewards_1: Floats64,
        rewards_2: Floats64,
        average_return: float,
        rng: np.random.Generator,
    ) -> Answer:
        """Compare two segments.

        Args:
            query: index of the query.
            rewards_1: any reward along the real steps of σ₁, (t₁,).
            rewards_2: the same along σ₂, (t₂,).
            average_return: R̄, the return of an average segment.
            rng: source of choices and mistakes; two draws an answer.
        """
        values = [myopic_return(rewards, self.discount) for rewards in (rewards_1, rewards_2)]
        chooses_first = prefers_first(values[0] - values[1], self.rationality, rng)
        mistaken = bool(rng.random() < self.mistake_probability)
        undecided = self._undecided(rewards_1.sum(), rewards_2.sum(), average_return)
        if undecided is not None:
            return Answer(query, undecided)
        return self.express(query, (rewards_1, rewards_2), int(not chooses_first), mistaken)

    def answer_queries(
        self, pool: SegmentPool, queries: Sequence[Query], rng: np.random.Generator
    ) -> list[Answer]:
        """Answer each query by the pool's true rewards."""
        average = self.average_return
        if average is None:
            average = float(pool.returns.mean())
        return [
            self.answer(index, *rewards_of(pool, query), average, rng)
            for index, query in enumerate(queries)
        ]

    def _undecided(
        self, return_1: float, return_2: float, average_return: float
    ) -> tuple[float, float] | None:
        """The answer without a preference, where there is one."""
        if max(return_1, return_2) < adaptive_threshold(self.epsilon_skip, average_return):
            return UNRELATED
        if abs(return_1 - return_2) < adaptive_threshold(self.epsilon_equal, average_return):
            return EQUAL
        return None


BPREF_TEACHERS: Final[Mapping[str, BPrefTeacher]] = {
    "oracle": BPrefTeacher(),
    "stochastic": BPrefTeacher(rationality=1.0),
    "myopic": BPrefTeacher(discount=0.9),
    "skip": BPrefTeacher(epsilon_skip=0.1),
    "equal": BPrefTeacher(epsilon_equal=0.1),
    "mistake": BPrefTeacher(mistake_probability=0.1),
}
"""The benchmark's six teachers with its own numbers."""
