"""A run's folder: taken once, and gone on with only by the same run."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

from polite.files import (
    MARKER,
    is_temporary,
    read_json_object,
    remove_temporaries,
    system_says,
    write_json,
)
from polite.types import InvalidValueError, PoliteError

LOCK = ".lock"
"""Held by the process that works in the folder, if its runs ask for that; names the process."""
_MOST_TOLD, _SHORT = 3, 80  # differing settings in one line, characters of two values
BUSY = "another run (process {process}) works in {folder}; wait for it"


@contextmanager
def sole_run(out: Path, run: dict[str, Any], resume: bool, busy: str = BUSY) -> Iterator[None]:
    """Claim a folder and keep other processes from it; a process that is killed lets go of it.

    Args:
        out: The folder.
        run: As in `claim_folder`.
        resume: As in `claim_folder`.
        busy: What to say if another process works there; has {process} and {folder}.

    Raises:
        PoliteError: As in `claim_folder`, or another process works there.
    """
    _check(out, run, resume)  # a folder of something else gets no lock
    try:
        out.mkdir(parents=True, exist_ok=True)
        file = (out / LOCK).open("a+", encoding="utf-8")
    except OSError as error:
        raise PoliteError(_unusable(out, error)) from error
    with file:
        if not _lock(file):
            file.seek(0)
            raise PoliteError(busy.format(process=file.read().strip() or "unknown", folder=out))
        file.truncate(0)
        file.write(f"{os.getpid()}\n")
        file.flush()
        claim_folder(out, run, resume)
        yield


def is_left(out: Path) -> bool:
    """Whether a run was begun in a folder and no process works there now; no, if that is hidden."""
    try:
        with (out / LOCK).open("r+", encoding="utf-8") as file:
            return sys.platform != "win32" and _lock(file)
    except OSError:  # never begun, or not ours to write
        return False


if sys.platform == "win32":

    def _lock(file: TextIO) -> bool:
        """Windows has no lock of this kind, so nobody is kept out."""
        return True

else:
    import fcntl

    def _lock(file: TextIO) -> bool:
        """Lock a file until it is closed; whether nobody else holds it."""
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError:  # a file system without locks
            return True
        return True


def claim_folder(out: Path, run: dict[str, Any], resume: bool) -> None:
    """Make the folder of a run, or recognise it and clear what a killed process left half written.

    Args:
        out: The folder.
        run: What makes the run what it is; its `seed`, if it has one, is checked.
        resume: Whether an existing folder may be gone on with.

    Raises:
        PoliteError: The seed is not one, the folder cannot be used, or it holds something and is
            not to be gone on with or is another run's. Nothing is written or removed then.
    """
    _check(out, run, resume)
    try:
        if out.exists():
            remove_temporaries(out)
    except OSError as error:
        raise PoliteError(_unusable(out, error)) from error
    write_json(out / MARKER, run)


def _check(out: Path, run: dict[str, Any], resume: bool) -> None:
    """Look whether a folder can be claimed; changes nothing.

    Raises:
        PoliteError: if not, with what to do.
    """
    run = json.loads(json.dumps(run))
    _check_seed(run.get("seed", 0))
    try:
        if out.exists() and not all(map(_is_left_over, out.iterdir())):
            _recognise(out, out / MARKER, run, resume)
    except OSError as error:
        raise PoliteError(_unusable(out, error)) from error


def _is_left_over(path: Path) -> bool:
    """Whether a file is what a process leaves that was killed before it had claimed its folder."""
    return path.name == LOCK or is_temporary(path)


def _unusable(out: Path, error: OSError) -> str:
    return f"{out} cannot be a run's folder ({system_says(error)}); give another folder"


def _check_seed(seed: object) -> None:
    """Refuse what no random generator can be seeded with.

    Raises:
        InvalidValueError: with what was seen.
    """
    if not isinstance(seed, int) or seed < 0:
        raise InvalidValueError(f"seed: expected a whole number of at least 0, got {seed!r}")


def _recognise(out: Path, marker: Path, run: dict[str, Any], resume: bool) -> None:
    """Check that a folder that holds something may be gone on with.

    Raises:
        PoliteError: if not, with what to do.
    """
    if not resume:
        raise PoliteError(
            f"{out} is not empty; give another folder, or go on there with --resume "
            "(from Python resume=True)"
        )
    if not marker.exists():
        raise PoliteError(f"{out} holds no run to go on with; give another folder")
    before = read_json_object(marker, "restore it, or give another folder")
    if before != run:
        raise PoliteError(
            f"{out} holds a run with other settings ({_differences(before, run)}); give another "
            "folder"
        )


def _differences(before: dict[str, Any], now: dict[str, Any]) -> str:
    """Which settings differ, and how where that is short."""

    def shown(run: dict[str, Any], name: str) -> str:
        return json.dumps(run[name], ensure_ascii=False) if name in run else "nothing"

    told = []
    for name in {**before, **now}:
        there, here = shown(before, name), shown(now, name)
        if there != here:
            short = len(there) + len(here) <= _SHORT
            told.append(f"{name}: {there} there, {here} now" if short else name)
    return ", ".join([*told[:_MOST_TOLD], *(["…"] if len(told) > _MOST_TOLD else [])])
