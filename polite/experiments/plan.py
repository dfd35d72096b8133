"""A study's plan as a table of text, from settings or from a benchmark's results."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from polite.analysis.benchmark_summary import TARGETS
from polite.analysis.planning import StudyPlan, plan_study
from polite.experiments.plan_config import PlanConfig
from polite.files import read_json_object
from polite.report.benchmark_words import reached_words
from polite.types import InvalidValueError


def run_plan(config: PlanConfig) -> str:
    """The plan as lines of text.

    Raises:
        PoliteError: a setting is out of its range, the benchmark cannot be read, or it does not
            know how many queries reach the share.
    """
    queries, source = config.queries, "as asked for"
    if config.benchmark is not None:
        queries, source = _queries_of(config, config.benchmark)
    else:
        _check_heard(config)
    plan = plan_study(
        queries,
        highlights=config.method == "polite",
        queries_per_participant=config.queries_per_participant,
        agreement=config.agreement,
        correlation=config.correlation,
        shares=config.shares,
        effect=config.effect,
        power=config.power,
    )
    rows = _rows(plan, config, source)
    width = max(len(name) for name, _ in rows)
    return "\n".join(f"{name:<{width}}  {value}" for name, value in rows)


def _rows(plan: StudyPlan, config: PlanConfig, source: str) -> list[tuple[str, str]]:
    noise = source if config.agreement is None else f"{source}, with the pilot's noise"
    first, second = config.shares
    return [
        ("answers in each condition", f"{plan.queries} ({noise})"),
        (
            "participants in each condition",
            f"{plan.participants}, {plan.queries_per_participant} answers each",
        ),
        ("minutes a participant", f"{plan.minutes_per_participant:.1f} (the paper's, scaled)"),
        ("hours of people in each condition", f"{plan.hours:.1f}"),
        (
            "design effect of shared participants",
            f"{plan.design_effect:.2f} (intraclass correlation {config.correlation:g}): as good as "
            f"{plan.effective_queries:.0f} independent answers",
        ),
        (f"power to tell {first:g} from {second:g}", f"{plan.power:.2f}"),
        (
            f"participants for a power of {config.power:g}",
            f"{plan.participants_for_power} in each condition",
        ),
        (
            f"training runs to see {config.effect:g} sd",
            f"{plan.runs_per_cell} in each condition, at a power of {config.power:g}",
        ),
    ]


def _check_heard(config: PlanConfig) -> None:
    """What says which curve of a benchmark to read would go unheard without one."""
    for name in ("env", "loss", "highlights", "share"):
        if getattr(config, name) != getattr(PlanConfig(), name):
            raise InvalidValueError(f"{name}: only with --benchmark, whose curve it chooses")


def _queries_of(config: PlanConfig, folder: Path) -> tuple[int, str]:
    path = folder / "results.json"
    results = read_json_object(path, "run `polite benchmark` first")
    if config.share not in TARGETS:
        known = ", ".join(f"{share:g}" for share in TARGETS)
        raise InvalidValueError(f"share: a benchmark knows {known}, got {config.share}")
    envs = results.get("envs", [])
    if envs and config.env not in envs:
        raise InvalidValueError(f"env: {path} has {', '.join(envs)}, got {config.env}")
    fitting = [row for row in results.get("queries_to_reach", []) if _fits(row, config)]
    if not fitting:
        raise InvalidValueError(
            f"{path}: expected {config.method} on {config.env} with its queries to reach "
            f"{config.share:.0%} of the true reward's return, found none; choose another "
            "method, loss or form of highlights, or give --queries"
        )
    (row,) = fitting
    if row["reached"] == "not reached":
        raise InvalidValueError(
            f"{path}: {config.method} did not reach {config.share:.0%} of the true reward's return "
            f"on {config.env} with {row['queries']:.0f} queries, the most that were tried; ask for "
            "a smaller --share"
        )
    form = f", {row['highlights']} highlights" if row["highlights"] else ""
    found = f"the benchmark's {reached_words(row)} on {config.env}, {row['loss']} loss{form}"
    return round(row["queries"]), found


def _fits(row: Mapping[str, Any], config: PlanConfig) -> bool:
    """Whether a row is about what was asked for, in the env itself and not in a variant of it."""
    form = config.highlights if config.method == "polite" else None
    wanted = (config.env, config.method, config.share, config.loss, form, "")
    names = ("env", "method", "share", "loss", "highlights", "variant")
    return tuple(row[name] for name in names) == wanted
