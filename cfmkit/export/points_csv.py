"""The exact points of a drawing as CSV, one table per file: for CAD splines and for checking a finished part."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.errors import GeometryError
from cfmkit.export.layers import check_name

if TYPE_CHECKING:
    from cfmkit.export.contours import Drawing


def write_points(drawing: Drawing) -> dict[str, bytes]:
    """Return the drawing's tables as CSV with the header ``x [mm],y [mm],...``, by file name.

    Raises GeometryError if two tables have one name, or a name that no file can have.
    """
    from cfmkit.tables import Table, border_column, to_csv

    files: dict[str, bytes] = {}
    for table in drawing.tables:
        name = f"{check_name(table.name, 'table')}.csv"
        if name in files:
            raise GeometryError(f"the drawing {drawing.name!r} has two tables named {table.name!r}")
        columns = (border_column(key, values, dimension) for key, (values, dimension) in table.columns.items())
        files[name] = to_csv(Table(tuple(columns)))
    return files
