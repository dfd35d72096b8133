"""Corridor-steps per second of the vector env, what they are spent on, and pymunk's ceiling."""

import time
from collections import defaultdict

import gymnasium as gym
import numpy as np
import pymunk

import socialnav_env.world as world_module
from socialnav_env.config import CorridorConfig
from socialnav_env.vector_env import SocialCorridorVectorEnv
from socialnav_env.world import World

STEPS, ROUNDS = 50, 15
AT_LEAST = 400_000
SHARE_OF_CEILING, DEARER_WHEN_MANY = 0.5, 1.5


def actions_for(count):
    return np.random.default_rng(0).uniform(-1.0, 1.0, (STEPS, count, 2))


def prepared(count):
    """A vector env in mid-episode, and a function that steps it and tells seconds a corridor."""
    env = gym.make_vec("SocialCorridor-v0", num_envs=count)
    env.reset(seed=0)
    actions = actions_for(count)

    def run():
        start = time.perf_counter()
        for action in actions:
            env.step(action)
        return (time.perf_counter() - start) / (STEPS * count)

    run()
    return env, run


def bare_space(count):
    """One Space with the walls and bodies of many corridors and nothing else; and its stepping."""
    config, space = CorridorConfig(), pymunk.Space()
    space.use_spatial_hash(2.0, 100 * count)
    rng = np.random.default_rng(0)
    for n in range(count):
        aside = 10.0 * n
        z, x = config.half_length + 0.5, config.half_width + 0.5
        corners = [(-z, aside - x), (z, aside - x), (z, aside + x), (-z, aside + x)]
        for start, end in zip(corners, corners[1:] + corners[:1], strict=True):
            space.add(pymunk.Segment(space.static_body, start, end, 0.5))
        for place in (-14.0, -10.0, 5.0, 8.0):
            body = pymunk.Body(50.0, float("inf"))
            body.position = place, aside
            body.velocity = tuple(rng.uniform(-0.1, 0.1, 2))
            space.add(body, pymunk.Circle(body, 0.3))

    def run():
        start = time.perf_counter()
        for _ in range(STEPS * config.frame_skip):
            space.step(config.timestep)
        return (time.perf_counter() - start) / (STEPS * count)

    return run


def best_of(runs, rounds=ROUNDS):
    """Least seconds of each run, taken in turns."""
    best = dict.fromkeys(runs, float("inf"))
    for _ in range(rounds):
        for name, run in runs.items():
            best[name] = min(best[name], run())
    return best


def test_many_corridors_against_the_ceiling_and_against_more_of_them(benchmark):
    envs = {count: prepared(count) for count in (1, 16, 64, 256, 1024, 4096)}
    benchmark.pedantic(envs[256][1], rounds=3)
    runs = {count: run for count, (_, run) in envs.items()}
    best = best_of({**runs, "bare": bare_space(256)})
    per_second = {name: round(1.0 / seconds) for name, seconds in best.items()}
    ratios = {
        "share_of_ceiling": best["bare"] / best[256],
        "cost_4096_to_256": best[4096] / best[256],
    }
    benchmark.extra_info.update({str(k): v for k, v in per_second.items()} | ratios)
    print(f"\ncorridor-steps/s: {per_second}; {ratios}")
    assert per_second[256] >= AT_LEAST
    assert ratios["share_of_ceiling"] >= SHARE_OF_CEILING
    assert ratios["cost_4096_to_256"] <= DEARER_WHEN_MANY


PARTS = {
    "drive": "people",
    "walk": "people",
    "reward": "reward",
    "observe": "observation",
    "count_step": "metrics",
    "summarise": "metrics",
}
"""Kernel of a step -> the part that it counts as."""


def test_what_a_step_is_spent_on(benchmark, monkeypatch):
    spent = defaultdict(float)

    def timed(function, part):
        def run(*args, **keywords):
            start = time.perf_counter()
            result = function(*args, **keywords)
            spent[part] += time.perf_counter() - start
            return result

        return run

    env, run = prepared(256)
    for name, part in PARTS.items():
        monkeypatch.setattr(world_module, name, timed(getattr(world_module, name), part))
    physics = env.unwrapped.world._physics
    monkeypatch.setattr(physics, "step", timed(physics.step, "physics"))
    monkeypatch.setattr(World, "begin", timed(World.begin, "new episodes"))
    monkeypatch.setattr(
        SocialCorridorVectorEnv, "_info", timed(SocialCorridorVectorEnv._info, "info")
    )
    whole = benchmark.pedantic(lambda: [run() for _ in range(ROUNDS)], rounds=1)
    total, each = sum(whole) / ROUNDS, 1.0 / (ROUNDS * STEPS * 256)
    split = {part: 1e6 * seconds * each for part, seconds in spent.items()}
    split["the rest"] = 1e6 * total - sum(split.values())
    benchmark.extra_info.update(split)
    print("\nus a corridor: " + ", ".join(f"{k} {v:.2f}" for k, v in split.items()))
    assert split["the rest"] >= 0.0
    assert split["physics"] < 1e6 * total


def test_many_corridors_in_permanent_contact(benchmark):
    """The worst case: every robot leans against a wall, so that pymunk moves every corridor."""
    count = 256
    env = gym.make_vec("SocialCorridor-v0", num_envs=count, terminate_on_collision=False)
    env.reset(seed=0)
    world, ahead = env.unwrapped.world, np.tile([1.0, 0.0], (count, 1))
    for n in range(count):
        bodies = world.state.bodies[n].copy()
        bodies[0] = -14.0, 2.69, 0.5 * np.pi, 0.0, 0.0, 0.0
        world.place(n, bodies)
    env.step(ahead)
    benchmark.pedantic(lambda: [env.step(ahead) for _ in range(20)], rounds=5, warmup_rounds=1)
    assert world.contacts[:, 1].all()
    benchmark.extra_info["per_second"] = round(20 * count / benchmark.stats.stats.min)
    print(f"\n{count} corridors in contact: {benchmark.extra_info['per_second']} steps/s")
