"""Let a teacher of one's own answer: here one who likes smooth driving, whatever the env pays.

    python examples/own_teacher.py Pendulum-v1 20000 --out runs/smooth

A teacher is a function from segments and pairs of them to answers. This one prefers the clip whose
actions change less, and marks the calmest moment as good. Nothing here sees the env's own reward.
"""

import argparse
from pathlib import Path

import numpy as np

import polite
from polite import Answer, Highlight
from polite.rewards.network import predict

LENGTH = 5  # L, steps that a highlight reaches back; the loss has to know it as well


def jerks(segment):
    """How much the action changes at each step, (t,)."""
    changes = np.linalg.norm(np.diff(segment.actions, axis=0), axis=1)
    return np.concatenate([changes[:1], changes])


def likes_smooth_driving(pool, queries, rng):
    """An answer to each pair, with the calmest window of the preferred clip as its highlight."""
    answers = []
    for number, query in enumerate(queries):
        clips = [jerks(pool[query.first]), jerks(pool[query.second])]
        better = int(clips[1].mean() < clips[0].mean())
        calm = np.convolve(clips[better], np.ones(LENGTH + 1), mode="valid")
        preference = (0.0, 1.0) if better else (1.0, 0.0)
        highlight = Highlight(end=int(calm.argmin()) + LENGTH, length=LENGTH)
        answers.append(Answer(number, preference, positive=highlight))
    return answers


def main(env, steps, out):
    polite.train(
        out=out,
        env=env,
        teacher=likes_smooth_driving,
        highlight_length=LENGTH,
        queries=50,
        steps=steps,
    )
    feedback = polite.load_feedback(out / "data")
    model, pool = polite.load_reward_model(out / "models" / "reward.pt"), feedback.pool
    rewards = predict(model, pool.observations, pool.actions)
    changes = np.concatenate([jerks(pool[index]) for index in range(len(pool))])
    correlation = np.corrcoef(rewards[pool.mask], -changes)[0, 1]
    print(f"{len(feedback.answers)} answers; r̂ and smoothness correlate: {correlation:.2f}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("env", nargs="?", default="Pendulum-v1", help="id of the env")
    parser.add_argument("steps", nargs="?", type=int, default=20_000, help="policy steps")
    parser.add_argument("--out", type=Path, default=Path("runs/smooth"), help="a new folder")
    given = parser.parse_args()
    main(given.env, given.steps, given.out)
