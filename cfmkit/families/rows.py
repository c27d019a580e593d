"""A solved mechanism as rows of curves, with a table of named quantities and a table of findings.

One mechanism is one row; a sweep, a yield or a search are many rows of one solution. Nothing is computed before it is
read: a result of one mechanism reads the tables by name at row 0, a study reads columns.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

import numpy as np

from cfmkit.arrays import LazyMapping
from cfmkit.results import Quantity

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.findings import Finder
    from cfmkit.metrics.metrics_of_rows import CurveRows
    from cfmkit.results import Finding

S = TypeVar("S")
S_co = TypeVar("S_co", covariant=True)


@dataclass(frozen=True)
class ScalarQuantity(Generic[S]):
    """A scalar result of a family: what it is, and how a solution gives it."""

    dimension: str
    definition: str
    function: Callable[[S], Any]  # of a solution: (m,) values or one for all mechanisms [SI], NaN where there is none
    reason: str | Callable[[S], str] = "there is none"  # why a solution of one mechanism has no value
    applies: Callable[[S], bool] | None = None  # False: such mechanisms do not even name it; default: all do
    words: tuple[str, ...] = ()  # what the values are indices of

    def is_of(self, solution: S) -> bool:
        """Return True if mechanisms of this kind have such a value, or a reason why not."""
        return self.applies is None or self.applies(solution)

    @property
    def about(self) -> tuple[str, str]:
        """Dimension and definition, as the record of a family lists them."""
        return self.dimension, self.definition


def values_of_one(table: Mapping[str, ScalarQuantity[S]], solution: S) -> LazyMapping[Quantity]:
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
class FindingRule(Generic[S]):
    """When a finding holds, for many mechanisms at once, and what it says of one that has it."""

    name: str
    holds: Callable[[S], Any]  # of a solution: (m,) of bool, or one for all mechanisms
    sentence: Callable[[S], tuple[Any, ...]]  # of a solution of one mechanism: message, then cures


def findings_of_one(rules: Iterable[FindingRule[S]], finding: Finder, solution: S) -> Iterator[Finding]:
    """Yield the findings of a solution of one mechanism, in the order of the rules."""
    with np.errstate(all="ignore"):
        held = [rule for rule in rules if np.ravel(rule.holds(solution))[0]]
    for rule in held:
        yield finding(rule.name, *rule.sentence(solution))


@np.errstate(all="ignore")
def findings_of_rows(rules: Iterable[FindingRule[S]], solution: S, count: int) -> dict[str, NDArray[np.bool_]]:
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
    def each(self) -> Sequence[S_co]:
        """Their solutions."""
        ...


def each_quantity(quantity: ScalarQuantity[S]) -> ScalarQuantity[Any]:
    """Return a quantity of one solution as that of several."""

    def function(several: SeveralSolutions[S]) -> FloatArray:
        return np.array([float(np.ravel(quantity.function(one))[0]) for one in several.each])

    return ScalarQuantity(*quantity.about, function, words=quantity.words)


def each_rule(rule: FindingRule[S]) -> FindingRule[Any]:
    """Return a rule on one solution as that on several."""

    def holds(several: SeveralSolutions[S]) -> NDArray[np.bool_]:
        return np.array([bool(np.ravel(rule.holds(one))[0]) for one in several.each])

    return FindingRule(rule.name, holds, lambda several: rule.sentence(several.each[0]))


class RowsSolution(Protocol):
    """Values and findings of several solved mechanisms, for studies."""

    def __len__(self) -> int:
        """Return the number of mechanisms."""
        ...

    @property
    def branches(self) -> Mapping[str, CurveRows]:
        """The nominal curve of each mechanism, by branch."""
        ...


R = TypeVar("R", bound=RowsSolution)


@dataclass(frozen=True, eq=False)
class SolvedRows(Generic[R]):
    """Mechanisms that are solved together, one a row, with what a study reads of them."""

    solution: R
    quantities: Mapping[str, ScalarQuantity[R]]
    rules: Sequence[FindingRule[R]]
    complete: NDArray[np.bool_]  # (m,) others have curves that end early: they are analysed one by one
    traced: bool = False  # whether the model is a path of each: then nothing of it is computed twice

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

    @property
    def branches(self) -> Mapping[str, CurveRows]:
        """The nominal curve of each mechanism, by branch."""
        return self.solution.branches
