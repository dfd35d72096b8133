"""pymunk's step and batch transfer, set up once instead of on every call.

`Space.step` and `pymunk.batch` prepare each call in Python, which takes a single corridor longer
than the physics. The functions called here are those that they call, of the same C library.

Only the Space may hold on to its C structure, hence `space._space` in every call: whatever keeps
that alive longer than the Space's bodies has it torn down while the garbage collector frees them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import pymunk
from pymunk import batch
from pymunk._chipmunk_cffi import ffi, lib

from socialnav_env.kernels import FloatArray

PURGE_TIME = 1e-9
"""A step this short [s] only serves to forget contacts."""
_PAIR = batch.ArbiterFields.BODY_A_ID | batch.ArbiterFields.BODY_B_ID


def stepper(space: pymunk.Space) -> Callable[[float], None]:
    """A function that advances the space by so many seconds; for a space without callbacks."""

    def advance(seconds: float) -> None:
        lib.cpSpaceStep(space._space, seconds)

    return advance


def forgetter(space: pymunk.Space) -> Callable[[], None]:
    """A function that drops the space's memory of contacts.

    pymunk starts a lasting contact from its last impulses, which cannot be read or set. With
    `collision_persistence = 0` they are dropped, and contacts do not push at all: hence only for
    one more step of a space whose bodies have been read.
    """
    kept = space.collision_persistence

    def forget() -> None:
        lib.cpSpaceSetCollisionPersistence(space._space, 0)
        lib.cpSpaceStep(space._space, PURGE_TIME)
        lib.cpSpaceSetCollisionPersistence(space._space, kept)

    return forget


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
        self._space = space
        self._buffer = batch.Buffer()
        self._buffer.set_float_buf(values)
        self._floats: Any = self._buffer._float_arr
        self._data = _batched(self._buffer, fields.value)
        self._get = ffi.addressof(lib, "pmSpaceBodyGetIteratorFuncBatched")
        self._set = ffi.addressof(lib, "pmSpaceBodySetIteratorFuncBatched")

    def read(self) -> None:
        """From the bodies to the array."""
        self._floats.num = 0
        lib.cpSpaceEachBody(self._space._space, self._get, self._data)

    def write(self) -> None:
        """From the array to the bodies."""
        self._floats.num = 0
        lib.cpSpaceEachBody(self._space._space, self._set, self._data)


class Contacts:
    """Lists which bodies of a space touch."""

    def __init__(self, space: pymunk.Space) -> None:
        """Prepare the call."""
        self._space = space
        self._buffer = batch.Buffer()
        self._ids: Any = self._buffer._int_arr
        self._data = _batched(self._buffer, _PAIR.value)
        self._get = ffi.addressof(lib, "pmSpaceArbiterIteratorFuncBatched")

    def pairs(self) -> Sequence[tuple[int, int]]:
        """The ids (`Body.id`) of each two bodies that touch, a wall counting as the static body."""
        ids = self._ids
        ids.num = 0
        lib.cpSpaceEachCachedArbiter(self._space._space, self._get, self._data)
        if ids.num == 0:
            return ()
        flat = ffi.unpack(ids.arr, ids.num)
        return list(zip(flat[::2], flat[1::2], strict=True))


def _batched(buffer: batch.Buffer, fields: int) -> Any:
    """The C struct that pymunk.batch hands to its iterators."""
    data = ffi.new("pmBatchedData *")
    data.fields = fields
    data.floatArray = buffer._float_arr
    data.intArray = buffer._int_arr
    return data
