"""Make the corridor, drive straight towards the end goal, and keep the episode as a GIF.

    python examples/watch.py corridor.gif

The docstring of `socialnav_env.SocialCorridorEnv` says what the observation's entries are.
"""

import argparse
from pathlib import Path

import gymnasium as gym
import numpy as np

import socialnav_env  # noqa: F401 (importing it registers SocialCorridor-v0)
from polite.clips import write_clip


def main(path: Path) -> None:
    env = gym.make("SocialCorridor-v0", render_mode="rgb_array", render_width=640)
    observation, _ = env.reset(seed=0)
    frames, ended = [], False
    while not ended:
        sine = observation[13]  # of the end goal's bearing: positive is to the left
        action = np.array([1.0, np.clip(2.0 * sine, -1.0, 1.0)], dtype=np.float32)
        observation, _, terminated, truncated, info = env.step(action)
        frames.append(env.render())
        ended = terminated or truncated
    write_clip(path, np.stack(frames[::2]), fps=2 * env.metadata["render_fps"])
    print(f"success {info['success']:.0f}, closest to a person {info['min_human_distance']:.2f} m")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", nargs="?", type=Path, default="corridor.gif", help="the GIF")
    main(parser.parse_args().out)
