import numpy as np
import pytest
import torch

from polite.methods.history import FeedbackHistory
from polite.methods.pairs import CANDIDATES, PAIR_SAMPLERS, PairRequest
from polite.rewards.ensemble import RewardEnsemble, member_probabilities
from polite.rewards.network import RewardNet, RewardNetConfig
from polite.samplers import uniform_pairs
from polite.teachers.oracle import Oracle
from polite.types import Query, SegmentPool


def make_pool(size=12, seed=0):
    rng = np.random.default_rng(seed)
    return SegmentPool(
        observations=rng.normal(size=(size, 4, 2)),
        actions=rng.normal(size=(size, 4, 1)),
        rewards=rng.normal(size=(size, 4)),
        states=np.zeros((size, 4, 1)),
        lengths=rng.integers(1, 4, size, endpoint=True),
        trajectory=np.zeros(size),
        start=np.zeros(size),
    )


POOL = make_pool()
_SOURCE = torch.Generator().manual_seed(0)
NET, *NETS = (RewardNet(2, 1, RewardNetConfig((8,), (0.0,)), _SOURCE) for _ in range(4))
ENSEMBLE = RewardEnsemble(NETS)


def request(count=3, seed=0, asked=()):
    return PairRequest(POOL, asked, count, np.random.default_rng(seed))


def candidates(count=3, seed=0):
    return uniform_pairs(CANDIDATES * count, np.random.default_rng(seed), POOL)


def test_uniform_pairs_are_drawn_as_ever() -> None:
    pairs = PAIR_SAMPLERS["uniform"](request(), NET)
    assert pairs == uniform_pairs(3, np.random.default_rng(0), POOL)


@pytest.mark.parametrize("name", PAIR_SAMPLERS)
def test_so_many_different_pairs_of_the_candidates_are_chosen(name: str) -> None:
    pairs = PAIR_SAMPLERS[name](request(count=5), ENSEMBLE)
    assert len({frozenset((pair.first, pair.second)) for pair in pairs}) == 5
    assert name == "uniform" or set(pairs) <= set(candidates(5))


def test_disputed_pairs_are_those_on_which_the_members_differ_most() -> None:
    spread = member_probabilities(ENSEMBLE, POOL, candidates()).std(axis=0)
    chosen = PAIR_SAMPLERS["disagreement"](request(), ENSEMBLE)
    assert chosen[0] == candidates()[spread.argmax()]


def test_one_network_has_an_opinion_of_which_it_is_more_or_less_certain() -> None:
    (probabilities,) = member_probabilities(NET, POOL, candidates())
    chosen = PAIR_SAMPLERS["entropy"](request(), NET)
    assert chosen[0] == candidates()[np.abs(probabilities - 0.5).argmin()]


def test_centres_keep_away_from_what_was_asked() -> None:
    first = PAIR_SAMPLERS["k-centre"](request(count=1), NET)
    assert first == [candidates(1)[0]]  # any pair is the first centre
    (second,) = PAIR_SAMPLERS["k-centre"](request(count=1, asked=first), NET)
    assert {second.first, second.second} != {first[0].first, first[0].second}


CHOOSING = [name for name in PAIR_SAMPLERS if name != "uniform"]


@pytest.mark.parametrize("name", CHOOSING)
def test_what_was_asked_is_not_asked_again_while_there_is_something_else(name: str) -> None:
    first = PAIR_SAMPLERS[name](request(), ENSEMBLE)
    asked = [Query(pair.second, pair.first) for pair in first]  # the other way round is the same
    again = PAIR_SAMPLERS[name](request(asked=asked), ENSEMBLE)
    known = {frozenset((pair.first, pair.second)) for pair in asked}
    assert len(again) == 3
    assert not known & {frozenset((pair.first, pair.second)) for pair in again}


@pytest.mark.parametrize("name", CHOOSING)
def test_where_everything_was_asked_it_is_asked_again(name: str) -> None:
    every = [Query(i, j) for j in range(len(POOL)) for i in range(j)]
    assert len(PAIR_SAMPLERS[name](request(asked=every), ENSEMBLE)) == 3


def test_the_history_tells_which_of_the_recent_pairs_were_asked() -> None:
    history, seen = FeedbackHistory(recent_sessions=2), []

    def choose(wanted: PairRequest) -> list[Query]:
        seen.append(wanted)
        return wanted.draw()

    for number in range(3):
        history.add_segments(make_pool(5, number))
        rng = np.random.default_rng(number)
        history.ask(4, Oracle().answer_queries, rng, choose)
    assert [len(wanted.pool) for wanted in seen] == [5, 10, 10]
    assert [len(wanted.asked) for wanted in seen[:2]] == [0, 4]
    kept = [q for q in history.feedback.queries[:8] if min(q.first, q.second) >= 5]
    assert seen[2].asked == [Query(q.first - 5, q.second - 5) for q in kept]
    for old, new in zip(kept, seen[2].asked, strict=True):
        np.testing.assert_array_equal(
            history.feedback.pool.observations[old.first], seen[2].pool.observations[new.first]
        )
