"""The numbers and the figure of a web study under load; see assets/results/study_load."""

from __future__ import annotations

import os
import platform
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import matplotlib.pyplot as plt
from study_load import LEVELS, make_study, measure

from polite.files import write_json
from polite.plots.style import BLUE, GREY, STYLE, VERMILION

TARGET = 200.0
"""Of the 95th percentile with 200 participants [ms]."""


PACKAGES = ("uvicorn", "fastapi", "sqlalchemy", "psycopg", "httpx2")


def record(out: Path, postgresql_url: str) -> None:
    """Measure both databases, which takes about ten minutes, and write results.json and load.png.

    Args:
        out: The folder.
        postgresql_url: Of an empty database, on a server with `fsync` on.
    """
    with TemporaryDirectory() as place:
        folder = make_study(Path(place) / "study")
        series = {
            "SQLite, one process": measure(folder, f"sqlite:///{place}/study.db", 1),
            "PostgreSQL, two processes": measure(folder, postgresql_url, 2),
        }
    versions = {"python": platform.python_version()} | {name: version(name) for name in PACKAGES}
    machine = {"cores": os.cpu_count(), "versions": versions}
    out.mkdir(parents=True, exist_ok=True)
    write_json(out / "results.json", {"machine": machine, "series": series})
    plot_load(series, out / "load.png")


def plot_load(series: dict[str, list[dict[str, Any]]], path: Path) -> None:
    """Draw the percentiles of an answer against the number of participants.

    Args:
        series: A server's name -> a row for each number of participants.
        path: Of the picture.
    """
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(4.6, 3.0), layout="constrained")
        for (name, rows), colour in zip(series.items(), (BLUE, VERMILION), strict=False):
            people = [row["participants"] for row in rows]
            axes.plot(people, [r["p95_ms"] for r in rows], "o-", color=colour, label=f"{name}, p95")
            axes.plot(people, [r["p50_ms"] for r in rows], ":", color=colour, label="median")
            axes.plot(people, [r["p99_ms"] for r in rows], "--", color=colour, label="p99", lw=0.7)
        axes.axhline(TARGET, color=GREY, lw=0.9)
        axes.annotate("200 ms", (10, TARGET), (0, 2), textcoords="offset points", color=GREY)
        axes.set(xlabel="participants at once", ylabel="an answer takes [ms]", yscale="log")
        axes.set_xticks(LEVELS[1:])
        figure.legend(loc="outside upper center", ncols=2)
        figure.savefig(path, dpi=200)
        plt.close(figure)
