"""Gymnasium's wrappers around the single env do what they promise."""

import gymnasium as gym
import imageio_ffmpeg as ffmpeg
import numpy as np
import pytest
from gymnasium import wrappers

import socialnav_env  # noqa: F401 (registers the id)


def make(**settings):
    return gym.make("SocialCorridor-v0", **settings)


def told(env, actions, seed=0):
    """Everything that the env tells under these actions, a new episode after each end."""
    rows = [env.reset(seed=seed)]
    for action in actions:
        row = env.step(action)
        rows.append(row)
        if row[2] or row[3]:
            rows.append(env.reset())
    return rows


def actions(count, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform((0.0, -1.0), (1.0, 1.0), (count, 2)).astype(np.float32)


LOW, HIGH = np.float64(-1.0), np.float64(1.0)
EVERY = {
    "TimeLimit": lambda env: wrappers.TimeLimit(env, 20),
    "RecordEpisodeStatistics": wrappers.RecordEpisodeStatistics,
    "NormalizeObservation": wrappers.NormalizeObservation,
    "NormalizeReward": wrappers.NormalizeReward,
    "FrameStackObservation": lambda env: wrappers.FrameStackObservation(env, 4),
    "FlattenObservation": wrappers.FlattenObservation,
    "RescaleObservation": lambda env: wrappers.RescaleObservation(env, LOW, HIGH),
    "DtypeObservation": lambda env: wrappers.DtypeObservation(env, np.float32),
    "TimeAwareObservation": wrappers.TimeAwareObservation,
    "DelayObservation": lambda env: wrappers.DelayObservation(env, 2),
    "RescaleAction": lambda env: wrappers.RescaleAction(env, np.float32(0), np.float32(1)),
    "ClipAction": wrappers.ClipAction,
    "StickyAction": lambda env: wrappers.StickyAction(env, 0.25),
    "ClipReward": lambda env: wrappers.ClipReward(env, -1.0, 1.0),
    "Autoreset": wrappers.Autoreset,
}

# Gymnasium says so of every env that observes in double precision.
single_precision = pytest.mark.filterwarnings("ignore:.*precision lowered by casting:UserWarning")


@single_precision
@pytest.mark.parametrize("name", EVERY)
def test_equal_seeds_give_equal_episodes_through_a_wrapper(name):
    first, second = (told(EVERY[name](make(max_episode_steps=40)), actions(60)) for _ in "ab")
    for one, other in zip(first, second, strict=True):
        np.testing.assert_equal(one[0], other[0])
        assert one[1:-1] == other[1:-1]


@single_precision
@pytest.mark.parametrize("name", EVERY)
def test_observations_lie_in_the_space_that_a_wrapper_declares(name):
    env = EVERY[name](make(max_episode_steps=40))
    for row in told(env, actions(60)):
        assert env.observation_space.contains(row[0])


def test_the_time_limit_ends_an_episode():
    env = wrappers.TimeLimit(make().unwrapped, 7)
    ends = [row[2:4] for row in told(env, [[-1.0, 0.0]] * 7)[1:8]]
    assert ends == [(False, False)] * 6 + [(False, True)]


def test_episode_statistics_are_sum_and_count():
    env = wrappers.RecordEpisodeStatistics(make(max_episode_steps=25))
    rows = told(env, actions(25))[1:26]
    episode = rows[-1][4]["episode"]
    assert episode["r"] == pytest.approx(sum(row[1] for row in rows), abs=1e-12)
    assert episode["l"] == 25


def test_normalised_observations_follow_the_mean_and_variance_of_those_seen():
    env = wrappers.NormalizeObservation(make(max_episode_steps=300))
    seen = np.array([row[0] for row in told(make(max_episode_steps=300), actions(200))])
    told(env, actions(200))
    # Gymnasium starts from a made-up 1e-4 of an observation with mean 0 and variance 1.
    np.testing.assert_allclose(env.obs_rms.mean, seen.mean(axis=0), atol=1e-5)
    np.testing.assert_allclose(env.obs_rms.var, seen.var(axis=0), atol=1e-3)


def test_normalised_rewards_keep_their_sign():
    plain = [row[1] for row in told(make(max_episode_steps=50), actions(100)) if len(row) == 5]
    env = wrappers.NormalizeReward(make(max_episode_steps=50))
    scaled = [row[1] for row in told(env, actions(100)) if len(row) == 5]
    assert np.isfinite(scaled).all()
    np.testing.assert_array_equal(np.sign(scaled), np.sign(plain))


def test_stacked_frames_are_the_last_observations():
    plain = [row[0] for row in told(make(), actions(10))]
    stacked = [row[0] for row in told(wrappers.FrameStackObservation(make(), 4), actions(10))]
    np.testing.assert_array_equal(stacked[0], [plain[0]] * 4)
    for t in range(3, 11):
        np.testing.assert_array_equal(stacked[t], plain[t - 3 : t + 1])


def test_a_flat_observation_is_the_observation():
    plain, flat = told(make(), actions(10)), told(EVERY["FlattenObservation"](make()), actions(10))
    assert [row[0].tolist() for row in flat] == [row[0].tolist() for row in plain]


def test_rescaled_actions_are_the_same_actions():
    plain = told(make(), actions(10))
    env = EVERY["RescaleAction"](make())
    scaled = told(env, (actions(10) + 1.0) / 2.0)
    assert env.action_space == gym.spaces.Box(0.0, 1.0, (2,))
    for one, other in zip(scaled, plain, strict=True):
        np.testing.assert_allclose(one[0], other[0], atol=1e-6)  # actions are single precision


def test_clipped_actions_may_be_any():
    env = wrappers.ClipAction(make())
    assert not env.action_space.is_bounded()
    far, near = told(env, [[9.0, -9.0]] * 5), told(make(), [[1.0, -1.0]] * 5)
    assert [row[0].tolist() for row in far] == [row[0].tolist() for row in near]


def test_pictures_are_collected():
    env = wrappers.RenderCollection(make(render_mode="rgb_array", render_width=64))
    told(env, actions(5))
    pictures = env.render()
    assert len(pictures) == 6
    assert all(picture.shape == pictures[0].shape for picture in pictures)


def test_pictures_can_be_the_observations():
    env = wrappers.AddRenderObservation(make(render_mode="rgb_array", render_width=64))
    for row in told(env, actions(5)):
        assert env.observation_space.contains(row[0])


def test_a_video_of_each_episode_is_recorded(tmp_path):
    env = make(render_mode="rgb_array", render_width=320, max_episode_steps=10)
    env = wrappers.RecordVideo(env, tmp_path / "videos", episode_trigger=lambda _: True)
    told(env, actions(15))
    env.close()
    first, second = sorted((tmp_path / "videos").glob("*.mp4"))
    # MoviePy multiplies frames by seconds and drops the last one where that rounds down.
    assert ffmpeg.count_frames_and_secs(first)[0] in (10, 11)
    frames, seconds = ffmpeg.count_frames_and_secs(second)
    assert frames in (5, 6)
    assert frames / seconds == pytest.approx(env.metadata["render_fps"], abs=0.5)
