"""The list of parts to make and to buy for a mechanism: `parts.csv`, numbered as the assembly drawing numbers them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Literal

from cfmkit.tables import Table, TableColumn, text_column

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence


@dataclass(frozen=True)
class ListedPart:
    """One line of the list: equal parts that are made or bought."""

    place: str  # what it does in the mechanism
    name: str  # by which it is ordered or drawn; empty where none is stated
    count: int  # how many of it
    data: str = ""  # what decides whether another one would do
    source: Literal["buy", "make"] = "buy"
    size: str = ""  # main dimensions
    standard: str = ""  # of its sizes
    body: str = ""  # name of its bodies in the assembly drawing; empty if it is not drawn


def parts_table(parts: Sequence[ListedPart]) -> Table:
    """Return the list as a table: item, place, name, count, data, source, size, standard."""
    columns = {
        key: text_column(key, (getattr(part, key) for part in parts))
        for key in ("place", "name", "data", "source", "size", "standard")
    }
    item = TableColumn("item", tuple(range(1, len(parts) + 1)))
    count = TableColumn("count", tuple(part.count for part in parts))
    first = [columns.pop(key) for key in ("place", "name")]
    return Table((item, *first, count, *columns.values()))


def parts_tables(parts: Callable[[], Iterable[ListedPart]]) -> dict[str, Callable[[], Table]]:
    """Return the list as a result carries it, computed when it is written."""
    return {"parts": partial(_parts_table_of, parts)}


def _parts_table_of(parts: Callable[[], Iterable[ListedPart]]) -> Table:
    return parts_table(tuple(parts()))
