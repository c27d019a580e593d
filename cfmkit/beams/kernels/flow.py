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

from cfmkit.beams.kernels.compiler import kernel
from cfmkit.beams.kernels.rk8 import COUPLING, NODES, STAGES, WEIGHTS

COLUMNS = 5  # the state itself, then its derivatives by the start's rotation, h, v and M


@kernel
def _slopes(row, y, force, kp, kx):
    """Set the slopes of (phi, M) and (X, Y) with their derivatives at one stage; `row` is the stage's table."""
    psi = row[0] + y[0]
    c, s = np.cos(psi), np.sin(psi)
    h, v = force
    normal, shear = h * c + v * s, v * c - h * s
    stretch = row[1] + row[3] * normal
    slip = row[4] * shear
    xp, yp = stretch * c - slip * s, stretch * s + slip * c
    kp[0] = row[2] * y[5]
    kp[5] = yp * h - xp * v
    kx[0], kx[5] = xp, yp
    for k in range(1, 5):
        dphi = y[k]
        dn, dv = shear * dphi, -normal * dphi
        if k == 2:
            dn += c
            dv -= s
        elif k == 3:
            dn += s
            dv += c
        a, b = row[3] * dn, row[4] * dv
        dx, dy = -yp * dphi + a * c - b * s, xp * dphi + a * s + b * c
        kp[k] = row[2] * y[5 + k]
        kx[k], kx[5 + k] = dx, dy
        kp[5 + k] = dy * h - dx * v
    kp[7] += yp
    kp[8] -= xp


@kernel
def flow(table, width, steps, start, load, out, work):
    """Integrate over the steps [first, last) of a segment, with derivatives.

    start: rotation, h, v, M at the segment's start; load: the line load's (wx, wy).
    out (20): phi, M, X, Y in rows of 5: value, then derivatives by rotation, h, v, M. X and Y count from the start.
    Returns the force (h, v) at the end.
    """
    slope, place, y, x = work[0], work[1], work[2, 0], work[2, 1]
    loaded = load[0] != 0.0 or load[1] != 0.0
    for k in range(10):
        y[k], x[k] = 0.0, 0.0
    y[0], y[5] = start[0], start[3]
    y[1], y[9] = 1.0, 1.0
    h, v = start[1], start[2]
    at = work[2, 2]
    for step in range(steps[0], steps[1]):
        length = width[step]
        for i in range(STAGES):
            for k in range(10):
                at[k] = 0.0
            for j in range(i):
                weight = COUPLING[i, j]
                if weight != 0.0:
                    for k in range(10):
                        at[k] += weight * slope[j, k]
            for k in range(10):
                at[k] = y[k] + length * at[k]
            force = (h, v)
            if loaded:
                run = _run(table[step], width[step], i)
                force = (h - load[0] * run, v - load[1] * run)
            _slopes(table[step, i], at, force, slope[i], place[i])
        for i in range(STAGES):
            weight = length * WEIGHTS[i]
            if weight != 0.0:
                for k in range(10):
                    y[k] += weight * slope[i, k]
                    x[k] += weight * place[i, k]
        if loaded:
            run = _run(table[step], width[step], STAGES)
            h -= load[0] * run
            v -= load[1] * run
    for k in range(10):
        out[k], out[10 + k] = y[k], x[k]
    return h, v


@kernel
def _run(stages, width, i):
    """Return the arc length from the start of a step to its stage i, or to its end for i = STAGES."""
    total = 0.0
    if i == STAGES:
        for j in range(STAGES):
            total += WEIGHTS[j] * stages[j, 1]
    else:
        for j in range(i):
            total += COUPLING[i, j] * stages[j, 1]
    return total * width


@kernel
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
