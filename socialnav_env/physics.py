"""The bodies, shapes and walls of N corridors in one pymunk Space."""

from __future__ import annotations

import math

import numpy as np
import pymunk
from pymunk import batch

from socialnav_env.chipmunk import Transfer, stepper
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
_DRIVE = batch.BodyFields.ANGULAR_VELOCITY | batch.BodyFields.FORCE
_PAIR = batch.ArbiterFields.BODY_A_ID | batch.ArbiterFields.BODY_B_ID


@kernel
def push(
    bodies: FloatArray, commands: FloatArray, masses: FloatArray, timestep: float, out: FloatArray
) -> None:
    """Write the forces that take each body from its velocity to the commanded one in one step.

    Forces, not velocities: pymunk moves bodies before it looks for contacts, so that a velocity
    set from outside would press them into each other, at one physics step per env step through
    each other. A force counts only after that, together with the contacts.

    Args:
        bodies: (N, B, 6) z, x, angle, velocity z, x, angular.
        commands: (N, B, 3) wanted velocity z, x and angular.
        masses: (B,) [kg].
        timestep: One physics step [s].
        out: (N * B or more, 3) written: turn rate [rad/s], force z and x [N].
    """
    for n in range(bodies.shape[0]):
        for i in range(bodies.shape[1]):
            row = out[n * bodies.shape[1] + i]
            row[0] = commands[n, i, 2]
            row[1] = masses[i] * (commands[n, i, 0] - bodies[n, i, 3]) / timestep
            row[2] = masses[i] * (commands[n, i, 1] - bodies[n, i, 4]) / timestep


@kernel
def can_touch(
    bodies: FloatArray, commands: FloatArray, radii: FloatArray, edges: FloatArray, seconds: float
) -> bool:
    """Whether any two bodies, or a body and a wall, could meet within a time.

    Args:
        bodies: (N, B, 6) z, x, angle, velocity z, x, angular.
        commands: (N, B, 3) wanted velocity z, x and angular.
        radii: (B,) [m].
        edges: (2,) half length and half width of the corridor [m].
        seconds: The time [s].
    """
    for n in range(bodies.shape[0]):
        for i in range(bodies.shape[1]):
            z, x = bodies[n, i, 0], bodies[n, i, 1]
            reach = radii[i] + seconds * _top_speed(bodies, commands, n, i) + 0.01
            if min(edges[0] - abs(z), edges[1] - abs(x)) < reach:
                return True
            for k in range(i):
                theirs = radii[k] + seconds * _top_speed(bodies, commands, n, k)
                if math.hypot(bodies[n, k, 0] - z, bodies[n, k, 1] - x) < reach + theirs:
                    return True
    return False


@kernel
def _top_speed(bodies: FloatArray, commands: FloatArray, n: int, i: int) -> float:
    """The larger of a body's speeds now and to come [m/s]."""
    now = math.hypot(bodies[n, i, 3], bodies[n, i, 4])
    return max(now, math.hypot(commands[n, i, 0], commands[n, i, 1]))


@kernel
def prepare(
    bodies: FloatArray,
    commands: FloatArray,
    masses: FloatArray,
    radii: FloatArray,
    edges: FloatArray,
    frames: int,
    timestep: float,
    drive: FloatArray,
    contacts: BoolArray,
    time: FloatArray,
) -> bool:
    """Make ready for a step: forces, no contacts yet, the clock; see `push` and `can_touch`.

    Returns:
        Whether anybody can touch anything within the step.
    """
    push(bodies, commands, masses, timestep, drive)
    contacts[:] = False
    time += frames * timestep
    return can_touch(bodies, commands, radii, edges, frames * timestep)


class Physics:
    """Moves the bodies of N corridors that lie side by side in one Space.

    Along the Space's x axis runs the corridor's z, along its y axis the corridor's x. A single
    corridor has offset 0, so nothing is rounded on the way in and out.

    Attributes:
        commands: (N, 1 + H, 3) velocity z, x and angular that the next step shall bring about.
    """

    def __init__(self, config: CorridorConfig, count: int) -> None:
        """Build the Space.

        Args:
            config: Sizes and masses.
            count: Number of corridors.
        """
        self._config = config
        self._timestep = config.timestep
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
        moving = count * per_corridor
        state, self._drive = np.zeros((moving + 2, 6)), np.zeros((moving + 2, 3))
        self._read_state = Transfer(self._space, _STATE, state).read
        self._write_drive = Transfer(self._space, _DRIVE, self._drive).write
        self._moved = state[:moving].reshape(count, per_corridor, 6)
        self._advance = stepper(self._space)
        self._contact_buffer = batch.Buffer()
        self._masses = np.array([config.robot_mass] + [config.human_mass] * config.num_humans)
        self._radii = np.array([config.robot_radius] + [config.human_radius] * config.num_humans)
        self._edges = np.array([config.half_length, config.half_width])
        self.commands = np.zeros((count, per_corridor, 3))

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

    def step(self, frames: int, bodies: FloatArray, contacts: BoolArray, time: FloatArray) -> None:
        """Drive the bodies to the commanded velocities in `frames` physics steps.

        They take them up in the first one, and move with them from the second one on.

        Args:
            frames: Number of physics steps.
            bodies: (N, 1 + H, 6) the bodies before; overwritten with the bodies after.
            contacts: (N, 2) written: the robot touched a person, a wall.
            time: (N,) seconds since the episode's start; updated.
        """
        timestep = self._timestep
        near = prepare(
            bodies,
            self.commands,
            self._masses,
            self._radii,
            self._edges,
            frames,
            timestep,
            self._drive,
            contacts,
            time,
        )
        self._write_drive()
        touching = False
        for _ in range(frames):
            self._advance(timestep)
            if near:
                touching = self._read_contacts(contacts)
        if touching:
            self._forget_contacts()
        self._read_state()
        bodies[...] = self._moved
        if len(bodies) > 1:
            bodies[..., 1] -= self._offsets[:, None]

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
        self._advance(PURGE_TIME)
        self._space.collision_persistence = 1
