"""Writing and strict reading of cfmkit's own CSV files, without loss, and writing of JSON.

`read_csv` returns the table given to `to_csv`. Files are RFC 4180 in UTF-8 with line feeds, headers such as ``force
[N]``, no comment lines. Floats have the fewest digits that read back as the same float, integers no dot, missing values
are empty cells. A cell is quoted if the format needs it, or if a text would otherwise read as a number. A text that a
spreadsheet would compute as a formula gets an apostrophe before it, which `read_csv` removes: names come from other
people, and a formula can fetch what is in other cells.
"""

from __future__ import annotations

import json
import re
from itertools import repeat
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import CfmError, DataError, UsageError, reason_of
from cfmkit.tables.table import HEADER_PATTERN, Cell, Table, TableColumn, Values

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.arrays import FloatArray


_CHUNK_ROWS = 8192  # rows that are formatted at one time: large enough for speed, small beside the table itself
_INTEGER_PATTERN = re.compile(r"-?(?:0|[1-9][0-9]*)")
_NUMBER_PATTERN = re.compile(_INTEGER_PATTERN.pattern + r"(?:\.[0-9]+)?(?:e[-+]?[0-9]+)?|-?inf")
_SPECIAL_CHARACTERS = re.compile(r'[",\r\n]')
_FORMULA_START = re.compile("'*\\s*[=+\\-@\uff1d\uff0b\uff0d\uff20].", re.DOTALL)
"""How a formula begins in a spreadsheet, blanks and full-width signs included, after any number of apostrophes."""
_TOKEN_PATTERN = re.compile(r'("(?:[^"]|"")*"|[^",\r\n]*)([,\n])')


def to_csv(table: Table) -> bytes:
    """Return the whole table as the bytes of a CSV file."""
    return b"".join(csv_chunks(table))


def csv_chunks(table: Table) -> Iterator[bytes]:
    """Yield the CSV of a table piece by piece, for tables that are large."""
    lone = len(table.columns) == 1
    if table.columns:
        yield _encode_rows([[_format_cell(header)] for header in table.headers])
    for start in range(0, len(table), _CHUNK_ROWS):
        columns = [_format_column(column.values[start : start + _CHUNK_ROWS]) for column in table.columns]
        if lone:  # an empty line would not count as a row
            columns = [[text or '""' for text in columns[0]]]
        yield _encode_rows(columns)


def _encode_rows(columns: Sequence[Sequence[str]]) -> bytes:
    """Return rows as UTF-8; bytes that were never text (an odd file name) stand as ``\\udc..``."""
    return ("\n".join(map(",".join, zip(*columns, strict=True))) + "\n").encode("utf-8", "backslashreplace")


def _format_column(values: Values) -> list[str]:
    if isinstance(values, tuple):
        if set(map(type, values)) <= {str, type(None)}:  # names of branches and states: few, many times
            cell_texts = {cell: _format_cell(cell) for cell in set(values)}
            return [cell_texts[cell] for cell in values]
        return list(map(_format_cell, values))
    texts = list(map(repr, values.tolist()))
    if values.dtype.kind == "f" and np.isnan(values).any():
        return ["" if text == "nan" else text for text in texts]
    return texts


def _format_cell(cell: Cell) -> str:
    if cell is None:
        return ""
    if not isinstance(cell, str):
        return repr(cell)
    is_number = _NUMBER_PATTERN.fullmatch(cell)
    if not is_number and _FORMULA_START.match(cell):
        cell = f"'{cell}"
    if is_number or _SPECIAL_CHARACTERS.search(cell):
        return '"' + cell.replace('"', '""') + '"'
    return cell


def read_csv(
    source: str | bytes | Path,  # the text itself, its bytes, or the file that holds it
) -> Table:
    """Return the table in a CSV file that cfmkit wrote.

    Strict: measured data of other origin is read by `cfmkit.experiment`.

    Raises DataError with the line of the first thing that cfmkit would not have written; UsageError if the file cannot
    be read.
    """
    name = str(source) if isinstance(source, Path) else "CSV"
    rows = _parse_rows(_decode_source(source, name), name)
    _, headers = next(rows)
    body = []
    for line, row in rows:
        if len(row) != len(headers):
            raise DataError(f"{name}:{line}: has {len(row)} cells, but the header has {len(headers)}")
        body.append(row)
    try:
        return Table(tuple(map(_parse_column, headers, zip(*body, strict=True) if body else repeat(()))))
    except CfmError as error:
        raise DataError(f"{name}: {error}") from None


def _decode_source(source: str | bytes | Path, name: str) -> str:
    """Return the text of `source`, checked for what concerns the whole file."""
    try:
        data = source.read_bytes() if isinstance(source, Path) else source
        text = data.decode("utf-8") if isinstance(data, bytes) else data
    except OSError as error:
        raise UsageError(f"{name}: cannot be read: {reason_of(error)}") from None
    except UnicodeDecodeError as error:
        raise DataError(f"{name}: byte {error.start + 1} is not UTF-8") from None
    if not text.endswith("\n"):
        raise DataError(f"{name}: {'the last line is cut off' if text else 'the file is empty'}")
    return text


def _parse_rows(text: str, name: str) -> Iterator[tuple[int, list[str]]]:
    """Yield (line number, raw cells) of every row."""
    if '"' not in text and "\r" not in text:
        yield from ((line, row.split(",")) for line, row in enumerate(text[:-1].split("\n"), start=1))
        return
    place, start = 0, 1
    row: list[str] = []
    while place < len(text):
        if not (token := _TOKEN_PATTERN.match(text, place)):
            line = 1 + text.count("\n", 0, place)
            raise DataError(f"{name}:{line}: a quote or a carriage return is out of place")
        row.append(token[1])
        place = token.end()
        if token[2] == "\n":
            yield start, row
            start, row = start + 1 + sum(cell.count("\n") for cell in row), []


def _parse_column(header: str, cells: Sequence[str]) -> TableColumn:
    """Return the column of a header and raw cells."""
    match = HEADER_PATTERN.fullmatch(_unquote(header))
    if not match:
        raise CfmError(f"{_unquote(header)!r} is not a header such as 'force [N]'")
    values = _plain_floats(cells)
    return TableColumn(match["name"], tuple(map(_parse_cell, cells)) if values is None else values, match["unit"])


def _plain_floats(cells: Sequence[str]) -> FloatArray | None:
    """Return the floats in a column that has nothing else: three times faster than cell by cell."""
    try:
        values = list(map(float, cells))
    except ValueError:
        return None
    array = np.array(values, dtype=np.float64)
    return array if values and list(map(repr, values)) == list(cells) and not np.isnan(array).any() else None


def _parse_cell(raw: str) -> Cell:
    if not raw:
        return None
    if _NUMBER_PATTERN.fullmatch(raw):
        return int(raw) if _INTEGER_PATTERN.fullmatch(raw) else float(raw)
    return _unquote(raw)


def _unquote(raw: str) -> str:
    text = raw[1:-1].replace('""', '"') if raw.startswith('"') else raw
    return text[1:] if text.startswith("'") and _FORMULA_START.match(text) else text


def json_bytes(data: Any) -> bytes:
    """Return JSON with two spaces, in the order given, UTF-8, a line feed at the end.

    Raises ValueError if there is a NaN or an infinity inside: no reader of JSON takes them.

    Examples
    --------
    >>> json_bytes({"value": None})
    b'{\\n  "value": null\\n}\\n'
    """
    return (json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode("utf-8", "backslashreplace")
