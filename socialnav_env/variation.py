"""Settings that differ from episode to episode: domain randomisation through reset's options."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from socialnav_env.config import ConfigError, CorridorConfig
from socialnav_env.layout import draw_layout


@dataclass(frozen=True)
class Variation:
    """What each episode draws anew.

    Attributes:
        settings: Field of CorridorConfig -> a value, a pair (low, high) of numbers to draw from
            uniformly, or a list of values to choose from.
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
DEFAULTS = "defaults"
"""The option that returns to them."""
SPEEDS = ("human_speed", "human_speed_std")
"""The settings that together say how fast people are."""


def variation_of(options: Mapping[str, Any] | None, config: CorridorConfig) -> Variation | None:
    """What the options of a reset say of this and later episodes.

    Args:
        options: See `Variation.settings`, or {"defaults": True}. None says nothing; nor does {},
            which Gymnasium's own vector envs send.
        config: The env's own settings.

    Returns:
        None where nothing is said, so that all stays as it is.

    Raises:
        ConfigError: A name or a value that cannot be; the message tells what can.
    """
    if options is not None and not isinstance(options, Mapping):
        raise ConfigError(f"options={options!r}: expected None or a mapping of names to values")
    if not options:
        return None
    if DEFAULTS not in options:
        return variation_from(options, config)
    if len(options) > 1 or _plain(options[DEFAULTS]) is not True:
        raise ConfigError(f"{DEFAULTS} in {options!r}: expected True, and no settings beside it")
    return NO_VARIATION


def variation_from(options: Mapping[str, Any], config: CorridorConfig) -> Variation:
    """Check settings that a reset's options give.

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
            f"unknown reset option {', '.join(map(str, unknown))}; "
            f"valid are {DEFAULTS}, {', '.join(valid)}"
        )
    plain = {name: _plain(value) for name, value in options.items()}
    extremes = {name: _extremes(name, value) for name, value in plain.items()}
    for name, values in extremes.items():
        # At the shortest timestep any speed is safe; how fast people may be is checked below.
        own = dataclasses.replace(config, timestep=0.001) if name in SPEEDS else config
        for value in values:
            dataclasses.replace(own, **{name: value})
    _check_top_speed({name: max(extremes[name]) for name in SPEEDS if name in extremes}, config)
    for walking in extremes.get("walking", ()):
        draw_layout(dataclasses.replace(config, walking=walking), np.random.default_rng(0))
    return Variation(plain)


def _plain(value: Any) -> Any:
    """The value as Python's own: options that were stored come back as NumPy's."""
    if isinstance(value, np.ndarray):
        numbers = value.ndim == 1 and np.issubdtype(value.dtype, np.number)
        return tuple(value.tolist()) if numbers else value.tolist()
    if isinstance(value, tuple):
        return tuple(map(_plain, value))
    if isinstance(value, list):
        return list(map(_plain, value))
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


def _check_top_speed(fastest: Mapping[str, Any], config: CorridorConfig) -> None:
    """Raise ConfigError if people could be faster than the observation's bounds allow for.

    Args:
        fastest: The largest values that the options give to some of SPEEDS.
        config: The env's own settings.
    """
    top = dataclasses.replace(config, timestep=0.001, **fastest).human_top_speed
    if top > config.human_top_speed + 1e-9:  # sums that are equal may differ in their last bit
        said = ", ".join(f"{name}={value}" for name, value in fastest.items())
        raise ConfigError(
            f"{said}: people would walk up to {top:.4g} m/s, but the observation's bounds allow "
            f"for {config.human_top_speed:.4g} m/s; make the env with the highest speeds wanted "
            "and draw below them"
        )


def _draw(value: Any, rng: np.random.Generator) -> Any:
    """A value for one episode."""
    if isinstance(value, tuple):
        return float(rng.uniform(*value))
    if isinstance(value, list):
        return value[int(rng.integers(len(value)))]
    return value
