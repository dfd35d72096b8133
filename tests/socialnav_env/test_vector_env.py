import copy
import doctest
import pickle

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import vector as wrappers

from socialnav_env.config import SCENARIOS, ConfigError
from socialnav_env.metrics import METRICS
from socialnav_env.reward import TERMS
from socialnav_env.vector_env import SocialCorridorVectorEnv

LENIENT = {"terminate_on_goal": False, "terminate_on_collision": False}
MODES = list(AutoresetMode)
SETTINGS = [
    *({"scenario": name} for name in SCENARIOS),
    {"walking": "group", "num_humans": 5, "observation": "rays", "ray_noise": 0.1},
    {"walking": "queue", "observation": "state", "tracking_noise": 0.1, "reactive": False},
    {"walking": "mixed", "action": "holonomic", "ray_noise": 0.2, "tracking_noise": 0.2},
    {"robot_visible": False, "frame_skip": 1, "timestep": 0.1, **LENIENT},
]


def make(count, **settings):
    return gym.make_vec("SocialCorridor-v0", num_envs=count, **settings)


def make_sync(count, mode, **settings):
    kwargs = {"autoreset_mode": mode}
    return gym.make_vec(
        "SocialCorridor-v0", count, vectorization_mode="sync", vector_kwargs=kwargs, **settings
    )


def assert_same(ours, theirs):
    """Equal in every bit, key and type."""
    assert type(ours) is type(theirs)
    if isinstance(ours, dict):
        assert ours.keys() == theirs.keys()
        for name in ours:
            assert_same(ours[name], theirs[name])
        return
    assert ours.dtype == theirs.dtype and ours.shape == theirs.shape
    if ours.dtype == object:
        assert [one is None for one in ours] == [one is None for one in theirs]
        for mine, yours in zip(ours, theirs, strict=True):
            if mine is not None:
                assert_same(mine, yours)
    else:
        assert ours.tobytes() == theirs.tobytes()


def actions_for(env, rng):
    """Mostly straight on, so that goals, people and walls are met."""
    actions = rng.uniform(-1.0, 1.0, env.action_space.shape)
    actions[:, 0] = np.minimum(actions[:, 0] + 0.8, 1.0)
    actions[:, -1] *= 0.5
    return actions


# --- the same as single envs ---------------------------------------------------------------------


@pytest.mark.parametrize("settings", SETTINGS, ids=str)
@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.value)
def test_it_tells_what_single_envs_in_gymnasiums_sync_vector_env_tell(mode, settings):
    """Bit by bit, over many whole episodes: observations, rewards, ends, info and its masks."""
    settings = {"max_episode_steps": 45, "half_length": 8.0, "start_z": -6.0, **settings}
    settings |= {"intermittent_z": -4.0, "goal_z": 0.0, "doorway_z": -2.0}
    ours, theirs = make(2, autoreset_mode=mode, **settings), make_sync(2, mode, **settings)
    assert (ours.observation_space, ours.action_space) == (
        theirs.observation_space,
        theirs.action_space,
    )
    options = {"human_speed": (0.3, 0.9), "goal_z": (-1.0, 1.0)}
    first = (env.reset(seed=7, options=dict(options)) for env in (ours, theirs))
    for mine, yours in zip(*first, strict=True):
        assert_same(mine, yours)
    rng, ends = np.random.default_rng(0), 0
    further = [{}, {"goal_z": -1.5}, {"defaults": True}, {"human_speed": [0.5, 0.7]}]
    for _ in range(140):
        actions = actions_for(ours, rng)
        told = ours.step(actions)
        for mine, yours in zip(told, theirs.step(actions), strict=True):
            assert_same(mine, yours)
        ended = told[2] | told[3]
        ends += np.count_nonzero(ended)
        if mode is AutoresetMode.DISABLED and ended.any():
            given = {"reset_mask": ended, **further[ends % 4]}
            mine, yours = (env.reset(options=dict(given)) for env in (ours, theirs))
            assert_same(mine[0], yours[0])
            assert_same(mine[1], yours[1])
    assert ends >= 5
    for one, other in zip(ours.np_random, theirs.np_random, strict=True):
        assert one.bit_generator.state == other.bit_generator.state


@pytest.mark.parametrize("seed", [5, [3, 8], [None, 4]], ids=str)
def test_the_generators_are_told_as_by_gymnasiums_sync_vector_env(seed):
    ours, theirs = make(2), make_sync(2, AutoresetMode.NEXT_STEP)
    for env in (ours, theirs):
        env.reset(seed=seed)
    known = slice(1 if seed == [None, 4] else 0, None)
    assert ours.np_random_seed[known] == theirs.np_random_seed[known]
    assert type(ours.np_random_seed) is type(ours.np_random) is tuple
    assert len(ours.np_random_seed) == len(ours.np_random) == 2
    for one, other in zip(ours.np_random[known], theirs.np_random[known], strict=True):
        assert one.bit_generator.state == other.bit_generator.state


def test_the_first_reset_without_a_seed_goes_on_from_the_generators_that_were_told():
    env = make(2)
    assert len(set(env.np_random_seed)) == 2
    seeds = list(env.np_random_seed)
    np.testing.assert_array_equal(env.reset()[0], make(2).reset(seed=seeds)[0])


def test_a_corridor_does_not_depend_on_how_many_there_are():
    few, many = make(2), make(40)
    few.reset(seed=3)
    many.reset(seed=3)
    rng = np.random.default_rng(0)
    for _ in range(300):
        actions = actions_for(many, rng)
        one, other = few.step(actions[:2]), many.step(actions)
        for mine, yours in zip(one[:4], other[:4], strict=True):
            np.testing.assert_array_equal(mine, yours[:2])


# --- making --------------------------------------------------------------------------------------


def test_make_vec_makes_one_world():
    env = make(5, num_humans=2)
    assert isinstance(env.unwrapped, SocialCorridorVectorEnv)
    assert env.num_envs == 5
    assert env.max_episode_steps == 600
    single = gym.make("SocialCorridor-v0", num_humans=2)
    assert env.single_observation_space == single.observation_space
    assert env.single_action_space == single.action_space
    assert env.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert SocialCorridorVectorEnv.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP


def test_the_example_runs():
    tests = doctest.DocTestFinder(recurse=False).find(SocialCorridorVectorEnv, globs={})
    assert doctest.DocTestRunner().run(tests[0]) == (0, 6)


@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.value)
def test_the_mode_is_a_member_or_its_value(mode):
    for said in (mode, mode.value):
        assert make(1, autoreset_mode=said).metadata["autoreset_mode"] is mode


def test_the_frame_rate_is_that_of_the_steps():
    assert make(1, frame_skip=4, timestep=0.01).metadata["render_fps"] == 25


def test_spaces_are_batches():
    env = make(3)
    observations, _ = env.reset(seed=0)
    assert env.observation_space.contains(observations)
    observations, rewards, terminated, truncated, info = env.step(np.zeros((3, 2)))
    assert env.observation_space.contains(observations)
    assert rewards.shape == terminated.shape == truncated.shape == (3,)
    assert all(values.shape == (3,) for values in info.values())


def test_the_time_limit_is_gymnasiums():
    assert make(1, max_episode_steps=None).max_episode_steps == 600
    env = make(1, num_humans=0, max_episode_steps=-1)
    env.reset(seed=0)
    for _ in range(610):
        assert not env.step(np.array([[-1.0, 0.0]]))[3].any()


@pytest.mark.parametrize(
    "bad", [{"num_envs": 0}, {"num_envs": 1.5}, {"num_envs": True}, {"max_episode_steps": 0}]
)
def test_impossible_counts_are_an_error(bad):
    with pytest.raises(ConfigError, match="expected a whole number of at least 1"):
        SocialCorridorVectorEnv(**{"num_envs": 1, **bad})


@pytest.mark.parametrize(
    ("bad", "said"),
    [
        ({"people": 3}, "unknown keyword people"),
        ({"scenario": "maze"}, "scenario='maze'"),
        ({"autoreset_mode": "never"}, "autoreset_mode='never': expected one of NextStep"),
        ({"render_mode": "ansi"}, "render_mode='ansi'"),
        ({"render_envs": [2]}, r"render_envs=\[2\]: expected different whole numbers in \[0, 1\]"),
        ({"render_envs": [0, 0]}, "render_envs"),
        ({"render_envs": []}, "render_envs"),
        ({"camera": "drone"}, "camera='drone'"),
        ({"overlays": ["ray"]}, "overlays"),
        ({"render_envs": 5}, r"render_envs=5: expected different whole numbers in \[0, 1\]"),
        ({"render_envs": [0.0]}, r"render_envs=\[0.0\]: expected different"),
        ({"render_envs": [True]}, r"render_envs=\[True\]: expected different"),
        ({"render_envs": "01"}, "render_envs='01': expected different"),
    ],
)
def test_unknown_keywords_are_an_error(bad, said):
    with pytest.raises(ConfigError, match=said):
        make(2, **bad)


def test_counts_may_be_numpys():
    env = SocialCorridorVectorEnv(
        np.int64(2), max_episode_steps=np.int32(3), render_mode="rgb_array",
        render_width=np.int64(64), render_envs=np.array([1]), num_humans=np.int8(2),
    )  # fmt: skip
    env.reset(seed=[np.int64(5), None])
    assert (type(env.num_envs), type(env.max_episode_steps)) == (int, int)
    assert env.render()[0].shape[1] == 64
    for _ in range(3):
        truncated = env.step(np.zeros((2, 2)))[3]
    assert truncated.all()


# --- what follows an end -------------------------------------------------------------------------

AHEAD = np.tile([1.0, 0.0], (4, 1))


def test_next_step_begins_anew_in_the_step_after_the_end():
    env = make(4, max_episode_steps=7, **LENIENT)
    env.reset(seed=0)
    for step in range(1, 25):
        observations, rewards, terminated, truncated, info = env.step(AHEAD)
        assert not terminated.any()
        assert truncated.all() == (step % 8 == 7)
        assert "final_obs" not in info
        fresh = step % 8 == 0
        assert (rewards == 0.0).all() == fresh
        assert (observations[:, 4] == 0.0).all() == fresh


def test_same_step_begins_anew_at_once():
    env = make(4, max_episode_steps=7, autoreset_mode="SameStep", **LENIENT)
    first, _ = env.reset(seed=0)
    for step in range(1, 22):
        observations, rewards, terminated, truncated, info = env.step(AHEAD)
        assert not terminated.any() and (rewards != 0.0).all()
        assert truncated.all() == ("final_obs" in info) == (step % 7 == 0)
    assert info["_final_obs"].all() and info["_final_info"].all()
    final = np.stack(info["final_obs"])
    np.testing.assert_array_equal(info["final_info"]["z_position"], final[:, 1])
    np.testing.assert_array_equal(info["z_position"], observations[:, 1])
    assert (observations[:, 1] < -13.0).all() and (observations != first).any()


def test_disabled_waits_for_a_reset():
    env = make(4, max_episode_steps=3, autoreset_mode="Disabled", **LENIENT)
    env.reset(seed=0)
    for _ in range(3):
        truncated = env.step(AHEAD)[3]
    assert truncated.all()
    with pytest.raises(gym.error.ResetNeeded, match=r"corridors \[0, 1, 2, 3\] are over"):
        env.step(AHEAD)
    env.reset(options={"reset_mask": np.array([True, True, False, True])})
    with pytest.raises(gym.error.ResetNeeded, match=r"corridors \[2\] are over"):
        env.step(AHEAD)
    env.reset(options={"reset_mask": np.array([False, False, True, False])})
    assert not env.step(AHEAD)[3].any()


def test_only_corridors_that_end_begin_anew():
    env = make(3, num_humans=0, autoreset_mode="SameStep")
    env.reset(seed=0)
    world = env.unwrapped.world
    world.place(1, np.array([[0.0, 2.69, np.pi / 2, 0.0, 0.0, 0.0]]))
    before = world.state.bodies.copy()
    ended = np.zeros(3, dtype=bool)
    while not ended.any():
        _, rewards, terminated, truncated, info = env.step(AHEAD[:3])
        ended = terminated | truncated
    assert ended.tolist() == info["_final_obs"].tolist() == [False, True, False]
    final = info["final_info"]
    assert final["wall_collisions"].tolist() == [0.0, 1.0, 0.0]
    assert rewards[1] == np.sum([final[name][1] for name in TERMS])
    np.testing.assert_array_less(before[[0, 2], 0, 0], world.state.bodies[[0, 2], 0, 0])
    assert world.state.time[[0, 2]].min() > 0.0 == world.state.time[1]


def test_an_end_on_the_last_step_is_both_as_with_gymnasiums_time_limit():
    env = make(2, num_humans=0, max_episode_steps=1)
    env.reset(seed=0)
    env.unwrapped.world.state.goals[0, 1] = env.unwrapped.world.state.bodies[0, 0, :2]
    _, _, terminated, truncated, _ = env.step(np.zeros((2, 2)))
    assert terminated.tolist() == [True, False]
    assert truncated.tolist() == [True, True]


# --- resets --------------------------------------------------------------------------------------


def test_seeds():
    one = make(3).reset(seed=5)[0]
    np.testing.assert_array_equal(make(3).reset(seed=[5, 6, 7])[0], one)
    np.testing.assert_array_equal(make(3).reset(seed=np.int64(5))[0], one)
    assert len(np.unique(one, axis=0)) == 3
    np.testing.assert_array_equal(make(3).reset(seed=np.array([5, 6, 7]))[0], one)
    with pytest.raises(ConfigError, match="seed: expected 3 seeds, got 2"):
        make(3).reset(seed=[1, 2])


@pytest.mark.parametrize("bad", [0.5, [1, 2.0, 3], [1, "2", 3], True, "123", [1, -2, 3]], ids=str)
def test_a_seed_is_a_whole_number(bad):
    env = make(3)
    env.reset(seed=0)
    before = pickle.dumps(env.get_snapshot())
    with pytest.raises(ConfigError, match=r"seed=.*: expected None or a whole number"):
        env.reset(seed=bad)
    assert pickle.dumps(env.get_snapshot()) == before


def test_no_seed_goes_on_drawing():
    env, again = make(2), make(2)
    told = [[e.reset(seed=1)[0], e.reset()[0], e.reset()[0]] for e in (env, again)]
    np.testing.assert_array_equal(told[0], told[1])
    assert len(np.unique(np.vstack(told[0]), axis=0)) == 6
    mixed = again.reset(seed=[None, 2])[0]
    np.testing.assert_array_equal(mixed[0], env.reset()[0][0])
    np.testing.assert_array_equal(mixed[1], make(2).reset(seed=1)[0][1])


@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.value)
def test_a_mask_chooses_which_corridors_begin_anew(mode):
    env = make(4, autoreset_mode=mode, ray_noise=0.1, max_episode_steps=20)
    env.reset(seed=0)
    for _ in range(10):
        observations = env.step(AHEAD)[0]
    mask = np.array([True, False, False, True])
    options = {"reset_mask": mask}
    after, info = env.reset(seed=[8, 9, None, None], options=options)
    assert options["reset_mask"] is mask, "wrappers outside read it too"
    np.testing.assert_array_equal(after[~mask], observations[~mask])
    assert (after[mask] != observations[mask]).any(axis=1).all()
    np.testing.assert_array_equal(after[0], make(1, ray_noise=0.1).reset(seed=8)[0][0])
    assert (info["_z_position"] == mask).all()
    assert (info["z_position"][~mask] == 0.0).all()
    truncated = [env.step(AHEAD)[3].tolist() for _ in range(10)]
    assert truncated[-1] == (~mask).tolist()


@pytest.mark.parametrize(
    "bad",
    [[True, False], np.ones(2), np.ones(3, dtype=bool), np.zeros(2, dtype=bool), None],
    ids=str,
)
def test_a_bad_mask_is_an_error(bad):
    env = make(2)
    env.reset(seed=0)
    with pytest.raises(ConfigError, match=r"reset_mask=.*expected an array of bool of shape"):
        env.reset(options={"reset_mask": bad})


def test_the_first_reset_is_for_all():
    with pytest.raises(gym.error.ResetNeeded, match="reset all corridors"):
        make(2).reset(options={"reset_mask": np.array([True, False])})


def start_of(env, n):
    """Where a robot starts along the corridor, give or take half a metre."""
    return env.unwrapped.world.state.bodies[n, 0, 0]


def test_options_stay_until_others_come():
    env = make(3, max_episode_steps=2, **LENIENT)
    env.reset(seed=0, options={"start_z": 3.0})
    assert all(abs(start_of(env, n) - 3.0) <= 0.5 for n in range(3))
    for _ in range(3):
        env.step(AHEAD[:3])
    assert all(abs(start_of(env, n) - 3.0) <= 0.5 for n in range(3)), "autoreset keeps them"
    first, last = np.array([True, False, False]), np.array([False, False, True])
    env.reset(options={"reset_mask": first, "start_z": 9.0})
    env.reset(options={"reset_mask": last})
    env.reset()
    assert [round(start_of(env, n) / 3.0) for n in range(3)] == [3, 1, 1]
    env.reset(options={})
    assert [round(start_of(env, n) / 3.0) for n in range(3)] == [3, 1, 1]
    env.reset(options={"reset_mask": last, "defaults": True})
    env.reset()
    assert [round(start_of(env, n) / 3.0) for n in range(3)] == [3, 1, -5]
    env.reset(options={"defaults": True})
    assert all(abs(start_of(env, n) + 14.0) <= 0.5 for n in range(3))


@pytest.mark.parametrize("begun", [True, False])
def test_a_reset_that_fails_leaves_everything_as_it_was(monkeypatch, begun):
    env, twin = make(3, ray_noise=0.1), make(3, ray_noise=0.1)
    for one in (env, twin):
        if begun:
            one.reset(seed=0, options={"human_speed": 0.5})
            one.step(AHEAD[:3])
    begin = env.world.begin

    def fails_at_the_last(n, *given):
        if n == 2:
            raise ConfigError("too small")
        begin(n, *given)

    with monkeypatch.context() as patch, pytest.raises(ConfigError, match="too small"):
        patch.setattr(env.world, "begin", fails_at_the_last)
        env.reset(seed=9, options={"human_speed": 0.9})
    if begun:
        assert pickle.dumps(env.get_snapshot()) == pickle.dumps(twin.get_snapshot())
    seed = None if begun else 1
    for mine, yours in zip(env.reset(seed=seed), twin.reset(seed=seed), strict=True):
        assert_same(mine, yours)


@pytest.mark.parametrize("bad", [5, [("human_speed", 0.5)], "defaults"], ids=str)
def test_options_are_a_mapping(bad):
    with pytest.raises(ConfigError, match=r"options=.*expected None or a mapping"):
        make(2).reset(options=bad)


@pytest.mark.parametrize("name", ["render", "render_tiled", "state_rows"])
def test_there_is_nothing_to_see_before_the_first_reset(name):
    env = make(2, render_mode="rgb_array")
    with pytest.raises(gym.error.ResetNeeded, match=rf"reset\(\) before {name}\(\)"):
        getattr(env, name)()


def test_an_unknown_option_is_an_error_and_changes_nothing():
    env = make(2)
    env.reset(seed=0)
    before = env.get_snapshot()
    with pytest.raises(ConfigError, match="unknown reset option mask"):
        env.reset(seed=1, options={"mask": 1})
    assert env.get_snapshot().generators == before.generators
    np.testing.assert_array_equal(env.state_rows(), before.state.scene_rows())


# --- steps ---------------------------------------------------------------------------------------


def test_infos_and_observations_of_earlier_steps_stay_as_they_were():
    env = make(2, max_episode_steps=3, autoreset_mode="SameStep")
    told = [env.reset(seed=0), *(env.step(np.ones((2, 2)))[::4] for _ in range(2))]
    kept = copy.deepcopy(told)
    for _ in range(5):
        env.step(np.ones((2, 2)))
    env.reset(options={"reset_mask": np.array([True, False])})
    for (observations, info), (then, values) in zip(told, kept, strict=True):
        np.testing.assert_array_equal(observations, then)
        assert_same(info, values)


@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.value)
def test_a_mask_cannot_be_written_to_since_all_keys_share_it(mode):
    env = make(2, max_episode_steps=1, autoreset_mode=mode)
    told = [env.reset(seed=0)[1], env.step(AHEAD[:2])[4]]
    told += [told[1].get("final_info", {})]
    for info in told:
        masks = [value for name, value in info.items() if name.startswith("_")]
        assert not any(mask.flags.writeable for mask in masks)


def test_what_is_told_may_be_written_to():
    env, other = make(2), make(2)
    for one in (env, other):
        observations, info = one.reset(seed=0)
    observations[...] = 0.0
    info["z_position"][:] = 0.0
    mask = np.array([False, True])
    kept, expected = (one.reset(options={"reset_mask": mask})[0] for one in (env, other))
    np.testing.assert_array_equal(kept, expected)


@pytest.mark.parametrize("bad", [np.zeros((2, 3)), np.zeros(2), np.full((3, 2), np.nan)])
def test_bad_actions_are_an_error(bad):
    env = make(3)
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"expected finite numbers of shape \(3, 2\)"):
        env.step(bad)


def test_a_step_needs_a_reset():
    with pytest.raises(gym.error.ResetNeeded, match="reset"):
        make(2).step(np.zeros((2, 2)))


def test_rows_draw_the_moment_they_were_taken_at():
    env, single = make(2), gym.make("SocialCorridor-v0").unwrapped
    env.reset(seed=3)
    single.reset(seed=4)
    np.testing.assert_array_equal(env.state_rows()[1], single.state_row())


# --- Gymnasium's wrappers ------------------------------------------------------------------------


@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.value)
def test_episode_statistics(mode):
    env = wrappers.RecordEpisodeStatistics(make(3, max_episode_steps=6, autoreset_mode=mode))
    env.reset(seed=0)
    total, episodes = np.zeros(3), []
    for _ in range(30):
        _, rewards, terminated, truncated, info = env.step(AHEAD[:3])
        total += rewards
        ended = terminated | truncated
        if ended.any():
            episodes += info["episode"]["l"][ended].tolist()
            np.testing.assert_allclose(info["episode"]["r"][ended], total[ended])
            total[ended] = 0.0
            if mode is AutoresetMode.DISABLED:
                env.reset(options={"reset_mask": ended})
    assert len(episodes) >= 12 and set(episodes) == {6}


def test_observations_and_rewards_are_normalised():
    env = wrappers.NormalizeReward(wrappers.NormalizeObservation(make(64, max_episode_steps=50)))
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    seen = [env.step(actions_for(env, rng))[0] for _ in range(200)]
    spread = np.std(seen[-50:], axis=(0, 1))
    assert np.median(spread) == pytest.approx(1.0, abs=0.3)


def test_infos_as_a_list():
    env = wrappers.DictInfoToList(make(2, max_episode_steps=2, autoreset_mode="SameStep"))
    env.reset(seed=0)
    env.step(AHEAD[:2])
    infos = env.step(AHEAD[:2])[4]
    assert [set(METRICS) <= set(info["final_info"]) for info in infos] == [True, True]


# --- many steps ----------------------------------------------------------------------------------


def test_nothing_leaves_the_corridor_in_many_random_steps():
    count, steps = 128, 500
    env = SocialCorridorVectorEnv(count, terminate_on_collision=False)
    observations, _ = env.reset(seed=0)
    config, rng = env.config, np.random.default_rng(0)
    low, high = env.single_observation_space.low, env.single_observation_space.high
    edge = np.array([config.half_length, config.half_width])
    radii = np.array([config.robot_radius] + [config.human_radius] * config.num_humans)
    deepest = (config.robot_speed + config.human_top_speed) * config.timestep + 0.01
    lowest, highest, farthest, contacts = observations.min(0), observations.max(0), -np.inf, 0.0
    push = np.zeros((count, 2))
    for step in range(steps):
        if step % 20 == 0:  # held for two seconds, so that the robots get somewhere
            push = rng.uniform(-1.0, 1.0, (count, 2)) * (1.0, 0.3) + (0.6, 0.0)
        observations, _, _, _, info = env.step(push)
        lowest = np.minimum(lowest, observations.min(axis=0))
        highest = np.maximum(highest, observations.max(axis=0))
        beyond = np.abs(env.world.state.bodies[..., :2]) + radii[:, None] - edge
        farthest = max(farthest, beyond.max())
        contacts += np.count_nonzero(info["reward_collision"])
    assert contacts > 2_000
    assert np.isfinite(highest).all()
    assert (low <= lowest).all() and (highest <= high).all()
    assert farthest <= deepest  # no deeper into a wall than one physics step presses
