"""Numbers in words that a reader can trust: as many digits as their interval allows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from polite.analysis.numbers import as_array
from polite.analysis.statistics import Estimate, mean_interval

NBSP = "\N{NO-BREAK SPACE}"


def number(value: float | None, decimals: int | None = None) -> str:
    """A number with three significant digits, or so many decimals, and a proper minus sign."""
    if value is None or not math.isfinite(value):
        return "–"
    if decimals is None:
        size = math.floor(math.log10(abs(value))) if value else 0
        decimals = max(0, 2 - size) if size < 3 else 0
        decimals = 0 if float(value).is_integer() and size < 6 else min(decimals, 6)
    text = f"{value:,.{decimals}f}"
    zero = not text.strip("-0.,")
    return text.removeprefix("-") if zero else text.replace("-", "−")


def estimate(value: Estimate, unit: str = "") -> str:
    """`mean [low, high] unit`; without the bracket where the interval has no bound at all.

    One that is open on one side is written so: `mean [low, ∞) unit`.
    """
    unit = f"{NBSP}{unit}" if unit else ""
    bounded = math.isfinite(value.low), math.isfinite(value.high)
    if not any(bounded):
        return number(value.mean) + unit
    if not all(bounded):
        low = f"[{number(value.low)}" if bounded[0] else "(−∞"
        high = f"{number(value.high)}]" if bounded[1] else "∞)"
        return f"{number(value.mean)} {low},{NBSP}{high}{unit}"
    decimals = _decimals((value.high - value.low) / 2)
    low, high = (number(bound, decimals) for bound in (value.low, value.high))
    return f"{number(value.mean, decimals)} [{low},{NBSP}{high}]{unit}"


def stored(part: Mapping[str, Any], mean: str = "mean", unit: str = "") -> str:
    """The same for `{mean, low, high}` of results.json."""
    values = (math.nan if part[name] is None else part[name] for name in (mean, "low", "high"))
    return estimate(Estimate(*values), unit)


def over_seeds(values: Any, *, share: bool = False) -> str:
    """Mean and 95% t interval of one number a seed; missing ones are left out.

    Where all seeds have one value it is said so: their t interval would have no width. That of a
    `share` ends at 0 and 1.
    """
    array = as_array(values)
    array = array[np.isfinite(array)]
    if not array.size:
        return "–"
    found = mean_interval(array)
    if array.size > 1 and np.ptp(array) == 0.0:
        return f"{number(found.mean)} (all {array.size})"
    if share and array.size > 1:
        found = replace(found, low=max(found.low, 0.0), high=min(found.high, 1.0))
    return estimate(found)


def percent(value: Estimate) -> str:
    """A share as a percentage with its interval."""
    if not math.isfinite(value.mean):
        return "–"
    mean, low, high = (f"{100 * share:.1f}" for share in (value.mean, value.low, value.high))
    return f"{mean}% [{low},{NBSP}{high}]"


def p_value(p: float | None) -> str:
    """`p = .027`, or `p = 4.9 × 10⁻⁵` where it is small; `no p` where nothing can be tested."""
    if p is None:
        return "no p"
    if p >= 0.001:
        return f"p = {p:.3f}".replace("0.", ".", 1)
    if p == 0.0:
        return "p < 10⁻³⁰⁰"
    leading, exponent = f"{p:.1e}".split("e")
    raised = str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"p = {leading} × 10{raised}"


def _decimals(half_width: float) -> int:
    """Decimals that give an interval's half-width two significant digits.

    So a bound that an interval has just passed is seldom what it is rounded to.
    """
    if half_width <= 0:
        return 3
    return min(max(1 - math.floor(math.log10(half_width)), 0), 6)
