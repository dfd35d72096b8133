"""The corridor is a fair task: PPO on the true reward alone learns it."""

import numpy as np
import torch

import socialnav_env  # noqa: F401 (registers the corridor)
from polite.policies.ppo import PpoConfig, PpoTrainer
from polite.policies.vec_env import make_vec_env
from polite.rollouts import evaluate

STEPS = 150_000


def test_ppo_reaches_the_goal_and_learns_not_to_collide():
    torch.set_num_threads(1)
    config = PpoConfig()
    env = make_vec_env("SocialCorridor-v0", config.num_envs, 0)
    trainer = PpoTrainer(env, config, 0, STEPS)
    trainer.train(STEPS)

    judged = make_vec_env("SocialCorridor-v0", 100, 0).vector_env
    episodes = evaluate(judged, trainer.policy().mean_action, 10_000)
    assert episodes["success"].mean() >= 0.9

    steps = np.array([episode["step"] for episode in trainer.episodes])
    collided = np.array([episode["collisions"] > 0 for episode in trainer.episodes])
    assert collided[steps < STEPS / 5].mean() > 2 * collided[steps > 4 * STEPS / 5].mean()
