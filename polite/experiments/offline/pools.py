"""The segments of the offline bench: what a policy does at several stages of its training."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import partial
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

import socialnav_env  # noqa: F401 (registers the corridor)
from polite.experiments.runner import Report
from polite.files import write_atomically
from polite.methods.history import join_pools
from polite.methods.presets import preset_of
from polite.policies.policy import GaussianPolicy
from polite.policies.ppo import PpoTrainer
from polite.policies.vec_env import make_vec_env
from polite.rollouts import collect
from polite.segments import cut_segments
from polite.types import SegmentPool

LENGTH = 50
"""m, steps of a segment."""


@dataclass(frozen=True)
class PoolConfig:
    """Whose segments: PPO on the true reward, looked at on the way."""

    env: str
    """The env's id."""
    steps: int
    """Steps of the whole training, which the learning rate is planned for."""
    early: tuple[float, ...] = (0.0, 0.04, 0.08, 0.12, 0.16)
    """Stages at which a teacher is asked, as shares of the training: those of the paper's first
    sessions."""
    late: tuple[float, ...] = (0.4,)
    """Stages that nobody is asked about, to which r̂ has to generalise."""
    segments: int = 1000
    """Segments that pairs are drawn from, spread evenly over the early stages."""
    held_out: int = 400
    """Further segments of the early stages, and as many of the late ones, for judging r̂."""


POOLS = ("asked", "early", "late")
"""Segments to ask about; held-out ones of the same stages; held-out ones of later stages."""


def build_pools(config: PoolConfig, seed: int, folder: Path, report: Report) -> dict[str, float]:
    """Train, collect at every stage, and write one file a pool.

    Args:
        config: what to collect.
        seed: everything random follows from it.
        folder: gets `<env>-asked.npz` and so on.
        report: told the share that is done.

    Returns:
        Mean true return of the segments of each pool.
    """
    preset = preset_of(config.env)
    rng = np.random.default_rng(seed)
    env = make_vec_env(config.env, preset.ppo.num_envs, seed, **preset.settings)
    trainer = PpoTrainer(env, preset.ppo, seed, config.steps)
    last = max(*config.early, *config.late)
    parts: dict[str, list[SegmentPool]] = {name: [] for name in POOLS}
    done = 0
    for stage in sorted({*config.early, *config.late}):
        target = int(stage * config.steps)
        if target > done:
            trainer.train(
                target - done, lambda steps: report(min(1.0, steps / (last * config.steps)))
            )
            done = target
        roll = partial(_roll_out, config.env, trainer.policy(), rng)
        if stage in config.early:
            parts["asked"].append(roll(ceil(config.segments / len(config.early))))
            parts["early"].append(roll(ceil(config.held_out / len(config.early))))
        if stage in config.late:
            parts["late"].append(roll(ceil(config.held_out / len(config.late))))
    env.close()
    pools = {name: join_pools(pieces) for name, pieces in parts.items()}
    for name, pool in pools.items():
        write_atomically(pool_path(folder, config.env, name), partial(_save, pool))
    return {name: float(pool.returns.mean()) for name, pool in pools.items()}


def load_pools(folder: Path, env: str) -> dict[str, SegmentPool]:
    """Read what `build_pools` wrote."""
    pools = {}
    for name in POOLS:
        with np.load(pool_path(folder, env, name), allow_pickle=False) as arrays:
            pools[name] = SegmentPool(**arrays)
    return pools


def pool_path(folder: Path, env: str, name: str) -> Path:
    """Where a pool is kept."""
    return folder / "pools" / f"{env}-{name}.npz"


def _save(pool: SegmentPool, path: Path) -> None:
    arrays: dict[str, Any] = {field.name: getattr(pool, field.name) for field in fields(pool)}
    np.savez_compressed(path, **arrays)


def _roll_out(
    env_id: str, policy: GaussianPolicy, rng: np.random.Generator, count: int
) -> SegmentPool:
    """Segments of whole episodes, more episodes than needed where these end early."""
    env = make_vec_env(env_id, 8, 0, **preset_of(env_id).settings)
    try:
        trajectories = collect(
            env.vector_env,
            lambda observations: policy.sample(observations, rng),
            env.time_limit or count * LENGTH,
            int(rng.integers(2**31)),
        )
    finally:
        env.close()
    return cut_segments(trajectories, LENGTH, count, rng)
