"""A plan of a study whose points are given."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping


class GivenPoints:
    """Points of a study by their values: dotted path -> values, (n,) each."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        self.paths, self.columns = tuple(values), tuple(np.array(column) for column in values.values())

    def __len__(self) -> int:
        return len(self.columns[0])

    def point(self, index: int) -> tuple[Any, ...]:
        return tuple(column[index].item() for column in self.columns)

    def block(self, start: int, stop: int) -> tuple[Any, ...]:
        return tuple(column[start:stop] for column in self.columns)
