"""What every method begins with: sizes and seeds."""

from __future__ import annotations

import numpy as np
import torch

from polite.policies.vec_env import GymnasiumVecEnv
from polite.types import PoliteError


def vector_sizes(env: GymnasiumVecEnv) -> tuple[int, int]:
    """How many entries an observation and an action have.

    Raises:
        PoliteError: if one of them is no vector.
    """
    for name, space in (("observations", env.observation_space), ("actions", env.action_space)):
        if space.shape is None or len(space.shape) != 1:
            raise PoliteError(f"expected {name} that are vectors (Box of one axis), got {space}")
    return env.observation_space.shape[0], env.action_space.shape[0]  # type: ignore[index]


def independent_seeds(seed: int, count: int) -> list[int]:
    """Seeds that follow from one, the first ones the same whatever the count."""
    return [int(s.generate_state(1)[0] >> 1) for s in np.random.SeedSequence(seed).spawn(count)]


def torch_generator(seed: int) -> torch.Generator:
    """A source of random numbers for PyTorch."""
    return torch.Generator().manual_seed(seed)
