"""The example query on the page: both clips, and the preferred one's highlights on a time line."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from polite.plots.strip import MARKS, Windows, example_windows
from polite.report.clips import clip_paths, read_clip
from polite.report.html import Markup, data_uri, element, join, void

BAR = 600
"""Width of the time line in units of its drawing."""


def example_clips(example: Mapping[str, Any], folder: Path, no_mark: str) -> Markup:
    """Two figures side by side, or a sentence when the run kept no clips.

    Args:
        example: The query, as in results.json.
        folder: The run's.
        no_mark: What to say where nothing was highlighted.
    """
    paths = clip_paths(example, folder)
    if not paths:
        return element("p", "This run kept no clips.")
    cards = (_card(example, place, path, no_mark) for place, path in enumerate(paths))
    return element("div", *cards, class_="pair")


def timeline(windows: Windows, steps: int, fps: float) -> Markup:
    """A bar as long as the clip; each window has a colour, a pattern, a sign and its seconds."""
    described = "; ".join(_words(sign, window, fps) for sign, window in windows.items())
    svg = Markup(
        f'<svg viewBox="0 0 {BAR} 58" role="img" aria-label="Highlights: {described}">'
        f"<title>Highlights: {described}</title><defs>{_PATTERNS}</defs>"
        f'<rect x="1" y="1" width="{BAR - 2}" height="56" rx="4" class="bar"/>'
    )
    marks = (_window(sign, window, steps) for sign, window in windows.items())
    return join([svg, *marks, Markup("</svg>"), _legend(windows, fps)])


def _card(example: Mapping[str, Any], place: int, path: Path, no_mark: str) -> Markup:
    name, fps = ("first", "second")[place], example["fps"]
    chosen = place == example["preferred"]
    title = f"{name.capitalize()} clip" + (" — preferred" if chosen else "")
    picture = void("img", src=data_uri(path), alt=f"Moving picture of the {name} clip, from above")
    parts = [element("h3", title), picture]
    if chosen:
        windows = example_windows(example)
        none = element("p", no_mark)
        steps = len(read_clip(path, fps))
        parts.append(timeline(windows, steps, fps) if windows else none)
    return element("div", *parts, class_="clip chosen" if chosen else "clip")


def _window(sign: str, window: tuple[int, int], steps: int) -> Markup:
    text, colour, _ = MARKS[sign]
    left, right = (BAR * edge / steps for edge in (window[0], window[1] + 1))
    top = 4 if sign == "positive" else 31
    before = right > 0.75 * BAR
    x, anchor = (left - 8, "end") if before else (right + 8, "start")
    return Markup(
        f'<rect x="{left:.1f}" y="{top}" width="{right - left:.1f}" height="23" fill="{colour}"/>'
        f'<rect x="{left:.1f}" y="{top}" width="{right - left:.1f}" height="23" '
        f'fill="url(#{sign}-pattern)"/>'
        f'<text x="{x:.1f}" y="{top + 18}" text-anchor="{anchor}" fill="{INK[sign]}">{text}</text>'
    )


def _legend(windows: Windows, fps: float) -> Markup:
    return element("p", " · ".join(_words(sign, window, fps) for sign, window in windows.items()))


def _words(sign: str, window: tuple[int, int], fps: float) -> str:
    return f"{MARKS[sign][0]}: {window[0] / fps:.1f} to {(window[1] + 1) / fps:.1f} s"


INK = {"positive": "#00654a", "negative": "#9a3f00"}
"""Darker shades of the marks' colours, for text that meets a contrast of 4.5 to 1."""

_PATTERNS = (
    '<pattern id="positive-pattern" width="9" height="9" patternUnits="userSpaceOnUse" '
    'patternTransform="rotate(45)"><rect width="3" height="9" fill="#fff"/></pattern>'
    '<pattern id="negative-pattern" width="9" height="9" patternUnits="userSpaceOnUse">'
    '<circle cx="4.5" cy="4.5" r="2" fill="#fff"/></pattern>'
)
