"""People who stand: in conversation, or in a queue that moves up."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from socialnav_env.config import DOORWAY_WALL, ConfigError, CorridorConfig
from socialnav_env.kernels import FloatArray
from socialnav_env.start import NUM_WAYPOINTS, PLACING_TRIES, START_CLEARANCE, WALL_CLEARANCE

GROUP_SIZE, TALKING_GAP = 4, 0.6
"""People in one conversation at most, and the gap between neighbours, surface to surface [m]."""
QUEUE_GAP = 0.4
"""Gap between people in a queue, surface to surface [m]."""
STANDING = ("group", "queue")
"""Settings of `walking` with which people stand."""
QUEUE_TO_WALL = 0.6
"""Gap between a queue and the wall that it stands along, surface to surface [m]."""


@dataclass(frozen=True)
class Formation:
    """People who stand; positions are (z, x) in metres.

    Attributes:
        waypoints: (H, K, 2) where each person stands in turn; the first place is the start.
        facings: (H,) where each one looks [rad].
    """

    waypoints: FloatArray
    facings: FloatArray


def no_room(config: CorridorConfig) -> ConfigError:
    """The error of a corridor that is too small for its people."""
    stands = config.walking in STANDING
    lacking = f"no room for a {config.walking}" if stands else "no free place found"
    return ConfigError(
        f"num_humans={config.num_humans}: {lacking} in a corridor of "
        f"half_length={config.half_length:g}, half_width={config.half_width:g}; use fewer people "
        "or more room"
    )


def draw_formation(
    config: CorridorConfig, robot: FloatArray, rng: np.random.Generator
) -> Formation | None:
    """People who stand in conversation or in a queue, as `config.walking` says.

    Args:
        config: Their number and sizes.
        robot: (2,) where the robot starts.
        rng: The corridor's generator.

    Returns:
        None where the robot is in the way.

    Raises:
        ConfigError: The corridor is too small for its people, wherever the robot starts.
    """
    draw = _draw_groups if config.walking == "group" else _draw_queue
    any_fits = False
    for _ in range(PLACING_TRIES):
        formation = draw(config, rng)
        people = formation.waypoints[:, 0]
        fits = _fits(config, people)
        if fits and _clear_of(config, people, robot):
            return formation
        any_fits = any_fits or fits
    if any_fits:
        return None
    raise no_room(config)


def _draw_groups(config: CorridorConfig, rng: np.random.Generator) -> Formation:
    """Circles of up to GROUP_SIZE people who look at each other."""
    count = config.num_humans
    positions, facings = np.zeros((count, 2)), np.zeros(count)
    for members in np.array_split(np.arange(count), math.ceil(count / GROUP_SIZE)):
        centre = rng.uniform(-1.0, 1.0, 2) * (0.6 * config.half_length, 0.5 * config.half_width)
        angles = rng.uniform(0.0, math.tau) + math.tau * np.arange(len(members)) / len(members)
        chord = 2.0 * config.human_radius + TALKING_GAP
        radius = 0.5 * chord / math.sin(math.pi / len(members)) if len(members) > 1 else 0.0
        rim = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        positions[members] = centre + radius * rim
        facings[members] = angles + math.pi
    stay = np.repeat(positions[:, None], NUM_WAYPOINTS, axis=1)
    return Formation(stay, facings)


def _draw_queue(config: CorridorConfig, rng: np.random.Generator) -> Formation:
    """A queue along a wall; when patience is out, the first one goes to its end."""
    count = config.num_humans
    ahead, side = rng.choice([-1.0, 1.0], size=2)
    spacing = 2.0 * config.human_radius + QUEUE_GAP
    middle = rng.uniform(-0.5, 0.5) * config.half_length
    z = middle + ahead * spacing * (0.5 * (count - 1) - np.arange(count))
    x = side * (config.half_width - config.human_radius - QUEUE_TO_WALL)
    places = np.stack([z, np.full(count, x)], axis=1)
    turns = np.arange(count)[:, None] - np.arange(NUM_WAYPOINTS)
    waypoints = places[turns % count]
    facings = np.full(count, 0.0 if ahead > 0.0 else math.pi)
    return Formation(waypoints, facings)


def _fits(config: CorridorConfig, people: FloatArray) -> bool:
    """Whether all stand inside, clear of walls and of each other."""
    size = np.array([config.half_length, config.half_width])
    clear = np.abs(people) + config.human_radius + WALL_CLEARANCE <= size
    if config.doorway_width > 0.0:
        margin = config.human_radius + WALL_CLEARANCE + 0.5 * DOORWAY_WALL
        clear[:, 0] &= np.abs(people[:, 0] - config.doorway_z) >= margin
    gaps = np.linalg.norm(people[:, None] - people, axis=-1) - 2.0 * config.human_radius
    np.fill_diagonal(gaps, np.inf)
    apart = gaps.min(initial=np.inf) >= min(TALKING_GAP, QUEUE_GAP) - 1e-9
    return bool(clear.all() and apart)


def _clear_of(config: CorridorConfig, people: FloatArray, robot: FloatArray) -> bool:
    """Whether all stand clear of the robot."""
    gaps = np.linalg.norm(people - robot, axis=1) - config.human_radius - config.robot_radius
    return bool(gaps.min(initial=np.inf) >= START_CLEARANCE)
