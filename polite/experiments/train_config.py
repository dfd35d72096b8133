"""The settings of one training; the command line is made from them. Imports nothing heavy."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from polite.types import InvalidValueError


@dataclass(frozen=True, kw_only=True)
class TrainConfig:
    """Train a policy from the answers of a simulated teacher, by one of the methods.

    Writes results.json, models/, data/ and figures/ into a folder.
    """

    out: Path
    """Folder for everything; new, unless --resume."""
    env: str = "SocialCorridor-v0"
    """Id of any Gymnasium env with vectors for observations and continuous actions."""
    method: Literal["polite", "preferences", "highlights", "untrained", "ground-truth"] = "polite"
    """polite: preferences and highlights; preferences, highlights: one of them alone; untrained: a
    random reward model; ground-truth: the env's own reward."""
    queries: int = 200
    """Pairs of clips that the teacher is asked about, in ten sessions."""
    steps: int = 200_000
    """Steps on which the policy is trained; those spent on collecting clips come on top."""
    seed: int = 0
    """Everything random follows from it."""
    net: Literal["fast", "paper"] = "fast"
    """The reward model: a small one, or the paper's with dropout, which takes far longer."""
    evaluation_episodes: int = 100
    """Whole episodes on which the finished policy is judged by the true reward."""
    resume: bool = False
    """Take a folder that was begun with the same settings; an unfinished training starts over."""

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            InvalidValueError: naming the one that is out of its range.
        """
        for name, least in (("queries", 0), ("steps", 1), ("seed", 0), ("evaluation_episodes", 1)):
            if getattr(self, name) < least:
                raise InvalidValueError(f"{name}: expected at least {least}, got {self}")
