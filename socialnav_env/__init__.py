"""A social-navigation corridor for Gymnasium; importing it registers `SocialCorridor-v0`."""

import gymnasium as gym

from socialnav_env.config import TIME_LIMIT, ConfigError, CorridorConfig
from socialnav_env.env import SocialCorridorEnv
from socialnav_env.snapshot import Snapshot, VectorSnapshot
from socialnav_env.vector_env import SocialCorridorVectorEnv

__all__ = [
    "ConfigError",
    "CorridorConfig",
    "Snapshot",
    "SocialCorridorEnv",
    "SocialCorridorVectorEnv",
    "VectorSnapshot",
]

gym.register(
    id="SocialCorridor-v0",
    entry_point="socialnav_env.env:SocialCorridorEnv",
    vector_entry_point="socialnav_env.vector_env:SocialCorridorVectorEnv",
    max_episode_steps=TIME_LIMIT,
)
