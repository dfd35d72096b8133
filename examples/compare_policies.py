"""Social metrics of a replication's policies beside the reference controllers.

    polite replicate --preset fast --out runs/study
    python examples/compare_policies.py runs/study --episodes 200 --out comparison

The corridor is the study's: anchors nearly fixed, episodes end at the goal or after 600 steps, and
go on after a collision. Policies of one kind but another seed are rows of their own.
"""

import argparse
import json
from pathlib import Path

from polite.files import write_atomically
from polite.policies.policy import load_policy
from socialnav_env import CorridorConfig
from socialnav_env.controllers import CONTROLLERS
from socialnav_env.evaluation import evaluate
from socialnav_env.wrappers import compare

KINDS = {
    "ground_truth": "PPO, true reward",
    "polite": "PPO, POLITE's reward",
    "baseline": "PPO, baseline's reward",
}
SHOWN = ["success", "collided", "intermittent", "timeout", "spl", "time_to_goal", "stalled_time",
         "min_human_distance", "personal_space_compliance", "min_time_to_collision", "speed_mean",
         "jerk_mean", "path_irregularity", "return"]  # fmt: skip


def main(run: Path, episodes: int, out: Path) -> None:
    results = run / "results.json"
    if not results.is_file() or not any((run / "models").glob("policy-*.pt")):
        raise ValueError(f"{run}: expected the folder of a finished `polite replicate`, "
                         "with results.json and models/policy-*.pt")  # fmt: skip
    config = json.loads(results.read_text(encoding="utf-8"))["config"]
    scene = {"anchor_jitter": config["anchor_jitter"], "terminate_on_collision": False}
    corridor = CorridorConfig(**scene)
    policies = {name: robot(corridor) for name, robot in CONTROLLERS.items()}
    for kind, title in KINDS.items():
        for path in sorted((run / "models").glob(f"policy-{kind}-*.pt")):
            policies[f"{title} {path.stem.rsplit('-', 1)[1]}"] = load_policy(path)
    tables = {}
    for name, policy in policies.items():
        tables[name] = evaluate(policy, episodes=episodes, **scene)
        print(f"{name}: success {tables[name]['success'].mean:.2f}", flush=True)
    out.mkdir(parents=True, exist_ok=True)
    count = tables["straight"]["success"].n
    text = f"{count} episodes each; mean and 95% interval.\n\n{compare(tables, SHOWN)}\n"
    write_atomically(out / "policies.md", lambda path: path.write_text(text, encoding="utf-8"))
    print(f"\n{out / 'policies.md'}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path, help="folder of a finished `polite replicate`")
    parser.add_argument("--episodes", type=int, default=200,
                        help="of each policy; rounded up to a multiple of 50")  # fmt: skip
    parser.add_argument("--out", type=Path, default=Path("comparison"), help="folder")
    given = parser.parse_args()
    try:
        main(given.run, given.episodes, given.out)
    except ValueError as error:
        parser.error(str(error))
