"""Let a teacher of one's own answer: here one who likes smooth driving, whatever the env pays.

    python examples/own_teacher.py Pendulum-v1 20000

A teacher is a function from segments and pairs of them to answers. This one prefers the clip whose
actions change less, and marks the calmest moment as good. Nothing here sees the env's own reward.
"""

import argparse
from functools import partial

import numpy as np

from polite import Answer, Highlight
from polite.methods.config import METHODS, LearningConfig
from polite.methods.preference_learning import learn
from polite.methods.presets import preset_of
from polite.policies.vec_env import make_vec_env
from polite.rewards.network import predict


def jerks(segment):
    """How much the action changes at each step, (t,)."""
    changes = np.linalg.norm(np.diff(segment.actions, axis=0), axis=1)
    return np.concatenate([changes[:1], changes])


def likes_smooth_driving(pool, queries, rng, length):
    """An answer to each pair, with the calmest window of the preferred clip as its highlight.

    The window has length + 1 steps; the loss has to be told the same length L.
    """
    answers = []
    for number, query in enumerate(queries):
        clips = [jerks(pool[query.first]), jerks(pool[query.second])]
        better = int(clips[1].mean() < clips[0].mean())
        calm = np.convolve(clips[better], np.ones(length + 1), mode="valid")
        preference = (0.0, 1.0) if better else (1.0, 0.0)
        highlight = Highlight(end=int(calm.argmin()) + length, length=length)
        answers.append(Answer(number, preference, positive=highlight))
    return answers


def main(env, steps):
    preset = preset_of(env).with_highlights("choice")
    config = LearningConfig(
        METHODS["polite"], queries=50, steps=steps, training=preset.training, ppo=preset.ppo
    )
    learned = learn(
        lambda count, seed: make_vec_env(env, count, seed, **preset.settings),
        lambda pool: partial(likes_smooth_driving, length=preset.training.highlight_length),
        config,
        seed=0,
    )
    pool = learned.feedback.pool
    rewards = predict(learned.reward, pool.observations, pool.actions)
    changes = np.concatenate([jerks(pool[index]) for index in range(len(pool))])
    correlation = np.corrcoef(rewards[pool.mask], -changes)[0, 1]
    print(f"{len(learned.feedback.answers)} answers; r̂ and smoothness correlate: {correlation:.2f}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("env", nargs="?", default="Pendulum-v1", help="id of the env")
    parser.add_argument("steps", nargs="?", type=int, default=20_000, help="policy steps")
    given = parser.parse_args()
    main(given.env, given.steps)
