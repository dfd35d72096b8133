"""The metrics of all episodes so far, as a table, for one env or many."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Generic

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv, VectorWrapper
from numpy.typing import NDArray

from socialnav_env.metrics import METRICS
from socialnav_env.wrappers.episode_metrics import EpisodeMetrics, episode_summary
from socialnav_env.wrappers.table import MetricsTable
from socialnav_env.wrappers.types import Action, Observation, Step

Flags = NDArray[np.bool_]
Told = tuple[Observation, NDArray[Any], Flags, Flags, dict[str, Any]]


class SocialMetrics(EpisodeMetrics[Observation, Action], Generic[Observation, Action]):
    """Keeps the metrics of every finished episode and sums them up.

    What `EpisodeMetrics` tells of each episode: the social metrics where the env has them, else
    return, length and time-outs. Belongs outside the time limit.

    Example:
        >>> import gymnasium as gym
        >>> import socialnav_env
        >>> from socialnav_env.wrappers import SocialMetrics
        >>> env = SocialMetrics(gym.make("SocialCorridor-v0", max_episode_steps=5))
        >>> for seed in range(3):
        ...     _ = env.reset(seed=seed)
        ...     for _ in range(5):
        ...         _ = env.step([-1.0, 0.0])  # stands still
        >>> table = env.table()
        >>> table["timeout"].mean, table["stalled_time"].mean, table["stalled_time"].unit
        (1.0, 0.5, 's')
        >>> print(table.to_markdown().splitlines()[2])
        | success | 0 [0, 0.561] | - | 3 |
    """

    def __init__(self, env: gym.Env[Observation, Action]) -> None:
        """Wrap an env."""
        super().__init__(env)
        self.episodes: list[dict[str, Any]] = []
        """The finished episodes, oldest first."""

    def step(self, action: Action) -> Step[Observation]:
        """Step the env; keep the metrics when the episode ends."""
        observation, reward, terminated, truncated, info = super().step(action)
        if terminated or truncated:
            self.episodes.append(dict(info["episode_metrics"]))
        return observation, reward, terminated, truncated, info

    def table(self) -> MetricsTable:
        """Means and intervals over the finished episodes.

        Raises:
            ValueError: No episode has finished.
        """
        return MetricsTable.of(self.episodes)


class VectorSocialMetrics(
    VectorWrapper[Observation, Action, Observation, Action, NDArray[Any]],
    Generic[Observation, Action],
):
    """`SocialMetrics` for many envs at once, in any autoreset mode.

    Example:
        >>> import gymnasium as gym
        >>> import socialnav_env
        >>> from socialnav_env.wrappers import VectorSocialMetrics
        >>> env = VectorSocialMetrics(
        ...     gym.make_vec("SocialCorridor-v0", num_envs=4, max_episode_steps=5)
        ... )
        >>> _ = env.reset(seed=0)
        >>> for _ in range(5):
        ...     _ = env.step(0.0 * env.action_space.sample())
        >>> env.table(each=1)["length"].mean
        5.0
    """

    def __init__(self, env: VectorEnv[Observation, Action, NDArray[Any]]) -> None:
        """Wrap a vector env."""
        super().__init__(env)
        self.episodes: list[list[dict[str, Any]]] = [[] for _ in range(env.num_envs)]
        """The finished episodes of each env, oldest first."""
        # Gymnasium takes a vector env that does not tell for one of that mode.
        mode = env.metadata.get("autoreset_mode", AutoresetMode.NEXT_STEP)
        self._next_step = mode is AutoresetMode.NEXT_STEP
        self._ended: Flags = np.zeros(env.num_envs, dtype=np.bool_)
        self._returns = np.zeros(env.num_envs)
        self._lengths = np.zeros(env.num_envs, dtype=np.int64)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode in all envs, or in those of `options["reset_mask"]`."""
        begun = (options or {}).get("reset_mask", np.ones(self.num_envs, dtype=np.bool_))
        self._forget(begun)
        return self.env.reset(seed=seed, options=options)

    def step(self, actions: Action) -> Told[Observation]:
        """Step the envs; keep the metrics of the episodes that end."""
        observations, rewards, terminated, truncated, info = self.env.step(actions)
        counts = ~self._ended if self._next_step else np.ones(self.num_envs, dtype=np.bool_)
        self._returns += np.where(counts, rewards, 0.0)
        self._lengths += counts
        self._ended = terminated | truncated
        last = info.get("final_info", info)
        for n in np.flatnonzero(self._ended).tolist():
            one = _info_of(last, n)
            total, length = float(self._returns[n]), int(self._lengths[n])
            self.episodes[n].append(episode_summary(one, bool(terminated[n]), total, length))
        self._returns[self._ended] = 0.0
        self._lengths[self._ended] = 0
        return observations, rewards, terminated, truncated, info

    def table(self, each: int | None = None) -> MetricsTable:
        """Means and intervals over the finished episodes.

        Args:
            each: Only that many of each env's first episodes. While every env counts as long as it
                runs, the short episodes are more than their share: choose a number that every env
                has finished.

        Raises:
            ValueError: No episode has finished, or an env has finished fewer than `each`.
        """
        fewest = min(map(len, self.episodes))
        if each is not None and not 1 <= each <= fewest:
            raise ValueError(f"each={each}: expected 1 to {fewest}, what every env has finished")
        return MetricsTable.of([one for episodes in self.episodes for one in episodes[:each]])

    def _forget(self, begun: Flags) -> None:
        """Drop what has been counted of the unfinished episodes."""
        self._ended[begun] = False
        self._returns[begun] = 0.0
        self._lengths[begun] = 0


def _info_of(info: Mapping[str, Any], n: int) -> dict[str, Any]:
    """What an episode's summary needs of one env's info."""
    return {name: info[name][n].item() for name in (*METRICS, "ended") if name in info}
