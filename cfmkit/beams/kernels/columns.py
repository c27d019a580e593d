"""Derivatives of equilibria by design variables: the exact derivative of everything the solver integrates and sums.

A `cfmkit.beams.kernels.model.Tilt` holds how the arrays of a model change with each variable. At an equilibrium the
residual stays zero, so the unknowns change by the solution of a linear system with the tangent that Newton's method
uses; its right sides are the changes of the residual at unchanged unknowns. Along a beam those come from the
Runge-Kutta steps of the state, differentiated: one sweep for all the variables that a beam depends on.
"""

from __future__ import annotations

import numpy as np

from cfmkit.beams.kernels.chain import BEFORE, E2, SMALL, E, F, G
from cfmkit.beams.kernels.compiler import kernel
from cfmkit.beams.kernels.dense import lu_solve
from cfmkit.beams.kernels.flow_slopes import ROWS, flow_slopes
from cfmkit.beams.kernels.force_slopes import beam_slopes, load_slopes, pose_slope, spring_slopes, value_slopes
from cfmkit.beams.kernels.newton import assemble
from cfmkit.beams.kernels.rk8 import STAGES


@kernel
def _segment_slopes(m, tilt, e, y, n, drive, ends):
    """Set the derivatives of the end states of a beam's segments at unchanged starts: ends (segments, 9, count)."""
    begin, count = m.beam_segment[e], tilt.first[e + 1] - tilt.first[e]
    load = (m.line_load[e, 0, 0] + drive * m.line_load[e, 1, 0], m.line_load[e, 0, 1] + drive * m.line_load[e, 1, 1])
    none = np.empty((1, ROWS, count))
    for j in range(begin, m.beam_segment[e + 1]):
        first = m.segment_step[j]
        state = ends[j - begin]
        for q in range(count):
            k = tilt.variable[tilt.first[e] + q]
            for r in range(7):
                state[r, q] = 0.0
            for r in range(2):
                state[7 + r, q] = tilt.line[k, e, 0, r] + drive * tilt.line[k, e, 1, r]
        o = n + 6 * j
        start = (y[o + 2], y[o + 3], y[o + 4], y[o + 5])
        at = tilt.begin[e] + (first - m.segment_step[begin]) * STAGES * 5 * count
        flow_slopes(m.table, m.width, (first, m.segment_step[j + 1]), start, load, tilt.table, at, state, none)


@kernel
def _chain_slopes(m, tilt, e, ends, store, c, d, parts):
    """Carry the changes of the segments through the chain of beam e: c (k, 3) closure, d (k, 3) start force.

    parts (segments, k, 6) keeps the closure before each segment and what `_unfold_slopes` needs.
    """
    begin = m.beam_segment[e]
    for j in range(begin, m.beam_segment[e + 1]):
        keep, first = store[j], tilt.first[e]
        small, p, e2, a = keep[SMALL], keep[G], keep[BEFORE], keep[E2]
        for q in range(tilt.first[e + 1] - first):
            k = tilt.variable[first + q]
            s = ends[j - begin, :, q]
            part = parts[j, k]
            for r in range(3):
                part[r] = c[k, r]
            b0, b1 = -s[4], -s[5]
            b2 = small[0, 0] * b0 + small[0, 1] * b1 - small[0, 2] * (s[1] + small[2, 0] * c[k, 2])
            part[3], part[4], part[5] = b0, b1, b2
            for r in range(3):
                d[k, r] += e2[r, 0] * b0 + e2[r, 1] * b1 + e2[r, 2] * b2
            turn = c[k, 2]
            c[k, 0] += a[0, 2] * turn + s[2] + p[0, 0] * b0 + p[0, 1] * b1 + p[0, 2] * b2
            c[k, 1] += a[1, 2] * turn + s[3] + p[1, 0] * b0 + p[1, 1] * b1 + p[1, 2] * b2
            c[k, 2] = a[2, 2] * turn + s[0] + p[2, 0] * b0 + p[2, 1] * b1 + p[2, 2] * b2


@kernel
def _unfold_slopes(m, e, k, n, store, parts, dqa, dpb, dy):
    """Set the derivatives of the unknowns of all segments of beam e by variable k."""
    n0, n1, n2 = dpb[0], dpb[1], dpb[2]
    for j in range(m.beam_segment[e + 1] - 1, m.beam_segment[e] - 1, -1):
        keep, part = store[j], parts[j, k]
        small = keep[SMALL]
        turn = small[1, 0] * dqa[0] + small[1, 1] * dqa[1] + small[1, 2] * dqa[2]
        n2 = small[0, 0] * n0 + small[0, 1] * n1 + small[0, 2] * n2 + turn + part[5]
        n0, n1 = n0 + part[3], n1 + part[4]
        at = n + 6 * j
        for r in range(3):
            dq = part[r]
            dq += keep[E, r, 0] * dqa[0] + keep[E, r, 1] * dqa[1] + keep[E, r, 2] * dqa[2]
            dq += keep[F, r, 0] * n0 + keep[F, r, 1] * n1 + keep[F, r, 2] * n2
            dy[at + r, k] = dq
        dy[at + 3, k], dy[at + 4, k], dy[at + 5, k] = n0, n1, n2


@kernel
def _right_side(m, tilt, k, y, drive, n_free, values, rel, c, d, rhs, work):
    """Set column k of the right side: minus the changes of the residual at unchanged unknowns."""
    dvalues, force, w, pose, dstart, dend = work
    n_dofs = values.shape[0]
    for i in range(n_dofs):
        force[i] = 0.0
        dvalues[i] = 0.0 if m.slot[i] >= 0 else tilt.base[k, i] + drive * tilt.rate[k, i]
    for e in range(m.beam_end.shape[0]):
        last = n_free + 3 * e
        pose_slope(m, tilt, k, m.beam_end[e, 0], values, dvalues, pose[0])
        pose_slope(m, tilt, k, m.beam_end[e, 1], values, dvalues, pose[1])
        for r in range(3):
            dstart[e, r], dend[e, r], total = d[e, k, r], 0.0, c[e, k, r] - pose[1, r]
            for s in range(3):
                dstart[e, r] += rel[e, G, r, s] * pose[0, s]
                total += rel[e, E, r, s] * pose[0, s]
            rhs[last + r, k] = -total
    if tilt.moves[k]:
        load_slopes(m, tilt, k, values, dvalues, drive, w, force)
        spring_slopes(m, tilt, k, values, dvalues, w, force)
    beam_slopes(m, tilt, k, y, n_free, values, dvalues, dstart, dend, w, force)
    for i in range(n_dofs):
        if m.slot[i] >= 0:
            rhs[m.slot[i], k] = -force[i]


@kernel
def slopes(m, tilt, n_free, ys, drives, out, held, scratch):
    """Set the derivatives of the unknowns at points by all variables; tell whether every tangent is regular.

    out (points, unknowns, k); held (points, dofs + 1, k): derivatives of the forces on all degrees of freedom, as
    `cfmkit.beams.kernels.observe.forces` has them, and of the springs' energy.
    """
    h, _, _, residual, values, ends, rel, store, work, _ = scratch
    n, count, beams = h.shape[0] - 1, tilt.moves.shape[0], m.beam_end.shape[0]
    segments = m.segment_step.shape[0] - 1
    c, d = np.zeros((beams, count, 3)), np.zeros((beams, count, 3))
    parts = np.zeros((segments, count, 6))
    most, wide = 0, 0
    for e in range(beams):
        most = max(most, tilt.first[e + 1] - tilt.first[e])
        wide = max(wide, m.beam_segment[e + 1] - m.beam_segment[e])
    moved = np.empty((wide, 9, most))
    dvalues, force, w, pose = np.zeros(values.shape[0]), np.zeros(values.shape[0]), np.zeros((12, 7)), np.zeros((2, 7))
    dstart, dend = np.zeros((beams, 3)), np.zeros((beams, 3))
    room = (dvalues, force, w, pose, dstart, dend)
    matrix, rhs = np.empty((n, n)), np.zeros((n, count))
    for p in range(ys.shape[0]):
        y, drive = ys[p], drives[p]
        assemble(m, y, drive, n_free, h, residual, values, ends, rel, store, work)
        for e in range(beams):
            for k in range(count):
                for r in range(3):
                    c[e, k, r], d[e, k, r] = 0.0, 0.0
            own = tilt.first[e + 1] - tilt.first[e]
            if own > 0:
                block = moved[:, :, :own]
                _segment_slopes(m, tilt, e, y, n, drive, block)
                _chain_slopes(m, tilt, e, block, store, c[e], d[e], parts)
        for k in range(count):
            _right_side(m, tilt, k, y, drive, n_free, values, rel, c, d, rhs, room)
        for i in range(n):
            for j in range(n):
                matrix[i, j] = h[i, j]
        if not lu_solve(matrix, rhs):
            return False
        dy = out[p]
        for i in range(n):
            for k in range(count):
                dy[i, k] = rhs[i, k]
        for k in range(count):
            value_slopes(m, tilt, k, drive, dy, dvalues)
            for i in range(force.shape[0]):
                force[i] = 0.0
            for e in range(beams):
                pose_slope(m, tilt, k, m.beam_end[e, 0], values, dvalues, pose[0])
                for r in range(3):
                    dend[e, r] = dy[n_free + 3 * e + r, k]
                _unfold_slopes(m, e, k, n, store, parts, pose[0], dend[e], dy)
                for r in range(3):
                    dstart[e, r] = dy[n + 6 * m.beam_segment[e] + 3 + r, k]
            load_slopes(m, tilt, k, values, dvalues, drive, w, force)
            held[p, force.shape[0], k] = spring_slopes(m, tilt, k, values, dvalues, w, force)
            beam_slopes(m, tilt, k, y, n_free, values, dvalues, dstart, dend, w, force)
            for i in range(force.shape[0]):
                held[p, i, k] = force[i]
    return True


@kernel
def row_slopes(m, tilt, n_free, y, drive, dy, out):
    """Set the derivatives of the states at the step boundaries of all segments at one point by all variables.

    `tilt` pairs every beam with every variable. out (steps + segments, 7, k): as in `cfmkit.beams.kernels.observe`.
    """
    n, count = n_free + 3 * m.beam_end.shape[0], dy.shape[1]
    state = np.zeros((9, count))
    row = 0
    for e in range(m.beam_end.shape[0]):
        load = (
            m.line_load[e, 0, 0] + drive * m.line_load[e, 1, 0],
            m.line_load[e, 0, 1] + drive * m.line_load[e, 1, 1],
        )
        begin = m.segment_step[m.beam_segment[e]]
        for j in range(m.beam_segment[e], m.beam_segment[e + 1]):
            o, first, last = n + 6 * j, m.segment_step[j], m.segment_step[j + 1]
            for k in range(count):
                state[0, k], state[1, k], state[2, k], state[3, k] = dy[o + 2, k], dy[o + 5, k], dy[o, k], dy[o + 1, k]
                state[4, k], state[5, k], state[6, k] = dy[o + 3, k], dy[o + 4, k], 0.0
                for r in range(2):
                    state[7 + r, k] = tilt.line[k, e, 0, r] + drive * tilt.line[k, e, 1, r]
            start = (y[o + 2], y[o + 3], y[o + 4], y[o + 5])
            at = tilt.begin[e] + (first - begin) * STAGES * 5 * count
            rows = out[row : row + last - first + 1]
            flow_slopes(m.table, m.width, (first, last), start, load, tilt.table, at, state, rows)
            row += last - first + 1
