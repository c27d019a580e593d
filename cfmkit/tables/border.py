"""Curves and other SI values as table columns in the units of the border."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.curves import Column, Curve
from cfmkit.specs.units.decimals import shift_decimal
from cfmkit.tables.table import Table, TableColumn

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import ArrayLike

    from cfmkit.arrays import FloatArray

    Part = tuple[Mapping[str, Column], int]


def curve_table(curves: Sequence[Curve]) -> Table:
    """Return the curves of one run as one tidy table in border units, stacked in their order.

    The values that tell the curves apart lead, then come ``branch``, displacement
    or angle, force or torque, ``stable``, and the extras. A column that a curve
    does not have is empty in its rows.

    Parameters
    ----------
    curves : sequence of Curve
        The nominal one first.
    """
    labels: list[Part] = [(_label_columns(curve), len(curve)) for curve in curves]
    columns: list[Part] = [(dict(curve.columns()), len(curve)) for curve in curves]
    return Table((*_stacked(labels), *_stacked(columns)))


def border_column(name: str, values: Any, dimension: str) -> TableColumn:
    """Return SI values as a column in the border unit of their dimension.

    Parameters
    ----------
    name : str
        Name of the column, without a unit.
    values : (n,) array
        SI values, or texts if `dimension` is ``"text"``.
    dimension : str
        A dimension of `cfmkit.specs.units`, or ``"text"``.
    """
    if dimension == "text":
        return TableColumn(name, values)
    from cfmkit.specs.units import border_unit

    return TableColumn(name, border_values(values, dimension), border_unit(dimension))


def border_values(values: ArrayLike, dimension: str) -> FloatArray:
    """Return SI values in the border unit of their dimension, as short decimals where they are ones.

    Parameters
    ----------
    values : array_like
        SI values.
    dimension : str
        A dimension of `cfmkit.specs.units`.

    Examples
    --------
    >>> float(border_values(0.0041, "length")), 0.0041 * 1000
    (4.1, 4.1000000000000005)
    """
    # Here and above, because reading and writing CSV needs no units.
    from cfmkit.specs.units import to_border

    power = _power_of_ten(float(to_border(1.0, dimension)))
    if power is not None:
        return shift_decimal(values, power)
    converted: FloatArray = to_border(np.asarray(values, dtype=np.float64), dimension)
    return converted


def _power_of_ten(factor: float) -> int | None:
    power = round(math.log10(factor))
    return power if factor == float(f"1e{power}") else None


def _label_columns(curve: Curve) -> dict[str, Column]:
    return {name: Column(np.full(len(curve), value), kind) for name, (value, kind) in curve.label.items()}


def _stacked(parts: Sequence[Part]) -> list[TableColumn]:
    """Return every column that occurs in `parts`, one part below the other."""
    kinds = {name: column.dimension for columns, _ in parts for name, column in columns.items()}
    return [border_column(name, _stack(name, kind, parts), kind) for name, kind in kinds.items()]


def _stack(name: str, kind: str, parts: Sequence[Part]) -> Any:
    missing: Any = "" if kind == "text" else math.nan
    return np.concatenate([part[name].values if name in part else np.full(count, missing) for part, count in parts])
