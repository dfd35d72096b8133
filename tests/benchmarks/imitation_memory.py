"""What imitation's preference dataset keeps in memory, in a Python of its own.

Each line on standard input is JSON with the arguments of `run`; the answer is JSON with the bytes
that are kept and those at the peak.
"""

import json
import sys
import tracemalloc

import numpy as np
from imitation.algorithms.preference_comparisons import PreferenceDataset, RandomFragmenter
from imitation.data.types import TrajectoryWithRew


def episode(steps, rng):
    return TrajectoryWithRew(
        obs=rng.normal(size=(steps + 1, 17)),
        acts=rng.normal(size=(steps, 6)).astype(np.float32),
        rews=rng.normal(size=steps),
        infos=None,
        terminal=True,
    )


def run(sessions, pairs, length, episodes, steps):
    rng = np.random.default_rng(0)
    dataset, fragmenter = PreferenceDataset(), RandomFragmenter(rng=rng, warning_threshold=0)
    tracemalloc.start()
    for _ in range(sessions):
        trajectories = [episode(steps, rng) for _ in range(episodes)]
        dataset.push(fragmenter(trajectories, length, pairs), np.ones(pairs, np.float32))
    del trajectories
    memory = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return memory


print("ready", flush=True)
for line in sys.stdin:
    print(json.dumps(run(**json.loads(line))), flush=True)
