"""One decorator for the compiled kernels and the array types that they share."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

Function = TypeVar("Function", bound=Callable[..., object])


def kernel(function: Function) -> Function:
    """Compile scalar code over arrays; the machine code is cached on disk.

    ``NUMBA_DISABLE_JIT=1`` runs the same code as plain Python, for debugging and coverage.
    """
    return cast(Function, njit(cache=True)(function))
