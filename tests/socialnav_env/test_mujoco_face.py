import gymnasium as gym
import numpy as np
import pytest

import socialnav_env  # noqa: F401 (registers the env)


@pytest.fixture
def env():
    made = gym.make("SocialCorridor-v0").unwrapped
    made.reset(seed=0)
    return made


def test_sizes(env):
    assert (env.model.nq, env.model.nv, env.model.nu) == (9, 9, 2)
    assert env.data.qpos.shape == env.data.qvel.shape == (9,)
    assert env.state_vector().shape == (18,)
    assert env.model.opt.timestep * env.frame_skip == pytest.approx(env.dt)


def test_there_is_a_state_before_the_first_reset():
    made = gym.make("SocialCorridor-v0").unwrapped
    np.testing.assert_array_equal(made.init_qpos, made.data.qpos)
    made.do_simulation([1.0, 0.0], 10)
    assert made.data.qpos[1] > made.init_qpos[1]


def test_the_initial_state_is_that_of_the_last_reset(env):
    np.testing.assert_array_equal(env.data.qpos, env.init_qpos)
    np.testing.assert_array_equal(env.data.qvel, env.init_qvel)
    env.step([1.0, 0.0])
    assert not np.array_equal(env.data.qpos, env.init_qpos)
    env.init_qpos[:] = 99.0
    assert env.init_qpos.max() < 20.0, "what is told is a copy"


def test_set_state_and_state_vector_give_each_other_back(env):
    rng = np.random.default_rng(0)
    qpos, qvel = rng.uniform(-2.0, 2.0, 9), rng.uniform(-0.5, 0.5, 9)
    env.set_state(qpos, qvel)
    np.testing.assert_array_equal(env.data.qpos, qpos)
    np.testing.assert_array_equal(env.data.qvel, qvel)
    np.testing.assert_array_equal(env.state_vector(), np.concatenate([qpos, qvel]))


def test_qpos_is_x_z_and_heading_then_people(env):
    qpos = np.array([1.0, -3.0, 0.5, -1.0, 2.0, 0.0, 4.0, 1.0, 6.0])
    env.set_state(qpos, np.zeros(9))
    bodies = env.world.state.bodies[0]
    np.testing.assert_array_equal(bodies[0, :3], [-3.0, 1.0, 0.5])
    np.testing.assert_array_equal(bodies[1:, :2], [[2.0, -1.0], [4.0, 0.0], [6.0, 1.0]])
    _, _, _, _, info = env.step([-1.0, 0.0])
    assert info["x_position"] == pytest.approx(1.0, abs=1e-9)
    assert info["z_position"] == pytest.approx(-3.0, abs=1e-9)


def test_a_jump_is_no_progress_no_path_and_collects_nothing(env):
    collected = env.world.state.flags.copy()
    qpos = np.array([0.0, 7.0, 0.0, 2.0, -9.0, 2.0, -7.0, 2.0, -5.0])
    env.set_state(qpos, np.zeros(9))
    np.testing.assert_array_equal(env.world.state.flags, collected)
    _, _, _, _, info = env.step([-1.0, 0.0])
    assert info["reward_progress"] == pytest.approx(0.0, abs=1e-9)
    assert info["path_length"] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("name", ["qpos", "qvel"])
@pytest.mark.parametrize("bad", [np.zeros(8), np.zeros((9, 1)), np.full(9, np.nan)])
def test_a_bad_state_is_named_and_changes_nothing(env, name, bad):
    before = env.state_vector()
    parts = {"qpos": np.zeros(9), "qvel": np.zeros(9), name: bad}
    with pytest.raises(ValueError, match=f"{name}: expected"):
        env.set_state(**parts)
    np.testing.assert_array_equal(env.state_vector(), before)


@pytest.mark.parametrize(
    ("entry", "who"), [(0, "the robot"), (1, "the robot"), (4, "person 0"), (7, "person 2")]
)
def test_a_speed_that_could_take_a_body_through_a_wall_is_an_error(env, entry, who):
    before, qvel = env.state_vector(), np.zeros(9)
    qvel[entry] = 50.0
    with pytest.raises(ValueError, match=f"{who} moves at 50 m/s: expected at most 6, or"):
        env.set_state(env.data.qpos, qvel)
    np.testing.assert_array_equal(env.state_vector(), before)
    qvel[entry] = 5.9
    env.set_state(env.data.qpos, qvel)


@pytest.mark.parametrize("people", [0, 6])
def test_a_state_in_contact_is_taken_back_whatever_the_timestep(people):
    """At the longest timestep a small robot is pushed by fast people against walls."""
    made = gym.make(
        "SocialCorridor-v0", num_humans=people, robot_radius=0.1, timestep=0.12, frame_skip=1,
        half_length=5.0, half_width=1.5, start_z=-3.0, intermittent_z=0.0, goal_z=3.0,
        reactive=False,
    ).unwrapped  # fmt: skip
    made.reset(seed=0)
    made.action_space.seed(0)
    touched, action = 0.0, made.action_space.sample()
    for t in range(600):
        if t % 20 == 0:
            action = made.action_space.sample()
        touched = made.step([1.0, action[1]])[4]["wall_collisions"]
        made.set_state(made.data.qpos, made.data.qvel)
    assert touched > 20


def test_time_and_control(env):
    assert env.data.time == 0.0
    env.step([3.0, -0.25])
    assert env.data.time == pytest.approx(env.dt)
    np.testing.assert_array_equal(env.data.ctrl, [1.0, -0.25])
    env.do_simulation([0.0, 0.0], 7)
    assert env.data.time == pytest.approx(env.dt + 7 * env.model.opt.timestep)


def test_do_simulation_with_frame_skip_moves_as_a_step_does(env):
    snapshot = env.get_snapshot()
    env.step([0.7, 0.3])
    moved = env.state_vector()
    env.set_snapshot(snapshot)
    env.do_simulation([0.7, 0.3], env.frame_skip)
    np.testing.assert_array_equal(env.state_vector(), moved)


@pytest.mark.parametrize("name", ["x", "z"])
def test_velocities_in_info_are_those_of_qvel(env, name):
    _, _, _, _, info = env.step([1.0, 0.5])
    index = "xz".index(name)
    assert info[f"{name}_velocity"] == env.data.qvel[index]
    assert info[f"{name}_position"] == env.data.qpos[index]


def test_a_set_state_leaves_where_standing_people_look():
    made = gym.make("SocialCorridor-v0", walking="group", num_humans=4).unwrapped
    made.reset(seed=0)
    before = made.state_row()
    made.set_state(made.data.qpos, np.zeros(made.model.nv))
    np.testing.assert_array_equal(made.state_row(), before)


def test_a_holonomic_base_has_three_controls():
    made = gym.make("SocialCorridor-v0", action="holonomic").unwrapped
    made.reset(seed=0)
    made.do_simulation([0.0, 1.0, 0.0], 10)
    assert made.model.nu == len(made.data.ctrl) == 3
    with pytest.raises(ValueError, match=r"action: expected shape \(3,\)"):
        made.do_simulation([0.0, 1.0], 1)


def test_reset_model_starts_a_new_episode(env):
    env.step([1.0, 0.0])
    observation = env.reset_model()
    assert env.observation_space.contains(observation)
    assert env.data.time == 0.0


# --- code that was written for MujocoEnv ---------------------------------------------------------


class RandomShooting:
    """Model-predictive control by random shooting, with the env itself as the model.

    Nothing in it knows whether MuJoCo or the corridor is beneath: the state is saved and restored
    by qpos and qvel, actions go in through `do_simulation`, times are `dt` and `frame_skip`.
    """

    def __init__(self, env, score, seconds=1.0, tries=24, seed=0):
        self.env, self.score, self.tries = env.unwrapped, score, tries
        self.length = max(1, round(seconds / self.env.dt))
        self.rng = np.random.default_rng(seed)

    def action(self):
        qpos, qvel = self.env.data.qpos.copy(), self.env.data.qvel.copy()
        plans = self.rng.uniform(-1.0, 1.0, (self.tries, self.env.model.nu))
        scores = [self.imagine(qpos, qvel, plan) for plan in plans]
        self.env.set_state(qpos, qvel)
        return plans[int(np.argmax(scores))]

    def imagine(self, qpos, qvel, plan):
        """How good a held action is, from the same start."""
        self.env.set_state(qpos, qvel)
        for _ in range(self.length):
            self.env.do_simulation(plan, self.env.frame_skip)
        return self.score(self.env.data.qpos, self.env.data.qvel)


def control(env, planner, steps):
    """Set the env to its initial state without velocity, then follow the plans."""
    base = env.unwrapped
    env.reset(seed=0)
    base.set_state(base.init_qpos, np.zeros(base.model.nv))
    start, begun = base.data.qpos.copy(), base.data.time
    for _ in range(steps):
        base.do_simulation(planner.action(), base.frame_skip)
    assert base.state_vector().shape == (base.model.nq + base.model.nv,)
    assert base.data.ctrl.shape == env.action_space.shape == (base.model.nu,)
    assert base.data.time > begun
    return base.data.qpos - start


@pytest.mark.parametrize(
    ("env_id", "along", "seconds", "gained"),
    [("SocialCorridor-v0", 1, 1.0, 1.0), ("Walker2d-v5", 0, 0.1, 0.02)],
)
def test_a_planner_written_for_mujoco_runs_on_both(make_mujoco, env_id, along, seconds, gained):
    env = make_mujoco(env_id)
    planner = RandomShooting(env, lambda qpos, qvel: qpos[along] + 0.1 * qvel[along], seconds)
    assert control(env, planner, 25)[along] > gained


def test_positions_are_copies_to_be_changed_and_set():
    env = gym.make("SocialCorridor-v0").unwrapped
    env.reset(seed=0)
    qpos, before = env.data.qpos, env.data.qpos
    qpos[1] += 1.0
    np.testing.assert_array_equal(env.data.qpos, before)
    env.set_state(qpos, env.data.qvel)
    np.testing.assert_array_equal(env.data.qpos, qpos)


def test_writing_into_ctrl_is_an_error():
    """In MuJoCo it would be the next action; here it would be lost."""
    env = gym.make("SocialCorridor-v0").unwrapped
    env.reset(seed=0)
    with pytest.raises(ValueError, match="read-only"):
        env.data.ctrl[0] = 1.0


def test_observations_under_mujocos_name():
    env = gym.make("SocialCorridor-v0").unwrapped
    observation, _ = env.reset(seed=0)
    np.testing.assert_array_equal(env._get_obs(), observation)
