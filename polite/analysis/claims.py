"""The paper's claims about the user study, judged by rules that are code, not prose.

The rules were written before any run and read only `results.json`; they are listed with every
verdict. A claim is *reproduced*, *not reproduced*, *undecided* (an interval straddles its bound),
or *input* (calibration or design put it in, so that it says nothing about the method). What people
do is an input of a simulation, and judged where people answered.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from polite.analysis.claims_reward import reward_claims
from polite.analysis.claims_study import study_claims


def judge(results: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The entries of `claims` for a results dictionary that holds everything else.

    Each entry has `id`, `kind` (emergent, input or arithmetic), `text`, `published`, `rule`,
    `verdict`, the deciding `measured`, `low`, `high` and `unit`, and `parts`: every
    quantity that the rule reads, with its own interval.
    """
    return [claim.as_json() for claim in [*reward_claims(results), *study_claims(results)]]
