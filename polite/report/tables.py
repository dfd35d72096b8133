"""The tables of the page: statistics, claims, policies, sensitivity, inputs, configuration."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from polite.analysis.numbers import as_array
from polite.analysis.statistics import share_interval, welch_difference
from polite.report.html import Markup, element, join, table
from polite.report.wording import wording
from polite.report.words import NBSP, estimate, number, over_seeds, p_value, percent, stored

Results = Mapping[str, Any]

BADGES = {"reproduced": "✓", "not reproduced": "✗", "undecided": "?", "input": "•", "shown": "·"}
"""A sign for each verdict, so that colour is not what tells them apart."""

METRICS = {
    "success": "success S",
    "intermittent": "intermittent goal collected",
    "collisions": "collisions begun",
    "human_collisions": "steps in contact with a person HC",
    "wall_collisions": "steps in contact with a wall WC",
    "time_to_goal": "time to the goal, or to the end without it, T [s]",
    "path_length": "path length PL [m]",
    "spl": "success weighted by path length SPL",
    "stalled_time": "stalled time ST [s]",
    "min_human_distance": "smallest distance to a person DH_min, surface to surface [m]",
    "personal_space_compliance": "share of steps outside personal space PSC",
    "min_time_to_collision": "smallest time to collision TTC [s]",
    "speed_mean": "mean speed V [m/s]",
    "speed_max": "largest speed [m/s]",
    "acceleration_mean": "mean acceleration A [m/s²]",
    "acceleration_max": "largest acceleration [m/s²]",
    "jerk_mean": "mean jerk J [m/s³]",
    "jerk_max": "largest jerk [m/s³]",
    "path_irregularity": "path irregularity [rad/m]",
}
"""Social metrics in words with their units; a metric that is not listed keeps its own name."""
RATES = {
    "success_rate": "success rate",
    "collision_rate": "collision rate",
    "intermittent_rate": "intermittent-goal rate",
}
SHARES = {*RATES.values(), "spl", "personal_space_compliance"}
"""What lies between 0 and 1."""


def claims_table(claims: list[dict[str, Any]], kind: str, caption: str) -> Markup:
    """The claims of one kind, each with every quantity that its rule reads."""
    rows = (
        (claim["text"], claim["published"], _parts(claim), claim["rule"], badge(claim["verdict"]))
        for claim in claims
        if claim["kind"] == kind
    )
    head = ("Claim of the paper", "Paper", "Here, with 95% interval", "Rule", "Verdict")
    return table(caption, head, rows)


def badge(verdict: str, words: str = "") -> Markup:
    """A verdict with its sign, in words of its own if there are any."""
    kind = verdict.replace(" ", "-")
    return element("span", f"{BADGES[verdict]} {words or verdict}", class_=f"badge {kind}")


def measurement(part: Mapping[str, Any]) -> str:
    """`quantity: value [low, high] unit (needed: bound)` of one part of a claim."""
    bound = part["bound"].replace(" ", NBSP)
    needed = f" (needed:{NBSP}{bound})" if bound else ""
    return f"{part['what']}: {stored(part, 'measured', part['unit'])}{needed}"


def statistics_table(results: Results) -> Markup:
    """The paper's statistics of the answers beside ours."""
    rows = [*_share_rows(results), *_test_rows(results), *_time_rows(results)]
    return table(wording(results).statistics, ("Quantity", "Paper", "This run"), rows)


def policy_table(results: Results) -> Markup:
    """Returns, rates and social metrics of each policy, and POLITE minus baseline."""
    policies = results["policy"]
    names = [c for c in ("polite", "baseline", "ground_truth") if c in policies]
    flat = {c: _flat_policy(policies[c]) for c in names}
    rows = (
        (
            METRICS.get(key, key.replace("_", " ")),
            *(over_seeds(flat[c].get(key, []), share=key in SHARES) for c in names),
            estimate(welch_difference(as_array(flat["polite"][key]), as_array(other))),
        )
        for key, other in flat["baseline"].items()
        if key in flat["polite"]
    )
    titles = {"polite": "POLITE", "baseline": "baseline", "ground_truth": "PPO on true reward"}
    caption = "Final policies: mean over seeds with its 95% t interval; the last column is Welch's."
    return table(caption, ("", *(titles[c] for c in names), "POLITE − baseline"), rows)


def sensitivity_table(rows: list[dict[str, Any]]) -> Markup:
    """POLITE and baseline under each setting of the participants."""
    cells = (
        (
            f"{row['factor']}: {row['level']}",
            *(over_seeds(row["pair_accuracy"][c]) for c in ("polite", "baseline")),
            stored(row, "difference"),
            *(over_seeds(row["correlation"][c]) for c in ("polite", "baseline")),
            stored(row["correlation_difference"]),
            over_seeds(row["spread_ratio"]),
        )
        for row in rows
    )
    accuracy = ("pair accuracy, POLITE", "pair accuracy, baseline", "difference (paired)")
    correlation = ("correlation, POLITE", "correlation, baseline", "difference (paired)")
    caption = "Reward models on held-out segments: mean over seeds with 95% t intervals."
    return table(
        caption,
        ("Participants", *accuracy, *correlation, "spread of the maps, baseline / POLITE"),
        cells,
    )


def inputs_table(calibrated: Mapping[str, Any]) -> Markup:
    """Every number that was put in, and where it is from."""
    rows = (
        (name.replace("_", " "), _plain(entry["value"]), entry["source"])
        for name, entry in calibrated.items()
    )
    caption = "Properties of the simulated participants that were put in, not found."
    return table(caption, ("Input", "Value", "Source"), rows)


def config_table(config: Mapping[str, Any]) -> Markup:
    """Every setting of the run, nested names joined by dots."""
    return table("All settings of this run.", ("Setting", "Value"), _flatten(config))


def _parts(claim: Mapping[str, Any]) -> Markup:
    return join(
        element("div", f"{BADGES[p['verdict']]} {measurement(p)}", class_="part")
        for p in claim["parts"]
    )


def _share_rows(results: Results) -> list[tuple[str, str, str]]:
    counts = results["counts"]
    shares = (
        ("No preference, baseline", "16.5% (66/400)", "baseline", "no_preference", "answers"),
        ("No preference, POLITE", "7% (28/400)", "polite", "no_preference", "answers"),
        ("Positive highlights", "63.44% (236/372)", "polite", "positive", "expressed"),
        ("Negative highlights", "47.31% (176/372)", "polite", "negative", "expressed"),
    )
    return [
        (name, paper, f"{percent(share_interval(c[part], c[whole]))} ({c[part]}/{c[whole]})")
        for name, paper, condition, part, whole in shares
        for c in (counts[condition],)
    ]


def _test_rows(results: Results) -> list[tuple[str, str, str]]:
    test = results["chi_square"]
    plain, cluster = test["uncorrected"], test["cluster"]

    def chi(part: Mapping[str, float | None]) -> str:
        return f"χ² = {number(part['statistic'], 2)}, {p_value(part['p_value'])}"

    return [
        (
            "No preference by condition, χ² with Yates' correction",
            "χ² = 16.5, p < .001 (from its counts: 16.503, p = 4.9 × 10⁻⁵)",
            chi(test),
        ),
        ("The same without correction", "not given (from its counts: 17.41)", chi(plain)),
        (
            f"The same by {cluster['method']}",
            "not given",
            f"{stored(cluster, 'statistic')}, {p_value(cluster['p_value'])}",
        ),
    ]


def _time_rows(results: Results) -> list[tuple[str, str, str]]:
    times = results["times"]

    def minutes(condition: str) -> str:
        return f"{times[condition]['mean']:.2f} ± {times[condition]['sd']:.2f} min (sd)"

    return [
        ("Time, POLITE", "24.83 ± 6.48 min", minutes("polite")),
        ("Time, baseline", "18.93 ± 9.4 min", minutes("baseline")),
        ("Increase in time", "31.17%", f"{100 * times['increase']:.2f}%"),
        (
            "Welch's t of the times",
            "not given (if ± is an sd over 20: t = 2.31, p = .027)",
            f"t = {number(times['welch_t'], 2)}, {p_value(times['p_value'])}",
        ),
    ]


def _flat_policy(policy: Mapping[str, Any]) -> dict[str, Any]:
    """Returns and rates, then the social metrics that repeat none of them."""
    rates = {"return": "true return"} | RATES
    repeated = {"success", "intermittent", *rates}
    metrics = {k: v for k, v in policy["metrics"].items() if k not in repeated}
    return {title: policy[key] for key, title in rates.items()} | metrics


def _flatten(config: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    for name, value in config.items():
        if isinstance(value, Mapping):
            yield from _flatten(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", _plain(value)


def _plain(value: Any) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_plain(inner)}" for name, inner in value.items())
    if isinstance(value, (list, tuple)):
        return ", ".join(_plain(inner) for inner in value)
    if value is None:
        return "none"
    return f"{value:g}" if isinstance(value, float) else str(value)
