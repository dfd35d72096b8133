"""Files of tensors, written whole or not at all, and alike where their content is."""

from __future__ import annotations

from pathlib import Path

import torch

from polite.files import write_atomically


def save_tensors(path: Path, content: object) -> None:
    """Write tensors, numbers, text, and lists and dicts of them.

    Raises:
        PoliteError: if the system refuses.
    """

    def write(temporary: Path) -> None:
        with temporary.open("wb") as file:  # to a path PyTorch would write the file's name, too
            torch.save(content, file)

    write_atomically(path, write)
