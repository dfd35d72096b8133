"""Many corridors in one process, as a Gymnasium vector env."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from socialnav_env.checks import checked_count
from socialnav_env.config import ConfigError, CorridorConfig
from socialnav_env.env import FRAMES_PER_SECOND, INFO
from socialnav_env.kernels import BoolArray, FloatArray, IntArray
from socialnav_env.pictures import RENDER_MODES, Pictures
from socialnav_env.rendering import DEFAULT_OVERLAYS, Window, tile
from socialnav_env.robot import action_size
from socialnav_env.snapshot import VectorSnapshot, check_snapshot, generator_from, states_of
from socialnav_env.variation import NO_VARIATION, Variation, variation_of
from socialnav_env.vector_checks import (
    autoreset_mode_of,
    checked_actions,
    drawn_corridors,
    seeds_of,
    split_options,
    time_limit,
)
from socialnav_env.world import World

MASKS = tuple(f"_{name}" for name in INFO)
"""The keys of `info` under which Gymnasium tells which corridors a value is of."""
Told = tuple[FloatArray, FloatArray, BoolArray, BoolArray, dict[str, Any]]
"""What `step` returns."""


class SocialCorridorVectorEnv(VectorEnv[FloatArray, FloatArray, Any]):
    """A world of N corridors that step together.

    It tells, to the last bit, what Gymnasium's SyncVectorEnv of N single envs tells: observations,
    rewards, ends, and `info` with the single env's keys, each an (N,) array, beside each its mask,
    which is read-only.

    What follows the end of an episode is the `autoreset_mode`, by member or by value:

    - `NEXT_STEP` ("NextStep", Gymnasium's default): the corridor begins anew in the next step,
      which ignores its action and pays 0.
    - `SAME_STEP` ("SameStep"): it begins anew within the same step; `info["final_obs"]` and
      `info["final_info"]` hold the last observations and values of the finished episodes.
    - `DISABLED` ("Disabled"): it has to begin anew by `reset(options={"reset_mask": mask})` before
      the next step.

    Example:
        >>> import gymnasium as gym
        >>> import socialnav_env
        >>> env = gym.make_vec("SocialCorridor-v0", num_envs=3, scenario="crowded")
        >>> observations, info = env.reset(seed=0)
        >>> observations.shape
        (3, 64)
        >>> env.step(env.action_space.sample())[1].shape
        (3,)
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 (Gymnasium declares it an instance's)
        "render_modes": list(RENDER_MODES),
        "render_fps": FRAMES_PER_SECOND,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        num_envs: int = 1,
        *,
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
        render_width: int = 960,
        render_envs: Iterable[int] | None = None,
        camera: str = "corridor",
        overlays: Collection[str] = DEFAULT_OVERLAYS,
        **settings: Any,
    ) -> None:
        """Build the corridors.

        Args:
            num_envs: N.
            max_episode_steps: An episode is truncated after this many steps; as in `gym.make`,
                None is the registered 600 and -1 never.
            autoreset_mode: What follows the end of an episode.
            render_mode: None, "rgb_array", or "human" for a window with all pictures.
            render_width: Width of one corridor's picture [px].
            render_envs: Indices of the corridors to draw; the first 16 at most where None.
            camera: One of `socialnav_env.rendering.CAMERAS`.
            overlays: Some of `socialnav_env.rendering.OVERLAYS`.
            **settings: `scenario` and fields of CorridorConfig.

        Raises:
            ConfigError: An unknown or impossible keyword.
        """
        self.num_envs = num_envs = checked_count("num_envs", num_envs)
        self.max_episode_steps = time_limit(max_episode_steps)
        self._mode = autoreset_mode_of(autoreset_mode)
        self.config = CorridorConfig.from_keywords(**settings)
        self.metadata = {
            **self.metadata,
            "render_fps": self.config.frames_per_second,
            "autoreset_mode": self._mode,
        }
        self.render_mode = render_mode
        self._pictures = Pictures(
            self.config,
            drawn_corridors(render_envs, num_envs),
            render_mode=render_mode,
            render_width=render_width,
            camera=camera,
            overlays=overlays,
        )
        self._window: Window | None = None
        self.world = World(self.config, num_envs)
        self.single_observation_space = gym.spaces.Box(
            self.world.low, self.world.high, dtype=np.float64
        )
        size = action_size(self.config)
        self.single_action_space = gym.spaces.Box(-1.0, 1.0, (size,), dtype=np.float32)
        self._action_shape = (num_envs, size)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._begun = False
        self._elapsed: IntArray = np.zeros(num_envs, dtype=np.int64)
        self._ended: BoolArray = np.zeros(num_envs, dtype=np.bool_)
        self._variations: list[Variation] = [NO_VARIATION] * num_envs
        self._observations: FloatArray = np.zeros((num_envs, len(self.world.low)))
        self._seeds: list[int | None] = [None] * num_envs

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the window: a copy goes on from the same moment."""
        return {**self.__dict__, "_window": None}

    # --- Gymnasium -------------------------------------------------------------------------------

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Begin an episode in every corridor, or in those that `options["reset_mask"]` chooses.

        Args:
            seed: Corridor n gets seed + n, or the n-th of a list; None goes on drawing from the
                generator that there is.
            options: `reset_mask`, an (N,) array of bool; and what this and later episodes of the
                chosen corridors draw anew, as for the single env. Options stay in force until a
                reset brings others; {"defaults": True} returns to the keywords.

        Returns:
            The observations of all corridors, and the info of those that begin.

        Raises:
            ConfigError: An unknown or impossible option or seed, or a list of another length than
                N; nothing has changed then.
            gymnasium.error.ResetNeeded: Only some corridors are chosen, and none has begun.
        """
        chosen, settings = split_options(options, self.num_envs)
        variation = variation_of(settings, self.config)
        seeds = seeds_of(seed, self.num_envs)
        if not self._begun and len(chosen) < self.num_envs:
            raise gym.error.ResetNeeded("reset all corridors before only some of them")
        before = self.get_snapshot() if self._begun and variation is not None else None
        variations, known = self._variations.copy(), self._seeds.copy()
        self._seed(chosen.tolist(), seeds)
        if variation is not None:
            for n in chosen.tolist():
                self._variations[n] = variation
        try:
            self._begin(chosen)
        except ConfigError:  # no room for what was drawn
            if before is not None:
                self.set_snapshot(before)
            self._variations, self._seeds = variations, known
            raise
        self._begun = True
        self._ended[chosen] = False
        self._observations[chosen] = self.world.observe(chosen)
        self._look()
        mask = np.zeros(self.num_envs, dtype=np.bool_)
        mask[chosen] = True
        return self._observations.copy(), self._info(mask)

    def step(self, actions: ArrayLike) -> Told:
        """Advance every corridor by `dt`.

        Args:
            actions: (N, A) actions of the single env.

        Raises:
            ValueError: The actions have another shape or are not finite.
            gymnasium.error.ResetNeeded: No episode has begun, or with autoreset disabled an episode
                is over.
        """
        self._check_ready()
        self.world.act(checked_actions(actions, self._action_shape))
        self._elapsed += 1
        if self._mode is AutoresetMode.NEXT_STEP:
            self._begin(np.flatnonzero(self._ended))
        rewards: FloatArray = self.world.terms.sum(axis=1)
        terminated = self.world.ended.copy()
        truncated = self._elapsed >= self.max_episode_steps
        self._ended = terminated | truncated
        observations = self.world.observe()
        info: dict[str, Any] = {}
        if self._mode is AutoresetMode.SAME_STEP and self._ended.any():
            info = self._final(observations)
            over = np.flatnonzero(self._ended)
            self._begin(over)
            observations[over] = self.world.observe(over)
        self._observations[...] = observations
        self._look()
        info |= self._info(np.ones(self.num_envs, dtype=np.bool_))
        return observations, rewards, terminated, truncated, info

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Draw the present moment.

        Returns:
            An (h, w, 3) picture for each of `render_envs`; None where a window shows them.
        """
        if self.render_mode is None:
            gym.logger.warn(
                "render() needs a render_mode: gym.make_vec(..., render_mode='rgb_array')"
            )
            return None
        self._check_begun("render")
        if self.render_mode == "rgb_array":
            return self._pictures.frames(self.world)
        self._window = self._window or Window()
        self._window.show(self.render_tiled(), self.metadata["render_fps"])
        return None

    def render_tiled(self) -> NDArray[np.uint8]:
        """(h, w, 3) the pictures of all `render_envs` side by side."""
        self._check_begun("render_tiled")
        return tile(self._pictures.frames(self.world))

    def close_extras(self, **kwargs: Any) -> None:
        """Close the window, if one is open."""
        if self._window is not None:
            self._window.close()
            self._window = None

    # --- exact states ----------------------------------------------------------------------------

    def state_rows(self) -> FloatArray:
        """(N, 9 + 5 H) what pictures of the present moment need (`State.scene_rows`)."""
        self._check_begun("state_rows")
        return self.world.state.scene_rows()

    def get_snapshot(self) -> VectorSnapshot:
        """The present moment of all corridors, to go on from exactly.

        Raises:
            gymnasium.error.ResetNeeded: No episode has begun.
        """
        self._check_begun("get_snapshot")
        return VectorSnapshot(
            config=self.config,
            state=self.world.state.copy(),
            terms=self.world.terms.copy(),
            forces=self.world.forces.copy(),
            generators=states_of(self.world.generators),
            noises=states_of(self.world.noises),
            variations=tuple(self._variations),
            trails=self._pictures.trails(),
            autoreset_mode=self._mode,
            elapsed=self._elapsed.copy(),
            ended=self._ended.copy(),
            observations=self._observations.copy(),
        )

    def set_snapshot(self, snapshot: VectorSnapshot) -> None:
        """Go on from a snapshot: the same actions then give bit-identical results.

        Raises:
            ValueError: It is no snapshot of a vector env, or of one with other settings, another
                number of corridors or another autoreset mode.
        """
        check_snapshot(snapshot, VectorSnapshot, self.config)
        if snapshot.autoreset_mode is not self._mode:
            raise ValueError(
                f"the snapshot is of an env with autoreset_mode {snapshot.autoreset_mode.value}, "
                f"expected {self._mode.value}"
            )
        self.world.restore(snapshot.state)
        self.world.terms[...], self.world.forces[...] = snapshot.terms, snapshot.forces
        self.world.generators[:] = map(generator_from, snapshot.generators)
        self.world.noises[:] = map(generator_from, snapshot.noises)
        self._seeds = [-1] * self.num_envs  # Gymnasium's word for a generator whose seed is unknown
        self._variations = list(snapshot.variations)
        self._pictures.resume(snapshot.trails, self.world)
        self._elapsed = snapshot.elapsed.copy()
        self._ended = snapshot.ended.copy()
        self._observations = snapshot.observations.copy()
        self._begun = True

    # --- random numbers --------------------------------------------------------------------------

    @property  # type: ignore[misc] # SyncVectorEnv has no setter either
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """Each corridor's generator, as SyncVectorEnv tells them."""
        self._seed(range(self.num_envs))
        return tuple(self.world.generators)

    @property
    def np_random_seed(self) -> tuple[int | None, ...]:  # type: ignore[override]
        """The seed of each corridor's generator; -1 where it came with a snapshot."""
        self._seed(range(self.num_envs))
        return tuple(self._seeds)

    # ---------------------------------------------------------------------------------------------

    def _seed(self, chosen: Iterable[int], seeds: Sequence[int | None] | None = None) -> None:
        """Make those generators of the chosen corridors that get a seed, or never had one."""
        for n in chosen:
            seed = None if seeds is None else seeds[n]
            if seed is not None or self._seeds[n] is None:
                self.world.generators[n], self._seeds[n] = seeding.np_random(seed)

    def _begin(self, chosen: IntArray) -> None:
        """Begin an episode in the chosen corridors."""
        for n in chosen.tolist():
            self.world.begin(n, self.world.generators[n], self._variations[n])
        self._elapsed[chosen] = 0
        self._pictures.forget(chosen.tolist())

    def _look(self) -> None:
        """Keep the trails up to date, and the window."""
        self._pictures.follow(self.world)
        if self.render_mode == "human":
            self.render()

    def _info(self, mask: BoolArray) -> dict[str, Any]:
        """The single env's keys, each an (N,) array that is 0 outside the mask, and their masks."""
        world = self.world
        z, x, _, vz, vx, _ = world.state.bodies[:, 0].T.copy()
        motion = x, z, vx, vz, world.collided.copy()
        values = (*world.terms.T.copy(), *motion, *world.metrics.T.copy())
        if not mask.all():
            for value in values:
                value[~mask] = 0
        mask.flags.writeable = False  # one for all keys, which saves a tenth of a small env's step
        return {**dict(zip(INFO, values, strict=True)), **dict.fromkeys(MASKS, mask)}

    def _final(self, observations: FloatArray) -> dict[str, Any]:
        """What SyncVectorEnv tells of episodes that are over, under its keys."""
        ended = self._ended.copy()
        final = np.full(self.num_envs, None, dtype=object)
        for n in np.flatnonzero(ended).tolist():
            final[n] = observations[n].copy()
        return {
            "final_obs": final,
            "_final_obs": ended,
            "final_info": self._info(ended),
            "_final_info": ended,
        }

    def _check_begun(self, name: str) -> None:
        """Raise ResetNeeded unless episodes have begun."""
        if not self._begun:
            raise gym.error.ResetNeeded(f"call reset() before {name}()")

    def _check_ready(self) -> None:
        """Raise ResetNeeded unless every corridor can take a step."""
        self._check_begun("step")
        if self._mode is AutoresetMode.DISABLED and self._ended.any():
            raise gym.error.ResetNeeded(
                f"the episodes of corridors {np.flatnonzero(self._ended).tolist()} are over; call "
                "reset(options={'reset_mask': terminated | truncated}) before step()"
            )
