"""What a vector env is given: checked, and in one form."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import ArrayLike

from socialnav_env.config import ConfigError, CorridorConfig
from socialnav_env.env import TIME_LIMIT
from socialnav_env.kernels import FloatArray, IntArray
from socialnav_env.variation import Variation, variation_from

DRAWN = 16
"""So many corridors are drawn where nobody says which."""


def checked_count(name: str, value: Any) -> int:
    """A whole number of at least 1, or a ConfigError."""
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise ConfigError(f"{name}={value!r}: expected a whole number of at least 1")
    return value


def time_limit(steps: int | None) -> float:
    """Steps after which an episode is truncated, in the way of `gym.make`, or a ConfigError."""
    if steps is None:
        return TIME_LIMIT
    return math.inf if steps == -1 else checked_count("max_episode_steps", steps)


def autoreset_mode_of(mode: AutoresetMode | str) -> AutoresetMode:
    """The mode meant by a member or its value, or a ConfigError."""
    try:
        return AutoresetMode(mode)
    except ValueError as error:
        valid = ", ".join(member.value for member in AutoresetMode)
        raise ConfigError(f"autoreset_mode={mode!r}: expected one of {valid}") from error


def drawn_corridors(corridors: Iterable[int] | None, count: int) -> tuple[int, ...]:
    """Which of `count` corridors are drawn, or a ConfigError."""
    if corridors is None:
        return tuple(range(min(count, DRAWN)))
    chosen = tuple(corridors)
    if not chosen or len(set(chosen)) < len(chosen) or not set(chosen) <= set(range(count)):
        raise ConfigError(
            f"render_envs={chosen}: expected different whole numbers in [0, {count - 1}]"
        )
    return chosen


def checked_actions(actions: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    """(N, A) float64, or a ValueError."""
    checked = np.asarray(actions, dtype=np.float64)
    if checked.shape != shape or not np.isfinite(checked).all():
        raise ValueError(
            f"actions: expected finite numbers of shape {shape}, got shape {checked.shape}"
        )
    return checked


def seeds_of(seed: int | Sequence[int | None] | None, count: int) -> list[int | None]:
    """A seed for each of `count` corridors, or a ConfigError; None is none."""
    if seed is None:
        return [None] * count
    if isinstance(seed, int | np.integer):
        return [int(seed) + n for n in range(count)]
    if len(seed) != count:
        raise ConfigError(f"seed: expected {count} seeds, got {len(seed)}")
    return [None if one is None else int(one) for one in seed]


def chosen_corridors(options: Mapping[str, Any] | None, count: int) -> IntArray:
    """Indices of those of `count` corridors that a reset is for, or a ConfigError."""
    if options is None or "reset_mask" not in options:
        return np.arange(count)
    mask = options["reset_mask"]
    fits = isinstance(mask, np.ndarray) and mask.dtype == np.bool_ and mask.shape == (count,)
    if not fits or not mask.any():
        raise ConfigError(
            f"reset_mask={mask!r}: expected an array of bool of shape ({count},), at least one of "
            "them True"
        )
    return np.flatnonzero(mask)


def variation_of(options: Mapping[str, Any] | None, config: CorridorConfig) -> Variation | None:
    """What a reset's options say of later episodes, or a ConfigError; None is nothing.

    A `reset_mask` alone says nothing, or nobody could reset some corridors and leave the rest of
    the options as they are.
    """
    if options is None or set(options) == {"reset_mask"}:
        return None
    further = {name: value for name, value in options.items() if name != "reset_mask"}
    return variation_from(further, config)
