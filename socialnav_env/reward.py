"""The true reward: a sum of named terms."""

from __future__ import annotations

import math
from typing import NamedTuple

from socialnav_env.config import DOORWAY_WALL, CorridorConfig
from socialnav_env.kernels import BoolArray, FloatArray, IntArray, kernel

TERMS = (
    "reward_goal",
    "reward_intermittent",
    "reward_collision",
    "reward_proximity",
    "reward_progress",
    "reward_control",
)
"""Columns of the reward array, and their keys in `info`."""


class RewardParameters(NamedTuple):
    """What the kernels need of CorridorConfig, in its units."""

    robot_radius: float
    human_radius: float
    intermittent_radius: float
    goal_radius: float
    goal_reward: float
    intermittent_reward: float
    collision_penalty: float
    contact_penalty: float
    memory_steps: float
    proximity_penalty: float
    personal_space: float
    progress_weight: float
    control_penalty: float
    terminate_on_goal: float
    terminate_on_collision: float
    doorway_z: float
    door_free: float


def reward_parameters(config: CorridorConfig) -> RewardParameters:
    """Pick the kernels' parameters from the config."""
    derived = {
        "memory_steps": round(config.contact_memory / config.dt),
        "door_free": config.jamb - 0.5 * DOORWAY_WALL - config.robot_radius,
    }
    names = [name for name in RewardParameters._fields if name not in derived]
    return RewardParameters(**derived, **{name: getattr(config, name) for name in names})


@kernel
def rewards_from(row: FloatArray) -> RewardParameters:
    """The parameters from a row of numbers, which takes a kernel call a fraction of the time."""
    return RewardParameters(
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
        row[16],
    )


@kernel
def _norm(z: float, x: float) -> float:
    """Length of a vector; `math.hypot` guards against overflow, which takes three times as long."""
    return math.sqrt(z * z + x * x)


@kernel
def way(z: float, x: float, to_z: float, to_x: float, p: RewardParameters) -> float:
    """Length [m] of the shortest way for the robot's centre, people left aside.

    Straight, or through the doorway where a wall lies between; the corners of its jambs are taken
    to be sharp, and the wall to be thin.

    Args:
        z: From here [m].
        x: The same across [m].
        to_z: To there [m].
        to_x: The same across [m].
        p: Parameters.
    """
    before, behind = p.doorway_z - z, to_z - p.doorway_z
    if p.door_free > 0.0 and before * behind > 0.0:
        crossing = x + (to_x - x) * before / (to_z - z)
        door = min(max(crossing, -p.door_free), p.door_free)
        return _norm(before, door - x) + _norm(behind, to_x - door)
    return _norm(to_z - z, to_x - x)


@kernel
def shortest_way(body: FloatArray, goal: FloatArray, parameters: FloatArray) -> float:
    """The length of `way` from the robot to a goal [m].

    Args:
        body: (6,) the robot.
        goal: (2,) z, x.
        parameters: Row of RewardParameters.
    """
    return way(body[0], body[1], goal[0], goal[1], rewards_from(parameters))


@kernel
def remaining_way(
    body: FloatArray, goals: FloatArray, flags: BoolArray, parameters: FloatArray
) -> float:
    """Metres of the way that are left; minus the potential of `reward_progress`.

    The way leads over the intermittent goal while that one is uncollected and still ahead. A
    function of the state alone, so that the term is potential-based shaping (Ng et al. 1999, with
    discount 1): over an episode it sums to the weight times the metres gained. Whoever passes the
    intermittent goal without collecting it gains the detour that is no longer ahead, at once.

    Args:
        body: (6,) the robot.
        goals: (2, 2) intermittent and end goal, z, x.
        flags: (2,) collected, reached.
        parameters: Row of RewardParameters.
    """
    if flags[1]:
        return 0.0
    p = rewards_from(parameters)
    z, x = body[0], body[1]
    if not flags[0] and z < goals[0, 0]:
        first = way(z, x, goals[0, 0], goals[0, 1], p)
        return first + way(goals[0, 0], goals[0, 1], goals[1, 0], goals[1, 1], p)
    return way(z, x, goals[1, 0], goals[1, 1], p)


@kernel
def effort(action: FloatArray) -> float:
    """Sum of the squared shares of top speed and top turn rate.

    Args:
        action: (2,) of a unicycle or (3,) of a holonomic base, clipped to [-1, 1].
    """
    if action.shape[0] == 3:
        moving: float = min(action[0] ** 2 + action[1] ** 2, 1.0)
        turning: float = action[2] ** 2
    else:
        moving, turning = (0.5 * (action[0] + 1.0)) ** 2, action[1] ** 2
    return moving + turning


@kernel
def proximity_share(distance: float, personal_space: float) -> float:
    """1 at touching distance, falling linearly to 0 at the edge of personal space.

    Args:
        distance: Surface to surface [m].
        personal_space: Its radius, surface to surface [m].
    """
    if distance >= personal_space or personal_space <= 0.0:
        return 0.0
    return 1.0 - max(distance, 0.0) / personal_space


@kernel
def reward(
    bodies: FloatArray,
    goals: FloatArray,
    flags: BoolArray,
    contacts: BoolArray,
    actions: FloatArray,
    contact_free: IntArray,
    remaining: FloatArray,
    parameters: FloatArray,
    terms: FloatArray,
    collided: BoolArray,
    ended: BoolArray,
) -> None:
    """Write the reward terms of N corridors, what was collected, and which episodes end.

    Args:
        bodies: (N, 1 + H, 6) z, x, angle, velocity z, x, angular after the step; robot first.
        goals: (N, 2, 2) intermittent and end goal, z, x.
        flags: (N, 2) collected, reached; updated.
        contacts: (N, 2) the robot touched a person, a wall, in this step.
        actions: (N, 2 or 3) clipped to [-1, 1].
        contact_free: (N, 2) steps since the last contact with a person, a wall; updated.
        remaining: (N,) metres left before the step; updated.
        parameters: Row of RewardParameters.
        terms: (N, 6) written, in the order of TERMS.
        collided: (N,) written: a new collision happened.
        ended: (N,) written: the goal or a collision ends the episode.
    """
    p = rewards_from(parameters)
    for n in range(bodies.shape[0]):
        robot = bodies[n, 0]
        for i in range(terms.shape[1]):
            terms[n, i] = 0.0

        to_goal = way(robot[0], robot[1], goals[n, 1, 0], goals[n, 1, 1], p)
        if not flags[n, 1] and to_goal <= p.goal_radius:
            flags[n, 1] = True
            terms[n, 0] = p.goal_reward
        to_other = way(robot[0], robot[1], goals[n, 0, 0], goals[n, 0, 1], p)
        if not flags[n, 0] and to_other <= p.intermittent_radius:
            flags[n, 0] = True
            terms[n, 1] = p.intermittent_reward

        collided[n] = False
        for kind in range(contacts.shape[1]):  # who leans on a wall can still run into a person
            if contacts[n, kind]:
                collided[n] = collided[n] or contact_free[n, kind] >= p.memory_steps
                contact_free[n, kind] = 0
            else:
                contact_free[n, kind] += 1
        if collided[n]:
            terms[n, 2] = -p.collision_penalty
        elif contacts[n, 0] or contacts[n, 1]:
            terms[n, 2] = -p.contact_penalty

        for h in range(1, bodies.shape[1]):
            centres = _norm(bodies[n, h, 0] - robot[0], bodies[n, h, 1] - robot[1])
            gap = centres - p.robot_radius - p.human_radius
            terms[n, 3] -= p.proximity_penalty * proximity_share(gap, p.personal_space)

        left = remaining_way(robot, goals[n], flags[n], parameters)
        terms[n, 4] = p.progress_weight * (remaining[n] - left)
        remaining[n] = left
        terms[n, 5] = -p.control_penalty * effort(actions[n])
        at_goal = p.terminate_on_goal > 0.0 and flags[n, 1]
        ended[n] = at_goal or (p.terminate_on_collision > 0.0 and collided[n])
