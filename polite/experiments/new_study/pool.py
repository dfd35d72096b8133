"""Where the clips of a study with people come from, and the pairs of them."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import socialnav_env  # noqa: F401 (registers the corridor)
from polite.dataset import Feedback, load_feedback
from polite.experiments.new_study.config import NewStudyConfig
from polite.policies.policy import load_policy
from polite.policies.vec_env import make_vec_env
from polite.rollouts import collect
from polite.samplers import uniform_pairs
from polite.segments import cut_segments
from polite.types import PoliteError, SegmentPool

_ENVS = 8
_SPARE = 4  # so many more steps are collected than are shown, lest clips overlap much


def demo_folder() -> Path:
    """Where the demo lies: in the installed package, or in the checkout beside it."""
    package = Path(__file__).parents[2]
    installed = package / "assets" / "study_demo"
    return installed if installed.is_dir() else package.parent / "assets" / "study_demo"


def study_pool(config: NewStudyConfig, pairs: int) -> Feedback:
    """Segments, and pairs of them, without answers.

    Args:
        config: Says from where.
        pairs: How many are needed; as many are drawn, unless the pool brings its own.

    Raises:
        PoliteError: The pool or the policy cannot be read, or the env cannot be made.
        ShapeError: The policy is another env's.
    """
    rng = np.random.default_rng(config.seed)
    if config.env and not config.pool:
        pool = _roll_out(config, rng)
        return Feedback(pool, uniform_pairs(pairs, rng, pool), [])
    stored = load_feedback(config.pool or demo_folder() / "pool")
    queries = stored.queries or uniform_pairs(pairs, rng, stored.pool)
    return Feedback(stored.pool, queries, [])


def _roll_out(config: NewStudyConfig, rng: np.random.Generator) -> SegmentPool:
    """Collect clips from the policy, or from random actions."""
    steps = max(2 * config.length, -(-_SPARE * config.segments * config.length // _ENVS))
    if config.policy:
        policy = load_policy(config.policy)
    with closing(make_vec_env(str(config.env), _ENVS, config.seed)) as env:
        space: Any = env.action_space

        def draw(observations: NDArray[Any]) -> NDArray[np.float32]:
            bounds = np.clip(space.low, -1e3, None), np.clip(space.high, None, 1e3)
            return rng.uniform(*bounds, (len(observations), *space.shape)).astype(np.float32)

        def act(observations: NDArray[Any]) -> NDArray[np.float32]:
            return policy.sample(observations, rng)

        chosen: Callable[[NDArray[Any]], NDArray[np.float32]] = act if config.policy else draw
        trajectories = collect(env.vector_env, chosen, steps, config.seed)
    whole = [t for t in trajectories if len(t.rewards) >= min(config.length, 2)]
    if not whole:
        raise PoliteError(f"{config.env}: expected episodes of at least 2 steps")
    return cut_segments(whole, config.length, config.segments, rng)
