"""Withdrawing from a study: everything that somebody answered is deleted, wherever we keep it."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Final

from polite.study.database import Database
from polite.study.participants import withdraw

EXPORT: Final = "export"
"""Where exports go unless another folder is given, in the study's folder."""


def withdraw_everywhere(folder: Path, database: Database, code: str, now: float) -> bool:
    """Delete a participant's answers from the database and the study's own export.

    The export is removed as a whole, since every file of it may tell of the participant; it can be
    made again. Of exports elsewhere we do not know.

    Args:
        folder: The study's.
        database: Where the answers are.
        code: The participant's.
        now: Seconds since the epoch.

    Returns:
        Whether there was such a participant.
    """
    with database.write() as connection:
        known = withdraw(connection, code, now)
    if known:
        shutil.rmtree(folder / EXPORT, ignore_errors=True)
        database.forget_traces()
    return known
