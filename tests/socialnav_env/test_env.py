import json
import os
import subprocess
import sys
from pathlib import Path

import gymnasium as gym
import numpy as np
import pygame
import pytest
from episodes import episode, make

import socialnav_env
from socialnav_env.config import SCENARIOS, ConfigError
from socialnav_env.keyboard import CODES, KEYS, action_of
from socialnav_env.metrics import METRICS
from socialnav_env.observation import HEAD, NUM_RAYS, PER_HUMAN
from socialnav_env.pictures import RENDER_MODES
from socialnav_env.reward import TERMS

LENIENT = {"terminate_on_goal": False, "terminate_on_collision": False}
SETTINGS = [
    *({"scenario": name} for name in SCENARIOS),
    {"num_humans": 12, "observation": "rays"},
    {"frame_skip": 1, "timestep": 0.1, "observation": "state", "walking": "queue"},
    {"action": "holonomic", "ray_noise": 0.1, "tracking_noise": 0.1, "walking": "group"},
    LENIENT,
]


# --- what others expect of an env ----------------------------------------------------------------


def test_it_is_registered_by_its_module_too():
    env = gym.make("socialnav_env:SocialCorridor-v0")
    assert env.spec.max_episode_steps == 600
    assert env.unwrapped.config == socialnav_env.CorridorConfig()


def test_settings_arrive():
    env = make(num_humans=1, goal_reward=3.0, render_width=np.int64(320)).unwrapped
    assert (env.config.num_humans, env.config.goal_reward, env.render_width) == (1, 3.0, 320)


@pytest.mark.parametrize("kind", ["unicycle", "holonomic"])
@pytest.mark.parametrize("observed", ["both", "state", "rays"])
def test_the_spaces_are_those_of_the_keywords(kind, observed):
    env = make(action=kind, observation=observed, num_humans=5)
    size = HEAD + (observed != "rays") * 5 * PER_HUMAN + (observed != "state") * NUM_RAYS
    assert env.observation_space.shape == (size,)
    assert env.action_space.shape == ({"unicycle": 2, "holonomic": 3}[kind],)


# --- equal seeds ---------------------------------------------------------------------------------


@pytest.mark.parametrize("settings", SETTINGS, ids=str)
def test_equal_seeds_give_equal_episodes(settings):
    env = make(**settings)
    first = episode(env, 3)
    assert episode(env, 3) == first
    assert episode(make(**settings), 3) == first
    assert episode(env, 4) != first


def test_episodes_after_the_first_are_equal_too():
    envs = [make(), make()]
    for env in envs:
        env.reset(seed=5)
    told = [[env.reset()[0].tolist() for _ in range(5)] for env in envs]
    assert told[0] == told[1]
    assert len({tuple(observation) for observation in told[0]}) == 5


PROGRAM = """
import json, sys
sys.path.insert(0, {folder!r})
from episodes import episode, make
print(json.dumps(episode(make(), 11)))
"""


def test_equal_seeds_give_equal_episodes_in_another_process():
    here = Path(__file__).parent
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(folder=str(here))],
        capture_output=True, text=True, check=True, timeout=120, cwd=here.parents[1],
        env={**os.environ, "PYTHONHASHSEED": "7"},
    )  # fmt: skip
    assert json.loads(done.stdout) == json.loads(json.dumps(episode(make(), 11)))


# --- reward and info -----------------------------------------------------------------------------


@pytest.mark.parametrize("settings", SETTINGS, ids=str)
def test_the_reward_is_exactly_the_sum_of_its_terms(settings):
    for _, reward, _, _, info in episode(make(**settings), 0):
        total = 0.0
        for name in TERMS:  # one after the other; from Python 3.12 on `sum` rounds less than that
            total += info[name]
        assert reward == total
        assert [name for name in info if name.startswith("reward_")] == list(TERMS)


def test_progress_over_an_episode_is_the_way_gained():
    env = make(**LENIENT)
    env.reset(seed=2)
    inner = env.unwrapped
    first, total = inner.world.state.remaining[0], 0.0
    for _ in range(400):
        total += env.step([1.0, 0.0])[4]["reward_progress"]
    gained = first - inner.world.state.remaining[0]
    assert gained > 5.0
    assert total == pytest.approx(inner.config.progress_weight * gained, abs=1e-9)


def test_info_has_plain_values_under_known_keys():
    for _, _, _, _, info in episode(make(), 0, 5):
        motion = {"x_position", "z_position", "x_velocity", "z_velocity", "collision"}
        assert set(info) == {*TERMS, *METRICS, *motion}
        assert {type(value) for value in info.values()} == {float, bool}


def test_a_reset_tells_nothing_of_the_episode_before():
    env = make(**LENIENT)
    _, fresh = env.reset(seed=0)
    for _ in range(30):
        env.step([1.0, 0.7])
    assert env.reset(seed=0)[1] == fresh
    assert all(fresh[name] == 0.0 for name in TERMS)


def test_observations_and_infos_are_fresh_objects():
    env = make()
    told = [env.reset(seed=0), *(env.step([0.0, 0.0])[::4] for _ in range(3))]
    assert len({id(observation) for observation, _ in told}) == 4
    assert not any(np.shares_memory(told[0][0], observation) for observation, _ in told[1:])
    assert len({id(info) for _, info in told}) == 4


# --- the end of an episode -----------------------------------------------------------------------


def at_the_goal(**settings):
    env = make(num_humans=0, **settings)
    env.reset(seed=0)
    env.unwrapped.world.state.goals[0, 1] = (-13.0, 0.0)
    env.unwrapped.set_state([0.0, -14.5, 0.0], np.zeros(3))
    return env


@pytest.mark.parametrize("ends", [True, False])
def test_the_goal_ends_an_episode_where_it_shall(ends):
    env = at_the_goal(terminate_on_goal=ends)
    for _ in range(20):
        _, _, terminated, truncated, info = env.step([1.0, 0.0])
        assert not truncated
        assert terminated == (ends and info["reward_goal"] > 0.0)
        if terminated:
            break
    assert info["success"] == 1.0
    assert terminated == ends


@pytest.mark.parametrize("ends", [True, False])
def test_a_collision_ends_an_episode_where_it_shall(ends):
    env = make(num_humans=0, terminate_on_collision=ends)
    env.reset(seed=0)
    env.unwrapped.set_state([2.0, 0.0, np.pi / 2], np.zeros(3))
    for _ in range(20):
        _, _, terminated, truncated, info = env.step([1.0, 0.0])
        assert not truncated
        assert terminated == (ends and info["collision"])
        if terminated:
            break
    assert info["collisions"] == 1.0
    assert terminated == ends


def test_only_the_time_limit_truncates():
    env = make(**LENIENT)
    env.reset(seed=0)
    ends = [env.step([-1.0, 0.0])[2:4] for _ in range(600)]
    assert ends == [(False, False)] * 599 + [(False, True)]
    assert env.unwrapped.step(np.array([-1.0, 0.0]))[2:4] == (False, False)


# --- what episodes draw anew --------------------------------------------------------------------


def starts(env, count, **keywords):
    """Where the robot starts along the corridor, give or take half a metre."""
    return [env.reset(**keywords)[0][1]] + [env.reset()[0][1] for _ in range(count - 1)]


def test_options_stay_until_others_come():
    env = make()
    assert np.abs(np.array(starts(env, 4, seed=0, options={"start_z": 3.0})) - 3.0).max() <= 0.5
    drawn = np.array(starts(env, 30, options={"start_z": (-5.0, 5.0)}))
    assert drawn.min() < -3.0 and drawn.max() > 3.0 and np.abs(drawn).max() <= 5.5
    drawn = np.array(starts(env, 30, options={}))
    assert drawn.min() < -3.0 and drawn.max() > 3.0, "what Gymnasium sends by itself says nothing"
    assert np.abs(np.array(starts(env, 4, options={"defaults": True})) + 14.0).max() <= 0.5


def test_a_reset_that_fails_leaves_the_options_as_they_were(monkeypatch):
    env = make().unwrapped
    env.reset(seed=0, options={"start_z": 3.0})

    def fails(*_):
        raise ConfigError("too small")

    with monkeypatch.context() as patch, pytest.raises(ConfigError, match="too small"):
        patch.setattr(env.world, "begin", fails)
        env.reset(options={"start_z": -9.0})
    assert np.abs(np.array(starts(env, 4)) - 3.0).max() <= 0.5


@pytest.mark.parametrize("seed", [np.int64(7), np.uint8(7)], ids=repr)
def test_a_seed_may_be_numpys(seed):
    assert make().reset(seed=seed)[0].tolist() == make().reset(seed=7)[0].tolist()


@pytest.mark.parametrize("bad", [0.5, "7", True, -1, [1]], ids=repr)
def test_another_seed_is_an_error(bad):
    with pytest.raises(ConfigError, match=r"seed=.*: expected None or a whole number"):
        make().reset(seed=bad)


def test_equal_options_and_seeds_give_equal_episodes():
    options = {"human_speed": (0.3, 0.9), "walking": ["cross", "along"], "reactive": False}
    told = []
    for env in (make(), make()):
        first = env.reset(seed=3, options=options)[0].tolist()
        told.append([first, *(env.reset()[0].tolist() for _ in range(5)), episode(env, 4, 30)])
    assert told[0] == told[1]


# --- bad input -----------------------------------------------------------------------------------


def test_a_step_needs_a_reset():
    with pytest.raises(gym.error.ResetNeeded, match="reset"):
        make().unwrapped.step(np.zeros(2))


@pytest.mark.parametrize("bad", [np.zeros(3), 0.0, np.zeros((1, 2)), [], [0.0]])
def test_an_action_of_another_shape_is_an_error(bad):
    env = make().unwrapped
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"action: expected shape \(2,\)"):
        env.step(bad)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("index", [0, 1])
def test_an_action_that_is_not_finite_is_an_error_and_moves_nobody(bad, index):
    env = make().unwrapped
    env.reset(seed=0)
    before, action = env.state_vector(), np.zeros(2)
    action[index] = bad
    with pytest.raises(ValueError, match="action: expected finite numbers"):
        env.step(action)
    np.testing.assert_array_equal(env.state_vector(), before)


def test_actions_beyond_the_bounds_are_clipped():
    told = []
    for action in ([1.0, -1.0], [50.0, -3.0]):
        env = make().unwrapped
        env.reset(seed=0)
        told.append(env.step(action)[0].tolist())
    assert told[0] == told[1]


@pytest.mark.parametrize("bad", [5, [("human_speed", 0.5)], "defaults"], ids=str)
def test_options_are_a_mapping(bad):
    with pytest.raises(ConfigError, match=r"options=.*expected None or a mapping"):
        make().unwrapped.reset(options=bad)


def test_an_unknown_reset_option_is_an_error_and_changes_nothing():
    env = make()
    env.reset(seed=0)
    generator, before = env.unwrapped.np_random.bit_generator.state, env.unwrapped.state_vector()
    with pytest.raises(ConfigError, match="unknown reset option speed"):
        env.reset(seed=1, options={"speed": 1.0})
    assert env.unwrapped.np_random.bit_generator.state == generator
    np.testing.assert_array_equal(env.unwrapped.state_vector(), before)


@pytest.mark.parametrize("bad", ["ansi", "", 3])
def test_an_unknown_render_mode_is_an_error(bad):
    with pytest.raises(ConfigError, match=r"render_mode=.*expected None or one of"):
        socialnav_env.SocialCorridorEnv(render_mode=bad)


@pytest.mark.parametrize("bad", [63, 4097, 640.0, "640"])
def test_an_impossible_width_is_an_error(bad):
    with pytest.raises(ConfigError, match=r"render_width=.*expected a whole number"):
        make(render_width=bad)


@pytest.mark.parametrize(
    ("bad", "said"),
    [
        ({"scenario": "maze"}, "scenario='maze': expected one of paper"),
        ({"camera": "drone"}, "camera='drone': expected one of corridor, robot"),
        ({"overlays": ["ray"]}, r"overlays=\['ray'\]: expected some of rays"),
        ({"overlays": "rays"}, "overlays='rays': expected some of rays"),
        ({"overlays": None}, "overlays=None: expected some of rays"),
        ({"overlays": 5}, "overlays=5: expected some of rays"),
        ({"overlays": [[]]}, r"overlays=\[\[\]\]: expected some of rays"),
        ({"people": 3}, "unknown keyword people; valid are render_mode"),
    ],
)
def test_an_unknown_word_is_an_error_that_names_the_known_ones(bad, said):
    with pytest.raises(ConfigError, match=said):
        make(**bad)


# --- the keyboard --------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["unicycle", "holonomic"])
def test_every_combination_of_keys_is_an_action(kind):
    env = make(action=kind)
    known = env.unwrapped.get_keys_to_action()
    assert len(known) == 2 ** len(KEYS[kind]) - 1
    assert all(env.action_space.contains(action) for action in known.values())
    for pressed in (["up"], ["up", "left"], ["left", "right"]):
        np.testing.assert_array_equal(
            known[tuple(CODES[key] for key in pressed)], action_of(pressed, kind)
        )


def test_keys_drive_the_robot():
    assert action_of([], "unicycle").tolist() == [-1.0, 0.0]
    assert action_of({"up", "left", "escape"}, "unicycle").tolist() == [1.0, 1.0]
    assert action_of({"left", "right"}, "unicycle").tolist() == [-1.0, 0.0]
    assert action_of([], "holonomic").tolist() == [0.0, 0.0, 0.0]
    assert action_of({"down", "right", "a"}, "holonomic").tolist() == [-1.0, -1.0, 1.0]


def test_the_key_codes_are_pygames():
    names = {name: name.upper() if len(name) > 1 else name for name in CODES}
    assert {name: getattr(pygame, f"K_{names[name]}") for name in CODES} == CODES


# --- pictures ------------------------------------------------------------------------------------


def test_the_render_modes_are_declared():
    env = make()
    assert tuple(env.metadata["render_modes"]) == RENDER_MODES
    assert env.metadata["render_fps"] == round(1.0 / env.unwrapped.dt)
    assert make(frame_skip=4, timestep=0.01).unwrapped.metadata["render_fps"] == 25


def test_an_array_is_rendered_without_a_display():
    env = make(render_mode="rgb_array", render_width=480)
    env.reset(seed=0)
    first = env.render()
    for _ in range(20):
        env.step([1.0, 0.0])
    second = env.render()
    assert first.shape == second.shape and first.shape[1:] == (480, 3)
    assert first.dtype == np.uint8
    assert (first != second).any()
    assert not pygame.display.get_init()


def test_rendering_changes_nothing():
    plain, drawn = make(), make(render_mode="rgb_array", render_width=64)
    for env in (plain, drawn):
        env.reset(seed=0)
    for _ in range(20):
        drawn.render()
        assert plain.step([0.5, 0.1])[0].tolist() == drawn.step([0.5, 0.1])[0].tolist()


def test_a_recorded_row_gives_the_picture_of_its_moment():
    env = make(render_mode="rgb_array", render_width=320)
    env.reset(seed=0)
    inner = env.unwrapped
    row, picture = inner.state_row(), inner.render_state(inner.state_row())
    for _ in range(30):
        env.step([1.0, 0.0])
    later = inner.state_vector()
    assert np.array_equal(inner.render_state(row), picture)
    np.testing.assert_array_equal(inner.state_vector(), later)


def test_without_a_render_mode_render_says_so():
    env = make().unwrapped
    env.reset(seed=0)
    with pytest.warns(UserWarning, match=r"render_mode"):
        assert env.render() is None


def test_human_mode_shows_a_window_and_closes_it(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = make(render_mode="human", render_width=320, frame_skip=1, timestep=0.002)
    env.reset(seed=0)
    assert pygame.display.get_init()
    env.step([0.0, 0.0])
    assert env.render() is None
    assert pygame.display.get_surface().get_width() == 320
    env.close()
    env.close()
    assert not pygame.display.get_init()
