"""Which pairs a session asks about: the samplers, given what the training has at hand."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from polite.rewards.ensemble import RewardEnsemble, member_probabilities
from polite.rewards.network import RewardNet
from polite.samplers import (
    disagreement_pairs,
    disputed_k_centre_pairs,
    entropy_pairs,
    k_centre_pairs,
    segment_features,
    uniform_pairs,
)
from polite.types import Floats64, InvalidValueError, Query, SegmentPool

CANDIDATES = 10
"""Pairs that are drawn for each that is asked (Christiano et al. 2017; PEBBLE)."""


@dataclass(frozen=True, eq=False)
class PairRequest:
    """What a session needs."""

    pool: SegmentPool
    """The segments of the last sessions, S of them."""
    asked: Sequence[Query]
    """Pairs of them that were asked about before."""
    count: int
    """Pairs to ask about now."""
    rng: np.random.Generator
    """Source of the draws."""

    def draw(self, per_pair: int = 1) -> list[Query]:
        """Draw pairs uniformly, so many for each that is to be asked."""
        return uniform_pairs(per_pair * self.count, self.rng, self.pool)

    def candidates(self) -> list[Query]:
        """Draw `CANDIDATES` for each; those asked before are left out if enough others are left.

        A model may still be uncertain about them, or its members disagree, long after the answer.
        """
        asked = {frozenset((pair.first, pair.second)) for pair in self.asked}
        drawn = self.draw(CANDIDATES)
        fresh = [pair for pair in drawn if frozenset((pair.first, pair.second)) not in asked]
        return fresh if len(fresh) >= self.count else drawn


PairSampler = Callable[[PairRequest, RewardNet | RewardEnsemble], list[Query]]
"""(request, reward model as it is) -> as many pairs of the pool as requested."""


def ask_uniformly(request: PairRequest, model: RewardNet | RewardEnsemble) -> list[Query]:
    """Any pairs (`uniform_pairs`)."""
    return request.draw()


def ask_disputed(request: PairRequest, model: RewardNet | RewardEnsemble) -> list[Query]:
    """What an ensemble disagrees about most (`disagreement_pairs`)."""
    candidates = request.candidates()
    return disagreement_pairs(candidates, _opinions(request, model, candidates), request.count)


def ask_uncertain(request: PairRequest, model: RewardNet | RewardEnsemble) -> list[Query]:
    """What the model is least certain about (`entropy_pairs`)."""
    candidates = request.candidates()
    return entropy_pairs(candidates, _opinions(request, model, candidates), request.count)


def ask_centres(request: PairRequest, model: RewardNet | RewardEnsemble) -> list[Query]:
    """What covers all that was seen (`k_centre_pairs`)."""
    features = segment_features(request.pool)
    return k_centre_pairs(request.candidates(), features, request.count, request.asked)


def ask_disputed_centres(request: PairRequest, model: RewardNet | RewardEnsemble) -> list[Query]:
    """What covers the half that an ensemble disagrees about most (`disputed_k_centre_pairs`)."""
    candidates = request.candidates()
    opinions, features = _opinions(request, model, candidates), segment_features(request.pool)
    return disputed_k_centre_pairs(candidates, opinions, features, request.count, request.asked)


PAIR_SAMPLERS: Final[Mapping[str, PairSampler]] = {
    "uniform": ask_uniformly,
    "disagreement": ask_disputed,
    "entropy": ask_uncertain,
    "k-centre": ask_centres,
    "disputed-k-centre": ask_disputed_centres,
}
"""By the names that the command line uses."""
NEED_ENSEMBLE: Final = (ask_disputed, ask_disputed_centres)
"""Those for which one network is not enough."""


def check_pairs(pairs: Sequence[Query], request: PairRequest) -> list[Query]:
    """The same pairs, looked at before anybody is asked.

    Raises:
        InvalidValueError: unless they are as many as requested, of segments of the pool.
    """
    found, size = list(pairs) if isinstance(pairs, Sequence) else [], len(request.pool)
    if len(found) != request.count or not all(
        isinstance(pair, Query) and max(pair.first, pair.second) < size for pair in found
    ):
        raise InvalidValueError(
            f"sampler: expected {request.count} Queries of segments 0 to {size - 1}, got "
            f"{len(found)}: {found[:3] or pairs!r} …"
        )
    return found


def _opinions(
    request: PairRequest, model: RewardNet | RewardEnsemble, candidates: Sequence[Query]
) -> Floats64:
    return member_probabilities(model, request.pool, candidates)
