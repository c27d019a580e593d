"""Read-only arrays, mappings and sequences computed when they are read, and short texts (`repr`) of what holds arrays.

Arrays are in SI units, and read-only once they are handed out. The full text of a result would have a million
characters.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import partial
from itertools import accumulate
from typing import TYPE_CHECKING, Any, TypeVar, overload

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    import numpy as np
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]

MAX_REPR_LENGTH = 1500  # characters of a `repr`
LONGEST_ITEM = 100  # characters of one item in it
PLAIN_TYPES = (str, int, float, type(None))  # what has a text of its own that is short
ValueT = TypeVar("ValueT")


def __getattr__(name: str) -> Any:
    """Return the type of arrays: who asks for it has numpy, which short texts of results must not bring."""
    if name == "FloatArray":
        import numpy as np
        from numpy.typing import NDArray

        return NDArray[np.float64]
    raise AttributeError(f"module {__name__} has no attribute {name}")


def read_only(values: Any, dtype: Any = "float64") -> NDArray[Any]:
    """Return `values` as an array that cannot be written to (copied if it could be)."""
    import numpy as np

    array = np.array(values, dtype=dtype)
    array.setflags(write=False)
    return array


def distinct(values: Any) -> NDArray[Any]:
    """Return the distinct values of an array without NaN, increasing, (n,).

    `np.unique` does the same, but loads numpy.ma to do it: 20 ms of a process that has no other use of it.

    Examples
    --------
    >>> distinct([2.0, 1.0, 2.0]).tolist()
    [1.0, 2.0]
    """
    import numpy as np

    ordered = np.sort(values, axis=None)
    keep = np.ones(len(ordered), dtype=np.bool_)
    np.not_equal(ordered[1:], ordered[:-1], out=keep[1:])
    return ordered[keep]


class Named(dict[str, ValueT]):
    """Values by name, whose text is short."""

    def __repr__(self) -> str:
        return "{" + _join_texts([f"{name!r}: {brief(value)}" for name, value in self.items()]) + "}"


class Several(tuple[ValueT, ...]):
    """Values in order, whose text is short."""

    __slots__ = ()

    def __repr__(self) -> str:
        return "(" + _join_texts([brief(value) for value in self]) + ")"


class LazyMapping(Mapping[str, ValueT]):
    """Values by name, each computed when it is first read.

    Parameters
    ----------
    names : iterable of str
        In the order in which they are shown.
    compute : callable
        Returns the value of a name.
    known : mapping, optional
        Values that are known already; they come last.

    Examples
    --------
    >>> lengths = LazyMapping(["cam", "beam"], len)
    >>> lengths["beam"], list(lengths | {"x": 1})
    (4, ['cam', 'beam', 'x'])
    """

    def __init__(
        self, names: Iterable[str], compute: Callable[[str], ValueT], precomputed: Mapping[str, ValueT] | None = None
    ) -> None:
        self._known = dict(precomputed or {})
        self._names = dict.fromkeys((*names, *self._known))
        self._compute = compute

    def __getitem__(self, name: str) -> ValueT:
        """Return a value; it is computed once."""
        if name not in self._known:
            if name not in self._names:
                raise KeyError(name)
            self._known[name] = self._compute(name)
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __or__(self, replacements: Mapping[str, ValueT]) -> LazyMapping[ValueT]:
        """Return these values with others, which replace those of the same name."""
        return LazyMapping(self._names, self._compute, {**self._known, **replacements})

    def __reduce__(self) -> tuple[Any, ...]:
        return Named, (dict(self),)

    def __repr__(self) -> str:
        """Return the names; nothing is computed for a text."""
        return f"<values by name: {_join_texts(list(self._names))}>"


class LazySequence(Sequence[ValueT]):
    """Values in order, all computed when one of them, or their number, is first read.

    Examples
    --------
    >>> squares = LazySequence(lambda: (n * n for n in range(4)))
    >>> (*squares, 16)
    (0, 1, 4, 9, 16)
    """

    def __init__(self, compute: Callable[[], Iterable[ValueT]]) -> None:
        self._compute: Callable[[], Iterable[ValueT]] | None = compute
        self._values: Several[ValueT] = Several()

    @property
    def values(self) -> Several[ValueT]:
        """All of them."""
        if self._compute is not None:
            self._values, self._compute = Several(self._compute()), None
        return self._values

    @overload
    def __getitem__(self, index: int) -> ValueT: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[ValueT, ...]: ...
    def __getitem__(self, index: int | slice) -> ValueT | tuple[ValueT, ...]:
        return self.values[index]

    def __len__(self) -> int:
        return len(self.values)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and self.values == tuple(other)

    def __hash__(self) -> int:
        return hash(self.values)

    def __reduce__(self) -> tuple[Any, ...]:
        return Several, (tuple(self.values),)

    def __repr__(self) -> str:
        return repr(self.values)


class ShortRepr:
    """Makes the text of a dataclass (with ``repr=False``) short, or says that its own is."""

    def __repr__(self) -> str:
        reported = [f"{item.name}={brief(getattr(self, item.name))}" for item in fields(self)]  # type: ignore[arg-type]
        return f"<{type(self).__name__}: {_join_texts(reported)}>"


def shorten_values(values: Any) -> Any:
    """Return values by name, and those within them, with short texts."""
    if not isinstance(values, Mapping):
        return values
    return Named({name: shorten_values(value) for name, value in values.items()})


def brief(value: Any) -> str:
    """Return a text of at most a line.

    Examples
    --------
    >>> brief(read_only([[3.0, float("nan")], [1.0, 2.0]])), brief([1] * 30), brief(0.25)
    ('array of 2 x 2: 1 ... 3', 'list of 30', '0.25')
    """
    if hasattr(value, "dtype") and getattr(value, "shape", None):
        text = _describe_array(value)
    elif isinstance(value, (Mapping, tuple, list)):
        few = not isinstance(value, Mapping) and len(value) <= 4
        is_short = few and all(isinstance(item, PLAIN_TYPES) for item in value)
        text = repr(value) if is_short else f"{type(value).__name__} of {len(value)}"
    elif is_dataclass(value) and not isinstance(value, ShortRepr):
        is_short = all(isinstance(getattr(value, item.name), PLAIN_TYPES) for item in fields(value))
        text = str(value) if is_short or type(value).__str__ is not object.__str__ else f"<{type(value).__name__}>"
    elif isinstance(value, partial):  # its text has the arrays that it is called with
        text = f"partial of {value.func.__name__}"
    else:
        text = repr(value) if isinstance(value, str) else str(value)
    return text if len(text) <= LONGEST_ITEM else text[: LONGEST_ITEM - 1] + "…"


def _describe_array(values: Any) -> str:
    import numpy as np

    shape = " x ".join(map(str, values.shape))
    finite = values[np.isfinite(values)] if values.dtype.kind == "f" else np.empty(0)
    return f"array of {shape}" + (f": {finite.min():.4g} ... {finite.max():.4g}" if len(finite) else "")


def _join_texts(texts: list[str]) -> str:
    """Return texts in a row, as many as there is room for."""
    count = sum(end <= MAX_REPR_LENGTH for end in accumulate(len(text) + 2 for text in texts))
    more = len(texts) - count
    return ", ".join(texts[:count]) + (f", ... and {more} more" if more else "")
