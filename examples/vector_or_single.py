"""PPO on the true reward: the same training on one vector env and on single envs side by side.

    python examples/vector_or_single.py --steps 150000 --seeds 3 --out vector_or_single

Draws the share of episodes that reach the end goal against wall time and writes the numbers.
Nothing differs but how the envs are stepped; the trainings run one after the other.
"""

import argparse
import time
from pathlib import Path

import gymnasium as gym
import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from matplotlib.figure import Figure

import socialnav_env  # noqa: F401 (registers the env)
from polite.files import write_json
from polite.policies.ppo import PpoConfig, PpoTrainer
from polite.policies.vec_env import GymnasiumVecEnv

ENV, RECENT = "SocialCorridor-v0", 100
ROUTES = {
    "one vector env": {"vectorization_mode": "vector_entry_point"},
    "single envs": {"vectorization_mode": "sync"},
}


def train(mode, seed, steps):
    """Wall seconds and success over the last episodes, after each rollout."""
    keywords = {"autoreset_mode": AutoresetMode.SAME_STEP}
    if mode["vectorization_mode"] == "sync":
        keywords = {"vector_kwargs": keywords}
    envs = gym.make_vec(ENV, PpoConfig().num_envs, **mode, **keywords)
    trainer = PpoTrainer(GymnasiumVecEnv(envs, seed), PpoConfig(), seed, steps)
    seconds, success, start = [], [], time.perf_counter()

    def note(_):
        recent = [episode["success"] for episode in trainer.episodes[-RECENT:]]
        seconds.append(time.perf_counter() - start)
        success.append(float(np.mean(recent)) if recent else 0.0)

    trainer.train(steps, note)
    envs.close()
    return {"seconds": seconds, "success": success}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=150_000, help="env steps of each training")
    parser.add_argument("--seeds", type=int, default=3, help="trainings of each kind")
    parser.add_argument("--out", type=Path, default=Path("vector_or_single"), help="folder")
    given = parser.parse_args()
    torch.set_num_threads(1)
    curves = {name: [] for name in ROUTES}
    for seed in range(given.seeds):  # in turns, so that a busy machine slows both alike
        for name, mode in ROUTES.items():
            curves[name].append(train(mode, seed, given.steps))
            last = {key: values[-1] for key, values in curves[name][-1].items()}
            print(f"{name}, seed {seed}: {last['seconds']:.0f} s, success {last['success']:.2f}")
    given.out.mkdir(parents=True, exist_ok=True)
    write_json(given.out / "curves.json", {"steps": given.steps, "curves": curves})
    figure = Figure(figsize=(6, 3.6), layout="constrained")
    axes = figure.add_subplot(
        xlabel="wall time [s]", ylabel=f"success, last {RECENT} episodes", ylim=(0, 1.02)
    )
    for (name, runs), colour in zip(curves.items(), ("#0072B2", "#D55E00"), strict=True):
        for run in runs:
            label = name if run is runs[0] else None
            axes.plot(run["seconds"], run["success"], color=colour, alpha=0.8, label=label)
    axes.legend(title=f"{given.steps} steps each")
    figure.savefig(given.out / "success.png", dpi=150)


if __name__ == "__main__":
    main()
