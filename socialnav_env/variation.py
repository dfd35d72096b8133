"""Settings that differ from episode to episode: domain randomisation through reset's options."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from socialnav_env.config import ConfigError, CorridorConfig


@dataclass(frozen=True)
class Variation:
    """What each episode draws anew.

    Attributes:
        settings: Field of CorridorConfig -> a value, a pair (low, high) of numbers to draw from
            uniformly, or a list of words or switches to choose from.
    """

    settings: Mapping[str, Any]

    def __post_init__(self) -> None:
        """Keep a copy that nobody can change."""
        own = {k: list(v) if isinstance(v, list) else v for k, v in self.settings.items()}
        object.__setattr__(self, "settings", MappingProxyType(own))

    def __reduce__(self) -> tuple[type[Variation], tuple[dict[str, Any]]]:
        """A read-only mapping cannot be pickled by itself."""
        return Variation, (dict(self.settings),)

    def draw(self, config: CorridorConfig, rng: np.random.Generator) -> CorridorConfig:
        """The config of one episode.

        Raises:
            ConfigError: Settings that are fine by themselves are at odds with each other.
        """
        if not self.settings:
            return config
        drawn = {name: _draw(value, rng) for name, value in self.settings.items()}
        return dataclasses.replace(config, **drawn)


NO_VARIATION = Variation({})
"""Every episode has the env's own settings."""


def variation_from(options: Mapping[str, Any], config: CorridorConfig) -> Variation:
    """Check the options of a reset.

    Args:
        options: See `Variation.settings`.
        config: The env's own settings, whose bounds of the observation hold.

    Raises:
        ConfigError: A name or a value that cannot be; the message tells what can.
    """
    valid = [item.name for item in dataclasses.fields(config) if item.metadata["varies"]]
    unknown = sorted(set(options) - set(valid))
    if unknown:
        raise ConfigError(
            f"unknown reset option {', '.join(map(str, unknown))}; valid are {', '.join(valid)}"
        )
    plain = {name: _plain(value) for name, value in options.items()}
    for name, value in plain.items():
        for extreme in _extremes(name, value):
            _check_bounds(name, dataclasses.replace(config, **{name: extreme}), config)
    return Variation(plain)


def _plain(value: Any) -> Any:
    """The value as Python's own: options that were stored come back as NumPy's."""
    if isinstance(value, np.ndarray):
        return tuple(value.tolist())
    return value.item() if isinstance(value, np.generic) else value


def _extremes(name: str, value: Any) -> list[Any]:
    """The values to check: both ends of a range, every choice, or the value itself."""
    if isinstance(value, tuple):
        numbers = [v for v in value if isinstance(v, int | float) and not isinstance(v, bool)]
        if len(value) != 2 or len(numbers) != 2 or not value[0] <= value[1]:
            raise ConfigError(f"{name}={value!r}: expected a range (low, high) of two numbers")
        return list(value)
    if isinstance(value, list):
        if not value:
            raise ConfigError(f"{name}=[]: expected at least one value to choose from")
        return value
    return [value]


def _check_bounds(name: str, episode: CorridorConfig, config: CorridorConfig) -> None:
    """Raise ConfigError if people could be faster than the observation's bounds allow for."""
    if episode.human_top_speed > config.human_top_speed:
        raise ConfigError(
            f"{name}={getattr(episode, name)}: people would walk faster than the observation's "
            f"bounds say; make the env with human_speed={config.human_speed:g} raised to the "
            "highest speed wanted and draw below it"
        )


def _draw(value: Any, rng: np.random.Generator) -> Any:
    """A value for one episode."""
    if isinstance(value, tuple):
        return float(rng.uniform(*value))
    if isinstance(value, list):
        return value[int(rng.integers(len(value)))]
    return value
