"""Tables as Parquet, for studies with more points than a spreadsheet opens: a tenth of the bytes, and types kept.

Needs pyarrow (``pip install pyarrow``).
"""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

from cfmkit.tables.optional_libraries import library

if TYPE_CHECKING:
    from cfmkit.tables.table import Table


def require_pyarrow() -> None:
    """Raise UsageError with the command that installs pyarrow where it is not there."""
    library("pyarrow", "--table parquet")


def parquet(table: Table) -> bytes:
    """Return a table as Parquet, its columns headed as in the CSV, an empty cell as null.

    Raises UsageError without pyarrow.
    """
    require_pyarrow()
    import pyarrow
    from pyarrow import parquet as writer

    columns: dict[str, Any] = {column.header: _cells(column.cells()) for column in table.columns}
    into = io.BytesIO()
    writer.write_table(pyarrow.table(columns), into, compression="zstd")
    return into.getvalue()


def _cells(cells: Any) -> list[Any]:
    """Return the cells of a column, numbers that are not there as null; a column of texts and numbers as texts."""
    values = [None if isinstance(cell, float) and cell != cell else cell for cell in cells]
    kinds = {type(value) for value in values if value is not None}
    if str in kinds and len(kinds) > 1:
        return [None if value is None else str(value) for value in values]
    return values
