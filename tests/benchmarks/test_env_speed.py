"""Steps per second of the corridor against Walker2d-v5 and against bare pymunk, in one run."""

import time

import gymnasium as gym
import numpy as np
import pymunk
import pytest

from socialnav_env.config import CorridorConfig

STEPS, ROUNDS = 1000, 15
AGAINST_WALKER, AGAINST_PYMUNK = 4.0, 3.0


def actions_for(env):
    env.action_space.seed(0)
    return [env.action_space.sample() for _ in range(STEPS)]


def run_env(env, actions):
    env.reset(seed=0)
    for action in actions:
        _, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            env.reset()


def bare_corridor():
    """The corridor's bodies and walls, as pymunk's manual would build them."""
    config, space, bodies = CorridorConfig(), pymunk.Space(), []
    z, x = config.half_length + 0.5, config.half_width + 0.5
    corners = [(-z, -x), (z, -x), (z, x), (-z, x)]
    for start, end in zip(corners, corners[1:] + corners[:1], strict=True):
        space.add(pymunk.Segment(space.static_body, start, end, 0.5))
    people = [(config.human_mass, config.human_radius)] * config.num_humans
    for place, (mass, radius) in zip(
        (-14.0, -10.0, 5.0, 8.0), [(config.robot_mass, config.robot_radius), *people], strict=True
    ):
        body = pymunk.Body(mass, float("inf"))
        body.position = place, 0.0
        space.add(body, pymunk.Circle(body, radius))
        bodies.append(body)
    return space, bodies, config


def run_bare(space, bodies, config, velocities):
    """Velocities in, physics, positions and velocities out, nothing else."""
    for step in velocities:
        for body, velocity in zip(bodies, step, strict=True):
            body.velocity = velocity
        for _ in range(config.frame_skip):
            space.step(config.timestep)
        for body in bodies:
            body.position, body.velocity  # noqa: B018


@pytest.fixture
def contestants(tmp_path, monkeypatch):
    pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)  # MuJoCo 4 writes MUJOCO_LOG.TXT where it runs
    corridor, walker = gym.make("SocialCorridor-v0"), gym.make("Walker2d-v5")
    velocities = np.random.default_rng(0).uniform(-1.0, 1.0, (STEPS, 4, 2)).tolist()
    return {
        "corridor": (run_env, corridor, actions_for(corridor)),
        "walker": (run_env, walker, actions_for(walker)),
        "pymunk": (run_bare, *bare_corridor(), velocities),
    }


def test_steps_per_second_against_walker2d_and_bare_pymunk(benchmark, contestants):
    run, *args = contestants["corridor"]
    benchmark.pedantic(run, args=args, rounds=5, warmup_rounds=1)
    # In turns, so that a busy moment of the machine hits all of them.
    best = dict.fromkeys(contestants, float("inf"))
    for _ in range(ROUNDS):
        for name, (run, *args) in contestants.items():
            start = time.perf_counter()
            run(*args)
            best[name] = min(best[name], (time.perf_counter() - start) / STEPS)
    per_second = {name: round(1.0 / seconds) for name, seconds in best.items()}
    ratios = best["walker"] / best["corridor"], best["corridor"] / best["pymunk"]
    benchmark.extra_info.update(per_second)
    benchmark.extra_info["times_walker2d"], benchmark.extra_info["times_bare_pymunk"] = ratios
    print(f"\nsteps/s: {per_second}; {ratios[0]:.1f} x Walker2d-v5, {ratios[1]:.2f} x bare pymunk")
    assert ratios[0] >= AGAINST_WALKER
    assert ratios[1] <= AGAINST_PYMUNK


@pytest.mark.parametrize("count", [1, 16, 64, 256])
def test_corridor_steps_per_second_of_the_vector_env(benchmark, count):
    env = gym.make_vec("SocialCorridor-v0", num_envs=count)
    env.reset(seed=0)
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (50, count, 2))

    def run():
        for action in actions:
            env.step(action)

    benchmark.pedantic(run, rounds=10, warmup_rounds=1)
    benchmark.extra_info["steps_per_second"] = round(50 * count / benchmark.stats.stats.min)
    print(f"\n{count} corridors: {benchmark.extra_info['steps_per_second']} steps/s")
