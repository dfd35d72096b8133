"""The reward model r̂_ψ(s, a)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import isfinite, sqrt
from typing import Literal, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn.functional import leaky_relu

from polite.rewards.blocks import in_blocks
from polite.rewards.dropout import dropout
from polite.rewards.linear import Linear
from polite.types import (
    Floats32,
    InvalidValueError,
    SegmentPool,
    ShapeError,
    check_finite_32,
)

_CONSTANT = 1e-6  # an entry with less spread than this is only centred


@dataclass(frozen=True)
class RewardNetConfig:
    """Shape of a reward network."""

    hidden: tuple[int, ...] = (256, 256, 256)
    """Units of each hidden layer."""
    dropout: tuple[float, ...] = (0.2, 0.5, 0.5)
    """Dropout probability after each hidden layer, in [0, 1)."""
    output: Literal["tanh", "linear"] = "tanh"
    """tanh keeps r̂ in (−1, 1), without which L₊ of POLITE's Eq. 4 would have no minimum; a linear
    one cannot saturate."""

    def __post_init__(self) -> None:
        """Check the layers.

        Raises:
            InvalidValueError: unless each hidden layer has at least one unit and a probability.
        """
        if (
            len(self.hidden) != len(self.dropout)
            or min(self.hidden, default=0) < 1
            or not all(0 <= p < 1 for p in self.dropout)
            or self.output not in ("tanh", "linear")
        ):
            raise InvalidValueError(
                "expected hidden sizes ≥ 1, as many dropouts in [0, 1) and the output 'tanh' or "
                f"'linear', got {self}"
            )


PAPER = RewardNetConfig()
"""The net of the paper's experiments (released code)."""
FAST = RewardNetConfig(hidden=(32, 32), dropout=(0.0, 0.0))
"""A net that a laptop trains in seconds."""


class RewardNet(nn.Module):
    """A multi-layer perceptron with leaky ReLUs.

    It takes raw observations and actions and standardises them with statistics that are fixed once
    (`standardise`). Its output is what is trained; what it pays (`reward`) can be normalised.
    """

    mean: Tensor
    std: Tensor
    level: Tensor
    scale: Tensor

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
        self.register_buffer("level", torch.zeros(1))
        self.register_buffer("scale", torch.ones(1))

    def forward(self, inputs: Tensor, generator: torch.Generator | None = None) -> Tensor:
        """Score raw (s, a).

        Args:
            inputs: observations and actions side by side, (…, n + v).
            generator: source of the dropout masks; without one nothing is dropped.

        Returns:
            r̂, in (−1, 1) unless the output is linear, (…).
        """
        return self.score_scaled(self.scaled(inputs), generator)

    def scaled(self, inputs: Tensor) -> Tensor:
        """Raw (s, a) with the input statistics taken out, (…, n + v)."""
        return (inputs - self.mean) / self.std

    def score_scaled(self, inputs: Tensor, generator: torch.Generator | None = None) -> Tensor:
        """Score what `scaled` gave: a training takes the statistics out once, not at every step."""
        rows = inputs.reshape(-1, len(self.mean))
        rewards = in_blocks(
            lambda block: self._score_rows(block, generator), rows, max(self.config.hidden)
        )
        return rewards.view(inputs.shape[:-1])

    def _score_rows(self, features: Tensor, generator: torch.Generator | None) -> Tensor:
        """Score the rows of a matrix, (R, n + v) -> (R,)."""
        # A matrix, because in-place steps on a view of more axes would be copied when undone.
        *hidden, last = self.layers
        for layer, probability in zip(hidden, self.config.dropout, strict=True):
            features = leaky_relu(layer(features), inplace=True)
            if generator is not None:
                features = dropout(features, probability, generator)
        rewards = last(features)[:, 0]
        return torch.tanh(rewards) if self.config.output == "tanh" else rewards

    def score(self, inputs: Tensor) -> Tensor:
        """Score raw (s, a), (…, n + v), as an ensemble of one, (1, …), without dropout."""
        return self(inputs)[None]  # type: ignore[no-any-return]

    def reward(self, inputs: Tensor) -> Tensor:
        """What is paid for raw (s, a): the score, normalised, (…, n + v) -> (…)."""
        return (self(inputs) - self.level[0]) / self.scale[0]  # type: ignore[no-any-return]

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


def _linear(fan_in: int, fan_out: int, generator: torch.Generator) -> Linear:
    """PyTorch's default initialisation, U(±1/√fan_in), from a generator instead of global state."""
    layer = Linear(fan_in, fan_out, device="meta").to_empty(device="cpu")
    with torch.no_grad():
        for parameter in layer.parameters():
            parameter.uniform_(-1 / sqrt(fan_in), 1 / sqrt(fan_in), generator=generator)
    return layer


class RewardModel(Protocol):
    """What pays a policy: one network, or several of which the mean does."""

    observation_size: int
    action_size: int
    level: Tensor
    """Mean r̂ of each of K members where `normalise` measured it, (K,); 0 before."""
    scale: Tensor
    """Its standard deviation there, (K,); 1 before."""

    def score(self, inputs: Tensor) -> Tensor:
        """Score raw (s, a), (…, n + v), with every member, (K, …), without dropout."""

    def reward(self, inputs: Tensor) -> Tensor:
        """What is paid for raw (s, a): the members' mean, normalised, (…, n + v) -> (…)."""


def normalise(model: RewardModel, pool: SegmentPool) -> None:
    """Let each member's r̂ have mean 0 and standard deviation 1 over the pool's real steps.

    What is paid changes, what is trained does not (as Christiano et al. 2017: the scale of r̂ means
    nothing to Eq. 1's differences, but something to the policy's training). A member that scores
    all steps alike is only centred.

    Args:
        model: one network or several, changed in place.
        pool: segments whose real steps count.
    """
    inputs = np.concatenate([pool.observations, pool.actions], axis=-1)[pool.mask]
    with torch.no_grad():
        rewards = model.score(torch.from_numpy(inputs)).double()  # (K, steps)
    spread = rewards.std(dim=1, correction=0)
    model.level.copy_(rewards.mean(dim=1))
    model.scale.copy_(torch.where(spread < _CONSTANT, 1.0, spread))


def raise_by(model: RewardModel, offset: float) -> None:
    """Let a model pay so much more for every step, in place.

    Comparisons of segments of one length (Eq. 1) leave this constant open. Where episodes may end
    early it decides whether ending them pays.

    Raises:
        InvalidValueError: if the offset is not finite.
    """
    if not isfinite(offset):
        raise InvalidValueError(f"reward_offset: expected a finite number, got {offset}")
    model.level.sub_(offset * model.scale)


def predict(
    net: RewardModel, observations: NDArray[np.floating], actions: NDArray[np.floating]
) -> Floats32:
    """Score arrays of raw observations and actions, without dropout.

    Args:
        net: the reward model.
        observations: (…, n).
        actions: (…, v) with the same leading axes.

    Returns:
        r̂ as it is paid, (…) float32.

    Raises:
        ShapeError: if the arrays do not fit the net or each other.
        NotFiniteError: if an observation or action is NaN or infinite, or beyond float32.
    """
    rows = np.shape(observations)[:-1]
    for name, array, size in (
        ("observations", observations, net.observation_size),
        ("actions", actions, net.action_size),
    ):
        if np.shape(array) != (*rows, size):
            raise ShapeError(
                f"{name}: the reward model expects {(*rows, size)}, got {np.shape(array)}"
            )
        check_finite_32(name, array)
    inputs = np.concatenate([observations, actions], axis=-1, dtype=np.float32, casting="same_kind")
    with torch.no_grad():
        return np.asarray(net.reward(torch.from_numpy(inputs)).numpy(), dtype=np.float32)
