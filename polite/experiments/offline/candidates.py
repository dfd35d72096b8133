"""What the offline bench compares: readings of a highlight, and what goes with them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from polite.methods.presets import EnvPreset
from polite.rewards.network import FAST, RewardNetConfig
from polite.rewards.trainer import RewardTrainingConfig
from polite.teachers.noise import CARELESS, HighlightNoise

EPOCHS, STEP_SIZE = 100, 1e-3
"""All answers are there at once, so a larger step for fewer passes than in the ten sessions."""
FEW = EPOCHS // 8
"""Passes of the candidates whose name ends in few-epochs."""


@dataclass(frozen=True)
class Candidate:
    """One way to learn from highlights."""

    says: str
    """What it is, in a few words."""
    form: str | None
    """A name in `HIGHLIGHT_LOSSES`; None for preferences alone."""
    alpha: float | None = 1.0
    """Weight of both signs; None for the paper's α of the env."""
    unusual: bool = True
    """Whether the oracle marks what is unusual among the segments (`QuantileOracle`), or what is
    past fixed thresholds: the release's, or on the corridor ours."""
    windows: int = 1
    """Most highlights of each sign that an answer carries."""
    members: int = 1
    """Reward networks, whose mean is judged."""
    net: RewardNetConfig = FAST
    """Shape of the reward network."""
    noise: HighlightNoise = field(default_factory=HighlightNoise)
    """How often highlights go wrong."""
    shuffled: bool = False
    """Whether the highlights are dealt out anew among the answers: a null model."""
    epochs: int = EPOCHS
    """Passes over the answers."""
    alone: bool = False
    """Whether the highlights are all that is learned from: the preferences are left out."""

    @property
    def ranked(self) -> bool:
        """Whether it has one highlight a sign, one network, all epochs and a careful teacher."""
        plain = self.windows == self.members == 1 and not self.shuffled
        return plain and self.epochs == EPOCHS and self.noise == HighlightNoise()

    def training(self, preset: EnvPreset) -> RewardTrainingConfig:
        """How its reward model is trained in an env."""
        config = replace(preset.training, epochs=self.epochs, learning_rate=STEP_SIZE)
        if self.form is None:
            return config.without_highlights()
        config = replace(config, highlights=self.form)
        if self.alpha is None:
            return config
        return replace(config, alpha_positive=self.alpha, alpha_negative=self.alpha)


LINEAR = replace(FAST, output="linear")
BASELINE: Final = "preferences"
CANDIDATES: Final[Mapping[str, Candidate]] = {
    BASELINE: Candidate("preferences alone", None),
    "paper": Candidate("Eqs. 4 and 5, the paper's α, fixed thresholds", "paper", None, False),
    "paper-unusual": Candidate("Eqs. 4 and 5, the paper's α, unusual moments", "paper", None),
    "paper-alpha-1": Candidate("Eqs. 4 and 5 with α = 1, fixed thresholds", "paper", 1.0, False),
    "paper-summed": Candidate("Eqs. 4 and 5 summed: α scaled by the data", "paper-summed"),
    "target": Candidate("soft target for the window's mean r̂", "target"),
    "margin": Candidate("margin of the window over its segment", "margin"),
    "segment": Candidate("comparison with the mean of its segment", "segment"),
    "rival": Candidate("comparison with windows of other segments", "rival"),
    "choice": Candidate("choice among the segment's windows, unusual moments", "choice"),
    "choice-released": Candidate("the same, fixed thresholds", "choice", unusual=False),
    "choice-rival": Candidate("choice, and comparison with other segments", "choice-rival"),
    "choice-two": Candidate("choice, up to two highlights a sign", "choice", windows=2),
    "choice-alpha-8": Candidate("choice, highlights eight times as heavy", "choice", 8.0),
    "paper-alone": Candidate("the paper's, without preferences", "paper", None, False, alone=True),
    "choice-alone": Candidate("choice, without preferences", "choice", alone=True),
    "choice-linear": Candidate("choice, linear output", "choice", net=LINEAR),
    "preferences-linear": Candidate("preferences alone, linear output", None, net=LINEAR),
    "choice-ensemble": Candidate("choice, mean of three networks", "choice", members=3),
    "preferences-ensemble": Candidate("preferences alone, mean of three networks", None, members=3),
    "paper-noisy": Candidate("the paper's, noisy highlights", "paper", None, False, noise=CARELESS),
    "choice-noisy": Candidate("choice, noisy highlights", "choice", noise=CARELESS),
    "choice-alone-noisy": Candidate(
        "choice, without preferences, noisy highlights", "choice", noise=CARELESS, alone=True
    ),
    "choice-shuffled": Candidate("choice, highlights that say nothing", "choice", shuffled=True),
    "choice-alone-shuffled": Candidate(
        "choice, without preferences, highlights that say nothing",
        "choice",
        shuffled=True,
        alone=True,
    ),
    "preferences-few-epochs": Candidate(f"preferences alone, {FEW} epochs", None, epochs=FEW),
    "paper-few-epochs": Candidate(f"the paper's, {FEW} epochs", "paper", None, False, epochs=FEW),
    "choice-few-epochs": Candidate(f"choice, {FEW} epochs", "choice", epochs=FEW),
    "choice-alone-few-epochs": Candidate(
        f"choice, without preferences, {FEW} epochs", "choice", epochs=FEW, alone=True
    ),
    "choice-few-epochs-shuffled": Candidate(
        f"choice, highlights that say nothing, {FEW} epochs",
        "choice",
        shuffled=True,
        epochs=FEW,
    ),
}
"""By name; the first is what the others are compared with."""
LADDER: Final = (
    BASELINE,
    "paper",
    "choice",
    "choice-alone",
    "preferences-few-epochs",
    "choice-few-epochs",
)
"""The candidates that are compared at every budget."""
