"""One reward network or several: made and trained alike."""

from __future__ import annotations

from collections.abc import Callable

import torch

from polite.rewards.data import PreferenceData
from polite.rewards.ensemble import RewardEnsemble, train_ensemble
from polite.rewards.network import RewardNet, RewardNetConfig
from polite.rewards.trainer import RewardTrainingConfig, train_reward


def make_model(
    sizes: tuple[int, int],
    config: RewardNetConfig,
    members: int,
    generator: torch.Generator,
) -> RewardNet | RewardEnsemble:
    """A new reward model; the first member of several is the one that there is of one.

    Args:
        sizes: n and v, of observations and actions.
        config: shape of a network.
        members: how many networks.
        generator: source of the first weights.
    """
    nets = [RewardNet(*sizes, config, generator) for _ in range(members)]
    return nets[0] if members == 1 else RewardEnsemble(nets)


def train_model(
    model: RewardNet | RewardEnsemble,
    data: PreferenceData,
    config: RewardTrainingConfig,
    generator: torch.Generator,
    on_epoch: Callable[[int], object] = lambda epoch: None,
) -> None:
    """`train_reward`, or `train_ensemble` if there are several; `on_epoch` is told the number."""
    if isinstance(model, RewardEnsemble):
        train_ensemble(model, data, config, generator, lambda epoch, _: on_epoch(epoch))
    else:
        train_reward(model, data, config, generator, lambda epoch, _: on_epoch(epoch))
