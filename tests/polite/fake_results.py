"""A made-up results dictionary for tests of figures and page. No number in it was measured."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import imageio.v3 as iio
import numpy as np

from polite.analysis.answers import chi_square_part, times_part
from polite.analysis.claims import judge
from polite.analysis.divergence import kl_part
from polite.analysis.numbers import as_json
from polite.analysis.published import PUBLISHED
from polite.analysis.quality import policy_difference_part, sensitivity_row
from polite.analysis.reward_map import map_2d_part, profile, reward_map_part
from polite.files import write_json

SCENE: dict[str, Any] = {
    "half_length": 15.0,
    "half_width": 3.0,
    "intermittent": [0.0, -2.5],
    "goal": [0.0, 12.0],
    "goal_radius": 1.0,
    "intermittent_radius": 1.0,
    "people": [[1.0, -10.0], [-1.0, 5.0], [1.2, 8.0]],
    "anchor_jitter": 0.5,
}
CONDITIONS = {"polite": 1.0, "baseline": 0.35}
"""How strongly the made-up reward of each condition follows the scene."""
CURVES = {"polite": 1.25, "baseline": 1.05, "ground_truth": 1.6}
"""The final made-up return of each policy."""


def fake_results(seeds: int = 5) -> dict[str, Any]:
    """All keys that figures and page read, filled with synthetic numbers."""
    rng = np.random.default_rng(7)
    z = rng.uniform(-15, 15, 4000)
    x = rng.uniform(-2.7, 2.7, 4000)
    rewards = {name: _reward(x, z, gain, seeds, rng) for name, gain in CONDITIONS.items()}
    results: dict[str, Any] = {
        "version": "0.0.0-fake",
        "preset": "fake",
        "seed": 0,
        "seeds": list(range(seeds)),
        "simulated": True,
        "config": {"queries": 400, "reward": {"hidden": [32, 32], "epochs": 100}, "ppo": None},
        "scene": SCENE,
        "published": PUBLISHED,
        "participants": {"polite": 20, "baseline": 20},
        "calibrated": {
            "skip_rate_baseline": {"value": 0.165, "source": "66/400 in the paper"},
            "minutes_polite": {"value": {"mean": 24.83, "sd": 6.48}, "source": "the paper"},
        },
    }
    results |= _maps(x, z, rewards) | _answers(rng) | _policies(seeds, rng)
    results["kl"] = _kl(seeds, rng)
    results["claims"] = judge(results)
    return results


def write_fake_run(folder: Path, seeds: int = 5) -> Path:
    """A run's folder with `results.json` and two clips of coloured squares."""
    write_json(folder / "results.json", fake_results(seeds))
    (folder / "clips").mkdir()
    for name, hue in (("query_first", 0), ("query_second", 2)):
        frames = np.full((50, 96, 480, 3), 235, dtype=np.uint8)
        for step, frame in enumerate(frames):
            frame[40:56, 8 * step : 8 * step + 16] = 0
            frame[40:56, 8 * step : 8 * step + 16, hue] = 200
        iio.imwrite(folder / "clips" / f"{name}.gif", frames, duration=100, loop=0)
    return folder


def _reward(
    x: np.ndarray, z: np.ndarray, gain: float, seeds: int, rng: np.random.Generator
) -> np.ndarray:
    """(seeds, M) rewards with bumps at the goals and dents at the people."""
    bumps = [(0.0, -2.5, 0.9, 1.2), (0.0, 12.0, 1.4, 1.5)]
    dents = [(px, pz, -0.8, 1.0) for px, pz in SCENE["people"]]
    shape = sum(
        h * np.exp(-(((z - oz) / w) ** 2) / 2 - ((x - ox) / 2.0) ** 2 / 2)
        for ox, oz, h, w in bumps + dents
    )
    offset = rng.normal(0.0, 0.05, (seeds, 1))
    return np.tanh(gain * (shape + 0.01 * z) - 0.2 + offset + rng.normal(0, 0.2, (seeds, z.size)))


def _maps(x: np.ndarray, z: np.ndarray, rewards: dict[str, np.ndarray]) -> dict[str, Any]:
    edges = np.linspace(-15, 15, 61)
    near = np.linspace(-4, 4, 33)
    people = np.array(SCENE["people"])[:, 1]
    to_person = z[:, None] - people
    nearest = np.take_along_axis(to_person, np.abs(to_person).argmin(axis=1)[:, None], axis=1)[:, 0]
    goals = [np.hypot(x - gx, z - gz) for gx, gz in (SCENE["goal"], SCENE["intermittent"])]
    far = np.linspace(0, 26, 27)
    offsets = {
        "person_offset": nearest,
        "intermittent_offset": z - SCENE["intermittent"][1],
        "goal_offset": z - SCENE["goal"][1],
    }
    distances = {"goal_distance": goals[0], "nearest_goal_distance": np.minimum(*goals)}
    parts: dict[str, Any] = {
        "reward_map": {c: reward_map_part(z, r, edges) for c, r in rewards.items()},
        "reward_map_2d": {
            c: map_2d_part(x, z, r, np.linspace(-3, 3, 13), edges) for c, r in rewards.items()
        },
    }
    for name, offset in offsets.items():
        parts[name] = {c: profile(offset, r, near).as_json("offset") for c, r in rewards.items()}
    for name, distance in distances.items():
        parts[name] = {
            c: profile(distance, (r + 1) / 2, far).as_json("distance") for c, r in rewards.items()
        }
    return parts


def _kl(seeds: int, rng: np.random.Generator) -> dict[str, Any]:
    epochs = np.arange(0, 101, 5)
    growth = (epochs / 100)[None, :, None]
    gains = {"polite": 0.5, "baseline": 0.0, "other": 0.05, "shuffled": 0.15}
    rewards = {
        name: np.tanh(
            rng.normal(0, 0.2, (seeds, 1, 300))
            + growth * (gain + rng.normal(0, 0.05, (seeds, 1, 1)))
        )
        for name, gain in gains.items()
    }
    return kl_part(epochs, *rewards.values())


def _answers(rng: np.random.Generator) -> dict[str, Any]:
    skipped = {"polite": rng.binomial(20, 0.07, 20), "baseline": rng.binomial(20, 0.165, 20)}
    none = {name: int(counts.sum()) for name, counts in skipped.items()}
    counts = {
        name: {"answers": 400, "expressed": 400 - n, "no_preference": n, "positive": 0}
        | {"negative": 0}
        for name, n in none.items()
    }
    counts["polite"] |= {"positive": 231, "negative": 180}
    return {
        "counts": counts,
        "queries": {"polite": 400, "baseline": 400},
        "no_preference_rate": {name: n / 400 for name, n in none.items()},
        "chi_square": chi_square_part(skipped["polite"], skipped["baseline"], 20, rng),
        "times": times_part(rng.normal(24.8, 6.5, 20), rng.normal(18.9, 9.0, 20)),
        "example": {
            "query": 12,
            "preferred": 1,
            "positive": [12, 22],
            "negative": [31, 41],
            "fps": 10,
            "files": ["clips/query_first.gif", "clips/query_second.gif"],
            "strip": "",
        },
        "clip_policy": {
            "steps": 60_000,
            "why": "its clips show both goals and people",
            "success_rate": 0.42,
            "share_with_person": 0.55,
            "share_with_intermittent": 0.21,
            "share_with_goal": 0.18,
            "share_with_collision": 0.1,
        },
    }


def _policies(seeds: int, rng: np.random.Generator) -> dict[str, Any]:
    steps = np.linspace(0, 200_000, 21)
    actions = rng.normal(0, 0.1, (2, seeds, 200, 2)) + rng.normal(0, 0.1, (2, seeds, 1, 2))
    rates = {"success_rate": 0.8, "collision_rate": 0.1, "intermittent_rate": 0.6}
    metrics = {"path_length": 27.0, "stalled_time": 3.0, "spl": 0.8, "min_human_distance": 0.4}

    def draw(mean: float) -> list[float]:
        return as_json(mean * (1 + rng.normal(0, 0.06, seeds)))

    return {
        "policy": {
            name: {"seeds": list(range(seeds)), "return": draw(final)}
            | {rate: draw(value) for rate, value in rates.items()}
            | {"metrics": {metric: draw(value) for metric, value in metrics.items()}}
            for name, final in CURVES.items()
        },
        "curves": {name: _curve(steps, final, seeds, rng) for name, final in CURVES.items()},
        "policy_difference": policy_difference_part(*actions),
        "reward_quality": {
            name: {"pair_accuracy": draw(0.8), "correlation": draw(0.5)}
            for name in ("polite", "baseline", "null_shuffled")
        },
        "sensitivity": [
            sensitivity_row(
                "willingness to highlight",
                level,
                {"polite": draw(0.82), "baseline": draw(0.8)},
                {"polite": draw(0.5), "baseline": draw(0.45)},
                draw(0.6),
            )
            for level in ("half", "as calibrated", "double")
        ],
    }


def _curve(steps: np.ndarray, final: float, seeds: int, rng: np.random.Generator) -> dict[str, Any]:
    rise = 1 - np.exp(-steps / 60_000)
    noise = rng.normal(0, 0.08, (seeds, steps.size))
    return {
        "steps": as_json(steps),
        "return": as_json(final * rise - 0.5 + noise),
        "success_rate": as_json(np.clip(0.8 * rise + noise, 0, 1)),
        "collision_rate": as_json(np.clip(0.5 - 0.4 * rise + noise, 0, 1)),
    }
