import doctest

import gymnasium as gym
import numpy as np
import pytest

from socialnav_env import evaluation
from socialnav_env.config import ConfigError, CorridorConfig
from socialnav_env.controllers import (
    CONTROLLERS,
    DynamicWindow,
    SocialForceRobot,
    StraightToGoal,
)
from socialnav_env.controllers.dynamic_window import merit
from socialnav_env.controllers.sight import sight_of
from socialnav_env.controllers.steering import (
    actions_for,
    pedestrian_parameters,
    targets,
    way_to,
)
from socialnav_env.evaluation import evaluate

each_controller = pytest.mark.parametrize("name", CONTROLLERS)
each_action = pytest.mark.parametrize("action", ["unicycle", "holonomic"])


def config_of(**keywords):
    return CorridorConfig.from_keywords(**keywords)


def observed(config, moves=40, count=6):
    """Observations in the middle of episodes, and the states that they are of."""
    keywords = {"observation": config.observation, "action": config.action}
    env = gym.make_vec(
        "SocialCorridor-v0", num_envs=count, num_humans=config.num_humans, **keywords
    )
    env.reset(seed=3)
    env.action_space.seed(3)
    for _ in range(moves):
        observations = env.step(np.abs(env.action_space.sample()))[0]
    return observations, env.unwrapped.world.state


# --- what they have in common --------------------------------------------------------------------


@pytest.mark.parametrize("observation", ["both", "state"])
@pytest.mark.parametrize("num_humans", [0, 3, 12])
def test_an_observation_is_read_back_exactly(observation, num_humans):
    config = config_of(observation=observation, num_humans=num_humans)
    observations, state = observed(config)
    sight = sight_of(observations, config)
    angles = np.remainder(state.bodies[:, 0, 2] + np.pi, 2 * np.pi) - np.pi
    np.testing.assert_allclose(sight.bodies[:, 0, 2], angles, atol=1e-9)
    np.testing.assert_allclose(sight.bodies[:, 0, [0, 1, 3, 4, 5]], state.bodies[:, 0][:, [0, 1, 3, 4, 5]], atol=1e-9)  # fmt: skip  # noqa: E501
    np.testing.assert_allclose(sight.bodies[:, 1:, [0, 1, 3, 4]], state.bodies[:, 1:, [0, 1, 3, 4]], atol=1e-9)  # fmt: skip  # noqa: E501
    np.testing.assert_allclose(sight.goals, state.goals, atol=1e-9)
    np.testing.assert_array_equal(sight.flags, state.flags)


@each_controller
@each_action
@pytest.mark.parametrize("observation", ["both", "state"])
def test_one_observation_or_many(name, action, observation):
    config = config_of(action=action, observation=observation)
    robot = CONTROLLERS[name](config)
    observations, _ = observed(config)
    before = observations.copy()
    actions, state = robot.predict(observations, "memory", np.zeros(6), deterministic=False)
    assert state == "memory"
    assert actions.dtype == np.float32
    assert actions.shape == (6, 2 if action == "unicycle" else 3)
    assert np.abs(actions).max() <= 1.0
    for one, expected in zip(observations, actions, strict=True):
        np.testing.assert_array_equal(robot.predict(one)[0], expected)
    np.testing.assert_array_equal(observations, before)


@pytest.mark.parametrize("name", ["straight", "dynamic-window"])  # the third leans on purpose
@each_action
def test_a_mirrored_world_gives_mirrored_actions(name, action):
    config = config_of(action=action)
    robot = CONTROLLERS[name](config)
    observations, _ = observed(config)
    mirrored = observations.copy()
    left = [0, 3, 5, 6, 9, 13, *range(16, 27, 2)]
    mirrored[:, left] *= -1.0
    sign = [1.0, -1.0] if action == "unicycle" else [1.0, -1.0, -1.0]
    expected = robot.predict(observations)[0] * np.array(sign)
    np.testing.assert_allclose(robot.predict(mirrored)[0], expected, atol=1e-5)


@each_controller
def test_what_it_cannot_read_is_an_error(name):
    robot = CONTROLLERS[name](config_of())
    with pytest.raises(ValueError, match=r"expected shape \(36,\) or \(B, 36\), got \(35,\)"):
        robot.predict(np.zeros(35))
    with pytest.raises(ValueError, match="expected shape"):
        robot.predict(np.zeros((2, 3, 36)))
    with pytest.raises(ValueError, match="finite"):
        robot.predict(np.full(36, np.nan))
    with pytest.raises(ConfigError, match="expected observation='both' or 'state', got 'rays'"):
        CONTROLLERS[name](config_of(observation="rays"))


@each_controller
def test_one_step_ahead_of_the_goal_it_stays_finite(name):
    config = config_of(num_humans=1)
    observation = np.zeros(28)
    observation[[2, 8, 12]] = 1.0  # at the origin, on top of both goals and of the person
    assert np.isfinite(CONTROLLERS[name](config).predict(observation)[0]).all()


# --- steering ------------------------------------------------------------------------------------


def test_a_unicycle_turns_to_where_it_wants_to_go():
    config = config_of()
    wanted = config.robot_speed * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, 0.0]])
    actions = actions_for(wanted, np.zeros(4), config)
    np.testing.assert_allclose(actions[:, 0], [1.0, -1.0, -1.0, -1.0], atol=1e-9)
    assert actions[0, 1] == actions[3, 1] == 0.0
    assert actions[1, 1] == pytest.approx(np.pi / 2 / 0.3)
    assert abs(actions[2, 1]) == pytest.approx(np.pi / 0.3)


def test_a_holonomic_base_goes_there_at_once():
    config = config_of(action="holonomic")
    actions = actions_for(np.array([[0.0, 0.83]]), np.array([np.pi / 4]), config)
    np.testing.assert_allclose(actions[0, :2], [np.sqrt(0.5), np.sqrt(0.5)], atol=1e-9)


def test_it_heads_for_the_intermittent_goal_first():
    config = config_of()
    observations, state = observed(config)
    sight = sight_of(observations, config)
    sight.flags[:3, 0] = True
    aims = targets(sight, pedestrian_parameters(config))
    np.testing.assert_allclose(aims[:3], state.goals[:3, 1], atol=1e-9)
    np.testing.assert_allclose(aims[3:], state.goals[3:, 0], atol=1e-9)


def test_the_way_through_a_doorway():
    parameters = pedestrian_parameters(config_of(scenario="doorway"))  # at z = 2, |x| < 0.9
    free = 0.9 - 0.3 - 0.1
    assert way_to(0.0, 0.0, 1.0, 2.0, parameters) == (1.0, 2.0)  # this side
    assert way_to(3.0, 0.0, 9.0, 1.0, parameters) == (9.0, 1.0)  # past it
    assert way_to(-8.0, 2.0, 12.0, 2.0, parameters) == (
        1.4,
        pytest.approx(free / 2),
    )  # to its entry
    assert way_to(1.5, 0.0, 12.0, 0.0, parameters) == (2.6, 0.0)  # in line: through it
    assert way_to(2.2, 0.1, 12.0, 3.0, parameters)[0] == 2.6  # out of it before turning
    assert way_to(2.2, 2.5, 12.0, 3.0, parameters) == (12.0, 3.0)  # beside it, on the goal's side
    assert way_to(12.0, -2.0, -9.0, -2.0, parameters) == (2.6, pytest.approx(-free / 2))  # back


# --- each of them --------------------------------------------------------------------------------


@pytest.mark.parametrize("module", [evaluation, StraightToGoal])
def test_the_example_in_the_docstring_runs(module):
    tests = [t for t in doctest.DocTestFinder().find(module, globs={}) if t.examples]
    assert len(tests) == 1
    assert doctest.DocTestRunner().run(tests[0]).failed == 0


def meeting(config, dz, dx, vz=0.0, vx=0.0):
    """The robot at the origin goes along z at full speed towards far goals; one person."""
    observation = np.zeros(28)
    observation[[2, 4, 7, 8, 11, 12]] = 1.0, config.robot_speed, 10.0, 1.0, 14.0, 1.0
    observation[15:19] = dz, dx, vz - config.robot_speed, vx
    observation[19:] = config.ray_range
    return observation


def test_straight_minds_nobody():
    config = config_of(num_humans=1)
    action, _ = StraightToGoal(config).predict(meeting(config, 1.0, 0.0))
    np.testing.assert_allclose(action, [1.0, 0.0], atol=1e-6)


@pytest.mark.parametrize("controller", [SocialForceRobot, DynamicWindow])
def test_it_evades_to_the_free_side(controller):
    config = config_of(num_humans=1)
    robot = controller(config)
    assert robot.predict(meeting(config, 1.2, 0.25))[0][1] < 0.0  # a person left: to the right
    assert robot.predict(meeting(config, 1.2, -0.25))[0][1] > 0.0
    np.testing.assert_allclose(robot.predict(meeting(config, -5.0, 2.0))[0], [1.0, 0.0], atol=0.05)


def test_the_window_foresees_who_crosses():
    config = config_of(num_humans=1)
    robot = DynamicWindow(config)
    crossing = robot.predict(meeting(config, 1.3, -1.5, vx=1.0))[0]
    standing = robot.predict(meeting(config, 1.3, -1.5))[0]
    assert standing[0] == 1.0
    assert crossing[0] < 1.0 or abs(crossing[1]) > abs(standing[1])


def test_backwards_is_not_ahead():
    config = config_of(num_humans=0, action="holonomic")
    parameters = DynamicWindow(config)._parameters
    bodies, way = np.zeros((1, 6)), np.array([8.0, 0.0])
    back, nearly = (merit(bodies, way, -0.4, left, 0.0, parameters) for left in (0.0, 1e-9))
    assert back == pytest.approx(nearly, abs=1e-6)
    assert merit(bodies, -way, -0.4, 0.0, 0.0, parameters) == pytest.approx(
        merit(bodies, way, 0.4, 0.0, 0.0, parameters), abs=1e-9
    )


def test_the_social_force_is_that_of_a_person_in_its_place():
    # Between the walls at the top speed towards the goal, far from anybody: nothing to change.
    config = config_of(num_humans=1, action="holonomic")
    action, _ = SocialForceRobot(config).predict(meeting(config, -9.0, 0.0))
    np.testing.assert_allclose(action, [1.0, 0.0, 0.0], atol=1e-3)


# --- how well they do ----------------------------------------------------------------------------


@each_controller
@each_action
@pytest.mark.parametrize("scenario", ["paper", "crowded"])
def test_it_reaches_the_goal(name, action, scenario):
    config = config_of(scenario=scenario, action=action)
    robot = CONTROLLERS[name](config)
    table = evaluate(robot, episodes=16, num_envs=16, seed=7, scenario=scenario, action=action)
    assert table["success"].mean >= 0.9
    assert table["spl"].mean >= 0.8


@each_controller
def test_it_goes_through_a_doorway(name):
    robot = CONTROLLERS[name](config_of(scenario="doorway", num_humans=0))
    table = evaluate(robot, episodes=16, num_envs=16, scenario="doorway", num_humans=0)
    assert table["success"].mean == 1.0
    assert table["wall_collisions"].mean == 0.0


def test_who_evades_hits_fewer_people_who_do_not():
    settings = {"action": "holonomic", "robot_visible": False}
    rates = {
        name: evaluate(CONTROLLERS[name](config_of(**settings)), episodes=20, num_envs=20, **settings)["success"].mean  # noqa: E501
        for name in CONTROLLERS
    }  # fmt: skip
    assert min(rates["social-force"], rates["dynamic-window"]) > rates["straight"] + 0.3


@pytest.mark.parametrize("bad", [{"episodes": 0}, {"num_envs": 0}, {"episodes": 2.5}])
def test_an_impossible_evaluation_is_an_error(bad):
    with pytest.raises(ValueError, match=r"expected a whole number of at least 1"):
        evaluate(StraightToGoal(config_of()), **bad)


def test_the_autoreset_mode_is_the_evaluations_own():
    with pytest.raises(ValueError, match="autoreset_mode: expected none"):
        evaluate(StraightToGoal(config_of()), autoreset_mode="NextStep")


class Watcher:
    """Keeps what it is told."""

    def __init__(self):
        self.told = []

    def predict(self, observation, state=None, episode_start=None, *, deterministic):
        self.told.append((observation.copy(), episode_start.copy()))
        return np.tile([1.0, 0.2], (len(observation), 1)), state


def test_an_episodes_start_is_marked_where_it_is_observed():
    watcher = Watcher()
    table = evaluate(watcher, episodes=6, num_envs=np.int64(2), max_episode_steps=4)
    observations, begins = (np.array(told) for told in zip(*watcher.told, strict=True))
    assert table["length"].n == 6 and begins.sum() == 6 and len(begins) == 12
    stands = observations[..., 4] == 0.0  # only at its start
    np.testing.assert_array_equal(begins, stands)


def test_equal_seeds_give_equal_tables():
    robot = SocialForceRobot(config_of())
    tables = [evaluate(robot, episodes=6, num_envs=3, seed=s, max_episode_steps=50) for s in (1, 1, 2)]  # fmt: skip  # noqa: E501
    assert tables[0].to_markdown() == tables[1].to_markdown() != tables[2].to_markdown()
    assert tables[0]["length"].n == 6
