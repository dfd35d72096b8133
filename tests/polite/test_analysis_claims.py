"""Verdicts: a rule must say yes, no and "cannot tell" where each is right."""

from __future__ import annotations

import copy
import json
from typing import Any

import numpy as np
import pytest
from fake_results import fake_results

from polite.analysis.claims import judge
from polite.analysis.claims_reward import (
    baseline_flatter,
    divergence_grows,
    goal_limits,
    goal_range,
    goal_slope,
    peaks_and_dips,
)
from polite.analysis.claims_study import policies_differ, policy_return
from polite.analysis.statistics import Estimate
from polite.analysis.verdicts import above, below, combine

SCENE = {"goal_radius": 1.0, "intermittent_radius": 1.0}
SEEDS = np.array([-0.02, -0.01, 0.0, 0.01, 0.02])[:, None]
"""A little difference between seeds."""


@pytest.fixture(scope="module")
def results() -> dict[str, Any]:
    return fake_results()


def verdict(claim: Any) -> str:
    return str(claim.as_json()["verdict"])


@pytest.mark.parametrize(
    ("low", "high", "over", "under"),
    [
        (0.1, 0.3, "reproduced", "not reproduced"),
        (-0.3, -0.1, "not reproduced", "reproduced"),
        (-0.1, 0.1, "undecided", "undecided"),
        (0.0, 0.2, "undecided", "undecided"),
        (-np.inf, np.inf, "undecided", "undecided"),
        (np.nan, np.nan, "undecided", "undecided"),
    ],
)
def test_an_interval_decides(low: float, high: float, over: str, under: str) -> None:
    estimate = Estimate((low + high) / 2 if np.isfinite(low) else 0.0, low, high)
    assert above("x", estimate, 0).verdict == over
    assert below("x", estimate, 0).verdict == under


def test_a_claim_needs_all_its_parts() -> None:
    assert combine(["reproduced", "reproduced"]) == "reproduced"
    assert combine(["reproduced", "undecided"]) == "undecided"
    assert combine(["undecided", "not reproduced"]) == "not reproduced"
    assert combine(["input", "input"]) == "input"


def _offsets(height: float) -> dict[str, Any]:
    offset = np.linspace(-4, 4, 33)
    curve = height * (np.abs(offset) <= 1.0)
    return {"polite": {"offset": offset.tolist(), "per_seed": (curve * (1 + SEEDS)).tolist()}}


@pytest.mark.parametrize(
    ("goal", "person", "expected"),
    [(0.5, -0.5, "reproduced"), (0.5, 0.5, "not reproduced"), (-0.5, -0.5, "not reproduced")],
)
def test_peaks_and_dips(goal: float, person: float, expected: str) -> None:
    parts = {"intermittent_offset": _offsets(goal), "goal_offset": _offsets(goal)}
    found = peaks_and_dips({"scene": SCENE, "person_offset": _offsets(person)} | parts)
    assert verdict(found) == expected
    assert found.parts[0].estimate.mean == pytest.approx(goal)


def test_a_ramp_is_no_peak() -> None:
    offset = np.linspace(-4, 4, 33)
    ramp = 0.1 * offset + SEEDS * np.linspace(1, -1, 33) ** 2
    part = {"polite": {"offset": offset.tolist(), "per_seed": ramp.tolist()}}
    names = ("intermittent_offset", "goal_offset", "person_offset")
    found = peaks_and_dips({"scene": SCENE} | dict.fromkeys(names, part))
    assert verdict(found) == "undecided"


def _maps(polite: float, baseline: float) -> dict[str, Any]:
    wave = np.sin(np.linspace(0, 6, 30))

    def part(height: float, seeds: Any) -> dict[str, Any]:
        rows = (wave * height * (1 + seeds)).tolist()
        return {"per_seed": rows, "standardised": {"per_seed": rows}}

    return {"reward_map": {"polite": part(polite, SEEDS), "baseline": part(baseline, -SEEDS)}}


@pytest.mark.parametrize(("baseline", "expected"), [(0.2, "reproduced"), (0.9, "not reproduced")])
def test_flatter_means_half_the_spread(baseline: float, expected: str) -> None:
    found = baseline_flatter(_maps(1.0, baseline))
    assert verdict(found) == expected
    assert found.parts[0].estimate.mean == pytest.approx(baseline)


def _distances(polite: np.ndarray, baseline: np.ndarray) -> dict[str, Any]:
    distance = np.linspace(0.5, 25.5, 26).tolist()
    rows = {"polite": polite + SEEDS, "baseline": baseline + SEEDS[::-1]}
    return {
        "scene": SCENE,
        "goal_distance": {
            c: {"distance": distance, "per_seed": r.tolist()} for c, r in rows.items()
        },
    }


def test_goal_distance_as_published() -> None:
    distance = np.linspace(0.5, 25.5, 26)
    steep, flat = 0.05 + 0.95 * np.exp(-distance / 3), np.full(26, 0.5)
    wobble = flat + np.linspace(-0.01, 0.01, 5)[:, None] * np.sin(distance)
    results = _distances(steep + wobble - flat, flat + 0 * wobble)
    assert [verdict(rule(results)) for rule in (goal_limits, goal_range, goal_slope)] == [
        "reproduced"
    ] * 3


def test_goal_distance_the_other_way_round() -> None:
    distance = np.linspace(0.5, 25.5, 26)
    wobble = np.linspace(-0.01, 0.01, 5)[:, None] * np.sin(distance)
    results = _distances(0.5 - 0.3 * np.exp(-distance / 3) + wobble, 1 - distance / 26)
    assert [verdict(rule(results)) for rule in (goal_limits, goal_range, goal_slope)] == [
        "not reproduced"
    ] * 3


def _kl(end: float, null: float) -> dict[str, Any]:
    rise = np.linspace(0, 1, 20) * (1 + SEEDS)
    jitter = 1 + np.array([0.03, -0.02, 0.0, 0.02, -0.03])[:, None]
    nulls = {name: (null * rise * jitter).tolist() for name in ("null_seed", "null_shuffled")}
    return {"kl": {"per_seed": (end * rise).tolist()} | nulls}


def test_divergence_must_exceed_its_nulls() -> None:
    assert verdict(divergence_grows(_kl(1.0, 0.2))) == "reproduced"
    assert verdict(divergence_grows(_kl(1.0, 1.0))) == "undecided"
    assert verdict(divergence_grows(_kl(1.0, 2.0))) == "not reproduced"


@pytest.mark.parametrize(
    ("gain", "expected"), [(1.0, "reproduced"), (0.0, "undecided"), (-1.0, "not reproduced")]
)
def test_policies_are_compared_by_welch(gain: float, expected: str) -> None:
    noise = np.array([-0.1, 0.0, 0.1, 0.05, -0.05])
    policy = {"polite": {"return": (noise + gain).tolist()}, "baseline": {"return": noise.tolist()}}
    assert verdict(policy_return({"policy": policy})) == expected
    difference = {"per_seed": (noise + gain).tolist(), "null_per_seed": noise.tolist()}
    assert verdict(policies_differ({"policy_difference": difference})) == expected


def test_inputs_are_never_judged(results: dict[str, Any]) -> None:
    inputs = [claim for claim in judge(results) if claim["kind"] == "input"]
    assert {claim["id"] for claim in inputs} == {"no-preference", "highlights", "time", "design"}
    assert all(claim["verdict"] == "input" for claim in inputs)
    others = [claim for claim in judge(results) if claim["kind"] != "input"]
    assert all(claim["verdict"] != "input" for claim in others)


def test_the_paper_s_arithmetic_holds(results: dict[str, Any]) -> None:
    arithmetic = [claim for claim in judge(results) if claim["kind"] == "arithmetic"]
    assert len(arithmetic) == 2
    assert all(claim["verdict"] == "reproduced" for claim in arithmetic)


def test_claims_are_json_with_unique_names(results: dict[str, Any]) -> None:
    claims = judge(results)
    json.dumps(claims, allow_nan=False)
    assert len({claim["id"] for claim in claims}) == len(claims)
    keys = {"id", "kind", "text", "published", "measured", "low", "high", "rule", "verdict"}
    assert all(keys <= claim.keys() for claim in claims)


def test_one_seed_decides_nothing_that_emerges() -> None:
    emergent = [c for c in judge(fake_results(seeds=1)) if c["kind"] == "emergent"]
    assert {claim["verdict"] for claim in emergent} == {"undecided"}


def test_judging_changes_nothing(results: dict[str, Any]) -> None:
    before = copy.deepcopy(results)
    judge(results)
    assert results == before
