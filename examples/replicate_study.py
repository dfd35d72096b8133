"""Replicate the user study with simulated participants, and read what came out.

    python examples/replicate_study.py fast study    # a few minutes

A study that was stopped goes on where it was.
"""

import argparse
import json
from pathlib import Path

from polite.experiments.replication.config import PRESETS
from polite.experiments.replication.replicate import replicate

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("preset", nargs="?", choices=PRESETS, default="fast", help="how large")
    parser.add_argument("out", nargs="?", type=Path, default="study", help="folder")
    given = parser.parse_args()
    report = replicate(given.preset, seed=0, out=given.out, resume=True)
    results = json.loads((report.parent / "results.json").read_text("utf-8"))
    for claim in results["claims"]:
        print(f"{claim['verdict']:>15}  {claim['text']}")
