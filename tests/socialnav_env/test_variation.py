import copy
import dataclasses
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from socialnav_env.config import ConfigError, CorridorConfig
from socialnav_env.variation import NO_VARIATION, Variation, variation_from, variation_of

CONFIG = CorridorConfig(human_speed=2.0, human_speed_std=0.5, frame_skip=1)
FIELDS = dataclasses.fields(CorridorConfig)
VARYING = [item for item in FIELDS if item.metadata["varies"]]
NUMBERS = [item for item in VARYING if "low" in item.metadata]
OTHERS = [item for item in VARYING if "low" not in item.metadata]
FIXED = [item.name for item in FIELDS if not item.metadata["varies"]]


def by_name(items):
    return pytest.mark.parametrize("item", items, ids=lambda item: item.name)


def ends(item):
    """The range of a field in CONFIG: anchors lie inside, nobody is too fast for the bounds."""
    low, high = item.metadata["low"], item.metadata["high"]
    if item.name in ("start_z", "intermittent_z", "goal_z"):
        high = CONFIG.half_length - CONFIG.robot_radius
        low = -high
    if item.name in ("human_speed", "human_speed_std"):
        high = getattr(CONFIG, item.name)
    return low, high


def choices(item):
    return list(item.metadata.get("choices", (True, False)))


def draws(options, count=200, seed=0):
    variation, rng = variation_from(options, CONFIG), np.random.default_rng(seed)
    return [variation.draw(CONFIG, rng) for _ in range(count)]


# --- what can be drawn ---------------------------------------------------------------------------


@by_name(NUMBERS)
def test_a_range_of_numbers_is_drawn_from_evenly(item):
    low, high = ends(item)
    drawn = np.array([getattr(config, item.name) for config in draws({item.name: (low, high)})])
    assert (low <= drawn).all() and (drawn <= high).all()
    quarters, _ = np.histogram(drawn, bins=4, range=(low, high))
    assert (quarters > 25).all()  # of 200, 50 are expected in each


@by_name(NUMBERS)
def test_a_number_is_taken_as_it_is(item):
    low, high = ends(item)
    for value in (low, high, 0.5 * (low + high)):
        assert {getattr(config, item.name) for config in draws({item.name: value}, 3)} == {value}
        drawn = {getattr(config, item.name) for config in draws({item.name: (value, value)}, 3)}
        assert drawn == {value}


@by_name(OTHERS)
def test_a_list_is_chosen_from(item):
    drawn = [getattr(config, item.name) for config in draws({item.name: choices(item)})]
    shares = [drawn.count(value) / 200 for value in choices(item)]
    assert sum(shares) == 1.0 and min(shares) > 0.5 / len(shares)
    one = choices(item)[-1]
    assert {getattr(config, item.name) for config in draws({item.name: one}, 3)} == {one}
    assert {getattr(config, item.name) for config in draws({item.name: [one]}, 3)} == {one}


def test_the_rest_stays():
    options = {"human_speed": (0.5, 1.5), "walking": ["along", "mixed"], "reactive": False}
    for config in draws(options, 20):
        assert dataclasses.replace(config, **{name: getattr(CONFIG, name) for name in options}) == (
            CONFIG
        )


@given(st.integers(0, 2**32), st.lists(st.sampled_from(VARYING), unique=True))
def test_equal_seeds_give_equal_episodes(seed, items):
    options = {
        item.name: ends(item) if item in NUMBERS else choices(item) for item in items
    }  # fmt: skip
    assert draws(options, 5, seed) == draws(options, 5, seed)


def test_no_variation_is_the_config_itself_and_draws_nothing():
    rng = np.random.default_rng(0)
    before = rng.bit_generator.state
    assert NO_VARIATION.draw(CONFIG, rng) is CONFIG
    assert variation_from({}, CONFIG).draw(CONFIG, rng) is CONFIG
    assert rng.bit_generator.state == before
    assert variation_from({}, CONFIG) == NO_VARIATION


def test_settings_without_chance_draw_nothing():
    rng = np.random.default_rng(0)
    before = rng.bit_generator.state
    variation_from({"human_speed": 0.7, "walking": "along"}, CONFIG).draw(CONFIG, rng)
    assert rng.bit_generator.state == before


# --- what cannot ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [*FIXED, "num_people", ""])
def test_an_option_that_cannot_vary_is_named_with_all_that_can(name):
    with pytest.raises(ConfigError, match=f"unknown reset option {name}; valid are") as error:
        variation_from({name: 1.0}, CONFIG)
    assert all(item.name in str(error.value) for item in VARYING)


@by_name(NUMBERS)
@pytest.mark.parametrize("form", [lambda v: v, lambda v: (v, v), lambda v: [v]])
def test_a_number_out_of_range_is_named_with_its_range(item, form):
    low, high = item.metadata["low"], item.metadata["high"]
    for bad in (low - 1.0, high + 1.0, float("nan"), "3", None):
        with pytest.raises(ConfigError, match=f"{item.name}=.*expected a"):
            variation_from({item.name: form(bad)}, CONFIG)


@by_name(NUMBERS)
def test_a_range_with_one_end_outside_is_an_error(item):
    low, high = ends(item)
    for bad in ((low - 1.0, high), (low, item.metadata["high"] + 1.0)):
        with pytest.raises(ConfigError, match=f"{item.name}="):
            variation_from({item.name: bad}, CONFIG)


@by_name(VARYING)
@pytest.mark.parametrize(
    "bad", [(), (1.0,), (1.0, 0.5), (0.1, 0.2, 0.3), ("a", "b"), (True, False), (0.0, float("nan"))]
)
def test_a_range_is_two_numbers_in_order(item, bad):
    with pytest.raises(ConfigError, match=f"{item.name}=.*range \\(low, high\\) of two numbers"):
        variation_from({item.name: bad}, CONFIG)


@by_name(VARYING)
def test_there_is_something_to_choose_from(item):
    with pytest.raises(ConfigError, match=rf"{item.name}=\[\]: expected at least one value"):
        variation_from({item.name: []}, CONFIG)


@by_name(OTHERS)
@pytest.mark.parametrize("bad", ["no such word", 1, None, 0.5, (0.0, 1.0), {}])
def test_a_wrong_word_or_switch_is_named(item, bad):
    for value in (bad, [*choices(item), bad]):
        with pytest.raises(ConfigError, match=f"{item.name}=.*expected (one of|True or False)"):
            variation_from({item.name: value}, CONFIG)


@pytest.mark.parametrize("name", ["start_z", "intermittent_z", "goal_z"])
def test_an_anchor_stays_inside(name):
    with pytest.raises(ConfigError, match=rf"{name}=14.8 lies outside .*\[-14.7, 14.7\]"):
        variation_from({name: (0.0, 14.8)}, CONFIG)


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"human_speed": (1.0, 2.1)}, r"human_speed=2.1: .* 4.03 m/s"),
        ({"human_speed_std": 0.6}, r"human_speed_std=0.6: .* 4.16 m/s"),
        ({"human_speed_std": [0.1, 0.7], "human_speed": (1.0, 1.9)},
         r"human_speed=1.9, human_speed_std=0.7: .* 4.29 m/s"),
        ({"human_speed": 5.0, "human_speed_std": 1.0}, "human_speed=5.0, human_speed_std=1.0: "),
    ],
)  # fmt: skip
def test_nobody_is_faster_than_the_observations_bounds_say(options, named):
    for config in (CONFIG, dataclasses.replace(CONFIG, timestep=0.07)):
        with pytest.raises(ConfigError, match=f"{named}.*bounds allow for 3.9 m/s"):
            variation_from(options, config)


def test_only_the_joint_speed_matters():
    options = {"human_speed": (1.0, 2.5), "human_speed_std": [0.0, 0.25]}
    fastest = max(config.human_top_speed for config in draws(options))
    assert 3.7 < fastest <= CONFIG.human_top_speed
    variation_from({"human_speed": 1.1, "human_speed_std": 0.1}, CorridorConfig())  # 1.3 + 4e-16


whatever = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=3)),
    lambda inner: st.one_of(
        st.lists(inner, max_size=3), st.tuples(inner, inner), st.dictionaries(st.text(), inner)
    ),
    max_leaves=4,
)


@given(st.dictionaries(st.sampled_from([item.name for item in VARYING]), whatever, max_size=2))
def test_whatever_is_given_is_refused_by_name_or_can_be_drawn(options):
    try:
        variation = variation_from(options, CONFIG)
    except ConfigError as error:
        assert str(error).split("=")[0] in options or "relaxation_time" in str(error)
    else:
        assert variation.draw(CONFIG, np.random.default_rng(0)).human_speed <= 2.0


# --- a value -------------------------------------------------------------------------------------


def test_it_is_not_changed_from_outside():
    options = {"walking": ["cross"], "human_speed": 1.0}
    variation = variation_from(options, CONFIG)
    options["walking"].append("no such word")
    options["human_speed"] = 99.0
    for seed in range(20):
        drawn = variation.draw(CONFIG, np.random.default_rng(seed))
        assert (drawn.walking, drawn.human_speed) == ("cross", 1.0)
    with pytest.raises(TypeError, match="does not support item assignment"):
        variation.settings["human_speed"] = 99.0


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda v: pickle.loads(pickle.dumps(v))])
def test_a_copy_draws_the_same(copied):
    variation = variation_from({"human_speed": (0.5, 1.5), "walking": ["along", "mixed"]}, CONFIG)
    twin = copied(variation)
    assert isinstance(twin, Variation) and twin == variation
    with pytest.raises(TypeError, match="does not support item assignment"):
        twin.settings["human_speed"] = 99.0
    for seed in range(20):
        mine, theirs = np.random.default_rng(seed), np.random.default_rng(seed)
        assert variation.draw(CONFIG, mine) == twin.draw(CONFIG, theirs)


def test_options_that_were_stored_as_numpy_values_are_the_same_options():
    config = CorridorConfig()
    stored = {
        "human_speed": np.array([0.5, 1.0]),
        "reactive": np.bool_(False),
        "start_z": np.float64(-12.0),
    }
    plain = {"human_speed": (0.5, 1.0), "reactive": False, "start_z": -12.0}
    assert variation_from(stored, config) == variation_from(plain, config)


@pytest.mark.parametrize(
    ("stored", "plain"),
    [
        ({"human_speed": (np.float64(0.5), np.int64(1))}, {"human_speed": (0.5, 1)}),
        ({"human_speed": [np.float32(0.5), np.float64(1.0)]}, {"human_speed": [0.5, 1.0]}),
        ({"human_speed": np.array(0.5)}, {"human_speed": 0.5}),
        ({"walking": np.array("along")}, {"walking": "along"}),
        ({"walking": np.array(["along", "cross"])}, {"walking": ["along", "cross"]}),
        ({"walking": [np.str_("along")]}, {"walking": ["along"]}),
        ({"reactive": np.array([True, False])}, {"reactive": [True, False]}),
        ({"reactive": [np.bool_(True), np.False_]}, {"reactive": [True, False]}),
        ({"start_z": [np.array(-12.0)]}, {"start_z": [-12.0]}),
    ],
    ids=str,
)
def test_numpys_values_inside_are_taken_too(stored, plain):
    variation = variation_from(stored, CorridorConfig())
    assert variation == variation_from(plain, CorridorConfig())
    rng = np.random.default_rng(0)
    for name, value in variation.settings.items():
        kinds = {type(getattr(variation.draw(CorridorConfig(), rng), name)) for _ in range(5)}
        assert kinds <= {bool, int, float, str}, value


# --- what a reset says ---------------------------------------------------------------------------


@pytest.mark.parametrize("options", [None, {}], ids=str)
def test_no_options_say_nothing(options):
    assert variation_of(options, CONFIG) is None


def test_options_say_what_differs():
    options = {"human_speed": 0.5}
    assert variation_of(options, CONFIG) == variation_from(options, CONFIG)


@pytest.mark.parametrize("yes", [True, np.True_], ids=repr)
def test_the_defaults_come_back_on_demand(yes):
    assert variation_of({"defaults": yes}, CONFIG) is NO_VARIATION


@pytest.mark.parametrize(
    "bad",
    [{"defaults": False}, {"defaults": 1}, {"defaults": None}, {"defaults": np.ones(2)},
     {"defaults": True, "human_speed": 0.5}],
    ids=str,
)  # fmt: skip
def test_the_defaults_stand_alone(bad):
    with pytest.raises(ConfigError, match=r"defaults.*expected True, and no settings beside it"):
        variation_of(bad, CONFIG)


def test_a_way_of_walking_for_which_there_is_never_room_is_refused_at_once():
    small = CorridorConfig(
        num_humans=12, half_length=5.0, start_z=-4.0, intermittent_z=0.0, goal_z=4.0
    )
    with pytest.raises(ConfigError, match="no room for a queue"):
        variation_from({"walking": ["cross", "queue"]}, small)
    variation_from({"walking": ["cross", "along"]}, small)
