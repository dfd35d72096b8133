"""How well the learned reward orders segments that nobody was asked about."""

from __future__ import annotations

from contextlib import closing
from math import ceil
from typing import Any

import numpy as np
import torch

from polite.analysis.quality import reward_quality, saturation
from polite.methods.preference_learning import Learned, MakeEnv
from polite.policies.policy import Policy
from polite.rewards.ensemble import RewardEnsemble
from polite.rewards.network import RewardNet, predict
from polite.rollouts import collect
from polite.samplers import uniform_pairs
from polite.segments import cut_segments
from polite.types import SegmentPool

SEGMENTS, LENGTH, PAIRS = 200, 50, 1000
"""Fresh segments unless told otherwise, steps of each, and pairs of them."""
HELD_OUT_SEED = 2_000_000
"""Added to the run's seed, so that nothing here touches or repeats what the training draws."""
ENVS = 10
"""Envs that roll the policy out side by side."""


def held_out_quality(
    make_env: MakeEnv, learned: Learned, seed: int, segments: int = SEGMENTS
) -> dict[str, Any] | None:
    """On segments of the policy at the last session, and of the finished one.

    Args:
        make_env: makes the envs.
        learned: the training's outcome.
        seed: the run's.
        segments: fresh ones of each policy.

    Returns:
        `early`, where there was a session, and `late`, of what is paid (so that an offset counts
        where clips differ in length) but for `saturation`; None if the true reward paid.
    """
    if learned.reward is None:
        return None
    policies = {"early": learned.session_policy, "late": learned.policy}
    return {
        name: _quality(make_env, policy, learned.reward, [seed + HELD_OUT_SEED, number], segments)
        for number, (name, policy) in enumerate(policies.items())
        if policy is not None
    }


def _quality(
    make_env: MakeEnv,
    policy: Policy,
    model: RewardNet | RewardEnsemble,
    seed: list[int],
    segments: int,
) -> dict[str, float | None]:
    rng = np.random.default_rng(seed)
    pool = _fresh_segments(make_env, policy, rng, segments)
    pairs = np.array([(q.first, q.second) for q in uniform_pairs(PAIRS, rng, pool)])
    paid = predict(model, pool.observations, pool.actions)
    return reward_quality(paid, pool, pairs) | {"saturation": _saturation(model, pool)}


def _saturation(model: RewardNet | RewardEnsemble, pool: SegmentPool) -> float | None:
    """Of what is trained, which need not be what is paid; None where it has no bounds."""
    if model.config.output == "linear":
        return None
    inputs = np.concatenate([pool.observations, pool.actions], axis=-1)[pool.mask]
    with torch.no_grad():
        return saturation(model.score(torch.from_numpy(inputs)).mean(dim=0).numpy())


def _fresh_segments(
    make_env: MakeEnv, policy: Policy, rng: np.random.Generator, count: int
) -> SegmentPool:
    """Roll the policy out as it trains, its actions drawn, and cut segments."""
    with closing(make_env(ENVS, 0)) as env:
        trajectories = collect(
            env.vector_env,
            lambda observations: policy.sample(observations, rng),
            ceil(count * LENGTH / ENVS),
            int(rng.integers(2**31)),
        )
    return cut_segments(trajectories, LENGTH, count, rng)
