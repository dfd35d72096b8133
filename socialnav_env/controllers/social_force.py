"""A robot that walks as the people do."""

from __future__ import annotations

import math

import numpy as np

from socialnav_env.config import CorridorConfig
from socialnav_env.controllers.controller import Controller
from socialnav_env.controllers.sight import Sight
from socialnav_env.controllers.steering import actions_for, pedestrian_parameters, targets
from socialnav_env.kernels import FloatArray
from socialnav_env.people import social_force

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
        ways = targets(sight, self._parameters)
        pairs = zip(sight.bodies, ways.tolist(), strict=True)
        velocities = np.array([self._velocity(bodies, way) for bodies, way in pairs])
        return actions_for(velocities, sight.bodies[:, 0, 2], self.config)

    def _velocity(self, bodies: FloatArray, way: list[float]) -> tuple[float, float]:
        """The robot's next velocity z, x [m/s].

        Args:
            bodies: (1 + H, 6) z, x, angle, velocity z, x, angular; the robot first.
            way: Where to head for, z, x [m].
        """
        p, speed, dt = self._parameters, self.config.robot_speed, self.config.dt
        z, x, _, vz, vx, _ = bodies[0].tolist()
        length = max(math.hypot(way[0] - z, way[1] - x), 1e-9)
        ez, ex = (way[0] - z) / length, (way[1] - x) / length
        fz, fx = social_force(bodies, 0, ez, ex, LEAN, p)
        vz += ((speed * ez - vz) / p.relaxation_time + fz) * dt
        vx += ((speed * ex - vx) / p.relaxation_time + fx) * dt
        faster = max(math.hypot(vz, vx) / speed, 1.0)
        return vz / faster, vx / faster
