"""Arrays as the compiled code takes them: where each lies in memory, and its shape.

Whatever is handed over is checked first: the compiled code cannot.
"""

from __future__ import annotations

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


def addresses(arrays: Iterable[Any], kinds: Iterable[Kind]) -> bytes:
    """Return the address and the shape of each array, in words of 8 bytes.

    Raises
    ------
    TypeError
        If an array is not of its kind.
    """
    words: list[int] = []
    for array, kind in zip(arrays, kinds, strict=True):
        if array.dtype != kind.dtype or array.ndim != kind.ndim or not array.flags.c_contiguous:
            order = "C order" if array.flags.c_contiguous else "another order"
            raise TypeError(f"{kind.dtype}, {kind.ndim} axes, C order: not {array.dtype}, {array.ndim} axes, {order}")
        words.append(array.__array_interface__["data"][0])
        words += array.shape
    return _words(len(words)).pack(*words)


@lru_cache(maxsize=64)
def _words(count: int) -> struct.Struct:
    return struct.Struct(f"{count}q")


class Packed:
    """For tuples of arrays that are handed over many times: their addresses are read once.

    The arrays must not be given other memory (`numpy.ndarray.resize`); what they hold may change.
    """

    kinds: Any

    @cached_property
    def block(self) -> bytes:
        """Addresses and shapes."""
        return addresses(flat(self), tuple(flat(self.kinds)))

    def __getstate__(self) -> None:
        """Return nothing: in a copy, or in another process, the addresses are other ones."""
