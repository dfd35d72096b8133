"""The numbers of Holk, Marta and Leite, ICRA 2024, section V-B, as data."""

from __future__ import annotations

from typing import Any, Final

PUBLISHED: Final[dict[str, Any]] = {
    "source": "Holk, Marta and Leite: POLITE, ICRA 2024, section V-B",
    "participants": {"polite": 20, "baseline": 20},
    "queries_per_participant": 20,
    "answers": {"polite": 400, "baseline": 400},
    "no_preference": {"polite": 28, "baseline": 66},
    "no_preference_rate": {"polite": 0.07, "baseline": 0.165},
    "chi_square": {"statistic": 16.5, "p_value_below": 0.001},
    "highlights": {"positive": 236, "negative": 176},
    "highlight_rate": {"positive": 0.6344, "negative": 0.4731},
    "times": {
        "polite": {"mean": 24.83, "sd": 6.48},
        "baseline": {"mean": 18.93, "sd": 9.4},
        "increase": 0.3117,
    },
}
"""What the paper prints; the counts follow from its rates and 400 answers a condition.

The paper does not say what its "±" is. Read as a standard deviation over 20 participants, the two
times differ by Welch's t = 2.31, p = .027 (this test is not in the paper).
"""
