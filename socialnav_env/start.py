"""Draws a start: robot, goals, and people who walk across the corridor or along it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from socialnav_env.config import DOORWAY_WALL, CorridorConfig
from socialnav_env.kernels import FloatArray, kernel

PAPER_ANCHORS = (-10.0, 5.0, 8.0)
"""People's z in the POLITE paper (Fig. 5a): one around -10, two in [4, 15]."""
NUM_WAYPOINTS = 32
"""Waypoints drawn for each person; the last one is followed by the first."""
START_CLEARANCE = 0.5
"""Nobody walks off closer than this to another one or the robot, surface to surface [m]."""
WALL_CLEARANCE = 0.2
"""Nobody starts or has a waypoint closer than this to a wall, surface to surface [m]."""
PLACING_TRIES = 1000
START_Z, START_X, START_TURN = 0.5, 1.0, 0.3
"""The robot starts this close to its anchor along z and x [m], turned by at most this [rad]."""
SLOWEST = 0.05
"""Nobody prefers to walk more slowly [m/s]."""
LEAN_LEAST, LEAN_MOST = 0.05, 0.2
"""How far an evasion leans to one side [rad]."""
SHARE_ALONG = {"cross": 0.0, "along": 1.0, "mixed": 0.5}
"""Walking style -> chance that a person goes along the corridor."""


class StartParameters(NamedTuple):
    """What the kernels need of CorridorConfig."""

    half_length: float
    half_width: float
    human_radius: float
    robot_radius: float
    anchor_jitter: float
    human_roam: float
    human_speed: float
    human_speed_std: float
    start_z: float
    intermittent_z: float
    goal_z: float
    doorway_z: float
    doorway_width: float
    share_along: float


def start_parameters(config: CorridorConfig) -> StartParameters:
    """Pick the kernels' parameters from the config."""
    share = SHARE_ALONG.get(config.walking, 0.0)
    names = [name for name in StartParameters._fields if name != "share_along"]
    values = {name: float(getattr(config, name)) for name in names}
    return StartParameters(share_along=share, **values)


@kernel
def beside_doorway(z: float, doorway_z: float, doorway: float, radius: float) -> float:
    """The same z, moved clear of the wall around a doorway.

    Args:
        z: Where to be [m].
        doorway_z: Where the wall stands [m].
        doorway: Width of the opening, 0 for no wall [m].
        radius: Of whoever is to stand there [m].
    """
    clear = 0.5 * DOORWAY_WALL + radius + WALL_CLEARANCE
    if doorway <= 0.0 or abs(z - doorway_z) >= clear:
        return z
    return doorway_z + (clear if z >= doorway_z else -clear)


@kernel
def draw_start(
    room: StartParameters,
    rng: np.random.Generator,
    robot: FloatArray,
    goals: FloatArray,
    people: FloatArray,
    waypoints: FloatArray,
    speeds: FloatArray,
    sides: FloatArray,
) -> bool:
    """Draw the start of one corridor; see `layout.Layout` for what is what.

    Args:
        room: `start_parameters`.
        rng: The corridor's generator.
        robot: (3,) written.
        goals: (2, 2) written.
        people: (H, 4) written.
        waypoints: (H, K, 2) written.
        speeds: (H,) written.
        sides: (H,) written.

    Returns:
        Whether there was room for everybody.
    """
    jitter = room.anchor_jitter
    _draw_near(room.intermittent_z, jitter, jitter, room.robot_radius, room, rng, goals[0])
    _draw_near(room.goal_z, jitter, jitter, room.robot_radius, room, rng, goals[1])
    _draw_near(room.start_z, START_Z, START_X, room.robot_radius, room, rng, robot)
    robot[2] = rng.uniform(-START_TURN, START_TURN)
    for h in range(people.shape[0]):  # first, since standing people have them too
        spread = min(max(rng.standard_normal(), -2.0), 2.0)
        speeds[h] = max(room.human_speed + room.human_speed_std * spread, SLOWEST)
        sides[h] = rng.uniform(LEAN_LEAST, LEAN_MOST) * (1.0 if rng.random() < 0.5 else -1.0)
    for h in range(people.shape[0]):
        anchor = _draw_anchor(h, room, rng)
        _draw_waypoints(anchor, room, rng, waypoints[h])
        if not _draw_place(anchor, h, room, robot, rng, people):
            return False
        dz, dx = waypoints[h, 0, 0] - people[h, 0], waypoints[h, 0, 1] - people[h, 1]
        share = speeds[h] / max(math.hypot(dz, dx), 1e-9)
        people[h, 2], people[h, 3] = share * dz, share * dx
    return True


@kernel
def _draw_near(
    z: float,
    reach_z: float,
    reach_x: float,
    radius: float,
    room: StartParameters,
    rng: np.random.Generator,
    out: FloatArray,
) -> None:
    """Write a place around (z, 0), clear of all walls."""
    near = z + reach_z * rng.uniform(-1.0, 1.0)
    _put(near, reach_x * rng.uniform(-1.0, 1.0), radius, room, out)


@kernel
def _draw_anchor(h: int, room: StartParameters, rng: np.random.Generator) -> float:
    """The z around which person h starts: the paper's three, then anywhere."""
    limit = max(room.half_length - room.human_radius - WALL_CLEARANCE, 0.0)
    if h < len(PAPER_ANCHORS):
        anchor = PAPER_ANCHORS[h] + room.anchor_jitter * rng.uniform(-1.0, 1.0)
        return min(max(anchor, -limit), limit)
    return rng.uniform(-limit, limit)


@kernel
def _draw_waypoints(
    anchor: float, room: StartParameters, rng: np.random.Generator, waypoints: FloatArray
) -> None:
    """Write (K, 2) waypoints on alternate sides around the anchor, or at alternate ends."""
    along = room.share_along > 0.0 and rng.random() < room.share_along
    side = 1.0 if rng.random() < 0.5 else -1.0
    for k in range(waypoints.shape[0]):
        side = -side
        if along:
            z = side * rng.uniform(0.7, 0.95) * room.half_length
            x = rng.uniform(-0.7, 0.7) * room.half_width
        else:
            z = anchor + room.human_roam * rng.uniform(-1.0, 1.0)
            x = side * rng.uniform(0.3, 0.8) * room.half_width
        _put(z, x, room.human_radius, room, waypoints[k])


@kernel
def _put(z: float, x: float, radius: float, room: StartParameters, out: FloatArray) -> None:
    """Write the nearest place that is clear of all walls."""
    margin = radius + WALL_CLEARANCE
    far_z, far_x = max(room.half_length - margin, 0.0), max(room.half_width - margin, 0.0)
    z = beside_doorway(z, room.doorway_z, room.doorway_width, radius)
    out[0] = min(max(z, -far_z), far_z)
    out[1] = min(max(x, -far_x), far_x)


@kernel
def _draw_place(
    anchor: float,
    h: int,
    room: StartParameters,
    robot: FloatArray,
    rng: np.random.Generator,
    people: FloatArray,
) -> bool:
    """Place person h near the anchor, searched ever further from it; False if all is taken."""
    far_x = max(room.half_width - room.human_radius - WALL_CLEARANCE, 0.0)
    for attempt in range(PLACING_TRIES):
        reach = max(room.human_roam, 0.5) + 0.02 * attempt
        z = anchor + reach * rng.uniform(-1.0, 1.0)
        x = rng.uniform(-1.0, 1.0) * far_x
        _put(z, x, room.human_radius, room, people[h])
        if _is_free(h, room, robot, people):
            return True
    return False


@kernel
def _is_free(h: int, room: StartParameters, robot: FloatArray, people: FloatArray) -> bool:
    """Whether person h keeps START_CLEARANCE to the robot and to those before."""
    z, x = people[h, 0], people[h, 1]
    need = START_CLEARANCE + room.human_radius
    if math.hypot(robot[0] - z, robot[1] - x) < need + room.robot_radius:
        return False
    for k in range(h):
        if math.hypot(people[k, 0] - z, people[k, 1] - x) < need + room.human_radius:
            return False
    return True
