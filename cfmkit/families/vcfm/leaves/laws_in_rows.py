"""Laws of several leaves as one law, one leaf a row: numbers become columns (r, 1), and travels are (r, n)."""

from __future__ import annotations

from dataclasses import dataclass, fields, is_dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray

LawT = TypeVar("LawT")


def stack_laws(laws: Sequence[LawT]) -> LawT:
    """Return laws of one kind as one law with a row for each; one alone is returned as it is, with plain numbers.

    Examples
    --------
    >>> from cfmkit.families.vcfm.leaves.positive_stiffness_springs import Coils
    >>> stack_laws([Coils(100.0), Coils(200.0)]).force(0.1).tolist()
    [[10.0], [20.0]]
    """
    first: Any = laws[0]
    if len(laws) == 1:
        return laws[0]
    if getattr(first, "one_by_one", False):  # its tables and searches are not arrays over leaves
        column = np.empty((len(laws), 1), dtype=object)
        column[:, 0] = laws
        return LawsOneByOne(column)  # type: ignore[return-value]
    if not is_dataclass(first):
        return np.array(laws, dtype=float)[:, None]  # type: ignore[return-value]
    columns = {item.name: stack_laws([getattr(law, item.name) for law in laws]) for item in fields(first)}
    return type(laws[0])(**columns)


@dataclass(frozen=True)
class LawsOneByOne:
    """Laws that are asked one after the other, each for its row of travels (r, n)."""

    column: NDArray[np.object_]  # (r, 1)

    @property
    def laws(self) -> list[Any]:
        """The law of each row."""
        return list(self.column[:, 0])

    @cached_property
    def strip(self) -> Any:
        """The leaves' dimensions, a row each."""
        return stack_laws([law.strip for law in self.laws])

    def force(self, travel: FloatArray) -> FloatArray:
        """Return the force of each leaf along the motion [N]."""
        return np.asarray(self._each("force", travel))

    def stress(self, travel: FloatArray) -> FloatArray:
        """Return the largest stress of each leaf [Pa]."""
        return np.asarray(self._each("stress", travel))

    def state(self, travel: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return `force` and `stress`."""
        return self.force(travel), self.stress(travel)

    def is_buckled(self, travel: FloatArray) -> Any:
        """Return whether each leaf is buckled."""
        return self._each("is_buckled", travel)

    def _each(self, name: str, travel: FloatArray) -> Any:
        own = np.broadcast_to(travel, (len(self.laws), travel.shape[1]))
        return np.stack([np.asarray(getattr(law, name)(row)) for law, row in zip(self.laws, own, strict=True)])

    def __getattr__(self, name: str) -> Any:
        """Return what the laws know of themselves: a column, or a column for each of several numbers."""
        if name.startswith("__"):
            raise AttributeError(name)
        values = np.array([np.ravel(getattr(law, name)) for law in self.laws], dtype=float)
        return values if values.shape[1] == 1 else tuple(column[:, None] for column in values.T)
