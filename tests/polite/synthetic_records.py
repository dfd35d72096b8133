"""Made-up records of benchmark runs for tests of analysis, figures and page. None was measured."""

from __future__ import annotations

from typing import Any

import numpy as np

ENVS = {"Walker2d-v5": 1500.0, "HalfCheetah-v5": 5300.0}
"""The made-up return of a policy trained on the true reward."""
STEPS = 1_000_000


def synthetic_run(
    method: str,
    queries: int = 0,
    *,
    env: str = "Walker2d-v5",
    loss: str = "pairwise",
    form: str = "paper",
    preset: str = "fast",
    steps: int = STEPS,
    variant: str = "",
    seed: int = 0,
) -> dict[str, Any]:
    """The `run` of a record."""
    highlighted = method in ("polite", "highlights", "polite-pebble")
    return {
        "env": env,
        "method": method,
        "queries": queries,
        "loss": loss,
        "highlights": form if highlighted else None,
        "preset": preset,
        "steps": steps,
        "variant": variant,
        "seed": seed,
    }


def synthetic_record(run: dict[str, Any], final: float, *, quality: bool = True) -> dict[str, Any]:
    """A whole record that rises to a final return, the rest following from the seed."""
    rng = np.random.default_rng([run["seed"], run["queries"]])
    steps = np.arange(1, 51) * run["steps"] / 50
    rise = 1 - np.exp(-4 * steps / run["steps"])
    returns = final * rise / rise[-5:].mean() + 0.03 * abs(final) * rng.normal(size=50)
    returns[-5:] += final - returns[-5:].mean()  # the last tenth is the final return
    asked = run["queries"]
    learned = run["method"] not in ("ground-truth", "untrained") and quality
    return {
        "run": run,
        "curve": {
            "steps": steps.tolist(),
            "return": returns.tolist(),
            "length": [500.0] * 50,
            "episodes": [40] * 50,
        },
        "final_return": final,
        "evaluation": {"return": final * 1.1, "episodes": 20, "return_sd": 50.0},
        "answers": {
            "asked": asked,
            "no_preference": asked // 10,
            "positive": asked // 2 if run["highlights"] else 0,
            "negative": asked // 3 if run["highlights"] else 0,
            "label_accuracy": 0.9 if asked else None,
        },
        "quality": _quality(rng, final) if learned else None,
        "policy_steps": run["steps"],
        "collection_steps": asked * 250,
        "sessions": [20_000 * k for k in range(10)] if asked else [],
    }


def synthetic_grid(seeds: int = 5) -> list[dict[str, Any]]:
    """A grid as the benchmark's own, in which highlights help under the pairwise loss."""
    rng = np.random.default_rng(3)
    return [
        synthetic_record(run, float(_level(run) * ENVS[run["env"]] * (1 + 0.08 * rng.normal())))
        for run in synthetic_plan(seeds)
    ]


def synthetic_plan(seeds: int = 5) -> list[dict[str, Any]]:
    """The runs of that grid."""
    runs = []
    for env in ENVS:
        for seed in range(seeds):
            runs += [synthetic_run(m, env=env, seed=seed) for m in ("ground-truth", "untrained")]
            for loss in ("pairwise", "released"):
                place = {"env": env, "loss": loss, "seed": seed}
                runs += [synthetic_run("polite", q, **place) for q in (200, 400)]
                runs += [synthetic_run("preferences", q, **place) for q in (400, 800)]
            place = {"env": env, "seed": seed}
            runs += [synthetic_run("preferences", q, **place) for q in (262, 525)]
            runs += [synthetic_run("highlights", 400, form=f, **place) for f in ("paper", "choice")]
            runs += [synthetic_run("polite", q, form="choice", **place) for q in (100, 200, 400)]
            runs.append(synthetic_run("highlights", 200, form="choice", **place))
            runs.append(synthetic_run("polite", 200, form="choice", variant="shuffled", **place))
            noisy = {"form": "choice", "variant": "noisy", **place}
            runs += [synthetic_run(method, 200, **noisy) for method in ("highlights", "polite")]
            equal = {"variant": "equal-updates", **place}
            runs += [synthetic_run("preferences", q, **equal) for q in (262, 800)]
            few = {"variant": "few-epochs", **place}
            runs += [synthetic_run("preferences", q, **few) for q in (262, 800)]
            runs.append(synthetic_run("polite", 200, form="choice", **few))
            if seed < 3:
                runs += [synthetic_run("pebble", q, steps=STEPS // 4, **place) for q in (200, 400)]
        free = {"env": env, "variant": "no-termination"}
        for seed in range(min(seeds, 2)):
            runs.append(synthetic_run("polite", 200, seed=seed, **free))
            runs.append(synthetic_run("preferences", 800, seed=seed, **free))
    for seed in range(seeds):
        raised = {"env": "Walker2d-v5", "variant": "raised", "seed": seed}
        ours = {"form": "choice", **raised}
        runs += [synthetic_run(method, 200, **ours) for method in ("highlights", "polite")]
        runs += [synthetic_run("preferences", q, **raised) for q in (262, 800)]
        runs.append(synthetic_run("untrained", **raised))
    for seed in range(10, 10 + seeds):
        place = {"env": "Walker2d-v5", "seed": seed}
        runs.append(synthetic_run("polite", 200, form="choice", **place))
        runs.append(synthetic_run("preferences", 262, **place))
        place = {"env": "HalfCheetah-v5", "form": "choice", "seed": seed - 5}
        runs += [synthetic_run("polite", 200, variant=v, **place) for v in ("", "shuffled")]
    for seed in range(5, 5 + seeds):
        raised = {"env": "Walker2d-v5", "variant": "raised", "seed": seed}
        runs.append(synthetic_run("highlights", 200, form="choice", **raised))
        runs.append(synthetic_run("preferences", 262, **raised))
    return runs


def _level(run: dict[str, Any]) -> float:
    """Made-up final return as a share of the true reward's."""
    if run["method"] in ("ground-truth", "untrained"):
        return {"ground-truth": 1.0, "untrained": 0.08}[run["method"]]
    by_queries = 0.12 * np.log2(run["queries"] / 50)
    if run["method"] == "highlights":
        return float(0.5 * by_queries)
    gain = {"choice": 0.25, "paper": 0.02, None: 0.0}[run["highlights"]]
    gain *= run["variant"] != "shuffled"
    return float((by_queries + gain) * (0.6 if run["loss"] == "released" else 1.0))


def _quality(rng: np.random.Generator, final: float) -> dict[str, Any]:
    good = float(np.clip(0.6 + abs(final) / 2e4 + 0.02 * rng.normal(), 0, 1))
    stage = {"pair_accuracy": good, "pearson": good - 0.3, "spearman": good - 0.25}
    stage |= {"saturation": float(rng.uniform(0.1, 0.6))}
    reward = {"positive": 2.0, "negative": None, "all": 1.0}
    return {"early": stage, "late": stage, "highlighted_reward": reward}
