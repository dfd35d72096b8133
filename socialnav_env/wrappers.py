"""Wrappers for the corridor and for Gymnasium's MuJoCo envs alike."""

from __future__ import annotations

import copy
from typing import Any, Generic, Protocol, SupportsFloat, TypeVar

import gymnasium as gym
import numpy as np
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from socialnav_env.kernels import FloatArray
from socialnav_env.metrics import METRICS

Observation = TypeVar("Observation")
Action = TypeVar("Action")

Step = tuple[Observation, SupportsFloat, bool, bool, dict[str, Any]]


class FixedHorizon(
    gym.Wrapper[Observation, Action, Observation, Action],
    RecordConstructorArgs,
    Generic[Observation, Action],
):
    """Every episode lasts the same number of steps, since an early end tells of the reward.

    After a terminal state that state is held and pays 0 until the horizon is reached; only then is
    the episode truncated. `info["held"]` tells such steps apart; there the `reward_*` terms are 0
    and no `collision` begins. For an env that has no keyword against early ends: the corridor has
    `terminate_on_goal` and `terminate_on_collision`, most MuJoCo envs
    `terminate_when_unhealthy`.

    Example:
        >>> import gymnasium as gym
        >>> import socialnav_env
        >>> from socialnav_env.wrappers import FixedHorizon
        >>> env = FixedHorizon(gym.make("SocialCorridor-v0"), steps=300)
        >>> _ = env.reset(seed=0)
        >>> ends = [env.step(env.action_space.sample())[2:4] for _ in range(300)]
        >>> ends[-2:]
        [(False, False), (False, True)]
    """

    def __init__(self, env: gym.Env[Observation, Action], steps: int) -> None:
        """Wrap an env.

        Args:
            env: The env.
            steps: The horizon.

        Raises:
            ValueError: No whole number of at least 1, or more than the env's own time limit.
        """
        RecordConstructorArgs.__init__(self, steps=steps)
        super().__init__(env)
        limit = env.spec.max_episode_steps if env.spec is not None else None
        if isinstance(steps, bool) or not isinstance(steps, int) or steps < 1:
            raise ValueError(f"steps={steps!r}: expected a whole number of at least 1")
        if limit is not None and steps > limit:
            raise ValueError(
                f"steps={steps}: the env's own time limit is {limit}; "
                f"make it with max_episode_steps={steps}"
            )
        self.steps = steps
        self._elapsed = 0
        self._final: tuple[Observation, dict[str, Any]] | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode."""
        self._elapsed = 0
        self._final = None
        observation, info = self.env.reset(seed=seed, options=options)
        return observation, {**info, "held": False}

    def step(self, action: Action) -> Step[Observation]:
        """Step the env, or hold its terminal state."""
        self._elapsed += 1
        horizon = self._elapsed >= self.steps
        if self._final is not None:
            observation, info = copy.deepcopy(self._final)
            return observation, 0.0, False, horizon, info
        observation, reward, terminated, truncated, info = self.env.step(action)
        if terminated or truncated:
            self._final = copy.deepcopy((observation, _held(info)))
        return observation, reward, False, horizon, {**info, "held": False}


def _held(info: dict[str, Any]) -> dict[str, Any]:
    """The info of steps in which nothing happens any more."""
    nothing: dict[str, Any] = {key: 0.0 for key in info if key.startswith("reward_")}
    if "collision" in info:
        nothing["collision"] = False
    return {**info, **nothing, "held": True}


class _Moments(Protocol):
    """How an env's state is kept and put back."""

    def keep(self) -> Any:
        """The present moment, as `show` takes it."""

    def show(self, moment: Any) -> NDArray[np.uint8]:
        """Render a moment and leave the env as it was."""


class _Snapshots:
    """An env that has `get_snapshot`."""

    def __init__(self, env: Any) -> None:
        self._env = env

    def keep(self) -> Any:
        return self._env.get_snapshot()

    def show(self, moment: Any) -> NDArray[np.uint8]:
        present = self._env.get_snapshot()
        self._env.set_snapshot(moment)
        try:
            frame: NDArray[np.uint8] = self._env.render()
        finally:
            self._env.set_snapshot(present)
        return frame


class _Positions:
    """A MujocoEnv: positions and velocities are enough for a picture."""

    def __init__(self, env: Any) -> None:
        self._env = env

    def keep(self) -> tuple[FloatArray, FloatArray]:
        return self._env.data.qpos.copy(), self._env.data.qvel.copy()

    def show(self, moment: tuple[FloatArray, FloatArray]) -> NDArray[np.uint8]:
        import mujoco  # type: ignore[import-untyped] # an extra, which whoever has a MujocoEnv has installed

        # The next step depends on more than qpos and qvel, on the solver's warm start for one.
        present = copy.copy(self._env.data)
        self._env.set_state(*moment)
        try:
            frame: NDArray[np.uint8] = self._env.render()
        finally:
            mujoco.mj_copyData(self._env.data, self._env.model, present)
        return frame


def _moments_of(env: Any) -> _Moments:
    """The way in which this env's moments are kept.

    Raises:
        TypeError: The env has none.
    """
    if hasattr(env, "get_snapshot"):
        return _Snapshots(env)
    if hasattr(env, "set_state") and hasattr(getattr(env, "data", None), "qpos"):
        return _Positions(env)
    raise TypeError(
        f"{type(env).__name__} cannot be recorded: expected get_snapshot() and set_snapshot(), "
        "or set_state(), data.qpos and data.qvel as a MujocoEnv has them"
    )


class RecordState(
    gym.Wrapper[Observation, Action, Observation, Action],
    RecordConstructorArgs,
    Generic[Observation, Action],
):
    """Keeps every moment of an episode as numbers, so that any can be rendered later.

    A moment is a snapshot where the env has `get_snapshot`, (qpos, qvel) otherwise: some kilobytes
    instead of a frame. The reset is moment 0; the next reset forgets them all.

    A MujocoEnv's own `render()` lags behind its qpos by one physics step, since MuJoCo computes
    where the bodies are before it moves them; `render_at` draws the recorded qpos.

    Example:
        >>> import gymnasium as gym
        >>> import socialnav_env
        >>> from socialnav_env.wrappers import RecordState
        >>> env = RecordState(gym.make("SocialCorridor-v0", render_mode="rgb_array"))
        >>> _ = env.reset(seed=0)
        >>> for _ in range(20):
        ...     _ = env.step(env.action_space.sample())
        >>> len(env.moments)
        21
        >>> env.render_at(5).shape[2]
        3
    """

    def __init__(self, env: gym.Env[Observation, Action]) -> None:
        """Wrap an env.

        Raises:
            TypeError: The env's state can be neither kept nor put back.
        """
        RecordConstructorArgs.__init__(self)
        super().__init__(env)
        self._recorder = _moments_of(env.unwrapped)
        self.moments: list[Any] = []
        """The episode so far, the reset first."""

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode and a new recording."""
        result = self.env.reset(seed=seed, options=options)
        self.moments = [self._recorder.keep()]
        return result

    def step(self, action: Action) -> Step[Observation]:
        """Step the env and keep the moment after it."""
        result = self.env.step(action)
        self.moments.append(self._recorder.keep())
        return result

    def render_at(self, t: int) -> NDArray[np.uint8]:
        """Render a past moment; the env then goes on from the present one as if it had not.

        Args:
            t: Steps since the reset.

        Returns:
            (h, w, 3) RGB.

        Raises:
            ValueError: The env does not render arrays.
            IndexError: The episode has no such moment.
        """
        if self.render_mode != "rgb_array":
            raise ValueError(
                f"render_mode={self.render_mode!r}: expected 'rgb_array', "
                "as in gym.make(..., render_mode='rgb_array')"
            )
        if not 0 <= t < len(self.moments):
            raise IndexError(f"t={t}: expected a moment in [0, {len(self.moments) - 1}]")
        return self._recorder.show(self.moments[t])


class EpisodeMetrics(
    gym.Wrapper[Observation, Action, Observation, Action],
    RecordConstructorArgs,
    Generic[Observation, Action],
):
    """At an episode's end `info["episode_metrics"]` sums it up; belongs outside the time limit.

    It holds the social metrics of `socialnav_env.metrics.METRICS` where the env has them, and

    - `timeout`: 1 when the time ran out before the goal was reached (TO), else 0,
    - `return`: the sum of the rewards, undiscounted,
    - `length`: the number of steps.

    Example:
        >>> import gymnasium as gym
        >>> import socialnav_env
        >>> from socialnav_env.wrappers import EpisodeMetrics
        >>> env = EpisodeMetrics(gym.make("SocialCorridor-v0", max_episode_steps=5))
        >>> _ = env.reset(seed=0)
        >>> for _ in range(5):
        ...     info = env.step([-1.0, 0.0])[4]  # stands still
        >>> metrics = info["episode_metrics"]
        >>> metrics["timeout"], metrics["length"], metrics["path_length"]
        (1.0, 5, 0.0)
    """

    def __init__(self, env: gym.Env[Observation, Action]) -> None:
        """Wrap an env."""
        RecordConstructorArgs.__init__(self)
        super().__init__(env)
        self._return = 0.0
        self._length = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode."""
        self._return, self._length = 0.0, 0
        return self.env.reset(seed=seed, options=options)

    def step(self, action: Action) -> Step[Observation]:
        """Step the env; add the metrics when the episode ends."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        self._return += float(reward)
        self._length += 1
        if terminated or truncated:
            info = {**info, "episode_metrics": self._summary(info, terminated)}
        return observation, reward, terminated, truncated, info

    def _summary(self, info: dict[str, Any], terminated: bool) -> dict[str, Any]:
        """The finished episode in numbers."""
        over_before = terminated or info.get("held", False) or bool(info.get("success", False))
        return {
            **{name: info[name] for name in METRICS if name in info},
            "timeout": 0.0 if over_before else 1.0,
            "return": self._return,
            "length": self._length,
        }
