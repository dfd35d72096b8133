"""N corridors as arrays: begin an episode, step, get and set the state."""

from __future__ import annotations

import numpy as np

from socialnav_env.config import CorridorConfig
from socialnav_env.kernels import FloatArray
from socialnav_env.layout import draw_layout
from socialnav_env.metrics import (
    LAST_ANGLE,
    LAST_AX,
    LAST_AZ,
    LAST_VX,
    LAST_VZ,
    LAST_X,
    LAST_Z,
    METRICS,
    count_step,
    metric_parameters,
    start_tallies,
    summarise,
)
from socialnav_env.observation import observation_bounds, observation_parameters, observe
from socialnav_env.people import people_parameters, walk
from socialnav_env.physics import Physics
from socialnav_env.reward import TERMS, remaining_way, reward, reward_parameters
from socialnav_env.robot import drive
from socialnav_env.state import State


class World:
    """A world of N corridors; the single env is a world of one.

    Attributes:
        config: The constants.
        count: N.
        state: Everything that the next step depends on.
        terms: (N, 6) reward terms of the last step, in the order of `reward.TERMS`.
        metrics: (N, len(METRICS)) the episodes' metrics so far.
        contacts: (N, 2) the robot touched a person, a wall, in the last step.
        collided: (N,) a collision happened in the last step.
        ended: (N,) the episode ended in the last step, by goal or collision.
        low: (n,) bounds of the observation.
        high: (n,) bounds of the observation.
    """

    def __init__(self, config: CorridorConfig, count: int) -> None:
        """Build `count` corridors; each must begin an episode before the first step."""
        self.config = config
        self.count = count
        self.state = State.empty(config, count)
        self.terms = np.zeros((count, len(TERMS)))
        self.metrics = np.zeros((count, len(METRICS)))
        self.contacts = np.zeros((count, 2), dtype=np.bool_)
        self.collided = np.zeros(count, dtype=np.bool_)
        self.ended = np.zeros(count, dtype=np.bool_)
        self.low, self.high = observation_bounds(config)
        self._physics = Physics(config, count)
        # A call of a kernel costs more time than its arithmetic, and the less the fewer its
        # arguments: hence rows of numbers, and `step` calls each kernel once.
        self._people = np.array(people_parameters(config))
        self._observation = np.array(observation_parameters(config))
        self._reward = np.array(reward_parameters(config))
        self._metrics = np.array(metric_parameters(config))

    def begin(self, n: int, rng: np.random.Generator) -> None:
        """Begin an episode in corridor `n`.

        Raises:
            ConfigError: The corridor is too small for its people.
        """
        state = self.state
        state.begin(n, draw_layout(self.config, rng))
        state.remaining[n] = remaining_way(state.bodies[n, 0], state.goals[n], state.flags[n])
        start_tallies(state.bodies[n, 0], state.goals[n, 1], self._metrics, state.tallies[n])
        self._physics.place(n, state.bodies[n])
        self.terms[n] = 0.0
        self.contacts[n] = self.collided[n] = self.ended[n] = False
        one = slice(n, n + 1)
        summarise(state.tallies[one], state.flags[one], self._metrics, self.metrics[one])

    def step(self, actions: FloatArray) -> FloatArray:
        """Advance all corridors by one env step and score it.

        Args:
            actions: (N, 2) forward and turn; clipped to [-1, 1].

        Returns:
            (N, n) a fresh array of observations.
        """
        self.simulate(actions, self.config.frame_skip)
        self._score()
        return self.observe()

    def simulate(self, actions: FloatArray, frames: int) -> None:
        """Let robots act and people walk for `frames` physics steps."""
        state, config, commands = self.state, self.config, self._physics.commands
        drive(
            actions,
            state.bodies,
            config.robot_speed,
            config.robot_turn_rate,
            state.control,
            commands,
        )
        walk(
            state.bodies,
            state.waypoints,
            state.waypoint,
            state.waypoint_age,
            state.speeds,
            state.sides,
            self._people,
            commands,
        )
        self._physics.step(frames, state.bodies, self.contacts, state.time)

    def _score(self) -> None:
        """Write the reward terms of what just happened and count it in the metrics."""
        state = self.state
        reward(
            state.bodies,
            state.goals,
            state.flags,
            self.contacts,
            state.control,
            state.contact_free,
            state.remaining,
            self._reward,
            self.terms,
            self.collided,
            self.ended,
        )
        count_step(
            state.bodies, state.flags, self.contacts, self.collided, self._metrics, state.tallies
        )
        summarise(state.tallies, state.flags, self._metrics, self.metrics)

    def observe(self) -> FloatArray:
        """(N, n) a fresh array of observations."""
        out = np.empty((self.count, len(self.low)))
        state = self.state
        observe(state.bodies, state.goals, state.flags, self.low, self.high, self._observation, out)
        return out

    def place(self, n: int, bodies: FloatArray) -> None:
        """Put the bodies of corridor `n` somewhere; what was collected and counted stays.

        Args:
            n: The corridor.
            bodies: (1 + H, 6) z, x, angle, velocity z, x, angular; the robot first.
        """
        state = self.state
        state.bodies[n] = bodies
        self._physics.place(n, bodies)
        # A jump is no progress and no path.
        state.remaining[n] = remaining_way(state.bodies[n, 0], state.goals[n], state.flags[n])
        tally = state.tallies[n]
        tally[[LAST_Z, LAST_X, LAST_ANGLE, LAST_VZ, LAST_VX]] = bodies[0, :5]
        tally[[LAST_AZ, LAST_AX]] = 0.0

    def restore(self, state: State) -> None:
        """Continue from a copied state.

        Raises:
            ValueError: The state is for another number of corridors or people.
        """
        self.state.assign(state)
        for n in range(self.count):
            self._physics.place(n, state.bodies[n])
