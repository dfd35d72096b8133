"""The types that all wrappers share."""

from __future__ import annotations

from typing import Any, SupportsFloat, TypeVar

Observation = TypeVar("Observation")
Action = TypeVar("Action")

Step = tuple[Observation, SupportsFloat, bool, bool, dict[str, Any]]
"""What `step` returns."""
