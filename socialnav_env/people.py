"""How people walk: from waypoint to waypoint under the social force.

Helbing and Molnar, Social force model for pedestrian dynamics, Phys. Rev. E 51 (1995). The force
is evaluated once per env step; pymunk then moves the bodies.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from socialnav_env.config import CorridorConfig
from socialnav_env.kernels import FloatArray, IntArray, kernel

ARRIVAL = 0.5
"""A waypoint is reached at this distance [m]."""
OUT_OF_SIGHT_WEIGHT = 0.5
"""Weight of whoever a person does not see (Helbing and Molnar 1995)."""


class PeopleParameters(NamedTuple):
    """What the kernel needs of CorridorConfig, in its units."""

    dt: float
    half_length: float
    half_width: float
    robot_radius: float
    human_radius: float
    relaxation_time: float
    human_force: float
    human_force_range: float
    human_foresight: float
    wall_force: float
    wall_force_range: float
    sight_cosine: float
    patience_steps: float


def people_parameters(config: CorridorConfig) -> PeopleParameters:
    """Pick the kernel's parameters from the config."""
    return PeopleParameters(
        config.dt,
        config.half_length,
        config.half_width,
        config.robot_radius,
        config.human_radius,
        config.relaxation_time,
        config.human_force,
        config.human_force_range,
        config.human_foresight,
        config.wall_force,
        config.wall_force_range,
        math.cos(config.field_of_view / 2.0),
        round(config.human_patience / config.dt),
    )


@kernel
def people_from(row: FloatArray) -> PeopleParameters:
    """The parameters from a row of numbers, which takes a kernel call a fraction of the time."""
    return PeopleParameters(
        row[0],
        row[1],
        row[2],
        row[3],
        row[4],
        row[5],
        row[6],
        row[7],
        row[8],
        row[9],
        row[10],
        row[11],
        row[12],
    )


@kernel
def repulsion(
    dz: float, dx: float, vz: float, vx: float, reach: float, p: PeopleParameters
) -> tuple[float, float]:
    """Elliptical repulsion of a person by another one, Helbing and Molnar 1995, Eqs. 3 and 4.

    They treat people as points; here the distance counts from skin to skin, as in their later
    models, since our discs would touch where the points are still 0.6 m apart.

    Args:
        dz: From the other to the person, along z [m].
        dx: The same across [m].
        vz: The other's velocity [m/s].
        vx: The same across [m/s].
        reach: Sum of the two radii [m].
        p: Parameters.

    Returns:
        The acceleration (z, x) in m/s^2: -grad V0 exp((reach - b) / sigma), with
        2b = sqrt((|r| + |r - v dt|)^2 - |v dt|^2); as strong as in contact when closer still.
    """
    stride_z = vz * p.human_foresight
    stride_x = vx * p.human_foresight
    ahead_z = dz - stride_z
    ahead_x = dx - stride_x
    near = max(math.hypot(dz, dx), 1e-6)
    ahead = max(math.hypot(ahead_z, ahead_x), 1e-6)
    total = near + ahead
    b = 0.5 * math.sqrt(max(total * total - stride_z * stride_z - stride_x * stride_x, 0.0))
    b = max(b, 0.5 * reach)  # on the other's way b falls to 0, where the gradient has a pole
    strength = (
        p.human_force / p.human_force_range * math.exp(min(reach - b, 0.0) / p.human_force_range)
    )
    strength *= total / (4.0 * b)
    return (
        strength * (dz / near + ahead_z / ahead),
        strength * (dx / near + ahead_x / ahead),
    )


@kernel
def wall_repulsion(z: float, x: float, p: PeopleParameters) -> tuple[float, float]:
    """Repulsion of all four walls [m/s^2]: the sum, since the nearest alone makes people sway."""
    scale = p.wall_force / p.wall_force_range
    reach = p.wall_force_range
    az = math.exp(-(z + p.half_length) / reach) - math.exp(-(p.half_length - z) / reach)
    ax = math.exp(-(x + p.half_width) / reach) - math.exp(-(p.half_width - x) / reach)
    return scale * az, scale * ax


@kernel
def walk(
    bodies: FloatArray,
    waypoints: FloatArray,
    waypoint: IntArray,
    waypoint_age: IntArray,
    speeds: FloatArray,
    sides: FloatArray,
    parameters: FloatArray,
    commands: FloatArray,
) -> None:
    """Write every person's next velocity and move on to the next waypoint where one is reached.

    Args:
        bodies: (N, 1 + H, 6) z, x, angle, velocity z, x, angular; the robot first.
        waypoints: (N, H, K, 2) z, x.
        waypoint: (N, H) index of the current waypoint; changed here.
        waypoint_age: (N, H) steps since it was taken up; changed here.
        speeds: (N, H) preferred speeds [m/s].
        sides: (N, H) lean of the evasion [rad].
        parameters: Row of PeopleParameters.
        commands: (N, 1 + H, 3) velocity z, x and angular; rows 1 onwards are written.
    """
    p = people_from(parameters)
    for n in range(bodies.shape[0]):
        for h in range(waypoint.shape[1]):
            z, x = bodies[n, h + 1, 0], bodies[n, h + 1, 1]
            vz, vx = bodies[n, h + 1, 3], bodies[n, h + 1, 4]

            to_z = waypoints[n, h, waypoint[n, h], 0] - z
            to_x = waypoints[n, h, waypoint[n, h], 1] - x
            waypoint_age[n, h] += 1
            if math.hypot(to_z, to_x) < ARRIVAL or waypoint_age[n, h] > p.patience_steps:
                waypoint[n, h] = (waypoint[n, h] + 1) % waypoints.shape[2]
                waypoint_age[n, h] = 0
                to_z = waypoints[n, h, waypoint[n, h], 0] - z
                to_x = waypoints[n, h, waypoint[n, h], 1] - x
            length = max(math.hypot(to_z, to_x), 1e-9)
            ez, ex = to_z / length, to_x / length

            az = (speeds[n, h] * ez - vz) / p.relaxation_time
            ax = (speeds[n, h] * ex - vx) / p.relaxation_time
            cos, sin = math.cos(sides[n, h]), math.sin(sides[n, h])
            for other in range(bodies.shape[1]):
                if other == h + 1:
                    continue
                dz = z - bodies[n, other, 0]
                dx = x - bodies[n, other, 1]
                reach = p.human_radius + (p.robot_radius if other == 0 else p.human_radius)
                fz, fx = repulsion(dz, dx, bodies[n, other, 3], bodies[n, other, 4], reach, p)
                seen = -(ez * dz + ex * dx) >= math.hypot(dz, dx) * p.sight_cosine
                weight = 1.0 if seen else OUT_OF_SIGHT_WEIGHT
                az += weight * (cos * fz - sin * fx)
                ax += weight * (sin * fz + cos * fx)
            wz, wx = wall_repulsion(z, x, p)

            vz += (az + wz) * p.dt
            vx += (ax + wx) * p.dt
            speed = math.hypot(vz, vx)
            cap = 1.3 * speeds[n, h]
            if speed > cap:
                vz *= cap / speed
                vx *= cap / speed
            commands[n, h + 1, 0] = vz
            commands[n, h + 1, 1] = vx
            commands[n, h + 1, 2] = 0.0
