"""How new a state is: the entropy that PEBBLE's policy gathers before anybody is asked.

Lee, Smith, Abbeel, PEBBLE (ICML 2021), section 4.1: r(s) = log ‖s − s⁽ᵏ⁾‖, with s⁽ᵏ⁾ the k-th
nearest neighbour of s among all states seen, over the running standard deviation of r. (The
released code, B-Pref, leaves the logarithm out.)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import torch
from torch import Tensor

from polite.types import InvalidValueError

ROWS_AT_ONCE = 4096
"""States that distances are computed from at a time, which bounds the memory."""
CLOSEST = 1e-6
"""A distance below this counts as this, for the logarithm's sake."""


def neighbour_distances(states: Tensor, among: Tensor, k: int) -> Tensor:
    """The distance of each state from the k-th nearest one, itself not counted.

    Candidates are found by a fast formula that rounds coarsely; their distances are then computed
    from differences.

    Args:
        states: (B, n), each of them also one of `among`.
        among: (N, n).
        k: at least 1; the farthest neighbour is taken where there are fewer.

    Returns:
        (B,), 0 where there is no other state.

    Raises:
        InvalidValueError: if k is below 1 or there is no state to compare with.
    """
    if k < 1 or len(among) == 0:
        raise InvalidValueError(f"expected k ≥ 1 and at least one state, got {k} and {len(among)}")
    count = min(k + 1, len(among))  # the state itself is the nearest one
    centre = among.mean(dim=0)  # far from it, the fast formula rounds more coarsely
    found, first = [], 0
    for part in torch.split(among, ROWS_AT_ONCE):
        distances = torch.cdist(states - centre, part - centre)
        near = distances.topk(min(count, len(part)), largest=False)
        found.append((near.values, near.indices + first))
        first += len(part)
    distances, places = (torch.cat(parts, dim=1) for parts in zip(*found, strict=True))
    nearest = places.gather(1, distances.topk(count, largest=False).indices)
    exact: Tensor = torch.linalg.vector_norm(states[:, None] - among[nearest], dim=2)
    return exact.amax(dim=1)


@dataclass(frozen=True)
class Spread:
    """Count, mean and spread of values that come batch by batch (Chan, Golub, LeVeque 1979)."""

    count: int = 0
    """Values so far."""
    mean: float = 0.0
    """Their mean."""
    squares: float = 0.0
    """The sum of their squared distances from the mean."""

    def joined(self, values: Tensor) -> Self:
        """With more values, (B,)."""
        batch, own = values.double(), len(values)
        count, shift = self.count + own, float(batch.mean()) - self.mean
        squares = float((batch - batch.mean()).square().sum())
        return type(self)(
            count=count,
            mean=self.mean + shift * own / count,
            squares=self.squares + squares + shift**2 * self.count * own / count,
        )

    @property
    def std(self) -> float:
        """The standard deviation; 1 as long as all values are the same."""
        return (self.squares / self.count) ** 0.5 if self.squares > 0 else 1.0


class StateEntropy:
    """Pays for states that are far from all others."""

    def __init__(self, k: int) -> None:
        """Begin.

        Args:
            k: which neighbour counts.
        """
        self._k = k
        self._spread = Spread()

    def __call__(self, states: Tensor, among: Tensor) -> Tensor:
        """Reward (B, n) states among (N, n): (B,)."""
        entropy = neighbour_distances(states, among, self._k).clamp(min=CLOSEST).log()
        self._spread = self._spread.joined(entropy)
        return entropy / self._spread.std
