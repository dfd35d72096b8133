from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
import torch
from torch.nn.functional import logsigmoid

from polite.dataset import Feedback
from polite.rewards.data import PreferenceData, stack_feedback
from polite.rewards.network import FAST, RewardNet, RewardNetConfig, predict
from polite.rewards.trainer import (
    RewardTrainingConfig,
    batch_loss,
    minibatches,
    train_reward,
)
from polite.samplers import uniform_pairs
from polite.teachers.highlights import shuffle_highlights
from polite.teachers.oracle import Oracle
from polite.types import Answer, Highlight, InvalidValueError, Query, SegmentPool, ShapeError

STEPS = 8
QUICK = RewardTrainingConfig(
    epochs=15, batch_size=32, learning_rate=3e-3, highlight_length=2, alpha_positive=1.0,
    alpha_negative=1.0,
)  # fmt: skip


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


def make_pool(size=80, seed=0):
    """A linear true reward of the first observation entry and the action."""
    rng = np.random.default_rng(seed)
    observations = rng.normal(size=(size, STEPS, 3))
    actions = rng.uniform(-1, 1, (size, STEPS, 2))
    return SegmentPool(
        observations=observations,
        actions=actions,
        rewards=observations[..., 0] + actions[..., 0],
        states=np.zeros((size, STEPS, 1)),
        lengths=rng.integers(3, STEPS, size, endpoint=True),
        trajectory=np.zeros(size),
        start=np.zeros(size),
    )


POOL = make_pool()
QUERIES = uniform_pairs(150, np.random.default_rng(1), POOL)
ORACLE = Oracle(flip_probability=0.0, length=2, tie_threshold=0.5)
ANSWERS = ORACLE.answer_queries(POOL, QUERIES, np.random.default_rng(2))
DATA = stack_feedback(Feedback(POOL, QUERIES, ANSWERS))


def make_net(seed=0, config=FAST):
    net = RewardNet(3, 2, config, generator(seed))
    net.standardise(POOL)
    return net


def trained(config=QUICK, data=DATA, net=None, seed=3):
    net = net or make_net()
    train_reward(net, data, config, generator(seed))
    return net


def parameters(net):
    return torch.cat([parameter.detach().flatten() for parameter in net.parameters()])


def held_out(net):
    pool = make_pool(seed=9)
    rewards = predict(net, pool.observations, pool.actions)
    queries = uniform_pairs(300, np.random.default_rng(4), pool)
    first, second = np.array([(q.first, q.second) for q in queries]).T
    learned = np.where(pool.mask, rewards, 0).sum(axis=1)
    right = (learned[first] > learned[second]) == (pool.returns[first] > pool.returns[second])
    return right.mean(), np.corrcoef(rewards[pool.mask], pool.rewards[pool.mask])[0, 1]


@pytest.mark.parametrize("form", ["pairwise", "released"])
@pytest.mark.parametrize("alpha", [0.0, 1.0])
def test_training_learns_the_true_reward(form, alpha):
    config = replace(QUICK, preference=form, alpha_positive=alpha, alpha_negative=alpha)
    accuracy, correlation = held_out(trained(config))
    before, _ = held_out(make_net())
    assert accuracy > max(0.85, before) and correlation > 0.7


def test_highlights_alone_teach_where_the_reward_is():
    _, correlation = held_out(trained(data=DATA.without_preferences()))
    assert correlation > 0.5


def test_alphas_of_zero_are_the_baseline_and_ignore_highlights():
    config = replace(QUICK, alpha_positive=0.0, alpha_negative=0.0)
    none = torch.full_like(DATA.positive, -1)
    without = replace(DATA, positive=none, negative=none)
    assert torch.equal(parameters(trained(config)), parameters(trained(config, without)))
    assert not torch.equal(parameters(trained(config)), parameters(trained(QUICK)))


def test_a_fixed_seed_gives_the_same_net_and_touches_no_global_state():
    config = RewardNetConfig((16, 16), (0.2, 0.5))
    before = torch.random.get_rng_state()
    one, two = (parameters(trained(net=make_net(config=config))) for _ in range(2))
    assert torch.equal(one, two)
    assert not torch.equal(one, parameters(trained(net=make_net(config=config), seed=4)))
    assert torch.equal(torch.random.get_rng_state(), before)


def test_the_batch_gradient_equals_that_of_a_loop_over_pairs():
    net = make_net().double()
    data = replace(DATA, inputs=DATA.inputs.double(), mu=DATA.mu.double())
    batch = torch.arange(40)
    batch_loss(net(data.inputs[data.pairs[batch]]), data, batch, QUICK).backward()
    stacked = [parameter.grad.clone() for parameter in net.parameters()]
    net.zero_grad()
    _loop_loss(net, data, batch, QUICK).backward()
    for loop, gradient in zip(net.parameters(), stacked, strict=True):
        torch.testing.assert_close(loop.grad, gradient)


def _loop_loss(net, data, batch, config):
    """Eq. 6 as one would write it first: one pair after another, real steps only."""
    preferences, marks = [], {+1: [], -1: []}
    for i in batch.tolist():
        both = [net(data.inputs[s][data.mask[s]]) for s in data.pairs[i]]
        difference = both[0].sum() - both[1].sum()
        preferences += [
            -data.mu[i, 0] * logsigmoid(difference) - data.mu[i, 1] * logsigmoid(-difference)
        ]
        rewards = both[data.marked[i]]
        for sign, anchor in ((+1, data.positive[i].item()), (-1, data.negative[i].item())):
            if anchor >= 0:
                terms = range(min(anchor, config.highlight_length) + 1)
                weighted = [config.highlight_decay**k * rewards[anchor - k] for k in terms]
                marks[sign] += [-sign * torch.stack(weighted).sum()]
    return (
        torch.stack(preferences).sum()
        + config.alpha_positive * torch.stack(marks[+1]).mean()
        + config.alpha_negative * torch.stack(marks[-1]).mean()
    )


def test_padding_does_not_change_what_is_learned():
    junk = DATA.inputs.clone()
    junk[~DATA.mask] = 1e3
    assert torch.equal(parameters(trained()), parameters(trained(data=replace(DATA, inputs=junk))))


@pytest.mark.parametrize("form", ["pairwise", "released"])
def test_no_expressed_preference_at_all_leaves_the_net_as_it_was(form):
    answers = [Answer(0, (0.0, 0.0)), Answer(1, (0.0, 0.0))]
    net, before = make_net(), parameters(make_net())
    config = replace(QUICK, preference=form)
    train_reward(net, stack_feedback(Feedback(POOL, QUERIES, answers)), config, generator())
    assert torch.equal(parameters(net), before)


def test_one_answer_is_enough():
    data = stack_feedback(Feedback(POOL, QUERIES, ANSWERS[:1]))
    assert parameters(trained(data=data)).isfinite().all()


@pytest.mark.parametrize(("count", "size"), [(400, 128), (144, 128), (128, 128), (5, 2), (1, 9)])
def test_minibatches_are_of_equal_size_and_cover_all_once(count, size):
    parts = list(minibatches(count, size, generator()))
    sizes = {len(part) for part in parts}
    assert max(sizes) <= size and max(sizes) - min(sizes) <= 1
    assert torch.equal(torch.cat(parts).sort().values, torch.arange(count))
    assert len(parts) == -(-count // size)


def test_minibatches_are_shuffled_anew():
    source = generator()
    one, two = (torch.cat(list(minibatches(50, 8, source))) for _ in range(2))
    assert not torch.equal(one, two)


def test_after_each_epoch_the_net_is_shown():
    seen = []

    def watch(epoch, net):
        seen.append((epoch, parameters(deepcopy(net))))

    net = make_net()
    train_reward(net, DATA, replace(QUICK, epochs=3), generator(), watch)
    assert [epoch for epoch, _ in seen] == [1, 2, 3]
    assert not torch.equal(seen[0][1], seen[1][1])
    assert torch.equal(seen[-1][1], parameters(net))


def test_watching_changes_nothing():
    net = make_net()
    train_reward(net, DATA, QUICK, generator(3), lambda epoch, net: None)
    assert torch.equal(parameters(net), parameters(trained()))


def test_stacking_keeps_every_answer_in_its_row():
    answers = [
        Answer(1, (0.0, 1.0), positive=Highlight(2, 5)),
        Answer(0, (0.5, 0.5)),
        Answer(1, (1.0, 0.0), negative=Highlight(0, 5), marks_other=True),
    ]
    data = stack_feedback(Feedback(POOL, [Query(4, 7), Query(2, 1)], answers))
    assert data.pairs.tolist() == [[2, 1], [4, 7], [2, 1]]
    assert data.mu.tolist() == [[0, 1], [0.5, 0.5], [1, 0]]
    assert data.positive.tolist() == [2, -1, -1] and data.negative.tolist() == [-1, -1, 0]
    assert data.marked.tolist() == [1, 0, 1]
    assert data.inputs.shape == (80, STEPS, 5) and data.inputs.dtype == torch.float32
    np.testing.assert_array_equal(data.inputs[..., :3], POOL.observations)
    np.testing.assert_array_equal(data.inputs[..., 3:], POOL.actions)
    np.testing.assert_array_equal(data.mask, POOL.mask)


def test_shuffled_highlights_are_a_valid_data_set_that_says_less():
    shuffled = shuffle_highlights(ANSWERS, POOL, QUERIES, np.random.default_rng(0))
    data = stack_feedback(Feedback(POOL, QUERIES, shuffled))
    assert (data.positive >= 0).sum() == (DATA.positive >= 0).sum()
    told, dealt = (held_out(trained(data=d.without_preferences()))[1] for d in (DATA, data))
    assert told > dealt + 0.1


def test_feedback_that_does_not_fit_is_refused():
    with pytest.raises(ShapeError, match="at least one answer"):
        stack_feedback(Feedback(POOL, QUERIES))
    with pytest.raises(InvalidValueError, match="pairs: expected indices 0 … 79"):
        replace(DATA, pairs=DATA.pairs + 80)
    with pytest.raises(InvalidValueError, match="positive: expected −1 or a real step"):
        replace(DATA, positive=torch.full_like(DATA.positive, STEPS))
    with pytest.raises(ShapeError, match=r"mu: expected \(150, 2\)"):
        replace(DATA, mu=DATA.mu[:-1])
    assert isinstance(DATA, PreferenceData) and len(DATA) == 150


@pytest.mark.parametrize(
    "change",
    [
        {"epochs": 0},
        {"batch_size": 0},
        {"learning_rate": 0.0},
        {"weight_decay": -1.0},
        {"highlight_length": -1},
        {"highlight_decay": 1.5},
        {"alpha_positive": -1.0},
    ],
)
def test_impossible_settings_are_refused(change):
    with pytest.raises(InvalidValueError, match=f"^{next(iter(change))}: expected"):
        replace(QUICK, **change)


@pytest.mark.parametrize(("name", "known"), [("preference", "pairwise"), ("highlights", "choice")])
def test_an_unknown_loss_is_refused_with_those_there_are(name, known):
    told = f"^{name}: expected one of .*{known}.*got 'other'$"
    with pytest.raises(InvalidValueError, match=told):
        replace(QUICK, **{name: "other"})
