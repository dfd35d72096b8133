"""Steps per second of the single env against its peers and against bare pymunk, in one run."""

import os
import subprocess
import time
from pathlib import Path

import gymnasium as gym
import numpy as np
import pymunk
import pytest

from socialnav_env.config import CorridorConfig

STEPS, ROUNDS = 1000, 15
AGAINST_WALKER, AGAINST_PUSHT, AGAINST_PYMUNK = 5.0, 8.0, 3.0
ROOT = Path(__file__).parents[2]
PUSHT_PYTHON = Path(os.environ.get("PUSHT_PYTHON", ROOT / ".venv-pusht" / "bin" / "python"))


def actions_for(env):
    env.action_space.seed(0)
    return [env.action_space.sample() for _ in range(STEPS)]


def run_env(env, actions):
    start = time.perf_counter()
    env.reset(seed=0)
    for action in actions:
        _, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            env.reset()
    return time.perf_counter() - start


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
    start = time.perf_counter()
    for step in velocities:
        for body, velocity in zip(bodies, step, strict=True):
            body.velocity = velocity
        for _ in range(config.frame_skip):
            space.step(config.timestep)
        for body in bodies:
            body.position, body.velocity  # noqa: B018
    return time.perf_counter() - start


@pytest.fixture
def pusht():
    """A function that runs gym-pusht in its own Python and tells the seconds."""
    if not PUSHT_PYTHON.exists():
        pytest.skip(f"no Python with gym-pusht at {PUSHT_PYTHON}; `make bench` makes one")
    command = [str(PUSHT_PYTHON), str(Path(__file__).with_name("pusht_runner.py"))]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        assert process.stdout.readline() == "ready\n"

        def run():
            process.stdin.write(f"{STEPS}\n")
            process.stdin.flush()
            return float(process.stdout.readline())

        yield run
        process.stdin.close()


def test_steps_per_second_against_peers_and_bare_pymunk(benchmark, pusht, tmp_path, monkeypatch):
    pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)  # MuJoCo 4 writes MUJOCO_LOG.TXT where it runs
    corridor, walker = gym.make("SocialCorridor-v0"), gym.make("Walker2d-v5")
    velocities = np.random.default_rng(0).uniform(-1.0, 1.0, (STEPS, 4, 2)).tolist()
    bare = bare_corridor()
    actions, others = actions_for(corridor), actions_for(walker)
    contestants = {
        "corridor": lambda: run_env(corridor, actions),
        "walker": lambda: run_env(walker, others),
        "pymunk": lambda: run_bare(*bare, velocities),
        "pusht": pusht,
    }
    benchmark.pedantic(contestants["corridor"], rounds=5, warmup_rounds=1)
    # In turns, so that a busy moment of the machine hits all of them.
    best = dict.fromkeys(contestants, float("inf"))
    for _ in range(ROUNDS):
        for name, run in contestants.items():
            best[name] = min(best[name], run() / STEPS)
    per_second = {name: round(1.0 / seconds) for name, seconds in best.items()}
    ratios = {
        "times_walker2d": best["walker"] / best["corridor"],
        "times_pusht": best["pusht"] / best["corridor"],
        "time_of_bare_pymunk": best["corridor"] / best["pymunk"],
    }
    benchmark.extra_info.update(per_second | ratios)
    print(f"\nsteps/s: {per_second}; {ratios}")
    assert ratios["times_walker2d"] >= AGAINST_WALKER
    assert ratios["times_pusht"] >= AGAINST_PUSHT
    assert ratios["time_of_bare_pymunk"] <= AGAINST_PYMUNK
