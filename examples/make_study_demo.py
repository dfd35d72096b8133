"""Make the pool of the demo study: clips that differ, and pairs of them.

    python examples/make_study_demo.py              # that of the package, into assets/study_demo

The clips are those of the replication: a robot, trained part of the way, drives past people in the
corridor. `study.toml` beside the pool names clips by their numbers; look at it if they change.
"""

import argparse
from pathlib import Path

import numpy as np

from polite.dataset import Feedback, save_feedback
from polite.experiments.replication.config import preset
from polite.experiments.replication.stages import train_clip_policy
from polite.experiments.replication.study import Study
from polite.experiments.replication.world import FLAGS, collect_along, people_of
from polite.policies.policy import load_policy
from polite.samplers import uniform_pairs
from polite.segments import cut_segments
from polite.types import SegmentPool
from socialnav_env import CorridorConfig

LENGTH, PARTICIPANTS, COMPARISONS = 50, 4, 8
KINDS = {"collision": 8, "goal": 10, "near": 16}
"""How many clips of each kind are shown: somebody or a wall is hit, a goal is reached, a person is
close. Clips of a later kind are of none before it."""
APART = 6  # clips for guide and practice, which no comparison shows: two of each kind


def kinds_of(pool: SegmentPool) -> dict[str, np.ndarray]:
    """Which segments are of which kind, (S,) each; the last in order of their number."""
    world = CorridorConfig()
    flags = pool.states[..., FLAGS]
    collision = (pool.rewards < -0.5 * world.collision_penalty).any(axis=1)
    goal = (flags[:, -1] > flags[:, 0]).any(axis=1) & ~collision
    touching = world.robot_radius + world.human_radius + world.personal_space
    near = (people_of(pool.states)[1].min(axis=-1) < touching).any(axis=1)
    return {"collision": collision, "goal": goal, "near": near & ~collision & ~goal}


def choose(pool: SegmentPool) -> np.ndarray:
    """Segments to compare, all kinds mixed, and then those apart."""
    shown, apart = [], []
    for each, is_kind in zip(KINDS.values(), kinds_of(pool).values(), strict=True):
        numbers = np.flatnonzero(is_kind)
        shown.extend(numbers[:each])
        apart.extend(numbers[each : each + 2])
    return np.array([*np.sort(shown), *apart])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("assets/study_demo"))
    parser.add_argument("--work", type=Path, default=Path("runs/study_demo"), help="for the policy")
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args()
    study = Study(chosen.work, preset("fast"), chosen.seed)
    train_clip_policy(study, lambda share: None)
    policy = load_policy(chosen.work / "models" / "policy-clips.pt")
    rng = np.random.default_rng(chosen.seed)
    trajectories = collect_along(study.config, policy, rng)
    for clips in (1200, 4800):  # how often the policy hits differs with the processor's rounding
        pool = cut_segments(trajectories, LENGTH, clips, rng)
        found = {name: int(is_kind.sum()) for name, is_kind in kinds_of(pool).items()}
        if all(found[name] >= each + 2 for name, each in KINDS.items()):
            break
    else:
        raise SystemExit(f"expected {KINDS} clips and two more of each, found {found}; take more")
    few = SegmentPool.stack([pool[int(number)] for number in choose(pool)], LENGTH)
    compared = SegmentPool.stack([few[i] for i in range(len(few) - APART)], LENGTH)
    pairs = uniform_pairs(PARTICIPANTS * COMPARISONS, rng, compared)
    save_feedback(chosen.out / "pool", Feedback(few, pairs))
    print(f"{chosen.out}: {len(few)} clips, {len(pairs)} pairs; apart: {len(compared)} and on")


if __name__ == "__main__":
    main()
