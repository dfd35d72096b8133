"""A policy in an env gives trajectories, or the figures of whole episodes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import deepcopy
from itertools import pairwise
from numbers import Real
from typing import Any

import numpy as np
from gymnasium import Space
from gymnasium.vector import SyncVectorEnv, VectorEnv
from numpy.typing import NDArray

from polite.types import Trajectory, check_finite

Act = Callable[[NDArray[Any]], NDArray[np.float32]]
"""(N, n) observations -> (N, v) actions."""


def state_rows(env: VectorEnv[Any, Any, Any]) -> NDArray[np.float64] | None:
    """(N, k) what a picture of the present moment needs, None where the env cannot tell.

    The corridor gives `state_rows()`; a MuJoCo env qpos and qvel in one row (`state_vector()`).
    """
    if hasattr(env, "state_rows"):
        return np.asarray(env.state_rows())
    if isinstance(env, SyncVectorEnv):
        for name in ("state_row", "state_vector"):
            if hasattr(env.envs[0].unwrapped, name):
                return np.stack([getattr(e.unwrapped, name)() for e in env.envs])
    return None


def act_randomly(space: Space[Any], seed: int) -> Act:
    """Actions that see nothing: uniform within the bounds, where there are any.

    Args:
        space: Of one env's actions, (v,).
        seed: Of the draws.
    """
    space = deepcopy(space)  # an env's own draws are left alone
    space.seed(seed)
    return lambda observations: np.stack([space.sample() for _ in observations], dtype=np.float32)


def collect(
    env: VectorEnv[Any, Any, Any], act: Act, steps: int, seed: int | None
) -> list[Trajectory]:
    """Roll a policy out; no trajectory spans a reset.

    Args:
        env: A vector env that resets within the same step.
        act: The policy.
        steps: Steps of each env.
        seed: Seeds the reset.

    Returns:
        Trajectories, env by env, in the order of time. The last one of each env may be cut off.
    """
    rows: dict[str, list[NDArray[Any]]] = {name: [] for name in _FIELDS}
    observations, _ = env.reset(seed=seed)
    for _ in range(steps):
        states = state_rows(env)
        actions = act(observations)
        after, rewards, terminated, truncated, _ = env.step(actions)
        kept = (observations, actions, rewards, states, terminated, truncated)
        for name, value in zip(_FIELDS, kept, strict=True):
            rows[name].append(np.array(observations if value is None else value))
        observations = after
    arrays = {name: np.stack(values, axis=1) for name, values in rows.items()}  # (N, steps, ...)
    return [
        trajectory
        for n in range(env.num_envs)
        for trajectory in cut_episodes({name: array[n] for name, array in arrays.items()})
    ]


_FIELDS = ("observations", "actions", "rewards", "states", "terminated", "truncated")


def cut_episodes(arrays: dict[str, NDArray[Any]]) -> list[Trajectory]:
    """Cut one env's steps where episodes ended.

    Args:
        arrays: What `Trajectory` holds, and whether each step `terminated` or `truncated` an
            episode, (T, ...) each.
    """
    ended = np.flatnonzero(arrays["terminated"] | arrays["truncated"]) + 1
    bounds = np.unique([0, *ended, len(arrays["rewards"])])
    return [
        Trajectory(
            observations=arrays["observations"][start:end].astype(np.float32),
            actions=arrays["actions"][start:end].astype(np.float32),
            rewards=arrays["rewards"][start:end].astype(np.float64),
            states=arrays["states"][start:end].astype(np.float64),
            terminated=bool(arrays["terminated"][end - 1]),
        )
        for start, end in pairwise(bounds)
    ]


def evaluate(env: VectorEnv[Any, Any, Any], act: Act, seed: int) -> dict[str, NDArray[np.float64]]:
    """Run one whole episode in each env: N episodes, long and short ones counted alike.

    Args:
        env: A vector env that resets within the same step.
        act: The policy.
        seed: Seeds the reset; env n gets seed + n.

    Returns:
        (N,) `return` and `length`, and the numbers that the final `info` of any episode tells, NaN
        for those that do not tell them.

    Raises:
        NotFiniteError: if a reward is NaN or infinite.
    """
    observations, _ = env.reset(seed=seed)
    running = np.ones(env.num_envs, dtype=np.bool_)
    totals = {"return": np.zeros(env.num_envs), "length": np.zeros(env.num_envs)}
    final: list[dict[str, float]] = [{} for _ in range(env.num_envs)]
    while running.any():
        observations, rewards, terminated, truncated, info = env.step(act(observations))
        paid = np.where(running, rewards, 0.0)
        check_finite("rewards", paid)
        totals["return"] += paid
        totals["length"] += running
        ended = running & (terminated | truncated)
        for n in np.flatnonzero(ended).tolist():
            final[n] = told_numbers(info.get("final_info", {}), n)
        running &= ~ended
    names = sorted(set().union(*final))
    return {name: np.array([told.get(name, np.nan) for told in final]) for name in names} | totals


def told_numbers(info: Mapping[str, Any], n: int) -> dict[str, float]:
    """The numbers in a vector env's `info` that env n told; no arrays, no words.

    An env may tell a value now and then, and some in a type of NumPy's for which Gymnasium makes an
    array of objects (`np.bool_`): told is what the value's mask says.
    """
    values = {
        name: column[n]
        for name, column in info.items()
        if isinstance(column, np.ndarray) and f"_{name}" in info and info[f"_{name}"][n]
    }
    return {name: float(value) for name, value in values.items() if isinstance(value, _NUMBER)}


_NUMBER = (Real, np.bool_)
