from dataclasses import replace
from pathlib import Path
from typing import Any, get_args, get_type_hints

import numpy as np
import pytest

from polite.experiments.training.config import MOST_SESSIONS, TrainConfig
from polite.experiments.training.env_settings import parse_env_settings
from polite.experiments.training.settings import (
    FORMS,
    adapt_preset,
    learning_config,
    pebble_settings,
    teacher_maker,
)
from polite.methods.config import METHODS
from polite.methods.pairs import PAIR_SAMPLERS
from polite.methods.pebble_config import PEBBLE_METHODS, REFERENCE_STEPS, PebbleSchedule
from polite.methods.presets import OWN_FORM, PRESETS, EnvPreset
from polite.methods.schedules import EPOCHS, SCHEDULES, Schedule
from polite.policies.sac import SacConfig
from polite.rewards.network import PAPER, RewardNetConfig
from polite.samplers import uniform_pairs
from polite.teachers.bpref import BPREF_TEACHERS
from polite.types import InvalidValueError, SegmentPool

WALKER = PRESETS["Walker2d"]
CONFIG = TrainConfig(out=Path("unused"))


def make_pool(size=60, seed=0):
    rng = np.random.default_rng(seed)
    return SegmentPool(
        observations=rng.normal(size=(size, 20, 2)),
        actions=rng.normal(size=(size, 20, 1)),
        rewards=rng.normal(1.0, 2.0, (size, 20)),
        states=np.zeros((size, 20, 1)),
        lengths=rng.integers(5, 20, size, endpoint=True),
        trajectory=np.zeros(size),
        start=np.zeros(size),
    )


POOL = make_pool()
QUERIES = uniform_pairs(400, np.random.default_rng(1), POOL)


def answers(preset=WALKER, **changes):
    config = replace(CONFIG, **changes)
    teacher = teacher_maker(config, adapt_preset(preset, config))(POOL)
    return teacher(POOL, QUERIES, np.random.default_rng(2))


def winner_is_better(answer):
    query = QUERIES[answer.query]
    gap = POOL.returns[query.first] - POOL.returns[query.second]
    return (gap > 0) == (answer.preferred == 0)


def expressed(given):
    return [answer for answer in given if answer.preferred is not None]


# --- names ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "known"),
    [
        ("teacher", {"polite", *BPREF_TEACHERS}),
        ("sampler", set(PAIR_SAMPLERS)),
        ("schedule", set(SCHEDULES)),
        ("method", {*METHODS, "given", *PEBBLE_METHODS}),
        ("preset", set(FORMS)),
        ("epochs", set(EPOCHS)),
    ],
)
def test_the_command_line_offers_all_there_is(name: str, known) -> None:
    assert set(get_args(get_type_hints(TrainConfig)[name])) == known


def test_without_a_wish_highlights_are_read_in_our_own_form() -> None:
    for preset in (*PRESETS.values(), EnvPreset()):
        own = preset.with_highlights(OWN_FORM)
        assert adapt_preset(preset, CONFIG) == own != preset
        expected = own.make_teacher(POOL)(POOL, QUERIES, np.random.default_rng(2))
        assert answers(preset) == expected
    learning = learning_config(CONFIG, WALKER)
    assert learning.schedule == Schedule() and learning.members == 1
    shown = learning_config(replace(CONFIG, show_ends=True), WALKER)
    assert shown == replace(learning, schedule=Schedule(show_ends=True))
    assert learning.sampler is PAIR_SAMPLERS["uniform"]


def test_the_papers_preset_is_the_papers_in_all() -> None:
    config = replace(CONFIG, preset="paper")
    adapted = adapt_preset(WALKER, config)
    learning = learning_config(config, adapted)
    assert (learning.net, learning.ppo) == (PAPER, WALKER.paper_ppo)
    assert learning.training.highlights == "paper"
    assert (learning.training.alpha_positive, learning.training.alpha_negative) == (10.0, 5.0)
    teacher = teacher_maker(config, adapted)(POOL)
    expected = WALKER.make_teacher(POOL)(POOL, QUERIES, np.random.default_rng(2))
    assert teacher(POOL, QUERIES, np.random.default_rng(2)) == expected
    both = adapt_preset(WALKER, replace(config, highlights="choice"))
    assert both.training.highlights == "choice" and both.net == PAPER


@pytest.mark.parametrize("schedule", SCHEDULES)
def test_a_schedule_keeps_its_sessions_whatever_the_epochs(schedule: Any) -> None:
    configs = (replace(CONFIG, schedule=schedule, epochs=epochs) for epochs in EPOCHS)
    released, few = (learning_config(config, WALKER).schedule for config in configs)
    assert released == SCHEDULES[schedule]
    assert few.plan(200, 1_000_000) == released.plan(200, 1_000_000)
    asked = [each.epochs(number, 20, 64, 1000) for each in (released, few) for number in (1, 2)]
    assert asked == [200, 50, 25, 6]


def test_network_step_size_and_sessions_are_those_that_were_asked_for() -> None:
    config = replace(CONFIG, reward_net=(8, 4), learning_rate=0.01, sessions=3)
    learning = learning_config(config, adapt_preset(WALKER, config))
    assert learning.net == RewardNetConfig((8, 4), (0.0, 0.0))
    assert learning.ppo == replace(WALKER.ppo, learning_rate=0.01)
    assert learning.schedule == Schedule(sessions=3)
    config = replace(config, method="pebble", steps=REFERENCE_STEPS)
    pebble = pebble_settings(config, adapt_preset(WALKER, config))
    assert pebble.net == learning.net
    assert pebble.sac == replace(SacConfig(), learning_rate=0.01)
    assert pebble.schedule == PebbleSchedule(sessions=3)
    paper = replace(CONFIG, preset="paper", reward_net=(8,), learning_rate=0.01)
    learning = learning_config(paper, adapt_preset(WALKER, paper))
    assert learning.net == RewardNetConfig((8,), (0.0,))
    assert WALKER.paper_ppo is not None
    assert learning.ppo == replace(WALKER.paper_ppo, learning_rate=0.01)


def test_as_many_sessions_can_be_asked_for_as_a_training_has_room_for() -> None:
    config = replace(CONFIG, queries=1000, sessions=MOST_SESSIONS)
    plan = learning_config(config, WALKER).schedule.plan(1000, 100_000)
    assert len(plan) == MOST_SESSIONS and plan[-1].at < 100_000
    with pytest.raises(InvalidValueError, match="sessions"):
        Schedule(sessions=MOST_SESSIONS + 1)


def test_pebble_has_as_many_sessions_as_there_is_time_for() -> None:
    config = replace(CONFIG, method="pebble", steps=2 * REFERENCE_STEPS, sessions=25)
    assert pebble_settings(config, WALKER).schedule.sessions == 25
    with pytest.raises(InvalidValueError, match="sessions: 500,000 steps have time for 25, got 26"):
        pebble_settings(replace(config, sessions=26), WALKER)


def test_pebble_learns_by_the_envs_loss() -> None:
    for method, highlights in (("pebble", False), ("polite-pebble", True)):
        config = replace(CONFIG, method=method, loss="released")
        pebble = pebble_settings(config, adapt_preset(WALKER, config))
        assert pebble.method.highlights == highlights and pebble.method.preferences
        assert pebble.training.preference == "released"
        assert pebble.training.highlights == OWN_FORM
        assert pebble.training.stop_accuracy == 0.97


@pytest.mark.parametrize("schedule", ["decaying", "up-front"])
def test_other_schedules_have_a_number_of_sessions_of_their_own(schedule: Any) -> None:
    with pytest.raises(InvalidValueError, match="sessions: only for --schedule sessions"):
        replace(CONFIG, schedule=schedule, sessions=10)


@pytest.mark.parametrize(
    "change",
    [
        {"schedule": "up-front"},
        {"sampler": "entropy"},
        {"members": 5},
        {"epochs": "few"},
        {"show_ends": True},
        {"normalise": True},
        {"reward_offset": 1.0},
        {"validation_share": 0.2},
        {"preset": "paper"},
    ],
)
def test_what_pebble_would_not_heed_is_refused(change) -> None:
    with pytest.raises(InvalidValueError, match=next(iter(change))):
        replace(CONFIG, method="pebble", **change)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"method": "given"}, "reward: expected the file"),
        ({"reward": Path("reward.pt")}, "reward: expected the file"),
        ({"method": "untrained", "reward": Path("reward.pt")}, "reward: expected the file"),
        (
            {"method": "given", "reward": Path("reward.pt"), "members": 3},
            "members: given has no use",
        ),
        (
            {"method": "given", "reward": Path("reward.pt"), "reward_net": (8,)},
            "reward_net: given has no use",
        ),
        (
            {"method": "given", "reward": Path("reward.pt"), "reward_offset": np.nan},
            "reward_offset: expected a finite",
        ),
    ],
)
def test_a_given_reward_model_comes_with_its_method_and_nothing_learns(change, says) -> None:
    with pytest.raises(InvalidValueError, match=says):
        replace(CONFIG, **change)


# --- teachers ------------------------------------------------------------------------------------


def test_the_default_teacher_errs_and_b_pref_s_oracle_does_not() -> None:
    polite, oracle = expressed(answers()), expressed(answers(teacher="oracle"))
    assert np.mean([winner_is_better(answer) for answer in polite]) == pytest.approx(0.9, abs=0.06)
    assert all(winner_is_better(answer) for answer in oracle)
    assert len(oracle) == 400 > len(polite)  # who skips ties


@pytest.mark.parametrize("name", BPREF_TEACHERS)
def test_b_pref_s_teachers_mark_what_the_env_s_oracle_marks(name: str) -> None:
    known = {answer.query: answer for answer in answers()}
    same = 0
    for answer in expressed(answers(teacher=name)):
        other = known[answer.query]
        if other.preferred == answer.preferred and other.marked == answer.marked:
            assert (answer.positive, answer.negative) == (other.positive, other.negative)
            same += 1
    assert same > 100


def test_a_teacher_s_own_number_is_heeded_and_another_s_refused() -> None:
    sure, unsure = (
        np.mean([winner_is_better(a) for a in answers(teacher="stochastic", rationality=beta)])
        for beta in (100.0, 1e-3)
    )
    assert sure > 0.97 and unsure == pytest.approx(0.5, abs=0.1)
    for teacher in ("skip", "equal"):
        few, many = (
            sum(a.preferred is None for a in answers(teacher=teacher, average_return=mean))
            for mean in (1.0, 100.0)
        )
        assert few < many
    for change in ({"rationality": 1.0}, {"average_return": 1.0}):
        with pytest.raises(InvalidValueError, match=next(iter(change))):
            replace(CONFIG, teacher="mistake", **change)


@pytest.mark.parametrize("number", [-1.0, np.inf, np.nan])
def test_a_teacher_s_number_is_a_number(number: float) -> None:
    for change in (("stochastic", "rationality"), ("skip", "average_return")):
        with pytest.raises(InvalidValueError, match=change[1]):
            replace(CONFIG, teacher=change[0], **{change[1]: number})


def test_highlights_can_stay_with_the_true_winner() -> None:
    labelled, true = answers(teacher="mistake"), answers(teacher="mistake", marks="true-winner")
    assert [a.preferred for a in labelled] == [a.preferred for a in true]
    for one, other in zip(expressed(labelled), expressed(true), strict=True):
        assert not one.marks_other
        assert other.marks_other == (not winner_is_better(other))


def test_highlights_go_wrong_as_often_as_asked_and_preferences_stay() -> None:
    clean = answers()
    for change in ("missed", "wrong_sign", "shifted"):
        noisy = answers(**{f"highlights_{change}": 0.4})
        assert [a.preference for a in noisy] == [a.preference for a in clean]
        marked = [
            (one, other)
            for one, other in zip(clean, noisy, strict=True)
            if one.positive is not None
        ]
        share = np.mean([one.positive != other.positive for one, other in marked])
        assert share == pytest.approx(0.4, abs=0.1)


# --- losses --------------------------------------------------------------------------------------


def test_teacher_and_loss_agree_on_the_length_of_a_highlight() -> None:
    config = replace(CONFIG, highlight_length=3, highlight_decay=0.5, loss="released")
    for preset in (WALKER, EnvPreset()):
        adapted = adapt_preset(preset, config)
        training = adapted.training
        assert (training.highlight_length, training.highlight_decay) == (3, 0.5)
        assert training.preference == "released"
        given = teacher_maker(config, adapted)(POOL)(POOL, QUERIES, np.random.default_rng(0))
        lengths = {answer.positive.length for answer in given if answer.positive is not None}
        assert lengths == {3}


def test_a_form_of_the_highlight_loss_is_taken_by_its_name() -> None:
    adapted = adapt_preset(WALKER, replace(CONFIG, highlights="choice"))
    assert adapted.training.highlights == "choice"
    with pytest.raises(InvalidValueError, match="choice"):
        adapt_preset(WALKER, replace(CONFIG, highlights="chioce"))


def test_an_infinite_offset_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="reward_offset: expected a finite number"):
        replace(CONFIG, reward_offset=np.inf)


def test_the_reward_model_s_options_reach_it() -> None:
    config = replace(CONFIG, normalise=True, validation_share=0.25, reward_offset=1.5)
    learning = learning_config(config, adapt_preset(WALKER, config))
    assert learning.normalise and learning.training.validation_share == 0.25
    assert learning.reward_offset == 1.5


# --- the env -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("method", "change"),
    [
        ("ground-truth", {"normalise": True}),
        ("ground-truth", {"reward_offset": 1.0}),
        ("sac", {"reward_offset": 1.0}),
        ("ground-truth", {"validation_share": 0.2}),
        ("untrained", {"validation_share": 0.2}),
        ("highlights", {"validation_share": 0.2}),
        ("highlights", {"loss": "released"}),
        ("ground-truth", {"members": 5}),
        ("ground-truth", {"sampler": "disagreement"}),
        ("ground-truth", {"teacher": "stochastic", "rationality": 3.0}),
        ("ground-truth", {"schedule": "decaying"}),
        ("ground-truth", {"show_ends": True}),
        ("ground-truth", {"reward_net": (8,)}),
        ("untrained", {"sessions": 3}),
        ("sac", {"sessions": 3}),
        ("sac", {"reward_net": (8,)}),
        ("untrained", {"teacher": "skip"}),
        ("sac", {"loss": "released"}),
        ("sac", {"teacher": "mistake"}),
        ("preferences", {"highlights": "rival"}),
        ("preferences", {"highlights_missed": 0.5}),
        ("preferences", {"marks": "true-winner"}),
        ("pebble", {"highlight_length": 3}),
    ],
)
def test_what_a_method_would_not_heed_is_refused(method: str, change) -> None:
    with pytest.raises(InvalidValueError, match=next(iter(change))):
        replace(CONFIG, method=method, **change)


def test_keywords_of_the_env_are_json() -> None:
    asked = ("terminate_when_unhealthy=false", "ctrl_cost_weight=0.5", 'word="a=b"')
    expected = {"terminate_when_unhealthy": False, "ctrl_cost_weight": 0.5, "word": "a=b"}
    assert parse_env_settings(asked) == expected
    preset = PRESETS["SocialCorridor"]
    config = replace(CONFIG, env_settings=("terminate_on_goal=true",))
    adapted = adapt_preset(preset, config).settings
    assert adapted == {**preset.settings, "terminate_on_goal": True}


@pytest.mark.parametrize(
    "settings",
    [
        ("",),
        ("name",),
        ("name=",),
        ("name=word",),
        ("=1",),
        ("a b=1",),
        ("a=1", "a=2"),
        ("seed=1",),
    ],
)
def test_what_is_no_keyword_is_refused(settings: tuple[str, ...]) -> None:
    with pytest.raises(InvalidValueError, match="env_settings"):
        replace(CONFIG, env_settings=settings)


# --- mistakes ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "change",
    [
        {"members": 0},
        {"members": "three"},
        {"members": True},
        {"learning_rate": True},
        {"normalise": "no"},
        {"reward_net": 32},
        {"reward_net": None},
        {"reward_net": (True,)},
        {"average_return": "high", "teacher": "skip"},
        {"reward_net": (32, 0)},
        {"reward_net": ("wide",)},
        {"learning_rate": 0.0},
        {"learning_rate": float("nan")},
        {"sessions": 0},
        {"sessions": MOST_SESSIONS + 1},
        {"sessions": 11, "queries": 10},
        {"sessions": 2.5},
        {"highlights_missed": 1.5},
        {"highlights_wrong_sign": -0.1},
        {"highlights_shifted": float("nan")},
        {"sampler": "entropy", "schedule": "up-front"},
    ],
)
def test_impossible_settings_are_refused(change) -> None:
    with pytest.raises(InvalidValueError, match=f"{next(iter(change))}: expected"):
        replace(CONFIG, **change)


def test_a_sampler_that_compares_models_needs_several() -> None:
    config = replace(CONFIG, sampler="disagreement")
    with pytest.raises(InvalidValueError, match="members ≥ 2"):
        learning_config(config, WALKER)
    assert learning_config(replace(config, members=3), WALKER).members == 3
