"""A document as a notebook shows it: its headline, notes and warnings in less than 2 000 characters, and one figure."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from cfmkit.tables.html import html_table

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from matplotlib.figure import Figure

    from cfmkit.documents.document import Document

MAX_CHARACTERS = 2000
"""Of the text, without the figure."""

MAX_FACTS, MAX_WARNINGS = 5, 4
"""Values that are not required, and warnings, that are shown."""


def shown(document: Document, figures: Mapping[str, Callable[[], Figure]]) -> str:
    """Return the HTML of a document with the first of some figures."""
    from cfmkit.plots.vector_formats import first_picture

    return f"<div>{text_of(document)}{first_picture(figures)}</div>"


def text_of(document: Document) -> str:
    """Return the text as HTML: as many rows as there is room for, requirements first."""
    head = f"<strong>{escape(document.title)}</strong> {escape(document.summary)}: {escape(document.verdict)}"
    marks = {True: "ok", False: "MISSED", None: ""}
    required = [row for row in document.headline if row.required]
    facts = [row for row in document.headline if not row.required][:MAX_FACTS]
    rows = [(row.label, row.value, row.bound, marks[row.ok]) for row in (*required, *facts)]
    ends = [f"<p>{escape(note.word)}: {escape(note.text)}</p>" for note in document.notes if note.whole]
    ends += [f"<p>{escape(one.name)}: {escape(one.short)}</p>" for one in document.warnings[:MAX_WARNINGS]]
    while True:
        table = html_table(("", "value", "required", ""), rows) if rows else ""
        text = head + table + "".join(ends)
        if len(text) <= MAX_CHARACTERS or not (rows or ends):
            return text
        (ends if len(ends) > 1 or not rows else rows).pop()
