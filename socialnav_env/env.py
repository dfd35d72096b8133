"""SocialCorridor-v0: a world of one, as a Gymnasium env."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from socialnav_env.checks import checked_seed
from socialnav_env.config import ConfigError, CorridorConfig
from socialnav_env.kernels import FloatArray
from socialnav_env.keyboard import keys_to_action
from socialnav_env.metrics import METRICS
from socialnav_env.mujoco_face import (
    CorridorData,
    bodies_from,
    corridor_model,
    positions,
    velocities,
)
from socialnav_env.pictures import RENDER_MODES, Pictures
from socialnav_env.rendering import DEFAULT_OVERLAYS, Window
from socialnav_env.reward import TERMS
from socialnav_env.robot import action_size
from socialnav_env.snapshot import Snapshot, check_snapshot, generator_from, states_of
from socialnav_env.variation import NO_VARIATION, variation_of
from socialnav_env.world import World

FRAMES_PER_SECOND = round(1.0 / CorridorConfig().dt)

INFO = (*TERMS, "x_position", "z_position", "x_velocity", "z_velocity", "collision", *METRICS)
"""The keys of `info`."""


class SocialCorridorEnv(gym.Env[FloatArray, FloatArray]):
    """A Pepper-like robot goes through a corridor in which people walk.

    ## Description
    The corridor is 30 m long and 6 m wide. The robot starts at its lower end (z around -14), may
    collect an intermittent goal (z around -2.5) and has to reach the end goal (z around 12). Three
    people walk around z = -10, 5 and 8 under a social force; they see the robot and evade it. The
    scene is that of the user study in the POLITE paper (Holk, Marta, Leite, ICRA 2024). Bodies,
    walls and contacts are pymunk's.

    ## Action Space
    `Box(-1, 1, (2,), float32)` for a unicycle (`action="unicycle"`, the default); values outside
    are clipped.

    | Index | Quantity | Min | Max | Unit |
    |---|---|---|---|---|
    | 0 | forward speed; -1 stands, 1 is `robot_speed` | -1 (0) | 1 (0.83) | m/s |
    | 1 | turn rate, positive to the left (+x) | -1 (-1) | 1 (1) | rad/s |

    `Box(-1, 1, (3,), float32)` for a base that moves in any direction (`action="holonomic"`); its
    speed is capped at `robot_speed` in every direction.

    | Index | Quantity | Min | Max | Unit |
    |---|---|---|---|---|
    | 0 | speed ahead | -1 (-0.83) | 1 (0.83) | m/s |
    | 1 | speed to the left | -1 (-0.83) | 1 (0.83) | m/s |
    | 2 | turn rate, positive to the left | -1 (-1) | 1 (1) | rad/s |

    ## Observation Space
    `Box(low, high, (24 + 4 H,), float64)` for H people (36 by default). Relative quantities are in
    the robot's frame: forward, then left. D is twice the diagonal from the centre to a corner,
    V = `robot_speed` + 1.3 (`human_speed` + 2 `human_speed_std`).

    | Index | Quantity | Min | Max | Unit |
    |---|---|---|---|---|
    | 0 | robot's x | -3 | 3 | m |
    | 1 | robot's z | -15 | 15 | m |
    | 2 | cosine of its heading (1 looks along +z) | -1 | 1 | - |
    | 3 | sine of its heading (1 looks along +x) | -1 | 1 | - |
    | 4 | its forward velocity | -V | V | m/s |
    | 5 | its velocity to the left (a unicycle's: while it turns, since it moves along the heading at the step's start, and when pushed) | -V | V | m/s |
    | 6 | its turn rate | -1 | 1 | rad/s |
    | 7 | distance to the intermittent goal | 0 | D | m |
    | 8, 9 | cosine and sine of its bearing (cosine 1 is ahead, sine 1 is left) | -1 | 1 | - |
    | 10 | 1 when it has been collected | 0 | 1 | - |
    | 11 | distance to the end goal | 0 | D | m |
    | 12, 13 | cosine and sine of its bearing | -1 | 1 | - |
    | 14 | 1 when it has been reached | 0 | 1 | - |
    | 15 + 4 i, 16 + 4 i | person i's position, relative | -D | D | m |
    | 17 + 4 i, 18 + 4 i | person i's velocity, relative | -2 V | 2 V | m/s |
    | 15 + 4 H ... 23 + 4 H | nine ranges from -90 to 90 degrees, from the centre | 0 | 6 | m |

    `observation="state"` leaves out the ranges, (15 + 4 H,); `"rays"` leaves out the people, (24,).
    `tracking_noise` and `ray_noise` are the standard deviations of what is added to people's
    entries and to the ranges, drawn from a generator of its own for each episode, which the env's
    generator seeds.

    ## Rewards
    The reward is the sum of these terms, all of them in `info`.

    | Key | Value |
    |---|---|
    | `reward_goal` | `goal_reward` (1), once, on the step that reaches the end goal |
    | `reward_intermittent` | `intermittent_reward` (0.5), once, when it is collected |
    | `reward_collision` | -`collision_penalty` (1) when robot and person, or robot and wall, touch after `contact_memory` (0.5 s) without a contact of that kind, whoever ran into whom; -`contact_penalty` (0.02) on each further step in contact |
    | `reward_proximity` | -`proximity_penalty` (0.02) times 1 - d / `personal_space`, for each person whose distance d, surface to surface, is less than that (1.2 m) |
    | `reward_progress` | `progress_weight` (0.2) times the metres by which the remaining path got shorter; the path leads via the intermittent goal until that is collected or passed, so passing it by drops the detour at once |
    | `reward_control` | -`control_penalty` (0.001) times the sum of the squared shares of top speed and top turn rate |

    ## Info
    The reward terms; `x_position`, `z_position` [m], `x_velocity`, `z_velocity` [m/s]; `collision`
    (a collision began in this step); and the running social metrics that
    `socialnav_env.metrics.METRICS` defines.

    ## Starting State
    The robot stands at z = `start_z` within 0.5 m, x within 1 m, heading within 0.3 rad of the
    corridor's axis. Goals are drawn within `anchor_jitter` of their anchors. So are the z around
    which the first three people walk; further people walk anywhere. They start within `human_roam`
    (but at least 0.5 m) of that z, or a little further where there is no room, anywhere across,
    clear of each other and of the robot. With `walking="group"` or `"queue"` people stand anywhere.

    `reset(options={...})` sets how episodes differ: for each field of the config marked `varies` a
    value, a pair (low, high) to draw from uniformly, or a list of values to choose from, as in
    `env.reset(options={"human_speed": (0.5, 1.0), "walking": ["cross", "along"]})`. Options stay in
    force until a reset brings others; `{"defaults": True}` returns to the keywords.

    ## Episode End
    The episode terminates at the end goal (`terminate_on_goal`) and at a collision
    (`terminate_on_collision`). It is truncated after 600 steps (60 s) by `TimeLimit`, never by the
    env.

    ## Arguments
    `scenario`, a named starting point (`"paper"`, `"empty"`, `"crowded"`, `"doorway"`); every field
    of `socialnav_env.config.CorridorConfig`; `render_mode` (`"human"`, `"rgb_array"`),
    `render_width` (pixels), `camera` (`"corridor"` shows all of it, `"robot"` follows the robot)
    and `overlays`, some of `"rays"`, `"personal_space"`, `"forces"`, `"reward"`, `"trajectory"`.

    ## MuJoCo face
    `dt`, `frame_skip`, `init_qpos`, `init_qvel`, `data.qpos/qvel/time/ctrl`, `model.nq/nv/nu`,
    `set_state(qpos, qvel)`, `state_vector()`, `do_simulation(ctrl, n_frames)`, `reset_model()`.
    `get_snapshot()` and `set_snapshot()` restore exactly; `copy.deepcopy` and `pickle` give an env
    that goes on from the same moment, without its window.

    ## Version History
    * v0: first version.
    """  # noqa: E501 (a Markdown table row is one line)

    metadata: dict[str, Any] = {  # noqa: RUF012 (Gymnasium declares it an instance's)
        "render_modes": list(RENDER_MODES),
        "render_fps": FRAMES_PER_SECOND,
    }

    def __init__(
        self,
        *,
        render_mode: str | None = None,
        render_width: int = 960,
        camera: str = "corridor",
        overlays: Collection[str] = DEFAULT_OVERLAYS,
        **settings: Any,
    ) -> None:
        """Build the corridor.

        Args:
            render_mode: None, "human" or "rgb_array".
            render_width: Width of a picture [px].
            camera: One of `socialnav_env.rendering.CAMERAS`.
            overlays: Some of `socialnav_env.rendering.OVERLAYS`.
            **settings: `scenario` and fields of CorridorConfig.

        Raises:
            ConfigError: An unknown or impossible keyword.
        """
        self.config = CorridorConfig.from_keywords(**settings)
        self.metadata = {**self.metadata, "render_fps": self.config.frames_per_second}
        self.render_mode = render_mode
        self._pictures = Pictures(
            self.config,
            (0,),
            render_mode=render_mode,
            render_width=render_width,
            camera=camera,
            overlays=overlays,
        )
        self.render_width = self._pictures.width
        self.world = World(self.config, 1)
        self.world.begin(0, np.random.default_rng(0))  # a state to look at before the first reset
        self.observation_space = gym.spaces.Box(self.world.low, self.world.high, dtype=np.float64)
        shape = (action_size(self.config),)
        self.action_space = gym.spaces.Box(-1.0, 1.0, shape, dtype=np.float32)  # type: ignore[assignment]
        self.data = CorridorData(self.world)
        self.model = corridor_model(self.world)
        self.frame_skip = self.config.frame_skip
        self._variation = NO_VARIATION
        self._window: Window | None = None
        self._begun = False

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the window: a copy goes on from the same moment."""
        return {**self.__dict__, "_window": None}

    # --- Gymnasium -------------------------------------------------------------------------------

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: Seeds the env's generator.
            options: What this and later episodes draw anew, see above; None and {} change nothing.

        Raises:
            ConfigError: An unknown or impossible option or seed; the options in force stay.
        """
        before, said = self._variation, variation_of(options, self.config)
        super().reset(seed=checked_seed(seed))
        self._variation = before if said is None else said
        try:
            observation = self.reset_model()
        except ConfigError:
            self._variation = before
            raise
        if self.render_mode == "human":
            self.render()
        return observation, self._info()

    def step(self, action: ArrayLike) -> tuple[FloatArray, float, bool, bool, dict[str, Any]]:
        """Advance by `dt`.

        Args:
            action: (2,) forward and turn, or (3,) ahead, left and turn, in [-1, 1].

        Raises:
            ValueError: The action has another shape or is not finite.
            gymnasium.error.ResetNeeded: No episode has begun.
        """
        if not self._begun:
            raise gym.error.ResetNeeded("call reset() before step()")
        observations = self.world.step(self._checked(action))
        self._pictures.follow(self.world)
        if self.render_mode == "human":
            self.render()
        info = self._info()
        reward = float(self.world.terms[0].sum())  # as the vector env; Python's own sum rounds less
        return observations[0], reward, bool(self.world.ended[0]), False, info

    def render(self) -> NDArray[np.uint8] | None:
        """Draw the present moment: an (h, w, 3) array, or a frame in the window."""
        if self.render_mode is None:
            gym.logger.warn("render() needs a render_mode: gym.make(..., render_mode='rgb_array')")
            return None
        frame = self._pictures.frames(self.world)[0]
        if self.render_mode == "rgb_array":
            return frame
        self._window = self._window or Window()
        self._window.show(frame, self.metadata["render_fps"])
        return None

    def close(self) -> None:
        """Close the window, if one is open."""
        if self._window is not None:
            self._window.close()
            self._window = None

    def get_keys_to_action(self) -> dict[tuple[int, ...], NDArray[np.float32]]:
        """Keys for `gymnasium.utils.play`: the arrows, and a and d to turn a holonomic base."""
        return keys_to_action(self.config.action)

    # --- states as numbers, pictures from numbers ------------------------------------------------

    def state_row(self) -> FloatArray:
        """(9 + 5 H,) what a picture of the present moment needs (`State.scene_rows`)."""
        row: FloatArray = self.world.state.scene_rows()[0]
        return row

    def render_state(self, row: ArrayLike, trail: ArrayLike = ()) -> NDArray[np.uint8]:
        """Draw a recorded moment; the env itself is not changed.

        Args:
            row: (9 + 5 H,) from `state_row`.
            trail: (K, 2) the robot's way so far, x and z [m].
        """
        return self._pictures.draw_row(row, trail)

    def get_snapshot(self) -> Snapshot:
        """The present moment, to go on from exactly.

        The steps that a `TimeLimit` around the env has counted are not in it: `copy.deepcopy` of
        the wrapped env keeps them.

        Raises:
            gymnasium.error.ResetNeeded: No episode has begun.
        """
        if not self._begun:
            raise gym.error.ResetNeeded("call reset() before get_snapshot()")
        return Snapshot(
            config=self.config,
            state=self.world.state.copy(),
            terms=self.world.terms.copy(),
            forces=self.world.forces.copy(),
            generators=states_of([self.np_random]),  # from which the next episode begins
            noises=states_of(self.world.noises),
            variations=(self._variation,),
            trails=self._pictures.trails(),
        )

    def set_snapshot(self, snapshot: Snapshot) -> None:
        """Go on from a snapshot: the same actions then give bit-identical results.

        Raises:
            ValueError: It is no snapshot of a single env, or of one with other settings.
        """
        check_snapshot(snapshot, Snapshot, self.config)
        self.world.restore(snapshot.state)
        self.world.terms[...], self.world.forces[...] = snapshot.terms, snapshot.forces
        self.np_random = self.world.generators[0] = generator_from(snapshot.generators[0])
        self.world.noises[:] = map(generator_from, snapshot.noises)
        self._variation = snapshot.variations[0]
        self._pictures.resume(snapshot.trails, self.world)
        self._begun = True

    # --- MuJoCo ----------------------------------------------------------------------------------

    @property
    def dt(self) -> float:
        """One env step [s]."""
        return self.config.dt

    @property
    def init_qpos(self) -> FloatArray:
        """(nq,) qpos at the episode's start."""
        return positions(self.world.state.start[0])

    @property
    def init_qvel(self) -> FloatArray:
        """(nv,) qvel at the episode's start."""
        return velocities(self.world.state.start[0])

    def reset_model(self) -> FloatArray:
        """Draw a new start; returns the observation."""
        self.world.begin(0, self.np_random, self._variation)
        self._pictures.forget((0,))
        self._pictures.follow(self.world)
        self._begun = True
        observation: FloatArray = self.world.observe()[0]
        return observation

    def set_state(self, qpos: ArrayLike, qvel: ArrayLike) -> None:
        """Place every body as MuJoCo's does; goals, flags, people's ways and time stay.

        Args:
            qpos: (nq,) robot's x, z, heading, then each person's x, z.
            qvel: (nv,) their derivatives.

        Raises:
            ValueError: A wrong shape, a number that is not finite, a centre outside the walls, or a
                speed at which a physics step could take a body into a wall.
        """
        self.world.place(0, bodies_from(qpos, qvel, self.world.state.bodies[0]))

    def _get_obs(self) -> FloatArray:
        """(n,) the observation of the present moment, under MujocoEnv's name."""
        observation: FloatArray = self.world.observe()[0]
        return observation

    def state_vector(self) -> FloatArray:
        """(nq + nv,) qpos and qvel."""
        return np.concatenate([self.data.qpos, self.data.qvel])

    def do_simulation(self, ctrl: ArrayLike, n_frames: int) -> None:
        """Run physics steps with an action, without reward or observation."""
        self.world.simulate(self._checked(ctrl), n_frames)

    # ---------------------------------------------------------------------------------------------

    def _info(self) -> dict[str, Any]:
        """Reward terms, MuJoCo keys and metrics of the last step, in fresh objects."""
        world = self.world
        z, x, _, vz, vx, _ = world.state.bodies[0, 0].tolist()
        motion = (x, z, vx, vz, bool(world.collided[0]))
        values = (*world.terms[0].tolist(), *motion, *world.metrics[0].tolist())
        return dict(zip(INFO, values, strict=True))

    def _checked(self, action: ArrayLike) -> FloatArray:
        """(1, A) float64, or a ValueError that says what is wrong."""
        actions = np.asarray(action, dtype=np.float64)
        shape = (action_size(self.config),)
        if actions.shape != shape:
            raise ValueError(f"action: expected shape {shape}, got {actions.shape}")
        if not all(map(math.isfinite, actions.tolist())):
            raise ValueError(f"action: expected finite numbers, got {actions}")
        return actions.reshape(1, -1)
