"""Points of a measured outline or profile from a lab file: columns x and y with units, and perhaps a side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import DataError, reason_of
from cfmkit.tables.lab_file import TextBlock, block_of, decoded, header_cells, refuse_group, split_header

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray

FEWEST = 20
"""Points on a side without which it cannot be told from noise."""

SIDES = {"right": "right", "r": "right", "rechts": "right", "left": "left", "l": "left", "links": "left"}


def read_sides(path: Path) -> tuple[FloatArray, FloatArray]:
    """Return the points of the right and of the left side of an outline, each in the order of y [m].

    Parameters
    ----------
    path : Path
        Columns ``x [mm]`` and ``y [mm]``, in any unit of length; a column ``side`` with left and
        right, without which the sign of x tells the sides.

    Raises
    ------
    cfmkit.errors.DataError
        If there are no points, no units, or too few on a side.
    """
    name = path.name
    points, columns, rows = _points(path)
    if "side" in columns:
        sides = np.array([_side(cells, int(columns["side"][0]), name, number) for number, cells in rows])
    else:
        sides = np.where(points[:, 0] > 0, "right", "left")
    right, left = _ordered(points, sides == "right", name), _ordered(points, sides == "left", name)
    if right[:, 0].mean() < left[:, 0].mean():
        raise DataError(
            f"{name}: the points of the right flank have smaller x than those of the left one; is the sign of x "
            "reversed, or are the sides swapped?"
        )
    return right, left


def read_profile(path: Path) -> tuple[FloatArray, FloatArray]:
    """Return a profile, heights over places that increase [m].

    Parameters
    ----------
    path : Path
        Columns ``x [mm]`` and ``y [mm]``, in any unit of length.

    Raises
    ------
    cfmkit.errors.DataError
        If there are no units, fewer than two points, or places that do not increase.
    """
    points, _, rows = _points(path)
    back = np.flatnonzero(np.diff(points[:, 0]) <= 0)
    if len(points) < 2:
        raise DataError(f"{path.name}: a profile needs at least two points")
    if len(back):
        line = rows[int(back[0]) + 1][0] + 1
        raise DataError(f"{path.name}: line {line}: x must increase from point to point; sort the file or split it")
    return points[:, 0], points[:, 1]


def _points(path: Path) -> tuple[FloatArray, dict[str, tuple[int, float]], list[tuple[int, list[str]]]]:
    """Return the points of a file [m], its columns, and the line number and cells of each point."""
    name = path.name
    try:
        text, _ = decoded(path.read_bytes(), name)
    except OSError as error:
        raise DataError(f"{name}: cannot be read: {reason_of(error)}") from None
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    block = block_of(lines, name)
    columns = _columns(lines, block, name)
    rows = [(number, block.dialect.cells(lines[number])) for number in range(block.first, block.last)]
    rows = [(number, cells) for number, cells in rows if cells and lines[number].strip()]
    points = np.array(
        [[_coordinate(cells, columns[axis], block, name, number) for axis in "xy"] for number, cells in rows]
    )
    return points, columns, rows


def _columns(lines: list[str], block: TextBlock, name: str) -> dict[str, tuple[int, float]]:
    """Return index and unit of x and y, and the index of the side."""
    from cfmkit.specs.units.unit_size import border_size, is_unit, unit_size

    above = [index for index in range(block.first) if lines[index].strip()][-5:]
    cells = next(
        (row for row in (header_cells(lines[i], block) for i in reversed(above)) if len(row) == block.width), []
    )
    found: dict[str, tuple[int, float]] = {}
    for index, cell in enumerate(cells):
        title, unit = split_header(cell)
        key = title.strip().lower()
        if key == "side":
            found[key] = (index, 1.0)
        elif key in ("x", "y"):
            if unit is None or not is_unit(unit) or unit_size(unit).powers != border_size("length").powers:
                raise DataError(f"{name}: the column {key!r} needs a unit of length in the header: '{key} [mm]'")
            found[key] = (index, float(unit_size(unit).factor))
    if not {"x", "y"} <= set(found):
        raise DataError(f"{name}: needs a header with columns 'x [mm]' and 'y [mm]', and perhaps 'side'")
    return found


def _coordinate(cells: list[str], column: tuple[int, float], block: TextBlock, name: str, number: int) -> float:
    index, unit = column
    cell = cells[index] if index < len(cells) else ""
    if not block.dialect.is_number(cell):
        refuse_group(cell, name)
        raise DataError(f"{name}: line {number + 1}: {cell!r} is not a number; remove the line or correct it")
    return float(cell.replace(",", ".")) * unit


def _side(cells: list[str], index: int, name: str, number: int) -> str:
    cell = cells[index] if index < len(cells) else ""
    if cell.lower() not in SIDES:
        raise DataError(f"{name}: line {number + 1}: the side is {cell!r}; it must be 'left' or 'right'")
    return SIDES[cell.lower()]


def _ordered(points: FloatArray, chosen: NDArray[np.bool_], name: str) -> FloatArray:
    side = points[chosen]
    if len(side) < FEWEST:
        raise DataError(
            f"{name}: has {len(points)} points, {len(side)} of them on one side; both flanks are needed with at least "
            f"{FEWEST} points each"
        )
    found: FloatArray = side[np.argsort(side[:, 1], kind="stable")]
    return found
