"""Pairs per second of the reward trainers against imitation's, on the same pairs, in turns."""

import time

import numpy as np
import pytest
import torch
from imitation_process import imitation
from random_pool import PAIRS, random_pool

from polite.dataset import Feedback
from polite.rewards.data import stack_feedback
from polite.rewards.ensemble import RewardEnsemble, train_ensemble
from polite.rewards.network import RewardNet, RewardNetConfig
from polite.rewards.trainer import RewardTrainingConfig, train_reward
from polite.samplers import uniform_pairs
from polite.types import FIRST, SECOND, Answer

OBSERVATION, ACTION = 17, 6  # HalfCheetah's
EPOCHS, BATCH = 10, 128  # the paper's minibatch on HalfCheetah
ROUNDS = 15


@pytest.fixture(scope="module")
def feedback():
    """Segments, pairs, and who won each, without ties and highlights."""
    rng = np.random.default_rng(0)
    pool = random_pool(rng, OBSERVATION, ACTION)
    pairs = uniform_pairs(PAIRS, rng, pool)
    better = [pool.returns[pair.first] > pool.returns[pair.second] for pair in pairs]
    answers = [Answer(i, FIRST if first else SECOND) for i, first in enumerate(better)]
    return pool, pairs, answers


def save(path, feedback):
    pool, pairs, answers = feedback
    np.savez(
        path,
        observations=pool.observations,
        actions=pool.actions,
        rewards=pool.rewards,
        pairs=[(pair.first, pair.second) for pair in pairs],
        preferences=[answer.preference[0] for answer in answers],
    )


def net(hidden, seed):
    config = RewardNetConfig(hidden, dropout=(0.0,) * len(hidden))
    return RewardNet(OBSERVATION, ACTION, config, torch.Generator().manual_seed(seed))


def seconds_of(train, model, data, epochs):
    config = RewardTrainingConfig(
        epochs=epochs, batch_size=BATCH, alpha_positive=0.0, alpha_negative=0.0
    )
    start = time.process_time()
    train(model, data, config, torch.Generator().manual_seed(0))
    return time.process_time() - start


@pytest.mark.parametrize(
    ("hidden", "members", "target"),
    [((32, 32), 1, 20.0), ((256, 256, 256), 1, 2.0), ((32, 32), 3, 5.0)],
    ids=["32x32", "256x3", "three of 32x32"],
)
def test_pairs_per_second_against_imitation(
    benchmark, one_thread, tmp_path, feedback, hidden, members, target
):
    data = stack_feedback(Feedback(*feedback))
    save(tmp_path / "pairs.npz", feedback)
    nets = [net(hidden, seed) for seed in range(members)]
    train = train_reward if members == 1 else train_ensemble
    model = nets[0] if members == 1 else RewardEnsemble(nets)
    arguments = "pairs.npz", ",".join(map(str, hidden)), members, BATCH
    with imitation("imitation_rewards.py", *arguments, folder=tmp_path) as peer:
        peer(1)
        benchmark.pedantic(seconds_of, args=(train, model, data, EPOCHS), rounds=3, warmup_rounds=1)
        # In turns, so that a busy moment of the machine hits both. An epoch of theirs is enough.
        turns = [
            (seconds_of(train, model, data, EPOCHS) / EPOCHS, float(peer(1))) for _ in range(ROUNDS)
        ]
    ours, theirs = (min(times) for times in zip(*turns, strict=True))
    told = {
        "pairs_per_second": round(members * PAIRS / ours),
        "imitation_pairs_per_second": round(members * PAIRS / theirs),
        "ratio": theirs / ours,
    }
    benchmark.extra_info.update(told)
    print(f"\n{members} of {hidden}: {told}")
    assert told["ratio"] >= target
