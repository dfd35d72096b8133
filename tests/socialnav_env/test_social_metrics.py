import json
import math

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from socialnav_env.metrics import METRICS, NO_ONE, TIME_HORIZON
from socialnav_env.wrappers import (
    EpisodeMetrics,
    MetricsTable,
    SocialMetrics,
    VectorSocialMetrics,
    compare,
)
from socialnav_env.wrappers.table import mean_interval, rate_interval

ENVS = ["SocialCorridor-v0", "Walker2d-v5", "HalfCheetah-v5"]
each_env = pytest.mark.parametrize("name", ENVS)
each_mode = pytest.mark.parametrize("mode", list(AutoresetMode))


def episode(**metrics):
    return {
        "success": 1.0,
        "time_to_goal": 30.0,
        "min_human_distance": 0.4,
        "return": 1.0,
        **metrics,
    }


# --- intervals -----------------------------------------------------------------------------------


def test_the_interval_of_a_mean_is_students():
    # mean 2, standard error sqrt(1) / sqrt(3), t(2, 97.5%) = 4.302653
    half = 4.302652729911275 / math.sqrt(3)
    assert mean_interval([1.0, 2.0, 3.0]) == pytest.approx((2.0 - half, 2.0 + half))
    assert mean_interval([5.0] * 4) == (5.0, 5.0)


@pytest.mark.parametrize("values", [[], [1.0]])
def test_one_value_has_no_interval(values):
    assert all(map(math.isnan, mean_interval(values)))


@given(st.integers(1, 10_000), st.data())
def test_the_interval_of_a_rate_is_wilsons(n, data):
    successes = data.draw(st.integers(0, n))
    expected = stats.binomtest(successes, n).proportion_ci(method="wilson")
    low, high = rate_interval(successes, n)
    assert (low, high) == pytest.approx((expected.low, expected.high), abs=1e-9)
    assert 0.0 <= low <= successes / n + 1e-12 and successes / n - 1e-12 <= high <= 1.0


# --- the table -----------------------------------------------------------------------------------


def test_means_and_numbers_of_episodes():
    table = MetricsTable.of([episode(), episode(success=0.0, time_to_goal=60.0, **{"return": 3.0})])
    assert table["return"].mean == 2.0 and table["return"].n == 2
    assert (table["success"].low, table["success"].high) == rate_interval(1, 2)
    assert (table["time_to_goal"].mean, table["time_to_goal"].n) == (30.0, 1)


def test_nobody_is_at_no_distance():
    table = MetricsTable.of([episode(min_human_distance=NO_ONE), episode()])
    assert (table["min_human_distance"].mean, table["min_human_distance"].n) == (0.4, 1)
    nobody = MetricsTable.of([episode(min_human_distance=NO_ONE)])["min_human_distance"]
    assert nobody.n == 0 and math.isnan(nobody.mean) and nobody.cell() == "–"


ABOUT_PEOPLE = [
    "min_human_distance", "personal_space_compliance", "min_time_to_collision", "intimate_share",
    "personal_share", "social_share", "public_share",
]  # fmt: skip


@pytest.mark.parametrize("name", ABOUT_PEOPLE)
def test_a_corridor_without_people_tells_nothing_of_them(name):
    near = episode(**{name: 0.4})
    alone = episode(**{name: 1.0} | {"min_human_distance": NO_ONE})
    row = MetricsTable.of([alone, near])[name]
    assert (row.mean, row.n) == (0.4, 1)
    assert MetricsTable.of([alone])[name].n == 0
    assert MetricsTable.of([alone])["success"].n == 1


def test_whom_nobody_approached_had_no_time_to_collision():
    episodes = [episode(min_time_to_collision=seconds) for seconds in (2.0, TIME_HORIZON, 4.0)]
    row = MetricsTable.of(episodes)["min_time_to_collision"]
    assert (row.mean, row.n) == (3.0, 2)
    assert MetricsTable.of(episodes)["min_human_distance"].n == 3


@pytest.mark.parametrize("length", [0.0, 1e-12])
def test_whoever_did_not_move_has_no_path_that_could_be_irregular(length):
    still = episode(path_irregularity=0.0, path_length=length)
    moved = episode(path_irregularity=0.5, path_length=2.0)
    row = MetricsTable.of([still, moved])["path_irregularity"]
    assert (row.mean, row.n) == (0.5, 1)


def test_the_empty_corridor_tells_nothing_of_people():
    env = SocialMetrics(gym.make("SocialCorridor-v0", scenario="empty", max_episode_steps=5))
    env.reset(seed=0)
    for _ in range(5):
        env.step([1.0, 0.0])
    assert [row.name for row in env.table().rows if row.n == 0] == [
        "time_to_goal", *(name for name in METRICS if name in ABOUT_PEOPLE)
    ]  # fmt: skip


def test_rows_tell_unit_and_definition():
    table = MetricsTable.of([dict.fromkeys((*METRICS, "collided", "timeout", "length"), 1.0)])
    units = {row.name: row.unit for row in table.rows}
    assert (units["time_to_goal"], units["jerk_mean"], units["success"]) == ("s", "m/s^3", "")
    assert all(row.definition for row in table.rows)
    assert table["spl"].definition == METRICS["spl"]


def test_rows_become_plain_dicts():
    rows = MetricsTable.of([episode(), episode(success=0.0)]).as_dicts()
    assert json.loads(json.dumps(rows, allow_nan=False)) == rows
    assert rows[1]["n"] == 1 and rows[1]["low"] is None
    assert list(rows[0]) == ["name", "unit", "mean", "low", "high", "n", "definition"]


def test_markdown():
    table = MetricsTable.of([episode(), episode(success=0.0)])
    assert table.to_markdown().splitlines() == [
        "| metric | mean [95% interval] | unit | n |",
        "|---|---|---|---|",
        "| success | 0.5 [0.0945, 0.905] | - | 2 |",
        "| time_to_goal | 30 | s | 1 |",
        "| min_human_distance | 0.4 [0.4, 0.4] | m | 2 |",
        "| return | 1 [1, 1] | - | 2 |",
    ]


def test_tables_side_by_side():
    tables = {"a": MetricsTable.of([episode()]), "b": MetricsTable.of([episode(time_to_goal=40.0)])}
    assert compare(tables, ["time_to_goal"]).splitlines() == [
        "| metric | a | b |",
        "|---|---|---|",
        "| time_to_goal [s] | 30 | 40 |",
    ]
    assert len(compare(tables).splitlines()) == 2 + 4


def test_what_is_not_there_is_an_error():
    with pytest.raises(ValueError, match="at least one finished episode"):
        MetricsTable.of([])
    with pytest.raises(ValueError, match="tables: expected at least one"):
        compare({})
    with pytest.raises(KeyError, match="expected one of success, time_to_goal"):
        MetricsTable.of([episode()])["speed"]


# --- the wrappers --------------------------------------------------------------------------------


def run(env, episodes):
    env.action_space.seed(0)
    for seed in range(episodes):
        env.reset(seed=seed)
        ended = False
        while not ended:
            _, _, terminated, truncated, info = env.step(env.action_space.sample())
            ended = terminated or truncated
        yield info


@each_env
def test_episodes_are_those_of_episode_metrics(make_mujoco, name):
    plain = EpisodeMetrics(make_mujoco(name, max_episode_steps=30))
    env = SocialMetrics(make_mujoco(name, max_episode_steps=30))
    expected = [info["episode_metrics"] for info in run(plain, 3)]
    told = [info["episode_metrics"] for info in run(env, 3)]
    assert env.episodes == expected == told
    table = env.table()
    assert [row.name for row in table.rows] == list(expected[0])
    assert table["return"].mean == pytest.approx(np.mean([e["return"] for e in expected]))
    assert table["length"].n == 3


def test_an_unfinished_episode_does_not_count():
    env = SocialMetrics(gym.make("SocialCorridor-v0", max_episode_steps=5))
    env.reset(seed=0)
    env.step(np.zeros(2))
    with pytest.raises(ValueError, match="at least one finished episode"):
        env.table()


def vector_env(make_mujoco, name, mode):
    """Three envs, the corridor's own vector env or Gymnasium's for MuJoCo."""
    if name.startswith("Social"):
        return gym.make_vec(name, num_envs=3, max_episode_steps=9, autoreset_mode=mode)
    makers = [lambda: make_mujoco(name, max_episode_steps=9)] * 3
    return SyncVectorEnv(makers, autoreset_mode=mode)


def actions_of(n, t, space):
    return np.random.default_rng(100 * n + t).uniform(space.low, space.high).astype(np.float32)


def run_vector(env, steps, reset):
    """Step with actions that depend on the env and its episode's step only."""
    env.reset(seed=[10, 20, 30])
    ages = np.zeros(3, dtype=int)
    for _ in range(steps):
        acts = [actions_of(n, ages[n], env.single_action_space) for n in range(3)]
        _, _, terminated, truncated, _ = env.step(np.stack(acts))
        ended = terminated | truncated
        if reset and ended.any():
            env.reset(options={"reset_mask": ended})
        ages = np.where(ended, 0, ages + 1)


@each_env
@each_mode
def test_many_envs_tell_what_each_alone_does(make_mujoco, name, mode):
    env = VectorSocialMetrics(vector_env(make_mujoco, name, mode))
    disabled = mode is AutoresetMode.DISABLED
    run_vector(env, 9, disabled)
    for n, seed in enumerate((10, 20, 30)):
        one = SocialMetrics(make_mujoco(name, max_episode_steps=9))
        one.reset(seed=seed)
        for t in range(9):
            _, _, terminated, truncated, _ = one.step(actions_of(n, t, one.action_space))
            if terminated or truncated:
                break
        first = env.episodes[n][0]
        assert first.keys() == one.episodes[0].keys()
        for key, value in one.episodes[0].items():
            assert first[key] == pytest.approx(value, rel=1e-9), key


@each_mode
def test_every_episode_has_its_own_length_and_return(make_mujoco, mode):
    env = VectorSocialMetrics(vector_env(make_mujoco, "SocialCorridor-v0", mode))
    run_vector(env, 40, mode is AutoresetMode.DISABLED)
    for episodes in env.episodes:
        assert len(episodes) >= 4 and {e["length"] for e in episodes} == {9}
        terms = [e["return"] for e in episodes]
        assert max(terms) < 2.0 and len(set(terms)) == len(terms)


def test_only_the_first_episodes_of_each():
    env = VectorSocialMetrics(gym.make_vec("SocialCorridor-v0", num_envs=2, max_episode_steps=3))
    env.reset(seed=0)
    for _ in range(3):
        env.step(np.zeros((2, 2)))
    env.episodes[0].append(env.episodes[0][0])
    assert env.table()["length"].n == 3
    assert env.table(each=1)["length"].n == 2
    with pytest.raises(ValueError, match="each=2: expected 1 to 1"):
        env.table(each=2)


def test_a_reset_drops_what_was_begun():
    env = VectorSocialMetrics(gym.make_vec("SocialCorridor-v0", num_envs=2, max_episode_steps=3))
    env.reset(seed=0)
    env.step(np.zeros((2, 2)))
    env.reset(seed=0)
    for _ in range(3):
        env.step(np.zeros((2, 2)))
    assert [episodes[0]["length"] for episodes in env.episodes] == [3, 3]
