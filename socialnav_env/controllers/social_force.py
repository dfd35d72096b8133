"""A robot that walks as the people do."""

from __future__ import annotations

import math

import numpy as np

from socialnav_env.config import CorridorConfig
from socialnav_env.controllers.controller import Controller
from socialnav_env.controllers.sight import Sight
from socialnav_env.controllers.steering import actions_for, pedestrian_parameters, targets
from socialnav_env.kernels import FloatArray, kernel
from socialnav_env.people import PeopleParameters, social_force

LEAN = 0.15
"""The robot's evasion leans to its left by this angle [rad], like a person's `sides`."""


class SocialForceRobot(Controller):
    """Takes up the velocity that the social force gives a person in its place.

    Helbing and Molnar, Social force model for pedestrian dynamics, Phys. Rev. E 51 (1995), with
    the corridor's own values, the robot's radius and its top speed as the preferred one. As a
    controller: Ferrer, Garrell and Sanfeliu, Robot companion: a social-force based approach with
    human awareness-navigation in crowded environments, IROS 2013. The walls' repulsion closes
    doorways narrower than 1.2 m: it stops before them.
    """

    def __init__(self, config: CorridorConfig) -> None:
        """Get to know the corridor; arguments and errors as `Controller`."""
        super().__init__(config)
        self._parameters = pedestrian_parameters(config)

    def act(self, sight: Sight) -> FloatArray:
        """(B, A) actions."""
        velocities = np.empty((len(sight.bodies), 2))
        ways = targets(sight, self._parameters)
        speed, dt = self.config.robot_speed, self.config.dt
        _write_velocities(sight.bodies, ways, speed, dt, self._parameters, velocities)
        return actions_for(velocities, sight.bodies[:, 0, 2], self.config)


@kernel
def _write_velocities(
    bodies: FloatArray,
    ways: FloatArray,
    speed: float,
    dt: float,
    p: PeopleParameters,
    out: FloatArray,
) -> None:
    """Write the robots' next velocities.

    Args:
        bodies: (B, 1 + H, 6) z, x, angle, velocity z, x, angular; the robot first.
        ways: (B, 2) where to head for, z, x [m].
        speed: Preferred and top speed [m/s].
        dt: One env step [s].
        p: Parameters.
        out: (B, 2) written: z, x [m/s].
    """
    for n in range(bodies.shape[0]):
        robot = bodies[n, 0]
        to_z, to_x = ways[n, 0] - robot[0], ways[n, 1] - robot[1]
        length = max(math.sqrt(to_z * to_z + to_x * to_x), 1e-9)
        ez, ex = to_z / length, to_x / length
        fz, fx = social_force(bodies[n], 0, ez, ex, LEAN, p)
        vz = robot[3] + ((speed * ez - robot[3]) / p.relaxation_time + fz) * dt
        vx = robot[4] + ((speed * ex - robot[4]) / p.relaxation_time + fx) * dt
        faster = max(math.sqrt(vz * vz + vx * vx) / speed, 1.0)
        out[n, 0], out[n, 1] = vz / faster, vx / faster
