"""How far two reward models' reward distributions lie apart (Fig. 5c)."""

from __future__ import annotations

from typing import Any

import numpy as np

from polite.analysis.numbers import Array, as_json
from polite.analysis.statistics import mean_band
from polite.types import InvalidValueError

SMALLEST_SD = 1e-3
"""Floor of a standard deviation: a model that pays the same everywhere has no finite KL."""
SMOOTHING = 0.5
"""Pseudo-count added to every bin of a histogram (Krichevsky and Trofimov 1981)."""


def gaussian_kl(p: Array, q: Array) -> Array:
    """KL(P‖Q) in nats of the two normal distributions with the samples' means and deviations.

    log(s_q / s_p) + (s_p² + (m_p − m_q)²) / (2 s_q²) − 1/2, the closed form.

    Args:
        p: (..., M) samples of P; the last axis runs over the samples.
        q: (..., M) samples of Q.

    Returns:
        (...) divergences, at least 0.
    """
    p, q = np.asarray(p, dtype=float), np.asarray(q, dtype=float)
    sd_p = np.maximum(p.std(axis=-1), SMALLEST_SD)
    sd_q = np.maximum(q.std(axis=-1), SMALLEST_SD)
    gap = p.mean(axis=-1) - q.mean(axis=-1)
    return np.asarray(np.log(sd_q / sd_p) + (sd_p**2 + gap**2) / (2 * sd_q**2) - 0.5)


def histogram_kl(p: Array, q: Array, edges: Array) -> float:
    """KL(P‖Q) in nats of the two samples' histograms, `SMOOTHING` added to each count.

    Args:
        p: (M,) samples of P.
        q: (N,) samples of Q.
        edges: (B+1,) bin edges that cover all samples.

    Raises:
        InvalidValueError: When a sample lies outside the edges.
    """
    share_p, share_q = (_smoothed_shares(samples, edges) for samples in (p, q))
    return float(np.sum(share_p * np.log(share_p / share_q)))


def kl_part(
    epochs: Array, polite: Array, baseline: Array, other_baseline: Array, shuffled: Array
) -> dict[str, Any]:
    """`kl` of results.json: KL(POLITE‖baseline) over the epochs, and its two null curves.

    All rewards are (S, E, M): S seeds, E checkpoints, the same M states.

    Args:
        epochs: (E,) epoch of each checkpoint; 0 is the untrained model.
        polite: Rewards of the POLITE models.
        baseline: Rewards of the preference-only models.
        other_baseline: Preference-only models of another batch order (first null).
        shuffled: POLITE models whose highlights were shuffled among the queries (second null).
    """
    forward = gaussian_kl(polite, baseline)  # (S, E)
    band = mean_band(forward)
    histogram = _histogram_curves(polite, baseline)
    reverse = gaussian_kl(baseline, polite)
    models = {"per_seed": polite, "null_seed": other_baseline, "null_shuffled": shuffled}
    centred = {name: gaussian_kl(_centre(m), _centre(baseline)) for name, m in models.items()}
    return {
        "epochs": as_json(epochs),
        "mean": as_json(band.mean),
        # A divergence cannot be negative, though its t interval can.
        "low": as_json(np.maximum(band.low, 0.0)),
        "high": as_json(band.high),
        "per_seed": as_json(forward),
        "null_seed": as_json(gaussian_kl(other_baseline, baseline)),
        "null_shuffled": as_json(gaussian_kl(shuffled, baseline)),
        "histogram": {"per_seed": as_json(histogram), "mean": as_json(histogram.mean(axis=0))},
        "reverse": {"per_seed": as_json(reverse), "mean": as_json(reverse.mean(axis=0))},
        "centred": {name: as_json(curves) for name, curves in centred.items()},
    }


def _centre(rewards: Array) -> Array:
    """Rewards with mean 0 over the states: comparisons of clips of one length leave it free."""
    rewards = np.asarray(rewards, dtype=float)
    return np.asarray(rewards - rewards.mean(axis=-1, keepdims=True))


def _histogram_curves(polite: Array, baseline: Array) -> Array:
    """(S, E) histogram divergences over the range (−1, 1) of a tanh, in 40 bins."""
    edges = np.linspace(-1.0, 1.0, 41)
    rows = [
        [histogram_kl(p, q, edges) for p, q in zip(seed_p, seed_q, strict=True)]
        for seed_p, seed_q in zip(polite, baseline, strict=True)
    ]
    return np.asarray(rows, dtype=float)


def _smoothed_shares(samples: Array, edges: Array) -> Array:
    count, _ = np.histogram(samples, bins=edges)
    if count.sum() != np.size(samples):
        raise InvalidValueError(
            f"histogram: expected all {np.size(samples)} samples within "
            f"[{edges[0]:g}, {edges[-1]:g}], got only {count.sum()} there; widen the edges"
        )
    smoothed = count + SMOOTHING
    return np.asarray(smoothed / smoothed.sum(), dtype=float)
