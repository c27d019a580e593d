"""From the bytes of a lab file to lines of text, to what separates numbers in them, and to what its columns are.

Nothing is assumed about a file but that it ends in a block of lines with the same
number of cells, at least two of which are numbers in every line. What stands above
that block is a header or of no concern; a few lines of text below it may follow.

What the columns of a lab file are: names, units and roles. Units are read or stated by the user, never guessed. A
unit stands in the header as ``Force [N]``, ``Kraft (N)``, ``s/mm`` or ``travel in mm``, in a line of its own below
the names, or in ``--units``. A column's role follows from the dimension of its unit; where several columns qualify,
from its name; where that does not decide either, the file is refused with the choices.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from dataclasses import dataclass
from difflib import get_close_matches
from typing import TYPE_CHECKING

from cfmkit.errors import DataError, QuantityError, UsageError
from cfmkit.specs.units.strict_decimal_number import shown

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence


SEPARATORS = {";": "semicolon", "\t": "tab", ",": "comma", " ": "spaces"}
"""What may stand between cells, in the order in which it is tried, and its name."""

LONGEST_LINE = 100_000
"""Characters of a line that is read: the reader of quoted cells takes 131072 in one."""

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
    encoding = next((reported for mark, reported in _MARKS if data.startswith(mark)), "")
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
    long = next((index for index in filled if len(lines[index]) > LONGEST_LINE), None)
    if long is not None:
        raise DataError(f"{name}: line {long + 1} has {len(lines[long])} characters; at most {LONGEST_LINE} are read")
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


ROLES = {"time": "time", "length": "displacement", "angle": "angle", "force": "force", "torque": "torque"}
"""What a column of a dimension can be."""

_IN_HEADER = (
    re.compile(r"(?P<name>.*?)\s*\[(?P<unit>[^\[\]]*)\]"),
    re.compile(r"(?P<name>.*?)\s*\((?P<unit>[^()]*)\)"),
    re.compile(r"(?P<name>.*\S)\s+in\s+(?P<unit>\S+)"),
    re.compile(r"(?P<name>[^/]*[^/\s])\s*/\s*(?P<unit>\S+)"),
)
_SPELLINGS = {
    "Nm": "N*m", "Nmm": "N*mm", "N m": "N*m", "N mm": "N*mm", "Ncm": "N*cm", "N cm": "N*cm", "°": "deg", "sec": "s",
    "Sek": "s", "-": "1", "": "1", "mm/mm": "1", "degree": "deg", "degrees": "deg",
}  # fmt: skip
_WORDS = {
    "time": ("time", "t", "zeit", "temps", "tiempo"),
    "length": (
        "displacement", "travel", "stroke", "position", "extension", "deflection", "crosshead", "s", "u", "x",
        "weg", "traverse", "traversenweg", "hub", "deplacement", "desplazamiento",
    ),
    "angle": ("angle", "rotation", "phi", "theta", "winkel", "drehwinkel"),
    "force": ("force", "load", "f", "kraft", "standardkraft", "load cell", "fuerza", "carga"),
    "torque": ("torque", "moment", "m", "drehmoment", "par"),
}  # fmt: skip


@dataclass(frozen=True)
class ColumnInfo:
    """One column of a lab file as its header describes it.

    Attributes
    ----------
    index : int
        Its place in the file, from 0.
    name : str
        As in the header, without the unit; ``column 1`` where there is none.
    unit : str or None
        As cfmkit spells it; None if nobody says.
    dimension : str or None
        Of the unit; None if that is of no use here.
    reported : bool
        Whether ``--units`` names the column.
    """

    index: int
    name: str
    unit: str | None = None
    dimension: str | None = None
    reported: bool = False

    @property
    def label(self) -> str:
        """Name and unit for messages: ``'Kraft' [N]``."""
        return f"{shown(self.name)} [{self.unit}]" if self.unit else f"{shown(self.name)} without a unit"


def read_units(text: str | None) -> dict[str, str]:
    """Return what ``--units`` says: ``"s=mm,F=N"`` by column.

    Raises
    ------
    cfmkit.errors.UsageError
        If it is malformed or names a unit that there is not.
    """
    found: dict[str, str] = {}
    for part in (text or "").split(","):
        name, equals, unit = (piece.strip() for piece in part.partition("="))
        if not part.strip() and not (text or "").strip():
            continue
        if not equals or not name or not unit or name in found:
            raise UsageError(f"--units: {shown(part)} is not 'column=unit'; write e.g. --units \"s=mm,F=N\"")
        if _dimension(unit) is None:
            raise UsageError(f"--units: {shown(unit)} is not a unit of a time, displacement, angle, force or torque")
        found[name] = _spelt(unit)
    return found


def describe(names: Sequence[str], unit_row: Sequence[str], units: Mapping[str, str], file: str) -> list[ColumnInfo]:
    """Return the columns that a header describes.

    Parameters
    ----------
    names : sequence of str
        Cells of the line with the names; empty texts where there is none.
    unit_row : sequence of str
        Cells of the line with the units; empty texts where there is none.
    units : mapping of str to str
        What ``--units`` says, by name or by number from 1.
    file : str
        For messages.

    Raises
    ------
    cfmkit.errors.DataError
        If ``--units`` names a column that is not there, or contradicts the header.
    """
    pairs = zip(names, unit_row, strict=True)
    found = [_described(index, name, unit) for index, (name, unit) in enumerate(pairs)]
    left = dict(units)
    chosen = [_reported(column, left, file) for column in found]
    if left:
        there = ", ".join(shown(column.name) for column in found)
        wrong = next(iter(left))
        near = get_close_matches(wrong, [column.name for column in found], n=1)
        hint = f"; did you mean {near[0]!r}?" if near else f"; there are {there}"
        raise DataError(f"{file}: --units names a column {shown(wrong)} that is not there{hint}")
    return chosen


def _described(index: int, text: str, below: str) -> ColumnInfo:
    name, unit = split_header(text)
    unit = unit if unit is not None else _bare_unit(below)
    name = " ".join(name.split()) or f"column {index + 1}"
    if unit is None:
        return ColumnInfo(index, name)
    return ColumnInfo(index, name, _spelt(unit), _dimension(unit))


def split_header(text: str) -> tuple[str, str | None]:
    """Return name and unit of a header's cell; the unit is None where there is none.

    Examples
    --------
    >>> split_header("Kraft (N)"), split_header("s/mm"), split_header("Force")
    (('Kraft', 'N'), ('s', 'mm'), ('Force', None))
    """
    text = text.strip().strip('"').strip()
    for number, pattern in enumerate(_IN_HEADER):
        match = pattern.fullmatch(text)
        # A word after "in" or a slash is a unit only if there is such a unit.
        if match and (number < 2 or _is_unit(match["unit"])):
            return match["name"], match["unit"].strip()
    return text, None


def is_unit_row(cells: Iterable[str]) -> bool:
    """Return whether a line holds nothing but units, bare or in brackets, and at least one of them."""
    units = [_bare_unit(cell) for cell in cells]
    bare = [cell.strip(' "') for cell in cells]
    known = [unit is not None and _is_unit(unit) for unit in units]
    return any(known) and all(good or not cell or _bracketed(cell) for good, cell in zip(known, bare, strict=True))


def _bracketed(cell: str) -> bool:
    return cell[:1] + cell[-1:] in ("[]", "()")


def _bare_unit(cell: str) -> str | None:
    cell = cell.strip(' "')
    return (cell[1:-1].strip() if _bracketed(cell) else cell) or None


def _reported(column: ColumnInfo, left: dict[str, str], file: str) -> ColumnInfo:
    """Return a column with what ``--units`` says of it; taken from `left`."""
    for key in (column.name, str(column.index + 1)):
        if key in left:
            unit = left.pop(key)
            if column.unit is not None and column.unit != unit:
                raise DataError(
                    f"{file}: the header gives {shown(column.name)} in {column.unit}, --units in {unit}; "
                    "correct the one that is wrong"
                )
            return ColumnInfo(column.index, column.name, unit, _dimension(unit), reported=True)
    return column


def _spelt(unit: str) -> str:
    """Return a unit as cfmkit spells it."""
    unit = unit.strip().replace("·", "*").replace("⋅", "*").replace("µ", "u").replace("μ", "u").replace("²", "^2")
    return _SPELLINGS.get(unit, unit)


def _is_unit(unit: str) -> bool:
    """Tell whether a text is a unit, in any of the spellings that are read."""
    from cfmkit.specs.units.unit_size import is_unit

    spelt = _spelt(unit)
    return spelt == "1" or is_unit(spelt)


def _dimension(unit: str) -> str | None:
    """Return which of the dimensions of interest a unit has."""
    from cfmkit.specs.units.table import COMMON
    from cfmkit.specs.units.unit_size import border_size, is_unit, unit_size

    spelt = _spelt(unit)
    common = next((name for name in ROLES if (name, spelt) in COMMON), None)
    if common or not is_unit(spelt):
        return common
    try:
        powers = unit_size(spelt).powers
    except QuantityError:
        return None
    return next((name for name in ROLES if border_size(name).powers == powers), None)


def column_of(columns: Sequence[ColumnInfo], dimension: str, file: str) -> ColumnInfo | None:
    """Return the column of a dimension, None if there is none.

    Raises
    ------
    cfmkit.errors.DataError
        If several qualify; the message names them.
    """
    found = [column for column in columns if column.dimension == dimension]
    found = [column for column in found if column.reported] or found
    named = [column for column in found if re.sub(r"[\W_\d]+", " ", column.name).strip().lower() in _WORDS[dimension]]
    chosen = found if len(found) < 2 else named
    if len(chosen) == 1 or not found:
        return chosen[0] if chosen else None
    options = " or ".join(f'--units "{column.name}={column.unit}"' for column in found)
    raise DataError(
        f"{file}: {len(found)} columns could be the {ROLES[dimension]}: "
        f"{', '.join(column.label for column in found)}; choose with {options}"
    )
