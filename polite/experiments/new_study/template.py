"""A first `study.toml`, with examples and practice chosen by the true reward."""

from __future__ import annotations

import json
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any, Final

import gymnasium as gym
import numpy as np

from polite.dataset import Feedback
from polite.types import PoliteError, SegmentPool

PRACTICE: Final = 2
"""Practice pairs."""
MIRRORED: Final = 2
"""Mirrored catch pairs: as many as the template's rule of exclusion wants contradicted, so that who
always presses the same side is excluded. One comparison is left to come again as it was."""
CORRIDOR: Final = "socialnav_env:SocialCorridor-v0"
_LONGEST_HIGHLIGHT: Final = 10


@dataclass(frozen=True)
class Window:
    """A segment, and a window of it."""

    segment: int
    """Its number in the pool."""
    start: int
    """The window's first step."""


def fill_template(
    feedback: Feedback,
    env: str | None,
    participants: int,
    comparisons: int,
    seed: int,
    recorded: Path | None = None,
) -> str:
    """A design's TOML for a pool.

    Args:
        feedback: Segments and pairs.
        env: Draws the states; None for the corridor.
        participants: In each condition.
        comparisons: Of each participant.
        seed: Of the orders.
        recorded: Folder with recorded clips, if they are not drawn.
    """
    pool = feedback.pool
    length = max(1, min(_LONGEST_HIGHLIGHT, pool.rewards.shape[1] // 5))
    free = _free_segments(feedback, participants * comparisons)
    good, bad = extreme_windows(pool, free, length)
    rest = [index for index in free if index not in (good.segment, bad.segment)]
    env = CORRIDOR if env in (None, "SocialCorridor-v0") else env
    source = resources.files("polite.experiments.new_study").joinpath("template.toml")
    return Template(source.read_text(encoding="utf-8")).substitute(
        env=json.dumps(env),
        env_settings=_inline(_look(env)),
        recorded=f"recorded = {json.dumps(str(recorded.resolve()))}\n" if recorded else "",
        seed=seed,
        participants=participants,
        comparisons=comparisons,
        mirrored=min(MIRRORED, comparisons - 1),
        highlight_length=length,
        good_segment=good.segment,
        good_start=good.start,
        bad_segment=bad.segment,
        bad_start=bad.start,
        practice="".join(map(_practice, practice_pairs(pool, rest, PRACTICE))),
    )


def extreme_windows(pool: SegmentPool, among: list[int], length: int) -> tuple[Window, Window]:
    """The best and the worst window of `length` + 1 steps by the true reward, of two segments.

    Raises:
        PoliteError: There are not two segments.
    """
    if len(among) < 2:
        raise PoliteError(f"the guide shows two segments, found {len(among)}; give a larger pool")
    means = {
        index: _window_means(pool.rewards[index, : pool.lengths[index]], length) for index in among
    }
    best = max(among, key=lambda index: means[index].max())
    worst = min((index for index in among if index != best), key=lambda index: means[index].min())
    return Window(best, int(means[best].argmax())), Window(worst, int(means[worst].argmin()))


def practice_pairs(pool: SegmentPool, among: list[int], count: int) -> list[tuple[int, int, str]]:
    """Pairs of very different true return, the best with the worst and so on inwards.

    Returns:
        First and second segment, and which of them is expected to be preferred, in turns; fewer
        than `count` where returns do not differ.
    """
    order = sorted(among, key=lambda index: pool.returns[index])
    pairs = []
    for place in range(min(count, len(order) // 2)):
        worse, better = order[place], order[-1 - place]
        if pool.returns[better] > pool.returns[worse]:
            first = place % 2 == 0
            pairs.append((better, worse, "first") if first else (worse, better, "second"))
    return pairs


def _window_means(rewards: Any, length: int) -> Any:
    """Mean reward of each window of `length` + 1 steps, (m - length,); shorter: of all steps."""
    width = min(length + 1, len(rewards))
    return np.convolve(rewards, np.ones(width) / width, mode="valid")


def _free_segments(feedback: Feedback, asked: int) -> list[int]:
    """Segments that no comparison shows; all of them, if these are too few."""
    shown = {i for query in feedback.queries[:asked] for i in (query.first, query.second)}
    free = [index for index in range(len(feedback.pool)) if index not in shown]
    return free if len(free) >= 2 + 2 * PRACTICE else list(range(len(feedback.pool)))


def _practice(pair: tuple[int, int, str]) -> str:
    first, second, expected = pair
    return (
        f'[[practice]]\nfirst = {first}\nsecond = {second}\nexpected = "{expected}"\n'
        'explanation = "Most people prefer the clip in which the robot gets on with its task '
        'and does no harm."\n\n'
    )


def _look(env: str) -> dict[str, Any]:
    """Settings by which an env draws clips that are large enough, and fast to load."""
    if env == CORRIDOR:
        return {"render_width": 480, "camera": "robot"}
    known = gym.registry.get(env.rpartition(":")[2])
    is_mujoco = known is not None and "mujoco" in str(known.entry_point)
    return {"width": 320, "height": 240} if is_mujoco else {}


def _inline(settings: dict[str, Any]) -> str:
    """An inline table of TOML; strings and numbers are written as in JSON."""
    return (
        "{ " + ", ".join(f"{json.dumps(k)} = {json.dumps(v)}" for k, v in settings.items()) + " }"
    )
