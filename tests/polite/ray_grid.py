"""A grid on a Ray cluster of two nodes on this machine; one node is killed in mid-grid.

A program of its own (`python ray_grid.py FOLDER`), because Ray leaves threads and handlers behind.
Prints, as JSON, the name of the run that was on the node which was killed.
"""

from __future__ import annotations

import json
import os
import sys
import threading
from pathlib import Path
from typing import Any

from polite.experiments.benchmark.execution import run_grid
from polite.experiments.benchmark.grid import Run

POINT = "registered_envs:Point-v0"
LONG = 8192
RUNS = [
    Run(POINT, "ground-truth", 0, None, None, "smoke", LONG, seed=0),
    Run(POINT, "untrained", 0, None, None, "smoke", LONG, seed=0),
    Run(POINT, "ground-truth", 0, None, None, "smoke", 2048, seed=1),
]
"""The first two are long enough for both nodes to be at work when one of them is killed."""
NODE: dict[str, Any] = {
    "num_cpus": 1,
    "include_dashboard": False,
    "object_store_memory": 80_000_000,
}


def alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def kill_when_both_work(folder: Path, cluster: Any, node: Any, killed: list[str]) -> None:
    """Kill a node once two runs are being done, and note which of them was there."""
    working: dict[str, int] = {}
    while len(working) < 2:
        threading.Event().wait(0.02)
        for path in (folder / "live").glob("[!.]*.json"):
            working[path.stem] = json.loads(path.read_text("utf-8"))["process"]
    cluster.remove_node(node, allow_graceful=False)
    while all(map(alive, working.values())):
        threading.Event().wait(0.02)
    killed += [name for name, process in working.items() if not alive(process)]


def main() -> None:
    from ray.cluster_utils import Cluster

    from polite.experiments.benchmark.ray_engine import RayEngine

    folder, killed = Path(sys.argv[1]), list[str]()
    cluster = Cluster(initialize_head=True, head_node_args=NODE)
    try:
        node = cluster.add_node(**NODE)
        watcher = threading.Thread(
            target=kill_when_both_work, args=(folder, cluster, node, killed), daemon=True
        )
        with RayEngine(cluster.address) as engine:
            watcher.start()
            failures = run_grid(folder, RUNS, engine)
        watcher.join()
    finally:
        cluster.shutdown()
    print(json.dumps({"killed": killed, "failures": list(failures.values())}))


if __name__ == "__main__":
    main()
