"""The settings of one training; the command line is made from them. Imports nothing heavy."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from polite.types import InvalidValueError

_LEAST = {"queries": 0, "steps": 1, "seed": 0, "members": 1, "evaluation_episodes": 1}


@dataclass(frozen=True, kw_only=True)
class TrainConfig:
    """Train a policy from the answers of a simulated teacher, by one of the methods.

    Writes results.json, models/, data/ and figures/ into a folder.
    """

    out: Path
    """Folder for everything; new, unless --resume."""
    env: str = "SocialCorridor-v0"
    """Id of any Gymnasium env with vectors for observations and continuous actions."""
    method: Literal[
        "polite",
        "preferences",
        "highlights",
        "untrained",
        "ground-truth",
        "pebble",
        "polite-pebble",
        "sac",
    ] = "polite"
    """polite: preferences and highlights; preferences, highlights: one of them alone; untrained: a
    random reward model; ground-truth: the env's own reward; all by PPO. pebble: preferences, by
    PEBBLE (SAC, relabelled replay, three reward models); polite-pebble: highlights as well; sac:
    its SAC on the env's own reward."""
    preset: Literal["fast", "paper"] = "fast"
    """fast: highlights as a choice, a small reward model, PPO for a laptop; paper: the paper's
    highlights, reward model with dropout and PPO, all of which take far longer."""
    queries: int = 200
    """Pairs of clips that the teacher is asked about."""
    steps: int = 200_000
    """Steps on which the policy is trained; those spent on collecting clips come on top."""
    seed: int = 0
    """Everything random follows from it."""
    teacher: Literal["polite", "oracle", "equal", "skip", "mistake", "myopic", "stochastic"] = (
        "polite"
    )
    """Who answers. polite: the paper's, who reverses 10% of the preferences and skips ties; the
    others are B-Pref's, of whom oracle makes no mistakes. All place highlights in the same way."""
    schedule: Literal["sessions", "decaying", "up-front"] = "sessions"
    """When the teacher is asked. sessions: ten in the first fifth of the training; decaying: a
    quarter before it, the rest ever more rarely until its end; up-front: before it."""
    sampler: Literal["uniform", "disagreement", "entropy", "k-centre", "disputed-k-centre"] = (
        "uniform"
    )
    """Which pairs the teacher is asked about, from the second session on. disagreement and
    disputed-k-centre need --members 2 or more. PEBBLE always asks what is disputed."""
    members: int = 1
    """Reward models, of which the mean pays the policy; PEBBLE always has three."""
    show_ends: bool = False
    """Whether clips may be cut short where the env ended an episode early, so that answers say what
    an end costs. Not for PEBBLE."""
    loss: Literal["pairwise", "released"] = "pairwise"
    """What a preference says: Eq. 2 of the paper, or the softmax over the minibatch that the
    authors' release has in its place."""
    highlights: str | None = None
    """What a highlight says, such as choice or paper; the preset's form if not given."""
    highlight_length: int | None = None
    """L, steps that a highlight reaches back; the env's own if not given."""
    highlight_decay: float | None = None
    """λ, what a step of it counts relative to the next one; the env's own if not given."""
    marks: Literal["labelled", "true-winner"] = "labelled"
    """On which clip highlights lie when a preference was reversed by mistake: on the one that is
    labelled the winner, or on the one that is."""
    highlights_missed: float = 0.0
    """How often the teacher forgets a highlight that it would have given."""
    highlights_wrong_sign: float = 0.0
    """How often it marks the good as bad and the bad as good."""
    highlights_shifted: float = 0.0
    """How often a highlight lies up to 5 steps beside its moment."""
    evaluation_episodes: int = 100
    """Whole episodes on which the finished policy is judged by the true reward."""
    resume: bool = False
    """Take a folder that was begun with the same settings; an unfinished training starts over, but
    PEBBLE's goes on from its last session."""

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            InvalidValueError: naming the one that is out of its range.
        """
        for name, least in _LEAST.items():
            if getattr(self, name) < least:
                raise InvalidValueError(f"{name}: expected at least {least}, got {self}")
        for name in ("highlights_missed", "highlights_wrong_sign", "highlights_shifted"):
            if not 0 <= getattr(self, name) <= 1:
                raise InvalidValueError(f"{name}: expected a share in [0, 1], got {self}")
        if self.method in ("pebble", "polite-pebble", "sac"):
            self._check_pebble()
        if self.schedule == "up-front" and self.sampler != "uniform":
            raise InvalidValueError(
                "sampler: expected uniform where everything is asked up front, since nothing is "
                f"learned before, got {self}"
            )

    def _check_pebble(self) -> None:
        """PEBBLE brings its own times, pairs and models; a wish for others would go unheard.

        Raises:
            InvalidValueError: naming what cannot be chosen.
        """
        for name, own in (
            ("schedule", "sessions"),
            ("sampler", "uniform"),
            ("members", 1),
            ("show_ends", False),
        ):
            if getattr(self, name) != own:
                raise InvalidValueError(f"{name}: PEBBLE has its own; leave it out, got {self}")
        if self.preset == "paper":
            raise InvalidValueError(f"preset: the paper has no numbers for PEBBLE, got {self}")
