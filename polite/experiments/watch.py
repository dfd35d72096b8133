"""An episode of a trained policy, to look at: its frames, and under them what every step paid."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any, Final

import gymnasium as gym
import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from numpy.typing import NDArray

from polite.clips import Frames, picture_env, state_render, write_clip
from polite.experiments.play_again import play_again
from polite.experiments.runner import make_progress
from polite.experiments.trained import Trained, read_trained
from polite.experiments.training.judge import EVALUATION_SEED
from polite.files import write_atomically
from polite.plots.episode import FRAMES, Traces, below_frames, draw_episode
from polite.plots.style import STYLE, WIDTH
from polite.rewards.network import predict
from polite.rollouts import collect
from polite.types import InvalidValueError, PoliteError, Trajectory
from polite.video import check_ffmpeg, pad_to_even, write_video

CLIPS: Final = (".webp", ".gif", ".mp4")
PICTURES: Final = (".png", ".pdf")
CLIP_FPS: Final = 25.0
"""At most so many frames a second; of faster envs only every second, third, … step is drawn."""
NARROWEST: Final = 200
"""Pixels of a frame's width that its traces have room in."""
USUAL_FPS: Final = 30.0
"""Steps a second of an env that does not tell."""
Draw = Callable[[Trajectory, Sequence[int]], Iterator[NDArray[np.uint8]]]
"""An episode and its steps that are wanted -> (h, w, 3) for each of them."""


def watch(folder: Path, out: Path | None = None, seed: int = 0) -> Path:
    """Draw an episode of a trained policy, its most likely actions, with what each step paid.

    Args:
        folder: of `polite train`, or `models/RUN` in the folder of `polite benchmark`.
        out: a clip in real time (.webp, .gif, .mp4), or a picture with some of the frames (.png,
            .pdf); if not given, `episode_SEED.webp` beside the models.
        seed: which episode; that of a training's own seed starts as the first that judged it.

    Returns:
        The path of the clip or picture.

    Raises:
        PoliteError: if there is no finished training, the seed is below 0, the ending is another,
            or the env cannot be drawn here. Nothing is written then.
    """
    trained = read_trained(folder)
    out = out or trained.models / f"episode_{seed}.webp"
    _check(out, seed)
    with picture_env(trained.env, **trained.settings) as env, make_progress() as progress:
        draw, pace = _drawing(env, seed)
        episode = play(trained, seed)
        steps = _steps(len(episode), pace, still=out.suffix in PICTURES)
        pictures = draw(episode, steps)
        frames = _enlarged(list(progress.track(pictures, len(steps), description="drawing")))
        traces = paid(trained, episode)
        title = f"{trained.title}: return {episode.rewards.sum():,.4g} in {len(episode):,} steps"
        writing = progress.add_task(f"writing {out.name}", total=None)
        with rc_context(STYLE):
            if out.suffix in PICTURES:
                figure = _picture(frames, steps, traces, 1.0 / pace, title)
                write_atomically(out, figure.savefig)
            else:
                shown = below_frames(frames, steps, traces, 1.0 / pace, title)
                _write_clip(out, shown, pace / _stride(pace))
        progress.update(writing, total=1, completed=1)
    return out


def play(trained: Trained, seed: int) -> Trajectory:
    """One whole episode of the most likely actions.

    Args:
        trained: whose.
        seed: which episode.
    """
    with closing(trained.make_env(1, 0)) as env:
        act = trained.policy.mean_action
        longest = env.check_time_limit()  # the first episode is over by then
        return collect(env.vector_env, act, longest, seed + EVALUATION_SEED)[0]


def paid(trained: Trained, episode: Trajectory) -> Traces:
    """(T,) the true reward of every step, and r̂ where a reward model paid."""
    traces: dict[str, NDArray[Any]] = {"true reward": episode.rewards}
    if trained.reward is not None:
        traces["r̂"] = predict(trained.reward, episode.observations, episode.actions)
    return traces


def _drawing(env: gym.Env[Any, Any], seed: int) -> tuple[Draw, float]:
    """How moments of an episode are drawn, and the env's steps per second.

    From the recorded states where that can be done, and by playing it once more elsewhere.
    """
    if drawing := state_render(env):
        render, pace = drawing

        def draw(episode: Trajectory, steps: Sequence[int]) -> Iterator[NDArray[np.uint8]]:
            for step in steps:
                yield render(episode.states[step], episode.states[: step + 1, :2])

        return draw, pace
    pace = float(env.metadata.get("render_fps") or USUAL_FPS)
    return partial(play_again, env, seed + EVALUATION_SEED), pace


def _enlarged(pictures: Sequence[NDArray[np.uint8]]) -> Frames:
    """The pictures in one array; small ones as many times larger as the traces need room for.

    Raises:
        PoliteError: They differ in size.
    """
    shapes = {picture.shape for picture in pictures}
    if len(shapes) > 1:
        raise PoliteError(f"expected pictures of one size, got {sorted(shapes)}")
    times = math.ceil(NARROWEST / pictures[0].shape[1])
    return np.stack(pictures).repeat(times, axis=1).repeat(times, axis=2)


def _check(out: Path, seed: int) -> None:
    """Refuse what cannot be done, before an episode is played.

    Raises:
        PoliteError: with what would do.
    """
    if seed < 0:
        raise InvalidValueError(f"seed: expected a whole number of at least 0, got {seed}")
    if out.suffix not in CLIPS + PICTURES:
        raise PoliteError(f"{out}: expected an ending of {', '.join(CLIPS + PICTURES)}")
    if out.suffix == ".mp4":
        check_ffmpeg()


def _stride(pace: float) -> int:
    """Steps from one frame of a clip to the next."""
    return math.ceil(pace / CLIP_FPS)


def _steps(count: int, pace: float, *, still: bool) -> list[int]:
    """The steps that are drawn."""
    if not still:
        return list(range(0, count, _stride(pace)))
    return sorted({round(step) for step in np.linspace(0, count - 1, FRAMES).tolist()})


def _picture(
    frames: Frames, steps: list[int], traces: Traces, seconds: float, title: str
) -> Figure:
    figure = Figure(figsize=(WIDTH, WIDTH))
    draw_episode(figure, frames, steps, traces, seconds)
    figure.suptitle(title, x=0.01, ha="left", fontsize=8.5, fontweight="bold")
    return figure


def _write_clip(out: Path, frames: Frames, fps: float) -> None:
    if out.suffix == ".mp4":
        write_video(out, pad_to_even(frames), fps)
    else:
        write_clip(out, frames, fps)
