"""A Minari data set of the corridor can be recorded, loaded, and replayed to the last bit."""

import gc

import gymnasium as gym
import minari
import numpy as np
import pytest

import socialnav_env  # noqa: F401 (registers the id)

# Minari leaves a temporary folder to the garbage collector, which says so. It is gone all the same.
pytestmark = pytest.mark.filterwarnings("ignore:Implicitly cleaning up:ResourceWarning")

EPISODES = 3
DESCRIPTION = {
    "algorithm_name": "chance",
    "author": "nobody",
    "author_email": "nobody@example.org",
    "code_permalink": "tests/socialnav_env/test_minari.py",
    "description": "random actions",
    "eval_env": "SocialCorridor-v0",
}


def record(name, options=None, seeds=(None,) * EPISODES, **settings):
    """Record episodes of random actions."""
    env = minari.DataCollector(
        gym.make("SocialCorridor-v0", max_episode_steps=40, **settings), record_infos=True
    )
    env.action_space.seed(0)
    for seed in seeds:
        env.reset(seed=seed, options=options)
        ended = False
        while not ended:
            _, _, terminated, truncated, _ = env.step(env.action_space.sample())
            ended = terminated or truncated
    dataset = env.create_dataset(name, **DESCRIPTION)
    env.close()
    del env
    gc.collect()  # here, where its warning is expected
    return dataset


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))


def check_replay(env, episode, seed, options=None):
    """The episode's actions give its observations, rewards, ends and infos again."""
    told = [(*env.reset(seed=seed, options=options), 0.0, False, False)]
    for action in episode.actions:
        observation, reward, terminated, truncated, info = env.step(action)
        told.append((observation, info, reward, terminated, truncated))
    observations, infos, rewards, terminated, truncated = zip(*told, strict=True)
    np.testing.assert_array_equal(observations, episode.observations)
    np.testing.assert_array_equal(rewards[1:], episode.rewards)
    np.testing.assert_array_equal(terminated[1:], episode.terminations)
    np.testing.assert_array_equal(truncated[1:], episode.truncations)
    for key in infos[0]:
        np.testing.assert_array_equal([info[key] for info in infos], episode.infos[key])


def metadata_of(dataset):
    return list(dataset.storage.get_episode_metadata(range(len(dataset))))


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"scenario": "crowded", "observation": "rays", "action": "holonomic"},
        {"scenario": "doorway", "ray_noise": 0.1, "tracking_noise": 0.2},
    ],
    ids=str,
)
def test_a_loaded_data_set_replays_exactly(settings):
    record("corridor/chance-v0", **settings)
    dataset = minari.load_dataset("corridor/chance-v0")
    assert len(dataset) == EPISODES
    env = dataset.recover_environment()
    assert env.unwrapped.config == gym.make("SocialCorridor-v0", **settings).unwrapped.config
    for episode, metadata in zip(dataset, metadata_of(dataset), strict=True):
        assert len(episode) > 5
        check_replay(env, episode, metadata["seed"])


def test_seeds_of_ones_own_are_kept():
    dataset = record("corridor/seeds-v0", seeds=(7, 0, 2**33))
    assert [metadata["seed"] for metadata in metadata_of(dataset)] == [7, 0, 2**33]
    check_replay(gym.make(dataset.env_spec), dataset[2], 2**33)


def options_of(metadata):
    """What the episode's reset was given; Minari hands values back as NumPy's, pairs as arrays."""
    plain = {name: np.asarray(value).tolist() for name, value in metadata["options"].items()}
    return {
        name: tuple(value) if isinstance(value, list) else value for name, value in plain.items()
    }


def test_options_of_a_reset_are_kept():
    options = {"human_speed": (0.5, 1.0), "walking": "along", "robot_visible": False}
    dataset = record("corridor/options-v0", options=options)
    for episode, metadata in zip(dataset, metadata_of(dataset), strict=True):
        assert options_of(metadata) == options
        check_replay(dataset.recover_environment(), episode, metadata["seed"], options_of(metadata))


def test_more_can_be_recorded_later():
    dataset = record("corridor/more-v0")
    env = minari.DataCollector(dataset.recover_environment(), record_infos=True)
    env.reset(seed=5)
    for _ in range(10):
        env.step(env.action_space.sample())
    env.add_to_dataset(dataset)
    env.close()
    del env
    gc.collect()
    dataset = minari.load_dataset("corridor/more-v0")
    assert (len(dataset), len(dataset[EPISODES])) == (EPISODES + 1, 10)
    assert dataset.total_steps == sum(map(len, dataset))
