"""Polynomials on an element: shape functions of the rotation, Gauss points, integrals from the start.

Places are u in [0, 1], a fraction of the element's parameter.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.polynomial import legendre

from cfmkit.arrays import read_only

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray

N_EXTRA_POINTS = 4  # Gauss points more than the degree: sine and cosine of the rotation are no polynomials


class Basis(NamedTuple):
    """Shape functions of one degree at their Gauss points."""

    degree: int
    places: FloatArray  # (q,)
    weights: FloatArray  # (q,), sum 1
    values: FloatArray  # (q, degree + 1)
    slopes: FloatArray  # (q, degree + 1), by u


@lru_cache(maxsize=64)
def basis(degree: int) -> Basis:
    """Return the shape functions of a degree at `degree + N_EXTRA_POINTS` Gauss points."""
    points, weights = legendre.leggauss(degree + N_EXTRA_POINTS)
    places = (1 + points) / 2
    values, slopes = shape_functions(degree, places)
    return Basis(degree, read_only(places), read_only(weights / 2), read_only(values), read_only(slopes))


def shape_functions(degree: int, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return values and slopes of the shape functions, each (n, degree + 1).

    The first two carry the rotations of the ends, 1 - u and u. The others vanish at both ends and are integrated
    Legendre polynomials: N_k = (P_k - P_{k-2}) / sqrt(4 k - 2), k = 2 ... degree, at 2 u - 1.

    Examples
    --------
    >>> values, slopes = shape_functions(3, np.array([0.0, 1.0]))
    >>> values.round(12).tolist()
    [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]]
    """
    x = 2 * np.asarray(places) - 1
    polynomials = legendre.legvander(x, max(degree, 1))
    order = np.arange(2, degree + 1)
    values, slopes = np.empty((len(x), degree + 1)), np.empty((len(x), degree + 1))
    values[:, 0], values[:, 1] = (1 - x) / 2, (1 + x) / 2
    slopes[:, 0], slopes[:, 1] = -1.0, 1.0
    values[:, 2:] = (polynomials[:, 2:] - polynomials[:, :-2]) / np.sqrt(4 * order - 2)
    slopes[:, 2:] = 2 * np.sqrt(order - 0.5) * polynomials[:, 1:-1]
    return values, slopes


@lru_cache(maxsize=64)
def integrals_to_points(degree: int) -> FloatArray:
    """Return the matrix (q, q) that takes values at the Gauss points to their integrals from 0 to each point."""
    return integrals(basis(degree).places, basis(degree).places)


@lru_cache(maxsize=64)
def slopes_at_points(degree: int) -> FloatArray:
    """Return the matrix (q, q) that takes values at the Gauss points to the slopes there by u."""
    x = 2 * basis(degree).places - 1
    count = len(x)
    slopes = [legendre.legval(x, legendre.legder(unit)) for unit in np.eye(count)]
    return read_only(2 * np.stack(slopes, axis=1) @ np.linalg.inv(legendre.legvander(x, count - 1)))


def integrals(places: FloatArray, ends: FloatArray) -> FloatArray:
    """Return the matrix that takes values at n places to the integrals from 0 to ends, (m, n).

    Exact for polynomials of degree n - 1 in u.
    """
    count = len(places)
    series = np.linalg.inv(legendre.legvander(2 * places - 1, count - 1))
    primitives = [legendre.legval(2 * ends - 1, legendre.legint(unit, lbnd=-1)) for unit in np.eye(count)]
    return read_only(np.stack(primitives, axis=1) @ series / 2)


def interpolation(nodes: FloatArray, places: FloatArray) -> FloatArray:
    """Return the matrix that takes values at n places to values at others, (m, n), by the polynomial through them."""
    count = len(nodes)
    series = np.linalg.inv(legendre.legvander(2 * nodes - 1, count - 1))
    return read_only(legendre.legvander(2 * places - 1, count - 1) @ series)
