"""Train stable-baselines3's PPO on the true reward, through the vector env, and evaluate it.

    python examples/train_sb3.py --steps 150000 --out ppo.zip    # a minute or two

`load(Path("ppo.zip"))` gives the trained policy again: both files, the model and its scale.
`polite train --method ground-truth` does the same with files and progress; this is the bare way.
"""

import argparse
import time
from pathlib import Path

import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

import socialnav_env  # noqa: F401 (importing it registers SocialCorridor-v0)
from polite.policies.vec_env import make_vec_env
from socialnav_env.evaluation import evaluate
from socialnav_env.wrappers import compare

SHOWN = ["success", "collided", "intermittent", "time_to_goal", "min_human_distance", "return"]


class Normalised:
    """A model with the scale of observations that it was trained with."""

    def __init__(self, model, mean, var):
        """Put them together."""
        self.model, self.mean, self.std = model, mean, np.sqrt(var + 1e-8)

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        """Actions, as the model's own `predict`."""
        observation = ((observation - self.mean) / self.std).clip(-10.0, 10.0)  # as VecNormalize
        return self.model.predict(observation, state, episode_start, deterministic)


def load(path: Path) -> Normalised:
    """The policy that was saved; stable-baselines3 unpickles, so load only what you trust."""
    with np.load(path.with_suffix(".scale.npz")) as scale:
        return Normalised(PPO.load(path, device="cpu"), scale["mean"], scale["var"])


def main(steps: int, num_envs: int, scenario: str, episodes: int, out: Path) -> None:
    envs = VecNormalize(make_vec_env("SocialCorridor-v0", num_envs, seed=0, scenario=scenario))
    model = PPO(
        "MlpPolicy",
        envs,
        n_steps=64,
        batch_size=256,
        learning_rate=lambda left: 1e-3 * left,
        policy_kwargs={"log_std_init": -0.5},
        seed=0,
        device="cpu",
    )
    scale = envs.obs_rms
    words = {"scenario": scenario, "episodes": episodes, "num_envs": min(episodes, 50)}
    tables = {"before": evaluate(Normalised(model, scale.mean, scale.var), **words)}
    start = time.perf_counter()
    model.learn(steps)
    seconds = time.perf_counter() - start
    model.save(out)
    np.savez(out.with_suffix(".scale.npz"), mean=scale.mean, var=scale.var)
    tables["after"] = evaluate(load(out), **words)

    done = model.num_timesteps  # whole rollouts: up to num_envs * 64 more than asked for
    print(f"{done} steps in {seconds:.0f} s ({done / seconds:,.0f} a second)")
    print(compare(tables, SHOWN))
    print(f"success {tables['after']['success'].cell()}, model in {out}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=150_000, help="env steps, at least")
    parser.add_argument("--num-envs", type=int, default=32, help="corridors that step together")
    parser.add_argument("--scenario", default="paper", help="where to train and evaluate")
    parser.add_argument("--episodes", type=int, default=200, help="of each evaluation")
    parser.add_argument("--out", type=Path, default=Path("ppo.zip"), help="the trained model")
    main(**vars(parser.parse_args()))
