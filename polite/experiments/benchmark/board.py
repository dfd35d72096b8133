"""One view of a running grid."""

from __future__ import annotations

import time
from collections.abc import Callable
from datetime import timedelta
from types import TracebackType
from typing import Self

from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from polite.experiments.benchmark.status import GridStatus, Running

LINE_EVERY = 30.0
"""Seconds between two lines where there is no terminal, at least."""

SILENT = 120.0
"""Seconds after which it is shown that a run has said nothing more: it may have been killed."""


def summary_line(now: GridStatus) -> str:
    """Counts and time to go."""
    left = "?" if now.seconds_left is None else str(timedelta(seconds=round(now.seconds_left)))
    text = f"{now.done} of {now.total} runs done, {len(now.running)} running, {now.left} left"
    text += f", {len(now.failed)} failed" if now.failed else ""
    return text if now.done == now.total else f"{text}; time to go {left}"


def view(now: GridStatus) -> Group:
    """Counts, and a row for each run that is being done."""
    table = Table(box=None, pad_edge=False, header_style="dim")
    for name in ("run", "done", "true return", "what it does"):
        table.add_column(name, justify="right" if name in ("done", "true return") else "left")
    for item in now.running:
        table.add_row(*_row(item))
    failed = [Text(f"failed: {run.name}", style="red") for run in now.failed]
    damaged = [
        Text(f"no record of it, though a file is there: {run.name}", style="red")
        for run in now.damaged
    ]
    rows = [table] if now.running else []
    return Group(Text(summary_line(now), style="bold"), *rows, *failed, *damaged)


def _row(item: Running) -> tuple[str, str, str, str]:
    last = "" if item.last_return is None else f"{item.last_return:,.0f}"
    heard = f", said {timedelta(seconds=round(item.silent))} ago" if item.silent > SILENT else ""
    return item.run.name, f"{item.share:.0%}", last, f"{item.says}{heard}"


class Board:
    """Shows how far a grid is: a view that is kept up to date, or now and then a line."""

    def __init__(self, look: Callable[[], GridStatus], console: Console) -> None:
        """Set up.

        Args:
            look: how far the grid is now.
            console: where it is shown.
        """
        self._look, self._console = look, console
        self._live = Live(console=console, auto_refresh=False) if console.is_terminal else None
        self._shown = -LINE_EVERY

    def __enter__(self) -> Self:
        """Begin to show."""
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Show the end."""
        self._shown = -LINE_EVERY
        self.update()
        if self._live is not None:
            self._live.stop()

    def update(self) -> None:
        """Show how far it is now."""
        if self._live is not None:
            self._live.update(view(self._look()), refresh=True)
        elif time.monotonic() - self._shown >= LINE_EVERY:
            self._console.print(summary_line(self._look()), highlight=False, soft_wrap=True)
            self._shown = time.monotonic()
