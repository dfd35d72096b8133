"""From the settings of one training to its parts: the learning, the env's preset, the teacher."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from polite.experiments.training.config import TrainConfig
from polite.experiments.training.env_settings import parse_env_settings
from polite.methods.config import METHODS, LearningConfig
from polite.methods.history import Teacher
from polite.methods.pairs import PAIR_SAMPLERS
from polite.methods.pebble_config import (
    NET,
    PEBBLE_METHODS,
    PebbleConfig,
    PebbleSchedule,
    pebble_config,
    with_loss_of,
)
from polite.methods.preference_learning import MakeTeacher
from polite.methods.presets import OWN_FORM, EnvPreset
from polite.methods.schedules import EPOCHS, SCHEDULES
from polite.policies.sac import SacConfig
from polite.rewards.network import RewardNetConfig
from polite.teachers.bpref import BPREF_TEACHERS, BPrefTeacher
from polite.teachers.noise import HighlightNoise, NoisyHighlights
from polite.teachers.quantile import QuantileOracle
from polite.types import InvalidValueError, SegmentPool

FORMS: Final = {"fast": OWN_FORM, "paper": "paper"}
"""What a highlight says under each preset."""


def learning_config(config: TrainConfig, preset: EnvPreset) -> LearningConfig:
    """The method's settings in this env.

    Raises:
        InvalidValueError: if the sampler needs more reward models than there are.
    """
    schedule = SCHEDULES[config.schedule]
    return LearningConfig(
        method=METHODS[config.method],
        queries=config.queries,
        steps=config.steps,
        schedule=replace(
            schedule,
            sessions=config.sessions or schedule.sessions,
            segment_length=config.segment_length,
            show_ends=config.show_ends,
        ).with_epochs(EPOCHS[config.epochs]),
        sampler=PAIR_SAMPLERS[config.sampler],
        net=preset.net,
        members=config.members,
        normalise=config.normalise,
        reward_offset=config.reward_offset,
        training=preset.training,
        ppo=preset.ppo,
    )


def pebble_settings(config: TrainConfig, preset: EnvPreset) -> PebbleConfig:
    """The settings of PEBBLE in this env.

    Raises:
        InvalidValueError: if the training is too short, for so many sessions or for any.
    """
    sac, schedule = SacConfig(), PebbleSchedule()
    pebble = pebble_config(
        config.queries,
        config.steps,
        method=PEBBLE_METHODS[config.method],
        schedule=replace(schedule, sessions=config.sessions or schedule.sessions),
        net=_net(config, NET),
        training=with_loss_of(preset.training),
        sac=replace(sac, learning_rate=config.learning_rate or sac.learning_rate),
    )
    if config.sessions is not None:
        planned = pebble.schedule.plan(pebble.queries, pebble.steps, pebble.first_session)
        if len(planned) < config.sessions:
            raise InvalidValueError(
                f"sessions: {pebble.steps:,} steps have time for {len(planned)}, got "
                f"{config.sessions}"
            )
    return pebble


def adapt_preset(preset: EnvPreset, config: TrainConfig) -> EnvPreset:
    """The preset with what the run changes of it; teacher and loss agree on L.

    Raises:
        InvalidValueError: if there is no such form of the highlight loss, or L or λ is none, or the
            share of held-out answers is none.
    """
    if config.preset == "paper":
        preset = preset.as_in_paper()
    preset = preset.with_highlights(config.highlights or FORMS[config.preset])
    changes = {
        name: getattr(config, name)
        for name in ("highlight_length", "highlight_decay")
        if getattr(config, name) is not None
    }
    training = replace(
        preset.training,
        preference=config.loss,
        validation_share=config.validation_share,
        **changes,
    )
    steps = config.segment_length
    if config.uses("highlight_length") and training.highlight_length >= steps:
        raise InvalidValueError(
            f"highlight_length: expected less than a clip's {steps} steps, got "
            f"{training.highlight_length}"
            + ("" if config.highlight_length else ", this env's own; give a shorter one")
        )
    oracle = preset.oracle and replace(preset.oracle, length=training.highlight_length)
    ppo = replace(preset.ppo, learning_rate=config.learning_rate or preset.ppo.learning_rate)
    return replace(
        preset,
        training=training,
        oracle=oracle,
        net=_net(config, preset.net),
        ppo=ppo,
        settings={**preset.settings, **parse_env_settings(config.env_settings)},
    )


def _net(config: TrainConfig, otherwise: RewardNetConfig) -> RewardNetConfig:
    """The reward network that was asked for."""
    hidden = tuple(config.reward_net)
    return replace(otherwise, hidden=hidden, dropout=(0.0,) * len(hidden)) if hidden else otherwise


def teacher_maker(config: TrainConfig, preset: EnvPreset) -> MakeTeacher:
    """From the first session's segments to who answers.

    B-Pref's teachers place highlights as the env's oracle does.
    """
    bpref = _bpref_teacher(config)
    noise = HighlightNoise(
        miss_probability=config.highlights_missed,
        wrong_sign_probability=config.highlights_wrong_sign,
        shift_probability=config.highlights_shifted,
    )

    def make(pool: SegmentPool) -> Teacher:
        oracle = replace(preset.oracle_for(pool), marks_labelled=config.marks == "labelled")
        teacher = oracle if bpref is None else bpref.marking_like(oracle)
        who = QuantileOracle(teacher) if preset.marks_unusual else teacher
        if noise == HighlightNoise():
            return who.answer_queries
        return NoisyHighlights(who.answer_queries, noise).answer_queries

    return make


def _bpref_teacher(config: TrainConfig) -> BPrefTeacher | None:
    """The teacher of B-Pref's that was asked for, with the numbers that were."""
    teacher = BPREF_TEACHERS.get(config.teacher)
    if teacher is not None and config.rationality is not None:
        teacher = replace(teacher, rationality=config.rationality)
    return teacher and replace(teacher, average_return=config.average_return)
