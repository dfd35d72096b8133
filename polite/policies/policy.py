"""A trained policy as numbers: network weights and the statistics that it sees the world through.

stable-baselines3's own files are pickles, which can run code when they are loaded; these cannot.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Final

import numpy as np
import torch
from numpy.typing import NDArray

from polite.files import damage
from polite.torch_files import save_tensors
from polite.types import PoliteError, ShapeError

CLIP = 10.0
"""Normalised observations are clipped to this, as by VecNormalize."""
EPSILON = 1e-8
"""Added to the variance, as by VecNormalize."""
LOG_STD = (-20.0, 2.0)
"""The logarithm of a squashed Gaussian's standard deviation is kept in this range, as by SAC."""


class Policy(ABC):
    """What every trained policy can do.

    Attributes:
        kind: The name of the class in a file.
        arrays: Its fields that are arrays, beside the weights.
        weights: (W_1, b_1, ..., W_k, b_k), the last pair without activation.
        activation: "tanh" or "relu".
    """

    kind: ClassVar[str]
    arrays: ClassVar[tuple[str, ...]]
    weights: tuple[NDArray[np.float32], ...]
    activation: str

    def __repr__(self) -> str:
        """Its layers; the weights would fill pages."""
        layers = [self.weights[0].shape[1], *(len(bias) for bias in self.weights[1::2])]
        return f"{type(self).__name__}({'-'.join(map(str, layers))}, {self.activation})"

    @abstractmethod
    def mean_action(self, observations: NDArray[Any]) -> NDArray[np.float32]:
        """The most likely actions, within their bounds.

        Args:
            observations: (N, n) raw.

        Returns:
            (N, v) float32.

        Raises:
            ShapeError: The observations are not those that it was trained on.
        """

    @abstractmethod
    def sample(self, observations: NDArray[Any], rng: np.random.Generator) -> NDArray[np.float32]:
        """Actions drawn from the policy; arguments and errors as `mean_action`."""

    def predict(
        self,
        observation: NDArray[Any],
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], Any]:
        """The most likely actions, as stable-baselines3's models give them; no state is kept.

        Args:
            observation: (N, n) raw, or (n,).
            state: Given back as it is.
            episode_start: Not needed.
            deterministic: `sample` draws actions.

        Raises:
            ShapeError: The observations are not those that it was trained on.
            PoliteError: Actions that are drawn were asked for.
        """
        if not deterministic:
            raise PoliteError("predict gives the most likely actions; sample() draws some")
        single = np.asarray(observation)
        actions = self.mean_action(np.atleast_2d(single))
        return (actions[0] if single.ndim == 1 else actions), state


@dataclass(frozen=True, eq=False, repr=False)
class GaussianPolicy(Policy):
    """A diagonal Gaussian over actions, with the mean from a multi-layer perceptron.

    Attributes:
        weights: (W_1, b_1, ..., W_k, b_k), the last pair without activation.
        activation: "tanh" or "relu".
        log_std: (v,).
        mean: (n,) of the observations.
        variance: (n,) of the observations.
        low: (v,) actions are clipped to [low, high].
        high: (v,).
    """

    kind: ClassVar[str] = "gaussian"
    arrays: ClassVar[tuple[str, ...]] = ("log_std", "mean", "variance", "low", "high")
    weights: tuple[NDArray[np.float32], ...]
    activation: str
    log_std: NDArray[np.float32]
    mean: NDArray[np.float64]
    variance: NDArray[np.float64]
    low: NDArray[np.float32]
    high: NDArray[np.float32]

    def mean_action(self, observations: NDArray[Any]) -> NDArray[np.float32]:
        """The mean of the Gaussian, clipped (see `Policy`)."""
        return np.clip(self._mean(observations), self.low, self.high)

    def sample(self, observations: NDArray[Any], rng: np.random.Generator) -> NDArray[np.float32]:
        """Actions drawn from the policy, clipped; arguments and errors as `mean_action`."""
        mean = self._mean(observations)
        noise = rng.standard_normal(mean.shape).astype(np.float32)
        return np.clip(mean + np.exp(self.log_std) * noise, self.low, self.high)

    def _mean(self, observations: NDArray[Any]) -> NDArray[np.float32]:
        """(N, v) means of the Gaussian."""
        _check_rows(observations, len(self.mean))
        scaled = (observations - self.mean) / np.sqrt(self.variance + EPSILON)
        return _perceptron(np.clip(scaled, -CLIP, CLIP), self.weights, self.activation)


@dataclass(frozen=True, eq=False, repr=False)
class SquashedGaussianPolicy(Policy):
    """A diagonal Gaussian whose draws are squashed by tanh and stretched over the actions (SAC's).

    Attributes:
        weights: (W_1, b_1, ..., W_k, b_k) for raw observations, the last pair without activation;
            it gives v means and then v logarithms of standard deviations.
        activation: "tanh" or "relu".
        low: (v,) actions lie in [low, high].
        high: (v,).
    """

    kind: ClassVar[str] = "squashed"
    arrays: ClassVar[tuple[str, ...]] = ("low", "high")
    weights: tuple[NDArray[np.float32], ...]
    activation: str
    low: NDArray[np.float32]
    high: NDArray[np.float32]

    def mean_action(self, observations: NDArray[Any]) -> NDArray[np.float32]:
        """The squashed mean of the Gaussian (see `Policy`)."""
        mean, _ = self._gaussian(observations)
        return self._squash(mean)

    def sample(self, observations: NDArray[Any], rng: np.random.Generator) -> NDArray[np.float32]:
        """Actions drawn from the policy; arguments and errors as `mean_action`."""
        mean, log_std = self._gaussian(observations)
        noise = rng.standard_normal(mean.shape).astype(np.float32)
        return self._squash(mean + np.exp(log_std) * noise)

    def _gaussian(
        self, observations: NDArray[Any]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(N, v) means, and logarithms of standard deviations."""
        _check_rows(observations, self.weights[0].shape[1])
        outputs = _perceptron(observations, self.weights, self.activation)
        mean, log_std = np.split(outputs, 2, axis=1)
        return mean, np.clip(log_std, *LOG_STD)

    def _squash(self, drawn: NDArray[Any]) -> NDArray[np.float32]:
        """(N, v) within the bounds."""
        share = 0.5 * (np.tanh(drawn) + 1.0)
        return np.asarray(self.low + share * (self.high - self.low), dtype=np.float32)


def _check_rows(observations: NDArray[Any], size: int) -> None:
    if observations.ndim != 2 or observations.shape[1] != size:
        raise ShapeError(f"observations: the policy expects (N, {size}), got {observations.shape}")


def _perceptron(
    inputs: NDArray[Any], weights: Sequence[NDArray[np.float32]], activation: str
) -> NDArray[np.float32]:
    """A multi-layer perceptron without activation at its end, (N, n) -> (N, outputs)."""
    hidden = inputs.astype(np.float32)
    pairs = list(zip(weights[::2], weights[1::2], strict=True))
    for weight, bias in pairs[:-1]:
        hidden = hidden @ weight.T + bias
        hidden = np.tanh(hidden) if activation == "tanh" else np.maximum(hidden, 0.0)
    return np.asarray(hidden @ pairs[-1][0].T + pairs[-1][1], dtype=np.float32)


_KINDS: Final[dict[str, Any]] = {c.kind: c for c in (GaussianPolicy, SquashedGaussianPolicy)}


def save_policy(path: Path | str, policy: Policy) -> None:
    """Write a policy to one file, whole or not at all."""
    save_tensors(Path(path), pack_policy(policy))


def load_policy(path: Path | str) -> Policy:
    """Read a policy that `save_policy` wrote. Nothing in the file can run code.

    Raises:
        PoliteError: Naming the file, if it is missing, damaged, not a policy, or has NaN.
    """
    if not Path(path).is_file():
        raise PoliteError(f"{path}: no such policy")
    try:
        content = torch.load(path, weights_only=True)
        if "observation_size" in content:
            raise PoliteError("it is a reward model's")
        return unpack_policy(content)
    except Exception as error:  # a damaged file fails in a dozen ways inside PyTorch
        raise PoliteError(
            f"{path}: expected a policy that polite saved ({damage(error)})"
        ) from None


def pack_policy(policy: Policy) -> dict[str, Any]:
    """A policy as tensors and text."""
    content: dict[str, Any] = {
        "kind": policy.kind,
        "weights": [torch.from_numpy(weight) for weight in policy.weights],
        "activation": policy.activation,
    }
    for name in policy.arrays:
        content[name] = torch.from_numpy(np.array(getattr(policy, name)))
    return content


def unpack_policy(content: dict[str, Any]) -> Policy:
    """What `pack_policy` was given.

    Raises:
        ValueError: A number is NaN or infinite.
    """
    kind = _KINDS[content.get("kind", "gaussian")]  # the first files did not say
    arrays = {name: content[name].numpy() for name in kind.arrays}
    weights = tuple(weight.numpy() for weight in content["weights"])
    if not all(np.isfinite(values).all() for values in (*weights, *arrays.values())):
        raise ValueError("NaN or infinity among its numbers")
    policy: Policy = kind(weights=weights, activation=content["activation"], **arrays)
    return policy
