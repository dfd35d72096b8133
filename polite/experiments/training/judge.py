"""How good a finished policy is, under the true reward."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from typing import Any

import numpy as np

from polite.methods.preference_learning import MakeEnv
from polite.policies.policy import Policy
from polite.rollouts import evaluate

EVALUATION_SEED = 1_000_000
"""Added to the run's seed, so that the policy is judged on scenes that it was not trained on.
Episode n adds n: trainings of one seed are judged on the same scenes whatever their method, and of
neighbouring seeds on all but one, so that differences between methods are not of scenes."""
RATES = {
    "success": "success_rate",
    "intermittent": "intermittent_rate",
    "collisions": "collision_rate",
}
"""What an env may tell of an episode -> the share of episodes in which it is above 0."""


def judge(make_env: MakeEnv, policy: Policy, episodes: int, seed: int) -> dict[str, Any]:
    """The policy's most likely actions over whole episodes, under the true reward.

    Args:
        make_env: makes the envs, one an episode.
        policy: the policy.
        episodes: how many.
        seed: the training's seed.
    """
    with closing(make_env(episodes, 0)) as env:
        numbers = evaluate(env.vector_env, policy.mean_action, seed + EVALUATION_SEED)
    spread = float(numbers["return"].std())
    means = {name: float(np.mean(values)) for name, values in outcomes(numbers).items()}
    return {"episodes": episodes, "return_sd": spread} | means


def outcomes(numbers: Mapping[str, Any]) -> dict[str, Any]:
    """Return and length of episodes, and the rates that the env tells; NaN has not happened."""
    known = {name: numbers[name] for name in ("return", "length")}
    return known | {
        rate: np.asarray(numbers[name]) > 0 for name, rate in RATES.items() if name in numbers
    }
