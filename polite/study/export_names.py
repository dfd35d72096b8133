"""What the files of an export are called; read without the packages of the `web` extra."""

from __future__ import annotations

from typing import Final

SUMMARY: Final = "export.json"
"""Written last: counts, and every other file's checksum."""
PARTICIPANTS_TABLE: Final = "participants.csv"
QUESTIONNAIRE: Final = ("participant", "condition", "excluded")
"""Columns of the questionnaire's table before those of its questions."""
DESIGNS: Final = "designs.json"
"""What the participants have seen: every design that any of them joined, by its checksum."""
DATA: Final = "data"
"""Holds a data set for each condition."""
VERSION: Final = 1
"""Of the files' form, in `export.json`."""
