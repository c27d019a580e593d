"""Derivatives by design variables of what is observed at solved points: forces on supports, states along the beams."""

from __future__ import annotations

from cfmkit.elastica.kernels.beam_ode_slopes import flow_slopes
from cfmkit.elastica.kernels.compiler import kernel
from cfmkit.elastica.kernels.force_slopes import beam_slopes, load_slopes, spring_slopes, value_slopes
from cfmkit.elastica.kernels.newton import all_values
from cfmkit.elastica.kernels.splitting import ROWS


@kernel
def held_slopes(m, design, n_free, ys, drives, dys, out, room):
    """Set the derivatives of the forces on all degrees of freedom and of the springs' energy, (points, dofs + 1, k).

    The forces are those of `cfmkit.elastica.kernels.observe.forces`.
    """
    count, beams, dofs = design.moves.shape[0], m.beam_end.shape[0], m.slot.shape[0]
    n = n_free + 3 * beams
    (values, dvalues, force), w, dstart, dend = room
    for p in range(ys.shape[0]):
        y, drive, dy = ys[p], drives[p], dys[p]
        all_values(m, y, drive, values)
        for k in range(count):
            value_slopes(m, design, k, drive, dy, dvalues)
            for i in range(dofs):
                force[i] = 0.0
            for e in range(beams):
                for r in range(3):
                    dstart[e, r], dend[e, r] = dy[n + 6 * m.beam_segment[e] + 3 + r, k], dy[n_free + 3 * e + r, k]
            load_slopes(m, design, k, values, dvalues, drive, w, force)
            out[p, dofs, k] = spring_slopes(m, design, k, values, dvalues, w, force)
            beam_slopes(m, design, k, y, n_free, values, dvalues, dstart, dend, w, force)
            for i in range(dofs):
                out[p, i, k] = force[i]


@kernel
def row_slopes(m, design, n_free, y, drive, dy, out, state):
    """Set the derivatives of the states at the step boundaries of all segments at one point by all variables.

    `design` pairs every beam with every variable. out (steps + segments, 7 k): phi, M, X, Y,
    energy, h, v, each by all variables. state (9 k): room.
    """
    n, count = n_free + 3 * m.beam_end.shape[0], dy.shape[1]
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
                state[k], state[count + k] = dy[o + 2, k], dy[o + 5, k]
                state[2 * count + k], state[3 * count + k], state[4 * count + k] = dy[o, k], dy[o + 1, k], 0.0
                state[5 * count + k], state[6 * count + k] = dy[o + 3, k], dy[o + 4, k]
                for r in range(2):
                    state[(7 + r) * count + k] = design.line[k, e, 0, r] + drive * design.line[k, e, 1, r]
            start = (y[o + 2], y[o + 3], y[o + 4], y[o + 5])
            at = design.begin[e] + (first - begin) * ROWS * m.table.shape[2] * count
            rows = out[row : row + last - first + 1]
            flow_slopes(m.table, (first, last), start, load, design.table, at, state, rows)
            row += last - first + 1
