"""What a vector env is given: checked, and in one form."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import ArrayLike

from socialnav_env.checks import checked_count, checked_seed, is_whole
from socialnav_env.config import TIME_LIMIT, ConfigError
from socialnav_env.kernels import FloatArray, IntArray

DRAWN = 16
"""So many corridors are drawn where nobody says which."""


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
    chosen = tuple(corridors) if isinstance(corridors, Iterable) else ()
    known = all(is_whole(n) and 0 <= n < count for n in chosen)
    if not chosen or not known or len(set(chosen)) < len(chosen):
        raise ConfigError(
            f"render_envs={corridors!r}: expected different whole numbers in [0, {count - 1}]"
        )
    return tuple(map(int, chosen))


def checked_actions(actions: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    """(N, A) float64, or a ValueError."""
    checked = np.asarray(actions, dtype=np.float64)
    if checked.shape != shape or not np.isfinite(checked).all():
        raise ValueError(
            f"actions: expected finite numbers of shape {shape}, got shape {checked.shape}"
        )
    return checked


def seeds_of(seed: Any, count: int) -> list[int | None]:
    """A seed for each of `count` corridors, or a ConfigError; None is none.

    Args:
        seed: Corridor 0's, from which the others count on, or one for each.
        count: N.
    """
    if isinstance(seed, str) or not isinstance(seed, Sequence | np.ndarray):
        first = checked_seed(seed)
        return [None if first is None else first + n for n in range(count)]
    if len(seed) != count:
        raise ConfigError(f"seed: expected {count} seeds, got {len(seed)}")
    return [checked_seed(one) for one in seed]


def split_options(options: Mapping[str, Any] | None, count: int) -> tuple[IntArray, Any]:
    """What a reset's options say of which of `count` corridors, and the rest.

    Returns:
        Indices of the corridors that the reset is for, and the options without the mask.

    Raises:
        ConfigError: The mask is no (N,) array of bool with a True in it.
    """
    if not isinstance(options, Mapping) or "reset_mask" not in options:
        return np.arange(count), options
    mask = options["reset_mask"]
    fits = isinstance(mask, np.ndarray) and mask.dtype == np.bool_ and mask.shape == (count,)
    if not fits or not mask.any():
        raise ConfigError(
            f"reset_mask={mask!r}: expected an array of bool of shape ({count},), at least one of "
            "them True"
        )
    rest = {name: value for name, value in options.items() if name != "reset_mask"}
    return np.flatnonzero(mask), rest
