"""Drive an episode by keyboard, keep it, and see how a controller does from the same start.

    python examples/drive.py                    # in a window: the arrow keys, escape ends
    python examples/drive.py --autopilot        # without one: presses the keys by itself

`python -m socialnav_env.play` is the same drive as a command, with more to choose.
"""

import argparse
from pathlib import Path

import gymnasium as gym
import numpy as np

from socialnav_env.controllers import SocialForceRobot
from socialnav_env.play import play
from socialnav_env.recording import load_recording, save_recording
from socialnav_env.rendering import Window

WORDS = {"scenario": "paper"}
"""Keywords of the env; they are kept with the recording."""


class Autopilot:
    """Stands in for a window: looks at nothing, and presses the keys that a controller means."""

    def __init__(self, env):
        """Take the wheel."""
        self.env, self.robot, self.closed = env, SocialForceRobot(env.unwrapped.config), False

    def show(self, picture, fps):
        """Nobody is looking."""

    def keys(self):
        """Names of the keys that are held."""
        ahead, turn = self.robot.predict(self.env.unwrapped.world.observe()[0])[0]
        sideways = {"left"} if turn > 0.1 else {"right"} if turn < -0.1 else set()
        return sideways | ({"up"} if ahead > -0.8 else set())


def main(out: Path, seed: int, autopilot: bool) -> None:
    env = gym.make("SocialCorridor-v0", render_mode="rgb_array", **WORDS)
    window = Autopilot(env) if autopilot else Window("SocialCorridor: arrow keys, escape ends")

    def keep(drive):
        print("you,", drive.summary())
        save_recording(out, drive.recording(WORDS))
        window.closed = True  # one episode is enough here

    play(env, window, seed, keep)
    recording = load_recording(out)  # what was driven can be replayed to the last bit
    env.reset(seed=recording.seed)
    replayed = [env.step(action)[0] for action in recording.actions]
    assert np.array_equal(replayed, recording.observations[1:])

    robot = SocialForceRobot(env.unwrapped.config)
    observation, info = env.reset(seed=seed)
    ended, total = False, 0.0
    while not ended:
        observation, reward, terminated, truncated, info = env.step(robot.predict(observation)[0])
        ended, total = terminated or truncated, total + reward
    seconds, near = info["time_to_goal"], info["min_human_distance"]
    print(f"social force, same start: success {info['success']:.0f} after {seconds:.1f} s, "
          f"closest to a person {near:.2f} m, return {total:.2f}")  # fmt: skip


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("drive.npz"), help="the recording")
    parser.add_argument("--seed", type=int, default=0, help="of the episode")
    parser.add_argument("--autopilot", action="store_true", help="no window, no keyboard")
    given = parser.parse_args()
    main(given.out, given.seed, given.autopilot)
