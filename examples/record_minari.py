"""Record a Minari data set, load it, and replay it to the last bit.

    pip install "minari[create,hdf5]"
    python examples/record_minari.py --out datasets --episodes 20

`minari.load_dataset` finds it under the same MINARI_DATASETS_PATH, and offline reinforcement
learning can begin. Only after `import socialnav_env` can `recover_environment()` make the env.
"""

import argparse
import os
import warnings
from pathlib import Path

import gymnasium as gym
import numpy as np

from socialnav_env.controllers import SocialForceRobot

NAME = "social-corridor/social-force-v0"


def record(episodes):
    """A social-force robot whose actions are disturbed, so that the data show mistakes too."""
    import minari  # only now, since it asks where data sets are when it is imported

    env = minari.DataCollector(gym.make("SocialCorridor-v0", scenario="paper"), record_infos=True)
    robot, rng = SocialForceRobot(env.unwrapped.config), np.random.default_rng(0)
    for seed in range(episodes):
        observation, _ = env.reset(seed=seed)
        ended = False
        while not ended:
            noisy = robot.predict(observation)[0] + 0.3 * rng.standard_normal(2)
            action = noisy.clip(-1.0, 1.0).astype(np.float32)
            observation, _, terminated, truncated, _ = env.step(action)
            ended = terminated or truncated
    dataset = env.create_dataset(
        NAME,
        algorithm_name="social force with noise 0.3",
        author="the authors of socialnav-polite",
        description="A robot among three people who cross a corridor.",
        eval_env="SocialCorridor-v0",
    )
    env.close()
    return dataset


def replay(dataset):
    """Whether the seeds and actions give the observations again."""
    env, exact = dataset.recover_environment(), True  # socialnav_env has been imported above
    details = dataset.storage.get_episode_metadata(range(len(dataset)))
    for episode, detail in zip(dataset, details, strict=True):
        seen = [env.reset(seed=detail["seed"])[0], *(env.step(a)[0] for a in episode.actions)]
        exact &= np.array_equal(seen, episode.observations)
    return exact


def main(out: Path, episodes: int) -> None:
    os.environ["MINARI_DATASETS_PATH"] = str(out)
    warnings.filterwarnings("ignore", "Implicitly cleaning up", ResourceWarning)  # Minari's own
    # It would like an address of the author and a link to the code; give yours in `record`.
    warnings.filterwarnings("ignore", "`(author_email|code_permalink)` is set to None")
    record(episodes)
    import minari

    dataset = minari.load_dataset(NAME)
    returns = [episode.rewards.sum() for episode in dataset]
    print(f"{len(dataset)} episodes, {dataset.total_steps} steps in {out / NAME}")
    print(f"mean return {np.mean(returns):.2f}; replayed exactly: {replay(dataset)}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("datasets"), help="folder of data sets")
    parser.add_argument("--episodes", type=int, default=20, help="how many")
    given = parser.parse_args()
    if given.episodes < 1:
        parser.error(f"--episodes {given.episodes}: expected at least 1")
    main(given.out.resolve(), given.episodes)
