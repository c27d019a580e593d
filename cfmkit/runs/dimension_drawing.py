"""Dimension drawings: a family's mechanism with its dimensions named, as files that come with the family's package.

Each text of the class ``row`` in the SVG is a row of the table of dimensions: a `tspan` with the symbol, one with the
key of the specification, and the lines of what it is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.errors import UsageError, visible

if TYPE_CHECKING:
    from cfmkit.families.base import Family

DRAWING_FILE = "dimensions.svg"
DRAWING_SUFFIXES = (".png", ".svg", ".pdf")


def find_drawn_family(name: str | None) -> Family:
    """Return the family of that name, which has a drawing.

    Raises UsageError if there is no such family, or it has no drawing.
    """
    from cfmkit.families import family, records

    names = ", ".join(record.name for record in records() if record.file(DRAWING_FILE))
    if name is None:
        raise UsageError(f"--figure needs a family: {names}")
    record = family(name)
    if not record.file(DRAWING_FILE):
        raise UsageError(f"the family {visible(name)!r} has no drawing; there are {names}")
    return record


def read_drawing(record: Family) -> dict[str, bytes]:
    """Return the drawing of a family by the ending of its file: ``.svg``, and those of `DRAWING_SUFFIXES` there."""
    stem = DRAWING_FILE.removesuffix(".svg")
    files = {ending: record.file(stem + ending) for ending in DRAWING_SUFFIXES}
    return {ending: file.read_bytes() for ending, file in files.items() if file is not None}


def read_dimensions(record: Family) -> list[dict[str, str]]:
    """Return ``symbol``, ``key`` of the specification and ``meaning`` of each row of the drawing's table.

    Raises UsageError if the drawing is no SVG, or a row has no symbol or key.
    """
    from xml.etree import ElementTree

    rows = []
    try:
        for text in ElementTree.fromstring(record.read(DRAWING_FILE)).iterfind(".//{*}text[@class='row']"):
            symbol, key, *meaning = ("".join(part.itertext()) for part in text)
            rows.append({"symbol": symbol, "key": key, "meaning": " ".join(meaning)})
    except (ElementTree.ParseError, ValueError) as error:
        raise UsageError(f"{record.folder}/{DRAWING_FILE} has no rows of symbol, key, meaning: {error}") from None
    return rows
