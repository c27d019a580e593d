"""Measured curves from lab CSV files as they come, in SI; what was decided on the way can be read back.

Separator, decimal sign, encoding and header are found out (`cfmkit.tables.lab_file`), units and roles
of the columns are read or stated by the user. Only the columns that are used must be
free of gaps.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from cfmkit.arrays import FloatArray, ShortRepr, read_only
from cfmkit.errors import DataError, UsageError, reason_of, visible
from cfmkit.numerics.robust_statistics import spikes
from cfmkit.specs.units.strict_decimal_number import shown
from cfmkit.tables.lab_file import (
    ROLES,
    SEPARATORS,
    ColumnInfo,
    TextBlock,
    block_of,
    column_of,
    decoded,
    describe,
    header_cells,
    is_unit_row,
    read_units,
    refuse_group,
    split_header,
)

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from cfmkit.curves import Kind


HEADER_LINES = 5
"""So many lines above the numbers are searched for their names."""


def columns_of(
    lines: list[str], block: TextBlock, reported: dict[str, str], name: str
) -> tuple[list[ColumnInfo], int | None]:
    """Return the columns with what the lines above the numbers say of them, and the line with the names."""
    above = [index for index in range(block.first) if lines[index].strip()][-HEADER_LINES:]
    rows = [(index, header_cells(lines[index], block)) for index in reversed(above)]
    fitting = [(index, cells) for index, cells in rows if len(cells) == block.width]
    # A column of remarks that stayed empty: its title stands beyond the numbers and has no unit.
    fitting = fitting or [
        (index, cells[: block.width])
        for index, cells in rows
        if len(cells) > block.width and not any(split_header(cell)[1] for cell in cells[block.width :])
    ]
    names, unit_row, at = [""] * block.width, [""] * block.width, None
    if fitting:
        at, names = fitting[0]
        if len(fitting) > 1 and is_unit_row(names):
            unit_row, (at, names) = names, fitting[1]
    elif rows and block.dialect.separator == "," and _halved(rows[0][1], block.width):
        raise DataError(
            f"{name}: line {block.first + 1} has {block.width} cells but the header {len(rows[0][1])}: comma seems to "
            "be both separator and decimal sign; export with another separator"
        )
    return describe(names, unit_row, reported, name), None if at is None else at + 1


def _halved(header: Sequence[str], width: int) -> bool:
    """Return whether a header has half the cells of the numbers below it, and is not just a title."""
    return width == 2 * len(header) and (len(header) > 1 or bool(split_header(header[0])[1]))


def roles_of(numeric: Sequence[ColumnInfo], columns: Sequence[ColumnInfo], name: str) -> dict[str, ColumnInfo]:
    """Return the columns that are used, by role."""
    pairs = (("length", "force"), ("angle", "torque"))
    there = {item.dimension for item in numeric}
    complete = [pair for pair in pairs if set(pair) <= there]
    if len(complete) > 1:
        reported = {item.dimension for item in numeric if item.reported}
        complete = [pair for pair in pairs if set(pair) <= reported] or complete
    if len(complete) > 1:
        raise DataError(
            f"{name}: there are displacement and force, and angle and torque; name the columns that are meant "
            'with --units, e.g. --units "phi=deg,M=N*mm"'
        )
    if not complete:
        raise DataError(_missing(numeric, columns, name))
    wanted = ("time", *complete[0])
    found = {ROLES[dimension]: column_of(numeric, dimension, name) for dimension in wanted}
    return {role: column for role, column in found.items() if column is not None}


def _missing(numeric: Sequence[ColumnInfo], columns: Sequence[ColumnInfo], name: str) -> str:
    """Say which of displacement and force there is not, and what to do."""
    if not any(column.unit for column in columns):
        example = ",".join(f"{column.name if not column.name.startswith('column ') else column.index + 1}=..."
                           for column in numeric[:3])  # fmt: skip
        return f'{name}: the header names no units, and they are never guessed; state them with --units "{example}"'
    there = {item.dimension for item in numeric}
    lacking = "force" if "length" in there else "displacement" if "force" in there else "displacement and force"
    lacking = "torque" if "angle" in there and "force" not in there else lacking
    labels = ", ".join(column.label for column in columns)
    return (
        f"{name}: no column for the {lacking} was found among {labels}; state which column it is, and its unit, with "
        "--units"
    )


LARGEST = 500_000_000
"""Bytes of the largest file that is read."""

FEWEST = 8
"""Points without which there is no curve."""


@dataclass(frozen=True)
class Decisions:
    """What was found out about a file, for the user to check.

    Attributes
    ----------
    encoding, separator, decimal : str
        In words.
    first_line : int
        Line of the file, from 1, with the first numbers.
    header_line : int or None
        Line with the names.
    skipped_lines : int
        Lines above and below that are neither header nor numbers.
    columns : mapping of str to str
        Role -> name and unit.
    unused : tuple of str
        Columns that are not used.
    """

    encoding: str
    separator: str
    decimal: str
    first_line: int
    header_line: int | None
    skipped_lines: int
    columns: dict[str, str]
    unused: tuple[str, ...]

    def lines(self) -> list[str]:
        """Return sentences for the terminal."""
        header = f"header in line {self.header_line}, " if self.header_line else "no header, "
        skipped = (
            f", {self.skipped_lines} other line{'s' * (self.skipped_lines > 1)} skipped" if self.skipped_lines else ""
        )
        reported = [
            f"{self.encoding}, separator {self.separator}, decimal {self.decimal}",
            f"{header}numbers from line {self.first_line}{skipped}",
            ", ".join(f"{role} = {label}" for role, label in self.columns.items()),
        ]
        return reported + ([f"not used: {', '.join(self.unused)}"] if self.unused else [])


@dataclass(frozen=True, repr=False)
class Recording(ShortRepr):
    """A measured curve as recorded: SI, in the order of the file.

    Attributes
    ----------
    name : str
        The file's name.
    motion : (n,) array
        Displacement [m] or angle [rad].
    effort : (n,) array
        Force [N] or torque [N m].
    time : (n,) array or None
        [s].
    kind : {"force", "torque"}
        Which pair `motion` and `effort` are.
    decisions : Decisions or None
        How the file was read.
    notes : tuple of str
        What was changed since.
    zeros, signs : (float, float)
        Of effort and motion: what was subtracted from the readings since [N, m] or [N m, rad], and -1 where the sign
        was then reversed.
    """

    name: str
    motion: FloatArray
    effort: FloatArray
    time: FloatArray | None = None
    kind: Kind = "force"
    decisions: Decisions | None = field(default=None, compare=False)
    notes: tuple[str, ...] = field(default=(), compare=False)
    zeros: tuple[float, float] = field(default=(0.0, 0.0), compare=False)
    signs: tuple[float, float] = field(default=(1.0, 1.0), compare=False)

    def __post_init__(self) -> None:
        """Freeze the arrays and refuse what no curve can be."""
        object.__setattr__(self, "motion", read_only(self.motion))
        object.__setattr__(self, "effort", read_only(self.effort))
        if self.time is not None:
            object.__setattr__(self, "time", read_only(self.time))
        _check_values(self)

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.motion)

    @property
    def motion_dimension(self) -> Literal["length", "angle"]:
        """``length`` or ``angle``."""
        return "length" if self.kind == "force" else "angle"

    @cached_property
    def travel(self) -> float:
        """From the least to the largest motion [m or rad], samples far off their neighbours not counted."""
        near = self.motion[spikes(self.motion) == 0]
        return float(np.ptp(near)) or float(np.ptp(self.motion))

    @property
    def lines(self) -> list[str]:
        """Sentences on how the file was read and what was changed since."""
        return [*(self.decisions.lines() if self.decisions else []), *self.notes]


def read_recording(path: str | os.PathLike[str], units: str | None = None) -> Recording:
    """Return the measured curve in a lab file.

    Parameters
    ----------
    path : path-like
        Text with columns: displacement and force, or angle and torque, and perhaps time.
    units : str, optional
        Units that the header does not state, by name or number of the column: ``"s=mm,F=N"``.
        Where several columns qualify, those named here are used.

    Raises
    ------
    cfmkit.errors.UsageError
        If the file cannot be read, or `units` is malformed.
    cfmkit.errors.DataError
        If it holds no curve.
    """
    name = Path(path).name
    reported = read_units(units)
    text, encoding = decoded(_content(Path(path)), name)
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    block = block_of(lines, name)
    columns, header = columns_of(lines, block, reported, name)
    roles = roles_of([column for column in columns if column.index in block.numeric], columns, name)
    values = _values(lines, block, list(roles.values()), name)
    rows = [index + 1 for index in range(block.first, block.last) if lines[index].strip()]
    others = len([line for line in lines if line.strip()]) - len(rows) - (header is not None)
    dialect = block.dialect
    decisions = Decisions(
        encoding,
        SEPARATORS[dialect.separator],
        {".": "point", ",": "comma"}[dialect.decimal],
        block.first + 1,
        header,
        others,
        {role: f"{column.name} [{column.unit}]" for role, column in roles.items()},
        tuple(column.name for column in columns if column.name and column not in roles.values()),
    )
    return _recording(name, dict(zip(roles, values, strict=True)), decisions, rows)


def _content(path: Path) -> bytes:
    try:
        if path.is_dir():
            raise UsageError(f"{path} is a folder; name a data file in it")
        with path.open("rb") as file:  # not by its stated size: a pipe or a device states none
            data = file.read(LARGEST + 1)
    except FileNotFoundError:
        raise UsageError(f"{path}: there is no such file") from None
    except (OSError, ValueError) as error:
        raise UsageError(f"{visible(str(path))} cannot be read: {reason_of(error)}") from None
    if len(data) > LARGEST:
        raise DataError(f"{path.name}: is larger than {LARGEST // 1_000_000} MB; thin it out or split it")
    return data


def _values(lines: list[str], block: TextBlock, columns: Sequence[ColumnInfo], name: str) -> list[FloatArray]:
    """Return the numbers of some columns in SI."""
    rows = lines[block.first : block.last]
    if block.dialect.decimal == ",":
        raw = "\n".join(rows)
        if "." in raw:
            _refuse_in(rows, block, name, columns)
        if block.dialect.separator != ",":
            rows = raw.replace(",", ".").split("\n")
    try:
        table = np.loadtxt(
            StringIO("\n".join(rows)),
            delimiter=None if block.dialect.separator == " " else block.dialect.separator,
            comments=None,
            usecols=[column.index for column in columns],
            quotechar='"' if block.dialect.quoted else None,
            converters=_comma_reader if block.dialect.decimal == "," and block.dialect.separator == "," else None,
            ndmin=2,
        )
    except ValueError:
        raise DataError(_bad_cell(lines, block, columns, name)) from None
    if not np.isfinite(table).all():
        raise DataError(_bad_cell(lines, block, columns, name))
    return [_in_si(table[:, number], column) for number, column in enumerate(columns)]


def _comma_reader(cell: str) -> float:
    return float(cell.replace(",", "."))


def _in_si(values: FloatArray, column: ColumnInfo) -> FloatArray:
    from cfmkit.specs.units import from_border
    from cfmkit.specs.units.table import COMMON, border_unit

    dimension, unit = column.dimension or "", column.unit or ""
    if unit == border_unit(dimension):
        converted: FloatArray = from_border(values, dimension)
        return converted
    if (dimension, unit) in COMMON:
        return values * float(COMMON[dimension, unit])
    from cfmkit.specs.units.unit_size import unit_size

    return values * float(unit_size(unit).factor)


def _refuse_in(rows: list[str], block: TextBlock, name: str, columns: Sequence[ColumnInfo]) -> None:
    for row in rows:
        cells = block.dialect.cells(row)
        for column in columns:
            if column.index < len(cells):
                refuse_group(cells[column.index], name)


def _bad_cell(lines: list[str], block: TextBlock, columns: Sequence[ColumnInfo], name: str) -> str:
    """Return what is wrong with the first line of the block that cannot be used."""
    for number in range(block.first, block.last):
        cells = block.dialect.cells(lines[number])
        if lines[number].strip() and len(cells) != block.width:
            return f"{name}: line {number + 1} has {len(cells)} cells, the others have {block.width}"
        for column in columns if cells else ():
            cell = cells[column.index]
            if not block.dialect.is_number(cell):
                refuse_group(cell, name)
                what = "is empty" if not cell else f"holds {shown(cell)}, which is not a number"
                return f"{name}: line {number + 1}: column {column.label} {what}; remove the line or correct it"
    return f"{name}: the numbers from line {block.first + 1} on cannot be read"


def _recording(name: str, values: dict[str, FloatArray], decisions: Decisions, lines: list[int]) -> Recording:
    kind: Kind = "force" if "force" in values else "torque"
    motion, effort = (
        (values["displacement"], values["force"]) if kind == "force" else (values["angle"], values["torque"])
    )
    time = values.get("time")
    if time is not None and len(time) > 1 and (back := np.flatnonzero(np.diff(time) < 0)).size:
        raise DataError(
            f"{name}: line {lines[int(back[0]) + 1]}: the time goes back from {time[back[0]]:g} s to "
            f"{time[back[0] + 1]:g} s; a recording must be in the order in which it was made"
        )
    return Recording(name, motion, effort, time, kind, decisions)


def _check_values(recording: Recording) -> None:
    """Raise if there is no curve in the numbers."""
    name, motion, effort = recording.name, recording.motion, recording.effort
    if len({len(motion), len(effort), len(motion if recording.time is None else recording.time)}) != 1:
        raise DataError(f"{name}: the columns differ in length")
    if len(motion) < FEWEST:
        raise DataError(f"{name}: has {len(motion)} points; a curve needs at least {FEWEST}")
    if not (np.isfinite(motion).all() and np.isfinite(effort).all()):
        raise DataError(f"{name}: not every value is a finite number")
    words = ("displacement", "force") if recording.kind == "force" else ("angle", "torque")
    for values, word in zip((motion, effort), words, strict=True):
        if np.ptp(values) == 0:
            raise DataError(
                f"{name}: the {word} is the same at all {len(values)} points; the sensor stood still, or another "
                "column is meant"
            )


__all__ = ["FEWEST", "Decisions", "Recording", "columns_of", "read_recording", "roles_of"]
