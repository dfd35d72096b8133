"""Where an episode starts: poses of robot and people, goals, and the way people will walk."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from socialnav_env.config import ConfigError, CorridorConfig
from socialnav_env.kernels import FloatArray

PAPER_ANCHORS = (-10.0, 5.0, 8.0)
"""People's z in the POLITE paper (Fig. 5a): one around -10, two in [4, 15]."""
NUM_WAYPOINTS = 32
"""Waypoints drawn for each person; the last one is followed by the first."""
START_CLEARANCE = 0.5
"""Nobody starts closer than this to another one or the robot, surface to surface [m]."""
WALL_CLEARANCE = 0.2
"""Nobody starts or has a waypoint closer than this to a wall, surface to surface [m]."""
PLACING_TRIES = 1000


@dataclass(frozen=True)
class Layout:
    """One corridor at the start of an episode; positions are (z, x) in metres.

    Attributes:
        robot: (3,) z, x, heading.
        people: (H, 4) z, x and velocity.
        goals: (2, 2) the intermittent goal, the end goal.
        waypoints: (H, K, 2) where each person walks in turn.
        speeds: (H,) preferred speeds [m/s].
        sides: (H,) angle by which a person's evasion leans to one side [rad], so that two who
            meet exactly head-on do not stop (the social force alone has no sideways part there).
    """

    robot: FloatArray
    people: FloatArray
    goals: FloatArray
    waypoints: FloatArray
    speeds: FloatArray
    sides: FloatArray


def draw_layout(config: CorridorConfig, rng: np.random.Generator) -> Layout:
    """Draw a start for one corridor.

    Raises:
        ConfigError: The corridor is too small for its people.
    """
    goals = np.array([_draw_goal(config, config.intermittent_z, rng),
                      _draw_goal(config, config.goal_z, rng)])  # fmt: skip
    robot = _draw_robot(config, rng)
    anchors = _draw_anchors(config, rng)
    waypoints = _draw_waypoints(config, anchors, rng)
    positions = _place_people(config, anchors, robot, rng)
    spread = np.clip(rng.normal(size=config.num_humans), -2.0, 2.0)
    speeds = np.maximum(0.05, config.human_speed + config.human_speed_std * spread)
    ways = waypoints[:, 0] - positions
    lengths = np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-9)
    velocities = ways / lengths * speeds[:, None]
    sides = rng.choice([-1.0, 1.0], size=config.num_humans) * rng.uniform(
        0.05, 0.2, size=config.num_humans
    )
    people = np.concatenate([positions, velocities], axis=1)
    return Layout(robot, people, goals, waypoints, speeds, sides)


def _inside(config: CorridorConfig, radius: float) -> FloatArray:
    """(2,) the largest |z| and |x| of a centre that keeps clear of the walls."""
    limits = np.array([config.half_length, config.half_width]) - radius - WALL_CLEARANCE
    return np.asarray(np.maximum(limits, 0.0))


def _draw_goal(config: CorridorConfig, anchor: float, rng: np.random.Generator) -> FloatArray:
    """(2,) a goal around its anchor on the centre line."""
    limits = _inside(config, config.robot_radius)
    around = np.array([anchor, 0.0]) + config.anchor_jitter * rng.uniform(-1.0, 1.0, size=2)
    return np.asarray(np.clip(around, -limits, limits))


def _draw_robot(config: CorridorConfig, rng: np.random.Generator) -> FloatArray:
    """(3,) the robot near the start, looking roughly along the corridor."""
    limits = _inside(config, config.robot_radius)
    position = np.array([config.start_z, 0.0]) + rng.uniform(-1.0, 1.0, size=2) * (0.5, 1.0)
    heading = rng.uniform(-0.3, 0.3)
    return np.append(np.clip(position, -limits, limits), heading)


def _draw_anchors(config: CorridorConfig, rng: np.random.Generator) -> FloatArray:
    """(H,) z around which each person walks: the paper's three, then anywhere."""
    limit = _inside(config, config.human_radius)[0]
    known = np.array(PAPER_ANCHORS[: config.num_humans])
    further = rng.uniform(-limit, limit, size=config.num_humans - len(known))
    drawn = known + config.anchor_jitter * rng.uniform(-1.0, 1.0, size=len(known))
    return np.asarray(np.clip(np.append(drawn, further), -limit, limit))


def _draw_waypoints(
    config: CorridorConfig, anchors: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """(H, K, 2) waypoints that lie on alternate sides of the corridor around the anchor."""
    count = len(anchors)
    limits = _inside(config, config.human_radius)
    z = anchors[:, None] + config.human_roam * rng.uniform(-1.0, 1.0, (count, NUM_WAYPOINTS))
    first_side = rng.choice([-1.0, 1.0], size=(count, 1))
    sides = first_side * (-1.0) ** np.arange(NUM_WAYPOINTS)
    x = sides * rng.uniform(0.3, 0.8, (count, NUM_WAYPOINTS)) * config.half_width
    return np.asarray(np.clip(np.stack([z, x], axis=-1), -limits, limits))


def _place_people(
    config: CorridorConfig, anchors: FloatArray, robot: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """(H, 2) starts around the anchors, clear of each other and of the robot."""
    limits = _inside(config, config.human_radius)
    placed = np.zeros((0, 2))
    for anchor in anchors:
        placed = np.vstack([placed, _place(config, anchor, robot[:2], placed, limits, rng)])
    return placed


def _place(
    config: CorridorConfig,
    anchor: float,
    robot: FloatArray,
    others: FloatArray,
    limits: FloatArray,
    rng: np.random.Generator,
) -> FloatArray:
    """(2,) a free place near the anchor, searched ever further from it."""
    for attempt in range(PLACING_TRIES):
        reach = max(config.human_roam, 0.5) + 0.02 * attempt
        z = anchor + reach * rng.uniform(-1.0, 1.0)
        position = np.clip([z, limits[1] * rng.uniform(-1.0, 1.0)], -limits, limits)
        from_robot = np.linalg.norm(position - robot) - config.robot_radius - config.human_radius
        from_others = np.linalg.norm(position - others, axis=1) - 2.0 * config.human_radius
        if min(from_robot, from_others.min(initial=np.inf)) >= START_CLEARANCE:
            return np.asarray(position)
    raise ConfigError(
        f"num_humans={config.num_humans}: no free place found in a corridor of half_length="
        f"{config.half_length:g}, half_width={config.half_width:g}; use fewer people or more room"
    )
