"""Through Gymnasium's vector wrappers the vector env tells what many single envs tell."""

import gymnasium as gym
import imageio.v3 as iio
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import vector

import socialnav_env  # noqa: F401 (registers the id)

COUNT, STEPS, LIMIT = 3, 60, 25

EVERY = {
    "nothing": lambda env: env,
    "RecordEpisodeStatistics": vector.RecordEpisodeStatistics,
    "NormalizeReward": vector.NormalizeReward,
    "ClipAction": vector.ClipAction,
    "RescaleAction": lambda env: vector.RescaleAction(env, np.float32(0), np.float32(1)),
    "ClipReward": lambda env: vector.ClipReward(env, -0.1, 0.1),
    "FlattenObservation": vector.FlattenObservation,
    "DtypeObservation": lambda env: vector.DtypeObservation(env, np.float32),
    "RescaleObservation": lambda env: vector.RescaleObservation(env, np.float64(-1), np.float64(1)),
    "DictInfoToList": vector.DictInfoToList,
}  # fmt: skip


def many(mode, **settings):
    """Our vector env."""
    return gym.make_vec(
        "SocialCorridor-v0", COUNT, max_episode_steps=LIMIT, autoreset_mode=mode, **settings
    )


def single(mode, vectorization="sync", **vector_kwargs):
    """Gymnasium's vector env of single ones."""
    return gym.make_vec(
        "SocialCorridor-v0",
        COUNT,
        max_episode_steps=LIMIT,
        vectorization_mode=vectorization,
        vector_kwargs={"autoreset_mode": mode, **vector_kwargs},
    )


def told(env, mode, steps=STEPS):
    """Everything that the env tells under some actions, but for how long it took."""
    rng = np.random.default_rng(0)
    observations, info = env.reset(seed=0)
    rows = [(observations, info)]
    for _ in range(steps):
        row = env.step(rng.uniform(0.0, 1.0, (COUNT, 2)).astype(np.float32))
        if isinstance(row[4], dict):
            row[4].get("episode", {}).pop("t", None)
        rows.append(row)
        ended = row[2] | row[3]
        if mode is AutoresetMode.DISABLED and ended.any():
            rows.append(env.reset(options={"reset_mask": ended}))
    env.close()
    return rows


def check_equal(first, second):
    for one, other in zip(first, second, strict=True):
        assert len(one) == len(other)
        for mine, theirs in zip(one, other, strict=True):
            np.testing.assert_equal(mine, theirs)


@pytest.mark.parametrize("mode", AutoresetMode)
@pytest.mark.parametrize("name", EVERY)
def test_a_vector_wrapper_sees_no_difference(name, mode):
    wrap = EVERY[name]
    check_equal(told(wrap(many(mode)), mode), told(wrap(single(mode)), mode))


def test_observations_are_normalised_alike():
    """Gymnasium's wrapper has them normalised in its default mode only."""
    mode = AutoresetMode.NEXT_STEP
    wrap = vector.NormalizeObservation
    check_equal(told(wrap(many(mode)), mode), told(wrap(single(mode)), mode))


def test_envs_in_processes_of_their_own_tell_the_same():
    mode = AutoresetMode.NEXT_STEP
    # Started anew: a fork of a process that has threads is a warning from Python 3.12 on.
    apart = single(mode, "async", context="spawn")
    check_equal(told(many(mode), mode, 30), told(apart, mode, 30))


def test_the_wrappers_of_a_usual_training_can_be_stacked():
    env = many(AutoresetMode.NEXT_STEP, scenario="crowded", observation="rays")
    env = vector.RecordEpisodeStatistics(env)
    env = vector.ClipAction(env)
    env = vector.NormalizeObservation(env)
    env = vector.NormalizeReward(env)
    ends = 0
    for row in told(env, AutoresetMode.NEXT_STEP)[1:]:
        assert env.observation_space.contains(row[0])
        ends += len(np.flatnonzero(row[2] | row[3]))
    assert env.get_wrapper_attr("episode_count") == ends >= 2 * COUNT


def test_a_video_shows_all_corridors(tmp_path):
    pytest.importorskip("moviepy")
    mode = AutoresetMode.NEXT_STEP
    env = many(mode, render_mode="rgb_array", render_width=320)
    env.reset(seed=0)
    height = env.render()[0].shape[0]
    env = vector.RecordVideo(
        env, tmp_path / "videos", video_aspect_ratio=(1, 3), episode_trigger=lambda n: n == 0
    )
    told(env, mode)
    (video,) = (tmp_path / "videos").glob("*.mp4")
    frames = iio.imread(video)
    assert frames.shape[1] * frames.shape[2] == COUNT * height * 320
    assert 1 < len(frames) <= LIMIT + 1
