"""Pairs per second of the trainer against the loop over pairs that one would write first."""

from time import perf_counter

import numpy as np
import pytest
import torch
from random_pool import PAIRS, random_pool
from torch import nn
from torch.nn.functional import logsigmoid

from polite.dataset import Feedback
from polite.rewards.data import stack_feedback
from polite.rewards.network import FAST, PAPER, RewardNet
from polite.rewards.trainer import RewardTrainingConfig, minibatches, train_reward
from polite.samplers import uniform_pairs
from polite.teachers.oracle import Oracle

OBSERVATION, ACTION = 35, 2
ONE_EPOCH = RewardTrainingConfig(epochs=1)


@pytest.fixture(scope="module")
def data():
    rng = np.random.default_rng(0)
    pool = random_pool(rng, OBSERVATION, ACTION)
    queries = uniform_pairs(PAIRS, rng, pool)
    oracle = Oracle(length=ONE_EPOCH.highlight_length)
    return stack_feedback(Feedback(pool, queries, oracle.answer_queries(pool, queries, rng)))


@pytest.mark.parametrize(("preset", "target"), [(FAST, 10.0), (PAPER, 1.5)], ids=["32x32", "256x3"])
def test_pairs_per_second_against_a_loop_over_pairs(benchmark, one_thread, data, preset, target):
    generator = torch.Generator().manual_seed(0)
    net = RewardNet(OBSERVATION, ACTION, preset, generator)
    loop = plain_net(preset)
    optimiser = torch.optim.Adam(loop.parameters(), lr=ONE_EPOCH.learning_rate)
    benchmark.pedantic(
        train_reward, args=(net, data, ONE_EPOCH, generator), rounds=5, warmup_rounds=1
    )
    seconds = min(timed(train_loop, loop, optimiser, data, generator) for _ in range(3))
    benchmark.extra_info["pairs_per_second"] = PAIRS / benchmark.stats.stats.min
    benchmark.extra_info["loop_pairs_per_second"] = PAIRS / seconds
    benchmark.extra_info["ratio"] = ratio = seconds / benchmark.stats.stats.min
    print(f"\n{preset.hidden}: {PAIRS / benchmark.stats.stats.min:.0f} pairs/s, ×{ratio:.1f}")
    assert ratio >= target


@pytest.mark.parametrize("preset", [FAST, PAPER], ids=["32x32", "256x3"])
def test_onednn_against_pytorch_s_own_product(benchmark, one_thread, data, preset, monkeypatch):
    net = RewardNet(OBSERVATION, ACTION, preset, torch.Generator().manual_seed(0))

    def seconds(enabled):
        with monkeypatch.context() as patch:
            patch.setattr(torch.backends.mkldnn, "enabled", enabled)
            return timed(train_reward, net, data, ONE_EPOCH, torch.Generator().manual_seed(0))

    benchmark.pedantic(seconds, args=(True,), rounds=3, warmup_rounds=1)
    turns = [(seconds(True), seconds(False)) for _ in range(9)]
    with_onednn, without = (min(times) for times in zip(*turns, strict=True))
    benchmark.extra_info["ratio"] = ratio = without / with_onednn
    print(f"\n{preset.hidden}: with oneDNN ×{ratio:.2f}")
    assert ratio >= 0.9  # how much it gains is up to the processor


def plain_net(preset):
    layers, size = [], OBSERVATION + ACTION
    for units, probability in zip(preset.hidden, preset.dropout, strict=True):
        layers += [nn.Linear(size, units), nn.LeakyReLU()]
        layers += [nn.Dropout(probability)] if probability else []
        size = units
    return nn.Sequential(*layers, nn.Linear(size, 1), nn.Tanh(), nn.Flatten(0))


def train_loop(net, optimiser, data, generator):
    """One epoch of the same loss over the same minibatches, one pair after another."""
    decays = ONE_EPOCH.highlight_decay ** torch.arange(ONE_EPOCH.highlight_length + 1)
    for batch in minibatches(len(data), ONE_EPOCH.batch_size, generator):
        preferences, marks = [], {+1: [], -1: []}
        for i in batch.tolist():
            both = [net(data.inputs[segment]) for segment in data.pairs[i]]
            difference = both[0].sum() - both[1].sum()
            preferences += [
                -data.mu[i, 0] * logsigmoid(difference) - data.mu[i, 1] * logsigmoid(-difference)
            ]
            for sign, anchor in ((+1, int(data.positive[i])), (-1, int(data.negative[i]))):
                if anchor >= 0:
                    window = both[data.marked[i]][: anchor + 1].flip(0)[: len(decays)]
                    marks[sign] += [-sign * (window * decays[: len(window)]).sum()]
        loss = torch.stack(preferences).sum()
        loss = loss + ONE_EPOCH.alpha_positive * torch.stack(marks[+1]).mean()
        loss = loss + ONE_EPOCH.alpha_negative * torch.stack(marks[-1]).mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()


def timed(function, *args):
    start = perf_counter()
    function(*args)
    return perf_counter() - start
