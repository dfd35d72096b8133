"""Runs gym-pusht in a Python of its own, since it needs an older pymunk.

Each line on standard input is a number of steps; the answer is the seconds that they took.
"""

import sys
import time

import gym_pusht  # noqa: F401 (registers the env)
import gymnasium as gym

env = gym.make("gym_pusht/PushT-v0", obs_type="state")
env.reset(seed=0)
env.action_space.seed(0)
actions = [env.action_space.sample() for _ in range(1000)]
print("ready", flush=True)
for line in sys.stdin:
    start = time.perf_counter()
    for action in actions[: int(line)]:
        _, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            env.reset()
    print(time.perf_counter() - start, flush=True)
