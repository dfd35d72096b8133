"""Episodes kept as states, to be looked at later."""

from __future__ import annotations

import copy
from typing import Any, Generic, Protocol

import gymnasium as gym
import numpy as np
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from socialnav_env.kernels import FloatArray
from socialnav_env.wrappers.types import Action, Observation, Step


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
