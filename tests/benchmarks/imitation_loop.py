"""imitation's preference loop in a Python of its own, since it needs an older Gymnasium.

PPO's numbers come on the command line, as JSON. Each line on standard input is JSON with the
arguments of `run`; the answer is JSON with the processor time [s] and the steps that it took.
"""

import contextlib
import json
import sys
import tempfile
import time

import numpy as np
import torch
from imitation.algorithms import preference_comparisons as comparisons
from imitation.rewards.reward_nets import BasicRewardNet
from imitation.util import logger
from imitation.util.util import make_vec_env
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnvWrapper

torch.set_num_threads(1)
SETTINGS = json.loads(sys.argv[1])


class Count(VecEnvWrapper):
    """Counts the steps of all envs."""

    steps = 0

    def reset(self):
        return self.venv.reset()

    def step_wait(self):
        self.steps += self.num_envs
        return self.venv.step_wait()


def run(steps, queries, iterations, first_epochs, later_epochs, fragment_length, seed):
    start = time.process_time()
    rng = np.random.default_rng(seed)
    venv = Count(make_vec_env("HalfCheetah-v4", rng=rng, n_envs=SETTINGS["num_envs"]))
    net = BasicRewardNet(venv.observation_space, venv.action_space)
    agent = PPO(
        "MlpPolicy",
        venv,
        n_steps=SETTINGS["rollout"],
        batch_size=SETTINGS["batch_size"],
        n_epochs=SETTINGS["epochs"],
        learning_rate=SETTINGS["learning_rate"],
        seed=seed,
        device="cpu",
    )
    log = logger.configure(tempfile.mkdtemp(), format_strs=[])
    trainer = comparisons.BasicRewardTrainer(
        comparisons.PreferenceModel(net),
        loss=comparisons.CrossEntropyRewardLoss(),
        rng=rng,
        epochs=later_epochs,
    )
    loop = comparisons.PreferenceComparisons(
        comparisons.AgentTrainer(agent, net, venv, rng=rng),
        net,
        num_iterations=iterations,
        fragmenter=comparisons.RandomFragmenter(rng=rng, warning_threshold=0),
        preference_gatherer=comparisons.SyntheticGatherer(rng=rng),
        reward_trainer=trainer,
        fragment_length=fragment_length,
        initial_epoch_multiplier=first_epochs / later_epochs,
        custom_logger=log,
    )
    loop.train(steps, queries)
    return {
        "seconds": time.process_time() - start,
        "policy_steps": agent.num_timesteps,
        "env_steps": venv.steps,
    }


print("ready", flush=True)
for line in sys.stdin:
    with contextlib.redirect_stdout(sys.stderr):
        told = run(**json.loads(line))
    print(json.dumps(told), flush=True)
