"""Feedback on disk: arrays, queries and answers, with a checksum each. No pickle.

A folder holds `segments.npz`, `queries.json`, `answers.jsonl` (one answer a line) and
`manifest.json` with the SHA-256 of each, written last.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from polite.files import sha256, write_atomically, write_json
from polite.types import Answer, Highlight, InvalidValueError, PoliteError, Query, SegmentPool

SEGMENTS, QUERIES, ANSWERS = FILES = ("segments.npz", "queries.json", "answers.jsonl")
MANIFEST = "manifest.json"
VERSION = 1


class DatasetError(PoliteError):
    """A data set on disk that is missing, cut short or altered."""


@dataclass(frozen=True, eq=False)
class Feedback:
    """Segments, pairs of them, and what teachers said."""

    pool: SegmentPool
    """The segments."""
    queries: list[Query]
    """Pairs of the pool."""
    answers: list[Answer] = field(default_factory=list)
    """Answers to the queries."""

    def __post_init__(self) -> None:
        """Check that the parts belong together.

        Raises:
            InvalidValueError: if a query, an answer or a highlight points beyond what there is.
        """
        for query in self.queries:
            if max(query.first, query.second) >= len(self.pool):
                raise InvalidValueError(f"expected indices below {len(self.pool)}, got {query}")
        for answer in self.answers:
            if answer.query >= len(self.queries):
                raise InvalidValueError(f"expected query < {len(self.queries)}, got {answer}")
            self._check_highlights(answer)

    def _check_highlights(self, answer: Answer) -> None:
        if answer.marked is None:
            return
        query = self.queries[answer.query]
        length = self.pool.lengths[(query.first, query.second)[answer.marked]]
        for highlight in (answer.positive, answer.negative):
            if highlight and highlight.end >= length:
                raise InvalidValueError(f"expected highlights to end before {length}, got {answer}")


def save_feedback(folder: Path | str, feedback: Feedback) -> None:
    """Write a feedback data set into a folder, made if needed."""
    folder, pool = Path(folder), feedback.pool
    (folder / MANIFEST).unlink(missing_ok=True)  # a half-written set must not look whole
    arrays = {each.name: getattr(pool, each.name) for each in fields(pool)}
    write_atomically(folder / SEGMENTS, lambda path: np.savez(path, **arrays))
    write_json(folder / QUERIES, [[q.first, q.second] for q in feedback.queries])
    lines = "".join(json.dumps(asdict(a), allow_nan=False) + "\n" for a in feedback.answers)
    write_atomically(folder / ANSWERS, lambda path: path.write_text(lines, encoding="utf-8"))
    checksums = {name: sha256(folder / name) for name in FILES}
    write_json(folder / MANIFEST, {"version": VERSION, "sha256": checksums})


def load_feedback(folder: Path | str) -> Feedback:
    """Read what `save_feedback` wrote, after checking every file.

    Raises:
        DatasetError: naming the file, if one is missing, cut short, altered or not readable.
    """
    folder = Path(folder)
    _check_files(folder)
    try:
        with np.load(folder / SEGMENTS, allow_pickle=False) as arrays:
            pool = SegmentPool(**arrays)
        queries = [Query(*pair) for pair in json.loads((folder / QUERIES).read_text("utf-8"))]
        lines = (folder / ANSWERS).read_text("utf-8").splitlines()
        return Feedback(pool, queries, [parse_answer(json.loads(line)) for line in lines])
    except (TypeError, KeyError, ValueError) as error:
        raise DatasetError(f"{folder}: not a feedback data set ({error})") from error


def _check_files(folder: Path) -> None:
    manifest = folder / MANIFEST
    try:
        content = json.loads(manifest.read_text("utf-8"))
        expected = {name: content["sha256"][name] for name in FILES}
    except FileNotFoundError:
        raise DatasetError(f"{manifest}: missing, so the data set is not whole") from None
    except (TypeError, KeyError, ValueError) as error:
        raise DatasetError(f"{manifest}: cut short or altered ({error})") from error
    if content.get("version") != VERSION:
        raise DatasetError(f"{manifest}: expected version {VERSION}, got {content.get('version')}")
    for name, checksum in expected.items():
        seen = sha256(folder / name) if (folder / name).is_file() else "no file"
        if seen != checksum:
            raise DatasetError(
                f"{folder / name}: cut short or altered: expected SHA-256 {checksum}, got {seen}; "
                "restore the file or collect the feedback again"
            )


def parse_answer(record: dict[str, Any]) -> Answer:
    """An answer from its record (`dataclasses.asdict`), as JSON keeps it."""
    highlights = {
        name: None if record[name] is None else Highlight(**record[name])
        for name in ("positive", "negative")
    }
    return Answer(**{**record, **highlights, "preference": tuple(record["preference"])})
