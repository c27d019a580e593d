"""Unstable directions under loads that turn with their node: real eigenvalues of a small unsymmetric matrix.

Such loads make the rows of the degrees of freedom that they act on unsymmetric, and those alone. All others are
condensed symmetrically, so that their inertia is counted as ever; of the condensed matrix C the negative real
eigenvalues count, by which the network diverges. Pairs of complex ones may flutter: only masses decide that. Beyond
flutter a pair may be real again, and negative: that, too, depends on masses, and so counts only if it is there with
small rotary inertia, with large one, and with one by which a node is as soft in turning as in moving: there a pair is
complex if it is with any.

C = ((J^-1)_ss)^-1, with J the tangent and s the degrees of freedom under these loads, and likewise C' of the symmetric
part J' of J. What is condensed is the same in both, and symmetric: by Haynsworth's theorem J' has as many positive
eigenvalues as C' and it together. An inverse has the signs of its matrix, and exists where C does not: a beam that does
not stretch holds its end.

References
----------
[W] J. H. Wilkinson, C. Reinsch, Handbook for Automatic Computation II, Linear Algebra, 1971: elmhes, hqr.
"""

from __future__ import annotations

import numpy as np

from cfmkit.elastica.kernels.compiler import kernel
from cfmkit.elastica.kernels.dense import lu_solve

RIGID, ROUNDING = 1e-13, 1e-14  # compliance, in units of L^2/EI and as a share of the largest, that is none
INERTIAS = (1e-2, 1.0, 1e2)  # radii of gyration, in units of that by which a node is as soft in turning as in moving
SWEEPS = 30  # of hqr for one eigenvalue: it takes two or three, and gives up at 30 [W]


@kernel
def diverging(m, h, unstable, factors, rhs, slots, compliance):
    """Return the number of unstable directions, given that of the tangent's symmetric part.

    factors, rhs, slots (dofs), compliance (dofs, dofs): room.
    """
    count = _followed(m, slots)
    if count == 0:
        return unstable
    if not _condense(h, False, factors, rhs, slots, compliance, count):
        return unstable
    symmetric, least = positive_real(compliance, count), count
    for inertia in INERTIAS:
        if not _condense(h, True, factors, rhs, slots, compliance, count):
            return unstable
        for i in range(count):
            if slots[i] % 1.0 > 0.0:
                scale = inertia * _balance(slots, compliance, i)
                for j in range(count):
                    compliance[i, j] *= scale
                    compliance[j, i] *= scale
        least = min(least, positive_real(compliance, count))
    return unstable - symmetric + least


@kernel
def _balance(slots, compliance, i):
    """Return the radius of gyration by which a node is as soft in turning, the unknown i, as in moving."""
    moving, j = 0.0, i - 1
    while j >= 0 and slots[j] % 1.0 == 0.0:
        moving, j = max(moving, abs(compliance[j, j])), j - 1
    turning = abs(compliance[i, i])
    return np.sqrt(moving / turning) if moving > RIGID and turning > RIGID else 1.0


@kernel
def _followed(m, slots):
    """List the unknowns that loads which turn with their node act on, rotations plus a half; return how many."""
    count = 0
    for k in range(m.load_follows.shape[0]):
        for a in range(4):
            slot = m.slot[m.place_dof[m.load_place[k], a]]
            known = slot < 0 or not m.load_follows[k]
            for j in range(count):
                known = known or int(slots[j]) == slot
            if not known:
                slots[count] = slot + (0.5 if a > 1 else 0.0)
                count += 1
    return count


@kernel
def _condense(h, whole, factors, rhs, slots, compliance, count):
    """Set the compliance of the listed unknowns, of the tangent or of its symmetric part; tell whether there is one."""
    n = h.shape[0] - 1
    for j in range(count):
        for i in range(n):
            for k in range(n):
                factors[i, k] = h[i, k] if whole else 0.5 * (h[i, k] + h[k, i])
            factors[i, n] = factors[n, i] = rhs[i, 0] = rhs[i, 1] = 0.0
        factors[n, n], rhs[n, 0], rhs[n, 1] = 1.0, 0.0, 0.0
        rhs[int(slots[j]), 0] = 1.0
        if not lu_solve(factors, rhs):
            return False
        for i in range(count):
            compliance[i, j] = rhs[int(slots[i]), 0]
    return True


@kernel
def positive_real(a, n):
    """Return how many eigenvalues of the first n rows and columns of a matrix (overwritten) are real and positive."""
    size = 0.0
    for i in range(n):
        for j in range(n):
            size = max(size, abs(a[i, j]))
    least = max(RIGID, ROUNDING * n * size)
    _to_hessenberg(a, n)
    found, last, shift, sweeps = 0, n - 1, 0.0, 0
    while last >= 0:
        first = _split(a, last, size)
        x = a[last, last]
        if first == last:
            found += 1 if x + shift > least else 0
            last, sweeps = last - 1, 0
            continue
        y, w = a[last - 1, last - 1], a[last, last - 1] * a[last - 1, last]
        if first == last - 1:
            half = 0.5 * (y - x)
            square = half * half + w
            if square >= 0.0:
                root = half + np.copysign(np.sqrt(square), half)
                found += 1 if x + shift + root > least else 0
                found += 1 if x + shift + (-w / root if root != 0.0 else root) > least else 0
            last, sweeps = last - 2, 0
            continue
        if sweeps == SWEEPS:
            return found
        if sweeps % 10 == 9:  # out of a cycle [W]
            shift += x
            for i in range(last + 1):
                a[i, i] -= x
            size_below = abs(a[last, last - 1]) + abs(a[last - 1, last - 2])
            x = y = 0.75 * size_below
            w = -0.4375 * size_below * size_below
        sweeps += 1
        _sweep(a, first, last, x, y, w)
    return found


@kernel
def _to_hessenberg(a, n):
    """Eliminate what is below the first diagonal under the main one, with row and column exchanges [W, elmhes]."""
    for m in range(1, n - 1):
        pivot = m
        for i in range(m + 1, n):
            if abs(a[i, m - 1]) > abs(a[pivot, m - 1]):
                pivot = i
        if pivot != m:
            for j in range(n):
                a[pivot, j], a[m, j] = a[m, j], a[pivot, j]
            for j in range(n):
                a[j, pivot], a[j, m] = a[j, m], a[j, pivot]
        if a[m, m - 1] != 0.0:
            for i in range(m + 1, n):
                factor = a[i, m - 1] / a[m, m - 1]
                for j in range(n):
                    a[i, j] -= factor * a[m, j]
                for j in range(n):
                    a[j, m] += factor * a[j, i]
                a[i, m - 1] = 0.0


@kernel
def _split(a, last, size):
    """Return the row where the block that ends at `last` begins: what couples it to those above is rounding."""
    first = last
    while first > 0:
        around = abs(a[first - 1, first - 1]) + abs(a[first, first])
        around = size if around == 0.0 else around
        if abs(a[first, first - 1]) + around == around:
            a[first, first - 1] = 0.0
            break
        first -= 1
    return first


@kernel
def _sweep(a, first, last, x, y, w):
    """Make one double step of Francis's method on a block; x, y, w: trace and determinant of the shifts [W, hqr]."""
    m, p, q, r = last - 2, 0.0, 0.0, 0.0
    while True:
        z = a[m, m]
        p = ((x - z) * (y - z) - w) / a[m + 1, m] + a[m, m + 1]
        q = a[m + 1, m + 1] - z - (x - z) - (y - z)
        r = a[m + 2, m + 1]
        scale = abs(p) + abs(q) + abs(r)
        p, q, r = p / scale, q / scale, r / scale
        if m == first:
            break
        small = abs(a[m, m - 1]) * (abs(q) + abs(r))
        large = abs(p) * (abs(a[m - 1, m - 1]) + abs(z) + abs(a[m + 1, m + 1]))
        if small + large == large:
            break
        m -= 1
    for i in range(m + 2, last + 1):
        a[i, i - 2] = 0.0
        if i > m + 2:
            a[i, i - 3] = 0.0
    scale = 1.0
    for k in range(m, last):
        three = k < last - 1
        if k > m:
            p, q, r = a[k, k - 1], a[k + 1, k - 1], (a[k + 2, k - 1] if three else 0.0)
            scale = abs(p) + abs(q) + abs(r)
            if scale == 0.0:
                continue
            p, q, r = p / scale, q / scale, r / scale
        s = np.copysign(np.sqrt(p * p + q * q + r * r), p)
        if s == 0.0:
            continue
        if k > m:
            a[k, k - 1] = -s * scale
        elif first != m:
            a[k, k - 1] = -a[k, k - 1]
        p += s
        u, v, t = p / s, q / s, r / s
        q, r = q / p, r / p
        for j in range(k, last + 1):
            change = a[k, j] + q * a[k + 1, j] + (r * a[k + 2, j] if three else 0.0)
            a[k, j] -= change * u
            a[k + 1, j] -= change * v
            if three:
                a[k + 2, j] -= change * t
        for i in range(first, min(last, k + 3) + 1):
            change = u * a[i, k] + v * a[i, k + 1] + (t * a[i, k + 2] if three else 0.0)
            a[i, k] -= change
            a[i, k + 1] -= change * q
            if three:
                a[i, k + 2] -= change * r
