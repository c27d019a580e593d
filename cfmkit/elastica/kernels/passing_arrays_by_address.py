"""Arrays as the compiled code takes them: it is told where NumPy's objects are, and looks into them itself.

To ask an array for its address in Python takes as long as a step of Newton's method. The compiled code checks each: its
type, that of its entries, axes and order.
"""

from __future__ import annotations

import ctypes
import struct
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator


class Kind(NamedTuple):
    """What an array must be, in C order."""

    dtype: np.dtype[Any]
    ndim: int


def floats(ndim: int) -> Kind:
    """Return the kind of an array of floats."""
    return Kind(np.dtype(np.float64), ndim)


def complexes(ndim: int) -> Kind:
    """Return the kind of an array of complex numbers."""
    return Kind(np.dtype(np.complex128), ndim)


def integers(ndim: int) -> Kind:
    """Return the kind of an array of integers."""
    return Kind(np.dtype(np.int64), ndim)


def truths(ndim: int) -> Kind:
    """Return the kind of an array of truth values."""
    return Kind(np.dtype(np.bool_), ndim)


def flat(nested: Any) -> Iterator[Any]:
    """Yield what stands in tuples in tuples; a `Kind` is none of these tuples."""
    for each in nested:
        if isinstance(each, tuple) and not isinstance(each, Kind):
            yield from flat(each)
        else:
            yield each


def objects(arrays: Iterable[Any]) -> bytes:
    """Return where the arrays themselves are, NumPy's objects, in words of 8 bytes; they must be held meanwhile."""
    places = [*map(id, arrays)]
    return _words(len(places)).pack(*places)


@lru_cache(maxsize=64)
def _words(count: int) -> struct.Struct:
    return struct.Struct(f"{count}q")


ABOUT = object.__basicsize__
"""Bytes before an object's own fields."""

TYPE, DATA, AXES, SHAPE, DTYPE, FLAGS = ABOUT - 8, ABOUT, ABOUT + 8, ABOUT + 16, ABOUT + 40, ABOUT + 48
"""Bytes from an array's address to its type, the address of its data, the number of its axes, the address of its shape,
the address of its dtype, its flags [NumPy, C API, `PyArrayObject_fields`: every extension is compiled with them]."""

ENTRIES = ABOUT + 8
"""Bytes from a dtype's address to a word that says what the entries are: kind, order of bytes, number of the type
[`PyArray_Descr`]. There are many dtypes of one kind: an array from another process brings its own."""

READY = 0x0101
"""Flags of an array in C order whose data are aligned [NPY_ARRAY_C_CONTIGUOUS, NPY_ARRAY_ALIGNED]."""

REFUSED = 1000
"""What the compiled code returns, plus the number of the argument, where an array is not of its kind."""

DTYPES = tuple(map(np.dtype, (np.float64, np.complex128, np.int64, np.bool_)))


def _entries(dtype: np.dtype[Any]) -> int:
    return ctypes.c_int64.from_address(id(dtype) + ENTRIES).value


HEAD = struct.pack(f"{1 + len(DTYPES)}q", id(np.ndarray), *map(_entries, DTYPES))
"""What begins every block, to compare with: NumPy's type of arrays and what their entries may be."""


class Packed:
    """For tuples of arrays that are handed over many times: where they are is found out once."""

    @cached_property
    def block(self) -> bytes:
        """Places of the arrays."""
        return objects(self._all())

    def _all(self) -> Iterable[Any]:
        return self  # type: ignore[return-value]

    def __repr__(self) -> str:
        """Return how many there are: their numbers are thousands."""
        return f"<{type(self).__name__} of {len(list(self._all()))}>"

    def __getstate__(self) -> None:
        """Return nothing: in a copy, or in another process, the arrays are elsewhere."""
