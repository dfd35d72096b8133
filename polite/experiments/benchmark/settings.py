"""From a run's names to the settings of its training."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

from polite.experiments.benchmark.grid import Run
from polite.methods.config import METHODS, LearningConfig, Schedule
from polite.methods.preference_learning import MakeEnv
from polite.methods.presets import EnvPreset, preset_of
from polite.policies.vec_env import make_vec_env
from polite.rewards.network import FAST, PAPER
from polite.types import InvalidValueError

NETS: Final = {"smoke": FAST, "fast": FAST, "paper": PAPER}
"""The reward model of each of the grid's presets."""
VARIANTS: Final[Mapping[str, Mapping[str, Any]]] = {
    "": {},
    "no-termination": {"terminate_when_unhealthy": False},
}
"""Keywords of the env in each variant."""


def learning_config(run: Run) -> tuple[LearningConfig, EnvPreset]:
    """How a run is trained, and what is set for its env.

    Raises:
        InvalidValueError: if the run names something that is not known.
    """
    if run.preset not in NETS or run.variant not in VARIANTS:
        raise InvalidValueError(
            f"expected a preset of {tuple(NETS)} and a variant of {tuple(VARIANTS)}, got {run}"
        )
    if run.highlights not in (None, "paper"):
        raise InvalidValueError(f"expected paper as the form of the highlights, got {run}")
    preset = preset_of(run.env)
    preset = replace(preset, settings={**preset.settings, **VARIANTS[run.variant]})
    if run.loss is not None:
        preset = replace(preset, training=replace(preset.training, preference=run.loss))
    config = LearningConfig(
        method=METHODS[run.method],
        queries=run.queries,
        steps=run.steps,
        schedule=Schedule(first_epochs=50, later_epochs=20) if _is_smoke(run) else Schedule(),
        net=NETS[run.preset],
        training=preset.training,
        ppo=preset.ppo,
    )
    return config, preset


def env_maker(run: Run, preset: EnvPreset) -> MakeEnv:
    """How a run's envs are made."""
    return lambda count, seed: make_vec_env(run.env, count, seed, **preset.settings)


def _is_smoke(run: Run) -> bool:
    return run.preset == "smoke"
