"""Train a small reward model on simulated answers, and draw where in the corridor it pays.

    python examples/draw_reward_map.py reward_map_example 50000

The training is short: the map shows the kind of picture, not the study's.
"""

import argparse
from pathlib import Path

import polite
from polite.experiments.map import draw_map

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", nargs="?", type=Path, default="reward_map_example", help="folder")
    parser.add_argument("steps", nargs="?", type=int, default=50_000, help="env steps of training")
    given = parser.parse_args()
    out = given.out
    polite.train(env="SocialCorridor-v0", method="polite", queries=100, steps=given.steps, out=out)
    print(draw_map(out / "models" / "reward.pt", out / "reward_map.png"))
