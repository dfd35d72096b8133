"""N corridors as arrays: begin an episode, step, get and set the state."""

from __future__ import annotations

import numpy as np

from socialnav_env.checks import is_whole
from socialnav_env.config import CorridorConfig
from socialnav_env.kernels import FloatArray, IntArray
from socialnav_env.layout import draw_layout
from socialnav_env.metrics import (
    LAST_ANGLE,
    LAST_VX,
    LAST_VZ,
    LAST_X,
    LAST_Z,
    METRICS,
    UNBROKEN,
    count_step,
    metric_parameters,
    start_tallies,
    summarise,
)
from socialnav_env.observation import (
    add_noise,
    observation_bounds,
    observation_parameters,
    observe,
)
from socialnav_env.people import people_parameters, walk
from socialnav_env.physics import Physics
from socialnav_env.reward import TERMS, remaining_way, reward, reward_parameters, shortest_way
from socialnav_env.robot import drive
from socialnav_env.state import State
from socialnav_env.variation import NO_VARIATION, Variation


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
        forces: (N, H, 2) social force on each person in the last step, z and x [m/s^2].
        generators: Each corridor's generator, which drew its start.
        noises: Each corridor's generator of sensor noise for the episode. One of its own, so that
            the next start does not depend on how often the robot has looked around.
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
        self.forces = np.zeros((count, config.num_humans, 2))
        self.generators = [np.random.default_rng(0)] * count
        self.noises = [np.random.default_rng(0)] * count
        self.low, self.high = observation_bounds(config)
        self._physics = Physics(config, count)
        self._noisy = config.ray_noise > 0.0 or config.tracking_noise > 0.0
        # A call of a kernel costs more time than its arithmetic, and the less the fewer its
        # arguments: hence rows of numbers, and `step` calls each kernel once.
        self._people = np.array(people_parameters(config))
        self._observation = np.array(observation_parameters(config))
        self._reward = np.array(reward_parameters(config))
        self._metrics = np.array(metric_parameters(config))

    def begin(self, n: int, rng: np.random.Generator, variation: Variation = NO_VARIATION) -> None:
        """Begin an episode in corridor `n`.

        Args:
            n: The corridor.
            rng: Draws the start, and seeds the sensor noise of the episode.
            variation: What this episode draws anew.

        Raises:
            ConfigError: The corridor is too small for its people.
        """
        state, config = self.state, variation.draw(self.config, rng)
        state.begin(n, draw_layout(config, rng))
        state.people_parameters[n] = (
            self._people if config is self.config else people_parameters(config)
        )
        self.generators[n] = rng
        seed = rng.integers(2**63)  # drawn in any case: noise changes no start
        if self._noisy:
            self.noises[n] = np.random.default_rng(seed)
        robot, goals = state.bodies[n, 0], state.goals[n]
        state.remaining[n] = remaining_way(robot, goals, state.flags[n], self._reward)
        way = shortest_way(robot, goals[1], self._reward)
        start_tallies(robot, way, self._metrics, state.tallies[n])
        self.terms[n] = self.forces[n] = 0.0
        self.contacts[n] = self.collided[n] = self.ended[n] = False
        one = slice(n, n + 1)
        summarise(state.tallies[one], state.flags[one], self._metrics, self.metrics[one])

    def step(self, actions: FloatArray) -> FloatArray:
        """Advance all corridors by one env step and score it.

        Args:
            actions: (N, 2) forward and turn, or (N, 3) ahead, left and turn; clipped to [-1, 1].

        Returns:
            (N, n) a fresh array of observations.
        """
        self.act(actions)
        return self.observe()

    def act(self, actions: FloatArray) -> None:
        """Advance and score as `step` does, without observing."""
        self.simulate(actions, self.config.frame_skip)
        self._score()

    def simulate(self, actions: FloatArray, frames: int) -> None:
        """Let robots act and people walk for some physics steps.

        Args:
            actions: As of `step`.
            frames: Number of physics steps, at least 1.

        Raises:
            ValueError: `frames` is no such number.
        """
        if not is_whole(frames) or frames < 1:
            raise ValueError(f"frames={frames!r}: expected a whole number of at least 1")
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
            state.waits,
            state.people_parameters,
            frames * config.timestep,
            commands,
            self.forces,
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

    def observe(self, chosen: IntArray | None = None) -> FloatArray:
        """Look around; with sensor noise every look is another one.

        Args:
            chosen: Indices of the corridors meant; all where None.

        Returns:
            (len(chosen), n) a fresh array of observations.
        """
        state = self.state
        bodies, goals, flags = state.bodies, state.goals, state.flags
        if chosen is not None:
            bodies, goals, flags = bodies[chosen], goals[chosen], flags[chosen]
        out = np.empty((len(bodies), len(self.low)))
        observe(bodies, goals, flags, self.low, self.high, self._observation, out)
        if self._noisy:
            for row, n in zip(out, range(self.count) if chosen is None else chosen, strict=True):
                add_noise(row, self.config, self.low, self.high, self.noises[n])
        return out

    def place(self, n: int, bodies: FloatArray) -> None:
        """Put the bodies of corridor `n` somewhere; what was collected and counted stays.

        Args:
            n: The corridor.
            bodies: (1 + H, 6) z, x, angle, velocity z, x, angular; the robot first.

        Raises:
            ValueError: A centre lies outside the outer walls, or a body is too fast for them.
        """
        _check_bodies(bodies, self.config)
        state = self.state
        state.bodies[n] = bodies
        # A jump is no progress and no path.
        robot = state.bodies[n, 0]
        state.remaining[n] = remaining_way(robot, state.goals[n], state.flags[n], self._reward)
        tally = state.tallies[n]
        tally[[LAST_Z, LAST_X, LAST_ANGLE, LAST_VZ, LAST_VX]] = bodies[0, :5]
        tally[UNBROKEN] = 0.0

    def restore(self, state: State) -> None:
        """Continue from a copied state.

        Raises:
            ValueError: The state is for another number of corridors or people.
        """
        self.state.assign(state)
        summarise(self.state.tallies, self.state.flags, self._metrics, self.metrics)


def _check_bodies(bodies: FloatArray, config: CorridorConfig) -> None:
    """Raise ValueError unless (1 + H, 6) bodies lie inside the walls, slow enough to stay there."""
    size = np.array([config.half_length, config.half_width])
    outside = np.abs(bodies[:, :2]) > size
    if outside.any():
        i, axis = np.argwhere(outside)[0].tolist()
        raise ValueError(
            f"{'zx'[axis]} of {_name(i)} is {bodies[i, axis]:g}: expected at most {size[axis]:g} "
            "from the middle, inside the walls"
        )
    radii = np.full(len(bodies), config.human_radius)
    radii[0] = config.robot_radius
    # Whoever is pushed may be as fast as the one who pushes.
    fastest = np.maximum(radii / config.timestep, max(config.robot_speed, config.human_top_speed))
    speeds = np.hypot(bodies[:, 3], bodies[:, 4])
    if (speeds > fastest).any():
        i = int(np.argmax(speeds > fastest))
        raise ValueError(
            f"{_name(i)} moves at {speeds[i]:g} m/s: expected at most {fastest[i]:g}, or one "
            "physics step could take it into a wall or through a person"
        )


def _name(i: int) -> str:
    """Whom row `i` of the bodies is about."""
    return "the robot" if i == 0 else f"person {i - 1}"
