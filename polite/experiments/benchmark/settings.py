"""From a run's names to the settings of its training, and a mark that tells settings apart."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import Field, dataclass, field, fields, is_dataclass, replace
from functools import cache
from typing import Any, Final

from polite.experiments.benchmark.grid import Run
from polite.methods.config import METHODS, LearningConfig, Schedule
from polite.methods.pebble_config import (
    PEBBLE_METHODS,
    PebbleConfig,
    pebble_config,
    with_loss_of,
)
from polite.methods.preference_learning import RANDOM_SEGMENTS, MakeEnv
from polite.methods.presets import EnvPreset, preset_of
from polite.methods.schedules import EPOCHS, LATER, SCHEDULES, EqualUpdates
from polite.policies.sac import SacConfig
from polite.policies.vec_env import make_vec_env
from polite.rewards.network import FAST
from polite.teachers.noise import CARELESS, HighlightNoise
from polite.types import InvalidValueError

PRESETS: Final = ("smoke", "fast", "paper")
"""Of the grid; paper has the paper's reward network and PPO."""


@dataclass(frozen=True)
class Variant:
    """Another way to train; without settings of its own it is the plain one."""

    env: Mapping[str, Any] = field(default_factory=dict)
    """Keywords of the env."""
    schedule: Schedule = SCHEDULES["sessions"]
    """When the teacher is asked, and how often the reward model is updated; PPO's methods only."""
    shuffled: bool = False
    """Whether the highlights of a session are dealt out anew among its answers."""
    noise: HighlightNoise = field(default_factory=HighlightNoise)
    """How often highlights go wrong."""
    pay: Mapping[str, Any] = field(default_factory=dict)
    """Settings of `LearningConfig` that tell how r̂ pays; PPO's methods only."""

    @property
    def of_highlights(self) -> bool:
        """Whether it means nothing where there are no highlights."""
        return self.shuffled or self.noise != HighlightNoise()


VARIANTS: Final[Mapping[str, Variant]] = {
    "": Variant(),
    "no-termination": Variant(env={"terminate_when_unhealthy": False}),
    "shuffled": Variant(shuffled=True),
    "noisy": Variant(noise=CARELESS),
    "equal-updates": Variant(schedule=EqualUpdates(reference=200)),  # as many as the headline's
    "few-epochs": Variant(schedule=Schedule().with_epochs(EPOCHS["few"])),
    "raised": Variant(pay={"normalise": True, "reward_offset": 2.0}),
}
"""By the names that runs have for them."""
SMOKE: Final[Mapping[str, Any]] = {"sessions": 4, "first_epochs": 50, "later_epochs": 20}
SMOKE_PEBBLE: Final[Mapping[str, Any]] = {
    "net": FAST,
    "sac": SacConfig(hidden=(32, 32), batch_size=64),
}
"""What ends in seconds, to see that it runs."""


def learning_config(run: Run) -> tuple[LearningConfig, EnvPreset]:
    """How a run is trained by PPO, and what is set for its env.

    Raises:
        InvalidValueError: if the run names something that is not known.
    """
    preset, smoke = env_preset(run), run.preset == "smoke"
    variant = VARIANTS[run.variant]
    config = LearningConfig(
        method=METHODS[run.method],
        queries=run.queries,
        steps=run.steps,
        schedule=replace(variant.schedule, **(SMOKE if smoke else {})),
        net=preset.net,
        training=preset.training,
        ppo=preset.ppo,
        **variant.pay,
    )
    return config, preset


def pebble_settings(run: Run) -> tuple[PebbleConfig, EnvPreset]:
    """How a run is trained by PEBBLE, and what is set for its env.

    Raises:
        InvalidValueError: if the run names something that is not known.
    """
    preset, variant = env_preset(run), VARIANTS[run.variant]
    if variant.schedule != SCHEDULES["sessions"] or variant.pay:
        raise InvalidValueError(f"{run.variant} is a variant of the trainings by PPO, got {run}")
    config = pebble_config(
        run.queries,
        run.steps,
        method=PEBBLE_METHODS[run.method],
        training=with_loss_of(preset.training),
        **(SMOKE_PEBBLE if run.preset == "smoke" else {}),
    )
    return config, preset


def env_preset(run: Run) -> EnvPreset:
    """What is set for a run's env, whatever trains the policy.

    Raises:
        InvalidValueError: if the run names something that is not known.
    """
    if run.preset not in PRESETS or run.variant not in VARIANTS:
        raise InvalidValueError(
            f"expected a preset of {PRESETS} and a variant of {tuple(VARIANTS)}, got {run}"
        )
    variant = VARIANTS[run.variant]
    if variant.of_highlights and run.highlights is None:
        raise InvalidValueError(f"expected highlights that can be {run.variant}, got {run}")
    preset = preset_of(run.env)
    if run.preset == "paper":
        preset = preset.as_in_paper()
    if run.highlights is not None:
        preset = preset.with_highlights(run.highlights)
    preset = replace(
        preset,
        settings={**preset.settings, **variant.env},
        shuffled=variant.shuffled,
        noise=variant.noise,
    )
    if run.loss is not None:
        preset = replace(preset, training=replace(preset.training, preference=run.loss))
    return preset


def env_maker(run: Run, preset: EnvPreset) -> MakeEnv:
    """How a run's envs are made."""
    return lambda count, seed: make_vec_env(run.env, count, seed, **preset.settings)


def fingerprint(run: Run) -> str:
    """A short SHA-256 of all that is set for a run, so that its record tells what made it.

    It changes with every setting, a new one included; the seed is in the run's own description. Not
    with constants in the code, nor with the versions of packages: those stand beside the times.

    Raises:
        InvalidValueError: if the run names something that is not known.
    """
    return _digest(replace(run, seed=0))


@cache
def _digest(run: Run) -> str:
    """Cached, because a board asks for every run of a grid, again and again."""
    return hashlib.sha256(canonical(run).encode("utf-8")).hexdigest()[:16]


def canonical(run: Run) -> str:
    """All that is set for a run as JSON, the same in every process; functions by their names.

    Raises:
        InvalidValueError: if the run names something that is not known.
    """
    settings = pebble_settings if run.method in PEBBLE_METHODS else learning_config
    config, preset = settings(run)
    resolved: dict[str, Any] = {
        "training": config,
        "oracle": preset.oracle,
        "marks_unusual": preset.marks_unusual,
        "env": preset.settings,
    }
    if isinstance(config, LearningConfig) and not config.method.true_reward:
        resolved["random_segments"] = RANDOM_SEGMENTS
    if preset.shuffled:  # absent otherwise: older runs keep their mark
        resolved["shuffled"] = True
    if preset.noise != HighlightNoise():
        resolved["noise"] = preset.noise
    return json.dumps(resolved, sort_keys=True, default=_plain)


def _telling(value: Any) -> Iterator[Field[Any]]:
    """The fields of a dataclass, without later ones that are at their defaults."""
    for each in fields(value):
        if not (each.metadata == LATER and getattr(value, each.name) == each.default):
            yield each


def _plain(value: Any) -> Any:
    """What JSON has no form for."""
    if is_dataclass(value) and not isinstance(value, type):
        return {each.name: getattr(value, each.name) for each in _telling(value)}
    if isinstance(value, Mapping):
        return dict(value)
    return value.__qualname__
