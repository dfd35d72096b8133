"""A training that can be taken up again: what it is made of, as tensors, numbers and text.

One file, written whole or not at all; nothing in it can run code when it is loaded.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, cast

import numpy as np
import torch

from polite.dataset import Feedback, parse_answer
from polite.files import damage
from polite.torch_files import save_tensors
from polite.types import PoliteError, Query, SegmentPool, Trajectory

Content = dict[str, Any]
_ROWS = ("observations", "actions", "rewards", "states")


def save_checkpoint(path: Path, identity: str, content: Content) -> None:
    """Write a training's state.

    Args:
        path: the file.
        identity: tells this training from others; asked for when the file is read.
        content: tensors, numbers, text, and lists and dicts of them.
    """
    save_tensors(path, {"identity": identity, "content": content})


def load_checkpoint(path: Path, identity: str) -> Content | None:
    """Read a training's state; None if there is no file.

    Raises:
        PoliteError: naming the file, if it is damaged or belongs to another training.
    """
    if not path.is_file():
        return None
    try:
        whole = torch.load(path, weights_only=True)
        found, content = whole["identity"], whole["content"]
    except Exception as error:  # a damaged file fails in a dozen ways inside PyTorch
        raise PoliteError(
            f"{path}: expected a training to go on with ({damage(error)}); remove it to begin anew"
        ) from None
    if found != identity:
        raise PoliteError(
            f"{path}: belongs to a training with other settings; remove it to begin anew, or go on "
            f"with the settings it has: {found}"
        )
    return cast(Content, content)


def pack_feedback(feedback: Feedback) -> Content:
    """Segments, queries and answers."""
    return {
        "pool": pack_pool(feedback.pool),
        "queries": [(query.first, query.second) for query in feedback.queries],
        "answers": [json.dumps(asdict(answer)) for answer in feedback.answers],
    }


def unpack_feedback(content: Content) -> Feedback:
    """What `pack_feedback` was given."""
    return Feedback(
        unpack_pool(content["pool"]),
        [Query(*pair) for pair in content["queries"]],
        [parse_answer(json.loads(answer)) for answer in content["answers"]],
    )


def pack_pool(pool: SegmentPool) -> Content:
    """The arrays of a pool."""
    return {f.name: torch.from_numpy(getattr(pool, f.name)) for f in fields(SegmentPool)}


def unpack_pool(content: Content) -> SegmentPool:
    """What `pack_pool` was given."""
    return SegmentPool(**{name: tensor.numpy() for name, tensor in content.items()})


def pack_trajectories(trajectories: Sequence[Trajectory]) -> Content:
    """Trajectories end to end (thousands of short ones would make a slow file), at least one."""
    columns = {
        name: torch.from_numpy(np.concatenate([getattr(t, name) for t in trajectories]))
        for name in _ROWS
    }
    return columns | {
        "lengths": [len(t) for t in trajectories],
        "terminated": [t.terminated for t in trajectories],
    }


def unpack_trajectories(content: Content) -> list[Trajectory]:
    """What `pack_trajectories` was given."""
    columns = {name: content[name].split(content["lengths"]) for name in _ROWS}
    return [
        Trajectory(**{name: rows[k].numpy() for name, rows in columns.items()}, terminated=ended)
        for k, ended in enumerate(content["terminated"])
    ]


def pack_generator(generator: np.random.Generator) -> str:
    """The state of a generator, as JSON: its integers are too large for a tensor."""
    return json.dumps(generator.bit_generator.state)


def set_generator(generator: np.random.Generator, packed: str) -> None:
    """Go on where the generator was that `pack_generator` was given."""
    generator.bit_generator.state = json.loads(packed)
