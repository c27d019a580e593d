"""The initial-value problem of a Reissner beam, with its exact derivatives.

With psi the reference angle plus the rotation phi, (h, v) the force and M the moment that the part after a
section exerts on the part before it, N = h cos psi + v sin psi and V = v cos psi - h sin psi [beam theory of
Reissner (1972)]:

    phi' = g M/EI,   X' = g[(1 + N/EA) cos psi - V/GA sin psi],   Y' = g[(1 + N/EA) sin psi + V/GA cos psi],
    M' = Y' h - X' v,   (h, v)' = -g w

g is ds/dt, so that a shape may have any parameter t; w is a dead load per reference length.
"""

from __future__ import annotations

import numpy as np

from cfmkit.beams.kernels.compiler import inlined, kernel, maker
from cfmkit.beams.kernels.rk8 import COUPLING, NODES, SHARES, SOURCES, STAGES, TERMS, WEIGHTS

COLUMNS = 5  # the state itself, then its derivatives by the start's rotation, h, v and M
SLOPE, PLACE, AT = 0, 1, 2  # of the work space: slopes of (phi, M), slopes of (X, Y), in AT: (phi, M), (X, Y), stage
FIRST, SECOND = 0, 8  # where the work spaces of two segments begin
FORCE = 20  # of a segment's outcome: h and v at its end; before them what `flow` says


@inlined
def sincos(x):
    """Return sine and cosine to rounding, without branches: as in fdlibm, reduced by two words of pi/2."""
    n = np.floor(x * 0.6366197723675814 + 0.5)
    r = (x - n * 1.5707963267341256) - n * 6.077100506506192e-11
    z = r * r
    s = 1.58969099521155e-10 * z - 2.5050760253406863e-08
    s = ((s * z + 2.7557313707070068e-06) * z - 1.984126982985795e-04) * z + 8.33333333332249e-03
    s = r + r * z * (s * z - 1.6666666666666632e-01)
    c = -1.1359647557788195e-11 * z + 2.0875723212981748e-09
    c = ((c * z - 2.7557314351390663e-07) * z + 2.480158728947673e-05) * z - 1.388888888887411e-03
    c = 1.0 - 0.5 * z + z * z * (c * z + 4.1666666666666602e-02)
    q = int(n) & 3
    odd = (q & 1) != 0
    first, second = c if odd else s, s if odd else c
    return (1.0 - (q & 2)) * first, (1.0 - ((q + 1) & 2)) * second


@inlined
def _slopes(table, step, i, h, v, w, o):
    """Set the slopes of (phi, M) and (X, Y) with their derivatives at stage i of a step."""
    s, c = sincos(table[step, i, 0] + w[o + AT, 2, 0])
    bend, pull, slide = table[step, i, 2], table[step, i, 3], table[step, i, 4]
    normal, shear = h * c + v * s, v * c - h * s
    stretch, slip = table[step, i, 1] + pull * normal, slide * shear
    xp, yp = stretch * c - slip * s, stretch * s + slip * c
    p, q = pull * shear, -slide * normal
    xphi, yphi = -yp + p * c - q * s, xp + p * s + q * c
    mphi = yphi * h - xphi * v
    for k in range(5):
        w[o + SLOPE, i, k] = bend * w[o + AT, 2, 5 + k]
    for k in range(1, 5):
        d = w[o + AT, 2, k]
        w[o + SLOPE, i, 5 + k], w[o + PLACE, i, k], w[o + PLACE, i, 5 + k] = mphi * d, xphi * d, yphi * d
    w[o + SLOPE, i, 5], w[o + PLACE, i, 0], w[o + PLACE, i, 5] = yp * h - xp * v, xp, yp
    hh, hv, vv = pull * c * c + slide * s * s, (pull - slide) * c * s, pull * s * s + slide * c * c
    w[o + PLACE, i, 2] += hh
    w[o + PLACE, i, 7] += hv
    w[o + SLOPE, i, 7] += yp + hv * h - hh * v
    w[o + PLACE, i, 3] += hv
    w[o + PLACE, i, 8] += vv
    w[o + SLOPE, i, 8] += -xp + vv * h - hv * v


@inlined
def _combine(i, length, w, o):
    """Set phi, M and their derivatives at stage i (sums in registers: this is where most of the time goes)."""
    a = b = c = d = e = f = g = h = p = q = 0.0
    for n in range(TERMS[i]):
        x, j = SHARES[i, n], SOURCES[i, n]
        a += x * w[o + SLOPE, j, 0]
        b += x * w[o + SLOPE, j, 1]
        c += x * w[o + SLOPE, j, 2]
        d += x * w[o + SLOPE, j, 3]
        e += x * w[o + SLOPE, j, 4]
        f += x * w[o + SLOPE, j, 5]
        g += x * w[o + SLOPE, j, 6]
        h += x * w[o + SLOPE, j, 7]
        p += x * w[o + SLOPE, j, 8]
        q += x * w[o + SLOPE, j, 9]
    w[o + AT, 2, 0], w[o + AT, 2, 1] = w[o + AT, 0, 0] + length * a, w[o + AT, 0, 1] + length * b
    w[o + AT, 2, 2], w[o + AT, 2, 3] = w[o + AT, 0, 2] + length * c, w[o + AT, 0, 3] + length * d
    w[o + AT, 2, 4], w[o + AT, 2, 5] = w[o + AT, 0, 4] + length * e, w[o + AT, 0, 5] + length * f
    w[o + AT, 2, 6], w[o + AT, 2, 7] = w[o + AT, 0, 6] + length * g, w[o + AT, 0, 7] + length * h
    w[o + AT, 2, 8], w[o + AT, 2, 9] = w[o + AT, 0, 8] + length * p, w[o + AT, 0, 9] + length * q


@inlined
def _begin(start, w, o):
    for k in range(10):
        w[o + AT, 0, k], w[o + AT, 1, k] = 0.0, 0.0
    w[o + AT, 0, 0], w[o + AT, 0, 5] = start[0], start[3]
    w[o + AT, 0, 1], w[o + AT, 0, 9] = 1.0, 1.0


@inlined
def _advance(length, w, o):
    for i in range(STAGES):
        weight = length * WEIGHTS[i]
        if weight != 0.0:
            for k in range(10):
                w[o + AT, 0, k] += weight * w[o + SLOPE, i, k]
                w[o + AT, 1, k] += weight * w[o + PLACE, i, k]


@inlined
def _end(h, v, w, o, out):
    for k in range(10):
        out[k], out[10 + k] = w[o + AT, 0, k], w[o + AT, 1, k]
    out[FORCE], out[FORCE + 1] = h, v


@kernel
def flow(table, width, steps, starts, loads, outs, w):
    """Integrate over two segments with derivatives, side by side: each waits for its own results half of the time.

    steps: the first of each and how many both have; starts: rotation, h, v, M at the start of each; loads: (wx, wy)
    of the line load on each; w: work space. The outcome of each goes to its row of outs (2 of 22): phi, M, X, Y in
    rows of 5: value, then derivatives by rotation, h, v, M; then the force h, v at the end. X and Y count from the
    start.
    """
    (one, other), (a, b) = starts, loads
    loaded = a[0] != 0.0 or a[1] != 0.0 or b[0] != 0.0 or b[1] != 0.0
    _begin(one, w, FIRST)
    _begin(other, w, SECOND)
    h, v, hh, vv = one[1], one[2], other[1], other[2]
    for step in range(steps[2]):
        p, q = steps[0] + step, steps[1] + step
        length, far = width[p], width[q]
        for i in range(STAGES):
            _combine(i, length, w, FIRST)
            _combine(i, far, w, SECOND)
            if loaded:
                run, way = _run(table, p, length, i), _run(table, q, far, i)
                _slopes(table, p, i, h - a[0] * run, v - a[1] * run, w, FIRST)
                _slopes(table, q, i, hh - b[0] * way, vv - b[1] * way, w, SECOND)
            else:
                _slopes(table, p, i, h, v, w, FIRST)
                _slopes(table, q, i, hh, vv, w, SECOND)
        _advance(length, w, FIRST)
        _advance(far, w, SECOND)
        if loaded:
            run, way = _run(table, p, length, STAGES), _run(table, q, far, STAGES)
            h, v = h - a[0] * run, v - a[1] * run
            hh, vv = hh - b[0] * way, vv - b[1] * way
    _end(h, v, w, FIRST, outs[0])
    _end(hh, vv, w, SECOND, outs[1])


@kernel
def _run(table, step, width, i):
    """Return the arc length from the start of a step to its stage i, or to its end for i = STAGES."""
    total = 0.0
    if i == STAGES:
        for j in range(STAGES):
            total += WEIGHTS[j] * table[step, j, 1]
    else:
        for j in range(i):
            total += COUPLING[i, j] * table[step, j, 1]
    return total * width


@maker
def plain_flow(table, width, steps, start, load, states):
    """Integrate without derivatives; works on complex numbers too (derivatives by complex steps).

    start: phi, h, v, M; states (n + 1, 7): phi, M, X, Y, h, v and strain energy at the step boundaries.
    """
    first, last = steps
    zero = start[0] * 0.0
    slope = np.empty((STAGES, 5), dtype=states.dtype)
    states[0, 0], states[0, 1], states[0, 2], states[0, 3] = start[0], start[3], zero, zero
    states[0, 4], states[0, 5], states[0, 6] = start[1], start[2], zero
    for step in range(first, last):
        here, there = states[step - first], states[step - first + 1]
        length = width[step]
        for i in range(STAGES):
            phi, moment, run = here[0], here[1], zero
            for j in range(i):
                weight = COUPLING[i, j]
                if weight != 0.0:
                    phi += length * weight * slope[j, 0]
                    moment += length * weight * slope[j, 1]
                    run += length * weight * table[step, j, 1]
            _plain_slopes(table[step, i], phi, moment, (here[4] - load[0] * run, here[5] - load[1] * run), slope[i])
        for k in range(7):
            there[k] = here[k]
        for i in range(STAGES):
            weight = length * WEIGHTS[i]
            for k in range(4):
                there[k] += weight * slope[i, k]
            there[4] -= load[0] * weight * table[step, i, 1]
            there[5] -= load[1] * weight * table[step, i, 1]
            there[6] += weight * slope[i, 4]


@kernel
def _plain_slopes(row, phi, moment, force, out):
    """Set the slopes of phi, M, X, Y and strain energy."""
    c, s = np.cos(row[0] + phi), np.sin(row[0] + phi)
    h, v = force
    normal, shear = h * c + v * s, v * c - h * s
    stretch, slip = row[1] + row[3] * normal, row[4] * shear
    xp, yp = stretch * c - slip * s, stretch * s + slip * c
    out[0] = row[2] * moment
    out[1] = yp * h - xp * v
    out[2], out[3] = xp, yp
    out[4] = 0.5 * (row[2] * moment * moment + row[3] * normal * normal + row[4] * shear * shear)


__all__ = ["COLUMNS", "FORCE", "NODES", "STAGES", "flow", "plain_flow"]
