"""A page of `cfmkit show`: records for JSON, and as tables for people."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    Record = Mapping[str, Any]


@dataclass(frozen=True)
class Column:
    """One column of a table: its head, and the cell of a record."""

    head: str
    cell: Callable[[Any], str]
    wraps: bool = False


@dataclass(frozen=True)
class Section:
    """A table under a heading."""

    heading: str
    records: Sequence[Record]
    columns: tuple[Column, ...]


@dataclass(frozen=True)
class Page:
    """Everything about one topic: tables for people, and the records behind them by name."""

    title: str
    text: str
    sections: tuple[Section, ...]
    data: Mapping[str, Sequence[Record]]


def field(name: str, head: str | None = None, wraps: bool = False) -> Column:
    """Return a column that shows one field of a record."""
    return Column(name if head is None else head, lambda record: str(record[name]), wraps)
