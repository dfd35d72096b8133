"""A study's database, opened for any command: brought up to date, and found to be of this study."""

from __future__ import annotations

import os
from contextlib import suppress
from typing import Final

from polite.study.changes import check_unchanged
from polite.study.database import Database, sqlite_url
from polite.study.folder import StudyFolder
from polite.study.reading import read_shown

DATABASE: Final = "POLITE_DATABASE"
"""The environment's variable that may say which database it is."""


def open_database(folder: StudyFolder, url: str) -> Database:
    """The study's database, brought up to date.

    Args:
        folder: The study.
        url: As SQLAlchemy reads it; empty for the environment's `POLITE_DATABASE`, and without
            that for the file in the folder.

    Raises:
        DatabaseError: It cannot be used.
    """
    url = url or os.environ.get(DATABASE, "")
    if not url:
        url = sqlite_url(folder.database_path)
        with suppress(OSError):  # that it cannot be written is said when it is opened
            folder.database_path.touch(mode=0o600)  # its log takes this over
    database = Database(url)
    database.migrate()
    return database


def check_study(folder: StudyFolder, database: Database) -> None:
    """Check that people have taken part in no other study than the one in the folder.

    Raises:
        ChangedError: They have; says what was changed.
    """
    with database.read() as connection:
        shown = read_shown(connection)
    check_unchanged(folder.design, folder.pool_checksum, shown)
