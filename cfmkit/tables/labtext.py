"""From the bytes of a lab file to lines of text, and to what separates numbers in them.

Nothing is assumed about a file but that it ends in a block of lines with the same
number of cells, at least two of which are numbers in every line. What stands above
that block is a header or of no concern; a few lines of text below it may follow.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from dataclasses import dataclass

from cfmkit.errors import DataError

SEPARATORS = {";": "semicolon", "\t": "tab", ",": "comma", " ": "spaces"}
"""What may stand between cells, in the order in which it is tried, and its name."""

MOST_FOOT_LINES = 20
_SAMPLE = 40
_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_DIGITS = r"[-+]?(?:[0-9]+(?:{0}[0-9]+)?{1}|{0}[0-9]+)(?:[eE][-+]?[0-9]+)?"
_NUMBERS = {".": re.compile(_DIGITS.format(r"\.", r"\.?")), ",": re.compile(_DIGITS.format(",", ""))}
_GROUPED = re.compile(r"[-+]?[0-9]{1,3}(?:([.,' \u00a0\u2009\u202f])[0-9]{3})+(?:[.,][0-9]*)?")


@dataclass(frozen=True)
class Dialect:
    """How the numbers of a file are written.

    Attributes
    ----------
    separator : str
        Between cells; a space stands for any number of spaces and tabs.
    decimal : {".", ","}
        The decimal sign.
    quoted : bool
        Whether cells are quoted.
    """

    separator: str
    decimal: str
    quoted: bool = False

    def cells(self, line: str) -> list[str]:
        """Return the cells of one line, without the blanks around them."""
        if self.separator == " ":
            return line.split()
        if self.quoted:
            return [cell.strip() for cell in next(csv.reader([line], delimiter=self.separator), [])]
        return [cell.strip() for cell in line.split(self.separator)]

    def is_number(self, cell: str) -> bool:
        """Return whether a cell is a number in this dialect."""
        return _NUMBERS[self.decimal].fullmatch(cell) is not None


@dataclass(frozen=True)
class TextBlock:
    """The block of numbers in a file.

    Attributes
    ----------
    dialect : Dialect
        How it is written.
    first, last : int
        Indices of its first line and of the line after its last one.
    width : int
        Cells in each line.
    numeric : tuple of int
        The columns that hold numbers.
    """

    dialect: Dialect
    first: int
    last: int
    width: int
    numeric: tuple[int, ...]


def decoded(data: bytes, name: str) -> tuple[str, str]:
    """Return the text of a file and the name of its encoding.

    Raises
    ------
    cfmkit.errors.DataError
        If it is not a text.
    """
    encoding = next((told for mark, told in _MARKS if data.startswith(mark)), "")
    if not encoding and b"\0" in data[:4096]:
        even, odd = data[:4096:2].count(0), data[1:4096:2].count(0)
        encoding = "utf-16-le" if odd > 8 * even else "utf-16-be" if even > 8 * odd else "ascii"
    for candidate in (encoding,) if encoding else ("utf-8", "latin-1"):
        try:
            text = data.decode(candidate)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text, candidate
    raise DataError(f"{name}: is not a text file; export the measurement as CSV")


def block_of(lines: list[str], name: str) -> TextBlock:
    """Return where the numbers are and how they are written.

    Raises
    ------
    cfmkit.errors.DataError
        If there are none, or a thousands separator leaves their meaning open.
    """
    filled = [index for index, line in enumerate(lines) if line.strip()]
    if not filled:
        raise DataError(f"{name}: the file is empty")
    # Most lines before the last few are data, whatever stands above and below them.
    middle = filled[len(filled) // 3 : max(len(filled) - 2, 1)] or filled
    sample = [lines[index] for index in middle[:: max(len(middle) // _SAMPLE, 1)]]
    found = [(score, dialect) for dialect in _dialects(sample) if (score := _score(dialect, sample))[0] > 0]
    if not found:
        _refuse_groups(sample, name)
        raise DataError(
            f"{name}: there is no block of lines with at least two numbers, separated by semicolon, tab, comma or "
            "spaces"
        )
    (share, width), dialect = max(found, key=lambda item: item[0][0])
    if share < 0.5 * len(sample) or not all(map(dialect.is_number, dialect.cells(sample[0]))):
        _refuse_groups(sample, name)
    return _bounded(lines, dialect, width, name)


def _dialects(sample: list[str]) -> list[Dialect]:
    quoted = any('"' in line for line in sample)
    found = [Dialect(separator, decimal, quoted) for separator in SEPARATORS for decimal in ".,"]
    return [item for item in found if item.separator != "," or item.decimal == "." or quoted]


def _score(dialect: Dialect, sample: list[str]) -> tuple[int, int]:
    """Return how many lines are data in this dialect, and how many cells they have."""
    rows = [dialect.cells(line) for line in sample]
    good = [len(row) for row in rows if sum(map(dialect.is_number, row)) >= 2]
    if not good:
        return 0, 0
    width, count = Counter(good).most_common(1)[0]
    return count, width


def _bounded(lines: list[str], dialect: Dialect, width: int, name: str) -> TextBlock:
    """Return the block between the first and the last line of data."""
    filled = [index for index, line in enumerate(lines) if line.strip()]

    def usual(index: int) -> bool:
        row = dialect.cells(lines[index])
        return len(row) == width and sum(map(dialect.is_number, row)) >= 2

    first = next(index for index in filled if usual(index))
    last = next(index for index in reversed(filled) if usual(index))
    # Cut off at the end a table has a line that is neither data nor text: it belongs to the block, to be found there.
    foot = [index for index in filled if index > last]
    if foot and any(map(dialect.is_number, dialect.cells(lines[foot[0]]))):
        last = foot[0]
    if (left := len([index for index in filled if index > last])) > MOST_FOOT_LINES:
        raise DataError(f"{name}: line {last + 2}: the numbers end, but {left} more lines follow; remove them")
    inside = [index for index in filled if first <= index <= last]
    chosen = [dialect.cells(lines[index]) for index in inside[:: max(len(inside) // _SAMPLE, 1)]]
    rows = [row for row in chosen if len(row) == width]
    numeric = tuple(
        column for column in range(width) if 2 * sum(dialect.is_number(row[column]) for row in rows) > len(rows)
    )
    return TextBlock(dialect, first, last + 1, width, numeric)


def header_cells(line: str, block: TextBlock) -> list[str]:
    """Return the cells of a header, as many as the block is wide where that can be done.

    Quotes are understood even where the numbers have none, and a leading ``#`` or ``%`` is dropped.
    """
    line = line.strip().lstrip("#%!").strip() if line.lstrip()[:1] in ("#", "%", "!") else line
    separator = block.dialect.separator
    if separator != " ":
        cells = Dialect(separator, ".", '"' in line).cells(line)
        short = range(len(cells), block.width)
        return cells + [""] * len(short) if len(cells) > 1 and not set(short) & set(block.numeric) else cells
    ways = (line.split(), re.split(r"\s{2,}|\t", line.strip()), re.findall(r"[^\[(]*[\[(][^\])]*[\])]", line))
    return next((cells for cells in ways if len(cells) == block.width), ways[0])


def _refuse_groups(sample: list[str], name: str) -> None:
    """Raise if cells have a thousands separator."""
    for separator in (";", "\t", None):
        for line in sample:
            for cell in csv.reader([line], delimiter=separator) if separator else [line.split()]:
                for text in cell:
                    refuse_group(text.strip(), name)


def refuse_group(cell: str, name: str) -> None:
    """Raise if a cell is a number with a thousands separator that leaves no doubt.

    Raises
    ------
    cfmkit.errors.DataError
        Naming it.
    """
    match = _GROUPED.fullmatch(cell)
    if match and (match[1] not in ".," or sum(map(cell.count, ".,")) > 1):
        raise DataError(f"{name}: {cell!r} has a thousands separator; export the numbers without one")
