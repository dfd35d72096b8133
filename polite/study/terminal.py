"""A study's tables in a terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from polite.study.summary import Section


def print_sections(sections: Sequence[Section], console: Console) -> None:
    """Print tables, each with its title above and how to read it below."""
    for section in sections:
        table = Table(title=Text(section.title), title_justify="left", title_style="bold")
        for number, column in enumerate(section.columns):
            table.add_column(Text(column), justify="right" if number else "left")
        for row in section.rows:
            table.add_row(*(Text(str(cell)) for cell in row))
        console.print(table)
        console.print(Text(section.caption, style="dim"))
        console.print()
