"""The course of a surface: its height and slope at any place, not only at the points that describe it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.families.beam.surface.spec import FileProfile, FormulaProfile, Surface

LOOKED_AT = 4001
"""Places along a surface at which extremes are looked for, before the best is refined."""

_ROWS = 201  # of the curve along a surface that is given by few points
_BESIDE = 1e-9  # of the length: both sides of a corner are looked at


@dataclass(frozen=True)
class Course:
    """A surface between its ends.

    Attributes
    ----------
    height, slope : callable
        Height [m] and its derivative [1] at places [m]; at a corner the slope is that of one side.
    rows : (n,) array
        The places that the curve along it is written at [m].
    corners : (k,) array
        Where the slope jumps [m].
    """

    height: Callable[[FloatArray], FloatArray]
    slope: Callable[[FloatArray], FloatArray]
    rows: FloatArray
    corners: FloatArray

    def places(self, end: float) -> FloatArray:
        """Return many places up to one [m], the rows and both sides of every corner among them."""
        start = float(self.rows[0])
        beside = _BESIDE * (float(self.rows[-1]) - start)
        both = np.concatenate([self.corners - beside, self.corners + beside])
        every = np.unique(np.concatenate([np.linspace(start, end, LOOKED_AT), self.rows, both]))
        return every[(every >= start) & (every <= end)]


def course_of(surface: Surface) -> Course:
    """Return the course of the surface of an analysis.

    Raises
    ------
    cfmkit.errors.DataError
        If the file cannot be used.
    """
    given = surface.profile
    return _of_file(given) if given.kind == "file" else _of_formula(given)


def _of_formula(given: FormulaProfile) -> Course:
    from cfmkit.specs.formula import formula, slope

    height, rise = formula(given.height), slope(given.height)
    rows = np.linspace(0.0, given.length, given.points)
    return Course(lambda x: height(x * 1e3) * 1e-3, lambda x: rise(x * 1e3), rows, np.zeros(0))


def _of_file(given: FileProfile) -> Course:
    from pathlib import Path

    from scipy.interpolate import CubicSpline

    from cfmkit.tables.labpoints import read_profile

    x, y = read_profile(getattr(given.file, "path", Path(given.file)))
    rows = np.unique(np.concatenate([x, np.linspace(x[0], x[-1], _ROWS)]))
    if given.between == "smooth":
        spline = CubicSpline(x, y)
        return Course(spline, spline.derivative(), rows, np.zeros(0))
    steps = np.diff(y) / np.diff(x)

    def slope(places: FloatArray) -> FloatArray:
        return np.asarray(steps[np.clip(np.searchsorted(x, places, side="right") - 1, 0, len(steps) - 1)])

    return Course(lambda places: np.interp(places, x, y), slope, rows, x[1:-1])


def largest(function: Callable[[FloatArray], FloatArray], places: FloatArray) -> float:
    """Return the largest value of a function near the best of some places, refined between its neighbours.

    Examples
    --------
    >>> round(largest(lambda x: 1 - (x - 0.3) ** 2, np.linspace(0.0, 1.0, 5)), 12)
    1.0
    """
    found = -np.inf
    for _ in range(_ZOOMS):
        values = function(places)
        best = int(np.argmax(values))
        found = max(found, float(values[best]))
        low, high = places[max(best - 1, 0)], places[min(best + 1, len(places) - 1)]
        places = np.linspace(low, high, _FINE)
    return found


_ZOOMS, _FINE = 5, 65  # each makes the places 32 times as dense
