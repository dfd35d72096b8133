"""The benchmark's claims on synthetic records: each rule says yes, no and "cannot tell"."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from synthetic_records import (
    STEPS,
    synthetic_grid,
    synthetic_plan,
    synthetic_record,
    synthetic_run,
)

from polite.analysis.benchmark_records import Grid, cell_of
from polite.analysis.benchmark_summary import summarise
from polite.analysis.claims_benchmark import RULES, judge_grid
from polite.analysis.verdicts import above, at_least, between, combine, shown
from polite.experiments.benchmark.grid import GRIDS, planned
from polite.types import InvalidValueError

Records = list[dict[str, Any]]


def cells(
    levels: dict[tuple[str, int], float], seeds: int = 5, spread: float = 10.0, **where: Any
) -> Records:
    """Records around a mean for each method and budget, ± spread, the same spread for each."""
    offsets = spread * np.linspace(-1, 1, seeds) if seeds > 1 else [0.0]
    return [
        synthetic_record(synthetic_run(method, queries, seed=k, **where), mean + float(offset))
        for (method, queries), mean in levels.items()
        for k, offset in enumerate(offsets)
    ]


def judge_benchmark(records: Records, planned: Records | None = None) -> Records:
    return judge_grid(Grid(records, planned or []))


def verdict(records: Records, identifier: str) -> dict[str, Any]:
    found = [claim for claim in judge_benchmark(records) if claim["id"] == identifier]
    assert len(found) == 1
    return found[0]


P200, P400, B800 = ("polite", 200), ("polite", 400), ("preferences", 800)
B262, B400, B525 = ("preferences", 262), ("preferences", 400), ("preferences", 525)
CONTROL_LABELS = (
    "POLITE-200, shuffled",
    "baseline-800, equal-updates",
    "baseline-262, equal-updates",
)


@pytest.mark.parametrize(
    ("polite", "expected"),
    [(900.0, "reproduced"), (600.0, "not reproduced"), (702.0, "undecided")],
)
def test_fewer_queries(polite: float, expected: str) -> None:
    claim = verdict(cells({P200: polite, B800: 700.0}), "walker2d-fewer-queries")
    assert claim["verdict"] == expected
    assert claim["measured"] == pytest.approx(polite - 700)
    assert claim["missing"] == []


@pytest.mark.parametrize(
    ("more", "expected"),
    [(900.0, "reproduced"), (500.0, "not reproduced"), (702.0, "undecided")],
)
def test_more_answers_help_the_baseline(more: float, expected: str) -> None:
    assert verdict(cells({B262: 700.0, B800: more}), "more-answers")["verdict"] == expected


@pytest.mark.parametrize(
    ("polite", "expected"),
    [(1330.0, "reproduced"), (900.0, "not reproduced"), (1900.0, "not reproduced")],
)
def test_nearly_double(polite: float, expected: str) -> None:
    claim = verdict(cells({P400: polite, B800: 700.0}), "walker2d-nearly-double")
    assert claim["verdict"] == expected


def test_nearly_double_is_undecided_across_a_bound_and_below_zero() -> None:
    wide = cells({P400: 1120.0, B800: 700.0}, spread=100.0)
    assert verdict(wide, "walker2d-nearly-double")["verdict"] == "undecided"
    below = verdict(cells({P400: 1120.0, B800: -700.0}), "walker2d-nearly-double")
    assert (below["verdict"], below["measured"]) == ("undecided", None)


@pytest.mark.parametrize(
    ("polite", "expected"), [(980.0, "reproduced"), (700.0, "not reproduced"), (902.0, "undecided")]
)
def test_near_the_baseline_with_fewer_queries(polite: float, expected: str) -> None:
    records = cells({P200: polite, B800: 1000.0}, env="HalfCheetah-v5")
    assert verdict(records, "halfcheetah-near")["verdict"] == expected


def test_pebble_is_compared_at_its_own_steps() -> None:
    records = cells({B400: 1000.0, P200: 1000.0})
    records += cells({("pebble", 400): 700.0}, seeds=3, steps=STEPS // 4)
    # At a quarter of its training the made-up baseline stands at about 64% of its end.
    claim = verdict(records, "walker2d-pebble-baseline")
    assert claim["verdict"] == "reproduced"
    assert claim["highlights"] is None
    assert 0 < claim["measured"] < 150
    assert verdict(records, "walker2d-polite-pebble")["verdict"] == "not reproduced"


def test_above_both_fails_when_one_fails() -> None:
    env = {"env": "HalfCheetah-v5"}
    records = cells({P400: 1000.0, B400: 900.0, ("pebble", 400): 1100.0}, **env)
    claim = verdict(records, "halfcheetah-above-both")
    assert [part["verdict"] for part in claim["parts"]] == ["reproduced", "not reproduced"]
    assert claim["verdict"] == "not reproduced"


def test_faster_convergence_reads_area_and_steps() -> None:
    claim = verdict(cells({P400: 2000.0, B400: 1000.0}), "H2")
    assert claim["verdict"] == "reproduced"
    assert claim["parts"][0]["measured"] > 0 > claim["parts"][1]["measured"]
    assert verdict(cells({P400: 1000.0, B400: 2000.0}), "H2")["verdict"] == "not reproduced"


def test_a_run_that_never_converges_leaves_its_side_open() -> None:
    slow = cells({P400: 1000.0, B400: 1001.0}, spread=5.0)
    low = {"steps": [STEPS], "return": [10.0], "episodes": [1]}
    slow[0] = slow[0] | {"curve": low}  # the first POLITE run
    steps = verdict(slow, "H2")["parts"][1]
    assert steps["high"] is None
    assert steps["low"] is not None
    assert steps["verdict"] == "undecided"
    lucky = cells({P400: 1000.0, B400: 1001.0}, spread=5.0)
    spike = dict(lucky[0]["curve"], **{"return": [0.0] * 9 + [1001.0] + [0.0] * 39 + [1001.0]})
    lucky[0] = lucky[0] | {"curve": spike}
    assert verdict(lucky, "H2")["parts"][1]["high"] is None  # one stretch is no convergence
    lone = cells({P400: 2000.0, B400: -5.0})
    assert verdict(lone, "H2")["parts"][1]["verdict"] == "undecided"  # 80% of a loss is no target


def test_synergy_is_the_contrast_of_four_cells() -> None:
    levels = {P400: 1000.0, B400: 500.0, ("highlights", 400): 300.0, ("untrained", 0): 100.0}
    claim = verdict(cells(levels), "fig4c")
    assert (claim["verdict"], claim["measured"]) == ("reproduced", pytest.approx(300.0))
    assert [part["measured"] for part in claim["parts"]] == pytest.approx([300.0, 500.0, 200.0])
    assert [part["verdict"] for part in claim["parts"][1:]] == ["shown", "shown"]
    levels[("highlights", 400)] = 900.0
    assert verdict(cells(levels), "fig4c")["verdict"] == "not reproduced"


def test_equal_effort_and_our_bar() -> None:
    levels = {P200: 800.0, P400: 900.0, B262: 700.0, B525: 950.0, B800: 790.0}
    records = cells(levels, form="choice")
    assert verdict(records, "equal-effort-200")["verdict"] == "reproduced"
    assert verdict(records, "equal-effort-400")["verdict"] == "not reproduced"
    assert verdict(records, "bar-fewer-queries")["verdict"] == "reproduced"
    assert verdict(records, "bar-equal-effort")["verdict"] == "reproduced"
    levels[B800] = 830.0  # clearly above, but POLITE keeps more than 90% of it
    assert verdict(cells(levels, form="choice"), "bar-fewer-queries")["verdict"] == "not reproduced"


@pytest.mark.parametrize(
    ("claimed", "ours", "other", "names"),
    [
        ("half-effort", ("polite", 100), B262, ("POLITE-100", "baseline-262")),
        (
            "highlights-for-preferences",
            ("highlights", 400),
            ("preferences", 400),
            ("highlights-400", "baseline-400"),
        ),
    ],
)
@pytest.mark.parametrize(
    ("level", "expected"),
    [(720.0, "reproduced"), (690.0, "undecided"), (600.0, "not reproduced")],
)
def test_no_worse_is_asked_of_our_form_only(
    claimed: str,
    ours: tuple[str, int],
    other: tuple[str, int],
    names: tuple[str, str],
    level: float,
    expected: str,
) -> None:
    levels = {ours: level, other: 700.0}
    claim = verdict(cells(levels, form="choice"), claimed)
    assert claim["verdict"] == expected
    assert [part["what"] for part in claim["parts"]] == [" minus ".join(names), " / ".join(names)]
    others = judge_benchmark(cells(levels, form="paper"))
    assert claimed not in {claim["id"] for claim in others}


def test_highlights_alone_with_200_queries() -> None:
    ours: dict[str, Any] = {"form": "choice"}
    levels = {("highlights", 200): 800.0, P200: 700.0, B262: 600.0, B800: 830.0}
    records = cells(levels, **ours) + cells({("highlights", 200): 500.0}, variant="noisy", **ours)
    expected = {
        "alone-fewer-queries": ("not reproduced", -30.0),
        "alone-equal-effort": ("reproduced", 200.0),
        "alone-or-both": ("reproduced", 100.0),
        "alone-noisy": ("not reproduced", -100.0),
    }
    for name, (judged, gap) in expected.items():
        claim = verdict(records, name)
        assert claim["verdict"] == judged
        assert claim["parts"][0]["measured"] == pytest.approx(gap)
    assert not any(c["id"].startswith("alone-") for c in judge_benchmark(cells(levels)))


def test_our_bar_is_about_our_form_under_the_pairwise_loss_alone() -> None:
    levels = {P200: 800.0, B262: 700.0, B800: 790.0}
    ours: dict[str, Any] = {"form": "choice"}
    for where in (
        {"form": "paper"},
        ours | {"loss": "released"},
        ours | {"variant": "no-termination"},
    ):
        assert not any(c["id"].startswith("bar-") for c in judge_benchmark(cells(levels, **where)))


def with_controls(
    shuffled: float, baseline_800: float, baseline_262: float, **where: Any
) -> Records:
    """POLITE-200 at 800 in our form, with its controls."""
    ours: dict[str, Any] = {"form": "choice", **where}
    equal = {B800: baseline_800, B262: baseline_262}
    return [
        *cells({P200: 800.0, B800: 500.0, B262: 700.0}, **ours),
        *cells({P200: shuffled}, variant="shuffled", **ours),
        *cells(equal, variant="equal-updates", **where),
    ]


@pytest.mark.parametrize(
    ("levels", "expected"),
    [
        ((700.0, 790.0, 700.0), ["reproduced"] * 3),
        ((900.0, 830.0, 900.0), ["not reproduced"] * 3),
        ((802.0, 810.0, 795.0), ["undecided"] * 3),
        ((700.0, 790.0, 900.0), ["reproduced", "reproduced", "not reproduced"]),
    ],
)
def test_the_controls_of_the_bar(levels: tuple[float, float, float], expected: list[str]) -> None:
    records = with_controls(*levels)
    controls = ("control-shuffled", "control-fewer-queries", "control-equal-effort")
    claims = [verdict(records, identifier) for identifier in controls]
    assert [claim["verdict"] for claim in claims] == expected
    for claim, level, name in zip(claims, levels, CONTROL_LABELS, strict=True):
        assert claim["parts"][0]["measured"] == pytest.approx(800 - level)
        assert claim["parts"][0]["what"] == f"POLITE-200 minus {name}"
        assert (claim["kind"], claim["variant"], claim["missing"]) == ("comparison", "", [])


def test_what_is_raised_is_judged_against_what_is_raised_and_against_itself() -> None:
    alone = ("highlights", 200)
    records = cells({alone: 900.0, P200: 700.0, B262: 800.0, B800: 1000.0}, form="choice")
    raised = {alone: 2000.0, P200: 1500.0, B262: 1700.0, B800: 2600.0}
    records += cells(raised, variant="raised", form="choice")
    claims = {(c["id"], c["variant"]): c["parts"][0]["measured"] for c in judge_benchmark(records)}
    told = {
        ("alone-fewer-queries", ""): -100.0,
        ("alone-fewer-queries", "raised"): -600.0,
        ("alone-equal-effort", "raised"): 300.0,
        ("alone-or-both", "raised"): 500.0,
        ("bar-fewer-queries", "raised"): -1100.0,
        ("bar-equal-effort", "raised"): -200.0,
        ("alone-raised", ""): 1100.0,
    }
    assert {key: claims[key] for key in told} == pytest.approx(told)
    assert ("alone-raised", "raised") not in claims and ("alone-noisy", "raised") not in claims
    later = {c["id"]: c["rule"] for c in judge_benchmark(records) if c["variant"] == "raised"}
    assert all("For 'raised' written before any run under it" in rule for rule in later.values())


def test_a_raised_random_reward_is_the_floor_of_what_is_raised_and_of_nothing_else() -> None:
    where = {"form": "choice", "variant": "raised"}
    alone, floor, ceiling = ("highlights", 200), ("untrained", 0), ("ground-truth", 0)
    records = cells({floor: 100.0, ceiling: 4100.0, alone: 1100.0}, form="choice")

    def told() -> dict[tuple[str, str], float]:
        parts = summarise(records)["comparisons"]
        return {(p["variant"], p["second"]): p["difference"]["mean"] for p in parts}

    records += cells({alone: 2100.0}, **where)
    assert told()["", "untrained reward"] == pytest.approx(1000.0)
    assert ("raised", "untrained reward") not in told()
    records += cells({floor: 900.0}, **where)
    assert told()["raised", "untrained reward"] == pytest.approx(1200.0)
    assert told()["", "untrained reward"] == pytest.approx(1000.0)
    scores = {
        (c["variant"], c["method"]): c["normalised"]["mean"] for c in summarise(records)["cells"]
    }
    assert scores["raised", "highlights"] == pytest.approx(0.5)  # of the plain ends
    assert scores["", "highlights"] == pytest.approx(0.25)


def test_the_bar_is_judged_with_few_epochs_too_and_controls_are_not() -> None:
    ours: dict[str, Any] = {"form": "choice"}
    records = cells({P200: 700.0, B262: 400.0, B800: 500.0}, **ours)
    records += cells({P200: 600.0}, variant="shuffled", **ours)
    records += cells({P200: 800.0, B262: 600.0, B800: 850.0}, variant="few-epochs", **ours)
    claims = judge_benchmark(records)
    bars = {
        (claim["id"], claim["variant"]): (claim["verdict"], claim["parts"][0]["measured"])
        for claim in claims
        if claim["id"].startswith("bar-")
    }
    assert bars == {
        ("bar-fewer-queries", ""): ("reproduced", pytest.approx(200.0)),
        ("bar-equal-effort", ""): ("reproduced", pytest.approx(300.0)),
        ("bar-fewer-queries", "few-epochs"): ("not reproduced", pytest.approx(-50.0)),
        ("bar-equal-effort", "few-epochs"): ("reproduced", pytest.approx(200.0)),
    }
    few = verdict(records, "control-few-epochs")
    assert few["verdict"] == "reproduced"
    assert [part["measured"] for part in few["parts"]] == pytest.approx([100.0, 350.0, 200.0])
    controls = [claim for claim in claims if claim["id"].startswith("control-")]
    assert {claim["variant"] for claim in controls} == {""}


def test_a_control_is_no_cell_of_the_plain_comparisons_and_the_other_way_round() -> None:
    records = with_controls(700.0, 790.0, 900.0)
    assert verdict(records, "bar-fewer-queries")["measured"] == pytest.approx(300)
    assert verdict(records, "bar-equal-effort")["measured"] == pytest.approx(100)
    variants = {(c["id"] == "more-answers", c["variant"]) for c in judge_benchmark(records)}
    assert variants == {(False, ""), (True, ""), (True, "equal-updates")}  # among themselves
    # The controls are about our form under the pairwise loss alone, and need their own runs.
    others = with_controls(700.0, 790.0, 900.0, loss="released")
    plain = [r for r in records if not r["run"]["variant"]]
    for some in (others, plain):
        assert not any(c["id"].startswith("control-") for c in judge_benchmark(some))
    plan = [r["run"] for r in records]
    missing = {
        claim["id"]: claim["missing"]
        for claim in judge_benchmark(plain, plan)
        if claim["id"].startswith("control-")
    }
    assert list(missing.values()) == [[f"{name}: 0 of 5 runs"] for name in CONTROL_LABELS]


def test_controls_are_compared_in_pairs_and_scored_by_the_plain_env() -> None:
    records = with_controls(700.0, 790.0, 900.0)
    records += cells({("untrained", 0): 0.0, ("ground-truth", 0): 1000.0})
    results = summarise(records)
    found = {
        (row["first"], row["second"]): row["difference"]["mean"]
        for row in results["comparisons"]
        if "," in row["first"] + row["second"]
    }
    shuffled, most, fewer = CONTROL_LABELS
    assert found == pytest.approx(
        {
            ("POLITE-200", shuffled): 100.0,
            ("POLITE-200", most): 10.0,
            ("POLITE-200", fewer): -100.0,
            (most, "baseline-800"): 290.0,
            (fewer, "baseline-262"): 200.0,
        }
    )
    within = {
        (row["first"], row["second"]): row["difference"]["mean"]
        for row in results["comparisons"]
        if row["variant"] == "equal-updates"
    }
    assert within == pytest.approx({("baseline-800", "baseline-262"): -110.0})
    scored = {
        (cell["label"], cell["variant"]): cell["normalised"]["mean"]
        for cell in results["cells"]
        if cell["variant"]
    }
    assert scored == pytest.approx(
        {
            ("POLITE-200", "shuffled"): 0.7,
            ("baseline-800", "equal-updates"): 0.79,
            ("baseline-262", "equal-updates"): 0.9,
        }
    )
    free = summarise(records + cells({P200: 700.0}, variant="no-termination"))["cells"]
    (other,) = (cell for cell in free if cell["variant"] == "no-termination")
    assert other["normalised"]["mean"] is None  # that env has a ceiling of its own


def test_our_bar_is_about_our_form_without_a_variant_under_the_pairwise_loss() -> None:
    levels = {P200: 800.0, B800: 500.0, B262: 700.0}
    records = cells(levels, form="choice")
    bars = [c for c in judge_benchmark(records) if c["id"].startswith("bar-")]
    assert {(c["id"], c["verdict"]) for c in bars} >= {
        ("bar-fewer-queries", "reproduced"),
        ("bar-equal-effort", "reproduced"),
    }
    for elsewhere in ({"variant": "no-termination"}, {"loss": "released"}, {"form": "paper"}):
        others = cells(levels, **{"form": "choice", **elsewhere})
        assert not any(c["id"].startswith("bar-") for c in judge_benchmark(others))


def test_losses_and_forms_are_judged_apart() -> None:
    records = cells({P200: 900.0, B800: 700.0})
    records += cells({P200: 600.0, B800: 700.0}, loss="released")
    records += cells({P200: 1500.0}, form="choice")
    found = {
        (claim["loss"], claim["highlights"]): claim["measured"]
        for claim in judge_benchmark(records)
        if claim["id"] == "walker2d-fewer-queries"
    }
    assert found == {
        ("pairwise", "paper"): pytest.approx(200),
        ("released", "paper"): pytest.approx(-100),
        ("pairwise", "choice"): pytest.approx(800),
    }


def test_a_control_is_judged_only_on_what_it_ran() -> None:
    records = cells({P200: 900.0, B800: 700.0, B400: 500.0})
    control = cells({P200: 650.0, B800: 700.0}, variant="no-termination")
    claims = judge_benchmark(records + control)
    (plain,) = (claim for claim in claims if claim["variant"])
    assert (plain["id"], plain["measured"]) == ("walker2d-fewer-queries", pytest.approx(-50))


def test_missing_runs_are_named_and_decide_nothing() -> None:
    records = cells({P200: 900.0}, seeds=1)
    assert judge_benchmark(records) == []  # nobody knows of a baseline
    plan = [synthetic_run("preferences", 800, seed=k) for k in range(5)]
    (claim,) = judge_benchmark(records, plan)
    assert claim["verdict"] == "undecided"
    assert claim["missing"] == ["POLITE-200: 1 of 2 runs", "baseline-800: 0 of 5 runs"]


def test_a_claim_is_judged_only_where_its_cells_are_finished_or_planned() -> None:
    plan = synthetic_plan(3)
    judged = judge_benchmark([], plan)
    assert {claim["id"] for claim in judged} == {rule.id for rule in RULES}
    assert judged and all(claim["missing"] for claim in judged)
    for claim in judge_benchmark(FULL, plan):
        assert claim["missing"] == []
        assert claim["measured"] is not None
    few = [run for run in plan if run["method"] != "pebble"]
    assert not any("pebble" in claim["id"] for claim in judge_benchmark([], few))


def test_the_own_grid_misses_nothing_when_it_is_complete() -> None:
    for preset in GRIDS:
        runs = [run.as_dict() for run in planned(preset)]
        records = [synthetic_record(run, 1000.0 + 10 * run["seed"]) for run in runs]
        results = summarise(records, runs)
        assert results["missing"] == []
        assert not any(claim["missing"] for claim in results["claims"])
        assert {cell["preset"] for cell in results["cells"]} == {preset}


def test_pebble_is_compared_only_under_the_loss_that_it_was_run_with() -> None:
    results = summarise(FULL, PLAN)
    rows = [*results["comparisons"], *results["queries_to_reach"]]
    rows = [row for row in rows if "PEBBLE" in str(row) or row.get("method") == "pebble"]
    assert rows and {row["loss"] for row in rows} == {"pairwise"}
    losses = {c["loss"] for c in results["claims"] if "PEBBLE" in c["text"]}
    assert losses == {"pairwise"}


def test_highlights_alone_serve_both_losses_and_are_told_once() -> None:
    levels = {P400: 1000.0, B400: 500.0}
    records = cells({**levels, ("highlights", 400): 300.0, ("untrained", 0): 100.0})
    records += cells(levels, loss="released")
    found = [claim for claim in judge_benchmark(records) if claim["id"] == "fig4c"]
    assert {claim["loss"]: claim["measured"] for claim in found} == pytest.approx(
        {"pairwise": 300.0, "released": 300.0}
    )
    results = summarise([*records, *cells({("ground-truth", 0): 2000.0})])
    pairs = [row["loss"] for row in results["comparisons"] if row["first"] == "highlights-400"]
    assert pairs == ["pairwise"]
    reach = [row["loss"] for row in results["queries_to_reach"] if row["method"] == "highlights"]
    assert reach and set(reach) == {"pairwise"}


def test_only_under_the_papers_own_conditions_is_a_claim_the_papers() -> None:
    levels = {P200: 900.0, B800: 700.0}
    records = cells(levels) + cells(levels, loss="released") + cells(levels, form="choice")
    records += cells(levels, variant="no-termination")
    found = {
        (claim["loss"], claim["highlights"], claim["variant"]): claim["kind"]
        for claim in judge_benchmark(records)
        if claim["id"] == "walker2d-fewer-queries"
    }
    assert found == {
        ("pairwise", "paper", ""): "emergent",
        ("released", "paper", ""): "emergent",
        ("pairwise", "choice", ""): "comparison",
        ("pairwise", "paper", "no-termination"): "comparison",
    }


def test_runs_without_a_finished_episode_are_left_out() -> None:
    records = cells({P200: 900.0, B800: 700.0})
    records[0] = records[0] | {"final_return": None}
    claim = verdict(records, "walker2d-fewer-queries")
    assert claim["measured"] == pytest.approx(200 + 10 / 4)  # without the lowest, 890
    assert np.isfinite(claim["low"])


def test_every_claim_has_its_rule_and_the_keys_of_results() -> None:
    claims = judge_benchmark(synthetic_grid(3))
    keys = {"id", "kind", "text", "published", "rule", "verdict", "measured", "low", "high"}
    keys |= {"unit", "parts", "env", "preset", "variant", "loss", "highlights", "missing"}
    assert all(set(claim) == keys for claim in claims)
    names = [
        tuple(claim[k] for k in ("id", "env", "variant", "loss", "highlights")) for claim in claims
    ]
    assert len(names) == len(set(names))
    assert {claim["id"] for claim in claims} == {rule.id for rule in RULES}
    json.dumps(claims, allow_nan=False)


def test_a_record_of_another_form_is_a_one_line_error() -> None:
    with pytest.raises(InvalidValueError, match="expected the key 'run'"):
        judge_benchmark([{"final_return": 1.0}])
    with pytest.raises(InvalidValueError, match="expected the key 'method'"):
        cell_of({"env": "Walker2d-v5"})


def test_the_later_of_two_records_of_a_run_counts() -> None:
    run = synthetic_run("preferences", 400)
    grid = Grid([synthetic_record(run, 1.0), synthetic_record(run, 2.0)])
    assert grid.finals(cell_of(run)).tolist() == [2.0]


def test_verdict_parts() -> None:
    wide = welch([0.0, 2.0, 4.0])
    assert at_least("", wide, 0).verdict == "reproduced"
    assert above("", wide, 0).verdict == "undecided"
    assert at_least("", wide, 3).verdict == "undecided"
    assert at_least("", wide, 50).verdict == "not reproduced"
    assert between("", wide, -50, 50).verdict == "reproduced"
    assert between("", wide, 40, 50).verdict == "not reproduced"
    assert between("", wide, 0, 50).verdict == "undecided"
    assert combine(["reproduced", shown("", wide).verdict]) == "reproduced"
    assert combine([shown("", wide).verdict]) == "shown"


def welch(values: list[float]) -> Any:
    from polite.analysis.statistics import mean_interval

    return mean_interval(np.array(values))


FULL, PLAN = synthetic_grid(3), synthetic_plan(3)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.sets(st.integers(0, len(FULL) - 1), max_size=30), st.booleans())
def test_no_partial_grid_breaks_the_summary(kept: set[int], known: bool) -> None:
    records = [FULL[k] for k in sorted(kept)]
    results = summarise(records, PLAN if known else [])
    json.dumps(results, allow_nan=False)
    assert results["runs"]["finished"] == len(records)
    if known:
        assert sum(len(part["seeds"]) for part in results["missing"]) == len(FULL) - len(records)
    for claim in results["claims"]:
        if claim["verdict"] in ("reproduced", "not reproduced"):
            assert claim["low"] is not None or claim["high"] is not None
        short = any(": 0 of" in text or ": 1 of" in text for text in claim["missing"])
        if short and len(claim["parts"]) == 1:
            assert claim["verdict"] == "undecided"


def test_the_order_of_records_and_a_new_cell_change_no_other_number() -> None:
    forward, backward = summarise(FULL, PLAN), summarise(FULL[::-1], PLAN[::-1])
    assert forward == backward
    extra = synthetic_record(synthetic_run("polite", 50), 1.0)
    more = summarise([*FULL, extra], PLAN)["cells"]
    assert [cell for cell in more if cell["queries"] != 50] == forward["cells"]


def test_new_seeds_are_judged_on_their_own() -> None:
    levels = {P200: 900.0, B262: 500.0}
    records = cells(levels, form="choice")
    assert "bar-equal-effort-anew" not in {claim["id"] for claim in judge_benchmark(records)}
    later = cells({P200: 500.0, B262: 900.0}, form="choice")
    for record in later:
        record["run"]["seed"] += 10
    judged = verdict([*records, *later], "bar-equal-effort-anew")
    assert (judged["verdict"], judged["measured"]) == ("not reproduced", pytest.approx(-400.0))
    assert verdict([*records, *later], "bar-equal-effort")["measured"] == pytest.approx(0.0)


def test_new_seeds_of_the_shuffled_control_are_judged_on_their_own() -> None:
    ours: dict[str, Any] = {"form": "choice", "env": "HalfCheetah-v5"}

    def both(plain: float, shuffled: float) -> Records:
        control = cells({P200: shuffled}, variant="shuffled", **ours)
        return cells({P200: plain}, **ours) + control

    records = both(900.0, 500.0)
    assert "control-shuffled-anew" not in {claim["id"] for claim in judge_benchmark(records)}
    later = both(500.0, 900.0)
    for record in later:
        record["run"]["seed"] += 5
    judged = verdict([*records, *later], "control-shuffled-anew")
    assert (judged["verdict"], judged["measured"]) == ("not reproduced", pytest.approx(-400.0))
    assert verdict([*records, *later], "control-shuffled")["measured"] == pytest.approx(0.0)


def test_new_raised_seeds_are_judged_on_their_own_and_say_what_had_been_read() -> None:
    raised: dict[str, Any] = {"form": "choice", "variant": "raised"}
    alone = ("highlights", 200)
    records = cells({alone: 900.0, B262: 500.0}, **raised)
    assert "alone-equal-effort-anew" not in {claim["id"] for claim in judge_benchmark(records)}
    later = cells({alone: 500.0, B262: 900.0}, **raised)
    for record in later:
        record["run"]["seed"] += 5
    anew = verdict([*records, *later], "alone-equal-effort-anew")
    assert (anew["verdict"], anew["measured"]) == ("not reproduced", pytest.approx(-400.0))
    together = verdict([*records, *later], "alone-equal-effort")
    assert together["measured"] == pytest.approx(0.0)
    read_before = "For 'raised' written before any run under it"
    assert read_before in together["rule"] and read_before not in anew["rule"]


def test_envs_count_alike_however_many_runs_they_have() -> None:
    plain = [r for r in synthetic_grid(4) if r["run"]["variant"] != "raised"]
    records = [r for r in plain if r["run"]["seed"] < 10]
    same = [r for r in records if r["run"]["seed"] < 4]
    assert {r["run"]["env"] for r in records if r not in same} == {"HalfCheetah-v5"}
    parts = summarise(same)["aggregates"]
    assert parts and summarise(records)["aggregates"] == parts
    assert all(len(set(part["n"])) == 1 for part in parts)
