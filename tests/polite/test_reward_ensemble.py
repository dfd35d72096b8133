from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
import torch

from polite.dataset import Feedback
from polite.highlight_losses import HIGHLIGHT_LOSSES
from polite.rewards import trainer
from polite.rewards.data import stack_feedback
from polite.rewards.ensemble import RewardEnsemble, member_probabilities, train_ensemble
from polite.rewards.network import FAST, PAPER, RewardNet, RewardNetConfig, normalise, predict
from polite.rewards.trainer import RewardTrainingConfig, minibatches, train_reward
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
    Feedback(
        POOL,
        QUERIES,
        Oracle(flip_probability=0.0).answer_queries(POOL, QUERIES, np.random.default_rng()),
    ),
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


@pytest.mark.parametrize("form", ["pairwise", "released"])
@pytest.mark.parametrize("highlights", HIGHLIGHT_LOSSES)
def test_training_an_ensemble_is_training_its_members_on_their_batches(
    monkeypatch, form, highlights
):
    config = replace(CONFIG, epochs=4, preference=form, highlights=highlights)
    nets = make_nets()
    ensemble = RewardEnsemble(nets)
    train_ensemble(ensemble, DATA, config, generator(5))
    source = generator(5)
    orders = [
        [list(minibatches(len(DATA), config.batch_size, source)) for _ in nets]
        for _ in range(config.epochs)
    ]
    for number, net in enumerate(nets):
        own = iter([epoch[number] for epoch in orders])
        monkeypatch.setattr(trainer, "minibatches", lambda *_, own=own: next(own))
        train_reward(net, DATA, config, generator())
        np.testing.assert_allclose(
            predict(ensemble.member(number), POOL.observations, POOL.actions),
            predict(net, POOL.observations, POOL.actions),
            atol=2e-3,
        )


def test_bootstrapped_members_learn_from_answers_of_their_own(monkeypatch):
    seen = [Counter() for _ in range(3)]
    config = replace(CONFIG, epochs=1, bootstrap=True)
    monkeypatch.setattr(torch, "vmap", lambda f: lambda *rows: _one_by_one(f, seen, *rows))
    train_ensemble(RewardEnsemble(make_nets()), DATA, config, generator())
    assert all(sum(counts.values()) == len(DATA) for counts in seen)
    for counts in seen:  # 1 − 1/e of the answers are drawn at all
        assert 0.5 < len(counts) / len(DATA) < 0.75
    assert seen[0] != seen[1] != seen[2]


def _one_by_one(function, seen, rewards, batches):
    for counts, batch in zip(seen, batches.tolist(), strict=True):
        counts.update(batch)
    return torch.stack([function(*row) for row in zip(rewards, batches, strict=True)])


def test_after_each_epoch_the_ensemble_is_shown():
    seen = []
    config = replace(CONFIG, epochs=3)
    ensemble = RewardEnsemble(make_nets())
    train_ensemble(ensemble, DATA, config, generator(), lambda *shown: seen.append(shown))
    assert seen == [(1, ensemble), (2, ensemble), (3, ensemble)]


def test_what_is_paid_is_the_mean_of_the_members():
    nets = make_nets()
    paid = predict(RewardEnsemble(nets), POOL.observations, POOL.actions)
    each = [predict(net, POOL.observations, POOL.actions) for net in nets]
    np.testing.assert_allclose(paid, np.mean(each, axis=0), atol=1e-6)
    one = RewardEnsemble(nets).reward(torch.zeros(5))
    assert one.shape == nets[0].reward(torch.zeros(5)).shape == ()


@pytest.mark.parametrize("output", ["tanh", "linear"])
def test_each_member_is_normalised_by_itself(output):
    nets = make_nets(config=RewardNetConfig((16,), (0.0,), output))
    ensemble = RewardEnsemble(nets)
    normalise(ensemble, POOL)
    for index, net in enumerate(nets):
        normalise(net, POOL)
        for name in ("level", "scale"):
            torch.testing.assert_close(getattr(ensemble, name)[index], getattr(net, name)[0])
        np.testing.assert_allclose(
            predict(ensemble.member(index), POOL.observations, POOL.actions),
            predict(net, POOL.observations, POOL.actions),
            atol=1e-4,
        )
    again = RewardEnsemble([ensemble.member(index) for index in range(3)])
    torch.testing.assert_close(again.level, ensemble.level)


def test_standardising_an_ensemble_is_standardising_its_members():
    nets = [RewardNet(3, 2, FAST, generator()) for _ in range(2)]
    ensemble = RewardEnsemble(nets)
    ensemble.standardise(POOL)
    nets[0].standardise(POOL)
    assert torch.equal(ensemble.mean, nets[0].mean) and torch.equal(ensemble.std, nets[0].std)


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
