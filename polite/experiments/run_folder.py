"""A run's folder: taken once, and gone on with only by the same run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from polite.files import (
    is_temporary,
    read_json_object,
    remove_temporaries,
    system_says,
    write_json,
)
from polite.types import InvalidValueError, PoliteError


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
    marker = out / "run.json"
    run = json.loads(json.dumps(run))
    _check_seed(run.get("seed", 0))
    try:
        if out.exists():
            if not all(is_temporary(path) for path in out.iterdir()):
                _recognise(out, marker, run, resume)
            remove_temporaries(out)
    except OSError as error:
        raise PoliteError(
            f"{out} cannot be a run's folder ({system_says(error)}); give another --out"
        ) from error
    write_json(marker, run)


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
        raise PoliteError(f"{out} is not empty; give another --out, or --resume to go on there")
    if not marker.exists():
        raise PoliteError(f"{out} holds no run to go on with; give another --out")
    if read_json_object(marker, "restore it, or give another --out") != run:
        raise PoliteError(f"{out} holds a run with other settings; give another --out")
