"""The bodies, shapes and walls of N corridors in one pymunk Space; the only file that knows it."""

from __future__ import annotations

import math

import numpy as np
import pymunk
from pymunk import batch

from socialnav_env.config import CorridorConfig
from socialnav_env.kernels import BoolArray, FloatArray, kernel

GAP = 2.0
"""Free room between neighbouring corridors [m]."""
WALL = 0.5
"""Half the thickness of a wall [m]; its inner face is the corridor's edge."""
CELL, CELLS_PER_CORRIDOR = 2.0, 30
"""Spatial hash: flat cost per corridor, and pairs found in an order that does not depend on what
happened before, which the default tree cannot promise and exact restore needs."""
PURGE_TIME = 1e-9
"""A step this short [s] only serves to forget contacts."""

_STATE = (
    batch.BodyFields.POSITION
    | batch.BodyFields.ANGLE
    | batch.BodyFields.VELOCITY
    | batch.BodyFields.ANGULAR_VELOCITY
)
_VELOCITY = batch.BodyFields.VELOCITY | batch.BodyFields.ANGULAR_VELOCITY
_PAIR = batch.ArbiterFields.BODY_A_ID | batch.ArbiterFields.BODY_B_ID


@kernel
def smallest_gap(
    bodies: FloatArray, half_length: float, half_width: float, robot: float, human: float
) -> float:
    """Smallest surface-to-surface distance [m] between any two bodies or a body and a wall.

    Args:
        bodies: (N, 1 + H, 6) z, x, ...; the robot first.
        half_length: Of the corridor [m].
        half_width: Of the corridor [m].
        robot: The robot's radius [m].
        human: A person's radius [m].
    """
    smallest = half_length
    for n in range(bodies.shape[0]):
        for i in range(bodies.shape[1]):
            z, x = bodies[n, i, 0], bodies[n, i, 1]
            radius = robot if i == 0 else human
            to_wall = min(half_length - abs(z), half_width - abs(x)) - radius
            smallest = min(smallest, to_wall)
            for k in range(i):
                centres = math.hypot(bodies[n, k, 0] - z, bodies[n, k, 1] - x)
                smallest = min(smallest, centres - radius - (robot if k == 0 else human))
    return smallest


class Physics:
    """Moves the bodies of N corridors that lie side by side in one Space.

    Along the Space's x axis runs the corridor's z, along its y axis the corridor's x. A single
    corridor has offset 0, so nothing is rounded on the way in and out.
    """

    def __init__(self, config: CorridorConfig, count: int) -> None:
        """Build the Space.

        Args:
            config: Sizes and masses.
            count: Number of corridors.
        """
        self._config = config
        self._offsets = np.arange(count) * (2.0 * config.half_width + GAP + 4.0 * WALL)
        self._space = pymunk.Space()
        self._space.use_spatial_hash(CELL, CELLS_PER_CORRIDOR * count)
        self._space.collision_slop = 0.001
        self._space.collision_persistence = 1
        self._bodies = [self._add_corridor(offset) for offset in self._offsets]
        self._place_of = {
            body.id: (n, slot)
            for n, bodies in enumerate(self._bodies)
            for slot, body in enumerate(bodies)
        }
        per_corridor = 1 + config.num_humans
        # pymunk's batch functions visit the static body last, hence one row more; and a full
        # buffer makes them reallocate memory that is NumPy's, hence another.
        moving = count * per_corridor
        rows = moving + 2
        self._state = np.zeros((rows, 6))
        self._command = np.zeros((rows, 3))
        self.state = self._state[:moving].reshape(count, per_corridor, 6)
        self.command = self._command[:moving].reshape(count, per_corridor, 3)
        self._state_buffer, self._command_buffer = batch.Buffer(), batch.Buffer()
        self._state_buffer.set_float_buf(self._state)
        self._command_buffer.set_float_buf(self._command)
        self._contact_buffer = batch.Buffer()
        fastest = config.robot_speed + 2.0 * config.human_top_speed
        self._reach = fastest * config.dt + 0.01

    def _add_corridor(self, offset: float) -> list[pymunk.Body]:
        """Add one corridor's walls and bodies; return the bodies, the robot first."""
        config, space = self._config, self._space
        z, x = config.half_length + WALL, config.half_width + WALL
        corners = [(-z, offset - x), (z, offset - x), (z, offset + x), (-z, offset + x)]
        for start, end in zip(corners, corners[1:] + corners[:1], strict=True):
            space.add(pymunk.Segment(space.static_body, start, end, WALL))
        sizes = [(config.robot_mass, config.robot_radius)]
        sizes += [(config.human_mass, config.human_radius)] * config.num_humans
        bodies = []
        for mass, radius in sizes:
            body = pymunk.Body(mass, float("inf"))  # discs: contacts push, they do not turn
            space.add(body, pymunk.Circle(body, radius))
            bodies.append(body)
        return bodies

    def place(self, n: int, bodies: FloatArray) -> None:
        """Put the bodies of corridor `n` where they are said to be.

        Args:
            n: The corridor.
            bodies: (1 + H, 6) z, x, angle, velocity z, x, angular.
        """
        for body, row in zip(self._bodies[n], bodies.tolist(), strict=True):
            body.position = row[0], row[1] + self._offsets[n]
            body.angle = row[2]
            body.velocity = row[3], row[4]
            body.angular_velocity = row[5]

    def step(self, frames: int, bodies: FloatArray, contacts: BoolArray) -> None:
        """Set the commanded velocities, run physics steps, read the bodies back.

        Args:
            frames: Number of physics steps.
            bodies: (N, 1 + H, 6) the bodies before; overwritten with the bodies after.
            contacts: (N, 2) written: the robot touched a person, a wall.
        """
        contacts[...] = False
        batch.set_space_bodies(self._space, _VELOCITY, self._command_buffer)
        watch = len(bodies) > 8 or self._somebody_near(frames, bodies)
        touching = False
        for _ in range(frames):
            self._space.step(self._config.timestep)
            if watch:
                touching = self._read_contacts(contacts)
        if touching:
            self._forget_contacts()
        self._state_buffer.clear()
        batch.get_space_bodies(self._space, _STATE, self._state_buffer)
        bodies[...] = self.state
        if len(bodies) > 1:
            bodies[..., 1] -= self._offsets[:, None]

    def _somebody_near(self, frames: int, bodies: FloatArray) -> bool:
        """Whether any contact is possible in the next `frames` physics steps."""
        c = self._config
        gap = smallest_gap(bodies, c.half_length, c.half_width, c.robot_radius, c.human_radius)
        return gap < self._reach * max(1.0, frames / c.frame_skip)

    def _read_contacts(self, contacts: BoolArray) -> bool:
        """Note the robots' contacts; return whether any two bodies or walls touch at all."""
        self._contact_buffer.clear()
        batch.get_space_arbiters(self._space, _PAIR, self._contact_buffer)
        ids = memoryview(self._contact_buffer.int_buf()).cast("P").tolist()
        for pair in zip(ids[::2], ids[1::2], strict=True):
            places = [self._place_of[key] for key in pair if key in self._place_of]
            robots = [n for n, slot in places if slot == 0]
            if robots:
                contacts[robots[0], 0 if len(places) == 2 else 1] = True
        return bool(ids)

    def _forget_contacts(self) -> None:
        """Drop pymunk's memory of contacts, so that the state is in the arrays alone.

        pymunk starts a lasting contact from its last impulses. They cannot be read or set, so a
        restored corridor would differ from the one it was copied from. With
        `collision_persistence = 0` they are dropped, and contacts do not push at all: hence only
        for one step that is too short to move anybody.
        """
        self._space.collision_persistence = 0
        self._space.step(PURGE_TIME)
        self._space.collision_persistence = 1
