"""The initial-value problem of a beam and its derivatives by any number of variables, kick by kick.

The derivatives are those of the discrete solution of `cfmkit.elastica.kernels.beam_ode`. Variables lie side by side:
the inner loops run over them.
"""

from __future__ import annotations

from cfmkit.elastica.kernels.beam_ode import WX, WY, sincos
from cfmkit.elastica.kernels.compiler import inlined, kernel
from cfmkit.elastica.kernels.network_array_types import (
    ANGLE,
    BENDING,
    HALVES,
    LENGTH,
    RUN,
    SHARE,
    SHEAR,
    STRETCH,
    TABLE_COLUMNS,
)
from cfmkit.elastica.kernels.symplectic_splitting_coefficients import ROWS as STEP_ROWS
from cfmkit.elastica.kernels.wide_strip import bent, by_section, strain_energy

ROWS = 7  # phi, M, X, Y, strain energy, h, v
_CLOSING = STEP_ROWS - 1


@kernel
def flow_slopes(table, steps, start, load, changes, at, state, rows):
    """Carry the state and the columns of its derivatives over the steps of a segment.

    start: phi, h, v, M; load: line load (wx, wy); changes: the flattened changes of the table, from index `at`.
    state (9 count) holds the derivatives of phi, M, X, Y, energy, h, v and those of the line load, each for all
    variables, at the start and then at the end. rows (steps + 1, 7 count): the derivatives at all step boundaries,
    if there is room.
    """
    count = state.shape[0] // 9
    columns = table.shape[2]
    keep = rows.shape[0] > 1
    phi, h, v, moment = start[0], start[1], start[2], start[3]
    for step in range(steps[0], steps[1]):
        if keep:
            for q in range(ROWS * count):
                rows[step - steps[0], q] = state[q]
        o = at + (step - steps[0]) * STEP_ROWS * columns * count
        for i in range(_CLOSING):
            phi += _drifted(table, step, i, moment, (changes, o), state, count)
            run = table[step, i, RUN]
            place = phi, h - load[WX] * run, v - load[WY] * run
            moment += _kicked(table, step, i, place, load, (changes, o), state)
            o += columns * count
        phi += _drifted(table, step, _CLOSING, moment, (changes, o), state, count)
        run = table[step, _CLOSING, RUN]
        for q in range(count):
            longer = changes[o + 5 * count + q]
            state[5 * count + q] -= state[7 * count + q] * run + load[WX] * longer
            state[6 * count + q] -= state[8 * count + q] * run + load[WY] * longer
        h, v = h - load[WX] * run, v - load[WY] * run
    if keep:
        for q in range(ROWS * count):
            rows[steps[1] - steps[0], q] = state[q]


@inlined
def _drifted(table, step, i, moment, changed, state, n):
    """Carry the derivatives over a drift; return by how much the rotation grows in it."""
    changes, o = changed
    if table.shape[2] > TABLE_COLUMNS:
        return _wide_drifted(table, step, i, moment, changed, state, n)
    turn = table[step, i, BENDING]
    for q in range(n):
        by, dm = changes[o + 2 * n + q], state[n + q]
        state[q] += by * moment + turn * dm
        state[4 * n + q] += (0.5 * by * moment + turn * dm) * moment
    return turn * moment


@kernel
def _wide_drifted(table, step, i, moment, changed, state, n):
    """Carry the derivatives over a drift of a wide strip; return by how much the rotation grows in it."""
    (changes, o), share, total = changed, table[step, i, SHARE], 0.0
    for half in HALVES:
        w, rest, curl = table[step, i, half], table[step, i, half + 1], table[step, i, half + 2]
        if w == 0.0:
            continue
        turn, slope = bent(w * moment, rest, curl, share)
        moments, energies = by_section(turn, rest, curl, share)
        energy, first = strain_energy(turn, rest, curl, share, w), o + half * n
        total += turn
        for q in range(n):
            by, dr, dc = changes[first + q], changes[first + n + q], changes[first + 2 * n + q]
            ds, dm = changes[o + SHARE * n + q], state[n + q]
            more = slope * (by * moment + w * dm - moments[0] * dr - moments[1] * dc - moments[2] * ds)
            state[q] += more
            state[4 * n + q] += moment * more - energy * by / w
            state[4 * n + q] += (energies[0] * dr + energies[1] * dc + energies[2] * ds) / w
    return total


@kernel
def _kicked(table, step, i, place, load, changed, state):
    """Carry the derivatives over a kick at a place (phi, h, v); return by how much the moment grows in it."""
    (changes, o), n = changed, state.shape[0] // 9
    phi, h, v = place
    s, c = sincos(table[step, i, ANGLE] + phi)
    length, run = table[step, i, LENGTH], table[step, i, RUN]
    pulls, slides = table[step, i, STRETCH], table[step, i, SHEAR]
    normal, shear = h * c + v * s, v * c - h * s
    along, across = length + pulls * normal, slides * shear
    x, y = along * c - across * s, along * s + across * c
    stiff, loaded = pulls == 0.0 and slides == 0.0, load[WX] != 0.0 or load[WY] != 0.0
    for q in range(n):
        turn, dh, dv = state[q] + changes[o + q], state[5 * n + q], state[6 * n + q]
        dh, dv = dh - state[7 * n + q] * run, dv - state[8 * n + q] * run
        if loaded:
            longer = changes[o + 5 * n + q]
            dh, dv = dh - load[WX] * longer, dv - load[WY] * longer
        a, b = changes[o + n + q], 0.0
        if not stiff:
            pull, slide = changes[o + 3 * n + q], changes[o + 4 * n + q]
            dn, dq = shear * turn + dh * c + dv * s, dv * c - dh * s - normal * turn
            a += pull * normal + pulls * dn
            b = slide * shear + slides * dq
            state[4 * n + q] += 0.5 * (pull * normal * normal + slide * shear * shear)
            state[4 * n + q] += pulls * normal * dn + slides * shear * dq
        dx, dy = -y * turn + a * c - b * s, x * turn + a * s + b * c
        state[n + q] += dy * h - dx * v + y * dh - x * dv
        state[2 * n + q] += dx
        state[3 * n + q] += dy
    return h * y - v * x
