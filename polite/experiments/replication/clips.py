"""One query of the study as two clips."""

from __future__ import annotations

from typing import Any

from polite.dataset import Feedback
from polite.experiments.clips import write_pair
from polite.experiments.replication.study import Study
from polite.experiments.replication.world import scene_settings
from polite.types import Answer, Highlight
from socialnav_env import SocialCorridorEnv

WIDTH = 640
"""Width of a clip [px]."""


def draw_example(study: Study) -> dict[str, Any]:
    """Draw the two clips of a query with highlights; returns `example` of `results.json`."""
    feedback = study.feedback("polite")
    answer = _telling_answer(feedback)
    env = SocialCorridorEnv(render_width=WIDTH, **scene_settings(study.config))
    fps = round(1.0 / env.dt)
    files = [f"clips/query_{place}.gif" for place in ("first", "second")]
    paths = [study.folder / name for name in files]
    write_pair(paths, feedback, answer.query, env.render_state, fps)
    return {
        "query": answer.query,
        "preferred": answer.preferred,
        "positive": _window(answer.positive),
        "negative": _window(answer.negative),
        "fps": fps,
        "files": files,
    }


def _telling_answer(feedback: Feedback) -> Answer:
    """The answer with most highlights, and among these the one whose clips differ most."""

    def tells(answer: Answer) -> tuple[int, float]:
        query = feedback.queries[answer.query]
        marks = (answer.positive is not None) + (answer.negative is not None)
        returns = feedback.pool.returns
        return marks, float(abs(returns[query.first] - returns[query.second]))

    expressed = [answer for answer in feedback.answers if answer.preferred is not None]
    return max(expressed, key=tells)


def _window(highlight: Highlight | None) -> list[int] | None:
    """First and last step of a highlight."""
    return None if highlight is None else [highlight.start, highlight.end]
