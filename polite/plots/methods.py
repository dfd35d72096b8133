"""How the methods of the benchmark look: hue and marker by method, line and shade by queries."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from matplotlib.colors import to_hex, to_rgb

from polite.analysis.benchmark_records import PAPER_FORM
from polite.plots.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    Look,
)

DARK_PURPLE = "#7A3B5E"

HUES: Final[Mapping[str, tuple[str, str]]] = {
    "polite": (BLUE, "o"),
    "own-polite": (ORANGE, "D"),
    "preferences": (VERMILION, "s"),
    "highlights": (PURPLE, "v"),
    "own-highlights": (DARK_PURPLE, "<"),
    "pebble": (SKY, "^"),
    "polite-pebble": (BLACK, "P"),
    "untrained": (GREY, "x"),
    "ground-truth": (GREEN, "*"),
}
"""Colour and marker; "own" ones have a form of highlights that is not the paper's."""
LINES: Final[Mapping[int, Any]] = {
    50: (0, (1, 3)),
    100: (0, (1, 1.2)),
    200: "-",
    262: (0, (5, 1, 1, 1, 1, 1)),
    400: (0, (4, 1.5)),
    525: (0, (7, 1, 1, 1)),
    800: (0, (4, 1.2, 1, 1.2)),
}
"""Dashes by queries; other budgets are solid."""
MIDDLE = 400
"""Queries whose shade is the method's own colour; fewer are lighter, more are darker."""


def look_of(cell: Mapping[str, Any], *, shaded: bool = True) -> Look:
    """The look of a cell of results.json, or of one of its methods where it is not shaded.

    Args:
        cell: an entry with `method`, `highlights`, `queries` and `label`.
        shaded: whether line and shade tell the queries.
    """
    colour, marker = HUES.get(_hue(cell), (BLACK, "h"))
    if not shaded or not cell["queries"]:
        line = {"ground-truth": "-.", "untrained": ":"}.get(cell["method"], "-")
        return Look(cell["label"], colour, line, marker)
    line = LINES.get(cell["queries"], "-")
    return Look(cell["label"], _shade(colour, cell["queries"]), line, marker)


def form_of(cell: Mapping[str, Any]) -> str:
    """The form of a cell's highlights in brackets, where it is not the paper's."""
    form = cell["highlights"]
    return "" if form in (None, PAPER_FORM) else f" ({form})"


def _hue(cell: Mapping[str, Any]) -> str:
    own = f"own-{cell['method']}"
    return own if form_of(cell) and own in HUES else str(cell["method"])


def _shade(colour: str, queries: int) -> str:
    """Mixed with white below the middle, with black above it."""
    octaves = float(np.clip(np.log2(queries / MIDDLE), -2, 2))
    towards = np.zeros(3) if octaves > 0 else np.ones(3)
    share = abs(octaves) * (0.3 if octaves > 0 else 0.22)
    red, green, blue = (1 - share) * np.array(to_rgb(colour)) + share * towards
    return str(to_hex((red, green, blue)))
