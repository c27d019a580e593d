"""Tables as HTML, for notebooks: every cell is text, whatever it holds."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cfmkit.tables.table import Table

MOST_ROWS = 10  # rows of a long table that a notebook shows: it is to be seen beside the code


def html_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return texts as a table.

    Examples
    --------
    >>> html_table(["a"], [["<b>"]])
    '<table><thead><tr><th>a</th></tr></thead><tbody><tr><td>&lt;b&gt;</td></tr></tbody></table>'
    """
    heads = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    body = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows)
    return f"<table><thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table>"


def first_rows(table: Table) -> str:
    """Return the first rows of a table, with a line that says how many there are."""
    columns = [[_cell_text(cell) for cell in column.cells()[:MOST_ROWS]] for column in table.columns]
    rest = len(table) - MOST_ROWS
    more = f"<p>{rest} more rows</p>" if rest > 0 else ""
    return html_table(table.headers, zip(*columns, strict=True)) + more


def _cell_text(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else "" if value is None else str(value)
