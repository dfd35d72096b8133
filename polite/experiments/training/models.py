"""The two files of a finished training: its policy and, unless the true reward paid, its reward."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from polite.policies.policy import Policy, load_policy, save_policy
from polite.rewards.ensemble import RewardEnsemble
from polite.rewards.files import load_reward_model, save_reward_model
from polite.rewards.network import RewardNet

POLICY: Final = "policy.pt"
REWARD: Final = "reward.pt"
Reward = RewardNet | RewardEnsemble | None
"""What paid the policy; None where the env's own reward did."""


def save_models(folder: Path, policy: Policy, reward: Reward) -> None:
    """Write both, each whole or not at all."""
    save_policy(folder / POLICY, policy)
    if reward is not None:
        save_reward_model(folder / REWARD, reward)


def load_models(folder: Path) -> tuple[Policy, Reward]:
    """Read what `save_models` wrote.

    Raises:
        PoliteError: naming the file, if the policy is missing or either is damaged.
    """
    rewarded = (folder / REWARD).exists()
    return load_policy(folder / POLICY), load_reward_model(folder / REWARD) if rewarded else None
