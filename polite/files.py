"""Files that are written whole or not at all, and their checksums."""

from __future__ import annotations

import hashlib
import json
import os
import pickle
import re
import uuid
from collections.abc import Callable
from pathlib import Path
from typing import Any

from polite.types import NotFiniteError, PoliteError

MARKER = "run.json"
"""Says what run a folder holds."""
_TEMPORARY = re.compile(r"\..*-[0-9a-f]{32}(\.[^.]+)?")


def write_atomically(path: Path, write: Callable[[Path], object]) -> None:
    """Let `write` fill a temporary file beside `path`, then move it into place.

    The temporary file keeps the suffix, because NumPy and Matplotlib read meaning into it. If
    `write` fails, what stood at `path` still stands, and nothing is left behind.

    Args:
        path: where the file shall be; its folder is made if needed.
        write: writes the whole content to the path that it is given.

    Raises:
        PoliteError: if the system refuses to make the folder or the file.
    """
    temporary = path.with_name(f".{path.stem}-{uuid.uuid4().hex}{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            write(temporary)
            os.replace(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise PoliteError(f"{path}: cannot be written ({system_says(error)})") from error


def write_private(path: Path, text: str) -> None:
    """Write a new file that its owner only may read, from before anything is in it; UTF-8.

    For use within `write_atomically`, whose file in place of an older one is then private, too.

    Raises:
        OSError: if the system refuses, or there is such a file.
    """
    descriptor = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600)
    with open(descriptor, "w", encoding="utf-8", newline="") as file:
        file.write(text)


def is_temporary(path: Path) -> bool:
    """Whether a path is a temporary file of `write_atomically`, left there by a process's death."""
    return _TEMPORARY.fullmatch(path.name) is not None and path.is_file()


def remove_temporaries(folder: Path) -> None:
    """Remove all temporary files of `write_atomically` below a folder that nobody writes into."""
    for path in filter(is_temporary, list(folder.rglob(".*"))):
        path.unlink(missing_ok=True)


def write_json(path: Path, content: object) -> None:
    """Write JSON, indented, in UTF-8.

    Raises:
        NotFiniteError: if the content has NaN or infinity, which JSON does not know.
    """
    try:
        text = json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    except ValueError as error:
        raise NotFiniteError(f"{path}: cannot write NaN or infinity as JSON ({error})") from error
    write_atomically(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))


def read_json_object(path: Path, remedy: str) -> dict[str, Any]:
    """Read a file that holds one JSON object.

    Args:
        path: the file.
        remedy: what the user should do if it does not; ends the error's message.

    Raises:
        PoliteError: naming the file, if it is missing, is no JSON or holds something else.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise PoliteError(f"{path}: cannot be read ({system_says(error)}); {remedy}") from error
    except ValueError as error:
        raise PoliteError(f"{path}: expected JSON ({one_line(error)}); {remedy}") from error
    if not isinstance(content, dict):
        found = type(content).__name__
        raise PoliteError(f"{path}: expected a JSON object, found {found}; {remedy}")
    return content


def marks(folder: Path) -> frozenset[str]:
    """The keys of a folder's `MARKER`, by which commands know their own; none without one."""
    try:
        return frozenset(read_json_object(folder / MARKER, "ignore it"))
    except PoliteError:
        return frozenset()


def system_says(error: OSError) -> str:
    """The system's reason without the path, which our message has already."""
    return error.strerror or one_line(error)


def one_line(error: Exception) -> str:
    """What a library says in an error, in one line of no more than 300 characters, never empty."""
    return " ".join(str(error).split())[:300] or type(error).__name__


def damage(error: Exception) -> str:
    """Why a file of tensors could not be read, without PyTorch's advice to run what is in it."""
    if isinstance(error, pickle.UnpicklingError):
        return "it holds no tensors, or more than tensors"
    if isinstance(error, RuntimeError) and "PytorchStreamReader" in str(error):
        return "it is cut short or damaged"  # PyTorch tells which line of its own found out
    if isinstance(error, PoliteError):
        return str(error)
    return f"{type(error).__name__}: {one_line(error)}"


def sha256(path: Path) -> str:
    """The SHA-256 checksum of a file, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
