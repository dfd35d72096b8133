"""How the robot takes an action: a unicycle with commanded velocities."""

from __future__ import annotations

import math

from socialnav_env.kernels import FloatArray, kernel


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
        actions: (N, 2) forward and turn, meant in [-1, 1].
        bodies: (N, 1 + H, 6) z, x, angle, velocity z, x, angular; the robot first.
        speed: Action 0 maps [-1, 1] to [0, speed] in m/s.
        turn_rate: Action 1 maps [-1, 1] to [-turn_rate, turn_rate] in rad/s.
        clipped: (N, 2) written: the actions in [-1, 1].
        commands: (N, 1 + H, 3) velocity z, x and angular; row 0 is written.
    """
    for n in range(actions.shape[0]):
        clipped[n, 0] = min(max(actions[n, 0], -1.0), 1.0)
        clipped[n, 1] = min(max(actions[n, 1], -1.0), 1.0)
        forward = 0.5 * (clipped[n, 0] + 1.0) * speed
        commands[n, 0, 0] = forward * math.cos(bodies[n, 0, 2])
        commands[n, 0, 1] = forward * math.sin(bodies[n, 0, 2])
        commands[n, 0, 2] = clipped[n, 1] * turn_rate
