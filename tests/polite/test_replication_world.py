"""The replication's scene and the states on which reward models are compared."""

import numpy as np
import pytest

from polite.dataset import Feedback
from polite.experiments.replication.config import PRESETS, StudyConfig, preset
from polite.experiments.replication.sensitivity import LEVELS, _new_answers
from polite.experiments.replication.stages import _content_of, ask, draw_queries
from polite.experiments.replication.study import Study
from polite.experiments.replication.world import (
    FLOOR_X,
    FLOOR_Z,
    MapStates,
    collect_map_states,
    derive,
    floor_plan,
    people_of,
    scene_settings,
)
from polite.policies.policy import GaussianPolicy
from polite.teachers.participants import POLITE
from polite.types import PoliteError, SegmentPool
from socialnav_env import SocialCorridorEnv

CONFIG = StudyConfig(pool_envs=2, pool_steps=40, map_states=200, participants=20)


def still_policy():
    """Drives ahead at half speed, give or take: all weights are 0."""
    n, v = 36, 2
    return GaussianPolicy(
        weights=(np.zeros((v, n), np.float32), np.zeros(v, np.float32)),
        activation="tanh",
        log_std=np.zeros(v, np.float32),
        mean=np.zeros(n),
        variance=np.ones(n),
        low=-np.ones(v, np.float32),
        high=np.ones(v, np.float32),
    )


@pytest.fixture(scope="module")
def states():
    return collect_map_states(CONFIG, still_policy(), np.random.default_rng(0))


def test_map_states_cover_the_corridor_evenly(states):
    counts = np.unique(np.floor(states.z), return_counts=True)[1]
    assert counts.max() <= CONFIG.map_states // len(counts)
    assert states.z.min() < -13.5
    assert states.z.max() > 9.0  # 40 steps from the last start place


def test_distances_are_those_that_the_robot_observes(states):
    np.testing.assert_allclose(states.goal_distance(0), states.observations[:, 7], atol=1e-4)
    np.testing.assert_allclose(states.goal_distance(1), states.observations[:, 11], atol=1e-4)
    np.testing.assert_allclose(states.x, states.observations[:, 0], atol=1e-5)
    np.testing.assert_allclose(states.z, states.observations[:, 1], atol=1e-5)


def test_people_are_as_far_as_the_robot_observes(states):
    relative = states.observations[:, 15:27].reshape(-1, 3, 4)[..., :2]
    expected = np.linalg.norm(relative, axis=-1)
    np.testing.assert_allclose(people_of(states.states)[1], expected, atol=1e-4)


def test_offsets_are_negative_before_the_object():
    row = np.array(
        [[0.0, -5.0, 0.0, 0, 0, 0.0, -2.5, 0.0, 12.0, 1.0, -4.0, 0, 0, 0, 1.0, 9.0, 0, 0, 0]]
    )
    states = MapStates(np.zeros((1, 1), np.float32), np.zeros((1, 2), np.float32), row)
    assert states.goal_offset(0)[0] == pytest.approx(-2.5)
    assert states.goal_offset(1)[0] == pytest.approx(-17.0)
    assert states.person_offset[0] == pytest.approx(-1.0)


def test_map_states_round_trip(states, tmp_path):
    states.save(tmp_path / "states.npz")
    loaded = MapStates.load(tmp_path / "states.npz")
    for name in ("observations", "actions", "states"):
        np.testing.assert_array_equal(getattr(loaded, name), getattr(states, name))


def test_the_floor_plan_has_every_cell_once_and_the_flags_of_its_side():
    floor = floor_plan(CONFIG)
    assert len(floor.z) == FLOOR_X * FLOOR_Z
    assert len(np.unique(np.stack([floor.x, floor.z]), axis=1).T) == FLOOR_X * FLOOR_Z
    np.testing.assert_allclose(floor.observations[:, 1], floor.z, atol=1e-5)
    np.testing.assert_array_equal(floor.observations[:, 10], floor.z > -2.5)
    np.testing.assert_array_equal(floor.observations[:, 14], 0.0)


def test_the_scene_has_a_fixed_horizon():
    env = SocialCorridorEnv(**scene_settings(CONFIG))
    assert not env.config.terminate_on_goal
    assert not env.config.terminate_on_collision


def test_each_purpose_has_a_seed_of_its_own():
    seeds = {derive(0, "policy", k) for k in range(5)} | {derive(0, "weights", 0), derive(1, "x")}
    assert len(seeds) == 7
    assert derive(0, "policy", 1) == derive(0, "policy", 1)


@pytest.mark.parametrize("name", PRESETS)
def test_presets_keep_their_floors(name):
    config = preset(name)
    if name == "smoke":
        return
    assert config.participants * POLITE.answers == 400
    assert config.reward_training.epochs >= 100
    assert config.policy_steps >= (150_000 if name == "fast" else 200_000)
    assert config.seeds >= (3 if name == "fast" else 5)
    assert config.evaluation_episodes >= 100


def test_an_unknown_preset_lists_the_valid_ones():
    with pytest.raises(PoliteError, match="smoke, fast, paper"):
        preset("huge")


def pool_of(rewards, states):
    count, steps = rewards.shape
    return SegmentPool(
        observations=np.zeros((count, steps, 2)),
        actions=np.zeros((count, steps, 2)),
        rewards=rewards,
        states=states,
        lengths=np.full(count, steps),
        trajectory=np.arange(count),
        start=np.zeros(count),
    )


def test_what_clips_show_is_counted_clip_by_clip():
    states = np.zeros((4, 3, 14))
    states[..., 9] = 2.9  # the person is far off ...
    states[1, 1, 9] = 1.0  # ... except once
    states[2, 2, 3] = 1.0  # collected in the clip
    states[3, :, 4] = 1.0  # reached before it
    rewards = np.zeros((4, 3))
    rewards[0, 1] = -1.0
    assert _content_of(pool_of(rewards, states)) == {
        "share_with_person": 0.25,
        "share_with_intermittent": 0.25,
        "share_with_goal": 0.0,
        "share_with_collision": 0.25,
    }


def test_equal_effort_gives_the_baseline_525_answers(tmp_path):
    rng = np.random.default_rng(1)
    pool = pool_of(rng.normal(size=(200, 50)), np.zeros((200, 50, 14)))
    study = Study(tmp_path, CONFIG, 0)
    queries = draw_queries(CONFIG, pool, 0)
    given = Feedback(pool, queries, ask(CONFIG, POLITE, pool, queries, 0))
    more = _new_answers(study, given, "baseline", {}, 3, more=True)
    assert len(more.answers) == len(more.queries) == 525
    assert sorted(answer.query for answer in more.answers) == list(range(525))
    assert more.queries[:400] == queries


@pytest.mark.parametrize("change", [change for _, _, change in LEVELS])
def test_every_sensitivity_level_is_a_possible_population(change, tmp_path):
    rng = np.random.default_rng(1)
    pool = pool_of(rng.normal(size=(200, 50)), np.zeros((200, 50, 14)))
    queries = draw_queries(CONFIG, pool, 0)
    given = Feedback(pool, queries, [])
    answers = _new_answers(Study(tmp_path, CONFIG, 0), given, "polite", change, 3, more=False)
    assert len(answers.answers) == 400
