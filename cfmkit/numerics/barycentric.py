"""Polynomials through values at nodes: their values elsewhere and their slopes, as matrices.

Reference
---------
[BT] J.-P. Berrut, L. N. Trefethen, Barycentric Lagrange interpolation, SIAM Review 46 (2004) 501.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray


def interpolation(nodes: FloatArray, places: FloatArray) -> FloatArray:
    """Return the matrix from values at nodes (n,) to those of their polynomial at places, (m, n) [BT, eq. 4.2].

    Examples
    --------
    >>> (interpolation(np.array([0.0, 1.0, 2.0]), np.array([1.5, 2.0])) @ [0.0, 1.0, 4.0]).round(12).tolist()
    [2.25, 4.0]
    """
    gaps = places[:, None] - nodes
    hit = np.abs(gaps) < 1e-14
    terms = _weights(nodes) / np.where(hit, 1.0, gaps)
    matrix: FloatArray = terms / terms.sum(axis=1, keepdims=True)
    exact = hit.any(axis=1)
    matrix[exact] = hit[exact]
    return matrix


def differentiation(nodes: FloatArray) -> FloatArray:
    """Return the matrix from values at nodes to slopes of their polynomial there, (n, n) [BT, eq. 9.4].

    Examples
    --------
    >>> (differentiation(np.array([0.0, 1.0, 2.0])) @ [0.0, 1.0, 4.0]).round(12).tolist()
    [0.0, 2.0, 4.0]
    """
    weights, gaps = _weights(nodes), nodes[:, None] - nodes
    np.fill_diagonal(gaps, 1.0)
    matrix: FloatArray = weights / weights[:, None] / gaps
    np.fill_diagonal(matrix, 0.0)
    np.fill_diagonal(matrix, -matrix.sum(axis=1))
    return matrix


def _weights(nodes: FloatArray) -> FloatArray:
    gaps = nodes[:, None] - nodes
    np.fill_diagonal(gaps, 1.0)
    return np.asarray(1.0 / gaps.prod(axis=1))
