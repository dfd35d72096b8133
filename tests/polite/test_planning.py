"""Planning: the textbook's numbers, the paper's design, and what a plan says in words."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic_records import synthetic_grid

from polite.analysis.benchmark_summary import summarise
from polite.analysis.planning import (
    accuracy_from_agreement,
    answers_for_shares,
    design_effect,
    minutes_each,
    plan_study,
    queries_for_accuracy,
    runs_for_effect,
    shares_power,
    t_test_power,
)
from polite.experiments.plan import run_plan
from polite.experiments.plan_config import PlanConfig
from polite.files import write_json
from polite.report.benchmark_words import reached_words
from polite.types import InvalidValueError, PoliteError


@pytest.mark.parametrize(
    ("effect", "count"), [(0.2, 394), (0.5, 64), (0.8, 26), (-0.8, 26), (1.0, 17)]
)
def test_group_sizes_of_cohens_tables(effect: float, count: int) -> None:
    # Cohen (1988), table 2.4.1: power .80, two-sided .05 (393 there, by his approximation)
    assert runs_for_effect(effect) == count
    assert t_test_power(effect, count) >= 0.8 > t_test_power(effect, count - 1)


def test_power_of_no_effect_is_the_significance() -> None:
    assert t_test_power(0.0, 10) == pytest.approx(0.05)
    assert t_test_power(0.0, 10, 0.01) == pytest.approx(0.01)
    assert t_test_power(50.0, 5) == pytest.approx(1.0)


def test_power_agrees_with_simulated_t_tests() -> None:
    rng = np.random.default_rng(0)
    x, y = rng.normal(size=(2, 4000, 5))
    gap = (x + 1.5).mean(axis=1) - y.mean(axis=1)
    error = np.sqrt((x.var(axis=1, ddof=1) + y.var(axis=1, ddof=1)) / 5)
    share = np.mean(np.abs(gap / error) > 2.306004)  # t(.975, 8)
    assert share == pytest.approx(t_test_power(1.5, 5), abs=0.03)


def test_shares_of_the_papers_design() -> None:
    # 16.5% against 7%: pooled .1175; (1.95996 · .45540 + .84162 · .45042)² / .095² = 179.2
    assert answers_for_shares(0.165, 0.07) == 180
    assert answers_for_shares(0.07, 0.165) == 180
    # 400 answers a condition, taken as independent: Φ((.095 · 20 − 1.95996 · .45540) / .45042)
    assert shares_power(0.165, 0.07, 400) == pytest.approx(0.9873, abs=1e-4)


def test_answers_of_the_same_people_are_worth_fewer() -> None:
    assert design_effect(20, 0.0) == 1.0
    assert design_effect(20, 0.05) == pytest.approx(1.95)
    assert design_effect(1, 0.7) == 1.0
    plan = plan_study(400, correlation=0.05, shares=(0.165, 0.07))
    assert plan.effective_queries == pytest.approx(400 / 1.95)
    assert plan.participants_for_power == 18  # 180 · 1.95 / 20 = 17.55
    assert plan.power == pytest.approx(shares_power(0.165, 0.07, 400 / 1.95))


def test_agreement_and_accuracy() -> None:
    assert accuracy_from_agreement(1.0) == 1.0
    assert accuracy_from_agreement(0.9**2 + 0.1**2) == pytest.approx(0.9)
    assert queries_for_accuracy(400, 0.9) == 400  # as good as the benchmark's teacher
    assert queries_for_accuracy(400, 0.7) == 1600  # half the margin, four times the queries
    assert queries_for_accuracy(400, 1.0) == 256


def test_the_papers_study_again() -> None:
    plan = plan_study(400)
    assert (plan.participants, plan.queries_per_participant) == (20, 20)
    assert plan.minutes_per_participant == pytest.approx(24.83)
    assert plan.hours == pytest.approx(20 * 24.83 / 60)
    assert minutes_each(20, highlights=False) == pytest.approx(18.93)
    assert minutes_each(40, highlights=True) == pytest.approx(49.66)
    assert plan_study(401).participants == 21
    assert (plan.power, plan.runs_per_cell) == (None, None)
    assert plan_study(400, effect=0.5).runs_per_cell == 64


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: plan_study(0), "queries ≥ 1"),
        (lambda: plan_study(10, queries_per_participant=0), "queries_per_participant ≥ 1"),
        (lambda: plan_study(10, agreement=0.5), r"agreement in \(.5, 1\]"),
        (lambda: plan_study(10, correlation=1.5), "intraclass correlation"),
        (lambda: plan_study(10, shares=(0.1, 0.1)), "two different shares"),
        (lambda: plan_study(10, shares=(0.0, 0.1)), "first in"),
        (lambda: plan_study(10, effect=0.0), "other than 0"),
        (lambda: plan_study(10, effect=1.0, power=1.0), "power in"),
        (lambda: plan_study(10, effect=1e-9), "larger effect"),
        (lambda: t_test_power(1.0, 1), "count ≥ 2"),
    ],
)
def test_impossible_plans_are_refused(call: object, message: str) -> None:
    assert callable(call)
    with pytest.raises(InvalidValueError, match=message):
        call()


@given(st.floats(0.05, 4.0), st.integers(2, 200))
def test_more_runs_give_more_power(effect: float, count: int) -> None:
    less, more = t_test_power(effect, count), t_test_power(effect, count + 1)
    assert 0.05 <= less <= more + 1e-9 <= 1.0 + 1e-6


def test_plan_in_words() -> None:
    text = run_plan(PlanConfig())
    for words in ("400 (as asked for)", "20, 20 answers each", "24.8", "8.3", "1.95", "205"):
        assert words in text
    noisy = run_plan(PlanConfig(agreement=0.58, method="preferences"))
    assert "1600 (as asked for, with the pilot's noise)" in noisy
    assert "18.9" in noisy


def found(rows: list[dict[str, Any]], **wanted: object) -> dict[str, Any]:
    """The row of POLITE on Walker2d under the pairwise loss."""
    wanted |= {"method": "polite", "env": "Walker2d-v5", "loss": "pairwise", "variant": ""}
    (row,) = (row for row in rows if all(row[name] == value for name, value in wanted.items()))
    return row


def test_plan_from_a_benchmark(tmp_path: Path) -> None:
    results = summarise(synthetic_grid(5))
    control = {"variant": "no-termination", "reached": "at", "queries": 1.0, "low": 1.0, "high": 1}
    rows = results["queries_to_reach"]
    results["queries_to_reach"] = [*({**row, **control} for row in rows), *rows]
    write_json(tmp_path / "results.json", results)
    text = run_plan(PlanConfig(benchmark=tmp_path, share=0.5))
    assert "on Walker2d-v5, pairwise loss, choice highlights" in text
    row = found(rows, highlights="choice", share=0.5)
    assert f"{row['queries']:.0f} (the benchmark's {reached_words(row)} on" in text
    assert reached_words(row).endswith("]")
    at_once = reached_words({**row, "reached": "at or before"})
    assert at_once.startswith("≤")
    with pytest.raises(InvalidValueError, match=r"did not reach 90% .* 400 queries, the most that"):
        run_plan(PlanConfig(benchmark=tmp_path, share=0.9))
    with pytest.raises(InvalidValueError, match="800 queries, the most that"):
        run_plan(PlanConfig(benchmark=tmp_path, share=0.9, method="preferences"))
    with pytest.raises(InvalidValueError, match="400 queries, the most that"):
        run_plan(PlanConfig(benchmark=tmp_path, share=0.5, highlights="paper", loss="released"))
    with pytest.raises(InvalidValueError, match="has HalfCheetah-v5, Walker2d-v5, got Ant-v5"):
        run_plan(PlanConfig(benchmark=tmp_path, env="Ant-v5"))
    for share in (6.0, 0.65):
        with pytest.raises(InvalidValueError, match=f"knows 0.5, .* 0.9, got {share:g}"):
            run_plan(PlanConfig(benchmark=tmp_path, share=share))
    with pytest.raises(PoliteError, match="polite benchmark"):
        run_plan(PlanConfig(benchmark=tmp_path / "nowhere"))


@pytest.mark.parametrize(
    "change", [{"env": "HalfCheetah-v5"}, {"share": 0.5}, {"loss": "released"}]
)
def test_a_curve_is_not_chosen_without_a_benchmark(change) -> None:
    with pytest.raises(InvalidValueError, match=f"{next(iter(change))}: only with --benchmark"):
        run_plan(PlanConfig(**change))
