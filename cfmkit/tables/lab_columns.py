"""Columns of the file of a testing machine: the name, unit and role (displacement, force, ...) of each.

Units are read or stated by the user, never guessed. A unit stands in the header as ``Force [N]``, ``Kraft (N)``,
``s/mm``, ``Load, N`` or ``travel in mm``, in a line of its own below the names, in the cells (``6.00 N``), in a column
of its own beside the numbers, or in ``--units``. Where two of these contradict each other the file is refused. A
column's role follows from the dimension of its unit; where several columns qualify, from its name; where that does not
decide either, the file is refused with the choices.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import lru_cache
from typing import TYPE_CHECKING

from cfmkit.errors import DataError, QuantityError, UsageError
from cfmkit.specs.units.strict_decimal_number import quote
from cfmkit.specs.units.table import COMMON_UNIT_SIZES, UNIT_TABLE, border_size, is_unit, unit_size

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence


COLUMN_ROLES = {"time": "time", "length": "displacement", "angle": "angle", "force": "force", "torque": "torque"}
"""What a column of a dimension can be."""
_IN_HEADER = (
    re.compile(r"(?P<name>.*?)\s*\[(?P<unit>[^\[\]]*)\]"),
    re.compile(r"(?P<name>.*?)\s*\((?P<unit>[^()]*)\)"),
    re.compile(r"(?P<name>.*\S)\s+in\s+(?P<unit>\S+)"),
    re.compile(r"(?P<name>[^/]*[^/\s])\s*/\s*(?P<unit>\S+)"),
    re.compile(r"(?P<name>.*[^,;:\s])\s*[,;:]\s*(?P<unit>[^,;:]*\S)"),
    re.compile(r"(?P<name>.*\S)\s+(?P<unit>N|(?!in$|min$)\S\S+)"),
)
_OTHER_WORDS = {
    "°": "deg", "sec": "s", "secs": "s", "sek": "s", "micron": "um", "microns": "um", "inches": "in", "zoll": "in",
    "kilopond": "kgf", "lbsf": "lbf", "poundsforce": "lbf", "feet": "ft",
}  # fmt: skip
_AMBIGUOUS_UNITS = {"mn"}  # spellings without regard to case that could be two units: mN and MN
_DIMENSIONLESS_SPELLINGS = {"-": "1", "": "1", "mm/mm": "1"}
_LABEL_OF_UNITS = re.compile(r"(?i).*(unit|einheit).*")
_COLUMN_WORDS = {
    "time": ("time", "t", "zeit", "temps", "tiempo", "prüfzeit", "test time"),
    "length": (
        "displacement", "travel", "stroke", "position", "extension", "deflection", "crosshead", "s", "u", "x",
        "weg", "traverse", "traversenweg", "standardweg", "hub", "deplacement", "déplacement", "desplazamiento",
    ),
    "angle": ("angle", "rotation", "phi", "theta", "winkel", "drehwinkel"),
    "force": ("force", "load", "f", "kraft", "standardkraft", "load cell", "fuerza", "carga"),
    "torque": ("torque", "moment", "m", "drehmoment", "par"),
}  # fmt: skip


@dataclass(frozen=True)
class ColumnInfo:
    """One column of a lab file as its header and its cells describe it."""

    index: int  # its place in the file, from 0
    name: str  # as in the header, without the unit; "column 1" where there is none
    unit: str | None = None  # as cfmkit spells it; as in the file if it is none; None if it is not stated
    dimension: str | None = None  # of the unit; None if that is of no use here
    named_by_option: bool = False  # whether --units names this column
    source: str = ""  # what says the unit, for messages
    unit_column: int | None = None  # where the unit of each cell stands, if beside it

    @property
    def label(self) -> str:
        """Name and unit for messages: ``'Kraft' [N]``."""
        return f"{quote(self.name)} [{self.unit}]" if self.unit else f"{quote(self.name)} without a unit"

    def with_unit(self, unit: str, source: str, file: str, place: str = "") -> ColumnInfo:
        """Return the column with a unit that `source` states for it.

        Raises DataError if another source stated another unit.
        """
        if self.dimension is None:
            return replace(self, unit=unit, dimension=dimension_of(unit), source=source)
        if unit != self.unit:
            verb = "give" if self.source == CELLS_SOURCE else "gives"
            raise DataError(
                f"{file}: {place}{self.source} {verb} {quote(self.name)} in {self.unit}, {source} in {unit}; correct "
                "the one that is wrong"
            )
        return self


HEADER_SOURCE, UNIT_LINE, CELLS_SOURCE = "the header", "the line of units", "the cells"


def read_units(text: str | None) -> dict[str, str]:
    """Return what ``--units`` says: ``"s=mm,F=N"`` by column.

    Raises UsageError if it is malformed or names a unit that there is not.
    """
    units: dict[str, str] = {}
    for part in (text or "").split(","):
        name, equals, unit = (piece.strip() for piece in part.rpartition("="))
        if not part.strip() and not (text or "").strip():
            continue
        if not equals or not name or not unit or name in units:
            raise UsageError(
                f'--units: {quote(part)} is not \'column=unit\'; write e.g. --units "s=mm,F=N", or --units "1=mm,2=N" '
                "by number"
            )
        if dimension_of(unit) is None:
            raise UsageError(f"--units: {quote(unit)} is not a unit of a time, displacement, angle, force or torque")
        units[name] = standard_spelling(unit)
    return units


def describe(
    # names, unit_row: cells of the lines with the names and the units; empty texts where there is none
    names: Sequence[str],
    unit_row: Sequence[str],
    cells: Mapping[int, str],  # unit that stands in the cells of a column
    units: Mapping[str, str],  # what ``--units`` says, by name or by number from 1
    file: str,  # for messages
) -> list[ColumnInfo]:
    """Return the columns of a file with what header, cells and ``--units`` say of them.

    Raises DataError if two of them contradict each other, or ``--units`` names a column that is not there.
    """
    columns = [_describe_column(index, *pair, file) for index, pair in enumerate(zip(names, unit_row, strict=True))]
    for index, unit in cells.items():
        columns[index] = columns[index].with_unit(unit, CELLS_SOURCE, file)
    for key, unit in units.items():
        index = column_named(key, columns, file).index
        columns[index] = replace(columns[index].with_unit(unit, "--units", file), named_by_option=True)
    return columns


def column_named(key: str, columns: Sequence[ColumnInfo], file: str) -> ColumnInfo:
    """Return the column that ``--units`` or ``--group`` means, by name or by number from 1.

    Raises DataError if there is none, or there are several.
    """
    named = [column for column in columns if column.name == key]
    if len(named) == 1:
        return named[0]
    if len(named) > 1:
        numbers = " and ".join(str(column.index + 1) for column in named)
        raise DataError(f"{file}: columns {numbers} are both called {quote(key)}; name the one that is meant by number")
    if key.isdecimal() and 1 <= int(key) <= len(columns):
        return columns[int(key) - 1]
    close = get_close_matches(key, [column.name for column in columns], n=1)
    hint = f"; did you mean {close[0]!r}?" if close else f"; there are {', '.join(quote(c.name) for c in columns)}"
    raise DataError(f"{file}: there is no column {quote(key)}{hint}")


def _describe_column(index: int, text: str, below: str, file: str) -> ColumnInfo:
    """Return a column as the header and the line of units describe it."""
    name, unit = split_header(text)
    under = _bare_unit(below)
    if unit is not None and dimension_of(unit) is None and under is not None and dimension_of(under):
        name, unit = text, None  # such as "Force (compression)"
    column = ColumnInfo(index, " ".join(name.strip(' "').split()) or f"column {index + 1}")
    if unit is not None:
        column = column.with_unit(standard_spelling(unit), HEADER_SOURCE, file)
    if under is not None and (dimension_of(under) or unit is None):
        column = column.with_unit(standard_spelling(under), UNIT_LINE, file)
    return column


def split_header(text: str) -> tuple[str, str | None]:
    """Return name and unit of a header's cell; the unit is None if there is none.

    Examples
    --------
    >>> split_header("Kraft (N)"), split_header("s/mm"), split_header("Load, N"), split_header("Force")
    (('Kraft', 'N'), ('s', 'mm'), ('Load', 'N'), ('Force', None))
    """
    text = text.strip().strip('"').strip()
    for number, pattern in enumerate(_IN_HEADER):
        match = pattern.fullmatch(text)
        # A word after "in", a slash, a comma or a space is a unit only if there is such a unit.
        if match and (number < 2 or dimension_of(match["unit"])):
            return match["name"], match["unit"].strip()
    return text, None


def is_unit_row(cells: Iterable[str]) -> bool:
    """Return whether a line has nothing but units, bare or in brackets, at least one, and perhaps the word first."""
    cells = [cell.strip(' "') for cell in cells]
    if len(cells) > 1 and _LABEL_OF_UNITS.fullmatch(cells[0]):
        cells = cells[1:]
    is_unit_cell = [(unit := _bare_unit(cell)) is not None and is_known(unit) for cell in cells]
    return any(is_unit_cell) and all(
        good or not cell or _is_bracketed(cell) for good, cell in zip(is_unit_cell, cells, strict=True)
    )


def _is_bracketed(cell: str) -> bool:
    return cell[:1] + cell[-1:] in ("[]", "()")


def _bare_unit(cell: str) -> str | None:
    cell = cell.strip(' "')
    return (cell[1:-1].strip() if _is_bracketed(cell) else cell) or None


@lru_cache(maxsize=1)
def _words() -> dict[str, str]:
    """Return the symbols of units of forces, lengths, angles and times by what else people write, folded."""
    symbols: dict[str, str] = {}
    for unit in UNIT_TABLE:
        if unit.dimension in COLUMN_ROLES:
            names = (unit.symbol, *unit.aliases, unit.name, unit.name + "s", unit.name.replace("meter", "metre"))
            symbols |= {_fold_case(word): unit.symbol for word in names if len(word) > 1}
    return {word: symbol for word, symbol in (symbols | _OTHER_WORDS).items() if word not in _AMBIGUOUS_UNITS}


def _fold_case(unit: str) -> str:
    return re.sub(r"[\s._-]", "", unit).lower()


@lru_cache(maxsize=1024)
def standard_spelling(unit: str) -> str:
    """Return a unit in the spelling of cfmkit; a text that is no unit as it is.

    Examples
    --------
    >>> [standard_spelling(unit) for unit in ("lbF", "Inches", "N·mm", "kgf-cm", "sec.")]
    ['lbf', 'in', 'N*mm', 'kgf*cm', 's']
    """
    unit = unit.strip().replace("µ", "u").replace("μ", "u").replace("²", "^2")
    if unit in _DIMENSIONLESS_SPELLINGS:
        return _DIMENSIONLESS_SPELLINGS[unit]
    if is_unit(unit):
        return unit
    if _fold_case(unit) in _words():
        return _words()[_fold_case(unit)]
    joined = re.fullmatch(r"(?P<one>.*N)(?P<other>[cm]?m)", unit)  # Nmm
    parts = joined.groups() if joined else re.split(r"\s*[·⋅×*.\s-]\s*", unit)
    symbols = [part if is_unit(part) else _words().get(_fold_case(part), "") for part in parts]
    return "*".join(symbols) if len(symbols) == 2 and all(symbols) else unit


def is_known(unit: str) -> bool:
    """Return whether a text is a unit, in any of the spellings that are read."""
    return standard_spelling(unit) == "1" or is_unit(standard_spelling(unit))


@lru_cache(maxsize=1024)
def dimension_of(unit: str) -> str | None:
    """Return which of the dimensions of interest a unit has; None if it has none of them."""
    symbol = standard_spelling(unit)
    common = next((name for name in COLUMN_ROLES if (name, symbol) in COMMON_UNIT_SIZES), None)
    if common or not is_unit(symbol):
        return common
    try:
        powers = unit_size(symbol).powers
    except QuantityError:
        return None
    return next((name for name in COLUMN_ROLES if border_size(name).powers == powers), None)


def roles_of(numeric: Sequence[ColumnInfo], columns: Sequence[ColumnInfo], name: str) -> dict[str, ColumnInfo]:
    """Return the columns that are used, by role.

    Raises DataError if there is no pair of displacement and force or angle and torque, or several; the message has the
    choices.
    """
    pairs = (("length", "force"), ("angle", "torque"))
    dimensions = {item.dimension for item in numeric}
    complete = [pair for pair in pairs if set(pair) <= dimensions]
    if len(complete) > 1:
        named_by_option = {item.dimension for item in numeric if item.named_by_option}
        complete = [pair for pair in pairs if set(pair) <= named_by_option] or complete
    if len(complete) > 1:
        raise DataError(
            f"{name}: there are displacement and force, and angle and torque; name the columns that are meant "
            'with --units, e.g. --units "phi=deg,M=N*mm"'
        )
    if not complete:
        raise DataError(_describe_missing(numeric, columns, name))
    candidates = {dimension: _role_candidates(numeric, dimension) for dimension in ("time", *complete[0])}
    times, motions = candidates["time"], [item for item in numeric if item.dimension == complete[0][0]]
    beside = [item for item in times if item.index < candidates[complete[0][0]][0].index]
    if len(times) == len(motions) > 1 and beside:
        candidates["time"] = beside[-1:]  # each displacement has its time
    if several := [candidates[dimension] for dimension in (*complete[0], "time") if len(candidates[dimension]) > 1]:
        raise DataError(_describe_choices(several, name))
    return {
        COLUMN_ROLES[dimension]: columns_found[0] for dimension, columns_found in candidates.items() if columns_found
    }


def _role_candidates(columns: Sequence[ColumnInfo], dimension: str) -> list[ColumnInfo]:
    """Return the columns that could be of a dimension's role: those of --units, else of the usual name, else all."""
    matching = [column for column in columns if column.dimension == dimension]
    matching = [column for column in matching if column.named_by_option] or matching
    words = [re.sub(r"[\W_\d]+", " ", column.name).strip().lower() for column in matching]
    named = [column for column, word in zip(matching, words, strict=True) if word in _COLUMN_WORDS[dimension]]
    return named if len(matching) > 1 and named else matching


def _describe_choices(several: Sequence[Sequence[ColumnInfo]], name: str) -> str:
    """Return what to choose from where several columns could have a role: of columns side by side the pairs."""
    titles = [column.name for candidates_of_role in several for column in candidates_of_role]

    def key(column: ColumnInfo) -> str:
        unique = titles.count(column.name) == 1 and not set(column.name) & set(",=")
        return f"{column.name if unique else column.index + 1}={column.unit}"

    side_by_side = len(several) == 2 and len(several[0]) == len(several[1])
    sets = list(zip(*several, strict=True)) if side_by_side else [(column,) for column in several[0]]
    options = " or ".join(f'--units "{",".join(map(key, chosen))}"' for chosen in sets)
    many = "; ".join(
        f"{len(candidates_of_role)} columns could be the {COLUMN_ROLES[candidates_of_role[0].dimension or 'time']}: "
        f"{', '.join(column.label for column in candidates_of_role)}"
        for candidates_of_role in several
    )
    return f"{name}: {many}; choose with {options}"


def _describe_missing(numeric: Sequence[ColumnInfo], columns: Sequence[ColumnInfo], name: str) -> str:
    """Return which of displacement and force there is not, and what to do."""

    def key(column: ColumnInfo) -> str:
        usable = not column.name.startswith("column ") and not set(column.name) & set(",=")
        return column.name if usable else str(column.index + 1)

    if not any(column.unit for column in columns):
        example = ",".join(f"{key(column)}=..." for column in numeric[:3])
        return f'{name}: the header names no units, and they are never guessed; state them with --units "{example}"'
    dimensions = {item.dimension for item in numeric}
    lacking = (
        "force" if "length" in dimensions else "displacement" if "force" in dimensions else "displacement and force"
    )
    lacking = "torque" if "angle" in dimensions and "force" not in dimensions else lacking
    weighed = next((item for item in numeric if item.unit and item.dimension is None and _is_mass(item.unit)), None)
    if weighed is not None and "force" not in dimensions:
        return (
            f"{name}: {weighed.label} is a mass; if the gauge shows the force of that mass, say so: --units "
            f'"{key(weighed)}={_fold_case(weighed.unit or "").removesuffix("s")}f"'
        )
    labels = ", ".join(column.label for column in columns)
    return (
        f"{name}: no column for the {lacking} was found among {labels}; state which column it is, and its unit, with "
        "--units"
    )


def _is_mass(unit: str) -> bool:
    return _fold_case(unit).removesuffix("s") in ("kg", "g", "lb", "oz")
