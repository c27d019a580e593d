"""Solved mechanisms as rows of curves, with tables of named quantities and findings; and variants of a specification.

One mechanism is one row; a sweep, a yield or a search are many rows of one solution. Nothing is computed before it is
read: a result of one mechanism reads the tables by name at row 0, a study reads columns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import cached_property, lru_cache, wraps
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

import numpy as np

from cfmkit.arrays import LazyMapping
from cfmkit.errors import CfmError
from cfmkit.numerics.roots import bracketed_root, bracketed_roots
from cfmkit.results import Quantity
from cfmkit.specs.spec import Model
from cfmkit.specs.yamlio.paths import slots_at

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.findings import Finder
    from cfmkit.metrics.curve_rows import CurveRows
    from cfmkit.results import Finding

SolutionT = TypeVar("SolutionT")
S_co = TypeVar("S_co", covariant=True)

ItemT = TypeVar("ItemT")


def stack(items: Sequence[ItemT]) -> ItemT:
    """Return dataclasses of numbers as one, with columns where they differ: (m, 1), of arrays (k,) (k, m, 1).

    Numbers that are equal in all stay plain, so that what mechanisms have in common is computed once. A class that
    knows more of itself than its fields names it in `also_stacked`.
    """
    first: Any = items[0]
    stacked: Any = first
    if len(items) == 1:
        return items[0]
    if isinstance(first, Model):
        columns = {name: stack([vars(item)[name] for item in items]) for name in vars(first)}
        stacked = first.model_copy(update=columns)
    elif is_dataclass(first):
        stacked = object.__new__(type(first))  # without what is known of the first one
        for name in (*(item.name for item in fields(first)), *getattr(first, "also_stacked", ())):
            vars(stacked)[name] = stack([getattr(item, name) for item in items])
    elif isinstance(first, tuple):
        stacked = tuple(stack(column) for column in zip(*items, strict=True))
    elif not ((values := np.array(items)) == values[0]).all():
        stacked = np.moveaxis(values, 0, -1)[..., None]
    return stacked  # type: ignore[no-any-return]


class RowsDiffer(Exception):
    """Mechanisms side by side do not take the same way through a computation; `mask` tells two kinds apart."""

    def __init__(self, mask: NDArray[np.bool_]) -> None:
        """Keep which of them are of the one kind, (m,); all: each is to be computed alone."""
        self.mask = mask
        super().__init__("mechanisms of several kinds")


def agree(condition: Any) -> bool:
    """Return a condition on one mechanism, or the one answer of a column (m, 1).

    Raises RowsDiffer if rows of the column differ.
    """
    if not np.ndim(condition):
        return bool(condition)
    mask = np.ravel(condition)
    if not mask.all() and mask.any():
        raise RowsDiffer(mask)
    return bool(mask[0])


def fails(condition: Any) -> bool:
    """Return what is wrong with one mechanism; of a column (m, 1) nothing may be.

    Raises RowsDiffer if it holds for a row of the column: what is wrong with it is said of one mechanism.
    """
    if np.ndim(condition) and np.any(condition):
        raise RowsDiffer(np.ravel(condition))
    return False if np.ndim(condition) else bool(condition)


def remember_plain(count: int) -> Callable[[Callable[..., ItemT]], Callable[..., ItemT]]:
    """Return a decorator that keeps the last results for plain numbers; those for columns are computed anew."""

    def decorate(function: Callable[..., ItemT]) -> Callable[..., ItemT]:
        kept = lru_cache(maxsize=count)(function)

        @wraps(function)
        def call(*arguments: Any) -> ItemT:
            try:
                hash(arguments)
            except TypeError:
                return function(*arguments)
            return kept(*arguments)

        return call

    return decorate


def or_nan(value: float | None) -> float:
    """Return a number, NaN in place of None."""
    return np.nan if value is None else float(value)


def is_column(*values: Any) -> bool:
    """Return True if one of some numbers is a column."""
    return any(np.ndim(value) > 0 for value in values)


def plain_if_equal(value: Any) -> Any:
    """Return a number as it is, and a column of equal numbers as one of them."""
    return value.flat[0] if np.ndim(value) and (value == value.flat[0]).all() else value


def refuse_columns(*values: Any) -> None:
    """Raise `RowsDiffer` if one of some numbers is a column: what follows is computed for one mechanism alone."""
    if is_column(*values):
        raise RowsDiffer(np.array([True]))


def root_between(function: Callable[[Any], Any], low: Any, high: Any) -> Any:
    """Return `bracketed_root` of one mechanism, or of each row of a column.

    Raises ValueError if the function of one mechanism has no root there; RowsDiffer if that is so of some rows.
    """
    if not is_column(low, high, function(low)):
        return bracketed_root(function, low, high)
    roots = bracketed_roots(function, low, high)
    fails(np.isnan(roots))
    return roots


class PlacesKept(Generic[ItemT]):
    """A function of places of all rows that keeps its last two results.

    What is wanted on the way up is wanted again on the way down, at other places in between.
    """

    def __init__(self, function: Callable[[FloatArray], ItemT]) -> None:
        """Keep nothing yet."""
        self._function = function
        self._kept: list[tuple[FloatArray, ItemT]] = []

    def __call__(self, places: FloatArray) -> ItemT:
        """Return the result at places."""
        for places_kept, result in self._kept:
            if places_kept is places or (places_kept.shape == places.shape and (places_kept == places).all()):
                return result
        result = self._function(places)
        self._kept = [(places, result), *self._kept[:1]]
        return result


def row_of(item: ItemT, row: int) -> ItemT:
    """Return one row of what is stacked, in plain numbers."""
    return _map_columns(item, lambda column: column[..., row, 0].tolist())


def rows_of(item: ItemT, rows: Any) -> ItemT:
    """Return some rows of what is stacked, with what is known of it; plain numbers hold for every row."""
    return _map_columns(item, lambda column: column[..., rows, :])


def _map_columns(item: ItemT, function: Callable[[FloatArray], Any]) -> ItemT:
    """Return what is stacked with a function of each of its columns in place of that."""
    mapped: Any = item
    if isinstance(item, np.ndarray):
        mapped = function(item) if item.ndim > 1 else item
    elif isinstance(item, tuple):
        mapped = tuple(_map_columns(value, function) for value in item)
    elif isinstance(item, Model) or is_dataclass(item):
        columns = {name: _map_columns(value, function) for name, value in vars(item).items()}
        if isinstance(item, Model):
            mapped = item.model_copy(update=columns)
        else:
            mapped = object.__new__(type(mapped))
            vars(mapped).update(columns)
    return mapped  # type: ignore[no-any-return]


@dataclass(frozen=True)
class ScalarQuantity(Generic[SolutionT]):
    """A scalar result of a family: what it is, and how a solution gives it."""

    dimension: str
    definition: str
    function: Callable[[SolutionT], Any]  # of a solution: (m,) values or one for all mechanisms [SI], NaN if none
    reason: str | Callable[[SolutionT], str] = "there is none"  # why a solution of one mechanism has no value
    applies: Callable[[SolutionT], bool] | None = None  # False: such mechanisms do not even name it; default: all do
    words: tuple[str, ...] = ()  # what the values are indices of

    def is_of(self, solution: SolutionT) -> bool:
        """Return True if mechanisms of this kind have such a value, or a reason why not."""
        return self.applies is None or self.applies(solution)

    @property
    def about(self) -> tuple[str, str]:
        """Dimension and definition, as the record of a family lists them."""
        return self.dimension, self.definition


def quantity_of_each(
    name: str,
    about: tuple[str, str],  # dimension and definition
    # of a solution: for each mechanism the results, by name, that it has; in one that names it, the first has a reason
    of_each: Callable[[SolutionT], Iterable[Mapping[str, Quantity]]],
) -> ScalarQuantity[SolutionT]:
    """Return a result that is computed of one mechanism after the other, and that not all of them have."""

    def function(solution: SolutionT) -> FloatArray:
        of_all = [quantities.get(name) for quantities in of_each(solution)]
        return np.array(
            [np.nan if quantity is None or quantity.value is None else quantity.value for quantity in of_all]
        )

    def first(solution: SolutionT) -> Mapping[str, Quantity]:
        return next(iter(of_each(solution)))

    return ScalarQuantity(
        *about, function, lambda solution: first(solution)[name].reason, lambda solution: name in first(solution)
    )


def columns_of_absent_values(definitions: Mapping[str, tuple[str, str]]) -> dict[str, ScalarQuantity[Any]]:
    """Return what rows say of results that they never have: studies may ask for them, and their cells are empty."""
    return {
        name.partition("[")[0]: ScalarQuantity(*about, lambda _solution: np.nan, applies=lambda _solution: False)
        for name, about in definitions.items()
    }


def values_of_one(table: Mapping[str, ScalarQuantity[SolutionT]], solution: SolutionT) -> LazyMapping[Quantity]:
    """Return the scalar results of a solution of one mechanism by name, each computed when it is read."""

    @np.errstate(all="ignore")
    def compute(name: str) -> Quantity:
        quantity = table[name]
        value = float(np.ravel(quantity.function(solution))[0])
        if np.isfinite(value):
            return Quantity(value, *quantity.about, words=quantity.words)
        reason = quantity.reason if isinstance(quantity.reason, str) else quantity.reason(solution)
        return Quantity(None, *quantity.about, reason=reason)

    return LazyMapping((name for name, quantity in table.items() if quantity.is_of(solution)), compute)


@dataclass(frozen=True)
class FindingRule(Generic[SolutionT]):
    """When a finding holds, for many mechanisms at once, and what it says of one that has it."""

    name: str
    holds: Callable[[SolutionT], Any]  # of a solution: (m,) of bool, or one for all mechanisms
    sentence: Callable[[SolutionT], tuple[Any, ...]]  # of a solution of one mechanism: message, then cures
    short: Callable[[SolutionT], str] | None = None  # of the same: the consequence with its number, for pages


def findings_of_one(rules: Iterable[FindingRule[SolutionT]], finding: Finder, solution: SolutionT) -> Iterator[Finding]:
    """Yield the findings of a solution of one mechanism, in the order of the rules."""
    with np.errstate(all="ignore"):
        held = [rule for rule in rules if np.ravel(rule.holds(solution))[0]]
    for rule in held:
        yield finding(rule.name, *rule.sentence(solution), short=rule.short(solution) if rule.short else "")


@np.errstate(all="ignore")
def findings_of_rows(
    rules: Iterable[FindingRule[SolutionT]], solution: SolutionT, count: int
) -> dict[str, NDArray[np.bool_]]:
    """Return which of `count` mechanisms have which finding, (m,) by name; findings that none has are left out."""
    held: dict[str, NDArray[np.bool_]] = {}
    for rule in rules:
        mask = np.broadcast_to(np.ravel(rule.holds(solution)), count)
        if mask.any():
            held[rule.name] = held.get(rule.name, np.zeros(count, dtype=bool)) | mask
    return held


class SeveralSolutions(Protocol[S_co]):
    """Mechanisms that are solved one by one, as traced ones are."""

    @property
    def solutions(self) -> Sequence[S_co]:
        """Their solutions."""
        ...


def each_quantity(quantity: ScalarQuantity[SolutionT]) -> ScalarQuantity[Any]:
    """Return a quantity of one solution as that of several."""

    def function(several: SeveralSolutions[SolutionT]) -> FloatArray:
        return np.array([float(np.ravel(quantity.function(solution))[0]) for solution in several.solutions])

    return ScalarQuantity(*quantity.about, function, words=quantity.words)


def each_rule(rule: FindingRule[SolutionT]) -> FindingRule[Any]:
    """Return a rule on one solution as that on several."""

    def holds(several: SeveralSolutions[SolutionT]) -> NDArray[np.bool_]:
        return np.array([bool(np.ravel(rule.holds(solution))[0]) for solution in several.solutions])

    return FindingRule(rule.name, holds, lambda several: rule.sentence(several.solutions[0]))


class RowsSolution(Protocol):
    """Values and findings of several solved mechanisms, for studies."""

    def __len__(self) -> int:
        """Return the number of mechanisms."""
        ...

    @property
    def branches(self) -> Mapping[str, CurveRows]:
        """The nominal curve of each mechanism, by branch: made anew, since curves refer to their solution."""
        ...


RowsT = TypeVar("RowsT", bound=RowsSolution)


class Variants(Sequence[Any]):
    """Variants of a specification that differ in some values; each is validated when it is read, not before.

    Reading one raises `CfmError` if its values are not valid. A family that knows which of its numbers need not agree
    with anything else reads `values`, and asks whether each keeps the bounds that the specification's type sets.

    Parameters
    ----------
    spec : Spec
        What is varied.
    values : mapping of str to (k,) array
        By dotted path, SI.
    make : callable
        Returns the specification of one of them, by its index.
    size : int
        Number of variants.
    as_made : bool, optional
        Whether they are manufactured parts, whose values need not agree as stated ones do.
    """

    def __init__(
        self,
        spec: Any,
        values: Mapping[str, NDArray[Any]],
        make: Callable[[int], Any],
        size: int,
        as_made: bool = False,
    ) -> None:
        """Make nothing yet."""
        self.spec, self.values, self._make, self._size, self.as_made = spec, values, make, size, as_made
        self._made: dict[int, Any] = {}

    def __len__(self) -> int:
        """Return the number of variants."""
        return self._size

    def __getitem__(self, index: Any) -> Any:
        """Return the specification of one."""
        if index not in self._made:
            self._made[index] = self._make(index)
        return self._made[index]

    def keep_bounds(self, paths: Iterable[str]) -> NDArray[np.bool_]:
        """Return which variants have values at some paths that are within bounds, (k,)."""
        kept = np.ones(len(self), dtype=bool)
        for path in paths:
            number = next(slot for slot in slots_at(type(self.spec), path) if slot.origin in (float, int))
            kept &= number.allows(self.values[path].astype(np.float64))
        return kept

    def validate_each(self, plain: Collection[str]) -> Iterator[tuple[int, Any]]:
        """Yield (index, specification) of valid variants; where only plain numbers vary their bounds alone are checked.

        `plain`: paths of numbers that need not agree with anything else.
        """
        if not self.values.keys() <= set(plain):
            yield from valid(self)
            return
        columns = {path: values.astype(np.float64).tolist() for path, values in self.values.items()}
        for index in np.flatnonzero(self.keep_bounds(columns)).tolist():
            yield index, with_values(self.spec, {path: column[index] for path, column in columns.items()})


def valid(specs: Sequence[ItemT], indices: Iterable[int] | None = None) -> Iterator[tuple[int, ItemT]]:
    """Yield (index, specification) of those, or of some of those, whose values are valid."""
    for index in range(len(specs)) if indices is None else indices:
        try:
            spec = specs[index]
        except CfmError:  # whoever analyses it alone says what is wrong with it
            continue
        yield index, spec


def with_values(block: ItemT, values: Mapping[str, Any]) -> ItemT:
    """Return a copy of a specification, or of a block of it, with other values at dotted paths; nothing is validated.

    Numbers may be columns (m, 1): then it is one of m mechanisms.
    """
    inner: dict[str, dict[str, Any]] = {}
    changes: dict[str, Any] = {}
    for path, value in values.items():
        head, _, rest = path.partition(".")
        if rest:
            inner.setdefault(head, {})[rest] = value
        else:
            changes[head] = value
    items: Any = block
    if isinstance(items, tuple):
        return tuple(changes.get(str(k), item) for k, item in enumerate(items))  # type: ignore[return-value]
    changes |= {head: with_values(getattr(items, head), below) for head, below in inner.items()}
    return items.model_copy(update=changes)  # type: ignore[no-any-return]


def drop_numbers(value: Any) -> Any:
    """Return what mechanisms that are solved together have in common: all of a block but the values of its numbers."""
    if isinstance(value, Model | tuple):
        items = value if isinstance(value, tuple) else vars(value).values()
        return ["number" if type(item) is float else item and drop_numbers(item) for item in items]
    return "number" if isinstance(value, float) else value


@dataclass(frozen=True, eq=False)
class SolvedRows(Generic[RowsT]):
    """Mechanisms that are solved together, one a row, with what a study reads of them."""

    solution: RowsT
    quantities: Mapping[str, ScalarQuantity[RowsT]]
    rules: Sequence[FindingRule[RowsT]]
    complete: NDArray[np.bool_]  # (m,) others have curves that end early: they are analysed one by one
    traced: bool = False  # whether each is a path, or a search: few are done at once, and nothing is computed twice

    @np.errstate(all="ignore")
    def value(self, name: str) -> FloatArray | None:
        """Return a scalar result of each mechanism, (m,) [SI], NaN where there is none; None for an unknown name."""
        if name not in self.quantities:
            return None
        if not self.quantities[name].is_of(self.solution):
            return np.full(len(self.solution), np.nan)
        return np.broadcast_to(np.ravel(self.quantities[name].function(self.solution)), len(self.solution))

    def findings(self) -> dict[str, NDArray[np.bool_]]:
        """Return which mechanisms have which finding, (m,) by name."""
        return findings_of_rows(self.rules, self.solution, len(self.solution))

    @cached_property
    def branches(self) -> Mapping[str, CurveRows]:
        """The nominal curve of each mechanism, by branch."""
        return self.solution.branches
