import numpy as np
import pytest
import torch

from polite.rewards.data import stack_feedback
from polite.rewards.ensemble import RewardEnsemble, member_probabilities, train_ensemble
from polite.rewards.network import FAST, PAPER, RewardNet, RewardNetConfig, predict
from polite.rewards.trainer import RewardTrainingConfig, train_reward
from polite.samplers import disagreement_pairs, uniform_pairs
from polite.teachers.oracle import Oracle
from polite.types import InvalidValueError, SegmentPool

CONFIG = RewardTrainingConfig(epochs=10, batch_size=32, learning_rate=3e-3, highlight_length=2)


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


def make_pool(size=70, steps=6, seed=0):
    rng = np.random.default_rng(seed)
    observations = rng.normal(2.0, 3.0, (size, steps, 3))
    return SegmentPool(
        observations=observations,
        actions=rng.uniform(-1, 1, (size, steps, 2)),
        rewards=observations[..., 0] - 2.0,
        states=np.zeros((size, steps, 1)),
        lengths=rng.integers(2, steps, size, endpoint=True),
        trajectory=np.zeros(size),
        start=np.zeros(size),
    )


POOL = make_pool()
QUERIES = uniform_pairs(100, np.random.default_rng(1), POOL)
DATA = stack_feedback(
    POOL,
    QUERIES,
    Oracle(flip_probability=0.0).answer_queries(POOL, QUERIES, np.random.default_rng()),
)


def make_nets(size=3, config=FAST):
    source = generator()
    nets = [RewardNet(3, 2, config, source) for _ in range(size)]
    for net in nets:
        net.standardise(POOL)
    return nets


@pytest.mark.parametrize("config", [FAST, PAPER])
def test_an_ensemble_scores_as_its_members_do(config):
    nets = make_nets(config=config)
    inputs = torch.randn(3, 4, 6, 5, generator=generator())
    stacked = RewardEnsemble(nets)(inputs)
    assert stacked.shape == (3, 4, 6)
    for net, own, rewards in zip(nets, inputs, stacked, strict=True):
        torch.testing.assert_close(rewards, net(own), atol=1e-6, rtol=1e-5)


def test_a_member_taken_out_is_the_one_put_in():
    nets = make_nets()
    ensemble = RewardEnsemble(nets)
    assert len(ensemble) == 3
    for index, net in enumerate(nets):
        for name, tensor in ensemble.member(index).state_dict().items():
            assert torch.equal(tensor, net.state_dict()[name])


def test_training_an_ensemble_of_one_is_training_its_member():
    (net,) = make_nets(1)
    ensemble = RewardEnsemble([net])
    train_ensemble(ensemble, DATA, CONFIG, generator(5))
    train_reward(net, DATA, CONFIG, generator(5))
    np.testing.assert_allclose(
        predict(ensemble.member(0), POOL.observations, POOL.actions),
        predict(net, POOL.observations, POOL.actions),
        atol=1e-4,
    )


def test_members_learn_independently_and_all_learn():
    ensemble = RewardEnsemble(make_nets())
    train_ensemble(ensemble, DATA, CONFIG, generator())
    probabilities = member_probabilities(ensemble, POOL, QUERIES)
    right = np.array([POOL.returns[q.first] > POOL.returns[q.second] for q in QUERIES])
    assert ((probabilities > 0.5) == right).mean(axis=1).min() > 0.85
    assert probabilities.std(axis=0).max() > 0.001


def test_dropout_is_used_in_training_only_and_drawn_for_each_member():
    config = RewardNetConfig((16, 16), (0.5, 0.5))
    (net,) = make_nets(1, config)
    twins = RewardEnsemble([net, net])
    inputs = torch.randn(1, 9, 5, generator=generator()).expand(2, -1, -1)
    assert torch.equal(*twins(inputs))
    assert not torch.equal(*twins(inputs, generator()))


def test_probabilities_are_those_of_the_summed_real_steps():
    nets = make_nets(2)
    probabilities = member_probabilities(RewardEnsemble(nets), POOL, QUERIES)
    assert probabilities.shape == (2, len(QUERIES))
    for net, own in zip(nets, probabilities, strict=True):
        rewards = np.where(POOL.mask, predict(net, POOL.observations, POOL.actions), 0)
        returns = rewards.sum(axis=1)
        differences = np.array([returns[q.first] - returns[q.second] for q in QUERIES])
        np.testing.assert_allclose(own, 1 / (1 + np.exp(-differences)), atol=1e-5)


def test_probabilities_feed_the_disagreement_sampler():
    probabilities = member_probabilities(RewardEnsemble(make_nets()), POOL, QUERIES)
    chosen = disagreement_pairs(QUERIES, probabilities, 10)
    spread = dict(zip(QUERIES, probabilities.std(axis=0), strict=True))
    assert min(spread[q] for q in chosen) >= max(spread[q] for q in set(QUERIES) - set(chosen))


def test_members_of_different_shapes_are_refused():
    with pytest.raises(InvalidValueError, match="members of one shape"):
        RewardEnsemble([*make_nets(1), *make_nets(1, PAPER)])
    with pytest.raises(InvalidValueError, match="members of one shape"):
        RewardEnsemble([])
