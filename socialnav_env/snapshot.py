"""A moment of one corridor or of many, to go on from exactly."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from socialnav_env.config import CorridorConfig
from socialnav_env.kernels import BoolArray, FloatArray, IntArray
from socialnav_env.pictures import Trail
from socialnav_env.state import State
from socialnav_env.variation import Variation


@dataclass(frozen=True, eq=False)
class Snapshot:
    """Everything that the next steps and resets of an env depend on, as arrays and plain data.

    It can be pickled, and an env of the same settings goes on from it in any process. N is 1 for
    the single env.

    Attributes:
        config: The env's settings.
        state: People, goals, flags, tallies and bodies.
        terms: (N, 6) reward terms of the last step, which a picture may show.
        forces: (N, H, 2) social forces of the last step, which a picture may show.
        generators: States of the N random generators, for the next resets.
        noises: States of the N random generators of sensor noise.
        variations: What the options of `reset` gave to each of the N corridors.
        trails: The robots' ways so far, for each corridor that is drawn.
    """

    config: CorridorConfig
    state: State
    terms: FloatArray
    forces: FloatArray
    generators: tuple[Mapping[str, Any], ...]
    noises: tuple[Mapping[str, Any], ...]
    variations: tuple[Variation, ...]
    trails: Mapping[int, Trail]


@dataclass(frozen=True, eq=False)
class VectorSnapshot(Snapshot):
    """A moment of a vector env.

    Attributes:
        autoreset_mode: What follows the end of an episode.
        elapsed: (N,) steps since each episode's start.
        ended: (N,) whose episode is over and has to begin anew.
        observations: (N, n) the last ones, which a reset of other corridors tells again.
    """

    autoreset_mode: AutoresetMode
    elapsed: IntArray
    ended: BoolArray
    observations: FloatArray


def check_snapshot(snapshot: Any, kind: type[Snapshot], config: CorridorConfig) -> None:
    """Check that an env can go on from a snapshot.

    Args:
        snapshot: What is given.
        kind: Snapshot for the single env, VectorSnapshot for many.
        config: The env's settings.

    Raises:
        ValueError: It is something else, or of other settings; the message names the first.
    """
    if type(snapshot) is not kind:
        raise ValueError(f"expected a {kind.__name__}, got a {type(snapshot).__name__}")
    for item in dataclasses.fields(config):
        seen, expected = getattr(snapshot.config, item.name), getattr(config, item.name)
        if seen != expected:
            raise ValueError(
                f"the snapshot is of an env with {item.name}={seen!r}, expected "
                f"{item.name}={expected!r}; make the env with the snapshot's settings"
            )


def states_of(generators: Iterable[np.random.Generator]) -> tuple[Mapping[str, Any], ...]:
    """The states of generators, as `generator_from` takes them."""
    return tuple(rng.bit_generator.state for rng in generators)


def generator_from(state: Mapping[str, Any]) -> np.random.Generator:
    """A generator that goes on from the state of another one's `bit_generator`."""
    bit_generator = getattr(np.random, state["bit_generator"])()
    bit_generator.state = state
    return np.random.Generator(bit_generator)
