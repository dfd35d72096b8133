"""Whole episodes, for tests that compare them."""

import gymnasium as gym
import numpy as np

import socialnav_env  # noqa: F401 (registers the env)


def make(**settings):
    return gym.make("SocialCorridor-v0", **settings)


def episode(env, seed, steps=600):
    """Everything that an episode with random actions tells."""
    observation, info = env.reset(seed=seed)
    rng = np.random.default_rng(seed)
    told = [(observation.tolist(), 0.0, False, False, info)]
    for _ in range(steps):
        action = rng.uniform(-1.0, 1.0, env.action_space.shape)
        action[0] += 0.5
        observation, reward, terminated, truncated, info = env.step(action)
        told.append((observation.tolist(), reward, terminated, truncated, info))
        if terminated or truncated:
            break
    return told
