"""A grid's records put together: results.json, figures and page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console

from polite.analysis.benchmark_summary import summarise
from polite.experiments.benchmark.grid import planned
from polite.experiments.benchmark.record import (
    is_damaged,
    made_otherwise,
    read_records,
    record_path,
)
from polite.files import MARKER, read_json_object, write_json
from polite.report.benchmark import write_benchmark_report
from polite.types import PoliteError

GRID = "benchmark"
"""Marks the folder of a grid, in its run.json."""
FORMAT = 1
"""Of the records; a folder of another format is not gone on with."""


def identity(preset: str) -> dict[str, Any]:
    """What all runs of a folder share, as it stands in its run.json."""
    return {GRID: FORMAT, "preset": preset}


def preset_in(folder: Path) -> str:
    """The preset of the grid in a folder.

    Raises:
        PoliteError: if the folder holds no grid, or another format's.
    """
    marker = read_json_object(folder / MARKER, "give the folder of a benchmark as --out")
    preset = str(marker.get("preset"))
    if marker != identity(preset):
        raise PoliteError(f"{folder} holds no benchmark of this version; give another --out")
    return preset


def report_grid(folder: Path) -> Path:
    """Put the records of a benchmark together, draw its figures and write its page.

    What the preset's grid has and the folder has not is named as missing, and so is what was made
    with other settings than today's, or is damaged.

    Args:
        folder: the benchmark's.

    Returns:
        The page.

    Raises:
        PoliteError: if the folder holds no grid, or another format's.
    """
    runs = planned(preset_in(folder))
    damaged = [record_path(folder, run).name for run in runs if is_damaged(folder, run)]
    results = summarise(
        read_records(folder, runs),
        [run.as_dict() for run in runs],
        made_otherwise=sum(made_otherwise(folder, run) for run in runs),
        damaged=damaged,
    )
    for name in damaged:
        Console(stderr=True).print(
            f"{folder / 'runs' / name} is no record of its run and left out; `polite benchmark "
            "--resume` runs it again",
            soft_wrap=True,
            highlight=False,
        )
    write_json(folder / "results.json", results)
    return write_benchmark_report(folder, results)
