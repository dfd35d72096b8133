"""What the user-study replication is made of, and its presets."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field

from polite.policies.ppo import PpoConfig
from polite.rewards.network import FAST, PAPER, RewardNetConfig
from polite.rewards.trainer import RewardTrainingConfig
from polite.types import PoliteError


@dataclass(frozen=True)
class StudyConfig:
    """The replication of the user study (POLITE, section V-B) with simulated participants."""

    seeds: int = 3
    """Training runs of each reward model and policy; the participants' answers are the same."""
    clip_steps: int = 20_480
    """PPO steps of the policy that makes the clips: part of the way, so that its clips show both
    good and clumsy passages. The learning rate decays as if it were trained to `policy_steps`."""
    horizon: int = 600
    """Steps of an episode; nothing ends it early, since an early end leaks reward."""
    anchor_jitter: float = 0.5
    """Goals and people are drawn within this distance of their anchors [m], so that places mean
    the same in every episode."""
    pool_envs: int = 8
    """Corridors for each of the start places from which the pool's clips are collected: places
    spread along the corridor, since from its beginning the end goal would hardly be shown."""
    pool_steps: int = 200
    """Steps of each of them."""
    pool_segments: int = 600
    """Segments of the pool, and of the held-out one."""
    segment_length: int = 50
    """m, steps of a segment (5 s)."""
    participants: int = 20
    """People in each condition."""
    map_states: int = 3000
    """Held-out states on which the reward models are compared, spread evenly over z."""
    reward_net: RewardNetConfig = FAST
    """The reward model."""
    reward_training: RewardTrainingConfig = field(default_factory=RewardTrainingConfig)
    """How it is trained; the baseline differs by both alphas at 0."""
    ppo: PpoConfig = field(default_factory=PpoConfig)
    """How policies are trained."""
    policy_steps: int = 150_000
    """PPO steps of each policy."""
    evaluation_episodes: int = 100
    """Episodes on which a finished policy is judged by the true reward."""
    sensitivity_seeds: int = 0
    """Training runs for each level of the sensitivity analysis; 0 leaves it out."""


PRESETS = {
    "smoke": StudyConfig(
        seeds=2,
        clip_steps=4096,
        horizon=200,
        pool_envs=1,
        pool_steps=80,
        pool_segments=120,
        participants=4,
        map_states=600,
        reward_training=RewardTrainingConfig(epochs=4, batch_size=40),
        ppo=PpoConfig(num_envs=16, epochs=2),
        policy_steps=4096,
        evaluation_episodes=10,
        sensitivity_seeds=1,
    ),
    # Twice the epochs: at 100 the small network has hardly left its first weights.
    "fast": StudyConfig(reward_training=RewardTrainingConfig(epochs=200)),
    "paper": StudyConfig(
        seeds=5,
        reward_net=PAPER,
        policy_steps=204_800,
        sensitivity_seeds=5,
    ),
}
"""`smoke` checks that everything runs, `fast` is for a first look, `paper` is the one to cite."""


def preset(name: str) -> StudyConfig:
    """The preset of that name.

    Raises:
        PoliteError: There is none; the message lists the valid ones.
    """
    if name not in PRESETS:
        raise PoliteError(f"unknown preset {name!r}; valid are {', '.join(PRESETS)}")
    return PRESETS[name]


def as_dict(config: StudyConfig) -> dict[str, object]:
    """The config as plain data, for `results.json` and to recognise a run to go on with."""
    return dataclasses.asdict(config)
