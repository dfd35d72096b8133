"""The offline bench from start to end: segments, trials, tables, figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

from polite.analysis.offline import summarise_trials
from polite.experiments.offline.candidates import BASELINE, CANDIDATES, LADDER
from polite.experiments.offline.pools import PoolConfig, build_pools, load_pools
from polite.experiments.offline.trial import run_trial
from polite.experiments.run_folder import sole_run
from polite.experiments.runner import Report, Runner, Task, make_progress
from polite.files import write_json
from polite.methods.presets import preset_of
from polite.report.offline import BENCH, write_offline_report

FORMAT = 2
"""Of the results; a folder of another format is not gone on with."""
RESULTS = "results.json"


@dataclass(frozen=True)
class BenchPreset:
    """How large a bench is."""

    pools: tuple[PoolConfig, ...]
    """The envs and their segments."""
    names: tuple[str, ...]
    """Candidates that are compared at the main budgets."""
    budgets: tuple[int, ...]
    """Queries of the comparison of all candidates."""
    ladder: tuple[int, ...]
    """Further budgets, for the candidates in LADDER."""
    seeds: int
    """Trials of each candidate at each budget."""

    def budgets_of(self, name: str) -> tuple[int, ...]:
        """At which budgets a candidate is tried, in rising order."""
        return tuple(sorted({*self.budgets, *(self.ladder if name in LADDER else ())}))


BENCHES: Final = {
    "smoke": BenchPreset(
        pools=(
            PoolConfig("Walker2d-v5", 25_600, segments=100, held_out=50),
            PoolConfig("SocialCorridor-v0", 12_000, segments=100, held_out=50),
        ),
        names=(BASELINE, "paper", "choice"),
        budgets=(20,),
        ladder=(),
        seeds=2,
    ),
    "full": BenchPreset(
        pools=(
            PoolConfig("SocialCorridor-v0", 200_000),
            PoolConfig("Walker2d-v5", 1_000_000),
            PoolConfig("HalfCheetah-v5", 1_000_000),
        ),
        names=tuple(CANDIDATES),
        budgets=(50, 200),
        ladder=(100, 262, 400, 800),
        seeds=10,
    ),
}


def compare(preset_name: str, seed: int, out: Path, *, resume: bool) -> Path:
    """Compare the candidates on each env and write everything into a folder.

    Args:
        preset_name: a key of BENCHES.
        seed: everything random follows from it, the envs' segments included.
        out: the folder: results.json, report.html, figures/, and what the stages computed.
        resume: whether a folder that was begun may be gone on with.

    Returns:
        The report's path.

    Raises:
        PoliteError: if the folder cannot be used, or a worker process died.
    """
    bench = BENCHES[preset_name]
    with sole_run(out, {BENCH: FORMAT, "preset": preset_name, "seed": seed}, resume):
        results = {"preset": preset_name} | _results(bench, seed, out)
        write_json(out / RESULTS, results)
        return write_offline_report(out, results)


def _results(bench: BenchPreset, seed: int, out: Path) -> dict[str, Any]:
    """Run what is not done yet, and put the numbers together."""
    with make_progress() as progress, Runner(out, progress) as runner:
        pools = runner.run([_pool_task(config, seed, out) for config in bench.pools])
        trials = runner.run(
            [
                _trials_task(bench, config.env, name, seed, out)
                for config in bench.pools
                for name in bench.names
            ]
        )
    chosen = {name: CANDIDATES[name] for name in bench.names}
    ranked = {name: candidate.ranked for name, candidate in chosen.items()}
    return {
        "seed": seed,
        "simulated": True,
        "seeds": bench.seeds,
        "pools": [
            asdict(config) | {"mean_return": returns}
            for config, returns in zip(bench.pools, pools, strict=True)
        ],
        "candidates": {name: candidate.says for name, candidate in chosen.items()},
    } | summarise_trials([trial for part in trials for trial in part["trials"]], ranked)


def _pool_task(config: PoolConfig, seed: int, out: Path) -> Task:
    return Task(f"pool-{config.env}", f"{config.env}: segments", partial(_build, config, seed, out))


def _build(config: PoolConfig, seed: int, out: Path, report: Report) -> dict[str, Any]:
    return dict(build_pools(config, seed, out, report))


def _trials_task(bench: BenchPreset, env: str, name: str, seed: int, out: Path) -> Task:
    says = f"{env}: {name}"
    work = partial(_try, out, env, name, bench.budgets_of(name), bench.seeds, seed)
    return Task(f"trials-{env}-{name}", says, work)


def _try(
    out: Path,
    env: str,
    name: str,
    budgets: Sequence[int],
    seeds: int,
    seed: int,
    report: Report,
) -> dict[str, Any]:
    """All trials of one candidate in one env."""
    pools, preset = load_pools(out, env), preset_of(env)
    trials = []
    for queries in budgets:
        for trial in range(seeds):
            measures = run_trial(CANDIDATES[name], preset, pools, queries, seed * 1000 + trial)
            trials.append(
                {"env": env, "candidate": name, "queries": queries, "seed": trial} | measures
            )
            report(len(trials) / (len(budgets) * seeds))
    return {"trials": trials}
