"""The state of N corridors: everything that the next step depends on, as arrays."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from socialnav_env.config import CorridorConfig
from socialnav_env.kernels import BoolArray, FloatArray, IntArray
from socialnav_env.layout import Layout
from socialnav_env.metrics import NUM_TALLIES, STALLED_SPEED
from socialnav_env.people import PeopleParameters
from socialnav_env.robot import action_size
from socialnav_env.start import NUM_WAYPOINTS

LONG_AGO = 1_000_000
"""`contact_free` at the start of an episode: the first contact is a collision."""


@dataclass
class State:
    """Arrays with a leading corridor axis; positions are (z, x) in metres.

    Attributes:
        bodies: (N, 1 + H, 6) z, x, angle, velocity z, x, angular; the robot first.
        start: (N, 1 + H, 6) the bodies at the episode's start.
        goals: (N, 2, 2) intermittent goal, end goal.
        flags: (N, 2) collected, reached.
        waypoints: (N, H, K, 2) where each person walks in turn.
        waypoint: (N, H) index of the current waypoint.
        waypoint_age: (N, H) seconds of patience that it has cost.
        speeds: (N, H) preferred speeds [m/s].
        sides: (N, H) lean of the evasion [rad].
        waits: (N, H) who stands at the waypoint until patience is out.
        people_parameters: (N, P) rows of `people.PeopleParameters`, drawn with the episode.
        contact_free: (N, 2) steps since the robot's last contact with a person, a wall.
        remaining: (N,) metres of the way that are left.
        tallies: (N, NUM_TALLIES) from which the metrics follow.
        time: (N,) seconds since the episode's start.
        control: (N, 2 or 3) the last action.
    """

    bodies: FloatArray
    start: FloatArray
    goals: FloatArray
    flags: BoolArray
    waypoints: FloatArray
    waypoint: IntArray
    waypoint_age: FloatArray
    speeds: FloatArray
    sides: FloatArray
    waits: BoolArray
    people_parameters: FloatArray
    contact_free: IntArray
    remaining: FloatArray
    tallies: FloatArray
    time: FloatArray
    control: FloatArray

    @classmethod
    def empty(cls, config: CorridorConfig, count: int) -> State:
        """Zeros for `count` corridors."""
        people = config.num_humans
        return cls(
            bodies=np.zeros((count, 1 + people, 6)),
            start=np.zeros((count, 1 + people, 6)),
            goals=np.zeros((count, 2, 2)),
            flags=np.zeros((count, 2), dtype=np.bool_),
            waypoints=np.zeros((count, people, NUM_WAYPOINTS, 2)),
            waypoint=np.zeros((count, people), dtype=np.int64),
            waypoint_age=np.zeros((count, people)),
            speeds=np.zeros((count, people)),
            sides=np.zeros((count, people)),
            waits=np.zeros((count, people), dtype=np.bool_),
            people_parameters=np.zeros((count, len(PeopleParameters._fields))),
            contact_free=np.zeros((count, 2), dtype=np.int64),
            remaining=np.zeros(count),
            tallies=np.zeros((count, NUM_TALLIES)),
            time=np.zeros(count),
            control=np.zeros((count, action_size(config))),
        )

    def begin(self, n: int, layout: Layout) -> None:
        """Put corridor `n` at the start of an episode; tallies and way are the world's to set."""
        self.bodies[n] = 0.0
        self.bodies[n, 0, :3] = layout.robot
        self.bodies[n, 1:, :2] = layout.people[:, :2]
        self.bodies[n, 1:, 2] = layout.facings
        self.bodies[n, 1:, 3:5] = layout.people[:, 2:]
        self.start[n] = self.bodies[n]
        self.goals[n] = layout.goals
        self.flags[n] = False
        self.waypoints[n] = layout.waypoints
        self.waypoint[n] = 0
        self.waypoint_age[n] = 0.0
        self.speeds[n] = layout.speeds
        self.sides[n] = layout.sides
        self.waits[n] = layout.waits
        self.contact_free[n] = LONG_AGO
        self.time[n] = 0.0
        self.control[n] = 0.0

    def copy(self) -> State:
        """An independent copy."""
        arrays = {item.name: getattr(self, item.name).copy() for item in dataclasses.fields(self)}
        return State(**arrays)

    def assign(self, other: State) -> None:
        """Take over another state's values, in place.

        Raises:
            ValueError: The other state is for another number of corridors or people.
        """
        for item in dataclasses.fields(self):
            mine, theirs = getattr(self, item.name), getattr(other, item.name)
            if mine.shape != theirs.shape:
                raise ValueError(f"{item.name}: expected shape {mine.shape}, got {theirs.shape}")
        for item in dataclasses.fields(self):
            getattr(self, item.name)[...] = getattr(other, item.name)

    def scene_rows(self) -> FloatArray:
        """(N, 9 + 5 H) what a picture needs, so that clips are stored as numbers.

        Columns: robot x, z, heading; collected, reached; intermittent goal x, z; end goal x, z;
        then each person's x, z, heading and velocity x, z. Who walks looks ahead.
        """
        count = len(self.bodies)
        people = self.bodies[:, 1:, [1, 0, 2, 4, 3]]
        vx, vz = people[..., 3], people[..., 4]
        people[..., 2] = np.where(
            np.hypot(vx, vz) >= STALLED_SPEED, np.arctan2(vx, vz), people[..., 2]
        )
        return np.concatenate(
            [
                self.bodies[:, 0, [1, 0, 2]],
                self.flags,
                self.goals[:, :, ::-1].reshape(count, 4),
                people.reshape(count, -1),
            ],
            axis=1,
        )
