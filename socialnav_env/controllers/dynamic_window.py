"""The dynamic window approach, among people who move."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from socialnav_env.config import DOORWAY_WALL, CorridorConfig
from socialnav_env.controllers.controller import Controller
from socialnav_env.controllers.sight import Sight
from socialnav_env.controllers.steering import actions_for, pedestrian_parameters, targets
from socialnav_env.kernels import FloatArray, kernel

HORIZON = 2.0
"""Robot and people are foreseen this far ahead [s]."""
STEPS = 20
"""Moments of the foresight."""
SAMPLES = 11
"""Samples of each of the two velocities, the ends of the window included."""
ACCELERATION = 4.0
"""Bounds the window of speeds [m/s^2]."""
TURN_ACCELERATION = 10.0
"""Bounds the window of turn rates [rad/s^2]."""
HEADING_WEIGHT = 0.1
"""Of looking at the target, beside the progress that counts 1 at top speed."""
CLEARANCE_WEIGHT = 2.0
"""Of keeping everybody's personal space free."""
COLLISION_WEIGHT = 2.0
"""Taken once for a collision at the horizon, and up to twice for an earlier one."""
WALL_SHARE = 3.0
"""A wall counts as if it were this many times as far away, since it minds no nearness."""


class DriveParameters(NamedTuple):
    """What the kernels need of CorridorConfig, in its units."""

    dt: float
    robot_speed: float
    robot_turn_rate: float
    robot_radius: float
    human_radius: float
    personal_space: float
    half_length: float
    half_width: float
    doorway_z: float
    jamb: float


class DynamicWindow(Controller):
    """Foresees each velocity that it could take up and takes the best one.

    Fox, Burgard and Thrun, The dynamic window approach to collision avoidance, IEEE Robotics and
    Automation Magazine 4 (1997): the candidates are the velocities that can be reached within a
    step, each held for a while; the best one weighs heading, clearance and speed. Here the speed
    counts as progress to the target, and people go on at their velocities, as in Seder and
    Petrovic, Dynamic window based approach to mobile robot motion control in the presence of
    moving obstacles, ICRA 2007. A holonomic base chooses among straight ways instead of arcs.
    Doorways narrower than 1.2 m leave it too little room: it stops before them.
    """

    def __init__(self, config: CorridorConfig) -> None:
        """Get to know the corridor; arguments and errors as `Controller`."""
        super().__init__(config)
        self._pedestrian = pedestrian_parameters(config)
        values = (float(getattr(config, name)) for name in DriveParameters._fields)
        self._parameters = DriveParameters(*values)

    def act(self, sight: Sight) -> FloatArray:
        """(B, A) actions."""
        config, holonomic = self.config, self.config.action == "holonomic"
        velocities = np.empty((len(sight.bodies), 3))
        ways = targets(sight, self._pedestrian)
        _choose(sight.bodies, ways, self._parameters, holonomic, velocities)
        ahead, left, turn = velocities.T
        if not holonomic:
            return np.stack(
                [2.0 * ahead / config.robot_speed - 1.0, turn / config.robot_turn_rate], axis=1
            )
        headings = sight.bodies[:, 0, 2]
        cos, sin = np.cos(headings), np.sin(headings)
        across = np.stack([ahead * cos - left * sin, ahead * sin + left * cos], axis=1)
        return actions_for(across, headings, config)


@kernel
def wall_gap(z: float, x: float, p: DriveParameters) -> float:
    """Distance from the robot's surface to the nearest wall [m]; negative inside it."""
    gap = min(p.half_length - abs(z), p.half_width - abs(x))
    if p.jamb > 0.0:
        dz, dx = z - p.doorway_z, min(abs(x) - p.jamb, 0.0)
        gap = min(gap, math.sqrt(dz * dz + dx * dx) - 0.5 * DOORWAY_WALL)
    return gap - p.robot_radius


@kernel
def room(z: float, x: float, t: float, bodies: FloatArray, p: DriveParameters) -> float:
    """Distance from the robot's surface to the nearest person's, walls counted as farther [m].

    Args:
        z: Where the robot will be [m].
        x: The same across [m].
        t: When [s].
        bodies: (1 + H, 6) now; the robot first.
        p: Parameters.
    """
    nearest = WALL_SHARE * wall_gap(z, x, p)
    for h in range(1, bodies.shape[0]):
        dz = bodies[h, 0] + bodies[h, 3] * t - z
        dx = bodies[h, 1] + bodies[h, 4] * t - x
        nearest = min(nearest, math.sqrt(dz * dz + dx * dx) - p.robot_radius - p.human_radius)
    return nearest


@kernel
def merit(
    bodies: FloatArray,
    way: FloatArray,
    ahead: float,
    left: float,
    turn: float,
    p: DriveParameters,
) -> float:
    """How good it is to hold a velocity up to the horizon.

    Args:
        bodies: (1 + H, 6) z, x, angle, velocity z, x, angular; the robot first.
        way: (2,) where to head for, z, x [m].
        ahead: Velocity ahead [m/s].
        left: Velocity to the left [m/s].
        turn: Turn rate [rad/s].
        p: Parameters.
    """
    dt = HORIZON / STEPS
    z, x, angle = bodies[0, 0], bodies[0, 1], bodies[0, 2]
    before = math.sqrt((way[0] - z) ** 2 + (way[1] - x) ** 2)
    free = 0.0
    for step in range(1, STEPS + 1):
        middle = angle + 0.5 * turn * dt
        z += (ahead * math.cos(middle) - left * math.sin(middle)) * dt
        x += (ahead * math.sin(middle) + left * math.cos(middle)) * dt
        angle += turn * dt
        nearest = room(z, x, step * dt, bodies, p)
        free += min(nearest / max(p.personal_space, 1e-6), 1.0) / STEPS
        if nearest <= 0.0:
            return -COLLISION_WEIGHT * (2.0 - step / STEPS)
    after = math.sqrt((way[0] - z) ** 2 + (way[1] - x) ** 2)
    progress = (before - after) / (p.robot_speed * HORIZON)
    course = angle + math.atan2(left, ahead)
    alignment = math.cos(math.atan2(way[1] - x, way[0] - z) - course)
    return progress + HEADING_WEIGHT * alignment + CLEARANCE_WEIGHT * free


@kernel
def sample(now: float, low: float, high: float, reach: float, i: int) -> float:
    """The i-th of SAMPLES values within `reach` of the present one and within [low, high]."""
    first = min(max(now - reach, low), high)
    last = max(min(now + reach, high), low)
    return first + (last - first) * i / (SAMPLES - 1)


@kernel
def _choose(
    bodies: FloatArray, ways: FloatArray, p: DriveParameters, holonomic: bool, out: FloatArray
) -> None:
    """Write the best velocities.

    Args:
        bodies: (B, 1 + H, 6) z, x, angle, velocity z, x, angular; the robot first.
        ways: (B, 2) where to head for, z, x [m].
        p: Parameters.
        holonomic: The second velocity goes to the left, else it turns.
        out: (B, 3) written: ahead, left [m/s], turn [rad/s].
    """
    reach, turn_reach = ACCELERATION * p.dt, TURN_ACCELERATION * p.dt
    speed, turn_rate = p.robot_speed, p.robot_turn_rate
    for n in range(bodies.shape[0]):
        robot = bodies[n, 0]
        cos, sin = math.cos(robot[2]), math.sin(robot[2])
        ahead_now = robot[3] * cos + robot[4] * sin
        left_now = robot[4] * cos - robot[3] * sin
        best = -math.inf
        for i in range(SAMPLES):
            for j in range(SAMPLES):
                ahead = sample(ahead_now, -speed if holonomic else 0.0, speed, reach, i)
                left, turn = 0.0, 0.0
                if holonomic:
                    left = sample(left_now, -speed, speed, reach, j)
                    faster = max(math.sqrt(ahead * ahead + left * left) / speed, 1.0)
                    ahead, left = ahead / faster, left / faster
                else:
                    turn = sample(robot[5], -turn_rate, turn_rate, turn_reach, j)
                value = merit(bodies[n], ways[n], ahead, left, turn, p)
                if value > best:
                    best = value
                    out[n, 0], out[n, 1], out[n, 2] = ahead, left, turn
