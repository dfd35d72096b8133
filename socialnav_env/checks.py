"""Whole numbers as people give them: Python's, and NumPy's where settings were computed."""

from __future__ import annotations

from numbers import Integral
from typing import Any

from socialnav_env.config import ConfigError


def is_whole(value: Any) -> bool:
    """Whether a value is a whole number; True and False are none."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def checked_count(name: str, value: Any) -> int:
    """A whole number of at least 1, or a ConfigError."""
    if not is_whole(value) or value < 1:
        raise ConfigError(f"{name}={value!r}: expected a whole number of at least 1")
    return int(value)


def checked_seed(seed: Any) -> int | None:
    """None or a whole number of at least 0, or a ConfigError."""
    if seed is None:
        return None
    if not is_whole(seed) or seed < 0:
        raise ConfigError(f"seed={seed!r}: expected None or a whole number of at least 0")
    return int(seed)
