"""What a finished training left, read back: its policy, its reward model, how its envs are made."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import socialnav_env  # noqa: F401 (registers the corridor)
from polite.experiments.benchmark.grid import Run
from polite.experiments.benchmark.settings import env_maker, env_preset
from polite.files import one_line, read_json_object
from polite.methods.preference_learning import MakeEnv
from polite.methods.presets import preset_of
from polite.policies.policy import Policy, load_policy
from polite.policies.vec_env import make_vec_env
from polite.rewards.files import load_reward_model
from polite.rewards.network import RewardModel
from polite.types import InvalidValueError, PoliteError

POLICY: Final = "policy.pt"
REWARD: Final = "reward.pt"
_WHERE: Final = "give a folder of `polite train`, or models/RUN of a folder of `polite benchmark`"


@dataclass(frozen=True)
class Trained:
    """A finished training."""

    env: str
    """Id of the env."""
    make_env: MakeEnv
    """Makes envs as they were in the training."""
    policy: Policy
    reward: RewardModel | None
    """None where the env's own reward paid."""
    title: str
    """Env, method and seed."""
    models: Path
    """The folder of the two models."""


def read_trained(folder: Path) -> Trained:
    """Read what a training left.

    Args:
        folder: of `polite train`, or `models/RUN` in the folder of `polite benchmark`.

    Raises:
        PoliteError: if it is neither, the training is not finished, or a file is damaged.
    """
    if (folder / "models" / POLICY).is_file():
        return _of_training(folder)
    if (folder / POLICY).is_file():
        return _of_grid(folder)
    raise PoliteError(f"{folder} holds no trained policy; {_WHERE}")


def _of_training(folder: Path) -> Trained:
    with _settings(folder / "results.json", "config") as config:
        env, method, settings = config["env"], config["method"], preset_of(config["env"]).settings
        budget = "" if method in ("ground-truth", "sac") else f"-{config['queries']}"
        title = f"{env}, {method}{budget}, seed {config['seed']}"
    return _read(
        folder / "models",
        env,
        lambda count, seed: make_vec_env(env, count, seed, **settings),
        title,
    )


def _of_grid(folder: Path) -> Trained:
    with _settings(folder.parent.parent / "runs" / f"{folder.name}.json", "run") as settings:
        run = Run(**settings)
        make_env = env_maker(run, env_preset(run))
        parts = (run.env, run.label, run.highlights, run.variant, f"seed {run.seed}")
    return _read(folder, run.env, make_env, ", ".join(part for part in parts if part))


@contextmanager
def _settings(path: Path, name: str) -> Iterator[dict[str, Any]]:
    """The settings in a file; what is wrong with them in the body is the file's fault.

    Raises:
        PoliteError: naming the file.
    """
    content = read_json_object(path, _WHERE)
    try:
        yield content[name]
    except (AttributeError, KeyError, TypeError, InvalidValueError) as error:
        raise PoliteError(f"{path}: expected {name!r} of a training ({one_line(error)})") from error


def _read(models: Path, env: str, make_env: MakeEnv, title: str) -> Trained:
    rewarded = (models / REWARD).exists()
    return Trained(
        env=env,
        make_env=make_env,
        policy=load_policy(models / POLICY),
        reward=load_reward_model(models / REWARD) if rewarded else None,
        title=title,
        models=models,
    )
