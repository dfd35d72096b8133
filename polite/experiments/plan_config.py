"""The settings of a study's plan; the command line is made from them. Imports nothing heavy."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal


@dataclass(frozen=True, kw_only=True)
class PlanConfig:
    """Plan a study with people: how many queries, participants and hours it takes."""

    queries: int = 400
    """Answers in each condition; not read with --benchmark."""
    benchmark: Path | None = None
    """Folder of a benchmark: take the queries with which its method reached --share."""
    env: str = "Walker2d-v5"
    """Whose curve of the benchmark to read."""
    method: Literal["polite", "preferences"] = "polite"
    """polite: people mark highlights, which takes 31% longer; preferences: they do not."""
    loss: Literal["pairwise", "released"] = "pairwise"
    """Preference loss whose curve of the benchmark to read."""
    highlights: Literal["choice", "paper"] = "choice"
    """Form of the highlight loss whose curve to read, our own or the paper's; for polite."""
    share: float = 0.8
    """Of the return of a policy trained on the true reward; .5 to .9 are what a benchmark knows."""
    queries_per_participant: int = 20
    """Answers of one person."""
    agreement: float | None = None
    """Share of a pilot's queries on which two people, or one asked twice, agree. It multiplies the
    queries: by how much people's labels are worth less, or more, than those of a simulated teacher
    who is wrong in 10% of them."""
    correlation: float = 0.05
    """Intraclass correlation of one person's answers; a guess, unless a pilot measured it."""
    shares: tuple[float, float] = (0.165, 0.07)
    """Two shares that the study should tell apart; by default the paper's of "no preference"."""
    effect: float = 1.0
    """Difference of the policies' returns that runs should show, in standard deviations."""
    power: float = 0.8
    """Chance to see what is there."""
