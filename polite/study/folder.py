"""A study's folder: what belongs to it, and whether it belongs together."""

from __future__ import annotations

import secrets
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Final

from polite.dataset import MANIFEST, Feedback, load_feedback
from polite.files import read_json_object, sha256, write_atomically, write_private
from polite.study.clips import Clip, clip_files, clip_names, load_clips, used_segments
from polite.study.design import FILE, Design, Example, read_design
from polite.types import PoliteError, Query, SegmentPool

SECRETS: Final = "secrets.json"
_TOKEN_BYTES: Final = 32
_REMAKE: Final = "make the clips again with: polite study new --resume"


class StudyFolderError(PoliteError):
    """A study's folder whose parts are missing or do not belong together."""


@dataclass(frozen=True)
class Secrets:
    """What nobody but the server and the researcher may know; never printed with the rest."""

    session_key: str = field(repr=False)
    """Signs the cookies of browsers."""
    researcher_token: str = field(repr=False)
    """Opens the researcher's page."""


@dataclass(frozen=True)
class StudyFolder:
    """A study on disk; its parts are read when they are first asked for, and then kept."""

    path: Path
    """The folder."""

    @property
    def pool_path(self) -> Path:
        """The feedback data set with segments and comparisons, without answers."""
        return self.path / "pool"

    @property
    def database_path(self) -> Path:
        """Participants and their answers, unless another database is given."""
        return self.path / "study.db"

    @cached_property
    def design(self) -> Design:
        """What the researcher fixed; `DesignError` if it cannot be read."""
        return read_design(self.path / FILE)

    @cached_property
    def feedback(self) -> Feedback:
        """Segments and comparisons; `DatasetError` if they cannot be read."""
        return load_feedback(self.pool_path)

    @property
    def pool_checksum(self) -> str:
        """Follows from every segment and comparison; `DatasetError` if the pool cannot be read."""
        assert self.feedback  # its files are what the manifest says
        return sha256(self.pool_path / MANIFEST)

    @property
    def pool(self) -> SegmentPool:
        """The segments."""
        return self.feedback.pool

    @property
    def queries(self) -> list[Query]:
        """The comparisons: block b is `comparisons` of them from b * `comparisons` on."""
        return self.feedback.queries

    @cached_property
    def clips(self) -> dict[int, Clip]:
        """The clip of each segment that is shown; `ClipError` if the list cannot be read."""
        return load_clips(self.path)

    @cached_property
    def secrets(self) -> Secrets:
        """The study's secrets, made when they are first asked for.

        Raises:
            PoliteError: The file cannot be written, or is damaged.
        """
        path = self.path / SECRETS
        if not path.exists():
            write_atomically(path, _write_secrets)
        content = read_json_object(path, "restore it; a new one would log everybody out")
        values = [content.get(name) for name in ("session_key", "researcher_token")]
        if not all(isinstance(value, str) and len(value) >= _TOKEN_BYTES for value in values):
            raise StudyFolderError(
                f"{path}: expected session_key and researcher_token of at least {_TOKEN_BYTES} "
                "characters; restore it, or delete it for new ones, which logs everybody out"
            )
        return Secrets(*map(str, values))

    def check(self) -> None:
        """Check that all parts are there and belong together.

        Raises:
            StudyFolderError: They do not; the message says what to do.
            PoliteError: One of them cannot be read.
        """
        self.check_there()
        check_design(self.design, self.feedback)
        self._check_clips()

    def check_there(self) -> None:
        """Check that there is a folder, whole or not.

        Raises:
            StudyFolderError: There is none.
        """
        if not self.path.is_dir():
            raise StudyFolderError(
                f"{self.path}: expected a study's folder, found none; make one with: "
                f"polite study new {self.path}"
            )

    def _check_clips(self) -> None:
        used = used_segments(self.design, self.feedback)
        missing = [index for index in used if index not in self.clips]
        if missing:
            raise StudyFolderError(
                f"{self.path}: {len(missing)} of {len(used)} clips are missing, the first that of "
                f"segment {missing[0]}; {_REMAKE}"
            )
        # A recording may have stayed on the machine that made the clips.
        names = {} if self.design.recorded else self._names(used)
        for index in used:
            clip, steps = self.clips[index], int(self.pool.lengths[index])
            if clip.steps != steps or names.get(index, clip.name) != clip.name:
                raise StudyFolderError(
                    f"{self.path}: the clip of segment {index} shows something else than the pool "
                    f"and {FILE} say; {_REMAKE}"
                )
            for path in clip_files(self.path, clip):
                if not path.is_file():
                    raise StudyFolderError(f"{path}: missing; {_REMAKE}")

    def _names(self, used: list[int]) -> dict[int, str]:
        return clip_names(self.path, self.design, self.feedback, used)


def check_design(design: Design, feedback: Feedback) -> None:
    """Check that a design asks for nothing that the pool does not have.

    Raises:
        StudyFolderError: It does; the message says what to do.
    """
    wanted, found = design.participants * design.comparisons, len(feedback.queries)
    if found < wanted:
        raise StudyFolderError(
            f"expected {wanted} comparisons ({design.participants} participants x "
            f"{design.comparisons}), found {found}; ask for fewer of either, or make a study "
            "from a pool with more"
        )
    _check_segments(design, len(feedback.pool))
    for which in ("good", "bad"):
        example: Example = getattr(design.guide, which)
        steps = int(feedback.pool.lengths[example.segment])
        last = max(0, steps - 1 - design.highlight_length)
        if example.start > last:
            raise StudyFolderError(
                f"{FILE}: guide.{which}.start: expected at most {last}, so that the window of "
                f"{design.highlight_length + 1} steps lies within the {steps} steps of segment "
                f"{example.segment}, got {example.start}"
            )


def _check_segments(design: Design, count: int) -> None:
    for number, pair in enumerate(design.practice, start=1):
        if pair.first == pair.second:
            raise StudyFolderError(
                f"{FILE}: practice {number}: expected two different segments, got "
                f"{pair.first} twice"
            )
    beyond = sorted(index for index in design.segments if index >= count)
    if beyond:
        raise StudyFolderError(
            f"{FILE}: guide and practice: expected segments below {count}, the size of the pool, "
            f"got {', '.join(map(str, beyond))}"
        )


def _write_secrets(path: Path) -> None:
    """Draw new secrets."""
    drawn = [secrets.token_urlsafe(_TOKEN_BYTES) for _ in range(2)]
    text = f'{{\n  "session_key": "{drawn[0]}",\n  "researcher_token": "{drawn[1]}"\n}}\n'
    write_private(path, text)
