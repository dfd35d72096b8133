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
from socialnav_env.evaluation import evaluate
from socialnav_env.play import Drive
from socialnav_env.recording import load_recording, save_recording
from socialnav_env.rendering import Window
from socialnav_env.rendering.window import NoDisplayError

WORDS = {"scenario": "paper"}
"""Keywords of the env; they are kept with the recording."""


def autopilot(env, robot):
    """The keys that a controller means."""
    ahead, turn = robot.predict(env.unwrapped.world.observe()[0])[0]
    sideways = {"left"} if turn > 0.1 else {"right"} if turn < -0.1 else set()
    return sideways | ({"up"} if ahead > -0.8 else set())


def drive(env, seed, robot, window):
    """One episode, or as much of it as was driven; without a window the controller drives."""
    driven = Drive(env, seed)
    while not driven.over:
        if window is not None:
            window.show(env.render(), env.metadata["render_fps"])
        pressed = autopilot(env, robot) if window is None else window.keys()
        if "escape" in pressed or (window is not None and window.closed):
            break
        driven.step(pressed)
    if window is not None:
        window.close()
    return driven


def main(out: Path, seed: int, window: Window | None) -> None:
    env = gym.make("SocialCorridor-v0", render_mode="rgb_array", **WORDS)
    robot = SocialForceRobot(env.unwrapped.config)
    driven = drive(env, seed, robot, window)
    if len(driven) == 0:
        print("nothing was driven, so nothing is kept")
        return
    print("you,", driven.summary())
    save_recording(out, driven.recording(WORDS))
    recording = load_recording(out)  # what was driven can be replayed to the last bit
    env.reset(seed=recording.seed)
    replayed = [env.step(action)[0] for action in recording.actions]
    assert np.array_equal(replayed, recording.observations[1:])

    table = evaluate(robot, episodes=1, num_envs=1, seed=seed, **WORDS)
    shown = {"success": ".0f", "time_to_goal": ".1f", "min_human_distance": ".2f", "return": ".2f"}
    told = ", ".join(f"{name} {table[name].mean:{digits}}" for name, digits in shown.items())
    print(f"social force, same start: {told}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("drive.npz"), help="the recording")
    parser.add_argument("--seed", type=int, default=0, help="of the episode")
    parser.add_argument("--autopilot", action="store_true", help="no window, no keyboard")
    given = parser.parse_args()
    shown = None if given.autopilot else Window("SocialCorridor: arrow keys, escape ends")
    try:
        main(given.out, given.seed, shown)
    except NoDisplayError as error:
        parser.exit(2, f"{parser.prog}: error: {error}; or drive with --autopilot\n")
