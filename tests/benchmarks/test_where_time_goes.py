"""What a training from preferences spends its time on, with the fast and with the paper's net."""

import time
from collections import defaultdict

import pytest
import stable_baselines3

import polite.methods.preference_learning as loop
from polite.methods.config import METHODS, LearningConfig
from polite.methods.presets import PRESETS
from polite.policies.vec_env import make_vec_env
from polite.rewards.network import FAST, PAPER

# A twentieth of the paper's experiment with 800 queries, its schedule and its epochs.
STEPS, QUERIES = 50_000, 40
PARTS = {
    "rollout": (stable_baselines3.PPO, "collect_rollouts"),
    "PPO": (stable_baselines3.PPO, "train"),
    "scoring": (loop, "predict"),
    "collecting segments": (loop, "collect"),
    "cutting and stacking": (loop, "cut_segments"),
    "reward training": (loop, "train_model"),
}
NETS = {"fast": (FAST, 0.5), "paper": (PAPER, 0.9)}
"""And the share of the time that training the reward model may take."""


class Clock:
    """Processor time of each part, less that of the parts within it."""

    def __init__(self):
        self.seconds = defaultdict(float)
        self._within = [0.0]

    def timed(self, name, function):
        def run(*args, **kwargs):
            self._within.append(0.0)
            start = time.process_time()
            try:
                return function(*args, **kwargs)
            finally:
                spent = time.process_time() - start
                self.seconds[name] += spent - self._within.pop()
                self._within[-1] += spent

        return run


def learn(net, steps, queries):
    """The preference-only method on HalfCheetah as `polite train` runs it."""
    preset = PRESETS["HalfCheetah"]
    config = LearningConfig(
        method=METHODS["polite"],
        queries=queries,
        steps=steps,
        net=net,
        training=preset.training,
        ppo=preset.ppo,
    )
    return loop.learn(
        lambda count, seed: make_vec_env("HalfCheetah-v5", count, seed),
        preset.make_teacher,
        config,
        seed=0,
    )


@pytest.mark.parametrize("net", NETS)
def test_where_the_time_goes(benchmark, one_thread, tmp_path, monkeypatch, net):
    monkeypatch.chdir(tmp_path)  # MuJoCo may write a log where it runs
    layers, at_most = NETS[net]
    learn(layers, steps=2048, queries=2)  # what is imported when first needed is no part of it
    clock = Clock()
    for name, (owner, attribute) in PARTS.items():
        monkeypatch.setattr(owner, attribute, clock.timed(name, getattr(owner, attribute)))
    whole = clock.timed("the rest", learn)
    learned = benchmark.pedantic(whole, args=(layers, STEPS, QUERIES), rounds=1)
    total = sum(clock.seconds.values())
    shares = {name: round(seconds / total, 3) for name, seconds in clock.seconds.items()}
    benchmark.extra_info.update(shares | {"seconds": total})
    steps = learned.policy_steps, learned.collection_steps
    print(f"\n{net} net: {total:.1f} s for {steps} policy and collection steps: {shares}")
    assert shares["the rest"] < 0.1
    assert shares["reward training"] < at_most
