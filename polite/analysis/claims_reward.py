"""Claims about the learned rewards: Fig. 5a, b and c. All of them emerge; none is put in."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from polite.analysis.numbers import Array, as_array, mean_of
from polite.analysis.reward_map import spread
from polite.analysis.statistics import mean_interval, paired_difference, paired_ratio
from polite.analysis.verdicts import Claim, above, below

Results = Mapping[str, Any]

PERSON_NEAR = 1.2
"""Personal space (Hall 1966), metres: "at a person" means closer than this along z."""
FLANK = 3.0
""""Around an object" reaches to this many times the radius that counts as "at" it."""
FLAT = 0.5
"""The baseline is "flat" when its spread is at most this share of POLITE's (our threshold)."""
NEAR_ONE, NEAR_ZERO = 0.8, 0.2
""""Nearing 1" and "approaching 0" on the (r̂+1)/2 scale (our thresholds)."""
NEAR_GOAL = 5.0
""""Close to the goal" for the slope of r̂, metres (our threshold)."""
FAR_SHARE = 0.75
""""Further away" is the farthest quarter of the distances (our threshold)."""
TAIL = 0.1
"""Share of the epochs that counts as the beginning, and as the end, of training."""


def peaks_and_dips(results: Results) -> Claim:
    """5a: POLITE's r̂ peaks at both goals and dips at people."""
    scene = results["scene"]
    intermittent = _contrast(results["intermittent_offset"]["polite"], scene["intermittent_radius"])
    goal = _contrast(results["goal_offset"]["polite"], scene["goal_radius"])
    person = _contrast(results["person_offset"]["polite"], PERSON_NEAR)
    return Claim(
        "5a-peaks",
        "emergent",
        "POLITE's reward peaks at the goals and dips at people",
        "shown in Fig. 5a, no number",
        "Mean r̂ within an object's radius minus mean r̂ around it (one to three radii, both sides, "
        "by signed distance along z), seed by seed: the 95% t interval lies above 0 at both goals "
        f"and below 0 at people (radius {PERSON_NEAR:g} m).",
        (
            above(
                "POLITE's r̂ at the intermittent goal minus around it",
                mean_interval(intermittent),
                0,
            ),
            above("POLITE's r̂ at the end goal minus around it", mean_interval(goal), 0),
            below("POLITE's r̂ at the nearest person minus around them", mean_interval(person), 0),
        ),
    )


def baseline_flatter(results: Results) -> Claim:
    """5a: the baseline's map is flat beside POLITE's, raw and standardised."""
    maps = results["reward_map"]
    raw = paired_ratio(*(spread(_seeds(maps[c])) for c in ("baseline", "polite")))
    scaled = paired_ratio(
        *(spread(_seeds(maps[c]["standardised"])) for c in ("baseline", "polite"))
    )
    return Claim(
        "5a-flat",
        "emergent",
        "The baseline's reward is flat along the corridor, POLITE's is not",
        "shown in Fig. 5a, no number",
        f"Spread over z (sd of the bin means), baseline over POLITE: at most {FLAT:g}, raw and "
        "standardised; 95% interval of the geometric mean ratio over seeds (paired t of the logs).",
        (
            below("spread ratio baseline / POLITE, raw", raw, FLAT),
            below("spread ratio baseline / POLITE, standardised", scaled, FLAT),
        ),
    )


def goal_limits(results: Results) -> Claim:
    """5b: POLITE's mapped reward nears 1 at the goal and 0 far from it."""
    part = results["goal_distance"]["polite"]
    distance, curves = as_array(part["distance"]), _seeds(part)
    near = distance <= max(results["scene"]["goal_radius"], distance[0])
    far = distance >= FAR_SHARE * distance[-1]
    return Claim(
        "5b-limits",
        "emergent",
        "POLITE's reward nears 1 close to the end goal and approaches 0 further away",
        "shown in Fig. 5b, no number",
        f"(r̂+1)/2 within the goal's radius at least {NEAR_ONE:g}, and over the farthest quarter of "
        f"the distances at most {NEAR_ZERO:g}; 95% t intervals over seeds.",
        (
            above(
                "POLITE's (r̂+1)/2 at the end goal", mean_interval(mean_of(curves, near)), NEAR_ONE
            ),
            below("POLITE's (r̂+1)/2 far away", mean_interval(mean_of(curves, far)), NEAR_ZERO),
        ),
    )


def goal_range(results: Results) -> Claim:
    """5b: POLITE's mapped reward covers a wider range over the distance than the baseline's."""
    ranges = [np.ptp(_filled(results["goal_distance"][c]), axis=-1) for c in ("polite", "baseline")]
    return Claim(
        "5b-range",
        "emergent",
        "POLITE's reward covers a broader range of values over the distance to the end goal",
        "shown in Fig. 5b, no number",
        "Largest minus smallest bin mean of (r̂+1)/2, POLITE minus baseline, paired by seed: the "
        "95% t interval lies above 0.",
        (above("range of (r̂+1)/2, POLITE minus baseline", paired_difference(*ranges), 0),),
    )


def goal_slope(results: Results) -> Claim:
    """5b: POLITE's reward rises faster the closer the goal, and faster than the baseline's."""
    near = {c: _rise(results["goal_distance"][c], 0.0, NEAR_GOAL) for c in ("polite", "baseline")}
    far = _rise(results["goal_distance"]["polite"], NEAR_GOAL, np.inf)
    return Claim(
        "5b-slope",
        "emergent",
        "POLITE's reward increases more rapidly the closer to the end goal",
        "shown in Fig. 5b, no number",
        f"Least-squares rise of (r̂+1)/2 per metre of approach over the last {NEAR_GOAL:g} m: more "
        "than POLITE's own rise further away, and more than the baseline's over the same metres; "
        "95% paired t intervals over seeds lie above 0.",
        (
            above(
                "rise near the goal, POLITE near minus POLITE far",
                paired_difference(near["polite"], far),
                0,
                "per m",
            ),
            above(
                "rise near the goal, POLITE minus baseline",
                paired_difference(near["polite"], near["baseline"]),
                0,
                "per m",
            ),
        ),
    )


def divergence_grows(results: Results) -> Claim:
    """5c: KL(POLITE‖baseline) grows with training and exceeds both null curves at its end."""
    kl = results["kl"]
    per_seed = as_array(kl["per_seed"])
    window = max(1, round(TAIL * per_seed.shape[1]))
    end = per_seed[:, -window:].mean(axis=1)
    nulls = {n: as_array(kl[n])[:, -window:].mean(axis=1) for n in ("null_seed", "null_shuffled")}
    growth = paired_difference(end, per_seed[:, :window].mean(axis=1))
    return Claim(
        "5c",
        "emergent",
        "The divergence between the two reward models grows with training",
        "shown in Fig. 5c, no number",
        f"KL(POLITE‖baseline), Gaussian closed form, mean of the last {TAIL:.0%} of the epochs: "
        f"above the first {TAIL:.0%}, above two baselines of different batch orders, and above "
        "POLITE with its highlights shuffled; 95% paired t intervals over seeds lie above 0.",
        (
            above("KL at the end minus at the beginning", growth, 0, "nats"),
            above(
                "KL at the end minus that of two baselines",
                paired_difference(end, nulls["null_seed"]),
                0,
                "nats",
            ),
            above(
                "KL at the end minus that of shuffled highlights",
                paired_difference(end, nulls["null_shuffled"]),
                0,
                "nats",
            ),
        ),
    )


def reward_claims(results: Results) -> list[Claim]:
    """All claims about the learned rewards, in the order of the figures."""
    rules = (
        peaks_and_dips,
        baseline_flatter,
        goal_limits,
        goal_range,
        goal_slope,
        divergence_grows,
    )
    return [rule(results) for rule in rules]


def _seeds(part: Results) -> Array:
    """(S, B) bin means, one row a seed."""
    return as_array(part["per_seed"])


def _filled(part: Results) -> Array:
    """(S, B') bin means without the bins that hold no state."""
    curves = _seeds(part)
    return curves[:, np.isfinite(curves).all(axis=0)]


def _contrast(part: Results, radius: float) -> Array:
    """(S,) mean within the radius minus mean from one to `FLANK` radii away."""
    reach, curves = np.abs(as_array(part["offset"])), _seeds(part)
    near = mean_of(curves, reach <= radius)
    return near - mean_of(curves, (reach > radius) & (reach <= FLANK * radius))


def _rise(part: Results, nearest: float, farthest: float) -> Array:
    """(S,) least-squares rise per metre of approach over the distances in [nearest, farthest)."""
    distance, curves = as_array(part["distance"]), _seeds(part)
    usable = (distance >= nearest) & (distance < farthest) & np.isfinite(curves).all(axis=0)
    if usable.sum() < 2:
        return np.full(len(curves), np.nan)
    centred = distance[usable] - distance[usable].mean()
    return np.asarray(-(curves[:, usable] @ centred) / float(centred @ centred), dtype=float)
