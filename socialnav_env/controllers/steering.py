"""From where a robot is to where it should go, and from a wanted velocity to an action."""

from __future__ import annotations

import math

import numpy as np

from socialnav_env.config import DOORWAY_WALL, CorridorConfig
from socialnav_env.controllers.sight import Sight
from socialnav_env.kernels import BoolArray, FloatArray, kernel
from socialnav_env.people import PeopleParameters, people_parameters

TURN_TIME = 0.3
"""A robot that looks elsewhere than it wants to go turns there within about this time [s]."""
MARGIN = 0.1
"""Room to leave between the robot and the wall around a doorway [m]."""
APPROACH = 0.6
"""A doorway is entered and left straight, from and to this far from the wall's middle [m]."""


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
        out[n, 0], out[n, 1] = way_to(bodies[n, 0, 0], bodies[n, 0, 1], goal[0], goal[1], p)


@kernel
def way_to(
    z: float, x: float, to_z: float, to_x: float, p: PeopleParameters
) -> tuple[float, float]:
    """The goal, or the next point on the way to it through the doorway.

    People who cut the corner are pushed around it; a robot is not, so it enters straight.

    Args:
        z: The robot [m].
        x: The same across [m].
        to_z: The goal [m].
        to_x: The same across [m].
        p: Parameters.
    """
    if p.jamb <= 0.0:
        return to_z, to_x
    side = math.copysign(1.0, to_z - p.doorway_z)
    before = (p.doorway_z - z) * side
    free = max(p.jamb - 0.5 * DOORWAY_WALL - p.robot_radius - MARGIN, 0.0)
    in_line = abs(x) <= free + 0.5 * MARGIN
    clear = 0.5 * DOORWAY_WALL + p.robot_radius
    if before < -clear or (before < 0.0 and not in_line):
        return to_z, to_x
    crossing = x + (to_x - x) * max(before, 0.0) / (before + (to_z - p.doorway_z) * side)
    if in_line:
        return p.doorway_z + side * APPROACH, min(max(crossing, -free), free)
    # Well inside the line, so that it is crossed before this point is reached.
    return p.doorway_z - side * APPROACH, min(max(crossing, -0.5 * free), 0.5 * free)


def actions_for(velocities: FloatArray, headings: FloatArray, config: CorridorConfig) -> FloatArray:
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
