"""From an observation back to what was observed, in the corridor's own axes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from socialnav_env.config import CorridorConfig
from socialnav_env.kernels import BoolArray, FloatArray
from socialnav_env.observation import HEAD, PER_HUMAN, people_entries


class Sight(NamedTuple):
    """What B robots see; positions are (z, x) in metres, as in `State`."""

    bodies: FloatArray
    """(B, 1 + H, 6) z, x, angle, velocity z, x, angular; the robot first. People's angle and
    turn rate are not observed: 0."""
    goals: FloatArray
    """(B, 2, 2) intermittent and end goal."""
    flags: BoolArray
    """(B, 2) collected, reached."""


def sight_of(observations: FloatArray, config: CorridorConfig) -> Sight:
    """The inverse of `socialnav_env.observation.observe`.

    Args:
        observations: (B, n).
        config: The corridor; its people are observed.
    """
    cos, sin = observations[:, 2, None], observations[:, 3, None]
    bodies = np.zeros((len(observations), 1 + config.num_humans, 6))
    robot = bodies[:, 0]
    robot[:, :2] = observations[:, [1, 0]]
    robot[:, 2] = np.arctan2(sin, cos)[:, 0]
    robot[:, 3:5] = _turned(observations[:, 4:6], cos[:, 0], sin[:, 0])
    robot[:, 5] = observations[:, 6]

    shape = len(observations), config.num_humans, PER_HUMAN
    people = observations[:, people_entries(config)].reshape(shape)
    bodies[:, 1:, :2] = robot[:, None, :2] + _turned(people[..., :2], cos, sin)
    bodies[:, 1:, 3:5] = robot[:, None, 3:5] + _turned(people[..., 2:], cos, sin)

    goals = observations[:, 7:HEAD].reshape(-1, 2, 4)
    offsets = goals[..., :1] * _turned(goals[..., 1:3], cos, sin)
    return Sight(bodies, robot[:, None, :2] + offsets, goals[..., 3] > 0.5)


def _turned(vectors: FloatArray, cos: FloatArray, sin: FloatArray) -> FloatArray:
    """(..., 2) forward, left of the robot -> z, x of the corridor."""
    forward, left = vectors[..., 0], vectors[..., 1]
    return np.stack([forward * cos - left * sin, forward * sin + left * cos], axis=-1)
