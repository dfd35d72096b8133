"""How bodies move: freely by a kernel, through pymunk where anybody could touch anything."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pymunk
from pymunk import batch

from socialnav_env.chipmunk import Contacts, Transfer, forgetter, stepper
from socialnav_env.config import DOORWAY_WALL, OUTER_WALL, CorridorConfig
from socialnav_env.kernels import BoolArray, FloatArray, kernel

CELL, CELLS = 2.0, 100
"""Spatial hash: pairs are found in an order that does not depend on what happened before, which
the default tree cannot promise and exact restore needs."""
PERSON, SURFACE = 0, 1
"""Columns of `contacts`: the robot touched a person, a wall."""

_FIELDS = (
    batch.BodyFields.POSITION
    | batch.BodyFields.ANGLE
    | batch.BodyFields.VELOCITY
    | batch.BodyFields.ANGULAR_VELOCITY
    | batch.BodyFields.FORCE
)


class PhysicsParameters(NamedTuple):
    """What the kernels need of CorridorConfig, in its units."""

    timestep: float
    half_length: float
    half_width: float
    doorway_z: float
    jamb: float
    robot_radius: float
    human_radius: float
    robot_mass: float
    human_mass: float


def physics_parameters(config: CorridorConfig) -> PhysicsParameters:
    """Pick the kernels' parameters from the config."""
    return PhysicsParameters(
        config.timestep,
        config.half_length,
        config.half_width,
        config.doorway_z,
        config.jamb,
        config.robot_radius,
        config.human_radius,
        config.robot_mass,
        config.human_mass,
    )


@kernel
def physics_from(row: FloatArray) -> PhysicsParameters:
    """The parameters from a row of numbers, which takes a kernel call a fraction of the time."""
    return PhysicsParameters(row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8])


@kernel
def can_touch(bodies: FloatArray, commands: FloatArray, frames: int, p: PhysicsParameters) -> bool:
    """Whether any two bodies, or a body and a wall, could meet within some physics steps.

    Args:
        bodies: (B, 6) one corridor's z, x, angle, velocity z, x, angular; the robot first.
        commands: (B, 3) wanted velocity z, x and angular.
        frames: Number of physics steps.
        p: Parameters.
    """
    seconds = frames * p.timestep
    for i in range(bodies.shape[0]):
        z, x = bodies[i, 0], bodies[i, 1]
        radius = p.robot_radius if i == 0 else p.human_radius
        reach = radius + seconds * _top_speed(bodies, commands, i) + 0.01
        if min(p.half_length - abs(z), p.half_width - abs(x)) < reach:
            return True
        if p.jamb > 0.0 and abs(z - p.doorway_z) < reach + 0.5 * DOORWAY_WALL:
            across, along = max(p.jamb - abs(x), 0.0), z - p.doorway_z
            edge = reach + 0.5 * DOORWAY_WALL
            if across * across + along * along < edge * edge:
                return True
        for k in range(i):
            theirs = p.robot_radius if k == 0 else p.human_radius
            far = reach + theirs + seconds * _top_speed(bodies, commands, k)
            dz, dx = bodies[k, 0] - z, bodies[k, 1] - x
            if dz * dz + dx * dx < far * far:
                return True
    return False


@kernel
def _top_speed(bodies: FloatArray, commands: FloatArray, i: int) -> float:
    """The larger of a body's speeds now and to come [m/s]."""
    now = bodies[i, 3] * bodies[i, 3] + bodies[i, 4] * bodies[i, 4]
    then = commands[i, 0] * commands[i, 0] + commands[i, 1] * commands[i, 1]
    return math.sqrt(max(now, then))


@kernel
def push(command: float, velocity: float, mass: float, timestep: float) -> float:
    """The force [N] that takes a body from its velocity to the commanded one in one step.

    Forces, not velocities: pymunk moves bodies before it looks for contacts, so that a velocity
    set from outside would press them into each other, at one physics step per env step through
    each other. A force counts only after that, together with the contacts.
    """
    return mass * (command - velocity) / timestep


@kernel
def fly(bodies: FloatArray, commands: FloatArray, frames: int, p: PhysicsParameters) -> None:
    """Move one corridor's bodies as pymunk moves bodies that nothing touches, to the last bit.

    Args:
        bodies: (B, 6) z, x, angle, velocity z, x, angular; changed.
        commands: (B, 3) wanted velocity z, x and angular.
        frames: Number of physics steps.
        p: Parameters.
    """
    step = p.timestep
    for i in range(bodies.shape[0]):
        body, command = bodies[i], commands[i]
        mass = p.robot_mass if i == 0 else p.human_mass
        inverse = 1.0 / mass
        body[5] = command[2]
        for frame in range(frames):
            body[0] += body[3] * step
            body[1] += body[4] * step
            body[2] += body[5] * step
            if frame == 0:
                body[3] += push(command[0], body[3], mass, step) * inverse * step
                body[4] += push(command[1], body[4], mass, step) * inverse * step


@kernel
def move(
    bodies: FloatArray,
    commands: FloatArray,
    frames: int,
    parameters: FloatArray,
    contacts: BoolArray,
    time: FloatArray,
    near: BoolArray,
) -> int:
    """Move the bodies of all corridors in which nobody can touch anything.

    Args:
        bodies: (N, B, 6) z, x, angle, velocity z, x, angular; changed where nobody is near.
        commands: (N, B, 3) wanted velocity z, x and angular.
        frames: Number of physics steps.
        parameters: Row of PhysicsParameters.
        contacts: (N, 2) written: none.
        time: (N,) seconds since the episode's start; updated.
        near: (N,) written: contacts are possible, pymunk must move this corridor.

    Returns:
        How many corridors are left to pymunk.
    """
    p = physics_from(parameters)
    left = 0
    for n in range(bodies.shape[0]):
        contacts[n, 0] = contacts[n, 1] = False
        time[n] += frames * p.timestep
        near[n] = can_touch(bodies[n], commands[n], frames, p)
        if near[n]:
            left += 1
        else:
            fly(bodies[n], commands[n], frames, p)
    return left


@kernel
def load(
    bodies: FloatArray, commands: FloatArray, parameters: FloatArray, rows: FloatArray
) -> None:
    """Write what pymunk is to start one corridor's step from.

    Args:
        bodies: (B, 6) z, x, angle, velocity z, x, angular.
        commands: (B, 3) wanted velocity z, x and angular.
        parameters: Row of PhysicsParameters.
        rows: (B, 8) written: z, x, angle, velocity z, x, angular, force z, x.
    """
    p = physics_from(parameters)
    for i in range(bodies.shape[0]):
        body, command, row = bodies[i], commands[i], rows[i]
        mass = p.robot_mass if i == 0 else p.human_mass
        row[0], row[1], row[2], row[3], row[4] = body[0], body[1], body[2], body[3], body[4]
        row[5] = command[2]
        row[6] = push(command[0], body[3], mass, p.timestep)
        row[7] = push(command[1], body[4], mass, p.timestep)


class Physics:
    """Moves the bodies of N corridors.

    All that a step depends on is in the arrays handed in: one pymunk Space with one corridor's
    bodies serves every corridor in turn and keeps nothing from one call to the next. Hence a
    corridor moves in the same way, to the last bit, alone or among thousands, and in any process.
    The Space's x axis is the corridor's z, its y axis the corridor's x.

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
        self._parameters = np.array(physics_parameters(config))
        self._near = np.zeros(count, dtype=np.bool_)
        self.commands = np.zeros((count, 1 + config.num_humans, 3))
        self._space = pymunk.Space()
        self._space.use_spatial_hash(CELL, CELLS)
        self._space.collision_slop = 0.001
        self._space.collision_persistence = 1
        self._add_walls()
        bodies = self._add_bodies()
        self._kinds = _contact_kinds(bodies, self._space.static_body)
        rows = np.zeros((len(bodies) + 2, 8))
        self._rows = rows[: len(bodies)]
        self._transfer = Transfer(self._space, _FIELDS, rows)
        self._contacts = Contacts(self._space)
        self._advance = stepper(self._space)
        self._forget = forgetter(self._space)

    def __reduce__(self) -> tuple[type[Physics], tuple[CorridorConfig, int]]:
        """Nothing but the sizes: a copy is built anew."""
        return Physics, (self._config, len(self.commands))

    def _add_walls(self) -> None:
        """Add the outer walls, and the wall around a doorway."""
        config, space = self._config, self._space
        half = 0.5 * OUTER_WALL  # the inner face is the corridor's edge
        z, x = config.half_length + half, config.half_width + half
        corners = [(-z, -x), (z, -x), (z, x), (-z, x)]
        walls = [(*ends, half) for ends in zip(corners, corners[1:] + corners[:1], strict=True)]
        if config.doorway_width > 0.0:
            at = config.doorway_z
            for side in (-1.0, 1.0):
                ends = (at, side * config.jamb), (at, side * x)
                walls.append((*ends, 0.5 * DOORWAY_WALL))
        for start, end, radius in walls:
            space.add(pymunk.Segment(space.static_body, start, end, radius))

    def _add_bodies(self) -> list[pymunk.Body]:
        """Add the bodies, the robot first."""
        config = self._config
        sizes = [(config.robot_mass, config.robot_radius)]
        sizes += [(config.human_mass, config.human_radius)] * config.num_humans
        bodies = []
        for mass, radius in sizes:
            body = pymunk.Body(mass, float("inf"))  # discs: contacts push, they do not turn
            self._space.add(body, pymunk.Circle(body, radius))
            bodies.append(body)
        return bodies

    def step(self, frames: int, bodies: FloatArray, contacts: BoolArray, time: FloatArray) -> None:
        """Drive the bodies to the commanded velocities in `frames` physics steps.

        They take them up in the first one, and move with them from the second one on.

        Args:
            frames: Number of physics steps.
            bodies: (N, 1 + H, 6) the bodies before; overwritten with the bodies after.
            contacts: (N, 2) written: the robot touched a person, a wall.
            time: (N,) seconds since the episode's start; updated.
        """
        if move(bodies, self.commands, frames, self._parameters, contacts, time, self._near):
            for n in self._near.nonzero()[0].tolist():
                self._resolve(frames, bodies[n], self.commands[n], contacts[n])

    def _resolve(
        self, frames: int, bodies: FloatArray, commands: FloatArray, contacts: BoolArray
    ) -> None:
        """Let pymunk move one corridor's bodies, who may touch each other and walls."""
        load(bodies, commands, self._parameters, self._rows)
        self._transfer.write()
        touched = False
        for _ in range(frames):
            self._advance(self._config.timestep)
            for pair in self._contacts.pairs():
                touched = True
                kind = self._kinds.get(pair)
                if kind is not None:
                    contacts[kind] = True
        self._transfer.read()
        bodies[...] = self._rows[:, :6]
        if touched:
            self._forget()


def _contact_kinds(bodies: list[pymunk.Body], walls: pymunk.Body) -> dict[tuple[int, int], int]:
    """Pair of `Body.id` -> PERSON or SURFACE, for pairs of which the robot is one."""
    robot, *people = [body.id for body in bodies]
    kinds = {}
    for other, kind in [*((person, PERSON) for person in people), (walls.id, SURFACE)]:
        kinds[robot, other] = kinds[other, robot] = kind
    return kinds
