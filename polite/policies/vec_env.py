"""Any Gymnasium vector env, as stable-baselines3 wants it."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import EnvSpec, load_env_creator
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv

from polite.env_ids import making
from polite.types import PoliteError, check_finite_32


class GymnasiumVecEnv(VecEnv):
    """Steps a vector env that resets ended episodes within the same step.

    What the vector env gives is passed on as it is: it owns its arrays only until it returns them,
    so no copy is needed.

    Attributes:
        vector_env: The env beneath.
        last_info: The vector env's `info` of the last step, arrays for all envs at once.
    """

    def __init__(self, vector_env: VectorEnv[Any, Any, Any], seed: int) -> None:
        """Wrap a vector env.

        Args:
            vector_env: One with `AutoresetMode.SAME_STEP`.
            seed: Seeds the first reset; env n gets seed + n.

        Raises:
            PoliteError: The vector env resets at another time.
        """
        mode = vector_env.metadata.get("autoreset_mode")
        if mode is not AutoresetMode.SAME_STEP:
            raise PoliteError(
                f"{vector_env}: expected autoreset_mode={AutoresetMode.SAME_STEP}, got {mode}; "
                "make it with that keyword"
            )
        self.vector_env = vector_env  # first: stable-baselines3 asks for its render_mode
        super().__init__(
            vector_env.num_envs, vector_env.single_observation_space, vector_env.single_action_space
        )
        self.last_info: dict[str, Any] = {}
        self._seed: int | None = seed
        self._actions: NDArray[Any] = np.zeros(0)

    @property
    def time_limit(self) -> int | None:
        """Steps after which an episode is cut off, where there is such a limit.

        What the envs were made with comes before what they are registered with; −1 is for none.
        """
        spec = self.vector_env.spec
        if spec is None:
            return None
        limit: int | None = spec.kwargs.get("max_episode_steps", spec.max_episode_steps)
        return None if limit == -1 else limit

    def check_time_limit(self) -> int:
        """The time limit.

        Raises:
            PoliteError: There is none, so that an episode may last for ever.
        """
        if self.time_limit is None:
            spec = self.vector_env.spec
            raise PoliteError(
                f"{spec and spec.id}: no time limit; register or make it with max_episode_steps"
            )
        return self.time_limit

    def reset(self) -> NDArray[Any]:
        """Begin an episode in every env; returns (N, n) observations."""
        observations, self.last_info = self.vector_env.reset(seed=self._seed)
        self._seed = None
        return np.asarray(observations)

    def step_async(self, actions: NDArray[Any]) -> None:
        """Take note of (N, v) actions."""
        self._actions = actions

    def step_wait(self) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], list[dict[str, Any]]]:
        """Step all envs.

        Returns:
            (N, n) observations, (N,) rewards, (N,) whether an episode ended, and for each env a
            dict. Where one did it has `terminal_observation`, `TimeLimit.truncated` and the last
            values of `info`, elsewhere nothing: those of all envs are in `last_info`.

        Raises:
            NotFiniteError: The env gave NaN or infinity, or what float32 cannot hold.
        """
        observations, rewards, terminated, truncated, info = self.vector_env.step(self._actions)
        _check_finite(observations, rewards)
        self.last_info = info
        ended = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for n in np.flatnonzero(ended).tolist():
            infos[n] = _values_of(info.get("final_info", {}), n)
            last = infos[n]["terminal_observation"] = info["final_obs"][n]
            _check_finite(last)  # above is what the reset observes
            infos[n]["TimeLimit.truncated"] = bool(truncated[n] and not terminated[n])
        return np.asarray(observations), np.asarray(rewards, np.float32), ended, infos

    def close(self) -> None:
        """Close the env beneath."""
        self.vector_env.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """The same attribute for every env asked for."""
        return [getattr(self.vector_env, attr_name)] * len(self._indices(indices))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Not possible: the envs are one object."""
        raise AttributeError(f"cannot set {attr_name} on envs that are one object")

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> Any:
        """Not possible: the envs are one object."""
        raise AttributeError(f"cannot call {method_name} on envs that are one object")

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """No env is wrapped one by one."""
        return [False] * len(self._indices(indices))

    def _indices(self, indices: int | Sequence[int] | None) -> list[int]:
        """The envs meant by stable-baselines3's way to name them."""
        if indices is None:
            return list(range(self.num_envs))
        return [indices] if isinstance(indices, int) else list(indices)


def _check_finite(*arrays: NDArray[Any]) -> None:
    """Refuse what would spread through a training before anybody sees it.

    Raises:
        NotFiniteError: It is NaN or infinite, or beyond float32.
    """
    for array in arrays:
        check_finite_32("the env's observations and rewards", array)


def _values_of(info: dict[str, Any], n: int) -> dict[str, Any]:
    """What a vector env's info says of env `n`; keys that begin with _ are masks."""
    return {
        name: values[n]
        for name, values in info.items()
        if isinstance(values, np.ndarray) and not name.startswith("_")
    }


def make_vec_env(env_id: str, count: int, /, seed: int, **settings: Any) -> GymnasiumVecEnv:
    """Make `count` envs that step together.

    An env's own vector version is used where it can reset within the same step, single envs side
    by side elsewhere.

    Raises:
        PoliteError: The id or a setting is unknown, or the env's actions are not continuous.
    """
    mode: dict[str, Any] = {"autoreset_mode": AutoresetMode.SAME_STEP}
    with making(env_id) as name:
        if _has_mode(gym.spec(name)):
            env = gym.make_vec(name, count, **mode, **settings)
        else:
            env = gym.make_vec(
                name, count, vectorization_mode="sync", vector_kwargs=mode, **settings
            )
    if not isinstance(env.single_action_space, gym.spaces.Box):
        env.close()
        raise PoliteError(
            f"{env_id}: expected continuous actions (Box), got {env.single_action_space}"
        )
    return GymnasiumVecEnv(env, seed)


def check_spaces(env: GymnasiumVecEnv) -> None:
    """Refuse what stable-baselines3 cannot see or act in.

    Raises:
        PoliteError: The observations are no Box, or the actions have no finite bounds or are whole
            numbers.
    """
    if not isinstance(env.observation_space, Box):
        raise PoliteError(
            f"expected observations that are vectors (a Box), got {env.observation_space}"
        )
    space = env.action_space
    if not isinstance(space, Box) or not np.isfinite([space.low, space.high]).all():
        raise PoliteError(f"expected actions with finite bounds (a Box), got {space}")
    if not np.issubdtype(space.dtype, np.floating):
        raise PoliteError(f"expected continuous actions (a Box of floats), got {space}")


def _has_mode(spec: EnvSpec) -> bool:
    """Whether the env has a vector version that can be told when to reset."""
    entry = spec.vector_entry_point
    if entry is None:
        return False
    creator = entry if callable(entry) else load_env_creator(entry)
    return "autoreset_mode" in inspect.signature(creator).parameters
