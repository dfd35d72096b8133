"""Compare the reference controllers over the scenarios: social metrics in tables and a figure.

    python examples/compare_scenarios.py --episodes 200 --out comparison

A policy of one's own joins the comparison if it has `predict(observation)` as stable-baselines3's.
"""

import argparse
from pathlib import Path

from matplotlib.figure import Figure

from socialnav_env import CorridorConfig
from socialnav_env.config import SCENARIOS
from socialnav_env.controllers import CONTROLLERS
from socialnav_env.evaluation import evaluate
from socialnav_env.wrappers import compare

SETTINGS = {
    **{name: {"scenario": name} for name in SCENARIOS},
    "unseen": {"scenario": "crowded", "robot_visible": False},
    "group": {"num_humans": 8, "walking": "group"},
    "queue": {"num_humans": 8, "walking": "queue"},
}
SHOWN = ["success", "collided", "intermittent", "timeout", "spl", "time_to_goal", "path_length",
         "min_human_distance", "personal_space_compliance", "jerk_mean", "return"]  # fmt: skip
DRAWN = {
    "success": "end goal reached",
    "collided": "episodes with a collision",
    "personal_space_compliance": "share of time with nobody\nin the personal space",
    "time_to_goal": "time to the goal [s]",
}
COLOURS = ("#999999", "#0072B2", "#E69F00")


def draw(tables) -> Figure:
    """For each of some metrics the means and 95% intervals of all controllers."""
    figure = Figure(figsize=(3.2 * len(DRAWN), 3.2), layout="constrained")
    for axes, (metric, label) in zip(figure.subplots(1, len(DRAWN)), DRAWN.items(), strict=True):
        for k, (controller, colour) in enumerate(zip(CONTROLLERS, COLOURS, strict=True)):
            for place, setting in enumerate(tables):
                row = tables[setting][controller][metric]
                axes.plot([row.low, row.high], [place + 0.2 * (k - 1)] * 2, color=colour)
                axes.plot(row.mean, place + 0.2 * (k - 1), "o", color=colour, markersize=4,
                          label=controller if place == 0 else None)  # fmt: skip
        axes.set(xlabel=label, yticks=range(len(tables)), yticklabels=list(tables))
        axes.invert_yaxis()
        axes.grid(axis="x", alpha=0.3)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def main(out: Path, episodes: int, names: list[str]) -> None:
    tables, count = {}, {"episodes": episodes, "num_envs": min(episodes, 50)}
    for name in names:
        config = CorridorConfig.from_keywords(**SETTINGS[name])
        tables[name] = {
            controller: evaluate(robot(config), **count, **SETTINGS[name])
            for controller, robot in CONTROLLERS.items()
        }
        print(f"## {name}\n\n{compare(tables[name], SHOWN)}\n", flush=True)
    out.mkdir(parents=True, exist_ok=True)
    text = "\n".join(f"## {name}\n\n{compare(tables[name], SHOWN)}\n" for name in tables)
    (out / "comparison.md").write_text(text, encoding="utf-8")
    draw(tables).savefig(out / "comparison.png", dpi=150)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--episodes", type=int, default=200, help="of each controller")
    parser.add_argument("--scenarios", nargs="+", choices=SETTINGS, default=[*SETTINGS])
    parser.add_argument("--out", type=Path, default=Path("comparison"), help="folder")
    given = parser.parse_args()
    main(given.out, given.episodes, given.scenarios)
