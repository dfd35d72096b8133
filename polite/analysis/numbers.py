"""Between NumPy arrays and plain JSON values, in which "not a number" is `null`."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def as_json(values: npt.ArrayLike) -> Any:
    """Nested lists of floats (or one float) with `None` for every NaN and infinity."""
    array = np.asarray(values, dtype=float)
    if array.ndim:
        return [as_json(row) for row in array]
    return float(array) if np.isfinite(array) else None


def as_array(values: Any) -> Array:
    """The float array of nested JSON lists, `None` read as NaN."""
    return np.asarray(values, dtype=float)


def mean_of(values: Array, chosen: npt.NDArray[np.bool_]) -> Array:
    """Mean over the chosen bins that hold data: values (..., B), chosen (B,) -> (...).

    NaN where no chosen bin holds any.
    """
    usable = chosen & np.isfinite(values)
    count = usable.sum(axis=-1)
    total = np.where(usable, values, 0.0).sum(axis=-1)
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), np.nan), dtype=float)
