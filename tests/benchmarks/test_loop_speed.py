"""The whole preference loop on HalfCheetah against imitation's: steps per second, in one run."""

import json
import time
from dataclasses import asdict

import pytest
import torch
from imitation_process import imitation

from polite.methods.config import METHODS, LearningConfig, Schedule
from polite.methods.preference_learning import learn
from polite.policies.ppo import PpoConfig
from polite.policies.vec_env import make_vec_env
from polite.rewards.trainer import RewardTrainingConfig
from polite.teachers.oracle import Oracle

STEPS, QUERIES, LENGTH, ITERATIONS = 50_000, 400, 50, 5
ROUNDS = ITERATIONS + 1  # imitation asks, trains and runs once more than it was told
AT_LEAST = 2.0
PPO = PpoConfig(
    num_envs=8, rollout=256, batch_size=256, epochs=10, learning_rate=3e-4, log_std=0.0
)
EPOCHS = {"the command's": (600, 3), "the tutorial's": (12, 3)}
"""Reward epochs of imitation's first session and of each later one."""


def run_ours(first_epochs, later_epochs, seed):
    """Processor time, policy steps and env steps of our loop, with 32×32 units as imitation's."""
    config = LearningConfig(
        method=METHODS["preferences"],
        queries=QUERIES,
        steps=STEPS,
        schedule=Schedule(
            sessions=ROUNDS,
            interval=1 / ROUNDS,
            segment_length=LENGTH,
            segments_per_query=2,  # as imitation, which uses a fragment once
            first_epochs=first_epochs,
            later_epochs=later_epochs,
        ),
        training=RewardTrainingConfig(batch_size=32, learning_rate=1e-3),
        ppo=PPO,
    )
    start = time.process_time()
    learned = learn(
        lambda count, seed: make_vec_env("HalfCheetah-v5", count, seed),
        lambda pool: Oracle().answer_queries,
        config,
        seed,
    )
    return {
        "seconds": time.process_time() - start,
        "policy_steps": learned.policy_steps,
        "env_steps": learned.policy_steps + learned.collection_steps,
    }


@pytest.fixture
def one_thread():
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


@pytest.mark.parametrize("epochs", EPOCHS)
def test_steps_per_second_of_the_loop(benchmark, one_thread, tmp_path, monkeypatch, epochs):
    monkeypatch.chdir(tmp_path)  # MuJoCo may write a log where it runs
    first, later = EPOCHS[epochs]
    question = {"steps": STEPS, "queries": QUERIES, "iterations": ITERATIONS, "seed": 0}
    question |= {"first_epochs": first, "later_epochs": later, "fragment_length": LENGTH}
    with imitation("imitation_loop.py", json.dumps(asdict(PPO)), folder=tmp_path) as peer:
        ours = benchmark.pedantic(run_ours, args=(first, later, 0), rounds=1)
        theirs = json.loads(peer(json.dumps(question)))
    rates = {
        f"{kind} per second": [side[kind] / side["seconds"] for side in (ours, theirs)]
        for kind in ("policy_steps", "env_steps")
    }
    ratios = {kind: mine / other for kind, (mine, other) in rates.items()}
    benchmark.extra_info.update({"polite": ours, "imitation": theirs, "ratios": ratios})
    print(f"\n{epochs} epochs: polite {ours}, imitation {theirs}, {ratios}")
    assert min(ratios.values()) >= AT_LEAST
