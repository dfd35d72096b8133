"""Memory, kept and at its peak, against the number of stored segments: ours and imitation's."""

import json
import tracemalloc

import numpy as np
from imitation_process import imitation

from polite.methods.history import FeedbackHistory
from polite.rewards.data import stack_feedback
from polite.segments import cut_segments
from polite.teachers.oracle import Oracle
from polite.types import Trajectory

SHAPE = {"pairs": 20, "length": 50, "episodes": 8}
FEW, MANY = 10, 60  # sessions of twice as many segments as pairs
SHORT, LONG = 1000, 4000  # steps of an episode


def episode(steps, rng):
    """HalfCheetah's sizes, and the states that clips are drawn from."""
    return Trajectory(
        observations=rng.normal(size=(steps, 17)).astype(np.float32),
        actions=rng.normal(size=(steps, 6)).astype(np.float32),
        rewards=rng.normal(size=steps),
        states=rng.normal(size=(steps, 18)),
        terminated=True,
    )


def run_ours(sessions, pairs, length, episodes, steps):
    """Kept, and at the peak, by a history that is stacked for training at every session [bytes]."""
    rng = np.random.default_rng(0)
    history = FeedbackHistory(recent_sessions=5)
    tracemalloc.start()
    for _ in range(sessions):
        trajectories = [episode(steps, rng) for _ in range(episodes)]
        history.add_segments(cut_segments(trajectories, length, 2 * pairs, rng))
        history.ask(pairs, Oracle().answer_queries, rng)
        feedback = history.feedback
        stack_feedback(feedback)
    del trajectories, feedback
    memory = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return memory


def slopes(run, steps):
    """Bytes more, kept and at the peak, with each segment more that is stored."""
    few, many = (run(**SHAPE, steps=steps, sessions=sessions) for sessions in (FEW, MANY))
    return (np.array(many) - few) / (2 * SHAPE["pairs"] * (MANY - FEW))


def test_memory_does_not_grow_with_the_length_of_episodes(benchmark, tmp_path):
    with imitation("imitation_memory.py", folder=tmp_path) as peer:
        ours = {steps: slopes(run_ours, steps) for steps in (SHORT, LONG)}
        theirs = {
            steps: slopes(lambda **settings: json.loads(peer(json.dumps(settings))), steps)
            for steps in (SHORT, LONG)
        }
    benchmark.pedantic(run_ours, kwargs={**SHAPE, "steps": SHORT, "sessions": FEW}, rounds=1)
    told = {
        f"{name}, episodes of {steps}: bytes a segment, kept and at the peak": bytes_.round()
        for name, measured in (("polite", ours), ("imitation", theirs))
        for steps, bytes_ in measured.items()
    }
    benchmark.extra_info.update({name: bytes_.tolist() for name, bytes_ in told.items()})
    print(f"\n{told}")
    assert (ours[LONG] < 1.05 * ours[SHORT]).all()
    assert (theirs[LONG] > 3.0 * theirs[SHORT]).all()  # the measurement shows what it is about
    assert (ours[LONG] < theirs[LONG] / 2).all()
