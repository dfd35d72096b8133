"""From where a robot is to where it should go, and from a wanted velocity to an action."""

from __future__ import annotations

import math

import numpy as np

from socialnav_env.config import CorridorConfig
from socialnav_env.controllers.sight import Sight
from socialnav_env.kernels import BoolArray, FloatArray, kernel
from socialnav_env.people import PeopleParameters, aim, people_parameters

TURN_TIME = 0.3
"""A robot that looks elsewhere than it wants to go turns there within about this time [s]."""


def pedestrian_parameters(config: CorridorConfig) -> PeopleParameters:
    """The social force's parameters for a robot among people, whom it always evades.

    The force adds two people's radii; with the mean radius that is robot and person.
    """
    radius = 0.5 * (config.robot_radius + config.human_radius)
    robot = people_parameters(config)._replace(human_radius=radius, reactive=1.0)
    return PeopleParameters(*map(float, robot))


def targets(sight: Sight, parameters: PeopleParameters) -> FloatArray:
    """(B, 2) z, x where to head for: the intermittent goal, then the end goal, through the door."""
    out = np.empty((len(sight.bodies), 2))
    _write_targets(sight.bodies, sight.goals, sight.flags, parameters, out)
    return out


@kernel
def _write_targets(
    bodies: FloatArray, goals: FloatArray, flags: BoolArray, p: PeopleParameters, out: FloatArray
) -> None:
    """Write each robot's target.

    Args:
        bodies: (B, 1 + H, 6) the robot first.
        goals: (B, 2, 2) intermittent and end goal, z, x.
        flags: (B, 2) collected, reached.
        p: Parameters.
        out: (B, 2) written: z, x.
    """
    for n in range(bodies.shape[0]):
        goal = goals[n, 1 if flags[n, 0] else 0]
        out[n, 0], out[n, 1] = aim(bodies[n, 0, 0], bodies[n, 0, 1], goal[0], goal[1], p)


def actions_for(
    velocities: FloatArray, headings: FloatArray, config: CorridorConfig
) -> FloatArray:
    """Actions that bring robots to the wanted velocities as far as their drive allows.

    A unicycle slows down while it looks elsewhere; a holonomic base goes there at once, and both
    turn to where they go.

    Args:
        velocities: (B, 2) wanted z, x [m/s].
        headings: (B,) [rad].
        config: The corridor.

    Returns:
        (B, 2) forward and turn, or (B, 3) ahead, left and turn; turns may exceed [-1, 1].
    """
    speeds = np.hypot(velocities[:, 0], velocities[:, 1])
    directions = np.where(speeds > 1e-6, np.arctan2(velocities[:, 1], velocities[:, 0]), headings)
    errors = np.remainder(directions - headings + math.pi, math.tau) - math.pi
    turns = errors / TURN_TIME / config.robot_turn_rate
    ahead = speeds * np.cos(errors) / config.robot_speed
    if config.action == "unicycle":
        return np.stack([2.0 * np.maximum(ahead, 0.0) - 1.0, turns], axis=1)
    return np.stack([ahead, speeds * np.sin(errors) / config.robot_speed, turns], axis=1)
