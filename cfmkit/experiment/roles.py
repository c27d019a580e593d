"""Which columns of a lab file are the time, the displacement and the force."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.errors import DataError
from cfmkit.tables.labheaders import ROLES, ColumnInfo, column_of, describe, is_unit_row, split_header
from cfmkit.tables.labtext import Block, header_cells

if TYPE_CHECKING:
    from collections.abc import Sequence

HEADER_LINES = 5
"""So many lines above the numbers are searched for their names."""


def columns_of(lines: list[str], block: Block, told: dict[str, str], name: str) -> tuple[list[ColumnInfo], int | None]:
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
    return describe(names, unit_row, told, name), None if at is None else at + 1


def _halved(header: Sequence[str], width: int) -> bool:
    """Return whether a header has half the cells of the numbers below it, and is not just a title."""
    return width == 2 * len(header) and (len(header) > 1 or bool(split_header(header[0])[1]))


def roles_of(numeric: Sequence[ColumnInfo], columns: Sequence[ColumnInfo], name: str) -> dict[str, ColumnInfo]:
    """Return the columns that are used, by role."""
    pairs = (("length", "force"), ("angle", "torque"))
    there = {item.dimension for item in numeric}
    complete = [pair for pair in pairs if set(pair) <= there]
    if len(complete) > 1:
        told = {item.dimension for item in numeric if item.told}
        complete = [pair for pair in pairs if set(pair) <= told] or complete
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
        return f'{name}: the header names no units, and they are never guessed; say --units "{example}"'
    there = {item.dimension for item in numeric}
    lacking = "force" if "length" in there else "displacement" if "force" in there else "displacement and force"
    lacking = "torque" if "angle" in there and "force" not in there else lacking
    labels = ", ".join(column.label for column in columns)
    return f"{name}: there is no column for the {lacking} among {labels}; say which is in which unit with --units"
