"""A tidy table as a value: read-only columns with names and units; the table of a run's curves; Parquet.

As Parquet, for studies with more points than a spreadsheet opens, it takes a tenth of the bytes, and types are kept;
that needs pyarrow (``pip install pyarrow``). Libraries that only some users need are imported when they are used, and
named with the command that installs them.
"""

from __future__ import annotations

import io
import math
import re
from dataclasses import dataclass
from importlib import import_module
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cfmkit.arrays import Several, ShortRepr, read_only
from cfmkit.curves import Column, Curve
from cfmkit.errors import CfmError, UsageError, visible
from cfmkit.specs.units.decimal_scaling_and_grids import shift_decimal

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import ArrayLike

    from cfmkit.arrays import FloatArray

    Part = tuple[Mapping[str, Column], int]


Cell = float | int | str | None
Values = NDArray[Any] | tuple[Cell, ...]

HEADER_PATTERN = re.compile(r"(?P<name>[^\[\] ](?:[^\[\]]*[^\[\] ])?)(?: \[(?P<unit>[^\[\]\s]+)\])?")
_INT64_RANGE = range(-(2**63), 2**63)


@dataclass(frozen=True, eq=False, repr=False)
class TableColumn(ShortRepr):
    """One column: its name, its values, and its unit if it has one."""

    name: str  # without brackets, e.g. ``force``
    # floats, integers, texts and None; truth values become ``true`` and ``false``. Kept as a read-only array if all are
    # floats (None is NaN there) or all are integers, else as a tuple
    values: Values
    # of the border, ``"1"`` for a ratio; None for names, states and counts. A column with a unit holds no texts
    unit: str | None = None

    def __post_init__(self) -> None:
        match = HEADER_PATTERN.fullmatch(self.header)
        if not match or match["name"] != self.name or match["unit"] != self.unit:
            raise CfmError(f"{self.header!r} cannot head a column: it must be a name with a unit in brackets")
        object.__setattr__(self, "values", _frozen(self.values, numeric=self.unit is not None))
        if self.unit is not None and isinstance(self.values, tuple):
            for cell in self.values:
                if isinstance(cell, str):
                    raise CfmError(f"{cell!r} is not a number: column {self.header!r} has a unit")

    @property
    def header(self) -> str:
        """The column's header: ``force [N]``."""
        return self.name if self.unit is None else f"{self.name} [{self.unit}]"

    def cells(self) -> list[Cell]:
        """Return the values as Python objects, None where one is missing."""
        if isinstance(self.values, tuple):
            return list(self.values)
        items: list[Cell] = self.values.tolist()
        if self.values.dtype.kind == "f":
            for index in np.flatnonzero(np.isnan(self.values)):
                items[index] = None
        return items


@dataclass(frozen=True, eq=False)
class Table(ShortRepr):
    """Columns of one length, in order, with different headers."""

    columns: tuple[TableColumn, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "columns", Several(self.columns))
        headers = self.headers
        if twice := sorted({name for name in headers if headers.count(name) > 1}):
            raise CfmError(f"the columns of a table need different headers, but there are two of {', '.join(twice)}")
        if len({len(column.values) for column in self.columns}) > 1:
            lengths = ", ".join(f"{column.header}: {len(column.values)}" for column in self.columns)
            raise CfmError(f"the columns of a table need one length ({lengths})")

    def __repr__(self) -> str:
        heads = ", ".join(self.headers)
        shown = heads if len(heads) <= 500 else f"{heads[:500]}..."
        return f"<Table of {len(self)} rows: {shown}>"

    def __len__(self) -> int:
        return len(self.columns[0].values) if self.columns else 0

    def __getitem__(self, name: str) -> Values:
        """Return the values of a column, by name (``force``) or header (``force [N]``)."""
        for column in self.columns:
            if name in (column.header, column.name):
                return column.values
        raise KeyError(f"there is no column {name!r}; there are {', '.join(self.headers)}")

    @property
    def headers(self) -> tuple[str, ...]:
        """The headers, in order."""
        return tuple(column.header for column in self.columns)

    def as_dict(self) -> dict[str, list[Cell]]:
        """Return the columns by their headers as plain lists, None where a value is missing."""
        return {column.header: column.cells() for column in self.columns}


def _frozen(values: Iterable[Any], *, numeric: bool) -> Values:
    """Return `values` as a read-only array of floats or of integers, or else as a tuple."""
    if isinstance(values, np.ndarray):
        if values.ndim != 1:
            raise CfmError(f"a column is a sequence of values, not an array of shape {values.shape}")
        if values.dtype.kind == "i":
            return read_only(values, np.int64)
        if values.dtype.kind == "f":
            return read_only(values + 0.0)  # adding zero turns -0.0 into 0.0
        if values.dtype.kind == "b":
            return tuple(np.where(values, "true", "false").tolist())
        if values.dtype.kind == "U":
            return tuple(text or None for text in values.tolist())
        values = values.tolist()
    cells = tuple(map(_to_cell, values))
    kinds = set(map(type, cells))
    if kinds in ({float}, {float, type(None)}) or (numeric and kinds <= {type(None)}):
        return read_only([math.nan if cell is None else cell for cell in cells])
    if kinds == {int} and all(cell in _INT64_RANGE for cell in cells):
        return read_only(cells, np.int64)
    return cells


def _to_cell(value: Any) -> Cell:
    """Return one value as a float, an int or a text; None if it is missing."""
    if value is None or isinstance(value, str):
        return str(value) if value else None
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, Integral):
        return int(value)
    if isinstance(value, Real):
        number = float(value) + 0.0
        return None if math.isnan(number) else number
    raise CfmError(f"a table holds numbers, texts and None, not {type(value).__name__}")


def curve_table(
    curves: Sequence[Curve],  # the nominal one first
) -> Table:
    """Return the curves of one run as one tidy table in border units, stacked in their order.

    The values that tell the curves apart lead, then come ``branch``, displacement or angle, force or torque,
    ``stable``, and the extras. A column that a curve does not have is empty in its rows.
    """
    labels: list[Part] = [
        ({name: Column(np.full(len(curve), value), kind) for name, (value, kind) in curve.label.items()}, len(curve))
        for curve in curves
    ]
    columns: list[Part] = [(dict(curve.columns()), len(curve)) for curve in curves]
    return Table((*_stack_columns(labels), *_stack_columns(columns)))


def text_column(name: str, values: Iterable[str | None]) -> TableColumn:
    """Return names and messages as a column; control characters are escaped: such texts come from outside.

    Examples
    --------
    >>> text_column("spec", ["a.yaml", "b\\x1b.yaml"]).values
    ('a.yaml', 'b\\\\x1b.yaml')
    """
    return TableColumn(name, tuple(None if text is None else visible(text) for text in values))


def border_column(
    name: str,  # name of the column, without a unit
    values: Any,  # (n,): SI values, or texts if `dimension` is ``"text"``
    dimension: str,  # a dimension of `cfmkit.specs.units`, or ``"text"``
) -> TableColumn:
    """Return SI values as a column in the border unit of their dimension."""
    if dimension == "text":
        return TableColumn(name, values)
    from cfmkit.specs.units import border_unit

    return TableColumn(name, border_values(values, dimension), border_unit(dimension))


def border_values(
    values: ArrayLike,  # SI values
    dimension: str,  # a dimension of `cfmkit.specs.units`
) -> FloatArray:
    """Return SI values in the border unit of their dimension, as short decimals where they are ones.

    Examples
    --------
    >>> float(border_values(0.0041, "length")), 0.0041 * 1000
    (4.1, 4.1000000000000005)
    """
    # Here and above, because reading and writing CSV needs no units.
    from cfmkit.specs.units import to_border

    factor = float(to_border(1.0, dimension))
    power = round(math.log10(factor))
    if factor == float(f"1e{power}"):
        return shift_decimal(values, power)
    return np.asarray(to_border(np.asarray(values, dtype=np.float64), dimension))


def _stack_columns(parts: Sequence[Part]) -> list[TableColumn]:
    """Return every column that occurs in `parts`, one part below the other."""
    kinds = {name: column.dimension for columns, _ in parts for name, column in columns.items()}
    return [border_column(name, _stack_values(name, kind, parts), kind) for name, kind in kinds.items()]


def _stack_values(name: str, kind: str, parts: Sequence[Part]) -> Any:
    missing: Any = "" if kind == "text" else math.nan
    return np.concatenate([part[name].values if name in part else np.full(count, missing) for part, count in parts])


def library(
    name: str,  # what it is imported as
    purpose: str,  # what needs it, for the message: ``to_pandas``
) -> Any:
    """Return an optional library.

    Raises UsageError where it is not installed, with the command that installs it.
    """
    try:
        return import_module(name)
    except ImportError:
        raise UsageError(f"{purpose} needs {name}: pip install {name}") from None


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

    columns: dict[str, Any] = {column.header: _null_or_cells(column.cells()) for column in table.columns}
    into = io.BytesIO()
    writer.write_table(pyarrow.table(columns), into, compression="zstd")
    return into.getvalue()


def _null_or_cells(cells: Any) -> list[Any]:
    """Return the cells of a column, numbers that are not there as null; a column of texts and numbers as texts."""
    values = [None if isinstance(cell, float) and cell != cell else cell for cell in cells]
    kinds = {type(value) for value in values if value is not None}
    if str in kinds and len(kinds) > 1:
        return [None if value is None else str(value) for value in values]
    return values
