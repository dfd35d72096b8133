"""Episodes' metrics summed up: means with 95% intervals, as rows and as Markdown."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import ndtri, stdtrit

from socialnav_env.metrics import METRICS, NO_ONE, NO_PATH, TIME_HORIZON

CONFIDENCE = 0.95
"""Share of such intervals that hold the true mean."""
RATES = ("success", "intermittent", "collided", "timeout")
"""Metrics that are 0 or 1 in an episode, so that their mean is a rate."""
ABOUT_PEOPLE = (
    "min_human_distance",
    "personal_space_compliance",
    "min_time_to_collision",
    "intimate_share",
    "personal_share",
    "social_share",
    "public_share",
)
"""Metrics that say nothing where there is nobody."""
DEFINITIONS = {
    **METRICS,
    "collided": "1 when there was a collision",
    "timeout": "1 when the time ran out before the goal was reached (TO)",
    "return": "sum of the rewards, undiscounted",
    "length": "number of steps",
}
"""Metric -> definition, with the unit in brackets at its end where it has one."""


@dataclass(frozen=True)
class Row:
    """One metric over many episodes. Where too few episodes tell of it, numbers are NaN."""

    name: str
    """Key in `info["episode_metrics"]`."""
    unit: str
    """Such as "m/s"; empty for a number without one."""
    mean: float
    """Over the episodes that tell of it."""
    low: float
    """Lower end of the 95% interval of the mean."""
    high: float
    """Its upper end."""
    n: int
    """How many episodes tell of it."""
    definition: str
    """What it is."""

    def cell(self) -> str:
        """The mean and its interval in a few letters."""
        if self.n == 0:
            return "–"
        if math.isnan(self.low):
            return f"{self.mean:.3g}"
        return f"{self.mean:.3g} [{self.low:.3g}, {self.high:.3g}]"


@dataclass(frozen=True)
class MetricsTable:
    """What a policy's episodes were like, a row for each metric."""

    rows: tuple[Row, ...]
    """In the order of the metrics."""

    @classmethod
    def of(cls, episodes: Sequence[Mapping[str, float]]) -> MetricsTable:
        """Sum up episodes.

        `time_to_goal` is the mean over the episodes that reached the goal, the metrics of distance
        to people over those with people, `min_time_to_collision` over those in which somebody was
        approaching, and `path_irregularity` over those in which the robot moved.

        Args:
            episodes: What `EpisodeMetrics` puts into `info["episode_metrics"]`, all with the same
                keys.

        Raises:
            ValueError: There is no episode.
        """
        if not episodes:
            raise ValueError("expected at least one finished episode, got none")
        return cls(tuple(_row(name, episodes) for name in episodes[0]))

    def __getitem__(self, name: str) -> Row:
        """The row of a metric.

        Raises:
            KeyError: There is none; the message lists those there are.
        """
        for row in self.rows:
            if row.name == name:
                return row
        raise KeyError(f"{name!r}: expected one of {', '.join(row.name for row in self.rows)}")

    def as_dicts(self) -> list[dict[str, Any]]:
        """The rows as plain dicts, for JSON or a data frame; None where no number is known."""
        return [
            {
                key: None if isinstance(value, float) and math.isnan(value) else value
                for key, value in dataclasses.asdict(row).items()
            }
            for row in self.rows
        ]

    def to_markdown(self) -> str:
        """A Markdown table: metric, mean with its interval, unit, number of episodes."""
        lines = ["| metric | mean [95% interval] | unit | n |", "|---|---|---|---|"]
        lines += [f"| {r.name} | {r.cell()} | {r.unit or '-'} | {r.n} |" for r in self.rows]
        return "\n".join(lines)


def compare(tables: Mapping[str, MetricsTable], names: Sequence[str] | None = None) -> str:
    """A Markdown table with a column for each policy.

    Args:
        tables: Title of the column -> its table.
        names: Metrics to show; all those of the first table where None.

    Raises:
        ValueError: There is no table.
        KeyError: A table lacks a metric.
    """
    if not tables:
        raise ValueError("tables: expected at least one, got none")
    first = next(iter(tables.values()))
    lines = [f"| metric | {' | '.join(tables)} |", "|---" * (1 + len(tables)) + "|"]
    for name in names or [row.name for row in first.rows]:
        unit = first[name].unit
        cells = " | ".join(table[name].cell() for table in tables.values())
        lines.append(f"| {name}{f' [{unit}]' if unit else ''} | {cells} |")
    return "\n".join(lines)


def mean_interval(values: Sequence[float]) -> tuple[float, float]:
    """Student's interval of a mean; NaN for fewer than two values."""
    n = len(values)
    if n < 2:
        return math.nan, math.nan
    half = stdtrit(n - 1, 0.5 * (1.0 + CONFIDENCE)) * np.std(values, ddof=1) / math.sqrt(n)
    mean = float(np.mean(values))
    return mean - float(half), mean + float(half)


def rate_interval(successes: float, n: int) -> tuple[float, float]:
    """Wilson's interval of a rate (Wilson 1927), which stays in [0, 1]; NaN for n = 0."""
    if n == 0:
        return math.nan, math.nan
    z2 = float(ndtri(0.5 * (1.0 + CONFIDENCE))) ** 2
    rate = successes / n
    middle = (rate + 0.5 * z2 / n) / (1.0 + z2 / n)
    half = math.sqrt(z2 * (rate * (1.0 - rate) / n + 0.25 * z2 / n**2)) / (1.0 + z2 / n)
    return max(middle - half, 0.0), min(middle + half, 1.0)


def _row(name: str, episodes: Sequence[Mapping[str, float]]) -> Row:
    """One metric over the episodes that tell of it."""
    values = [float(episode[name]) for episode in episodes if _tells(name, episode)]
    n = len(values)
    low, high = rate_interval(sum(values), n) if name in RATES else mean_interval(values)
    mean = float(np.mean(values)) if n else math.nan
    definition = DEFINITIONS.get(name, "")
    unit = re.search(r"\[([^\]]+)\]$", definition)
    return Row(name, unit[1] if unit else "", mean, low, high, n, definition)


def _tells(name: str, episode: Mapping[str, float]) -> bool:
    """Whether an episode has a value of that metric, or only a stand-in for none."""
    if name == "time_to_goal":
        return episode["success"] > 0
    if name in ABOUT_PEOPLE and episode["min_human_distance"] == NO_ONE:
        return False
    if name == "path_irregularity":
        return episode["path_length"] > NO_PATH
    return name != "min_time_to_collision" or episode[name] < TIME_HORIZON
