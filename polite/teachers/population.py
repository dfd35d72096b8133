"""Who the simulated participants of the user study are.

Their rates and times are put in (`calibrated_inputs`), from the published study where it gives
them; what a reward model learns from their answers comes out.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, log, sqrt
from typing import Any

import numpy as np

from polite.types import Floats64, InvalidValueError

PAPER_SOURCE = "POLITE (ICRA 2024), user study"
ASSUMED = "our assumption; the paper does not say"


@dataclass(frozen=True)
class PopulationConfig:
    """The distributions from which participants of one condition are drawn.

    The defaults are the condition `polite`; `BASELINE` is the other.
    """

    highlights: bool = True
    """Whether participants may highlight."""
    skip_rate: float = 0.07
    """Mean rate of "no preference" (28 of 400; baseline .165, 66 of 400)."""
    equal_share: float = 0.5
    """Share of "no preference" that is "equal" (.5, .5); the rest is "unrelated" (0, 0)."""
    positive_rate: float = 236 / 372
    """Mean rate of positive highlights per expressed preference (63.44%); what is reached is less
    where fewer segments have a window that sums above 0."""
    negative_rate: float = 176 / 372
    """Mean rate of negative highlights per expressed preference (47.31%); what is reached is less
    where fewer segments have a window that sums below 0."""
    concentration: float = 20.0
    """How alike the participants' rates are: a + b of the Beta distributions."""
    rationality: float = 4.0
    """Median Boltzmann β, per standard deviation of the return over the pool."""
    rationality_spread: float = 0.4
    """Standard deviation of log β over participants."""
    slip_rate: float = 0.05
    """Mean rate of expressed preferences that are a coin toss."""
    jitter: int = 2
    """Most steps by which the end of a highlight is off, at least 1 and either way."""
    highlight_length: int = 10
    """L, how many steps a highlight reaches back."""
    study_minutes: float = 24.83
    """Mean duration, tutorial included [min] (baseline 18.93)."""
    study_minutes_sd: float = 6.48
    """Its standard deviation over participants [min] (baseline 9.4)."""
    tutorial_minutes: float = 5.0
    """Duration of the tutorial [min]."""
    answers: int = 20
    """Queries that each participant answers."""
    pace_variation: float = 0.3
    """Coefficient of variation of one participant's seconds per answer."""

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            InvalidValueError: naming the valid ranges, if a value is outside.
        """
        rates = (self.skip_rate, self.positive_rate, self.negative_rate, self.slip_rate)
        positive = (self.concentration, self.rationality, self.study_minutes_sd)
        if (
            not all(0 < rate < 1 for rate in rates)
            or not 0 <= self.equal_share <= 1
            or min(positive) <= 0
            or min(self.rationality_spread, self.highlight_length, self.tutorial_minutes) < 0
            or min(self.jitter, self.answers) < 1
            or self.study_minutes <= self.tutorial_minutes
            or self.pace_variance < 0
        ):
            raise InvalidValueError(
                "expected rates in (0, 1), equal_share in [0, 1], concentration, rationality, "
                "study_minutes_sd > 0, jitter, answers ≥ 1, study_minutes > tutorial_minutes and "
                f"a pace_variation that study_minutes_sd leaves room for, got {self}"
            )

    @property
    def mean_pace(self) -> float:
        """Mean seconds per answer over participants."""
        return 60 * (self.study_minutes - self.tutorial_minutes) / self.answers

    @property
    def pace_variance(self) -> float:
        """Variance of the pace over participants that gives the total the published one [s²].

        With pace p, n answers and coefficient of variation c within a participant,
        Var(total) = n² Var(p) + n c² (E[p]² + Var(p)).
        """
        n, within = self.answers, self.answers * self.pace_variation**2
        total = (60 * self.study_minutes_sd) ** 2
        return (total - within * self.mean_pace**2) / (n**2 + within)


POLITE = PopulationConfig()
BASELINE = PopulationConfig(
    highlights=False, skip_rate=0.165, study_minutes=18.93, study_minutes_sd=9.4
)


@dataclass(frozen=True)
class Participant:
    """One simulated participant."""

    rationality: float
    """β: how much more likely the better segment wins, per standard deviation of the return."""
    slip_rate: float
    """How often an expressed preference is a coin toss."""
    skip_rate: float
    """Share of the study's pairs that look alike to this participant."""
    positive_rate: float
    """Share of preferred segments with a moment worth a positive highlight."""
    negative_rate: float
    """Share of preferred segments with a moment worth a negative highlight."""
    seconds: float
    """Mean time per answer [s]."""


def draw_population(
    config: PopulationConfig, count: int, rng: np.random.Generator
) -> list[Participant]:
    """Draw participants independently.

    Args:
        config: the distributions.
        count: how many.
        rng: source of the draws.
    """
    traits = (
        lognormal(rng, config.rationality, config.rationality_spread, count),
        _rates(rng, config.slip_rate, config.concentration, count),
        _rates(rng, config.skip_rate, config.concentration, count),
        _rates(rng, config.positive_rate, config.concentration, count),
        _rates(rng, config.negative_rate, config.concentration, count),
        _draw_pace(config, count, rng),
    )
    return [Participant(*map(float, row)) for row in zip(*traits, strict=True)]


def calibrated_inputs(config: PopulationConfig) -> dict[str, dict[str, Any]]:
    """Every number that is put in, with its source: name → {value, source}."""
    published = {
        "skip_rate": config.skip_rate,
        "study_minutes": config.study_minutes,
        "study_minutes_sd": config.study_minutes_sd,
        "answers": config.answers,
    }
    assumed = {
        "equal_share": config.equal_share,
        "concentration": config.concentration,
        "rationality": config.rationality,
        "rationality_spread": config.rationality_spread,
        "slip_rate": config.slip_rate,
        "tutorial_minutes": config.tutorial_minutes,
        "pace_variation": config.pace_variation,
    }
    if config.highlights:
        published |= {"positive_rate": config.positive_rate, "negative_rate": config.negative_rate}
        assumed |= {"jitter": config.jitter, "highlight_length": config.highlight_length}
    return {
        name: {"value": value, "source": source}
        for values, source in ((published, PAPER_SOURCE), (assumed, ASSUMED))
        for name, value in values.items()
    }


def lognormal(rng: np.random.Generator, median: float, spread: float, count: int) -> Floats64:
    """Draw positive numbers whose logarithm has standard deviation `spread`, (count,)."""
    return rng.lognormal(log(median), spread, count)


def _rates(rng: np.random.Generator, mean: float, concentration: float, count: int) -> Floats64:
    return rng.beta(mean * concentration, (1 - mean) * concentration, count)


def _draw_pace(config: PopulationConfig, count: int, rng: np.random.Generator) -> Floats64:
    """Mean seconds per answer of each participant, lognormal, (count,)."""
    spread = sqrt(log(1 + config.pace_variance / config.mean_pace**2))
    return lognormal(rng, config.mean_pace * exp(-(spread**2) / 2), spread, count)
