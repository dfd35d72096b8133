import numpy as np
import pytest

from polite.samplers import uniform_pairs
from polite.teachers.highlights import paper_candidate
from polite.teachers.oracle import Oracle
from polite.teachers.quantile import QuantileOracle, moment_quantiles
from polite.types import InvalidValueError, SegmentPool


def make_pool(rewards, lengths=None):
    rewards = np.asarray(rewards, dtype=float)
    count, steps = rewards.shape
    return SegmentPool(
        observations=np.zeros((count, steps, 1)),
        actions=np.zeros((count, steps, 1)),
        rewards=rewards,
        states=np.zeros((count, steps, 1)),
        lengths=np.full(count, steps) if lengths is None else lengths,
        trajectory=np.zeros(count),
        start=np.zeros(count),
    )


def random_pool(shift=0.0):
    rng = np.random.default_rng(0)
    return make_pool(rng.normal(size=(40, 50)).cumsum(axis=1) / 5 + shift)


def answers_of(pool, **settings):
    rng = np.random.default_rng(1)
    teacher = QuantileOracle(Oracle(tie_threshold=0.0), **settings)
    return teacher.answer_queries(pool, uniform_pairs(200, rng, pool), rng)


def test_quantiles_are_those_of_real_moments_only() -> None:
    pool = make_pool([[1, 2, 3, 100], [5, 6, 7, 8]], lengths=np.array([3, 4]))
    # trailing means: 1, 1.5, 2 and 5, 5.5, 6, 7
    assert moment_quantiles(pool, (0.0, 1.0)) == (1.0, 7.0)
    assert moment_quantiles(pool, (0.5, 0.5)) == (5.0, 5.0)


def test_a_constant_added_to_the_reward_moves_no_mark() -> None:
    """Where fixed thresholds would mark everything, or nothing."""
    plain, lifted = answers_of(random_pool()), answers_of(random_pool(shift=100.0))
    assert plain == lifted
    fixed = Oracle(tie_threshold=0.0).answer_queries
    rng = np.random.default_rng(1)
    pool = random_pool(shift=100.0)
    marks = fixed(pool, uniform_pairs(200, rng, pool), rng)
    assert all(answer.positive and not answer.negative for answer in marks)


def test_wider_quantiles_mark_less() -> None:
    def share(low, high):
        marks = answers_of(random_pool(), quantiles=(low, high))
        return [
            sum(getattr(a, sign) is not None for a in marks) for sign in ("positive", "negative")
        ]

    strict, usual, lax = share(0.0, 1.0), share(0.2, 0.8), share(0.5, 0.5)
    assert strict == [0, 0]
    assert all(0 < u < m for u, m in zip(usual, lax, strict=True))


def test_preferences_are_the_oracles() -> None:
    pool, rng = random_pool(), np.random.default_rng(1)
    oracle = Oracle(tie_threshold=0.0)
    expected = oracle.answer_queries(pool, uniform_pairs(200, rng, pool), rng)
    assert [a.preference for a in answers_of(pool)] == [a.preference for a in expected]


@pytest.mark.parametrize("quantiles", [(-0.1, 0.8), (0.2, 1.1), (0.8, 0.2), (float("nan"), 0.5)])
def test_impossible_quantiles_are_refused(quantiles) -> None:
    with pytest.raises(InvalidValueError, match="quantiles"):
        QuantileOracle(quantiles=quantiles)


def test_moments_scored_otherwise_are_refused() -> None:
    with pytest.raises(InvalidValueError, match="released_candidate"):
        QuantileOracle(Oracle(rule=paper_candidate))
