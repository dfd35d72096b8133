import dataclasses
import math

import gymnasium as gym
import pytest
from hypothesis import given
from hypothesis import strategies as st

import socialnav_env  # noqa: F401 (registers the env)
from socialnav_env.config import ConfigError, CorridorConfig

FIELDS = dataclasses.fields(CorridorConfig)
NUMBERS = [item for item in FIELDS if item.metadata]
WHOLE = [item for item in NUMBERS if item.metadata.get("whole")]
SWITCHES = [item for item in FIELDS if not item.metadata]


def test_every_field_is_a_number_with_a_range_or_a_switch():
    assert {item.name for item in SWITCHES} == {"terminate_on_goal", "terminate_on_collision"}
    for item in NUMBERS:
        assert item.metadata["low"] <= item.default <= item.metadata["high"]


def test_an_unknown_keyword_is_named_with_all_valid_ones():
    with pytest.raises(ConfigError, match="unknown keyword num_people") as error:
        gym.make("SocialCorridor-v0", num_people=3)
    for name in ["render_mode", "render_width", *(item.name for item in FIELDS)]:
        assert name in str(error.value)


def test_several_unknown_keywords_are_all_named():
    with pytest.raises(ConfigError, match="unknown keyword first, second"):
        CorridorConfig.from_keywords(second=1, first=2)


@pytest.mark.parametrize("item", NUMBERS, ids=lambda item: item.name)
@pytest.mark.parametrize("bad", ["below", "above", math.nan, math.inf, "3", None, True])
def test_a_value_out_of_range_is_named_with_its_range(item, bad):
    low, high = item.metadata["low"], item.metadata["high"]
    value = {"below": low - 1, "above": high + 1}.get(bad, bad)
    with pytest.raises(ConfigError, match=rf"{item.name}=.*expected a .*number in \[") as error:
        CorridorConfig(**{item.name: value})
    assert f"[{low:g}, {high:g}]" in str(error.value)


@pytest.mark.parametrize("item", WHOLE, ids=lambda item: item.name)
def test_a_count_is_whole(item):
    with pytest.raises(ConfigError, match=f"{item.name}=2.5: expected a whole number"):
        CorridorConfig(**{item.name: 2.5})


@pytest.mark.parametrize("item", SWITCHES, ids=lambda item: item.name)
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
        assert named == name or (name == "half_length" and named.endswith("_z"))
    else:
        assert getattr(config, name) == value


def test_derived_numbers():
    config = CorridorConfig(timestep=0.02, frame_skip=5, human_speed=1.0, human_speed_std=0.1)
    assert config.dt == pytest.approx(0.1)
    assert config.human_top_speed == pytest.approx(1.3 * 1.2)
