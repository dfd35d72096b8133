"""Rows as CSV, JSONL and Markdown, by their columns."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Sequence
from typing import Any, Final, TypeVar

from polite.study.columns import Cell, Column

Row = TypeVar("Row")

FORMULA: Final = ("=", "+", "-", "@", "＝", "＋", "－", "＠", "\t", "\r", "\n", "'")
"""How a text begins that a spreadsheet might run as a formula, or that looks escaped already."""


def as_csv(columns: Sequence[Column[Row]], rows: Iterable[Row]) -> str:
    """Rows as CSV with a head; free text that begins like a formula gets an apostrophe first."""
    text = io.StringIO()
    writer = csv.writer(text)  # ends lines as RFC 4180 says, and so quotes all line breaks
    writer.writerow([column.name for column in columns])
    for row in rows:
        writer.writerow([_csv_cell(column, column.value(row)) for column in columns])
    return text.getvalue()


def as_jsonl(columns: Sequence[Column[Row]], rows: Iterable[Row]) -> str:
    """Rows as one JSON object a line, with the same names; nothing is escaped in texts."""
    return "".join(
        json.dumps({c.name: c.value(row) for c in columns}, ensure_ascii=False, allow_nan=False)
        + "\n"
        for row in rows
    )


def dictionary_markdown(files: Sequence[tuple[str, Sequence[Column[Any]]]]) -> str:
    """The data dictionary as a page: one table a file."""
    parts = [_ABOUT]
    for name, columns in files:
        rows = (
            "| " + " | ".join(_markdown_cell(t) for t in (f"`{c.name}`", c.type, c.unit, c.meaning))
            for c in columns
        )
        head = "| column | type | unit | meaning |\n|---|---|---|---|"
        parts.append("\n".join([f"## {name}\n", head, *(row + " |" for row in rows), ""]))
    return "\n".join(parts)


_ABOUT: Final = """# Data dictionary

UTF-8. In CSV an empty cell is a missing value, and `true` and `false` are lower case; a text that
begins with `=`, `+`, `-`, `@`, a tab, a new line or an apostrophe has an apostrophe put before it,
so that no spreadsheet runs it as a formula. JSONL has the same names and no such apostrophes.

`data/polite` and `data/baseline` hold what a reward model is trained on: the last answers to main
comparisons of everybody who is not excluded, as `polite.dataset.load_feedback` reads them.
`study.toml` is the study's design as it is now; `designs.json` has every design that somebody
joined, by the `design_sha` of their rows: the consent and guide that they read, word for word.
`export.json` counts everything and has each file's SHA-256.
"""


def _csv_cell(column: Column[Any], value: Cell) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value)
    text = str(value)
    return f"'{text}" if column.type == "text" and text.startswith(FORMULA) else text


def _markdown_cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")
