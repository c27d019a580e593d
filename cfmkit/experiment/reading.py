"""Measured curves from lab CSV files as they come, in SI, one for each specimen; what was decided can be read back.

Separator, decimal sign, encoding and header are found out (`cfmkit.tables.lab_file`), units and roles of the columns
are read or stated by the user. Only the columns that are used must be free of gaps.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from cfmkit.arrays import FloatArray, ShortRepr, read_only
from cfmkit.errors import DataError, UsageError, reason_of, visible
from cfmkit.numerics.robust_statistics import spikes
from cfmkit.specs.units.strict_decimal_number import quote
from cfmkit.tables.lab_columns import column_named, read_units, roles_of
from cfmkit.tables.lab_file import EMPTY_CHARACTERS, SEPARATOR_NAMES, decode_file, lines_of, tables_in

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable, Mapping, Sequence

    from cfmkit.curves import Kind
    from cfmkit.tables.lab_columns import ColumnInfo
    from cfmkit.tables.lab_file import LabTable


MAX_FILE_BYTES = 500_000_000  # bytes of the largest file that is read
MIN_CURVE_POINTS = 8  # points without which there is no curve


@dataclass(frozen=True)
class Decisions:
    """Decisions of the reader about a file, for the user to check."""

    # encoding, separator, decimal: in words
    encoding: str
    separator: str
    decimal: str
    first_line: int  # line of the file, from 1, with the first numbers
    header_line: int | None  # line with the names
    skipped_lines: int  # lines above and below that are neither header nor numbers
    columns: dict[str, str]  # role -> name and unit
    unused: tuple[str, ...]  # columns that are not used

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
    """A measured curve as recorded: SI, in the order of the file."""

    name: str
    """The file's name."""
    motion: FloatArray
    """Displacement [m] or angle [rad], (n,)."""
    effort: FloatArray
    """Force [N] or torque [N m], (n,)."""
    time: FloatArray | None = None
    """Of each sample, (n,) [s]; None if it was not recorded."""
    kind: Kind = "force"
    """Which pair `motion` and `effort` are: "force" or "torque"."""
    decisions: Decisions | None = field(default=None, compare=False)
    """Choices that the reader made in the file; None if it was made of arrays."""
    notes: tuple[str, ...] = field(default=(), compare=False)
    """A sentence for each correction after reading."""
    zeros: tuple[float, float] = field(default=(0.0, 0.0), compare=False)
    """Of effort and motion: what was subtracted from the readings since [N, m] or [N m, rad]."""
    signs: tuple[float, float] = field(default=(1.0, 1.0), compare=False)
    """Of effort and motion: -1 where the sign was reversed after that."""

    def __post_init__(self) -> None:
        """Freeze the arrays and refuse what no curve can be."""
        object.__setattr__(self, "motion", read_only(self.motion))
        object.__setattr__(self, "effort", read_only(self.effort))
        if self.time is not None:
            object.__setattr__(self, "time", read_only(self.time))
        _check_values(self)

    def __len__(self) -> int:
        return len(self.motion)

    @property
    def motion_dimension(self) -> Literal["length", "angle"]:
        """``length`` or ``angle``."""
        return "length" if self.kind == "force" else "angle"

    @cached_property
    def travel(self) -> float:
        """From the least to the largest motion [m or rad], samples far off their neighbours not counted."""
        regular = self.motion[spikes(self.motion) == 0]
        return float(np.ptp(regular)) or float(np.ptp(self.motion))

    @property
    def lines(self) -> list[str]:
        """Sentences on how the file was read and what was changed afterwards."""
        return [*(self.decisions.lines() if self.decisions else []), *self.notes]


def read_recording(
    path: str | os.PathLike[str],  # text with columns: displacement and force, or angle and torque, and perhaps time
    # units that the header does not state, by name or number of the column: ``"s=mm,F=N"``. Where several columns
    # qualify, those named here are used
    units: str | None = None,
    group: str | None = None,  # which specimen of several, as ``"Specimen=2"``; ``"none"``: all rows are of one
) -> Recording:
    """Return the measured curve in a lab file.

    Raises UsageError if the file cannot be read, or `units` is malformed; DataError if it holds no curve, or those of
    several specimens.
    """
    recordings = read_recordings(path, units, group)
    if len(recordings) > 1:
        column = (group or "").strip()
        raise DataError(
            f"{Path(path).name}: {column!r} has {len(recordings)} values; choose {_choices(column, recordings)}"
        )
    return next(iter(recordings.values()))


def read_recordings(
    # path, units: as for `read_recording`
    path: str | os.PathLike[str],
    units: str | None = None,
    # ``"COLUMN"``: one curve for each of its values; ``"COLUMN=VALUE"``: that one; ``"table"`` and ``"table=2"``
    # likewise of tables one below the other; ``"none"``: all rows of a table are of one specimen, whatever its columns
    # say. Default: all rows, where nothing speaks for several specimens
    group: str | None = None,
) -> dict[str, Recording]:
    """Return the measured curve of each specimen in a lab file, by what `group` tells them apart.

    Raises UsageError if the file cannot be read, or `units` is malformed; DataError if it holds no curve, or those of
    several specimens and `group` does not say of which.
    """
    name = Path(path).name
    stated = read_units(units)
    text, encoding = decode_file(_read_bytes(Path(path)), name)
    lines = lines_of(text)
    tables = tables_in(lines, name, stated)
    key, _, value = (part.strip() for part in (group or "").partition("="))
    if group is not None and not key:
        raise UsageError("--group is empty; give the column that tells the specimens apart, as --group Specimen")
    if len(tables) > 1 or key == TABLE_WORD:
        return _each_table(tables, group, encoding, name)
    table = tables[0]
    roles = roles_of(table.numeric, table.columns, name)
    if key in ("", NO_COLUMN_WORD):
        specimens = None if key else _specimen_column(table, roles)
        if specimens is not None:
            values = list(dict.fromkeys(_labels(table, specimens)))
            raise DataError(
                f"{name}: {quote(specimens.name)} tells {len(values)} specimens apart, which no single curve "
                f"describes; choose {_choices(specimens.name, values)}, or --group {NO_COLUMN_WORD} for rows of one"
            )
        return {"": _recording_from_table(table, roles, encoding, name)}
    column = column_named(key, table.columns, name)
    parts = _tables_by_value(table.with_values(list(roles.values())), column)
    if value and value not in parts:
        raise DataError(
            f"{name}: --group: {quote(column.name)} is nowhere {quote(value)}; there are {_choices(key, parts)}"
        )
    chosen = {value: parts[value]} if value else parts
    total = sum(len(part.rows) for part in parts.values())
    return {
        item: _recording_from_table(part, roles, encoding, f"{name}, {column.name} {item}", total)
        for item, part in chosen.items()
    }


TABLE_WORD, NO_COLUMN_WORD = "table", "none"
"""Words in place of a column: tables one below the other, and no column at all."""
_NO_SPECIMEN = re.compile(
    r"(?i).*(cycle|zyklus|loop|branch|segment|step|schritt|direction|richtung|phase|stage|stroke|block|ramp|pass\b"
    r"|judg|state|status|mode|unit|remark|comment|note|event|flag|error|date|datum|time|zeit).*"
)
"""Columns of such names tell parts of one recording apart, or say something of its points."""
_SPECIMEN_PATTERN = re.compile(r"(?i).*(specimen|sample|probe|pr\u00fcfling|muster|teil|part|piece|serial|\bid\b).*")


def _each_table(tables: Sequence[LabTable], group: str | None, encoding: str, name: str) -> dict[str, Recording]:
    """Return the curve of each table of a file, or of the one that is chosen."""
    key, _, value = (part.strip() for part in (group or "").partition("="))
    names = [str(number + 1) for number in range(len(tables))]
    if key != TABLE_WORD or (value and value not in names):
        places = ", ".join(str(table.rows[0] + 1) for table in tables)
        choices = _choices(TABLE_WORD, names)
        raise DataError(
            f"{name}: there are {len(tables)} tables, with numbers from lines {places} on; choose {choices}"
        )
    chosen = [value] if value else names
    recordings = {}
    for item in chosen:
        table = tables[int(item) - 1]
        roles = roles_of(table.numeric, table.columns, name)
        recordings[item] = _recording_from_table(
            table, roles, encoding, f"{name}, table {item}", sum(len(table_of_all.rows) for table_of_all in tables)
        )
    return recordings


def _choices(column: str, values: Iterable[str]) -> str:
    """Return what to write for each of some values."""
    listed = list(values)
    shown_ones = [f'--group "{column}={value}"' for value in listed[:MOST_LISTED]]
    return " or ".join(shown_ones) + (f" (and {len(listed) - MOST_LISTED} more)" if len(listed) > MOST_LISTED else "")


MOST_LISTED = 6  # so many values are listed to choose from


def _labels(table: LabTable, column: ColumnInfo) -> list[str]:
    """Return the cells of a column; an empty one is as the one above it, as spreadsheets merge them."""
    cells: list[str] = []
    for text in table.texts(column):
        cells.append(text or (cells[-1] if cells else ""))
    return cells


def _tables_by_value(table: LabTable, column: ColumnInfo) -> dict[str, LabTable]:
    """Return the rows of each value of a column."""
    labels = _labels(table, column)
    return {item: table.only(label == item for label in labels) for item in dict.fromkeys(labels)}


def _specimen_column(table: LabTable, roles: Mapping[str, ColumnInfo]) -> ColumnInfo | None:
    """Return the column that tells specimens apart; None if none does.

    It has words or whole numbers without a unit, each over much of the travel, and in rows that follow each other
    unless its name says what it is.
    """
    filled = table.with_values(list(roles.values()))
    motion = filled.numbers(roles.get("displacement") or roles["angle"])
    units = {column.unit_column for column in table.columns}
    for column in table.columns:
        if column in roles.values() or column.unit or column.index in units or _NO_SPECIMEN.fullmatch(column.name):
            continue
        labels = np.array(_labels(filled, column))
        values, runs = set(labels.tolist()), 1 + int((labels[1:] != labels[:-1]).sum())
        named = _SPECIMEN_PATTERN.fullmatch(column.name) is not None
        if len(values) < 2 or "" in values or (runs > len(values) and not named):
            continue
        if any(_is_fraction(value, table) for value in values) or len(values) > len(labels) // MIN_CURVE_POINTS:
            continue
        parts = [motion[labels == value] for value in values]
        if all(len(part) >= MIN_CURVE_POINTS and np.ptp(part) > 0.5 * np.ptp(motion) for part in parts):
            return column
    return None


def _is_fraction(text: str, table: LabTable) -> bool:
    """Return whether a text is a number that is not whole: something was measured there."""
    number = table.shape.dialect.number(text)
    return number is not None and not number[0].is_integer()


def _recording_from_table(
    table: LabTable, roles: Mapping[str, ColumnInfo], encoding: str, name: str, n_rows: int | None = None
) -> Recording:
    """Return the curve of a table; of a part of one `n_rows` is how many rows the file has of it."""
    filled = table.with_values(list(roles.values()))
    n_rows = len(filled.rows) if n_rows is None else n_rows
    values = {role: filled.numbers(column) for role, column in roles.items()}
    others = sum(bool(line.strip(EMPTY_CHARACTERS)) for line in table.lines) - n_rows - (table.header is not None)
    dialect = table.shape.dialect
    decisions = Decisions(
        encoding,
        SEPARATOR_NAMES[dialect.separator],
        {".": "point", ",": "comma"}[dialect.decimal],
        filled.rows[0] + 1,
        None if table.header is None else table.header + 1,
        others,
        {role: f"{column.name} [{column.unit}]" for role, column in roles.items()},
        tuple(column.name for column in table.columns if _is_unused(column, table, roles)),
    )
    kind: Kind = "force" if "force" in values else "torque"
    motion, effort = (
        (values["displacement"], values["force"]) if kind == "force" else (values["angle"], values["torque"])
    )
    time = values.get("time")
    if time is not None and len(time) > 1 and (back := np.flatnonzero(np.diff(time) < 0)).size:
        raise DataError(
            f"{name}: line {filled.rows[int(back[0]) + 1] + 1}: the time goes back from {time[back[0]]:g} s to "
            f"{time[back[0] + 1]:g} s; a recording must be in the order in which it was made"
        )
    return Recording(name, motion, effort, time, kind, decisions)


def _is_unused(column: ColumnInfo, table: LabTable, roles: Mapping[str, ColumnInfo]) -> bool:
    """Return whether a column with a name is neither used nor the unit of one that is."""
    units = {used.unit_column for used in roles.values()}
    named = column.name != f"column {column.index + 1}" or any(table.texts(column))
    return named and column not in roles.values() and column.index not in units


def _read_bytes(path: Path) -> bytes:
    try:
        if path.is_dir():
            raise UsageError(f"{path} is a folder; name a data file in it")
        with path.open("rb") as file:  # not by its stated size: a pipe or a device states none
            data = file.read(MAX_FILE_BYTES + 1)
    except FileNotFoundError:
        raise UsageError(f"{path}: there is no such file") from None
    except (OSError, ValueError) as error:
        raise UsageError(f"{visible(str(path))} cannot be read: {reason_of(error)}") from None
    if len(data) > MAX_FILE_BYTES:
        raise DataError(f"{path.name}: is larger than {MAX_FILE_BYTES // 1_000_000} MB; thin it out or split it")
    return data


def _check_values(recording: Recording) -> None:
    """Raise if there is no curve in the numbers."""
    name, motion, effort = recording.name, recording.motion, recording.effort
    if len({len(motion), len(effort), len(motion if recording.time is None else recording.time)}) != 1:
        raise DataError(f"{name}: the columns differ in length")
    if len(motion) < MIN_CURVE_POINTS:
        raise DataError(f"{name}: has {len(motion)} points; a curve needs at least {MIN_CURVE_POINTS}")
    if not (np.isfinite(motion).all() and np.isfinite(effort).all()):
        raise DataError(f"{name}: not every value is a finite number")
    words = ("displacement", "force") if recording.kind == "force" else ("angle", "torque")
    for values, word in zip((motion, effort), words, strict=True):
        if np.ptp(values) == 0:
            raise DataError(
                f"{name}: the {word} is the same at all {len(values)} points; the sensor stood still, or another "
                "column is meant"
            )


__all__ = ["MIN_CURVE_POINTS", "Decisions", "Recording", "read_recording", "read_recordings"]
