"""Segments of chance, to measure speeds on."""

import numpy as np

from polite.types import SegmentPool

PAIRS, SEGMENTS, STEPS = 256, 200, 50


def random_pool(rng, observation, action):
    """SEGMENTS segments of STEPS steps of vectors of these sizes."""
    return SegmentPool(
        observations=rng.normal(size=(SEGMENTS, STEPS, observation)),
        actions=rng.uniform(-1, 1, (SEGMENTS, STEPS, action)),
        rewards=rng.normal(size=(SEGMENTS, STEPS)),
        states=np.zeros((SEGMENTS, STEPS, 1)),
        lengths=np.full(SEGMENTS, STEPS),
        trajectory=np.zeros(SEGMENTS),
        start=np.zeros(SEGMENTS),
    )
