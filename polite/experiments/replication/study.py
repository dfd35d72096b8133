"""A run of the study: its config, its seed, and where its files are."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polite.dataset import Feedback, load_feedback
from polite.experiments.replication.config import StudyConfig
from polite.experiments.replication.people import People
from polite.files import write_atomically
from polite.teachers.participants import BASELINE, POLITE

CONDITIONS = {"polite": POLITE, "baseline": BASELINE}
MODELS = ("polite", "baseline", "null_seed", "null_shuffled")
POLICIES = ("polite", "baseline", "ground_truth")


@dataclass(frozen=True)
class Study:
    """A run: its folder, its config and its seed."""

    folder: Path
    config: StudyConfig
    seed: int
    people: People | None = None
    """Who answered; without them, simulated participants do."""

    def model_path(self, name: str, k: int) -> Path:
        """Where the reward model of a condition and training run is kept."""
        return self.folder / "models" / f"reward-{name}-{k}.pt"

    def policy_path(self, name: str, k: int) -> Path:
        """Where the policy of a condition and training run is kept."""
        return self.folder / "models" / f"policy-{name}-{k}.pt"

    def arrays_path(self, name: str) -> Path:
        """Where a stage's arrays are kept."""
        return self.folder / "stages" / f"{name}.npz"

    def feedback(self, condition: str) -> Feedback:
        """The answers of a condition, with the pool and the pairs."""
        return load_feedback(self.folder / "data" / condition)


def save_arrays(path: Path, arrays: dict[str, NDArray[Any]]) -> None:
    """Write named arrays to one file, whole or not at all."""
    write_atomically(path, lambda temporary: np.savez_compressed(temporary, **arrays))  # type: ignore[arg-type]


def load_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Read what `save_arrays` wrote; nothing in the file can run code."""
    with np.load(path, allow_pickle=False) as arrays:
        return dict(arrays)
