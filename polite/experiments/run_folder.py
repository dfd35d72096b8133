"""A run's folder: taken once, and gone on with only by the same run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from polite.files import write_json
from polite.types import PoliteError


def claim_folder(out: Path, run: dict[str, Any], resume: bool) -> None:
    """Make the folder of a run, or recognise it.

    Args:
        out: The folder.
        run: What makes the run what it is.
        resume: Whether an existing folder may be gone on with.

    Raises:
        PoliteError: The folder holds something, and is not to be gone on with or is another run's.
    """
    marker = out / "run.json"
    run = json.loads(json.dumps(run))
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        if not resume:
            raise PoliteError(f"{out} is not empty; give another --out, or --resume to go on there")
        if not marker.exists():
            raise PoliteError(f"{out} holds no run to go on with; give another --out")
        if json.loads(marker.read_text("utf-8")) != run:
            raise PoliteError(f"{out} holds a run with other settings; give another --out")
    write_json(marker, run)
