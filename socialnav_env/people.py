"""How people walk or stand: from waypoint to waypoint under the social force.

Helbing and Molnar, Social force model for pedestrian dynamics, Phys. Rev. E 51 (1995). The force
is evaluated once per env step; pymunk then moves the bodies.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from socialnav_env.config import DOORWAY_WALL, CorridorConfig
from socialnav_env.kernels import BoolArray, FloatArray, IntArray, kernel

ARRIVAL = 0.5
"""A waypoint is reached at this distance [m]; who waits there slows down from here on."""
CUTOFF = 25.0
"""A repulsion is left out beyond so many of its ranges, where it is e^-25 of that in contact."""
HEADWAY = 0.5
"""Patience is lost in steps that bring a person forward at less than this share of its speed."""
BEYOND_DOOR = 0.5
"""Whoever wants to the other side aims at a point this far behind the doorway [m]."""
OUT_OF_SIGHT_WEIGHT = 0.5
"""Weight of whoever a person does not see (Helbing and Molnar 1995)."""


class PeopleParameters(NamedTuple):
    """What the kernel needs of CorridorConfig, in its units."""

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
    patience: float
    doorway_z: float
    jamb: float
    reactive: float
    robot_visible: float


def people_parameters(config: CorridorConfig) -> PeopleParameters:
    """Pick the kernel's parameters from the config."""
    return PeopleParameters(
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
        config.human_patience + 1e-6,  # or whether a last step counts would hang on rounding
        config.doorway_z,
        config.jamb,
        config.reactive,
        config.robot_visible,
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
        row[13],
        row[14],
        row[15],
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
    near = max(math.sqrt(dz * dz + dx * dx), 1e-6)
    ahead = max(math.sqrt(ahead_z * ahead_z + ahead_x * ahead_x), 1e-6)
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
    """Repulsion of all walls [m/s^2]: the sum, since the nearest alone makes people sway."""
    scale = p.wall_force / p.wall_force_range
    reach = p.wall_force_range
    az = math.exp(-(z + p.half_length) / reach) - math.exp(-(p.half_length - z) / reach)
    ax = math.exp(-(x + p.half_width) / reach) - math.exp(-(p.half_width - x) / reach)
    if p.jamb > 0.0:
        for side in (-1.0, 1.0):
            dz, dx = z - p.doorway_z, min(x * side - p.jamb, 0.0) * side
            centre = max(math.sqrt(dz * dz + dx * dx), 1e-6)
            push = math.exp((0.5 * DOORWAY_WALL - centre) / reach) / centre
            az += push * dz
            ax += push * dx
    return scale * az, scale * ax


@kernel
def aim(z: float, x: float, to_z: float, to_x: float, p: PeopleParameters) -> tuple[float, float]:
    """Where to walk for a waypoint: at it, or through the doorway when it lies on the other side.

    Args:
        z: The person [m].
        x: The same across [m].
        to_z: The waypoint [m].
        to_x: The same across [m].
        p: Parameters.
    """
    if p.jamb <= 0.0 or (z - p.doorway_z) * (to_z - p.doorway_z) >= 0.0:
        return to_z, to_x
    free = max(p.jamb - 0.5 * DOORWAY_WALL - p.human_radius - 0.1, 0.0)
    crossing = x + (to_x - x) * (p.doorway_z - z) / (to_z - z)
    ahead = math.copysign(BEYOND_DOOR, to_z - z)
    return p.doorway_z + ahead, min(max(crossing, -free), free)


@kernel
def towards(z: float, x: float, point: FloatArray, p: PeopleParameters) -> tuple[float, ...]:
    """The unit vector (z, x) of the way to a waypoint, and the distance [m] to what is aimed at.

    Args:
        z: The person [m].
        x: The same across [m].
        point: (2,) the waypoint, z, x.
        p: Parameters.
    """
    aim_z, aim_x = aim(z, x, point[0], point[1], p)
    to_z, to_x = aim_z - z, aim_x - x
    length = max(math.sqrt(to_z * to_z + to_x * to_x), 1e-9)
    return to_z / length, to_x / length, length


@kernel
def social_force(
    bodies: FloatArray, h: int, ez: float, ex: float, side: float, p: PeopleParameters
) -> tuple[float, float]:
    """The acceleration (z, x) of a person by robot, people and walls [m/s^2].

    Args:
        bodies: (1 + H, 6) one corridor's z, x, angle, velocity z, x, angular; the robot first.
        h: The person's row.
        ez: Where the person wants to go, unit vector.
        ex: The same across.
        side: Lean of the evasion [rad].
        p: Parameters.
    """
    z, x = bodies[h, 0], bodies[h, 1]
    az, ax = wall_repulsion(z, x, p)
    if p.reactive <= 0.0:
        return az, ax
    cos, sin = math.cos(side), math.sin(side)
    for other in range(0 if p.robot_visible > 0.0 else 1, bodies.shape[0]):
        if other == h:
            continue
        dz = z - bodies[other, 0]
        dx = x - bodies[other, 1]
        distance = math.sqrt(dz * dz + dx * dx)
        reach = p.human_radius + (p.robot_radius if other == 0 else p.human_radius)
        vz, vx = bodies[other, 3], bodies[other, 4]
        far = distance - reach - CUTOFF * p.human_force_range
        # a step aside is as far as the distance less the stride at least: b >= |r| - |v dt|
        if far > 0.0 and far > p.human_foresight * math.sqrt(vz * vz + vx * vx):
            continue
        fz, fx = repulsion(dz, dx, vz, vx, reach, p)
        seen = -(ez * dz + ex * dx) >= distance * p.sight_cosine
        weight = 1.0 if seen else OUT_OF_SIGHT_WEIGHT
        az += weight * (cos * fz - sin * fx)
        ax += weight * (sin * fz + cos * fx)
    return az, ax


@kernel
def walk(
    bodies: FloatArray,
    waypoints: FloatArray,
    waypoint: IntArray,
    waypoint_age: FloatArray,
    speeds: FloatArray,
    sides: FloatArray,
    waits: BoolArray,
    parameters: FloatArray,
    seconds: float,
    commands: FloatArray,
    forces: FloatArray,
) -> None:
    """Write every person's next velocity and move on to the next waypoint where it is time.

    It is time when a waypoint is reached or patience is out. Walking people lose patience while
    they are held up, so that a long way can be walked to its end; who waits there counts all time.

    Args:
        bodies: (N, 1 + H, 6) z, x, angle, velocity z, x, angular; the robot first.
        waypoints: (N, H, K, 2) z, x.
        waypoint: (N, H) index of the current waypoint; changed here.
        waypoint_age: (N, H) seconds of patience that it has cost; changed here.
        speeds: (N, H) preferred speeds [m/s].
        sides: (N, H) lean of the evasion [rad].
        waits: (N, H) who stands at the waypoint until patience is out.
        parameters: (N, P) rows of PeopleParameters.
        seconds: Until the next call.
        commands: (N, 1 + H, 3) velocity z, x and angular; rows 1 onwards are written.
        forces: (N, H, 2) written: the social force z, x [m/s^2].
    """
    for n in range(bodies.shape[0]):
        p = people_from(parameters[n])
        for h in range(waypoint.shape[1]):
            z, x = bodies[n, h + 1, 0], bodies[n, h + 1, 1]
            vz, vx = bodies[n, h + 1, 3], bodies[n, h + 1, 4]

            point = waypoints[n, h, waypoint[n, h]]
            to_z, to_x = point[0] - z, point[1] - x
            here = math.sqrt(to_z * to_z + to_x * to_x) < ARRIVAL and not waits[n, h]
            ez, ex, length = towards(z, x, point, p)
            if waits[n, h] or vz * ez + vx * ex < HEADWAY * speeds[n, h]:
                waypoint_age[n, h] += seconds
            if here or waypoint_age[n, h] > p.patience:
                # a queue of H people has whole rounds of H turns
                turns = waypoints.shape[2]
                last = turns - turns % waypoint.shape[1] if waits[n, h] else turns
                waypoint[n, h] = (waypoint[n, h] + 1) % last
                waypoint_age[n, h] = 0.0
                ez, ex, length = towards(z, x, waypoints[n, h, waypoint[n, h]], p)
            wanted = speeds[n, h] * (min(length / ARRIVAL, 1.0) if waits[n, h] else 1.0)

            fz, fx = social_force(bodies[n], h + 1, ez, ex, sides[n, h], p)
            forces[n, h, 0], forces[n, h, 1] = fz, fx
            vz += ((wanted * ez - vz) / p.relaxation_time + fz) * seconds
            vx += ((wanted * ex - vx) / p.relaxation_time + fx) * seconds
            speed = math.sqrt(vz * vz + vx * vx)
            cap = 1.3 * speeds[n, h]
            if speed > cap:
                vz *= cap / speed
                vx *= cap / speed
            commands[n, h + 1, 0] = vz
            commands[n, h + 1, 1] = vx
            commands[n, h + 1, 2] = 0.0
