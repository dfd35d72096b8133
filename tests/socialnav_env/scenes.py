"""Corridors with everybody where a test wants them."""

import numpy as np

from socialnav_env.config import CorridorConfig
from socialnav_env.world import World


def bodies_of(robot, people=()):
    """(1, 1 + H, 6) from rows z, x, angle, velocity z, x, angular; missing entries are 0."""
    bodies = np.zeros((1, 1 + len(people), 6))
    for row, values in zip(bodies[0], [robot, *people], strict=True):
        row[: len(values)] = values
    return bodies


def world_with(robot, people=(), goals=((-2.5, 0.0), (12.0, 0.0)), **settings):
    """A world of one; positions are z, x."""
    world = World(CorridorConfig(num_humans=len(people), **settings), 1)
    world.begin(0, np.random.default_rng(0))
    world.state.goals[0] = goals
    world.place(0, bodies_of(robot, people)[0])
    return world


STAND, FORWARD = np.array([[-1.0, 0.0]]), np.array([[1.0, 0.0]])
