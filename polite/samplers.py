"""From segments to pairs: which comparisons a teacher is asked for. Pure functions.

`uniform_pairs` draws pairs. The others choose among candidates that were drawn so; what they take
for equal stays in the candidates' order, which is a random one. No sampler that chooses returns a
pair twice, and (a, b) is the same pair as (b, a).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.distance import cdist

from polite.types import (
    Floats64,
    Integers,
    InvalidValueError,
    NotFiniteError,
    Query,
    SegmentPool,
    ShapeError,
    check_finite,
)

_CONSTANT = 1e-6  # an observation entry that varies less is left unscaled


def uniform_pairs(count: int, rng: np.random.Generator, pool: SegmentPool) -> list[Query]:
    """Draw pairs of different segments uniformly, each pair once before any comes again.

    Args:
        count: Q, pairs to draw.
        rng: source of the draws.
        pool: the segments, at least two.

    Raises:
        InvalidValueError: if the pool has fewer than two segments, or `count` is negative.
    """
    if len(pool) < 2 or count < 0:
        raise InvalidValueError(
            f"expected a pool of at least 2 segments, got {len(pool)}, and count ≥ 0, got {count}"
        )
    pairs = len(pool) * (len(pool) - 1) // 2
    rounds = [
        rng.choice(pairs, size=min(pairs, count - done), replace=False)
        for done in range(0, count, pairs)
    ]
    numbers = np.concatenate([np.zeros(0, dtype=np.int64), *rounds])
    # Pair number k of (0,1), (0,2), (1,2), (0,3), … is (k − j(j−1)/2, j).
    larger = ((1 + np.sqrt(1 + 8 * numbers)) // 2).astype(np.int64)
    smaller = numbers - larger * (larger - 1) // 2
    swapped = rng.random(count) < 0.5  # left and right mean nothing
    return [
        Query(int(b), int(a)) if swap else Query(int(a), int(b))
        for a, b, swap in zip(smaller, larger, swapped, strict=True)
    ]


def disagreement_pairs(
    candidates: Sequence[Query], member_probabilities: ArrayLike, count: int
) -> list[Query]:
    """Choose the pairs on which an ensemble disagrees most (Christiano et al. 2017; PEBBLE).

    Args:
        candidates: C pairs to choose from.
        member_probabilities: P[σ₁ ≻ σ₂] of each of K ≥ 2 members, (K, C).
        count: pairs to choose, at most as many as there are different candidates.

    Returns:
        The pairs with the highest standard deviation over members, most disputed first.

    Raises:
        ShapeError: if there are not two members and one column for each candidate.
        NotFiniteError: if a probability is NaN or infinite.
        InvalidValueError: if one is not in [0, 1], or fewer candidates than `count` are given.
    """
    probabilities = _probabilities(member_probabilities, 2, len(candidates))
    return _highest(candidates, probabilities.std(axis=0), count)


def entropy_pairs(
    candidates: Sequence[Query], member_probabilities: ArrayLike, count: int
) -> list[Query]:
    """Choose the pairs whose predicted preference is least certain (PEBBLE, Lee et al. 2021).

    The entropy is that of the members' mean prediction p: H = −p log p − (1 − p) log(1 − p). It
    falls with |p − ½|, by which the pairs are sorted, because near ½ rounding would level H.

    Args:
        candidates: C pairs to choose from.
        member_probabilities: P[σ₁ ≻ σ₂] of each of K ≥ 1 members, (K, C).
        count: pairs to choose, at most as many as there are different candidates.

    Returns:
        The pairs with the highest entropy, least certain first.

    Raises:
        ShapeError: if there is not one column for each candidate.
        NotFiniteError: if a probability is NaN or infinite.
        InvalidValueError: if one is not in [0, 1], or fewer candidates than `count` are given.
    """
    probabilities = _probabilities(member_probabilities, 1, len(candidates))
    return _highest(candidates, -np.abs(probabilities.mean(axis=0) - 0.5), count)


def k_centre_pairs(
    candidates: Sequence[Query], features: ArrayLike, count: int, asked: Sequence[Query] = ()
) -> list[Query]:
    """Choose pairs that cover all candidates, each time the one farthest from those so far.

    Pairs are compared by their segments' features side by side, in the order of left and right
    that brings them closer. The largest distance of a candidate from its nearest centre, chosen or
    asked, is at most twice the smallest one possible (Gonzalez 1985; Sener and Savarese 2018, and
    the k-centre sampler of PEBBLE).

    Args:
        candidates: pairs to choose from; without `asked`, the first one is the first centre.
        features: where each of the S segments lies, (S, d).
        count: pairs to choose, at most as many as there are different candidates.
        asked: pairs that are centres already.

    Returns:
        The pairs in the order in which they were chosen.

    Raises:
        ShapeError: if there is no row of features for a segment.
        NotFiniteError: if a feature is NaN or infinite.
        InvalidValueError: if fewer candidates than `count` are given.
    """
    points = _segment_points(features, [*candidates, *asked])
    candidates = [candidates[place] for place in _different(candidates)]
    _check_count(count, len(candidates))
    if count == 0:
        return []
    ends = _ends(candidates)
    gaps = np.full(len(candidates), np.inf)  # squared, to the nearest centre
    for centre in asked:
        gaps = np.minimum(gaps, _squared_distances(points, ends, centre))
    chosen: list[Query] = []
    for _ in range(count):
        farthest = int(gaps.argmax())
        chosen.append(candidates[farthest])
        gaps = np.minimum(gaps, _squared_distances(points, ends, candidates[farthest]))
        gaps[farthest] = -1.0  # not again, even where all that is left lies on a centre
    return chosen


def disputed_k_centre_pairs(
    candidates: Sequence[Query],
    member_probabilities: ArrayLike,
    features: ArrayLike,
    count: int,
    asked: Sequence[Query] = (),
) -> list[Query]:
    """Choose pairs that cover the more disputed half of the candidates (PEBBLE's hybrid).

    Args:
        candidates: C pairs to choose from.
        member_probabilities: P[σ₁ ≻ σ₂] of each of K ≥ 2 members, (K, C).
        features: where each of the S segments lies, (S, d).
        count: pairs to choose, at most as many as there are different candidates.
        asked: pairs that are centres already.

    Returns:
        The pairs in the order in which they were chosen; without `asked`, the most disputed first.

    Raises:
        ShapeError: as `disagreement_pairs` and `k_centre_pairs`.
        NotFiniteError: likewise.
        InvalidValueError: likewise.
    """
    half = max(count, len(_different(candidates)) // 2)
    disputed = disagreement_pairs(candidates, member_probabilities, half)
    return k_centre_pairs(disputed, features, count, asked)


def segment_features(pool: SegmentPool) -> Floats64:
    """What each segment's agent saw, step by step, for `k_centre_pairs`: (S, m · n).

    Every observation entry is scaled to mean 0 and spread 1 over the real steps, so that no unit
    outweighs another; the steps that a segment lacks are 0.
    """
    steps = pool.observations[pool.mask]
    mean = steps.mean(axis=0, dtype=np.float64)
    spread = steps.std(axis=0, dtype=np.float64)
    scaled = (pool.observations - mean) / np.where(spread < _CONSTANT, 1.0, spread)
    features: Floats64 = np.where(pool.mask[..., None], scaled, 0.0).reshape(len(pool), -1)
    return features


def _highest(candidates: Sequence[Query], scores: Floats64, count: int) -> list[Query]:
    """The different pairs with the highest scores; equal ones in the order given."""
    places = _different(candidates)
    _check_count(count, len(places))
    order = np.argsort(-scores[places], kind="stable")
    return [candidates[places[place]] for place in order[:count]]


def _different(candidates: Sequence[Query]) -> Integers:
    """The place where each pair comes first, in either order of its segments."""
    places: dict[frozenset[int], int] = {}
    for place, query in enumerate(candidates):
        places.setdefault(frozenset((query.first, query.second)), place)
    return np.array(list(places.values()), dtype=np.int64)


def _ends(queries: Sequence[Query]) -> Integers:
    """Both segments of each query, (2, Q)."""
    pairs = [(query.first, query.second) for query in queries]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2).T


def _squared_distances(points: Floats64, ends: Integers, centre: Query) -> Floats64:
    """Of each pair from a centre, (C,): the smaller one of both orders of left and right."""
    first, second = cdist(points[[centre.first, centre.second]], points, "sqeuclidean")
    left, right = ends
    distances: Floats64 = np.minimum(first[left] + second[right], first[right] + second[left])
    return distances


def _probabilities(values: ArrayLike, members: int, candidates: int) -> Floats64:
    """Check them, and sort the members, whose order then means nothing down to the last bit."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 2 or len(array) < members or array.shape[1] != candidates:
        raise ShapeError(
            f"member_probabilities: expected (K ≥ {members}, {candidates}), got {array.shape}"
        )
    bad = ~np.isfinite(array)
    if bad.any():
        raise NotFiniteError(
            f"member_probabilities: {bad.sum()} of {array.size} values are NaN or infinite; "
            "check the reward model"
        )
    if ((array < 0) | (array > 1)).any():
        raise InvalidValueError(
            "member_probabilities: expected values in [0, 1], "
            f"got {array.min():g} … {array.max():g}"
        )
    return np.sort(array, axis=0)


def _segment_points(features: ArrayLike, queries: Sequence[Query]) -> Floats64:
    """Check that the features are finite and have a row for every segment asked about."""
    points = np.asarray(features, dtype=np.float64)
    rows = 1 + int(_ends(queries).max(initial=-1))
    if points.ndim != 2 or len(points) < rows or points.shape[1] < 1:
        raise ShapeError(f"features: expected (S ≥ {rows}, d ≥ 1), got {points.shape}")
    check_finite("features", points)
    return points


def _check_count(count: int, available: int) -> None:
    if not 0 <= count <= available:
        raise InvalidValueError(
            f"expected at least {count} different candidates and count ≥ 0, got {available}"
        )
