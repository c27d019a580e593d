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
from cfmkit.beams.kernels.rk8 import COUPLING, NODES, STAGES, WEIGHTS

COLUMNS = 5  # the state itself, then its derivatives by the start's rotation, h, v and M
SLOPE, PLACE, AT = 0, 1, 2  # of the work space: slopes of (phi, M), slopes of (X, Y), in AT: (phi, M), (X, Y), stage


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
def _slopes(table, step, i, h, v, w):
    """Set the slopes of (phi, M) and (X, Y) with their derivatives at stage i of a step."""
    s, c = sincos(table[step, i, 0] + w[AT, 2, 0])
    bend, pull, slide = table[step, i, 2], table[step, i, 3], table[step, i, 4]
    normal, shear = h * c + v * s, v * c - h * s
    stretch, slip = table[step, i, 1] + pull * normal, slide * shear
    xp, yp = stretch * c - slip * s, stretch * s + slip * c
    p, q = pull * shear, -slide * normal
    xphi, yphi = -yp + p * c - q * s, xp + p * s + q * c
    mphi = yphi * h - xphi * v
    for k in range(5):
        w[SLOPE, i, k] = bend * w[AT, 2, 5 + k]
    for k in range(1, 5):
        d = w[AT, 2, k]
        w[SLOPE, i, 5 + k], w[PLACE, i, k], w[PLACE, i, 5 + k] = mphi * d, xphi * d, yphi * d
    w[SLOPE, i, 5], w[PLACE, i, 0], w[PLACE, i, 5] = yp * h - xp * v, xp, yp
    hh, hv, vv = pull * c * c + slide * s * s, (pull - slide) * c * s, pull * s * s + slide * c * c
    w[PLACE, i, 2] += hh
    w[PLACE, i, 7] += hv
    w[SLOPE, i, 7] += yp + hv * h - hh * v
    w[PLACE, i, 3] += hv
    w[PLACE, i, 8] += vv
    w[SLOPE, i, 8] += -xp + vv * h - hv * v


@inlined
def _combine(i, length, w):
    """Set phi, M and their derivatives at stage i (sums in registers: this is where most of the time goes)."""
    a = b = c = d = e = f = g = h = p = q = 0.0
    for j in range(i):
        x = COUPLING[i, j]
        if x != 0.0:
            a += x * w[SLOPE, j, 0]
            b += x * w[SLOPE, j, 1]
            c += x * w[SLOPE, j, 2]
            d += x * w[SLOPE, j, 3]
            e += x * w[SLOPE, j, 4]
            f += x * w[SLOPE, j, 5]
            g += x * w[SLOPE, j, 6]
            h += x * w[SLOPE, j, 7]
            p += x * w[SLOPE, j, 8]
            q += x * w[SLOPE, j, 9]
    w[AT, 2, 0], w[AT, 2, 1] = w[AT, 0, 0] + length * a, w[AT, 0, 1] + length * b
    w[AT, 2, 2], w[AT, 2, 3] = w[AT, 0, 2] + length * c, w[AT, 0, 3] + length * d
    w[AT, 2, 4], w[AT, 2, 5] = w[AT, 0, 4] + length * e, w[AT, 0, 5] + length * f
    w[AT, 2, 6], w[AT, 2, 7] = w[AT, 0, 6] + length * g, w[AT, 0, 7] + length * h
    w[AT, 2, 8], w[AT, 2, 9] = w[AT, 0, 8] + length * p, w[AT, 0, 9] + length * q


@kernel
def flow(table, width, steps, start, load, out, w):
    """Integrate over the steps [first, last) of a segment, with derivatives.

    start: rotation, h, v, M at the segment's start; load: the line load's (wx, wy); w: work space.
    out (20): phi, M, X, Y in rows of 5: value, then derivatives by rotation, h, v, M. X and Y count from the start.
    Returns the force (h, v) at the end.
    """
    loaded = load[0] != 0.0 or load[1] != 0.0
    for k in range(10):
        w[AT, 0, k], w[AT, 1, k] = 0.0, 0.0
    w[AT, 0, 0], w[AT, 0, 5] = start[0], start[3]
    w[AT, 0, 1], w[AT, 0, 9] = 1.0, 1.0
    h, v = start[1], start[2]
    for step in range(steps[0], steps[1]):
        length = width[step]
        for i in range(STAGES):
            _combine(i, length, w)
            fx, fy = h, v
            if loaded:
                run = _run(table, step, length, i)
                fx, fy = h - load[0] * run, v - load[1] * run
            _slopes(table, step, i, fx, fy, w)
        for i in range(STAGES):
            weight = length * WEIGHTS[i]
            if weight != 0.0:
                for k in range(10):
                    w[AT, 0, k] += weight * w[SLOPE, i, k]
                    w[AT, 1, k] += weight * w[PLACE, i, k]
        if loaded:
            run = _run(table, step, length, STAGES)
            h -= load[0] * run
            v -= load[1] * run
    for k in range(10):
        out[k], out[10 + k] = w[AT, 0, k], w[AT, 1, k]
    return h, v


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


__all__ = ["COLUMNS", "NODES", "STAGES", "flow", "plain_flow"]
