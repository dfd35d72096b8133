"""A reward model's file: one network or an ensemble."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch

from polite.files import damage
from polite.rewards.ensemble import RewardEnsemble
from polite.rewards.network import RewardNet, RewardNetConfig
from polite.torch_files import save_tensors
from polite.types import PoliteError, ShapeError

Shape = tuple[int, ...] | None
"""Of an array of a Gymnasium space, which may have none."""
_UNNORMALISED = {"level": torch.zeros(1), "scale": torch.ones(1)}  # the first files do not say


def save_reward_model(path: Path | str, model: RewardNet | RewardEnsemble) -> None:
    """Write a model's weights, statistics and shape to one file, whole or not at all."""
    content: dict[str, Any] = {
        "observation_size": model.observation_size,
        "action_size": model.action_size,
        "config": asdict(model.config),
    }
    if isinstance(model, RewardEnsemble):
        content["members"] = [model.member(k).state_dict() for k in range(len(model))]
    else:
        content["state"] = model.state_dict()
    save_tensors(Path(path), content)


def load_reward_model(path: Path | str) -> RewardNet | RewardEnsemble:
    """Read a model that `save_reward_model` wrote. Nothing in the file can run code.

    Raises:
        PoliteError: naming the file, if it is missing, damaged, or not a reward model.
    """
    if not Path(path).is_file():
        raise PoliteError(f"{path}: no such reward model")
    try:
        content = torch.load(path, weights_only=True)
        if "activation" in content:
            raise PoliteError("it is a policy's")
        if "members" in content:
            return RewardEnsemble([_network(content, state) for state in content["members"]])
        return _network(content, content["state"])
    except Exception as error:  # a damaged file fails in a dozen ways inside PyTorch
        raise PoliteError(
            f"{path}: expected a reward model that polite saved ({damage(error)})"
        ) from None


def check_sizes(model: RewardNet | RewardEnsemble, observations: Shape, actions: Shape) -> None:
    """Check that a model can pay in an env.

    Args:
        model: of n observed numbers and v of an action.
        observations: shape of the env's, (n,) where it fits.
        actions: likewise, (v,).

    Raises:
        ShapeError: if it cannot.
    """
    expected, seen = ((model.observation_size,), (model.action_size,)), (observations, actions)
    if seen != expected:
        raise ShapeError(
            "the reward model was trained on observations and actions of shapes "
            f"{expected}, got an env with {seen}"
        )


def _network(content: dict[str, Any], state: dict[str, Any]) -> RewardNet:
    config = RewardNetConfig(**content["config"])
    net = RewardNet(content["observation_size"], content["action_size"], config, torch.Generator())
    net.load_state_dict(_UNNORMALISED | state)
    if not all(torch.isfinite(values).all() for values in net.state_dict().values()):
        raise ValueError("NaN or infinity among its weights")
    return net
