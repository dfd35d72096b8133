"""Who answered: simulated participants, people, or robots that try a study with people out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

Respondents = Literal["simulated", "people", "robots"]


def respondents(results: Mapping[str, Any]) -> Respondents:
    """Whose answers a run is about; results of older runs are all simulated."""
    if "people" not in results:
        return "simulated"
    return "robots" if results["simulated"] else "people"
