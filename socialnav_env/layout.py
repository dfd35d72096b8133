"""Where an episode starts: poses of robot and people, goals, and the way people will walk."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from socialnav_env.config import CorridorConfig
from socialnav_env.kernels import BoolArray, FloatArray
from socialnav_env.standing import STANDING, draw_formation, no_room
from socialnav_env.start import NUM_WAYPOINTS, draw_start, start_parameters

STARTS = 50
"""Whole starts to draw before a corridor is found too small: the robot or the first people may
block it."""
DOWN_THE_CORRIDOR = math.pi
"""Facing of a walking person who has been stopped [rad]."""


@dataclass(frozen=True)
class Layout:
    """One corridor at the start of an episode; positions are (z, x) in metres.

    Attributes:
        robot: (3,) z, x, heading.
        goals: (2, 2) the intermittent goal, the end goal.
        people: (H, 4) z, x and velocity.
        waypoints: (H, K, 2) where each person goes in turn.
        speeds: (H,) preferred speeds [m/s].
        sides: (H,) angle by which a person's evasion leans to one side [rad], so that two who
            meet exactly head-on do not stop (the social force alone has no sideways part there).
        waits: (H,) who stands at a waypoint until patience is out.
        facings: (H,) where each person looks when standing [rad].
    """

    robot: FloatArray
    goals: FloatArray
    people: FloatArray
    waypoints: FloatArray
    speeds: FloatArray
    sides: FloatArray
    waits: BoolArray
    facings: FloatArray


def draw_layout(config: CorridorConfig, rng: np.random.Generator) -> Layout:
    """Draw a start for one corridor.

    Raises:
        ConfigError: The corridor is too small for its people.
    """
    count = config.num_humans
    layout = Layout(
        robot=np.empty(3),
        goals=np.empty((2, 2)),
        people=np.zeros((count, 4)),
        waypoints=np.empty((count, NUM_WAYPOINTS, 2)),
        speeds=np.empty(count),
        sides=np.empty(count),
        waits=np.zeros(count, dtype=np.bool_),
        facings=np.full(count, DOWN_THE_CORRIDOR),
    )
    stand = count > 0 and config.walking in STANDING
    for _ in range(STARTS):
        fits = draw_start(
            start_parameters(config),
            rng,
            layout.robot,
            layout.goals,
            layout.people,
            layout.waypoints,
            layout.speeds,
            layout.sides,
        )
        if stand:
            fits = _stand(layout, config, rng)
        if fits:
            return layout
    raise no_room(config)


def _stand(layout: Layout, config: CorridorConfig, rng: np.random.Generator) -> bool:
    """Let the people stand instead of walking; False if the robot is in the way."""
    formation = draw_formation(config, layout.robot[:2], rng)
    if formation is None:
        return False
    layout.waypoints[:] = formation.waypoints
    layout.people[:, :2], layout.people[:, 2:] = formation.waypoints[:, 0], 0.0
    layout.waits[:], layout.facings[:] = True, formation.facings
    return True
