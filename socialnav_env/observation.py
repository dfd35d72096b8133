"""From the state of a corridor to what the robot observes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from socialnav_env.config import DOORWAY_WALL, CorridorConfig
from socialnav_env.kernels import BoolArray, FloatArray, kernel

NUM_RAYS = 9
"""Range rays, evenly spread from -90 to 90 degrees of the heading (the paper's code has nine)."""
HEAD = 15
"""Entries before the people: pose, velocity, both goals and their flags."""
PER_HUMAN = 4
"""Entries for each person: relative position and velocity."""

_TURNS = tuple(math.pi * (ray / (NUM_RAYS - 1) - 0.5) for ray in range(NUM_RAYS))
RAY_COS, RAY_SIN = np.cos(_TURNS), np.sin(_TURNS)
"""(9,) the rays' directions, relative to the robot's heading."""


class ObservationParameters(NamedTuple):
    """What the kernel needs of CorridorConfig, in its units."""

    half_length: float
    half_width: float
    human_radius: float
    ray_range: float
    doorway_z: float
    jamb: float
    with_people: float
    with_rays: float


def observation_parameters(config: CorridorConfig) -> ObservationParameters:
    """Pick the kernel's parameters from the config."""
    return ObservationParameters(
        config.half_length,
        config.half_width,
        config.human_radius,
        config.ray_range,
        config.doorway_z,
        config.jamb,
        config.observation != "rays",
        config.observation != "state",
    )


@kernel
def sight_from(row: FloatArray) -> ObservationParameters:
    """The parameters from a row of numbers, which takes a kernel call a fraction of the time."""
    return ObservationParameters(
        row[0],
        row[1],
        row[2],
        row[3],
        row[4],
        row[5],
        row[6],
        row[7],
    )


def people_entries(config: CorridorConfig) -> slice:
    """Where the people's entries stand; empty where people are not observed."""
    return slice(HEAD, HEAD + (config.observation != "rays") * PER_HUMAN * config.num_humans)


def ray_entries(config: CorridorConfig) -> slice:
    """Where the ranges stand; empty where there are none."""
    start = people_entries(config).stop
    return slice(start, start + (config.observation != "state") * NUM_RAYS)


def observation_bounds(config: CorridorConfig) -> tuple[FloatArray, FloatArray]:
    """(n,) lowest and highest value of each entry; the order is the env's observation table."""
    speed = config.robot_speed + config.human_top_speed
    diagonal = 2.0 * math.hypot(config.half_length, config.half_width)
    robot = [config.half_width, config.half_length, 1.0, 1.0, speed, speed, config.robot_turn_rate]
    goals = [diagonal, 1.0, 1.0, 1.0] * 2
    person = [diagonal, diagonal, 2.0 * speed, 2.0 * speed]
    people, rays = people_entries(config), ray_entries(config)
    high = np.array(robot + goals + [0.0] * (rays.stop - HEAD))
    high[people] = np.tile(person, (people.stop - people.start) // PER_HUMAN)
    high[rays] = config.ray_range
    low = -high
    low[[7, 10, 11, 14]] = 0.0
    low[rays] = 0.0
    return low, high


def add_noise(
    observation: FloatArray,
    config: CorridorConfig,
    low: FloatArray,
    high: FloatArray,
    rng: np.random.Generator,
) -> None:
    """Make the people's states and the ranges of one observation as inexact as sensors are.

    Args:
        observation: (n,) changed; stays within its bounds.
        config: The standard deviations.
        low: (n,) lower bounds.
        high: (n,) upper bounds.
        rng: The corridor's generator.
    """
    people, rays = people_entries(config), ray_entries(config)
    for entries, deviation in ((people, config.tracking_noise), (rays, config.ray_noise)):
        if deviation > 0.0:
            values = observation[entries]
            values += deviation * rng.standard_normal(len(values))
    np.clip(observation, low, high, out=observation)


@kernel
def ray_length(bodies: FloatArray, cos: float, sin: float, p: ObservationParameters) -> float:
    """Distance [m] from the robot's centre along (cos, sin) to the first wall or person.

    Args:
        bodies: (1 + H, 6) one corridor's bodies, the robot first.
        cos: The ray's z part.
        sin: The ray's x part.
        p: Parameters.
    """
    z, x = bodies[0, 0], bodies[0, 1]
    length = p.ray_range
    if abs(cos) > 1e-12:
        length = min(length, (math.copysign(p.half_length, cos) - z) / cos)
    if abs(sin) > 1e-12:
        length = min(length, (math.copysign(p.half_width, sin) - x) / sin)
    for h in range(1, bodies.shape[0]):
        dz, dx = bodies[h, 0] - z, bodies[h, 1] - x
        length = min(length, to_disc(dz, dx, p.human_radius, cos, sin))
    if p.jamb > 0.0:
        length = min(length, to_doorway(z, x, cos, sin, p))
    return max(length, 0.0)


@kernel
def to_disc(dz: float, dx: float, radius: float, cos: float, sin: float) -> float:
    """Distance [m] along (cos, sin) to a disc ahead, infinite where the ray misses it.

    Args:
        dz: From the ray's origin to the disc's centre [m].
        dx: The same across [m].
        radius: The disc's [m].
        cos: The ray's z part.
        sin: The ray's x part.
    """
    along = dz * cos + dx * sin
    across = dz * sin - dx * cos
    half_chord = radius * radius - across * across
    if along <= 0.0 or half_chord < 0.0:
        return math.inf
    return along - math.sqrt(half_chord)


@kernel
def to_doorway(z: float, x: float, cos: float, sin: float, p: ObservationParameters) -> float:
    """Distance [m] along (cos, sin) to the wall around the doorway, infinite where none is met.

    Args:
        z: The ray's origin [m].
        x: The same across [m].
        cos: The ray's z part.
        sin: The ray's x part.
        p: Parameters.
    """
    half = 0.5 * DOORWAY_WALL
    nearest = math.inf
    for side in (-1.0, 1.0):  # the rounded ends of both halves
        nearest = min(nearest, to_disc(p.doorway_z - z, side * p.jamb - x, half, cos, sin))
    if abs(cos) > 1e-12:
        face = p.doorway_z + math.copysign(half, -cos)
        to_face = (face - z) / cos
        if to_face >= 0.0 and abs(x + to_face * sin) >= p.jamb:
            nearest = min(nearest, to_face)
    return nearest


@kernel
def observe(
    bodies: FloatArray,
    goals: FloatArray,
    flags: BoolArray,
    low: FloatArray,
    high: FloatArray,
    parameters: FloatArray,
    out: FloatArray,
) -> None:
    """Write N observations.

    Relative quantities are in the robot's frame: forward, then left. Entries are clipped to the
    Box: only a robot that is being pushed can reach its velocity bounds.

    Args:
        bodies: (N, 1 + H, 6) z, x, angle, velocity z, x, angular; the robot first.
        goals: (N, 2, 2) intermittent and end goal, z, x.
        flags: (N, 2) collected, reached.
        low: (n,) lower bounds.
        high: (n,) upper bounds.
        parameters: Row of ObservationParameters.
        out: (N, n) written.
    """
    p = sight_from(parameters)
    for n in range(bodies.shape[0]):
        z, x, angle = bodies[n, 0, 0], bodies[n, 0, 1], bodies[n, 0, 2]
        vz, vx = bodies[n, 0, 3], bodies[n, 0, 4]
        cos, sin = math.cos(angle), math.sin(angle)
        row = out[n]
        row[0] = x
        row[1] = z
        row[2] = cos
        row[3] = sin
        row[4] = vz * cos + vx * sin
        row[5] = vx * cos - vz * sin
        row[6] = bodies[n, 0, 5]
        for g in range(2):
            dz, dx = goals[n, g, 0] - z, goals[n, g, 1] - x
            distance = math.sqrt(dz * dz + dx * dx)
            row[7 + 4 * g] = distance
            row[8 + 4 * g] = (dz * cos + dx * sin) / distance if distance > 0.0 else 1.0
            row[9 + 4 * g] = (dx * cos - dz * sin) / distance if distance > 0.0 else 0.0
            row[10 + 4 * g] = 1.0 if flags[n, g] else 0.0
        at = HEAD
        if p.with_people > 0.0:
            for h in range(1, bodies.shape[1]):
                dz, dx = bodies[n, h, 0] - z, bodies[n, h, 1] - x
                dvz, dvx = bodies[n, h, 3] - vz, bodies[n, h, 4] - vx
                row[at] = dz * cos + dx * sin
                row[at + 1] = dx * cos - dz * sin
                row[at + 2] = dvz * cos + dvx * sin
                row[at + 3] = dvx * cos - dvz * sin
                at += PER_HUMAN
        if p.with_rays > 0.0:
            for ray in range(NUM_RAYS):
                ahead = cos * RAY_COS[ray] - sin * RAY_SIN[ray]
                left = sin * RAY_COS[ray] + cos * RAY_SIN[ray]
                row[at + ray] = ray_length(bodies[n], ahead, left, p)
        for i in range(row.shape[0]):
            row[i] = min(max(row[i], low[i]), high[i])
