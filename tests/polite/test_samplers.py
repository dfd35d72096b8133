from collections import Counter
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from polite.samplers import (
    disagreement_pairs,
    disputed_k_centre_pairs,
    entropy_pairs,
    k_centre_pairs,
    segment_features,
    uniform_pairs,
)
from polite.types import InvalidValueError, NotFiniteError, Query, SegmentPool, ShapeError

CANDIDATES = [Query(0, 1), Query(0, 2), Query(1, 2), Query(2, 3)]
LINE = np.array([[0.0], [1.0], [10.0], [100.0]])


def pool_of(size, **changes):
    fields = {
        "observations": np.zeros((size, 1, 1)),
        "actions": np.zeros((size, 1, 1)),
        "rewards": np.zeros((size, 1)),
        "states": np.zeros((size, 1, 1)),
        "lengths": np.ones(size),
        "trajectory": np.zeros(size),
        "start": np.arange(size),
    }
    return SegmentPool(**fields | changes)


def as_sets(queries):
    return [frozenset((q.first, q.second)) for q in queries]


def all_pairs(size):
    return [Query(a, b) for a, b in combinations(range(size), 2)]


def apart(one, other, features):
    """How far two pairs are from each other, whichever of their segments is left."""
    a, b, c, d = (features[i] for i in (one.first, one.second, other.first, other.second))
    return min(
        np.linalg.norm(np.concatenate([a - c, b - d])),
        np.linalg.norm(np.concatenate([a - d, b - c])),
    )


def radius(candidates, centres, features):
    return max(min(apart(q, c, features) for c in centres) for q in candidates)


by_probabilities = pytest.mark.parametrize("sampler", [disagreement_pairs, entropy_pairs])
# As a grid of 64ths, so that means are exact and equal scores are equal to the last bit.
grids = st.tuples(st.sampled_from([2, 4]), st.integers(1, 12)).flatmap(
    lambda shape: arrays(np.int64, shape, elements=st.integers(0, 64)).map(lambda a: a / 64)
)
small_sets = arrays(
    np.float64, st.tuples(st.integers(3, 5), st.integers(1, 2)), elements=st.integers(-9, 9)
)


# Uniform


@given(st.integers(2, 40), st.integers(0, 60), st.integers(0, 2**32 - 1))
def test_pairs_are_valid_and_repeat_only_when_all_were_drawn(size, count, seed):
    queries = uniform_pairs(count, np.random.default_rng(seed), pool_of(size))
    assert len(queries) == count
    assert all(min(q.first, q.second) >= 0 and max(q.first, q.second) < size for q in queries)
    times = Counter(as_sets(queries))
    pairs = size * (size - 1) // 2
    assert max(times.values(), default=0) <= -(-count // pairs)


def test_all_ordered_pairs_are_equally_likely():
    rng, pool = np.random.default_rng(0), pool_of(4)
    drawn = Counter((q.first, q.second) for _ in range(6000) for q in uniform_pairs(1, rng, pool))
    assert len(drawn) == 12
    assert all(abs(count / 6000 - 1 / 12) < 0.015 for count in drawn.values())


def test_equal_generators_draw_equal_pairs():
    one, same, other = (uniform_pairs(20, np.random.default_rng(s), pool_of(30)) for s in (5, 5, 6))
    assert one == same != other


def test_a_pool_of_one_has_no_pairs():
    with pytest.raises(InvalidValueError, match="at least 2 segments, got 1"):
        uniform_pairs(1, np.random.default_rng(0), pool_of(1))
    with pytest.raises(InvalidValueError, match="count ≥ 0, got -1"):
        uniform_pairs(-1, np.random.default_rng(0), pool_of(3))


# Disagreement and entropy


def test_disagreement_chooses_the_disputed_pairs():
    probabilities = np.array([[0.9, 0.1, 0.5, 0.6], [0.9, 0.9, 0.5, 0.4]])
    assert disagreement_pairs(CANDIDATES, probabilities, 2) == [CANDIDATES[1], CANDIDATES[3]]


def test_entropy_chooses_the_uncertain_pairs():
    # Means .9, .5 (disputed), .5 (agreed) and .45.
    probabilities = np.array([[0.9, 0.0, 0.5, 0.4], [0.9, 1.0, 0.5, 0.5]])
    chosen = entropy_pairs(CANDIDATES, probabilities, 3)
    assert chosen == [CANDIDATES[1], CANDIDATES[2], CANDIDATES[3]]
    assert entropy_pairs(CANDIDATES, probabilities[:1], 1) == [CANDIDATES[2]]  # one member will do


def test_entropy_tells_apart_what_rounding_of_its_formula_would_level():
    probabilities = 0.5 + np.array([[1e-9, -1e-10, 1e-8, 1e-11]])
    assert entropy_pairs(CANDIDATES, probabilities, 4) == [CANDIDATES[i] for i in (3, 1, 0, 2)]


@given(grids, st.data())
def test_disagreement_chooses_the_largest_standard_deviations(probabilities, data):
    candidates = all_pairs(6)[: probabilities.shape[1]]
    count = data.draw(st.integers(0, len(candidates)))
    spread = dict(zip(candidates, probabilities.std(axis=0), strict=True))
    chosen = [spread[q] for q in disagreement_pairs(candidates, probabilities, count)]
    np.testing.assert_allclose(chosen, sorted(spread.values(), reverse=True)[:count], atol=1e-12)


@given(grids, st.data())
def test_entropy_chooses_the_largest_entropies(probabilities, data):
    candidates = all_pairs(6)[: probabilities.shape[1]]
    count = data.draw(st.integers(0, len(candidates)))
    mean = np.clip(probabilities.mean(axis=0), 1e-300, 1)  # 0 log 0 = 0
    rest = np.clip(1 - mean, 1e-300, 1)
    entropy = dict(zip(candidates, -mean * np.log(mean) - rest * np.log(rest), strict=True))
    chosen = [entropy[q] for q in entropy_pairs(candidates, probabilities, count)]
    np.testing.assert_allclose(chosen, sorted(entropy.values(), reverse=True)[:count], atol=1e-12)


@by_probabilities
def test_ties_keep_their_order(sampler):
    assert sampler(CANDIDATES, np.ones((3, 4)), 4) == CANDIDATES
    assert sampler(CANDIDATES[::-1], np.ones((3, 4)), 2) == CANDIDATES[:1:-1]
    candidates, rng = all_pairs(25), np.random.default_rng(0)
    probabilities = rng.permuted(np.tile([[0.1], [0.23], [0.7]], len(candidates)), axis=0)
    assert sampler(candidates, probabilities, 300) == candidates  # the same members shuffled


@by_probabilities
@given(st.permutations(range(6)), st.permutations(range(3)), st.integers(0, 2**32 - 1))
def test_neither_order_of_candidates_nor_of_members_matters(sampler, order, members, seed):
    candidates, probabilities = all_pairs(4), np.random.default_rng(seed).random((3, 6))
    shuffled = probabilities[np.ix_(members, order)]
    again = sampler([candidates[i] for i in order], shuffled, 4)
    assert again == sampler(candidates, probabilities, 4)


@by_probabilities
def test_a_pair_that_comes_twice_is_chosen_once(sampler):
    candidates = [Query(0, 1), Query(1, 0), Query(0, 1), Query(1, 2)]
    probabilities = np.array([[0.0, 1.0, 0.0, 0.1], [1.0, 0.0, 1.0, 0.1]])
    assert sampler(candidates, probabilities, 2) == [Query(0, 1), Query(1, 2)]
    with pytest.raises(InvalidValueError, match=r"at least 3 different candidates .*got 2"):
        sampler(candidates, probabilities, 3)


@by_probabilities
def test_none_of_none_is_none(sampler):
    assert sampler([], np.zeros((2, 0)), 0) == []
    assert k_centre_pairs([], np.zeros((1, 1)), 0) == k_centre_pairs(CANDIDATES, LINE, 0) == []


@by_probabilities
def test_wrong_probabilities_are_refused(sampler):
    candidates = CANDIDATES[:2]
    for shape in ((2, 3), (2,), (0, 2)):
        with pytest.raises(ShapeError, match=r"expected \(K ≥ [12], 2\), got \("):
            sampler(candidates, np.zeros(shape), 1)
    with pytest.raises(NotFiniteError, match=r"member_probabilities: 1 of 4 .*reward model"):
        sampler(candidates, [[0.5, np.nan], [0.5, 0.5]], 1)
    with pytest.raises(InvalidValueError, match=r"in \[0, 1\], got -0.1 … 0.5"):
        sampler(candidates, [[0.5, -0.1], [0.5, 0.5]], 1)
    for count in (3, -1):
        with pytest.raises(InvalidValueError, match=f"at least {count} different candidates"):
            sampler(candidates, np.zeros((2, 2)), count)


def test_one_member_cannot_disagree():
    with pytest.raises(ShapeError, match=r"expected \(K ≥ 2, 4\), got \(1, 4\)"):
        disagreement_pairs(CANDIDATES, np.zeros((1, 4)), 1)


# k-centre


def test_k_centre_goes_to_the_farthest_each_time():
    # Side by side (0, 1), (0, 10), (1, 10) and (10, 100): 90.6 is farthest from the first, then
    # (1, 10) with 9.06 (1 and 9 aside), while (0, 10) is 1 from it and 9 from the first.
    assert k_centre_pairs(CANDIDATES, LINE, 4) == [CANDIDATES[i] for i in (0, 3, 2, 1)]


def test_k_centre_keeps_away_from_what_was_asked():
    assert k_centre_pairs(CANDIDATES, LINE, 1, asked=[Query(2, 3)]) == [CANDIDATES[0]]
    assert k_centre_pairs(CANDIDATES, LINE, 2, [Query(0, 1), Query(3, 2)]) == [
        CANDIDATES[2],
        CANDIDATES[1],
    ]


def test_for_k_centre_left_and_right_mean_nothing():
    features = np.array([[0.0], [5.0], [0.1], [5.1], [2.0], [2.5]])
    candidates = [Query(0, 1), Query(3, 2), Query(4, 5)]
    assert k_centre_pairs(candidates, features, 2) == [Query(0, 1), Query(4, 5)]


def test_k_centre_breaks_ties_by_order_and_never_repeats():
    candidates = [Query(0, 1), Query(1, 0), *all_pairs(4)[1:]]
    assert k_centre_pairs(candidates, np.zeros((4, 2)), 6) == all_pairs(4)
    with pytest.raises(InvalidValueError, match=r"at least 7 different candidates .*got 6"):
        k_centre_pairs(candidates, np.zeros((4, 2)), 7)


@given(st.permutations(range(1, 10)), st.integers(0, 2**32 - 1))
def test_for_k_centre_only_the_first_candidate_s_place_matters(order, seed):
    # No segment is in two pairs: (a, b) is as far from (a, c) as (d, b) from (d, c), a tie.
    candidates = [Query(2 * i, 2 * i + 1) for i in range(10)]
    features = np.random.default_rng(seed).random((20, 3))
    shuffled = [candidates[i] for i in order]
    first, asked = candidates[:1], [Query(1, 0)]
    assert k_centre_pairs(first + shuffled, features, 5) == k_centre_pairs(candidates, features, 5)
    assert k_centre_pairs(shuffled + first, features, 5, asked) == k_centre_pairs(
        candidates, features, 5, asked
    )


@given(small_sets, st.integers(1, 3), st.integers(0, 2), st.randoms(use_true_random=False))
def test_k_centre_is_at_most_twice_the_best_radius(features, count, asked, random):
    pairs = random.sample(all_pairs(len(features)), k=len(features) * (len(features) - 1) // 2)
    candidates, before = pairs[:7], pairs[-asked:] if asked else []
    count = min(count, len(candidates))
    chosen = k_centre_pairs(candidates, features, count, before)
    best = min(
        radius(candidates, [*centres, *before], features)
        for centres in combinations(candidates, count)
    )
    assert len(set(as_sets(chosen))) == count and set(chosen) <= set(candidates)
    assert radius(candidates, [*chosen, *before], features) <= 2 * best + 1e-9


def test_wrong_features_are_refused():
    for shape in ((3, 2), (4,), (4, 0)):
        with pytest.raises(ShapeError, match=r"features: expected \(S ≥ 4, d ≥ 1\), got \("):
            k_centre_pairs(CANDIDATES, np.zeros(shape), 1)
    with pytest.raises(ShapeError, match="S ≥ 9"):
        k_centre_pairs(CANDIDATES, LINE, 1, asked=[Query(0, 8)])
    with pytest.raises(NotFiniteError, match="features: 1 of 4"):
        k_centre_pairs(CANDIDATES, [[0.0], [1.0], [np.nan], [3.0]], 1)
    with pytest.raises(InvalidValueError, match="at least -1 different candidates"):
        k_centre_pairs(CANDIDATES, LINE, -1)


def test_the_hybrid_covers_the_disputed_half():
    candidates, features = all_pairs(4), LINE
    # Most disputed: (1, 2), then (0, 1) and (0, 2); the far pairs with 3 are agreed on.
    probabilities = np.array([[0.2, 0.3, 0.5, 0.0, 0.5, 0.5], [0.8, 0.7, 0.5, 1.0, 0.5, 0.5]])
    chosen = disputed_k_centre_pairs(candidates, probabilities, features, 2)
    assert chosen == [Query(1, 2), Query(0, 1)]
    assert set(disputed_k_centre_pairs(candidates, probabilities, features, 6)) == set(candidates)


# Features


def test_features_are_the_scaled_observations_without_the_padding():
    observations = np.array([[[1.0, 7.0], [3.0, 7.0]], [[5.0, 7.0], [99.0, 99.0]]])
    pool = pool_of(
        2,
        observations=observations,
        actions=np.zeros((2, 2, 1)),
        rewards=np.zeros((2, 2)),
        states=np.zeros((2, 2, 1)),
        lengths=np.array([2, 1]),
    )
    unit = np.sqrt(1.5)  # 2 / √(8 / 3)
    np.testing.assert_allclose(segment_features(pool), [[-unit, 0, 0, 0], [unit, 0, 0, 0]])


@given(st.integers(0, 2**32 - 1), st.floats(0.1, 1000), st.floats(-100, 100))
def test_features_do_not_depend_on_the_unit_of_an_observation(seed, scale, shift):
    observations = np.random.default_rng(seed).normal(size=(20, 1, 2))
    one = segment_features(pool_of(20, observations=observations))
    other = segment_features(pool_of(20, observations=observations * [scale, 1] + [shift, 0]))
    np.testing.assert_allclose(one, other, atol=1e-3)  # shifted float32 observations
