"""The reward model r̂_ψ(s, a), and its file."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from itertools import pairwise
from math import sqrt
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn.functional import leaky_relu

from polite.files import write_atomically
from polite.rewards.dropout import dropout
from polite.types import (
    Floats32,
    InvalidValueError,
    PoliteError,
    SegmentPool,
    ShapeError,
    check_finite,
)

_ROWS_AT_ONCE = 8192
_CONSTANT = 1e-6  # an entry with less spread than this is only centred


@dataclass(frozen=True)
class RewardNetConfig:
    """Shape of a reward network."""

    hidden: tuple[int, ...] = (256, 256, 256)
    """Units of each hidden layer."""
    dropout: tuple[float, ...] = (0.2, 0.5, 0.5)
    """Dropout probability after each hidden layer, in [0, 1)."""

    def __post_init__(self) -> None:
        """Check the layers.

        Raises:
            InvalidValueError: unless each hidden layer has at least one unit and a probability.
        """
        if (
            len(self.hidden) != len(self.dropout)
            or min(self.hidden, default=0) < 1
            or not all(0 <= p < 1 for p in self.dropout)
        ):
            raise InvalidValueError(
                f"expected hidden sizes ≥ 1 and as many dropouts in [0, 1), got {self}"
            )


PAPER = RewardNetConfig()
"""The net of the paper's experiments (released code)."""
FAST = RewardNetConfig(hidden=(32, 32), dropout=(0.0, 0.0))
"""A net that a laptop trains in seconds."""


class RewardNet(nn.Module):
    """A multi-layer perceptron with leaky ReLUs and an output in (−1, 1).

    It takes raw observations and actions and standardises them with statistics that are fixed once
    (`standardise`). Without a bound on the output, L₊ of POLITE's Eq. 4 would have no minimum.
    """

    mean: Tensor
    std: Tensor

    def __init__(
        self,
        observation_size: int,
        action_size: int,
        config: RewardNetConfig,
        generator: torch.Generator,
    ) -> None:
        """Draw the initial weights.

        Args:
            observation_size: n.
            action_size: v.
            config: hidden layers and their dropout.
            generator: source of the initial weights.
        """
        super().__init__()
        self.observation_size = observation_size
        self.action_size = action_size
        self.config = config
        sizes = (observation_size + action_size, *config.hidden, 1)
        self.layers = nn.ModuleList(
            _linear(fan_in, fan_out, generator) for fan_in, fan_out in pairwise(sizes)
        )
        self.register_buffer("mean", torch.zeros(sizes[0]))
        self.register_buffer("std", torch.ones(sizes[0]))

    def forward(self, inputs: Tensor, generator: torch.Generator | None = None) -> Tensor:
        """Score raw (s, a).

        Args:
            inputs: observations and actions side by side, (…, n + v).
            generator: source of the dropout masks; without one nothing is dropped.

        Returns:
            r̂ in (−1, 1), (…).
        """
        # As rows of a matrix: in-place steps on a view of more axes would be copied when undone.
        features = ((inputs - self.mean) / self.std).reshape(-1, len(self.mean))
        *hidden, last = self.layers
        for layer, probability in zip(hidden, self.config.dropout, strict=True):
            features = leaky_relu(layer(features), inplace=True)
            if generator is not None:
                features = dropout(features, probability, generator)
        return torch.tanh(last(features)).reshape(inputs.shape[:-1])

    def standardise(self, pool: SegmentPool) -> None:
        """Fix the input statistics to those of the pool's real steps.

        Raises:
            ShapeError: if the pool has other observations or actions than the net.
        """
        inputs = np.concatenate([pool.observations, pool.actions], axis=-1)[pool.mask]
        if inputs.shape[1] != len(self.mean):
            raise ShapeError(
                f"pool: expected n + v = {len(self.mean)} inputs, got {inputs.shape[1]}"
            )
        spread = inputs.std(axis=0, dtype=np.float64)
        spread = np.where(spread < _CONSTANT, 1.0, spread)
        self.mean.copy_(torch.from_numpy(inputs.mean(axis=0, dtype=np.float64)))
        self.std.copy_(torch.from_numpy(spread))


def _linear(fan_in: int, fan_out: int, generator: torch.Generator) -> nn.Linear:
    """PyTorch's default initialisation, U(±1/√fan_in), from a generator instead of global state."""
    layer = nn.Linear(fan_in, fan_out, device="meta").to_empty(device="cpu")
    with torch.no_grad():
        for parameter in layer.parameters():
            parameter.uniform_(-1 / sqrt(fan_in), 1 / sqrt(fan_in), generator=generator)
    return layer


def predict(
    net: RewardNet, observations: NDArray[np.floating], actions: NDArray[np.floating]
) -> Floats32:
    """Score arrays of raw observations and actions, without dropout.

    Args:
        net: the reward model.
        observations: (…, n).
        actions: (…, v) with the same leading axes.

    Returns:
        r̂ in (−1, 1), (…) float32.

    Raises:
        ShapeError: if the arrays do not fit the net or each other.
        NotFiniteError: if an observation or action is NaN or infinite.
    """
    rows = np.shape(observations)[:-1]
    for name, array, size in (
        ("observations", observations, net.observation_size),
        ("actions", actions, net.action_size),
    ):
        if np.shape(array) != (*rows, size):
            raise ShapeError(f"{name}: the reward model expects {(*rows, size)}, got {array.shape}")
        check_finite(name, array)
    inputs = np.concatenate([observations, actions], axis=-1, dtype=np.float32, casting="same_kind")
    flat = torch.from_numpy(inputs.reshape(-1, inputs.shape[-1]))
    with torch.no_grad():  # in chunks, so that a million states need no gigabytes
        rewards = [net(chunk) for chunk in torch.split(flat, _ROWS_AT_ONCE)]
    return np.asarray(torch.cat(rewards).numpy().reshape(rows), dtype=np.float32)


def save_reward_model(path: Path, net: RewardNet) -> None:
    """Write the net's weights, statistics and shape to one file, whole or not at all."""
    content = {
        "observation_size": net.observation_size,
        "action_size": net.action_size,
        "config": asdict(net.config),
        "state": net.state_dict(),
    }
    write_atomically(path, lambda temporary: torch.save(content, temporary))


def load_reward_model(path: Path | str) -> RewardNet:
    """Read a net that `save_reward_model` wrote. Nothing in the file can run code.

    Raises:
        PoliteError: naming the file, if it is missing, damaged, or not a reward model.
    """
    if not Path(path).is_file():
        raise PoliteError(f"{path}: no such reward model")
    try:
        content = torch.load(path, weights_only=True)
        net = RewardNet(
            content["observation_size"],
            content["action_size"],
            RewardNetConfig(**content["config"]),
            torch.Generator(),
        )
        net.load_state_dict(content["state"])
    except Exception as error:  # a damaged file fails in a dozen ways inside PyTorch
        reason = " ".join(str(error).split())[:300]
        raise PoliteError(f"{path}: expected a reward model that polite saved ({reason})") from None
    return net
