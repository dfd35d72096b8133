"""The two clips of a query, drawn from the states that were recorded."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from polite.clips import FASTEST, Render, frames_of, renderer, write_clip
from polite.dataset import Feedback


def draw_query(
    folder: Path, feedback: Feedback, query: int, env_id: str, **settings: Any
) -> list[Path]:
    """Draw both segments of a query, every step a frame.

    They play in real time, or slower where the env takes more steps a second than players show.

    Args:
        folder: Where `query_<number>_first.gif` and `query_<number>_second.gif` go.
        feedback: The segments and the queries about them.
        query: The number of the query.
        env_id: The env that the segments come from.
        **settings: Its keywords, the size of the pictures among them.

    Returns:
        The two files.

    Raises:
        PoliteError: The env cannot be made or drawn.
        ShapeError: The states are another env's.
    """
    paths = [folder / f"query_{query}_{place}.gif" for place in ("first", "second")]
    with renderer(env_id, **settings) as (render, steps_per_second):
        write_pair(paths, feedback, query, render, min(FASTEST, steps_per_second))
    return paths


def write_pair(
    paths: list[Path], feedback: Feedback, query: int, render: Render, fps: float
) -> None:
    """Write the first and the second segment of a query as clips.

    Args:
        paths: Their two files.
        feedback: The segments and the queries about them.
        query: The number of the query.
        render: Draws a state.
        fps: Frames per second.
    """
    pair = feedback.queries[query]
    for path, index in zip(paths, (pair.first, pair.second), strict=True):
        write_clip(path, frames_of(feedback.pool[index].states, render), fps)
