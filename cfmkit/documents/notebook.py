"""A document as a notebook shows it: its headline, notes and warnings in less than 2 000 characters, and one figure.

Tables of studies stand below, with their first rows.
"""

from __future__ import annotations

from html import escape
from types import MappingProxyType
from typing import TYPE_CHECKING

from cfmkit.tables.html import html_table

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from matplotlib.figure import Figure

    from cfmkit.documents.document import Document, PageTable

MAX_CHARACTERS = 2000  # of the text, without the figure
MAX_FACTS, MAX_WARNINGS = 5, 4  # values that are not required, and warnings, that are shown
MAX_ROWS = 10  # of a table: it is to be seen beside the code
NO_FIGURES: Mapping[str, Callable[[], Figure]] = MappingProxyType({})


def show_html(document: Document, figures: Mapping[str, Callable[[], Figure]] = NO_FIGURES, more: str = "") -> str:
    """Return the HTML of a document with its tables and the first of some figures; `more` follows."""
    from cfmkit.plots.vector_formats import first_picture

    tables = "".join(table_of(table, table.most or MAX_ROWS) for table in document.tables if table.most != 0)
    return f"<div>{text_of(document)}{tables}{first_picture(figures)}{more}</div>"


def table_of(table: PageTable, most: int | None = None) -> str:
    """Return a table as HTML, with at most `most` rows."""
    rows = [tuple(cell if isinstance(cell, str) else cell.text for cell in row) for row in table.rows[:most]]
    rest = len(table.rows) - len(rows)
    heading = f"<p>{escape(table.heading)}</p>" if table.heading else ""
    more = f"<p>{rest} more row{'s' if rest > 1 else ''}</p>" if rest else ""
    return heading + html_table(tuple(column.head for column in table.columns), rows) + more


def text_of(document: Document) -> str:
    """Return the headline, notes and warnings as HTML, requirements first, in at most `MAX_CHARACTERS`."""
    verdict = f": {escape(document.verdict)}" if document.verdict else ""
    head = f"<strong>{escape(document.title)}</strong> {escape(document.summary)}{verdict}"
    marks = {True: "ok", False: "MISSED", None: ""}
    required = [row for row in document.headline if row.required]
    facts = [row for row in document.headline if not row.required][:MAX_FACTS]
    rows = [(row.label, row.value, row.bound, marks[row.ok]) for row in (*required, *facts)]
    ends = [f"<p>{escape(note.word)}: {escape(note.text)}</p>" for note in document.notes if note.whole]
    ends += [f"<p>{escape(warning.name)}: {escape(warning.short)}</p>" for warning in document.warnings[:MAX_WARNINGS]]
    while True:
        table = html_table(("", "value", "required", ""), rows) if rows else ""
        text = head + table + "".join(ends)
        if len(text) <= MAX_CHARACTERS or not (rows or ends):
            return text
        (ends if len(ends) > 1 or not rows else rows).pop()
