import dataclasses
import math

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import socialnav_env  # noqa: F401 (registers the env)
from socialnav_env.config import DOORWAY_WALL, SCENARIOS, ConfigError, CorridorConfig

FIELDS = dataclasses.fields(CorridorConfig)
NUMBERS = [item for item in FIELDS if "low" in item.metadata]
WHOLE = [item for item in NUMBERS if item.metadata.get("whole")]
WORDS = [item for item in FIELDS if "choices" in item.metadata]
SWITCHES = [item for item in FIELDS if isinstance(item.default, bool)]


def by_name(items):
    return pytest.mark.parametrize("item", items, ids=lambda item: item.name)


def test_every_field_is_a_number_with_a_range_or_a_word_or_a_switch():
    assert len(NUMBERS) + len(WORDS) + len(SWITCHES) == len(FIELDS)
    for item in NUMBERS:
        assert item.metadata["low"] <= item.default <= item.metadata["high"]
    for item in WORDS:
        assert item.default == item.metadata["choices"][0]


def test_an_unknown_keyword_is_named_with_all_valid_ones():
    with pytest.raises(ConfigError, match="unknown keyword num_people") as error:
        gym.make("SocialCorridor-v0", num_people=3)
    others = ["render_mode", "render_width", "camera", "overlays", "scenario"]
    for name in [*others, *(item.name for item in FIELDS)]:
        assert f" {name}" in str(error.value)


def test_several_unknown_keywords_are_all_named():
    with pytest.raises(ConfigError, match="unknown keyword first, second"):
        CorridorConfig.from_keywords(second=1, first=2)


@by_name(NUMBERS)
@pytest.mark.parametrize("bad", ["below", "above", math.nan, math.inf, "3", None, True])
def test_a_value_out_of_range_is_named_with_its_range(item, bad):
    low, high = item.metadata["low"], item.metadata["high"]
    value = {"below": low - 1, "above": high + 1}.get(bad, bad)
    with pytest.raises(ConfigError, match=rf"{item.name}=.*expected a .*number in \[") as error:
        CorridorConfig(**{item.name: value})
    assert f"[{low:g}, {high:g}]" in str(error.value)


@by_name(WHOLE)
def test_a_count_is_whole(item):
    with pytest.raises(ConfigError, match=f"{item.name}=2.5: expected a whole number"):
        CorridorConfig(**{item.name: 2.5})


@by_name(WORDS)
@pytest.mark.parametrize("bad", ["", "crosss", 0, None, True, ["cross"]])
def test_a_word_that_cannot_be_is_named_with_those_that_can(item, bad):
    with pytest.raises(ConfigError, match=f"{item.name}=.*expected one of") as error:
        CorridorConfig(**{item.name: bad})
    assert str(error.value).endswith(", ".join(item.metadata["choices"]))


@by_name(WORDS)
def test_every_word_is_taken(item):
    for word in item.metadata["choices"]:
        assert getattr(CorridorConfig(**{item.name: word}), item.name) == word


@by_name(SWITCHES)
@pytest.mark.parametrize("bad", [0, 1.0, "yes", None])
def test_a_switch_is_true_or_false(item, bad):
    with pytest.raises(ConfigError, match=f"{item.name}=.*expected True or False"):
        CorridorConfig(**{item.name: bad})


@pytest.mark.parametrize("name", ["start_z", "intermittent_z", "goal_z"])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_an_anchor_lies_inside_the_corridor(name, side):
    edge = 10.0 - CorridorConfig().robot_radius
    inside = {"half_length": 10.0, "start_z": -9.0, "intermittent_z": 0.0, "goal_z": 9.0}
    CorridorConfig(**{**inside, name: side * edge})
    with pytest.raises(ConfigError, match=f"{name}=.*outside the corridor"):
        CorridorConfig(**{**inside, name: side * (edge + 0.01)})


anything = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=3), st.lists(st.none())
)


@given(st.sampled_from([item.name for item in FIELDS]), anything)
def test_whatever_is_given_is_taken_as_it_is_or_refused_by_name(name, value):
    try:
        config = CorridorConfig(**{name: value})
    except ConfigError as error:
        named = str(error).split("=")[0]
        assert named == name or (name, named) in {
            ("half_length", anchor) for anchor in ("start_z", "intermittent_z", "goal_z")
        }
    else:
        assert getattr(config, name) == value


# --- scenarios -----------------------------------------------------------------------------------


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_a_scenario_is_a_start_for_the_keywords_which_win(scenario):
    config = CorridorConfig.from_keywords(scenario=scenario)
    assert config == CorridorConfig(**SCENARIOS[scenario])
    changed = CorridorConfig.from_keywords(scenario=scenario, num_humans=7, half_width=2.5)
    assert changed == dataclasses.replace(config, num_humans=7, half_width=2.5)


def test_scenarios_differ_and_the_papers_is_the_default():
    configs = [CorridorConfig.from_keywords(scenario=name) for name in SCENARIOS]
    assert len(set(configs)) == len(configs)
    assert CorridorConfig.from_keywords() == CorridorConfig.from_keywords("paper")


@pytest.mark.parametrize("bad", ["empt", "", None, 3, ["paper"]])
def test_an_unknown_scenario_is_named_with_all_valid_ones(bad):
    with pytest.raises(ConfigError, match=r"scenario=.*expected one of") as error:
        CorridorConfig.from_keywords(scenario=bad)
    assert all(name in str(error.value) for name in SCENARIOS)


# --- the doorway ---------------------------------------------------------------------------------


def test_everybody_passes_a_doorway():
    sizes = {"robot_radius": 0.4, "human_radius": 0.3, "half_width": 2.5}
    for width in (0.0, 1.4, 3.3, 5.0):
        CorridorConfig(doorway_width=width, **sizes)
    for width in (0.1, 1.39, 5.01):
        with pytest.raises(ConfigError, match=rf"doorway_width={width}: .*\[1.4, 5\]"):
            CorridorConfig(doorway_width=width, **sizes)


def test_a_doorway_leaves_room_on_both_of_its_sides():
    CorridorConfig(doorway_width=2.0, doorway_z=-13.0)
    with pytest.raises(ConfigError, match=r"doorway_z=13.1 .*\[-13, 13\]"):
        CorridorConfig(doorway_width=2.0, doorway_z=13.1)
    CorridorConfig(doorway_width=0.0, doorway_z=14.9)  # no wall
    with pytest.raises(ConfigError, match=r"doorway_z=13.0 .*\[-12.4, 12.4\]"):
        CorridorConfig(doorway_width=2.6, doorway_z=13.0, human_radius=1.0)


def test_the_jamb_is_where_the_rounded_end_of_the_wall_has_its_middle():
    assert CorridorConfig().jamb == 0.0
    assert CorridorConfig(doorway_width=1.8).jamb == pytest.approx(0.9 + 0.5 * DOORWAY_WALL)


# --- time ----------------------------------------------------------------------------------------


def test_nobodys_centre_gets_into_a_wall_or_past_another_one_in_one_physics_step():
    # a robot of radius .3 at .83 m/s
    alone = {"num_humans": 0, "doorway_width": 2.0, "frame_skip": 1}
    CorridorConfig(timestep=0.36, **alone)
    with pytest.raises(ConfigError, match=r"timestep=0.37: .*at most 0.361 s"):
        CorridorConfig(timestep=0.37, **alone)
    # a person of radius .3, whose top speed is 1.3 * (1 + 2 * .15) = 1.69 m/s
    CorridorConfig(timestep=0.177, frame_skip=1)
    with pytest.raises(ConfigError, match=r"timestep=0.178: .*at most 0.178 s"):
        CorridorConfig(timestep=0.178, frame_skip=1)


def test_pictures_come_at_least_once_a_second():
    assert CorridorConfig().frames_per_second == 10
    assert CorridorConfig(timestep=0.1, frame_skip=4).frames_per_second == 2
    slow = CorridorConfig(timestep=0.1, frame_skip=20, relaxation_time=2.0)
    assert slow.frames_per_second == 1


def test_an_env_step_is_no_longer_than_people_take_to_take_up_speed():
    CorridorConfig(relaxation_time=0.1)
    with pytest.raises(ConfigError, match=r"timestep \* frame_skip = 0.1 s: expected at most 0.09"):
        CorridorConfig(relaxation_time=0.09)
    CorridorConfig(relaxation_time=0.09, num_humans=0, frame_skip=20)
    with pytest.raises(ConfigError, match=r"= 1.05 s: expected at most 1 s"):
        CorridorConfig(num_humans=0, frame_skip=21)


@pytest.mark.parametrize(
    ("name", "value", "kept"),
    [
        ("num_humans", np.int64(4), 4),
        ("human_speed", np.float32(0.5), 0.5),
        ("reactive", np.bool_(False), False),
        ("walking", np.str_("queue"), "queue"),
    ],
)
def test_numpy_values_are_taken_and_kept_as_pythons_own(name, value, kept):
    config = CorridorConfig(**{name: value})
    assert getattr(config, name) == kept
    assert type(getattr(config, name)) is type(kept)


def test_derived_numbers():
    config = CorridorConfig(timestep=0.02, frame_skip=5, human_speed=1.0, human_speed_std=0.1)
    assert config.dt == pytest.approx(0.1)
    assert config.human_top_speed == pytest.approx(1.3 * 1.2)
