"""Reader of measured outlines (of a cam) and profiles (of a surface): points [m] from a file with columns x and y.

Units are in the header; a third column may say to which side of an outline a point belongs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import DataError, reason_of
from cfmkit.tables.lab_file import decode_file, lines_of, tables_in

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.tables.lab_columns import ColumnInfo
    from cfmkit.tables.lab_file import LabTable

MIN_SIDE_POINTS = 20  # points on a side without which it cannot be told from noise
SIDE_WORDS = {"right": "right", "r": "right", "rechts": "right", "left": "left", "l": "left", "links": "left"}


def read_sides(
    # columns ``x [mm]`` and ``y [mm]``, in any unit of length; a column ``side`` with left and right, without which the
    # sign of x tells the sides
    path: Path,
) -> tuple[FloatArray, FloatArray]:
    """Return the points of the right and of the left side of an outline, each in the order of y [m].

    Raises DataError if there are no points, no units, or too few on a side.
    """
    name = path.name
    points, table = _read_points(path)
    side = next((column for column in table.columns if column.name.lower() == "side"), None)
    sides = np.where(points[:, 0] > 0, "right", "left") if side is None else _read_side_column(table, side)
    right, left = _order_points(points, sides == "right", name), _order_points(points, sides == "left", name)
    if right[:, 0].mean() < left[:, 0].mean():
        raise DataError(
            f"{name}: the points of the right flank have smaller x than those of the left one; is the sign of x "
            "reversed, or are the sides swapped?"
        )
    return right, left


def read_profile(
    path: Path,  # columns ``x [mm]`` and ``y [mm]``, in any unit of length
) -> tuple[FloatArray, FloatArray]:
    """Return a profile, heights over places that increase [m].

    Raises DataError if there are no units, fewer than two points, or places that do not increase.
    """
    points, table = _read_points(path)
    back = np.flatnonzero(np.diff(points[:, 0]) <= 0)
    if len(points) < 2:
        raise DataError(f"{path.name}: a profile needs at least two points")
    if len(back):
        line = table.rows[int(back[0]) + 1] + 1
        raise DataError(f"{path.name}: line {line}: x must increase from point to point; sort the file or split it")
    return points[:, 0], points[:, 1]


def _read_points(path: Path) -> tuple[FloatArray, LabTable]:
    """Return the points of a file [m] and its table."""
    name = path.name
    try:
        text, _ = decode_file(path.read_bytes(), name)
    except OSError as error:
        raise DataError(f"{name}: cannot be read: {reason_of(error)}") from None
    tables = tables_in(lines_of(text), name)
    if len(tables) > 1:
        raise DataError(f"{name}: there are {len(tables)} tables, where one is needed; split the file")
    axes = [_axis_column(tables[0].columns, axis, name) for axis in "xy"]
    table = tables[0].with_values(axes)
    return np.column_stack([table.numbers(axis) for axis in axes]), table


def _axis_column(columns: Sequence[ColumnInfo], axis: str, name: str) -> ColumnInfo:
    """Return the column of a coordinate."""
    column_of_axis = next((column for column in columns if column.name.lower() == axis), None)
    if column_of_axis is None:
        raise DataError(f"{name}: needs a header with columns 'x [mm]' and 'y [mm]', and perhaps 'side'")
    if column_of_axis.dimension != "length":
        raise DataError(f"{name}: the column {axis!r} needs a unit of length in the header: '{axis} [mm]'")
    return column_of_axis


def _read_side_column(table: LabTable, column: ColumnInfo) -> NDArray[np.str_]:
    """Return the side of each point."""
    words = [text.lower() for text in table.texts(column)]
    number = next((number for number, word in enumerate(words) if word not in SIDE_WORDS), None)
    if number is not None:
        raise DataError(
            f"{table.file}: line {table.rows[number] + 1}: the side is {words[number]!r}; it must be 'left' or 'right'"
        )
    return np.array([SIDE_WORDS[word] for word in words])


def _order_points(points: FloatArray, chosen: NDArray[np.bool_], name: str) -> FloatArray:
    side = points[chosen]
    if len(side) < MIN_SIDE_POINTS:
        raise DataError(
            f"{name}: has {len(points)} points, {len(side)} of them on one side; both flanks are needed with at least "
            f"{MIN_SIDE_POINTS} points each"
        )
    return np.asarray(side[np.argsort(side[:, 1], kind="stable")])
