"""Social-navigation metrics of an episode, kept up step by step.

Names and definitions are the field's, see SOURCES. All of them run on until the episode ends, `spl`
and `time_to_goal` until the goal. For a base that moves in any direction the heading is where it
looks, not where it goes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from socialnav_env.config import CorridorConfig
from socialnav_env.kernels import BoolArray, FloatArray, kernel

METRICS = {
    "success": "S: 1 once the end goal is reached (Francis)",
    "intermittent": "1 once the intermittent goal is collected",
    "collisions": "collisions begun, with people or walls, whoever ran into whom: events, not "
    "steps",
    "human_collisions": "HC: steps in contact with a person (Francis)",
    "wall_collisions": "WC: steps in contact with a wall (Francis)",
    "time_to_goal": "T: time until the end goal, or so far while it is not reached (Francis) [s]",
    "path_length": "PL: sum of |p_t - p_(t-1)|, p the robot's centre (Francis) [m]",
    "spl": "success weighted by path length, S l / max(PL until the goal, l), l the shortest way "
    "from the start to the goal's edge, through the doorway where there is one (Anderson)",
    "stalled_time": "ST: sum of dt over steps slower than 0.05 m/s (Francis) [s]",
    "min_human_distance": "DH_min: smallest distance to a person, surface to surface (Francis) [m]",
    "personal_space_compliance": "PSC: share of steps with nobody within `personal_space` (1.2 m "
    "unless told otherwise), surface to surface (Francis)",
    "min_time_to_collision": "TTC: smallest time until the surfaces of robot and an approaching "
    "person touch if both keep their velocities, at most 10 s (Francis) [s]",
    "speed_mean": "V: mean of |v_t| over the steps (Francis) [m/s]",
    "speed_max": "largest |v_t| [m/s]",
    "acceleration_mean": "A: mean of |a_t|, a_t = (v_t - v_(t-1)) / dt (Francis) [m/s^2]",
    "acceleration_max": "largest |a_t| [m/s^2]",
    "jerk_mean": "J: mean of |a_t - a_(t-1)| / dt, from the second step on (Francis) [m/s^3]",
    "jerk_max": "largest of these [m/s^3]",
    "path_irregularity": "sum of |change of the robot's heading| / PL; 0 where PL is 0, and left "
    "out of tables then (Francis) [rad/m]",
    "intimate_share": "share of steps with the nearest person closer than 0.45 m, surface to "
    "surface (Hall, HuNavSim)",
    "personal_share": "the same for 0.45 to 1.2 m (Hall, HuNavSim)",
    "social_share": "the same for 1.2 to 3.6 m (Hall, HuNavSim)",
    "public_share": "share of steps with everybody farther away than that (Hall, HuNavSim)",
}
"""Key in `info` -> definition; the order is that of the columns that `summarise` writes."""

SOURCES = {
    "Francis": "Francis et al., Principles and guidelines for evaluating social robot navigation "
    "algorithms, arXiv 2306.16740 (2023)",
    "Anderson": "Anderson et al., On evaluation of embodied navigation agents, arXiv 1807.06757 "
    "(2018)",
    "Hall": "Hall, The hidden dimension (1966)",
    "HuNavSim": "Pérez-Higueras et al., HuNavSim: a ROS 2 human navigation simulator, RA-L (2023)",
}
"""Name in METRICS -> where the definition is from."""
STALLED_SPEED = 0.05
"""Slower than this is stalled [m/s] (Francis et al. 2023)."""
TIME_HORIZON = 10.0
"""Longest time to collision that is told apart [s]."""
INTIMATE, PERSONAL, SOCIAL = 0.45, 1.2, 3.6
"""Ends of the bands of distance, surface to surface [m] (Hall 1966; HuNavSim)."""
NO_PATH = 1e-9
"""A path that is no longer is none [m]."""
NO_ONE = 1000.0
"""`min_human_distance` in a corridor without people [m]: finite, so that JSON can hold it."""

(
    STEPS, HUMAN_CONTACT, WALL_CONTACT, COLLISIONS, GOAL_STEPS, PATH, STALLED, NEAREST, INTRUDED,
    TTC, SPEED_SUM, SPEED_MAX, ACC_SUM, ACC_MAX, JERK_SUM, JERK_MAX, TURNED, STRAIGHT,
    LAST_Z, LAST_X, LAST_ANGLE, LAST_VZ, LAST_VX, LAST_AZ, LAST_AX,
    INTIMATE_STEPS, PERSONAL_STEPS, SOCIAL_STEPS, PATH_TO_GOAL, UNBROKEN, JERKS, NUM_TALLIES,
) = range(32)  # fmt: skip
"""Columns of the tallies, from which the metrics follow."""


class MetricParameters(NamedTuple):
    """What the kernels need of CorridorConfig, in its units."""

    dt: float
    robot_radius: float
    human_radius: float
    goal_radius: float
    personal_space: float


def metric_parameters(config: CorridorConfig) -> MetricParameters:
    """Pick the kernels' parameters from the config."""
    return MetricParameters(
        config.dt,
        config.robot_radius,
        config.human_radius,
        config.goal_radius,
        config.personal_space,
    )


@kernel
def metrics_from(row: FloatArray) -> MetricParameters:
    """The parameters from a row of numbers, which takes a kernel call a fraction of the time."""
    return MetricParameters(
        row[0],
        row[1],
        row[2],
        row[3],
        row[4],
    )


@kernel
def _norm(z: float, x: float) -> float:
    """Length of a vector; `math.hypot` guards against overflow, which takes three times as long."""
    return math.sqrt(z * z + x * x)


@kernel
def time_to_touch(dz: float, dx: float, vz: float, vx: float, reach: float) -> float:
    """Time [s] until two discs touch at constant velocities, TIME_HORIZON if they do not.

    Args:
        dz: From one centre to the other, along z [m].
        dx: The same across [m].
        vz: The other's velocity relative to the first [m/s].
        vx: The same across [m/s].
        reach: Sum of the radii [m].
    """
    gap = dz * dz + dx * dx - reach * reach
    closing = dz * vz + dx * vx
    if gap <= 0.0:
        return 0.0
    if closing >= 0.0:
        return TIME_HORIZON
    speed = vz * vz + vx * vx
    under_root = closing * closing - speed * gap
    if under_root < 0.0:
        return TIME_HORIZON
    return min(TIME_HORIZON, gap / (-closing + math.sqrt(under_root)))


@kernel
def start_tallies(body: FloatArray, way: float, parameters: FloatArray, tally: FloatArray) -> None:
    """Begin an episode.

    Args:
        body: (6,) the robot.
        way: Length of the shortest way to the end goal's centre [m].
        parameters: Row of MetricParameters.
        tally: (NUM_TALLIES,) written.
    """
    p = metrics_from(parameters)
    tally[:] = 0.0
    tally[NEAREST] = NO_ONE
    tally[TTC] = TIME_HORIZON
    tally[GOAL_STEPS] = -1.0
    tally[STRAIGHT] = max(way - p.goal_radius, 0.0)
    tally[LAST_Z], tally[LAST_X], tally[LAST_ANGLE] = body[0], body[1], body[2]
    tally[LAST_VZ], tally[LAST_VX] = body[3], body[4]


@kernel
def count_step(
    bodies: FloatArray,
    flags: BoolArray,
    contacts: BoolArray,
    collided: BoolArray,
    parameters: FloatArray,
    tallies: FloatArray,
) -> None:
    """Add one step to the tallies of N corridors.

    Args:
        bodies: (N, 1 + H, 6) z, x, angle, velocity z, x, angular after the step; robot first.
        flags: (N, 2) collected, reached.
        contacts: (N, 2) the robot touched a person, a wall, in this step.
        collided: (N,) a new collision happened.
        parameters: Row of MetricParameters.
        tallies: (N, NUM_TALLIES) updated.
    """
    p = metrics_from(parameters)
    reach = p.robot_radius + p.human_radius
    for n in range(bodies.shape[0]):
        tally = tallies[n]
        z, x, angle = bodies[n, 0, 0], bodies[n, 0, 1], bodies[n, 0, 2]
        vz, vx = bodies[n, 0, 3], bodies[n, 0, 4]
        tally[STEPS] += 1.0
        tally[HUMAN_CONTACT] += 1.0 if contacts[n, 0] else 0.0
        tally[WALL_CONTACT] += 1.0 if contacts[n, 1] else 0.0
        tally[COLLISIONS] += 1.0 if collided[n] else 0.0

        nearest = NO_ONE
        for h in range(1, bodies.shape[1]):
            dz, dx = bodies[n, h, 0] - z, bodies[n, h, 1] - x
            nearest = min(nearest, _norm(dz, dx) - reach)
            touch = time_to_touch(dz, dx, bodies[n, h, 3] - vz, bodies[n, h, 4] - vx, reach)
            tally[TTC] = min(tally[TTC], touch)
        tally[NEAREST] = min(tally[NEAREST], max(nearest, 0.0))
        tally[INTRUDED] += 1.0 if nearest < p.personal_space else 0.0
        if nearest < INTIMATE:
            tally[INTIMATE_STEPS] += 1.0
        elif nearest < PERSONAL:
            tally[PERSONAL_STEPS] += 1.0
        elif nearest < SOCIAL:
            tally[SOCIAL_STEPS] += 1.0

        speed = _norm(vz, vx)
        az, ax = (vz - tally[LAST_VZ]) / p.dt, (vx - tally[LAST_VX]) / p.dt
        acceleration = _norm(az, ax)
        tally[UNBROKEN] += 1.0
        jerk = 0.0
        if tally[UNBROKEN] > 1.5:  # else the acceleration before this one is not known
            jerk = _norm(az - tally[LAST_AZ], ax - tally[LAST_AX]) / p.dt
            tally[JERKS] += 1.0
        tally[PATH] += _norm(z - tally[LAST_Z], x - tally[LAST_X])
        if flags[n, 1] and tally[GOAL_STEPS] < 0.0:
            tally[GOAL_STEPS] = tally[STEPS]
            tally[PATH_TO_GOAL] = tally[PATH]
        tally[STALLED] += p.dt if speed < STALLED_SPEED else 0.0
        tally[SPEED_SUM] += speed
        tally[SPEED_MAX] = max(tally[SPEED_MAX], speed)
        tally[ACC_SUM] += acceleration
        tally[ACC_MAX] = max(tally[ACC_MAX], acceleration)
        tally[JERK_SUM] += jerk
        tally[JERK_MAX] = max(tally[JERK_MAX], jerk)
        tally[TURNED] += abs(angle - tally[LAST_ANGLE])
        tally[LAST_Z], tally[LAST_X], tally[LAST_ANGLE] = z, x, angle
        tally[LAST_VZ], tally[LAST_VX], tally[LAST_AZ], tally[LAST_AX] = vz, vx, az, ax


@kernel
def summarise(
    tallies: FloatArray, flags: BoolArray, parameters: FloatArray, out: FloatArray
) -> None:
    """Write the metrics of N corridors, in the order of METRICS.

    Args:
        tallies: (N, NUM_TALLIES).
        flags: (N, 2) collected, reached.
        parameters: Row of MetricParameters.
        out: (N, len(METRICS)) written.
    """
    p = metrics_from(parameters)
    for n in range(tallies.shape[0]):
        tally = tallies[n]
        row = out[n]
        steps = max(tally[STEPS], 1.0)
        row[0] = 1.0 if flags[n, 1] else 0.0
        row[1] = 1.0 if flags[n, 0] else 0.0
        row[2] = tally[COLLISIONS]
        row[3] = tally[HUMAN_CONTACT]
        row[4] = tally[WALL_CONTACT]
        row[5] = p.dt * (tally[GOAL_STEPS] if flags[n, 1] else tally[STEPS])
        row[6] = tally[PATH]
        longest = max(tally[PATH_TO_GOAL], tally[STRAIGHT])
        row[7] = row[0] * tally[STRAIGHT] / longest if longest > 0.0 else row[0]
        row[8] = tally[STALLED]
        row[9] = tally[NEAREST]
        row[10] = 1.0 - tally[INTRUDED] / steps
        row[11] = tally[TTC]
        row[12] = tally[SPEED_SUM] / steps
        row[13] = tally[SPEED_MAX]
        row[14] = tally[ACC_SUM] / steps
        row[15] = tally[ACC_MAX]
        row[16] = tally[JERK_SUM] / max(tally[JERKS], 1.0)
        row[17] = tally[JERK_MAX]
        row[18] = tally[TURNED] / tally[PATH] if tally[PATH] > NO_PATH else 0.0
        row[19] = tally[INTIMATE_STEPS] / steps
        row[20] = tally[PERSONAL_STEPS] / steps
        row[21] = tally[SOCIAL_STEPS] / steps
        row[22] = 1.0 - row[19] - row[20] - row[21]
