"""Episodes of one length."""

from __future__ import annotations

import copy
from typing import Any, Generic

import gymnasium as gym
from gymnasium.utils import RecordConstructorArgs

from socialnav_env.checks import checked_count
from socialnav_env.wrappers.types import Action, Observation, Step

REPORTS = ("episode", "episode_metrics")
"""What wrappers beneath tell of a finished episode (RecordEpisodeStatistics and Monitor,
EpisodeMetrics): whoever counts episodes counts each of these as one."""


class FixedHorizon(
    gym.Wrapper[Observation, Action, Observation, Action],
    RecordConstructorArgs,
    Generic[Observation, Action],
):
    """Every episode lasts the same number of steps, since an early end tells of the reward.

    After a terminal state that state is held and pays 0 until the horizon is reached; only then is
    the episode truncated. `info["held"]` tells such steps apart; there the `reward_*` terms are 0,
    no `collision` begins, and reports of the finished episode are not told again.
    `info["ended"]` says that the env has terminated, from that step on.

    For an env that has no keyword against early ends: the corridor has `terminate_on_goal` and
    `terminate_on_collision`, most MuJoCo envs `terminate_when_unhealthy`.

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
        steps = checked_count("steps", steps)
        limit = env.spec.max_episode_steps if env.spec is not None else None
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
        return observation, {**info, "held": False, "ended": False}

    def step(self, action: Action) -> Step[Observation]:
        """Step the env, or hold its terminal state."""
        self._elapsed += 1
        horizon = self._elapsed >= self.steps
        if self._final is not None:
            observation, info = copy.deepcopy(self._final)
            return observation, 0.0, False, horizon, info
        observation, reward, terminated, truncated, info = self.env.step(action)
        told = {**info, "ended": terminated}
        if terminated or truncated:
            self._final = copy.deepcopy((observation, _held(told)))
        return observation, reward, False, horizon, {**told, "held": False}


def _held(info: dict[str, Any]) -> dict[str, Any]:
    """The info of steps in which nothing happens any more."""
    nothing: dict[str, Any] = {key: 0.0 for key in info if key.startswith("reward_")}
    if "collision" in info:
        nothing["collision"] = False
    state = {key: value for key, value in info.items() if key not in REPORTS}
    return {**state, **nothing, "held": True}
