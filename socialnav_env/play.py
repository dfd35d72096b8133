"""Drive the corridor's robot by keyboard, and keep what was driven.

    python -m socialnav_env.play --scenario crowded --out drives --video gif

Up drives forward, left and right turn; with --action holonomic the arrows move and a and d turn.
When an episode is over, space begins the next one. r begins the episode again and throws away an
unfinished drive; escape ends and keeps it.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, cast

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

import socialnav_env  # noqa: F401 (importing it registers SocialCorridor-v0)
from socialnav_env.config import SCENARIOS, ConfigError
from socialnav_env.env import SocialCorridorEnv
from socialnav_env.kernels import FloatArray
from socialnav_env.keyboard import action_of
from socialnav_env.metrics import NO_ONE
from socialnav_env.recording import VIDEO_FORMATS, Recording, save_recording, write_video
from socialnav_env.rendering import CAMERAS, DEFAULT_OVERLAYS, OVERLAYS, Window
from socialnav_env.rendering.window import NoDisplayError

HELP = {
    "unicycle": "up: forward, left and right: turn",
    "holonomic": "arrows: move, a and d: turn",
}
"""For each kind of action: what the keys do."""
COMMANDS = "r: again (an unfinished drive is lost), space: next, escape: end"
"""The other keys."""
Env = gym.Env[FloatArray, NDArray[np.float32]]


class Drive:
    """An episode while it is being driven."""

    def __init__(self, env: Env, seed: int) -> None:
        """Begin it."""
        self._env = env
        self._corridor = cast(SocialCorridorEnv, env.unwrapped)
        self.seed = seed
        observation, self.info = env.reset(seed=seed)
        self._observations = [observation]
        self._states = [self._corridor.state_row()]
        self._actions: list[NDArray[np.float32]] = []
        self._rewards: list[float] = []
        self.terminated = self.truncated = False

    @property
    def over(self) -> bool:
        """Whether the episode has ended."""
        return self.terminated or self.truncated

    def __len__(self) -> int:
        """Steps so far."""
        return len(self._actions)

    def step(self, pressed: set[str]) -> bool:
        """Drive on as the keys say; tells whether the episode ended by it."""
        action = action_of(pressed, self._corridor.config.action)
        observation, reward, self.terminated, self.truncated, self.info = self._env.step(action)
        self._actions.append(action)
        self._rewards.append(float(reward))
        self._observations.append(observation)
        self._states.append(self._corridor.state_row())
        return self.over

    def recording(self, keywords: dict[str, Any]) -> Recording:
        """The episode so far, with at least one step."""
        return Recording(
            keywords=keywords,
            seed=self.seed,
            observations=np.stack(self._observations),
            actions=np.stack(self._actions),
            rewards=np.array(self._rewards),
            states=np.stack(self._states),
            terminated=self.terminated,
            truncated=self.truncated,
        )

    def summary(self) -> str:
        """How it went, in a line."""
        if self.info["success"] > 0:
            end = "goal reached"
        else:
            end = "collision" if self.info["collisions"] > 0 else "no goal"
        near = self.info["min_human_distance"]
        people = f", closest to a person {near:.2f} m" if near < NO_ONE else ""
        seconds, total = self.info["time_to_goal"], sum(self._rewards)
        return f"seed {self.seed}: {end} after {seconds:.1f} s{people}, return {total:.2f}"


def play(env: Env, window: Window, seed: int, keep: Callable[[Drive], object]) -> None:
    """Let somebody drive until they close the window or press escape.

    Args:
        env: A corridor that renders arrays.
        window: Where it is shown and keys are pressed.
        seed: Of the first episode; the next ones have the seeds after it.
        keep: Called with every episode that ended, and with the one that was broken off.

    Raises:
        NoDisplayError: There is nothing on which the window could be seen.
    """
    fps = env.metadata["render_fps"]
    drive = Drive(env, seed)
    while not window.closed:
        window.show(cast(NDArray[np.uint8], env.render()), fps)
        pressed = window.keys()
        if "escape" in pressed:
            break
        if "r" in pressed:
            drive = Drive(env, drive.seed)
        elif not drive.over:
            if drive.step(pressed):
                keep(drive)
        elif "space" in pressed:
            drive = Drive(env, drive.seed + 1)
    if len(drive) and not drive.over:
        keep(drive)


class Keeper:
    """Tells how an episode went, and writes it down where that is wanted."""

    def __init__(
        self, env: Env, keywords: dict[str, Any], folder: Path | None, video: str | None
    ) -> None:
        """Remember what to do with the episodes.

        Args:
            env: Draws the videos.
            keywords: Those that the env was made with.
            folder: Where the episodes go; None only tells.
            video: One of VIDEO_FORMATS, or None for no video.
        """
        self._env, self._keywords = env, keywords
        self._folder, self._video = folder, video

    def __call__(self, drive: Drive) -> None:
        """Take an episode."""
        print(drive.summary())
        if self._folder is None:
            return
        path = self._free(self._folder)
        recording = drive.recording(self._keywords)
        save_recording(path, recording)
        print(f"kept as {path}")
        if self._video is not None:
            film = path.with_suffix(f".{self._video}")
            corridor = cast(SocialCorridorEnv, self._env.unwrapped)
            write_video(film, recording, corridor.render_state, self._env.metadata["render_fps"])
            print(f"video {film}")

    @staticmethod
    def _free(folder: Path) -> Path:
        """The first of drive-001.npz, drive-002.npz, ... that does not exist."""
        number = 1
        while (path := folder / f"drive-{number:03}.npz").exists():
            number += 1
        return path


def _parser() -> argparse.ArgumentParser:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="python -m socialnav_env.play",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--scenario", choices=SCENARIOS, default="paper", help="named scenario")
    parser.add_argument("--walking", metavar="HOW", help="people's way, e.g. along, group or queue")
    parser.add_argument("--num-humans", type=int, metavar="N", help="how many people there are")
    parser.add_argument("--action", choices=HELP, default="unicycle", help="how the robot moves")
    parser.add_argument("--seed", type=int, default=0, help="of the first episode (default 0)")
    parser.add_argument("--camera", choices=CAMERAS, default=CAMERAS[0], help="what is shown")
    parser.add_argument(
        "--overlays", choices=OVERLAYS, nargs="*", default=DEFAULT_OVERLAYS, help="drawn on top"
    )
    parser.add_argument("--width", type=int, default=960, help="of the picture [px]")
    parser.add_argument("--out", type=Path, metavar="DIR", help="keep the episodes here, as .npz")
    parser.add_argument("--video", choices=VIDEO_FORMATS, help="and as videos; needs --out")
    return parser


def main(arguments: Sequence[str] | None = None, window: Window | None = None) -> None:
    """The command `python -m socialnav_env.play`.

    Args:
        arguments: The command line's, those of the process where None.
        window: Where to play; a new one where None.
    """
    parser = _parser()
    chosen = parser.parse_args(arguments)
    if chosen.video is not None and chosen.out is None:
        parser.error("--video needs --out DIR")
    if chosen.video == "mp4" and find_spec("imageio_ffmpeg") is None:
        parser.error("--video mp4 needs imageio-ffmpeg: pip install imageio-ffmpeg, or use gif")
    if chosen.seed < 0:
        parser.error(f"--seed {chosen.seed}: expected a whole number of at least 0")
    people = {"walking": chosen.walking, "num_humans": chosen.num_humans}
    given = {name: value for name, value in people.items() if value is not None}
    keywords = {"scenario": chosen.scenario, "action": chosen.action, **given}
    try:
        env = gym.make(
            "SocialCorridor-v0",
            render_mode="rgb_array",
            render_width=chosen.width,
            camera=chosen.camera,
            overlays=tuple(chosen.overlays),
            **keywords,
        )
    except ConfigError as error:
        parser.error(str(error))
    text = f"{HELP[chosen.action]}; {COMMANDS}"
    print(text)
    window = window or Window(f"SocialCorridor – {text}")
    try:
        play(env, window, chosen.seed, Keeper(env, keywords, chosen.out, chosen.video))
    except NoDisplayError as error:
        parser.exit(2, f"{parser.prog}: error: {error}\n")
    finally:
        window.close()
        env.close()


if __name__ == "__main__":
    main()
