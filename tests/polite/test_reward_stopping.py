from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from polite.dataset import Feedback
from polite.rewards.data import split_answers, stack_feedback
from polite.rewards.ensemble import RewardEnsemble, train_ensemble
from polite.rewards.network import FAST, RewardNet, RewardNetConfig
from polite.rewards.stopping import EarlyStop
from polite.rewards.trainer import RewardTrainingConfig, train_reward, validation_loss
from polite.samplers import uniform_pairs
from polite.teachers.oracle import Oracle
from polite.types import InvalidValueError, SegmentPool

CONFIG = RewardTrainingConfig(
    epochs=60, batch_size=32, learning_rate=3e-3, alpha_positive=0.0, alpha_negative=0.0
)


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


def make_data(count=120, flips=0.0, seed=0):
    rng = np.random.default_rng(seed)
    observations = rng.normal(size=(60, 6, 3))
    pool = SegmentPool(
        observations=observations,
        actions=rng.uniform(-1, 1, (60, 6, 2)),
        rewards=observations[..., 0],
        states=np.zeros((60, 6, 1)),
        lengths=rng.integers(3, 6, 60, endpoint=True),
        trajectory=np.zeros(60),
        start=np.zeros(60),
    )
    queries = uniform_pairs(count, rng, pool)
    oracle = Oracle(tie_threshold=0.3, flip_probability=flips)
    return stack_feedback(Feedback(pool, queries, oracle.answer_queries(pool, queries, rng)))


DATA, NOISE = make_data(), make_data(flips=0.5)


def make_net(seed=0, config=FAST):
    return RewardNet(3, 2, config, generator(seed))


def make_ensemble(size=3):
    return RewardEnsemble([make_net(seed) for seed in range(size)])


def weights(module):
    return torch.cat([parameter.detach().flatten() for parameter in module.parameters()])


def states_by_epoch(config, data=DATA, seed=3):
    """The net after each epoch that was run, and as the training left it."""
    states, net = [], make_net()
    train_reward(net, data, config, generator(seed), lambda _, net: states.append(weights(net)))
    return states, weights(net)


def share_in_order(net, data):
    returns = net(data.inputs[data.pairs]).where(data.mask[data.pairs], 0.0).sum(dim=-1)
    expressed = data.mu[:, 0] != data.mu[:, 1]
    right = (returns[:, 0] > returns[:, 1]) == (data.mu[:, 0] > data.mu[:, 1])
    return right[expressed].float().mean().item()


# --- by the accuracy in training -----------------------------------------------------------------


def test_a_training_stops_once_the_answers_are_learned():
    states, last = states_by_epoch(replace(CONFIG, stop_accuracy=0.97))
    assert 1 < len(states) < CONFIG.epochs
    assert torch.equal(states[-1], last)
    net = make_net()
    train_reward(net, DATA, replace(CONFIG, stop_accuracy=0.97), generator(3))
    assert share_in_order(net, DATA) > 0.95


def test_stopping_changes_nothing_before_the_stop():
    states, _ = states_by_epoch(replace(CONFIG, stop_accuracy=0.9))
    unstopped, _ = states_by_epoch(CONFIG)
    assert len(unstopped) == CONFIG.epochs
    for one, other in zip(states, unstopped, strict=False):
        assert torch.equal(one, other)


def test_no_training_has_more_epochs_than_it_was_given():
    states, _ = states_by_epoch(replace(CONFIG, epochs=3, stop_accuracy=0.999), NOISE)
    assert len(states) == 3


def test_answers_without_a_preference_never_stop_a_training():
    silent = replace(DATA, mu=torch.zeros_like(DATA.mu))
    states, _ = states_by_epoch(replace(CONFIG, epochs=4, stop_accuracy=0.01), silent)
    assert len(states) == 4
    equal = replace(DATA, mu=torch.full_like(DATA.mu, 0.5))
    assert len(states_by_epoch(replace(CONFIG, epochs=4, stop_accuracy=0.01), equal)[0]) == 4


def test_the_share_is_counted_over_expressed_preferences_and_real_steps():
    stop = EarlyStop(make_net(), accuracy=0.5, patience=1)
    rewards = torch.tensor([[[1.0, 9.0], [2.0, 0.0]], [[3.0, 0.0], [0.0, 0.0]]] * 2)
    mask = torch.tensor([[[True, False], [True, True]], [[True, True], [True, True]]] * 2)
    mu = torch.tensor([[0.0, 1.0], [0.0, 1.0], [0.5, 0.5], [0.0, 0.0]])
    stop.count(rewards, mask, mu)  # right, wrong, and two that do not count
    assert not stop.after_epoch(None)  # one half is not above one half
    stop.count(rewards[:1], mask[:1], mu[:1])
    assert stop.after_epoch(None)
    assert not stop.after_epoch(None)  # an epoch's count is its own


def test_an_ensemble_stops_by_its_mean_accuracy():
    stopped, full, before = make_ensemble(), make_ensemble(), weights(make_ensemble())
    train_ensemble(stopped, DATA, replace(CONFIG, stop_accuracy=0.97), generator())
    train_ensemble(full, DATA, CONFIG, generator())
    assert not torch.equal(weights(stopped), before)
    assert not torch.equal(weights(stopped), weights(full))
    shares = [share_in_order(stopped.member(index), DATA) for index in range(3)]
    assert np.mean(shares) > 0.94


def test_the_members_mean_decides_not_the_worst():
    """One member has every pair in order, the other 19 of 20: 97.5% together."""
    stop = EarlyStop(make_ensemble(2), 0.97, patience=1)
    rewards = torch.ones(2, 20, 2, 1) * torch.tensor([1.0, -1.0])[:, None]
    rewards[1, 0] *= -1
    mu = torch.tensor([1.0, 0.0]).expand(2, 20, 2)
    stop.count(rewards, torch.ones(2, 20, 2, 1).bool(), mu)
    assert stop.after_epoch(None)


# --- by held-out answers -------------------------------------------------------------------------


def test_held_out_answers_are_spread_evenly_and_no_answer_is_lost():
    training, held_out = split_answers(DATA, 0.25)
    assert (len(training), len(held_out)) == (90, 30)
    assert torch.equal(held_out.pairs, DATA.pairs[3::4])
    rows = torch.cat([training.pairs, held_out.pairs]).tolist()
    assert sorted(rows) == sorted(DATA.pairs.tolist())


@given(share=st.floats(0, 0.999), before=st.integers(1, 100), more=st.integers(0, 20))
def test_what_is_held_out_stays_so_when_answers_are_appended(share, before, more):
    """Else a model that is trained on would be judged on answers that it has learned."""
    fewer, all_of_them = (
        split_answers(DATA.take(torch.arange(count)), share) for count in (before, before + more)
    )
    taught = fewer[0].pairs
    assert torch.equal(all_of_them[0].pairs[: len(taught)], taught)
    assert len(taught) >= 1


@pytest.mark.parametrize("share", [0.0, 0.004])
def test_nothing_held_out_is_nothing_done(share):
    training, held_out = split_answers(DATA, share)
    assert training is DATA and held_out is None


def test_the_weights_it_begins_with_can_be_the_best():
    """Warm starts often are: each session's training begins with the last one's model."""
    net, config = make_net(), replace(CONFIG, validation_share=0.3, patience=3, learning_rate=0.5)
    before = weights(net).clone()
    _, held_out = split_answers(NOISE, 0.3)
    least = validation_loss(net, held_out, config)
    train_reward(net, NOISE, config, generator(3))
    assert validation_loss(net, held_out, config) == least
    assert torch.equal(weights(net), before)


def test_noise_is_not_trained_on_for_long_and_the_best_epoch_is_kept():
    config = replace(CONFIG, validation_share=0.3, patience=4)
    states, last = states_by_epoch(config, NOISE)
    assert len(states) < CONFIG.epochs
    states.insert(0, weights(make_net()))
    _, held_out = split_answers(NOISE, 0.3)
    losses = []
    for state in states:
        net = make_net()
        torch.nn.utils.vector_to_parameters(state, net.parameters())
        losses.append(validation_loss(net, held_out, config))
    best = int(np.argmin(losses))
    assert torch.equal(last, states[best])
    assert len(states) == best + 1 + 4


def test_an_ensemble_keeps_its_best_epoch_too():
    config = replace(CONFIG, validation_share=0.3, patience=4)
    kept, full = make_ensemble(), make_ensemble()
    train_ensemble(kept, NOISE, config, generator(3))
    train_ensemble(full, NOISE, replace(config, patience=CONFIG.epochs), generator(3))
    assert torch.equal(weights(kept), weights(full))  # the best came early in both
    _, held_out = split_answers(NOISE, 0.3)
    once = make_ensemble()
    train_ensemble(once, NOISE, replace(config, epochs=1), generator(3))
    losses = [validation_loss(ensemble.score, held_out, config) for ensemble in (kept, once)]
    assert losses[0] <= losses[1]


def test_held_out_loss_by_hand():
    _, held_out = split_answers(DATA, 0.2)
    nets = [make_net(seed) for seed in range(2)]
    own = [validation_loss(net, held_out, CONFIG) for net in nets]
    both = validation_loss(RewardEnsemble(nets).score, held_out, CONFIG)
    assert both == pytest.approx(np.mean(own), rel=1e-5)
    returns = nets[0](held_out.inputs[held_out.pairs]).where(held_out.mask[held_out.pairs], 0.0)
    gaps = np.diff(returns.sum(dim=-1).detach().numpy(), axis=1)[:, 0].astype(float)
    mu = held_out.mu.numpy()
    by_hand = (mu[:, 0] * np.log1p(np.exp(gaps)) + mu[:, 1] * np.log1p(np.exp(-gaps))).sum()
    assert own[0] == pytest.approx(by_hand, rel=1e-5)


def test_held_out_answers_without_a_preference_do_not_end_a_training():
    silent = replace(DATA, mu=torch.zeros_like(DATA.mu))
    states, _ = states_by_epoch(replace(CONFIG, epochs=5, validation_share=0.3, patience=1), silent)
    assert len(states) == 5


def test_a_handful_of_held_out_answers_does_not_end_a_training():
    """With 2 of 20 held out, every fourth training gave back the weights it began with."""
    expressed = DATA.take(DATA.mu.any(dim=-1).nonzero().flatten())
    few, enough = (expressed.take(torch.arange(count)) for count in (49, 50))
    config = replace(CONFIG, epochs=5, validation_share=0.2)
    for data, says in ((few, False), (enough, True)):
        _, held_out = split_answers(data, config.validation_share)
        assert held_out is not None
        assert (validation_loss(make_net(), held_out, config) is not None) == says
    states, last = states_by_epoch(replace(config, patience=1, learning_rate=1.0), few)
    assert len(states) == 5 and torch.equal(last, states[-1])


def test_equal_seeds_give_equal_nets():
    config = replace(CONFIG, validation_share=0.2, stop_accuracy=0.98, patience=3)
    shape = RewardNetConfig((16,), (0.3,))
    one, same, other = (make_net(config=shape) for _ in range(3))
    for net, seed in ((one, 1), (same, 1), (other, 2)):
        train_reward(net, DATA, config, generator(seed))
    assert torch.equal(weights(one), weights(same))
    assert not torch.equal(weights(one), weights(other))


@pytest.mark.parametrize(
    "change",
    [{"stop_accuracy": 1.0}, {"stop_accuracy": 0.0}, {"validation_share": 1.0}, {"patience": 0}],
)
def test_impossible_settings_are_refused(change):
    with pytest.raises(InvalidValueError, match=f"^{next(iter(change))}: expected"):
        replace(CONFIG, **change)
