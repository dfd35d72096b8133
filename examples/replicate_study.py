"""Replicate the user study with simulated participants, and read what came out."""

import json
import sys
from pathlib import Path

from polite.experiments.replicate import replicate

if __name__ == "__main__":
    preset, out = sys.argv[1:] or ("fast", "study")
    report = replicate(preset, seed=0, out=Path(out), resume=True)
    results = json.loads((report.parent / "results.json").read_text("utf-8"))
    for claim in results["claims"]:
        print(f"{claim['verdict']:>15}  {claim['text']}")
