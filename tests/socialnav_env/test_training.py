"""Training libraries learn the corridor: a short empty one, decided twice a second."""

import gymnasium as gym
import numpy as np
import pytest
import single_file_ppo
import torch
from gymnasium.vector import AutoresetMode
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.env_util import make_vec_env

import socialnav_env  # noqa: F401 (registers the id)

SHORT = {
    "scenario": "empty",
    "observation": "state",
    "half_length": 5.0,
    "start_z": -4.0,
    "intermittent_z": -1.0,
    "goal_z": 3.0,
    "anchor_jitter": 1.0,
    "frame_skip": 10,
    "max_episode_steps": 40,
}
EPISODES = 20
LITTLE = 1.5
"""So much more than chance is paid only to who reaches the end goal."""


@pytest.fixture(autouse=True)
def one_thread():
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def evaluate(policy):
    """Mean return and success rate over episodes that no training has seen."""
    env = gym.make("SocialCorridor-v0", **SHORT)
    returns, successes = [], []
    for seed in range(1000, 1000 + EPISODES):
        observation, _ = env.reset(seed=seed)
        rewards, ended = [], False
        while not ended:
            observation, reward, terminated, truncated, info = env.step(policy(observation))
            rewards.append(reward)
            ended = terminated or truncated
        returns.append(sum(rewards))
        successes.append(info["success"])
    return np.mean(returns), np.mean(successes)


@pytest.fixture(scope="module")
def chance():
    """The return of actions drawn at random."""
    rng = np.random.default_rng(0)
    mean_return, successes = evaluate(lambda _: rng.uniform(-1.0, 1.0, 2))
    assert successes < 0.5
    return mean_return


def check_has_learned(policy, chance):
    mean_return, successes = evaluate(policy)
    assert mean_return > chance + LITTLE
    assert successes >= 0.9


def test_stable_baselines_ppo_learns_it(chance):
    envs = make_vec_env("SocialCorridor-v0", n_envs=8, seed=0, env_kwargs=SHORT)
    model = PPO(
        "MlpPolicy", envs, n_steps=64, batch_size=64, learning_rate=2e-3, gamma=0.97,
        policy_kwargs={"log_std_init": -0.5}, seed=0, device="cpu",
    )  # fmt: skip
    model.learn(2048)
    check_has_learned(lambda seen: model.predict(seen, deterministic=True)[0], chance)


def test_stable_baselines_sac_learns_it(chance):
    model = SAC(
        "MlpPolicy", gym.make("SocialCorridor-v0", **SHORT), learning_starts=200, train_freq=2,
        batch_size=128, learning_rate=3e-3, gamma=0.95, tau=0.02, ent_coef=0.02,
        policy_kwargs={"net_arch": [64, 64]}, seed=0, device="cpu",
    )  # fmt: skip
    model.learn(1000)
    check_has_learned(lambda seen: model.predict(seen, deterministic=True)[0], chance)


def test_single_file_ppo_learns_it_through_the_vector_env(chance):
    envs = gym.make_vec(
        "SocialCorridor-v0", num_envs=8, autoreset_mode=AutoresetMode.SAME_STEP, **SHORT
    )
    policy = single_file_ppo.train(envs, updates=8, steps=64, seed=0)
    check_has_learned(policy, chance)
