"""What a run was done with: noted beside its times, never in its record."""

from __future__ import annotations

import platform
import subprocess
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final

import polite

PACKAGES: Final = ("torch", "numpy", "mujoco", "gymnasium", "stable-baselines3")
"""Beside this one, those that a run's numbers rest on."""


@cache
def machine() -> dict[str, str | None]:
    """Versions, commit and processor; None for what is not there or not known."""
    packages = {name: _version(name) for name in PACKAGES}
    named = {"polite": _version("socialnav-polite"), "commit": _commit()}
    return named | packages | {"python": platform.python_version(), "processor": _processor()}


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _commit() -> str | None:
    """The commit of the checkout that this package lies in, with "-dirty" if it was changed."""
    root = Path(polite.__file__).parents[1]
    if not (root / ".git").exists():
        return None
    command = ["git", "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return done.stdout.strip()


def _processor() -> str:
    """Its name as the system tells it: Linux in a file of its own."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    except OSError:
        lines = []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor() or platform.machine())
