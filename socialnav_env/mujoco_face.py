"""The corridor as a MujocoEnv would show itself: qpos, qvel, ctrl, set_state.

`qpos` is the robot's x, z and heading, then each person's x and z; `qvel` their derivatives.
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
from numpy.typing import ArrayLike

from socialnav_env.kernels import FloatArray
from socialnav_env.robot import action_size
from socialnav_env.world import World


def positions(bodies: FloatArray) -> FloatArray:
    """(3 + 2 H,) qpos of (1 + H, 6) bodies."""
    return np.concatenate([bodies[0, [1, 0, 2]], bodies[1:, [1, 0]].ravel()])


def velocities(bodies: FloatArray) -> FloatArray:
    """(3 + 2 H,) qvel of (1 + H, 6) bodies."""
    return np.concatenate([bodies[0, [4, 3, 5]], bodies[1:, [4, 3]].ravel()])


def bodies_from(qpos: ArrayLike, qvel: ArrayLike, present: FloatArray) -> FloatArray:
    """(1 + H, 6) bodies from qpos and qvel; where standing people look stays as it is at present.

    Raises:
        ValueError: A wrong shape, or a number that is not finite.
    """
    num_humans = len(present) - 1
    size = 3 + 2 * num_humans
    bodies = present.copy()
    for name, values, first in (("qpos", qpos, 0), ("qvel", qvel, 3)):
        row = np.asarray(values, dtype=np.float64)
        if row.shape != (size,):
            raise ValueError(f"{name}: expected shape ({size},), got {row.shape}")
        if not np.isfinite(row).all():
            raise ValueError(f"{name}: expected finite numbers, got {row}")
        bodies[0, [first + 1, first, first + 2]] = row[:3]
        bodies[1:, [first + 1, first]] = row[3:].reshape(num_humans, 2)
    return bodies


class CorridorData:
    """What `mujoco.MjData` would tell: copies of the present state.

    `set_state` moves bodies; writing into `ctrl` is an error, since only a step takes an action.
    """

    def __init__(self, world: World) -> None:
        """Look at a world of one."""
        self._world = world

    @property
    def qpos(self) -> FloatArray:
        """(nq,) positions [m, rad]."""
        return positions(self._world.state.bodies[0])

    @property
    def qvel(self) -> FloatArray:
        """(nv,) velocities [m/s, rad/s]."""
        return velocities(self._world.state.bodies[0])

    @property
    def ctrl(self) -> FloatArray:
        """(nu,) the last action, clipped."""
        control: FloatArray = self._world.state.control[0].copy()
        control.flags.writeable = False
        return control

    @property
    def time(self) -> float:
        """Seconds since the episode's start."""
        return float(self._world.state.time[0])


def corridor_model(world: World) -> SimpleNamespace:
    """What `mujoco.MjModel` would tell: sizes and the physics timestep."""
    size = 3 + 2 * world.config.num_humans
    option = SimpleNamespace(timestep=world.config.timestep)
    return SimpleNamespace(nq=size, nv=size, nu=action_size(world.config), opt=option)
