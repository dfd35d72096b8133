"""pymunk's step and batch transfer, set up once instead of on every call.

`Space.step` and `pymunk.batch` prepare each call in Python, which takes a single corridor longer
than the physics. The functions called here are those that they call, of the same C library.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import pymunk
from pymunk import batch
from pymunk._chipmunk_cffi import ffi, lib

from socialnav_env.kernels import FloatArray


def stepper(space: pymunk.Space) -> Callable[[float], None]:
    """A function that advances the space by so many seconds; for a space without callbacks."""
    return partial(lib.cpSpaceStep, space._space)


class Transfer:
    """Copies some fields of all bodies of a space from or to an array, in the order added."""

    def __init__(self, space: pymunk.Space, fields: batch.BodyFields, values: FloatArray) -> None:
        """Prepare the calls.

        Args:
            space: All its bodies have been added.
            fields: What to copy, each body's fields in a row.
            values: (rows, fields) C-contiguous. pymunk visits the static body last, hence one row
                more than there are moving bodies; and a full buffer makes it reallocate memory
                that is NumPy's, hence another.

        Raises:
            ValueError: The array has too few rows.
        """
        if len(values) < len(space.bodies) + 2:
            raise ValueError(f"values: expected {len(space.bodies) + 2} rows, got {len(values)}")
        self._buffer = batch.Buffer()
        self._buffer.set_float_buf(values)
        self._floats: Any = self._buffer._float_arr
        self._data = ffi.new("pmBatchedData *")
        self._data.fields = fields.value
        self._data.floatArray = self._floats
        self._data.intArray = self._buffer._int_arr
        each = partial(lib.cpSpaceEachBody, space._space)
        self._read = partial(
            each, ffi.addressof(lib, "pmSpaceBodyGetIteratorFuncBatched"), self._data
        )
        self._write = partial(
            each, ffi.addressof(lib, "pmSpaceBodySetIteratorFuncBatched"), self._data
        )

    def read(self) -> None:
        """From the bodies to the array."""
        self._floats.num = 0
        self._read()

    def write(self) -> None:
        """From the array to the bodies."""
        self._floats.num = 0
        self._write()
