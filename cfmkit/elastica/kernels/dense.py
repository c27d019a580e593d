"""Small dense linear algebra for compiled code: LU with partial pivoting, inertia by Bunch-Kaufman."""

from __future__ import annotations

import numpy as np

from cfmkit.elastica.kernels.compiler import kernel

_ALPHA = (1.0 + np.sqrt(17.0)) / 8.0
"""Share of a column's largest entry from which on its diagonal is a pivot: the bound on the growth of entries is least
where two single pivots and one of two rows allow the same, (1 + 1/a)^2 = 1 + 2/(1 - a) [Bunch, Kaufman, Math. Comp. 31
(1977) 163]."""


@kernel
def copy(target, source):
    """Copy an array into one of the same size (assigning slices compiles ten times as long)."""
    for i in range(target.shape[0]):
        target[i] = source[i]


@kernel
def copy_matrix(target, source):
    """Copy a matrix into one of the same size."""
    for i in range(target.shape[0]):
        for j in range(target.shape[1]):
            target[i, j] = source[i, j]


@kernel
def clear(target):
    """Set a matrix to zero."""
    for i in range(target.shape[0]):
        for j in range(target.shape[1]):
            target[i, j] = 0.0


@kernel
def lu_solve(a, b):
    """Overwrite the columns of `b` with the solution of a x = b; tell whether `a` is regular.

    `a` is overwritten by its factors.
    """
    n = a.shape[0]
    columns = b.shape[1]
    for k in range(n):
        pivot, largest = k, abs(a[k, k])
        for i in range(k + 1, n):
            if abs(a[i, k]) > largest:
                pivot, largest = i, abs(a[i, k])
        if not largest > 0.0:
            return False
        if pivot != k:
            for j in range(k, n):
                a[k, j], a[pivot, j] = a[pivot, j], a[k, j]
            for j in range(columns):
                b[k, j], b[pivot, j] = b[pivot, j], b[k, j]
        inverse = 1.0 / a[k, k]
        for i in range(k + 1, n):
            factor = a[i, k] * inverse
            if factor != 0.0:
                for j in range(k + 1, n):
                    a[i, j] -= factor * a[k, j]
                for j in range(columns):
                    b[i, j] -= factor * b[k, j]
    for k in range(n - 1, -1, -1):
        for j in range(columns):
            value = b[k, j]
            for i in range(k + 1, n):
                value -= a[k, i] * b[i, j]
            b[k, j] = value / a[k, k]
    return True


@kernel
def _swap(a, i, j):
    """Exchange rows and columns i and j of a symmetric matrix."""
    n = a.shape[0]
    for c in range(n):
        a[i, c], a[j, c] = a[j, c], a[i, c]
    for r in range(n):
        a[r, i], a[r, j] = a[r, j], a[r, i]


@kernel
def _largest_below(a, k, column):
    """Return the row below k with the largest entry of a column, the column's own row left out."""
    row, largest = k, -1.0
    for i in range(k, a.shape[0]):
        if i != column and abs(a[i, column]) > largest:
            row, largest = i, abs(a[i, column])
    return row, largest


@kernel
def _eliminate_one(a, k):
    n = a.shape[0]
    inverse = 1.0 / a[k, k]
    for i in range(k + 1, n):
        factor = a[i, k] * inverse
        if factor != 0.0:
            for j in range(k + 1, n):
                a[i, j] -= factor * a[k, j]


@kernel
def _eliminate_two(a, k):
    n = a.shape[0]
    p, q, r = a[k, k], a[k, k + 1], a[k + 1, k + 1]
    det = p * r - q * q
    for i in range(k + 2, n):
        u, v = a[i, k], a[i, k + 1]
        if u != 0.0 or v != 0.0:
            x, y = (u * r - v * q) / det, (v * p - u * q) / det
            for j in range(k + 2, n):
                a[i, j] -= x * a[k, j] + y * a[k + 1, j]


@kernel
def positive_count(a):
    """Return the number of positive eigenvalues of a symmetric matrix (overwritten): Sylvester's law."""
    n = a.shape[0]
    count, k = 0, 0
    while k < n:
        size = 1
        if k < n - 1:
            row, below = _largest_below(a, k, k)
            if abs(a[k, k]) < _ALPHA * below:
                _, across = _largest_below(a, k, row)
                if abs(a[k, k]) * across < _ALPHA * below * below:
                    if abs(a[row, row]) >= _ALPHA * across:
                        _swap(a, k, row)
                    else:
                        _swap(a, k + 1, row)
                        size = 2
        if size == 1:
            count += 1 if a[k, k] > 0.0 else 0
            if a[k, k] != 0.0:
                _eliminate_one(a, k)
        else:
            count += 1
            _eliminate_two(a, k)
        k += size
    return count
