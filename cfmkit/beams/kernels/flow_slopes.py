"""The initial-value problem of a beam and its derivatives by any number of variables, stage by stage.

The derivatives obey the linearised equations of `cfmkit.beams.kernels.flow`, with the same Runge-Kutta method, so
that they are those of the discrete solution. Variables lie side by side: the inner loops run over them.
"""

from __future__ import annotations

import numpy as np

from cfmkit.beams.kernels.compiler import inlined, kernel, maker
from cfmkit.beams.kernels.flow import sincos
from cfmkit.beams.kernels.rk8 import COUPLING, SHARES, SOURCES, STAGES, TERMS, WEIGHTS

ROWS = 7  # phi, M, X, Y, strain energy, h, v


@maker
def work_space(count):
    """Return the arrays that `flow_slopes` needs for up to so many variables."""
    return np.empty((STAGES, 2)), np.empty((STAGES, 5 * count)), np.empty(5 * count)


@kernel
def flow_slopes(table, width, steps, start, load, changes, at, state, rows, work):
    """Integrate the state and the columns of its derivatives over the steps of a segment.

    start: phi, h, v, M; load: line load (wx, wy); changes: the flattened changes of the table, from index `at`.
    state (9 count) holds the derivatives of phi, M, X, Y, energy, h, v and those of the line load, each for all
    variables, at the start and then at the end. rows (steps + 1, 7 count): the derivatives at all step boundaries,
    if there is room. work: see `work_space`.
    """
    count = state.shape[0] // 9
    base, slope, now = work
    keep = rows.shape[0] > 1
    for step in range(steps[0], steps[1]):
        if keep:
            for q in range(ROWS * count):
                rows[step - steps[0], q] = state[q]
        o = at + (step - steps[0]) * STAGES * 5 * count
        for i in range(STAGES):
            place = _combined(table, step, width[step], i, start, load, (changes, o), state, base, slope, now, count)
            _stage(table, step, i, place, (changes, o + i * 5 * count), now, base, slope, count)
        start = _combined(table, step, width[step], STAGES, start, load, (changes, o), state, base, slope, now, count)
        for q in range(2 * count, 5 * count):
            total = 0.0
            for n in range(TERMS[STAGES]):
                total += SHARES[STAGES, n] * slope[SOURCES[STAGES, n], q]
            state[q] += width[step] * total
        for q in range(2 * count):
            state[q], state[5 * count + q] = now[q], now[2 * count + q]
    if keep:
        for q in range(ROWS * count):
            rows[steps[1] - steps[0], q] = state[q]


@inlined
def _combined(table, step, width, i, start, load, changed, state, base, slope, now, count):
    """Set `now` (phi, M, h, v and arc length, differentiated) at stage i, or at the step's end for i = STAGES.

    Returns phi, h, v and M there.
    """
    phi, moment, h, v = start[0], start[3], start[1], start[2]
    for n in range(TERMS[i]):
        j, w = SOURCES[i, n], width * SHARES[i, n]
        phi += w * base[j, 0]
        moment += w * base[j, 1]
    for q in range(2 * count):
        total = 0.0
        for n in range(TERMS[i]):
            total += SHARES[i, n] * slope[SOURCES[i, n], q]
        now[q], now[2 * count + q] = state[q] + width * total, state[5 * count + q]
    if load[0] != 0.0 or load[1] != 0.0:
        run = _run(table, step, width, i, changed, now, count)
        h, v = h - load[0] * run, v - load[1] * run
        for q in range(count):
            now[2 * count + q] -= state[7 * count + q] * run + load[0] * now[4 * count + q]
            now[3 * count + q] -= state[8 * count + q] * run + load[1] * now[4 * count + q]
    return phi, h, v, moment


@kernel
def _run(table, step, width, i, changed, now, count):
    """Return the arc length up to stage i and set its derivatives."""
    changes, o = changed
    run = 0.0
    for q in range(count):
        now[4 * count + q] = 0.0
    for j in range(i):
        w = width * (WEIGHTS[j] if i == STAGES else COUPLING[i, j])
        run += w * table[step, j, 1]
        for q in range(count):
            now[4 * count + q] += w * changes[o + (j * 5 + 1) * count + q]
    return run


@inlined
def _stage(table, step, i, place, changed, now, base, slope, n):
    """Set the slopes of phi and M at one stage (base) and those of the derivatives of phi, M, X, Y and energy."""
    changes, o = changed
    phi, h, v, moment = place
    s, c = sincos(table[step, i, 0] + phi)
    bends, pulls, slides = table[step, i, 2], table[step, i, 3], table[step, i, 4]
    normal, shear = h * c + v * s, v * c - h * s
    stretch, slip = table[step, i, 1] + pulls * normal, slides * shear
    xp, yp = stretch * c - slip * s, stretch * s + slip * c
    base[i, 0], base[i, 1] = bends * moment, yp * h - xp * v
    stiff = pulls == 0.0 and slides == 0.0
    for q in range(n):
        turn, dm, dh, dv = now[q] + changes[o + q], now[n + q], now[2 * n + q], now[3 * n + q]
        a, b, bend = changes[o + n + q], 0.0, changes[o + 2 * n + q]
        own = bend * moment * moment
        if not stiff:
            pull, slide = changes[o + 3 * n + q], changes[o + 4 * n + q]
            dn, dq = shear * turn + dh * c + dv * s, dv * c - dh * s - normal * turn
            a += pull * normal + pulls * dn
            b = slide * shear + slides * dq
            own += pull * normal * normal + slide * shear * shear + 2 * (pulls * normal * dn + slides * shear * dq)
        dx, dy = -yp * turn + a * c - b * s, xp * turn + a * s + b * c
        slope[i, q], slope[i, n + q] = bend * moment + bends * dm, dy * h - dx * v + yp * dh - xp * dv
        slope[i, 2 * n + q], slope[i, 3 * n + q] = dx, dy
        slope[i, 4 * n + q] = 0.5 * own + bends * moment * dm
