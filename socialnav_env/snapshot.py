"""A moment of one corridor or of many, to go on from exactly."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

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
        state: People, goals, flags, tallies and bodies.
        terms: (N, 6) reward terms of the last step, which a picture may show.
        forces: (N, H, 2) social forces of the last step, which a picture may show.
        generators: States of the N random generators, for noise and the next resets.
        variations: What the options of `reset` gave to each of the N corridors.
        trails: The robots' ways so far, for each corridor that is drawn.
    """

    state: State
    terms: FloatArray
    forces: FloatArray
    generators: tuple[Mapping[str, Any], ...]
    variations: tuple[Variation, ...]
    trails: Mapping[int, Trail]


@dataclass(frozen=True, eq=False)
class VectorSnapshot(Snapshot):
    """A moment of a vector env.

    Attributes:
        elapsed: (N,) steps since each episode's start.
        ended: (N,) whose episode is over and has to begin anew.
        observations: (N, n) the last ones, which a reset of other corridors tells again.
    """

    elapsed: IntArray
    ended: BoolArray
    observations: FloatArray


def generator_from(state: Mapping[str, Any]) -> np.random.Generator:
    """A generator that goes on from the state of another one's `bit_generator`."""
    bit_generator = getattr(np.random, state["bit_generator"])()
    bit_generator.state = state
    return np.random.Generator(bit_generator)
