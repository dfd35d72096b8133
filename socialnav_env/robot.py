"""How the robot takes an action: a unicycle, or a base that moves in any direction."""

from __future__ import annotations

import math

from socialnav_env.config import CorridorConfig
from socialnav_env.kernels import FloatArray, kernel


def action_size(config: CorridorConfig) -> int:
    """Length of an action: 2 for a unicycle, 3 for a holonomic base."""
    return 3 if config.action == "holonomic" else 2


@kernel
def drive(
    actions: FloatArray,
    bodies: FloatArray,
    speed: float,
    turn_rate: float,
    clipped: FloatArray,
    commands: FloatArray,
) -> None:
    """Write the robots' next velocities.

    Args:
        actions: (N, 2) forward and turn, or (N, 3) ahead, left and turn; meant in [-1, 1].
        bodies: (N, 1 + H, 6) z, x, angle, velocity z, x, angular; the robot first.
        speed: Forward maps [-1, 1] to [0, speed] in m/s; ahead and left map [-1, 1] to
            [-speed, speed], and both together are no faster than speed either.
        turn_rate: Turn maps [-1, 1] to [-turn_rate, turn_rate] in rad/s.
        clipped: (N, 2 or 3) written: the actions in [-1, 1].
        commands: (N, 1 + H, 3) velocity z, x and angular; row 0 is written.
    """
    last = actions.shape[1] - 1
    for n in range(actions.shape[0]):
        for i in range(actions.shape[1]):
            clipped[n, i] = min(max(actions[n, i], -1.0), 1.0)
        if last == 2:
            ahead, left = speed * clipped[n, 0], speed * clipped[n, 1]
            faster = math.sqrt(ahead * ahead + left * left) / speed
            if faster > 1.0:
                ahead, left = ahead / faster, left / faster
        else:
            ahead, left = 0.5 * (clipped[n, 0] + 1.0) * speed, 0.0
        cos, sin = math.cos(bodies[n, 0, 2]), math.sin(bodies[n, 0, 2])
        commands[n, 0, 0] = ahead * cos - left * sin
        commands[n, 0, 1] = ahead * sin + left * cos
        commands[n, 0, 2] = clipped[n, last] * turn_rate
