"""From the bytes of a lab file to its tables: rows of cells below a header.

Nothing is assumed about a file but that it holds a table: lines with the same number of cells, at least two of which
are numbers, in the same places. Six rules read all exports that we know:

1. A cell is a number if it is one, perhaps with a unit behind it. Any of the signs that look like a minus is one.
2. Separator and decimal sign are those with which most lines of the file's middle have numbers in most cells.
3. A line without a value is no line. A table is an unbroken run of lines with numbers in its places.
4. Names and units stand in the nearest lines above a table that have its width.
5. A column of units beside a column of numbers belongs to it.
6. What these rules leave open is refused, with the choices; nothing is guessed.
"""

from __future__ import annotations

import codecs
import csv
import itertools
import re
from collections import Counter
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import DataError
from cfmkit.specs.units.strict_decimal_number import quote
from cfmkit.tables.lab_columns import (
    CELLS_SOURCE,
    ColumnInfo,
    describe,
    dimension_of,
    is_unit_row,
    split_header,
    standard_spelling,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cfmkit.arrays import FloatArray


SEPARATOR_NAMES = {";": "semicolon", "\t": "tab", ",": "comma", "|": "bar", " ": "spaces"}
"""What may stand between cells, in the order in which it is tried, and its name."""
LONGEST_LINE = 100_000  # characters of a line that is read: the reader of quoted cells takes 131072 in one
HEADER_LINES = 5  # so many lines above the numbers are searched for their names
UNIT_LINES = 40  # so many lines above the numbers are searched for a line of units that says so: LabVIEW's are far up
FEWEST_ROWS = 8  # a shorter run of lines with numbers is a part of some preamble where there is a longer one
_N_SAMPLE_LINES = 40
_BYTE_ORDER_MARKS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))
_DIGITS_PATTERN = (
    r"([-+]? ?(?:[0-9]+(?:{0}[0-9]+)?{1}|{0}[0-9]+)(?:[eE][-+]?[0-9]+)?)(?:\s*([^\s\d.,;:+-]\S*(?: \S+)?))?"
)
_NUMBER_PATTERNS = {
    ".": re.compile(_DIGITS_PATTERN.format(r"\.", r"\.?")),
    ",": re.compile(_DIGITS_PATTERN.format(",", "")),
}
_PLAIN_CHARACTERS = frozenset("0123456789.+-eE\n")
_GROUPED_PATTERN = re.compile(r"[-+]?[0-9]{1,3}(?:([.,' \u00a0\u2009\u202f])[0-9]{3})+(?:[.,][0-9]*)?")
_MINUS_PATTERN = re.compile(r"[\u2010-\u2013\u2212\ufe63\uff0d](?=\s?[0-9.,])")
EMPTY_CHARACTERS = ' \t\r;,|"\u00a0-=:+*_'  # what a line without a value may hold


@dataclass(frozen=True)
class Dialect:
    """Notation of the numbers of a file."""

    separator: str  # between cells; a space stands for any number of spaces and tabs
    decimal: str  # "." or ","
    quoted: bool = False  # whether there are quoted cells

    def cells(self, line: str) -> list[str]:
        """Return the cells of one line, without the blanks around them."""
        if self.separator == " ":
            return line.split()
        if self.quoted:
            return [cell.strip() for cell in next(csv.reader([line], delimiter=self.separator), [])]
        return [cell.strip() for cell in line.split(self.separator)]

    def number(self, cell: str) -> tuple[float, str] | None:
        """Return the number in a cell and the unit behind it, "" where there is none; None if it is no number."""
        match = _NUMBER_PATTERNS[self.decimal].fullmatch(cell)
        if match is None or (match[2] and dimension_of(match[2]) is None):
            return None
        return float(match[1].replace(",", ".").replace(" ", "")), standard_spelling(match[2]) if match[2] else ""

    def is_number(self, cell: str) -> bool:
        """Return whether a cell is a number in this dialect, perhaps with a unit."""
        match = _NUMBER_PATTERNS[self.decimal].fullmatch(cell)
        return match is not None and (not match[2] or dimension_of(match[2]) is not None)


@dataclass(frozen=True)
class RowPattern:
    """Common pattern of the lines of a table."""

    dialect: Dialect
    width: int  # cells in each line
    numeric: tuple[int, ...]  # columns that hold numbers
    blank: tuple[int, ...]  # columns left of them that hold nothing: what stands there labels a line of a preamble

    def row(self, line: str) -> list[str]:
        """Return the cells of a line, as many as there are columns or more."""
        cells = self.dialect.cells(line)
        return cells + [""] * (self.width - len(cells))

    def numbers_in(self, line: str) -> int:
        """Return how many of the columns with numbers have one in a line."""
        cells = self.row(line)
        return sum(self.dialect.is_number(cells[column]) for column in self.numeric)

    def is_row(self, line: str) -> bool:
        """Return whether a line has what every row has, and no word where rows have nothing."""
        cells = self.row(line)
        full = len(self.dialect.cells(line)) == self.width and self.numbers_in(line) == len(self.numeric)
        return full and not any(cells[column] for column in self.blank)


@dataclass(frozen=True, eq=False)
class LabTable:
    """A table of a lab file."""

    file: str  # for messages
    shape: RowPattern
    lines: list[str]  # all of the file
    rows: tuple[int, ...]  # indices of the lines of the table
    columns: tuple[ColumnInfo, ...]
    header: int | None  # index of the line with the names

    @cached_property
    def cells(self) -> list[list[str]]:
        """The cells of every row."""
        return [self.shape.row(self.lines[index]) for index in self.rows]

    @property
    def numeric(self) -> tuple[ColumnInfo, ...]:
        """The columns that hold numbers."""
        return tuple(self.columns[index] for index in self.shape.numeric)

    def only(self, keep: Iterable[bool]) -> LabTable:
        """Return the table with some of its rows."""
        return replace(self, rows=tuple(itertools.compress(self.rows, keep)))

    def with_values(self, columns: Sequence[ColumnInfo]) -> LabTable:
        """Return the table without the rows that are empty in all of some columns."""
        wanted = [column.index for column in columns]
        keep = [any(cells[index] for index in wanted) for cells in self.cells]
        return self if all(keep) else self.only(keep)

    def numbers(self, column: ColumnInfo) -> FloatArray:
        """Return the numbers of a column in SI.

        Raises DataError naming the first cell that is no number, or has another unit than the column.
        """
        cells = [row[column.index] for row in self.cells]
        plain = None if column.unit_column is not None else self._plain_numbers(cells)
        if plain is not None and not any(len(row) > self.shape.width for row in self.cells):
            return convert_to_si(plain, column.dimension or "", column.unit or "")
        return np.array([self._value(number, column) for number in range(len(cells))])

    def _plain_numbers(self, cells: list[str]) -> FloatArray | None:
        """Return all cells as numbers at once; None if one of them is more or less than a number."""
        text = "\n".join(cells)
        if self.shape.dialect.decimal == ",":
            if "." in text:
                return None
            text = text.replace(",", ".")
        if not _PLAIN_CHARACTERS.issuperset(text):
            return None
        try:
            return np.array(text.split("\n"), dtype=float)
        except ValueError:
            return None

    def _value(self, number: int, column: ColumnInfo) -> float:
        """Return the number in one cell in SI."""
        row, place = self.cells[number], f"{self.file}: line {self.rows[number] + 1}"
        filled = len(self.shape.dialect.cells(self.lines[self.rows[number]]))
        if column.index >= filled or any(map(self.shape.dialect.is_number, row[self.shape.width :])):
            raise DataError(f"{place} has {filled} cells, the others have {self.shape.width}")
        cell = row[column.index]
        reading = self.shape.dialect.number(cell)
        if reading is None:
            refuse_group(cell, self.file)
            what = "is empty" if not cell else f"holds {quote(cell)}, which is not a number"
            raise DataError(f"{place}: column {column.label} {what}; remove the line or correct it")
        value, unit = reading
        if column.unit_column is not None:
            unit = standard_spelling(row[column.unit_column])
        # a gauge that changes its range on the way shows the same kind of quantity in another unit
        alike = column.source == CELLS_SOURCE and dimension_of(unit) == column.dimension
        if unit and unit != column.unit and not alike:
            column.with_unit(unit, "the cell", self.file, f"line {self.rows[number] + 1}: ")
        return float(convert_to_si(np.array(value), column.dimension or "", unit or column.unit or ""))

    def texts(self, column: ColumnInfo) -> list[str]:
        """Return the cells of a column as they are."""
        return [row[column.index] for row in self.cells]


def convert_to_si(values: FloatArray, dimension: str, unit: str) -> FloatArray:
    """Return values with a unit as SI, exactly where the unit is that of cfmkit's own files."""
    from cfmkit.specs.units import from_border
    from cfmkit.specs.units.table import COMMON_UNIT_SIZES, border_unit, unit_size

    if unit == border_unit(dimension):
        return np.asarray(from_border(values, dimension))
    factor = COMMON_UNIT_SIZES[dimension, unit] if (dimension, unit) in COMMON_UNIT_SIZES else unit_size(unit).factor
    return values * float(factor)


def decode_file(data: bytes, name: str) -> tuple[str, str]:
    """Return the text of a file and the name of its encoding.

    Raises DataError if it is not a text.
    """
    encoding = next((reported for mark, reported in _BYTE_ORDER_MARKS if data.startswith(mark)), "")
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


def lines_of(text: str) -> list[str]:
    """Return the lines of a text, with an ASCII minus before numbers that have another one."""
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    return (text if text.isascii() else _MINUS_PATTERN.sub("-", text)).split("\n")


def tables_in(
    lines: list[str],  # of the file
    name: str,  # for messages
    units: Mapping[str, str] | None = None,  # what ``--units`` says, by name or by number from 1
) -> list[LabTable]:
    """Return the tables of a file; with one that is long enough, shorter runs of numbers above it are none.

    Raises DataError if there is none, or what a line means is open.
    """
    filled = [index for index, line in enumerate(lines) if line.strip(EMPTY_CHARACTERS)]
    if not filled:
        raise DataError(f"{name}: the file is empty")
    long = next((index for index in filled if len(lines[index]) > LONGEST_LINE), None)
    if long is not None:
        raise DataError(f"{name}: line {long + 1} has {len(lines[long])} characters; at most {LONGEST_LINE} are read")
    shape = _find_row_pattern(lines, filled, name)
    runs = _find_runs(lines, filled, shape)
    enough = min(2, len(shape.numeric))
    long_ones = [run for run in runs if sum(shape.numbers_in(lines[index]) >= enough for index in run) >= FEWEST_ROWS]
    chosen = long_ones or [max(runs, key=len)]
    for run in runs:
        most = max(shape.numbers_in(lines[index]) for index in run)
        if run not in chosen and (most > 1 if run[0] > chosen[0][0] else shape.is_row(lines[run[-1]])):
            raise DataError(
                f"{name}: line {max(run[0], chosen[0][0]) + 1}: numbers go on here after a text that interrupts them; "
                "remove the text, or the numbers that do not belong to the table"
            )
    starts = [0, *(run[-1] + 1 for run in chosen)]
    return [
        _make_table(lines, shape, run, start, units or {}, name) for run, start in zip(chosen, starts, strict=False)
    ]


def _find_row_pattern(lines: list[str], filled: list[int], name: str) -> RowPattern:
    """Return how the numbers of a file are written."""
    # Most lines before the last few are data, whatever stands above and below them.
    middle = filled[len(filled) // 3 : max(len(filled) - 2, 1)] or filled
    sample = [lines[index] for index in middle[:: max(len(middle) // _N_SAMPLE_LINES, 1)]]
    quoted = any('"' in line for line in sample)
    dialects = [Dialect(separator, decimal, quoted) for separator in SEPARATOR_NAMES for decimal in ".,"]
    dialects = [item for item in dialects if item.separator != "," or item.decimal == "." or quoted]
    scores = [(*_score_dialect(dialect, sample), dialect) for dialect in dialects]
    count, _, width, dialect = max(scores, key=lambda item: item[:2])
    if not count:
        _refuse_groups(sample, name)
        raise DataError(
            f"{name}: there are no lines below each other with at least two numbers each, separated by semicolon, tab, "
            "comma, bar or spaces"
        )
    rows = [cells for line in sample if _is_data(cells := dialect.cells(line), dialect)]
    if count < 0.5 * len(sample) or not all(map(dialect.is_number, dialect.cells(sample[0]))):
        _refuse_groups(sample, name)
    rows = [cells for cells in rows if len(cells) == width]
    numeric = tuple(k for k in range(width) if 2 * sum(dialect.is_number(row[k]) for row in rows) > len(rows))
    blank = tuple(k for k in range(numeric[0] if numeric else 0) if not any(row[k] for row in rows))
    return RowPattern(dialect, width, numeric, blank)


def _is_data(cells: Sequence[str], dialect: Dialect) -> bool:
    return sum(map(dialect.is_number, cells)) >= 2


def _score_dialect(dialect: Dialect, sample: list[str]) -> tuple[int, float, int]:
    """Return how many lines are data in this dialect, which part of their cells is numbers, and their width."""
    good = [cells for line in sample if _is_data(cells := dialect.cells(line), dialect)]
    if not good:
        return 0, 0.0, 0
    width, count = Counter(map(len, good)).most_common(1)[0]
    filled = [cell for cells in good if len(cells) == width for cell in cells if cell]
    return count, sum(map(dialect.is_number, filled)) / len(filled), width


def _find_runs(lines: list[str], filled: list[int], shape: RowPattern) -> list[list[int]]:
    """Return the unbroken runs of lines with numbers; an empty line ends one unless numbers in all places follow."""
    runs: list[list[int]] = []
    before = -2
    for index in filled:
        count = shape.numbers_in(lines[index])
        if count and runs and runs[-1][-1] == before and (before == index - 1 or count == len(shape.numeric)):
            runs[-1].append(index)
        # a word where the first number is to be labels the line, as in ``Rate; 20`` above a table
        elif count and not (count < 2 and shape.row(lines[index])[shape.numeric[0]][:1].isalpha()):
            runs.append([index])
        before = index
    return runs


def _make_table(
    lines: list[str], shape: RowPattern, run: list[int], start: int, units: Mapping[str, str], name: str
) -> LabTable:
    """Return one table with what the lines above it and its cells say of its columns."""
    names, unit_row, header = _find_header(lines, shape, range(start, run[0]), run[0] + 1, name)
    rows = [shape.row(lines[index]) for index in run[:: max(len(run) // _N_SAMPLE_LINES, 1)]]
    beside = _unit_columns(rows, shape, names)
    inside = {k: next(standard_spelling(row[unit]) for row in rows if row[unit]) for k, unit in beside.items()}
    for k in shape.numeric:
        numbers = [number[1] for row in rows if (number := shape.dialect.number(row[k]))]
        inside |= {k: numbers[0]} if numbers and numbers[0] else {}
    columns = describe(names, unit_row, inside, units, name)
    placed = tuple(replace(item, unit_column=beside.get(item.index)) for item in columns)
    return LabTable(name, shape, lines, tuple(run), placed, header)


_COUNTER_PATTERN = re.compile(r"(?i)(no|nr|n|#|idx|index|reading|row|point|count|sample|record|data no|lfd\.? ?nr)\W*")
"""Names of columns that count the rows: a unit to their right is not theirs."""


def _unit_columns(rows: list[list[str]], shape: RowPattern, names: Sequence[str]) -> dict[int, int]:
    """Return the columns of numbers beside which the unit of each cell stands, and where: to their right, else left."""
    positions: dict[int, int] = {}
    for k in sorted(set(range(shape.width)).difference(shape.numeric)):
        filled = [row[k] for row in rows if any(row[column] for column in shape.numeric)]
        if filled and all(map(dimension_of, filled)):
            left = [k - 1] if not _COUNTER_PATTERN.fullmatch(names[k - 1].strip(' "')) else []
            beside = [c for c in (*left, k + 1) if c in shape.numeric and c not in positions]
            positions |= {beside[0]: k} if beside else {}
    return positions


def _find_header(
    lines: list[str], shape: RowPattern, above: range, first_line: int, name: str
) -> tuple[list[str], list[str], int | None]:
    """Return the names, the units and the index of the line with the names."""
    filled = [index for index in above if lines[index].strip(EMPTY_CHARACTERS)]
    rows = [(index, _header_cells(lines[index], shape)) for index in reversed(filled[-UNIT_LINES:])]
    first_rows = rows[:HEADER_LINES]
    fitting = [(index, cells) for index, cells in first_rows if len(cells) == shape.width]
    # A column of remarks that stayed empty: its title stands beyond the numbers and has no unit.
    fitting = fitting or [
        (index, cells[: shape.width])
        for index, cells in first_rows
        if len(cells) > shape.width and not any(split_header(cell)[1] for cell in cells[shape.width :])
    ]
    if not fitting:
        titles = first_rows[0][1] if first_rows and shape.dialect.separator == "," else []
        # half the cells of the numbers below it, and not just a title
        if shape.width == 2 * len(titles) and (len(titles) > 1 or split_header(titles[0])[1]):
            raise DataError(
                f"{name}: line {first_line} has {shape.width} cells but the header {len(titles)}: comma seems to "
                "be both separator and decimal sign; export with another separator"
            )
        return [""] * shape.width, [""] * shape.width, None
    (header, names), unit_row = fitting[0], [""] * shape.width
    if len(fitting) > 1 and is_unit_row(names):
        unit_row, (header, names) = names, fitting[1]
    elif not any(split_header(cell)[1] for cell in names):
        units = [cells for index, cells in rows if index != header and len(cells) == shape.width and is_unit_row(cells)]
        unit_row = ["", *units[0][1:]] if units else unit_row
    return names, unit_row, header


def _header_cells(line: str, shape: RowPattern) -> list[str]:
    """Return the cells of a header, as many as the table is wide where that can be done.

    Quotes are understood even where the numbers have none, and a leading ``#`` or ``%`` is dropped.
    """
    line = line.strip().lstrip("#%!").strip() if line.lstrip()[:1] in ("#", "%", "!") else line
    separator = shape.dialect.separator
    if separator != " ":
        cells = Dialect(separator, ".", '"' in line).cells(line)
        if len(cells) == 2 * shape.width and all(dimension_of(cell) for cell in cells[1::2]):
            return [
                f"{title} [{unit}]" for title, unit in zip(cells[::2], cells[1::2], strict=True)
            ]  # Travel, mm, Load, N
        short = range(len(cells), shape.width)
        return cells + [""] * len(short) if len(cells) > 1 and not set(short) & set(shape.numeric) else cells
    ways = (line.split(), re.split(r"\s{2,}|\t", line.strip()), re.findall(r"[^\[(]*[\[(][^\])]*[\])]", line))
    return next((cells for cells in ways if len(cells) == shape.width), ways[0])


def _refuse_groups(sample: list[str], name: str) -> None:
    """Raise if cells have a thousands separator."""
    for separator in (";", "\t", None):
        for line in sample:
            for row in csv.reader([line], delimiter=separator) if separator else [line.split()]:
                for cell in row:
                    refuse_group(cell.strip(), name)


def refuse_group(cell: str, name: str) -> None:
    """Raise if a cell is a number with a thousands separator that leaves no doubt.

    Raises DataError naming it.
    """
    match = _GROUPED_PATTERN.fullmatch(cell)
    if match and (match[1] not in ".," or sum(map(cell.count, ".,")) > 1):
        raise DataError(f"{name}: {cell!r} has a thousands separator; export the numbers without one")
