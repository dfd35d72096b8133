"""Train a small reward model on simulated answers, and draw where in the corridor it pays."""

import sys
from pathlib import Path

import polite
from polite.experiments.map import draw_map

if __name__ == "__main__":
    out = Path(sys.argv[1] if len(sys.argv) > 1 else "reward_map_example")
    steps = int(sys.argv[2]) if len(sys.argv) > 2 else 50_000
    polite.train(env="SocialCorridor-v0", method="polite", queries=100, steps=steps, out=out)
    print(draw_map(out / "models" / "reward.pt", out / "reward_map.png"))
