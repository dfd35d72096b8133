"""The replication's scene: its envs, and the states on which reward models are compared."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polite.experiments.replication.config import StudyConfig
from polite.files import write_atomically
from polite.policies.policy import Policy
from polite.policies.vec_env import GymnasiumVecEnv, make_vec_env
from polite.rollouts import collect
from polite.types import Trajectory
from socialnav_env import CorridorConfig, SocialCorridorEnv
from socialnav_env.start import PAPER_ANCHORS

ENV_ID = "SocialCorridor-v0"
FLOOR_PEOPLE = ((1.2, PAPER_ANCHORS[0]), (-1.2, PAPER_ANCHORS[1]), (1.2, PAPER_ANCHORS[2]))
"""Where people stand on the floor plan: x, z [m]."""
FLOOR_X, FLOOR_Z = 13, 60
"""Cells of the floor plan."""
START_PLACES = tuple(float(z) for z in np.linspace(-14.0, 9.0, 15))
"""Places along the corridor from which clips and map states are collected [m]. The last lies before
the end goal: a robot that began beyond it would only meet the wall there."""


FLAGS = slice(3, 5)
"""Columns of a state's row that tell what has been collected and reached."""
GOALS = (slice(5, 7), slice(7, 9))
"""Columns of the intermittent and the end goal, x and z; the people follow, five columns each."""


def people_of(
    states: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The people in rows of states, and how far they are from the robot, centre to centre.

    Args:
        states: (..., k) rows of `socialnav_env.state.State.scene_rows`.

    Returns:
        (..., H, 5) x, z, heading and velocity x, z; and (..., H) distances [m].
    """
    people = states[..., GOALS[1].stop :].reshape(*states.shape[:-1], -1, 5)
    return people, np.linalg.norm(people[..., :2] - states[..., None, :2], axis=-1)


def scene_settings(config: StudyConfig) -> dict[str, Any]:
    """Keywords of the study's corridor: fixed horizon, anchors nearly fixed."""
    return {
        "anchor_jitter": config.anchor_jitter,
        "terminate_on_goal": False,
        "terminate_on_collision": False,
    }


def study_env(config: StudyConfig, count: int, seed: int, **further: Any) -> GymnasiumVecEnv:
    """`count` corridors of the study that step together."""
    settings = scene_settings(config) | further
    return make_vec_env(ENV_ID, count, seed, max_episode_steps=config.horizon, **settings)


def scene_of(anchor_jitter: float) -> dict[str, Any]:
    """Where walls, goals and people are, as the plots want it.

    Args:
        anchor_jitter: Half the width of the band in which a person is drawn [m].
    """
    world = CorridorConfig()
    return {
        "half_length": world.half_length,
        "half_width": world.half_width,
        "intermittent": [0.0, world.intermittent_z],
        "goal": [0.0, world.goal_z],
        "intermittent_radius": world.intermittent_radius,
        "goal_radius": world.goal_radius,
        "people": [list(place) for place in FLOOR_PEOPLE],
        "anchor_jitter": anchor_jitter,
    }


def derive(seed: int, *names: str | int) -> int:
    """A seed of its own for each purpose, from the run's seed."""
    words = [n if isinstance(n, int) else int.from_bytes(n.encode(), "big") for n in names]
    return int(np.random.SeedSequence([seed, *words]).generate_state(1)[0] >> 1)


@dataclass(frozen=True, eq=False)
class MapStates:
    """M states, spread evenly over z, with the action that the clip-making policy took.

    Attributes:
        observations: (M, n).
        actions: (M, v).
        states: (M, k) rows of `socialnav_env.state.State.scene_rows`.
    """

    observations: NDArray[np.float32]
    actions: NDArray[np.float32]
    states: NDArray[np.float64]

    @property
    def x(self) -> NDArray[np.float64]:
        """(M,) the robot's lateral position [m]."""
        return self.states[:, 0]

    @property
    def z(self) -> NDArray[np.float64]:
        """(M,) the robot's position along the corridor [m]."""
        return self.states[:, 1]

    def goal_offset(self, which: int) -> NDArray[np.float64]:
        """(M,) robot's z minus that of the intermittent (0) or the end goal (1) [m]."""
        return self.z - self.states[:, GOALS[which]][:, 1]

    def goal_distance(self, which: int) -> NDArray[np.float64]:
        """(M,) distance to the intermittent (0) or the end goal (1) [m]."""
        return np.asarray(np.linalg.norm(self.states[:, :2] - self.states[:, GOALS[which]], axis=1))

    @property
    def person_offset(self) -> NDArray[np.float64]:
        """(M,) robot's z minus that of the nearest person [m]."""
        people, distances = people_of(self.states)
        nearest = np.take_along_axis(people[..., 1], distances.argmin(axis=1)[:, None], axis=1)
        return np.asarray(self.z - nearest[:, 0])

    def save(self, path: Path) -> None:
        """Write to one file, whole or not at all."""
        write_atomically(
            path,
            lambda temporary: np.savez_compressed(
                temporary,
                observations=self.observations,
                actions=self.actions,
                states=self.states,
            ),
        )

    @classmethod
    def load(cls, path: Path) -> MapStates:
        """Read what `save` wrote."""
        with np.load(path, allow_pickle=False) as arrays:
            return cls(arrays["observations"], arrays["actions"], arrays["states"])


def collect_along(
    config: StudyConfig, policy: Policy, rng: np.random.Generator
) -> list[Trajectory]:
    """Let the clip-making policy, as it trains, walk from places spread along the corridor."""
    trajectories = []
    for start in START_PLACES:
        env = study_env(config, config.pool_envs, 0, start_z=start).vector_env
        trajectories += collect(
            env,
            lambda observations: policy.sample(observations, rng),
            config.pool_steps,
            int(rng.integers(2**31)),
        )
    return trajectories


def collect_map_states(config: StudyConfig, policy: Policy, rng: np.random.Generator) -> MapStates:
    """Collect states, and keep as many in each metre of z."""
    trajectories = collect_along(config, policy, rng)
    states = np.concatenate([t.states for t in trajectories])
    bins = np.floor(states[:, 1])
    places = np.unique(bins)
    each = max(1, config.map_states // len(places))
    chosen = np.concatenate(
        [
            rng.choice(np.flatnonzero(bins == b), min(each, int((bins == b).sum())), replace=False)
            for b in places
        ]
    )
    return MapStates(
        np.concatenate([t.observations for t in trajectories])[chosen],
        np.concatenate([t.actions for t in trajectories])[chosen],
        states[chosen],
    )


def floor_plan(config: StudyConfig) -> MapStates:
    """A robot driving ahead at full speed in every cell of the floor, with people standing still.

    The intermittent goal counts as collected beyond it, and the end goal as not yet reached.
    """
    settings = scene_settings(config) | {"anchor_jitter": 0.0}
    env = SocialCorridorEnv(**settings)
    env.reset(seed=0)
    half_x, half_z = env.config.half_width, env.config.half_length
    xs = (np.arange(FLOOR_X) + 0.5) / FLOOR_X * 2 * half_x - half_x
    zs = (np.arange(FLOOR_Z) + 0.5) / FLOOR_Z * 2 * half_z - half_z
    rows, observations = [], []
    for z in zs:
        for x in xs:
            qpos = np.array([x, z, 0.0, *np.ravel(FLOOR_PEOPLE)])
            qvel = np.zeros_like(qpos)
            qvel[1] = env.config.robot_speed
            env.world.state.flags[0] = (z > env.config.intermittent_z, False)
            env.set_state(qpos, qvel)
            rows.append(env.state_row())
            observations.append(env.world.observe()[0])
    actions = np.tile(np.array([1.0, 0.0], dtype=np.float32), (len(rows), 1))
    return MapStates(np.array(observations, dtype=np.float32), actions, np.array(rows))
