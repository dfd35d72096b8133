"""What is set for each env: the oracle, the highlights, PPO (the paper and the released code)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

from polite.methods.history import Teacher
from polite.methods.preference_learning import MakeTeacher
from polite.policies.ppo import PpoConfig
from polite.rewards.network import FAST, PAPER, RewardNetConfig
from polite.rewards.trainer import RewardTrainingConfig
from polite.teachers.noise import HighlightNoise, NoisyHighlights, ShuffledHighlights
from polite.teachers.oracle import Oracle
from polite.teachers.quantile import QUANTILES, QuantileOracle, moment_quantiles
from polite.types import SegmentPool

OWN_FORM = "choice"
"""The form of the highlight loss that is used unless another is asked for (docs/highlights.md)."""
TIE = 0.01
"""Tie threshold for such an env, as a share of the spread of the first segments' returns."""


@dataclass(frozen=True)
class EnvPreset:
    """How preferences are learned in one env."""

    oracle: Oracle | None = None
    """Who answers; None for one whose thresholds are quantiles of the first segments."""
    training: RewardTrainingConfig = field(
        default_factory=lambda: RewardTrainingConfig(batch_size=64, highlight_length=5)
    )
    """L, λ, α and the minibatch of the reward model."""
    ppo: PpoConfig = field(
        default_factory=lambda: PpoConfig(num_envs=8, rollout=256, learning_rate=3e-4, log_std=0.0)
    )
    """The policy's training, chosen for a laptop's two cores."""
    paper_ppo: PpoConfig | None = None
    """The same with the paper's numbers; None where there are none."""
    net: RewardNetConfig = FAST
    """The reward model."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """Keywords of the env."""

    marks_unusual: bool = False
    """Whether the oracle's highlight thresholds are quantiles of the segments around
    (`QuantileOracle`), instead of the oracle's own."""
    noise: HighlightNoise = field(default_factory=HighlightNoise)
    """How often the oracle's highlights go wrong."""
    shuffled: bool = False
    """Whether the highlights of each session are dealt out anew among its answers."""

    def as_in_paper(self) -> EnvPreset:
        """The same with the paper's reward network and, where the paper has numbers, its PPO."""
        return replace(self, net=PAPER, ppo=self.paper_ppo or self.ppo)

    def with_highlights(self, form: str) -> EnvPreset:
        """The same with a form of the highlight loss, a name in `HIGHLIGHT_LOSSES`.

        "paper" is the paper's form in all: its loss, its α, its oracle's thresholds. Any other form
        weighs as it stands (α = 1), and the oracle marks what is unusual.
        """
        if form == "paper":
            return self
        training = replace(self.training, highlights=form, alpha_positive=1.0, alpha_negative=1.0)
        return replace(self, training=training, marks_unusual=True)

    def oracle_for(self, pool: SegmentPool) -> Oracle:
        """The env's oracle; where it has none, one made for the first session's segments."""
        return self.oracle or quantile_oracle(pool, self.training.highlight_length)

    @property
    def make_teacher(self) -> MakeTeacher:
        """From the first session's segments to the oracle who answers."""

        def make(pool: SegmentPool) -> Teacher:
            oracle = self.oracle_for(pool)
            answers = (QuantileOracle(oracle) if self.marks_unusual else oracle).answer_queries
            if self.noise != HighlightNoise():
                answers = NoisyHighlights(answers, self.noise).answer_queries
            return ShuffledHighlights(answers).answer_queries if self.shuffled else answers

        return make


PRESETS: Final[Mapping[str, EnvPreset]] = {
    "SocialCorridor": EnvPreset(
        # The mean of three rewards is above .15 where any goal is reached (.5 / 3), below −.15 at a
        # collision (−1 / 3). The ±.2 of the authors' own corridor belongs to another reward; here
        # it would never mark the intermittent goal. A tie is 20 cm of way in five seconds.
        oracle=Oracle(
            tie_threshold=0.04, positive_threshold=0.15, negative_threshold=-0.15, length=10
        ),
        training=RewardTrainingConfig(batch_size=128, highlight_length=10),
        # At a fixed horizon all corridors are at the same part of their episodes: only a rollout of
        # a whole episode shows an update every part.
        ppo=PpoConfig(num_envs=4, rollout=600, batch_size=240, log_std=-0.5),
        settings={"terminate_on_goal": False, "terminate_on_collision": False},
    ),
    "HalfCheetah": EnvPreset(
        oracle=Oracle(),
        training=RewardTrainingConfig(batch_size=128, weight_decay=1e-3, highlight_length=5),
        ppo=PpoConfig(
            num_envs=8,
            rollout=256,
            learning_rate=3e-4,
            discount=0.98,
            gae_lambda=0.92,
            hidden=(256, 256),
            activation="relu",
            log_std=-2.0,
        ),
        paper_ppo=PpoConfig(
            num_envs=1,
            rollout=512,
            batch_size=64,
            epochs=20,
            learning_rate=2.0633e-5,
            anneal=False,
            discount=0.98,
            gae_lambda=0.92,
            clip=0.1,
            entropy=0.000401762,
            value_coefficient=0.58096,
            max_grad_norm=0.8,
            hidden=(256, 256),
            activation="relu",
            log_std=-2.0,
            orthogonal=False,
        ),
    ),
    "Walker2d": EnvPreset(
        oracle=Oracle(tie_threshold=2.0, positive_threshold=1.0, negative_threshold=-1.0),
        training=RewardTrainingConfig(batch_size=64, highlight_length=5, alpha_negative=5.0),
        paper_ppo=PpoConfig(
            num_envs=1,
            rollout=512,
            batch_size=32,
            epochs=20,
            learning_rate=5.05041e-5,
            anneal=False,
            clip=0.1,
            entropy=0.000585045,
            value_coefficient=0.871923,
            max_grad_norm=1.0,
            log_std=0.0,
        ),
    ),
}
"""By the env's name without module and version."""


def preset_of(env_id: str) -> EnvPreset:
    """The preset of an env, or what serves any env."""
    name = env_id.rpartition(":")[2].rpartition("-v")[0]
    return PRESETS.get(name, EnvPreset())


def quantile_oracle(pool: SegmentPool, length: int) -> Oracle:
    """An oracle that highlights what is rare in these segments.

    Args:
        pool: the first session's segments.
        length: L.
    """
    low, high = moment_quantiles(pool, QUANTILES)
    return Oracle(
        tie_threshold=float(TIE * pool.returns.std()),
        positive_threshold=high,
        negative_threshold=low,
        length=length,
        sign_test=False,
    )
