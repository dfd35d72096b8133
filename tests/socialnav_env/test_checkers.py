"""What Gymnasium and stable-baselines3 expect of an env holds in every scenario."""

import gymnasium as gym
import numpy as np
import pygame
import pytest
from gymnasium.utils import env_checker
from stable_baselines3.common import env_checker as sb3_checker

import socialnav_env  # noqa: F401 (registers the id)
from socialnav_env.config import SCENARIOS

SETTINGS = [
    *({"scenario": name} for name in SCENARIOS),
    {"walking": "group", "num_humans": 12},
    {"walking": "queue", "frame_skip": 1, "timestep": 0.1},
    {"ray_noise": 0.1, "tracking_noise": 0.1, "render_mode": "rgb_array"},
    {"terminate_on_goal": False, "terminate_on_collision": False},
]
everywhere = pytest.mark.parametrize("settings", SETTINGS, ids=str)
every_observation = pytest.mark.parametrize("observation", ["both", "state", "rays"])
every_action = pytest.mark.parametrize("action", ["unicycle", "holonomic"])


@everywhere
@every_observation
@every_action
def test_gymnasiums_checker_has_no_complaint(settings, observation, action):
    env = gym.make("SocialCorridor-v0", observation=observation, action=action, **settings)
    env_checker.check_env(env.unwrapped, skip_render_check=True)


def test_gymnasiums_checker_renders_every_mode(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env_checker.check_env(gym.make("SocialCorridor-v0", render_mode="rgb_array").unwrapped)
    pygame.display.quit()


@everywhere
@every_observation
@every_action
def test_stable_baselines_checker_has_no_complaint(settings, observation, action):
    env = gym.make("SocialCorridor-v0", observation=observation, action=action, **settings)
    sb3_checker.check_env(env, warn=True, skip_render_check=True)


@everywhere
@every_observation
@every_action
def test_the_passive_checker_has_no_complaint_over_whole_episodes(settings, observation, action):
    env = gym.make(
        "SocialCorridor-v0",
        observation=observation,
        action=action,
        max_episode_steps=50,
        **settings,
    )
    assert env.spec.disable_env_checker is False  # so gym.make has wrapped it in the checker
    rng = np.random.default_rng(0)
    env.reset(seed=0)
    for _ in range(60):
        seen, _, terminated, truncated, _ = env.step(
            rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)
        )
        assert env.observation_space.contains(seen)
        if terminated or truncated:
            env.reset()


def test_this_id_is_the_only_one():
    """So that the scenarios above are all that can be made."""
    ours = [name for name, spec in gym.registry.items() if "socialnav_env" in str(spec.entry_point)]
    assert ours == ["SocialCorridor-v0"]
