"""A finished training, read back: its policy, its reward model, how its envs are made."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import socialnav_env  # noqa: F401 (registers the corridor)
from polite.analysis.benchmark_records import UNASKED
from polite.experiments.benchmark.grid import Run
from polite.experiments.benchmark.settings import env_preset
from polite.experiments.training.models import POLICY, Reward, load_models
from polite.files import one_line, read_json_object
from polite.methods.presets import preset_of
from polite.policies.policy import Policy
from polite.policies.vec_env import GymnasiumVecEnv, make_vec_env
from polite.types import InvalidValueError, PoliteError

_UNASKED: Final = UNASKED | {"sac", "given"}
_FINISH: Final = "finish the training with --resume"


@dataclass(frozen=True)
class Trained:
    """A finished training."""

    env: str
    """Id of the env."""
    settings: Mapping[str, Any]
    """The env's keywords, as they were in the training."""
    policy: Policy
    reward: Reward
    title: str
    """Env, method and seed."""
    models: Path
    """The folder of the two models."""

    def make_env(self, count: int, seed: int) -> GymnasiumVecEnv:
        """So many envs that step together, as they were in the training."""
        return make_vec_env(self.env, count, seed, **self.settings)


def read_trained(folder: Path) -> Trained:
    """Read what a training left.

    Args:
        folder: of `polite train`, or `models/RUN` in the folder of `polite benchmark`.

    Raises:
        PoliteError: if it is neither, the training is not finished, or a file is damaged.
    """
    folder = folder.absolute()  # a grid's record lies beside its models
    if (folder / "models" / POLICY).is_file():
        return _of_training(folder)
    if (folder / POLICY).is_file():
        if folder.name == "models":
            raise PoliteError(f"{folder} holds the models of a training; give {folder.parent}")
        return _of_grid(folder)
    raise PoliteError(
        f"{folder} holds no trained policy; give the folder of a finished `polite train`, or "
        "models/RUN in the folder of `polite benchmark`"
    )


def _of_training(folder: Path) -> Trained:
    with _settings(folder / "results.json", "config") as config:
        env, method, seed = config["env"], config["method"], config["seed"]
        label = method if method in _UNASKED else f"{method}-{config['queries']}"
        settings = {**preset_of(env).settings, **config.get("env_settings", {})}
    policy, reward = load_models(folder / "models")
    return Trained(
        env=env,
        settings=settings,
        policy=policy,
        reward=reward,
        title=f"{env}, {label}, seed {seed}",
        models=folder / "models",
    )


def _of_grid(folder: Path) -> Trained:
    with _settings(folder.parent.parent / "runs" / f"{folder.name}.json", "run") as settings:
        run = Run(**settings)
        keywords = env_preset(run).settings
    parts = (run.env, run.label, run.highlights, run.variant, f"seed {run.seed}")
    policy, reward = load_models(folder)
    return Trained(
        env=run.env,
        settings=keywords,
        policy=policy,
        reward=reward,
        title=", ".join(part for part in parts if part),
        models=folder,
    )


@contextmanager
def _settings(path: Path, name: str) -> Iterator[dict[str, Any]]:
    """The settings in a file; what is wrong with them in the body is the file's fault.

    Raises:
        PoliteError: naming the file.
    """
    content = read_json_object(path, _FINISH)
    try:
        yield content[name]
    except KeyError as error:
        raise PoliteError(f"{path}: expected {error}, which it lacks; {_FINISH}") from error
    except (AttributeError, TypeError, InvalidValueError) as error:
        raise PoliteError(
            f"{path}: expected the settings of a training, {name!r} ({one_line(error)}); {_FINISH}"
        ) from error
