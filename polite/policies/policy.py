"""A trained policy as numbers: network weights and the statistics that it sees the world through.

stable-baselines3's own files are pickles, which can run code when they are loaded; these cannot.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from polite.files import one_line, write_atomically
from polite.types import PoliteError, ShapeError

CLIP = 10.0
"""Normalised observations are clipped to this, as by VecNormalize."""
EPSILON = 1e-8
"""Added to the variance, as by VecNormalize."""


@dataclass(frozen=True, eq=False)
class GaussianPolicy:
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

    weights: tuple[NDArray[np.float32], ...]
    activation: str
    log_std: NDArray[np.float32]
    mean: NDArray[np.float64]
    variance: NDArray[np.float64]
    low: NDArray[np.float32]
    high: NDArray[np.float32]

    def mean_action(self, observations: NDArray[Any]) -> NDArray[np.float32]:
        """The most likely actions, clipped.

        Args:
            observations: (N, n) raw.

        Returns:
            (N, v) float32.

        Raises:
            ShapeError: The observations are not those that it was trained on.
        """
        return np.clip(self._mean(observations), self.low, self.high)

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

    def sample(self, observations: NDArray[Any], rng: np.random.Generator) -> NDArray[np.float32]:
        """Actions drawn from the policy, clipped; arguments and errors as `mean_action`."""
        mean = self._mean(observations)
        noise = rng.standard_normal(mean.shape).astype(np.float32)
        return np.clip(mean + np.exp(self.log_std) * noise, self.low, self.high)

    def _mean(self, observations: NDArray[Any]) -> NDArray[np.float32]:
        """(N, v) means of the Gaussian."""
        if observations.ndim != 2 or observations.shape[1] != len(self.mean):
            raise ShapeError(
                f"observations: the policy expects (N, {len(self.mean)}), got {observations.shape}"
            )
        scaled = (observations - self.mean) / np.sqrt(self.variance + EPSILON)
        hidden = np.clip(scaled, -CLIP, CLIP).astype(np.float32)
        pairs = list(zip(self.weights[::2], self.weights[1::2], strict=True))
        for weight, bias in pairs[:-1]:
            hidden = hidden @ weight.T + bias
            hidden = np.tanh(hidden) if self.activation == "tanh" else np.maximum(hidden, 0.0)
        return np.asarray(hidden @ pairs[-1][0].T + pairs[-1][1], dtype=np.float32)


def save_policy(path: Path, policy: GaussianPolicy) -> None:
    """Write a policy to one file, whole or not at all."""
    content: dict[str, Any] = {
        "weights": [torch.from_numpy(weight) for weight in policy.weights],
        "activation": policy.activation,
    }
    for name in ("log_std", "mean", "variance", "low", "high"):
        content[name] = torch.from_numpy(np.array(getattr(policy, name)))
    write_atomically(path, lambda temporary: torch.save(content, temporary))


def load_policy(path: Path) -> GaussianPolicy:
    """Read a policy that `save_policy` wrote. Nothing in the file can run code.

    Raises:
        PoliteError: Naming the file, if it is missing, damaged, or not a policy.
    """
    if not path.is_file():
        raise PoliteError(f"{path}: no such policy")
    try:
        content = torch.load(path, weights_only=True)
        arrays = {
            name: content[name].numpy() for name in ("log_std", "mean", "variance", "low", "high")
        }
        weights = tuple(weight.numpy() for weight in content["weights"])
        return GaussianPolicy(weights=weights, activation=content["activation"], **arrays)
    except Exception as error:  # a damaged file fails in a dozen ways inside PyTorch
        reason = one_line(error)
        raise PoliteError(f"{path}: expected a policy that polite saved ({reason})") from None
