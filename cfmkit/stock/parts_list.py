"""The list of parts to buy for a mechanism: `parts.csv`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.tables import Table, TableColumn, text_column

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence


@dataclass(frozen=True)
class BoughtPart:
    """A part that is bought."""

    place: str  # what it does in the mechanism
    name: str  # by which it is ordered; empty where none is stated
    count: int  # how many of it
    data: str = ""  # what decides whether another one would do


def parts_table(parts: Sequence[BoughtPart]) -> Table:
    """Return the list as a table: place, name, count, data."""
    place, name, data = (text_column(key, (getattr(one, key) for one in parts)) for key in ("place", "name", "data"))
    return Table((place, name, TableColumn("count", tuple(one.count for one in parts)), data))


def listed(parts: Sequence[BoughtPart]) -> dict[str, Callable[[], Table]]:
    """Return the list as a result carries it; empty where nothing is bought by name."""
    return {"parts": lambda: parts_table(parts)} if parts else {}
