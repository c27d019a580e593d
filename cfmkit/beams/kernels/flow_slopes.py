"""The initial-value problem of a beam and its derivatives by any number of variables, stage by stage.

The derivatives obey the linearised equations of `cfmkit.beams.kernels.flow`, with the same Runge-Kutta method, so
that they are those of the discrete solution. Variables lie side by side: the inner loops run over them.
"""

from __future__ import annotations

import numpy as np

from cfmkit.beams.kernels.compiler import kernel
from cfmkit.beams.kernels.dense import copy_matrix
from cfmkit.beams.kernels.rk8 import COUPLING, STAGES, WEIGHTS

ROWS = 7  # phi, M, X, Y, h, v, strain energy: as in `cfmkit.beams.kernels.flow.plain_flow`


@kernel
def flow_slopes(table, width, steps, start, load, changes, at, state, rows):
    """Integrate the state and the columns of its derivatives over the steps of a segment.

    start: phi, h, v, M; load: line load (wx, wy); changes: the flattened changes of the table, from index `at`.
    state (9, count) holds the derivatives of phi, M, X, Y, h, v, energy at the start and then at the end; its last
    two rows are those of the line load. rows (steps + 1, 7, count): the derivatives at all step boundaries, if there
    is room.
    """
    count = state.shape[1]
    base, slope, now = np.zeros((STAGES, 3)), np.empty((STAGES, 5, count)), np.empty((5, count))
    keep = rows.shape[0] > 1
    for step in range(steps[0], steps[1]):
        if keep:
            copy_matrix(rows[step - steps[0]], state[:ROWS])
        o = at + (step - steps[0]) * STAGES * 5 * count
        for i in range(STAGES):
            row = table[step, i]
            place = _combined(table[step], width[step], i, start, load, (changes, o), state, base, slope, now)
            _stage(row, place, (changes, o + i * 5 * count), now, base[i], slope[i])
        start = _combined(table[step], width[step], STAGES, start, load, (changes, o), state, base, slope, now)
        for j in range(STAGES):
            w = width[step] * WEIGHTS[j]
            if w != 0.0:
                for q in range(count):
                    state[2, q] += w * slope[j, 2, q]
                    state[3, q] += w * slope[j, 3, q]
                    state[6, q] += w * slope[j, 4, q]
        for q in range(count):
            state[0, q], state[1, q], state[4, q], state[5, q] = now[0, q], now[1, q], now[2, q], now[3, q]
    if keep:
        copy_matrix(rows[steps[1] - steps[0]], state[:ROWS])


@kernel
def _combined(stages, width, i, start, load, changed, state, base, slope, now):
    """Set `now` (phi, M, h, v and arc length, differentiated) at stage i, or at the step's end for i = STAGES.

    Returns phi, h, v and M there.
    """
    changes, o = changed
    count = now.shape[1]
    phi, moment, run = start[0], start[3], 0.0
    loaded = load[0] != 0.0 or load[1] != 0.0
    for q in range(count):
        now[0, q], now[1, q], now[4, q] = state[0, q], state[1, q], 0.0
    for j in range(i):
        w = width * (WEIGHTS[j] if i == STAGES else COUPLING[i, j])
        if w != 0.0:
            phi += w * base[j, 0]
            moment += w * base[j, 1]
            run += w * stages[j, 1]
            for q in range(count):
                now[0, q] += w * slope[j, 0, q]
                now[1, q] += w * slope[j, 1, q]
            if loaded:
                first = o + (j * 5 + 1) * count
                for q in range(count):
                    now[4, q] += w * changes[first + q]
    for q in range(count):
        now[2, q] = state[4, q] - state[7, q] * run - load[0] * now[4, q]
        now[3, q] = state[5, q] - state[8, q] * run - load[1] * now[4, q]
    return phi, start[1] - load[0] * run, start[2] - load[1] * run, moment


@kernel
def _stage(row, place, changed, now, base, slope):
    """Set the slopes of phi and M at one stage (base) and those of the derivatives of phi, M, X, Y and energy."""
    changes, o = changed
    count = now.shape[1]
    phi, h, v, moment = place
    c, s = np.cos(row[0] + phi), np.sin(row[0] + phi)
    normal, shear = h * c + v * s, v * c - h * s
    stretch, slip = row[1] + row[3] * normal, row[4] * shear
    xp, yp = stretch * c - slip * s, stretch * s + slip * c
    base[0], base[1] = row[2] * moment, yp * h - xp * v
    for q in range(count):
        turn = now[0, q] + changes[o + q]
        bend, pull, slide = changes[o + 2 * count + q], changes[o + 3 * count + q], changes[o + 4 * count + q]
        dn = shear * turn + now[2, q] * c + now[3, q] * s
        dv = now[3, q] * c - now[2, q] * s - normal * turn
        a, b = changes[o + count + q] + pull * normal + row[3] * dn, slide * shear + row[4] * dv
        dx, dy = -yp * turn + a * c - b * s, xp * turn + a * s + b * c
        slope[0, q] = bend * moment + row[2] * now[1, q]
        slope[1, q] = dy * h - dx * v + yp * now[2, q] - xp * now[3, q]
        slope[2, q], slope[3, q] = dx, dy
        own = bend * moment * moment + pull * normal * normal + slide * shear * shear
        slope[4, q] = 0.5 * own + row[2] * moment * now[1, q] + row[3] * normal * dn + row[4] * shear * dv
