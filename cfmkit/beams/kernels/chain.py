"""One beam as a chain of segments: multiple shooting with the interior eliminated.

After j segments the chain obeys, in increments from the current iterate,

    dq_j = E dq_a + F dp_j + c,      dp_a = E2 dp_j + G dq_a + d

with q = (x, y, rotation), p = (h, v, m), a the start of the beam. This mixed form (a cantilever: pose at one end,
force at the other) exists for inextensible straight beams, where a stiffness does not, and stays stable in strong
tension, where carrying initial values forward does not. c and d have a second column: derivatives by the drive.
"""

from __future__ import annotations

import numpy as np

from cfmkit.beams.kernels.compiler import kernel
from cfmkit.beams.kernels.dense import clear, copy_matrix
from cfmkit.beams.kernels.flow import flow, plain_flow

E, F, E2, G, C_D, SMALL = 0, 1, 2, 3, 4, 5  # blocks of a relation; C_D: c in columns 0, 1
BEFORE = 6  # of what is kept of a segment: E2 before it; its SMALL[2, 0] and E2[:, 2] hold the segment's own turns


@kernel
def pose_of(m, values, i, pose):
    """Set the pose of attachment i; return its arm, turned."""
    d = m.place_dof[i]
    fc, fs = m.place_frame[i, 0], m.place_frame[i, 1]
    a, b, turn = values[d[0]], values[d[1]], values[d[2]]
    ct, st = np.cos(turn), np.sin(turn)
    ox = ct * m.place_arm[i, 0] - st * m.place_arm[i, 1]
    oy = st * m.place_arm[i, 0] + ct * m.place_arm[i, 1]
    pose[0] = m.place_origin[i, 0] + fc * a - fs * b + ox
    pose[1] = m.place_origin[i, 1] + fs * a + fc * b + oy
    pose[2] = values[d[3]]
    return ox, oy


@kernel
def _drive_column(m, e, steps, start, load, dp):
    """Set the derivative of a segment's end pose and force by the drive, where a line load grows with it."""
    states = np.empty((steps[1] - steps[0] + 1, 7), dtype=np.complex128)
    h = 1e-30
    tilted = (load[0] + 1j * h * m.line_load[e, 1, 0], load[1] + 1j * h * m.line_load[e, 1, 1])
    begin = (start[0] + 0j, start[1] + 0j, start[2] + 0j, start[3] + 0j)
    plain_flow(m.table, m.width, steps, begin, tilted, states)
    last = states[-1]
    dp[0], dp[1], dp[2] = last[2].imag / h, last[3].imag / h, last[0].imag / h
    dp[3], dp[4], dp[5] = last[4].imag / h, last[5].imag / h, last[1].imag / h


@kernel
def sweep(m, e, y, first_slot, drive, ends, rel, store, work):
    """Set the relation `rel` of beam e and keep in `store` what `unfold` needs.

    ends: poses of the two ends; first_slot: index in y of the beam's last force followed by that of its segments.
    Returns the change of the inertia by the eliminated unknowns and the smallest dM1/dM0 of a segment.
    """
    out, drv = work[2, 3], work[2, 4]
    grows = m.line_load[e, 1, 0] != 0.0 or m.line_load[e, 1, 1] != 0.0
    load = (
        m.line_load[e, 0, 0] + drive * m.line_load[e, 1, 0],
        m.line_load[e, 0, 1] + drive * m.line_load[e, 1, 1],
    )
    for k in range(6):
        clear(rel[k])
    for k in range(3):
        rel[E, k, k] = 1.0
        rel[E2, k, k] = 1.0
    for k in range(6):
        drv[k] = 0.0
    index, least = 0, 1.0
    begin, end = m.beam_segment[e], m.beam_segment[e + 1]
    for j in range(begin, end):
        at = first_slot[1] + 6 * j
        steps = (m.segment_step[j], m.segment_step[j + 1])
        if j == begin:
            y[at], y[at + 1], y[at + 2] = ends[0, 0], ends[0, 1], ends[0, 2]
        start = (y[at + 2], y[at + 3], y[at + 4], y[at + 5])
        h, v = flow(m.table, m.width, steps, start, load, out, work)
        if grows:
            _drive_column(m, e, steps, start, load, drv)
        if j + 1 < end:
            qx, qy, qr = y[at + 6], y[at + 7], y[at + 8]
            ph, pv, pm = y[at + 9], y[at + 10], y[at + 11]
        else:
            b = first_slot[0] + 3 * e
            qx, qy, qr = ends[1, 0], ends[1, 1], ends[1, 2]
            ph, pv, pm = y[b], y[b + 1], y[b + 2]
        rq = (y[at] + out[10] - qx, y[at + 1] + out[15] - qy, out[0] - qr)
        rp = (h - ph, v - pv, out[5] - pm)
        stiff = rel[F, 2, 2]
        denominator = _append(rel, store[j], out, rq, rp, drv)
        own = out[9]
        least = min(least, own)
        if j > begin and own != 0.0:
            gamma = -out[6] / own
            if gamma * stiff > 1.0:
                index += 1 if gamma > 0.0 else -1
        if denominator == 0.0:
            return index, np.nan
    return index, least


@kernel
def _append(rel, keep, out, rq, rp, drv):
    """Append a segment to the relation; return the scalar pivot of the elimination."""
    copy_matrix(keep[E], rel[E])
    copy_matrix(keep[F], rel[F])
    copy_matrix(keep[C_D], rel[C_D])
    copy_matrix(keep[BEFORE], rel[E2])
    turn = out[6]  # dM1 by the start's rotation: the only entry of dp1/dq0
    g0, g1 = out[7] + turn * rel[F, 2, 0], out[8] + turn * rel[F, 2, 1]
    pivot = out[9] + turn * rel[F, 2, 2]
    if pivot == 0.0:
        return pivot
    k = keep[SMALL]
    k[2, 0] = turn
    # dp_j = W dp_{j+1} + e3 (hq . dq_a) + hb; W differs from 1 in its last row only
    k[0, 0], k[0, 1], k[0, 2] = -g0 / pivot, -g1 / pivot, 1.0 / pivot
    for i in range(3):
        k[1, i] = -turn * rel[E, 2, i] / pivot
    for col in range(2):
        if col == 0:
            b0, b1, b2 = -rp[0], -rp[1], -rp[2] - turn * rel[C_D, 2, 0]
        else:
            b0, b1, b2 = -drv[3], -drv[4], -drv[5] - turn * rel[C_D, 2, 1]
        hb = k[0, 0] * b0 + k[0, 1] * b1 + k[0, 2] * b2
        # hb is kept beside the relation: columns of keep[E2] and, for the force at the start, of keep[G]
        keep[E2, 0, col], keep[E2, 1, col], keep[E2, 2, col] = b0, b1, hb
    _propagate(rel, keep, out, rq, drv)
    return pivot


@kernel
def _propagate(rel, keep, out, rq, drv):
    """Replace the relation by that after the segment."""
    k = keep[SMALL]
    e, f, e2, g, c = rel[E], rel[F], rel[E2], rel[G], rel[C_D]
    olde, oldf, oldc = keep[E], keep[F], keep[C_D]
    ax, ay, ar = out[11], out[16], out[1]  # dX, dY, dphi by the start's rotation
    keep[E2, 0, 2], keep[E2, 1, 2], keep[E2, 2, 2] = ax, ay, ar
    p = keep[G]  # scratch: P = A F + B
    for i in range(3):
        p[0, i] = oldf[0, i] + ax * oldf[2, i] + out[12 + i]
        p[1, i] = oldf[1, i] + ay * oldf[2, i] + out[17 + i]
        p[2, i] = ar * oldf[2, i] + out[2 + i]
    for r in range(3):
        last = p[r, 2]
        f[r, 0] = p[r, 0] + last * k[0, 0]
        f[r, 1] = p[r, 1] + last * k[0, 1]
        f[r, 2] = last * k[0, 2]
    for i in range(3):
        e[0, i] = olde[0, i] + ax * olde[2, i] + p[0, 2] * k[1, i]
        e[1, i] = olde[1, i] + ay * olde[2, i] + p[1, 2] * k[1, i]
        e[2, i] = ar * olde[2, i] + p[2, 2] * k[1, i]
    for col in range(2):
        h = keep[E2]
        for r in range(3):
            own = rq[r] if col == 0 else drv[r]
            if r == 0:
                moved = oldc[0, col] + ax * oldc[2, col]
            elif r == 1:
                moved = oldc[1, col] + ay * oldc[2, col]
            else:
                moved = ar * oldc[2, col]
            c[r, col] = moved + own + p[r, 0] * h[0, col] + p[r, 1] * h[1, col] + p[r, 2] * h[2, col]
            rel[SMALL, r, col] += e2[r, 0] * h[0, col] + e2[r, 1] * h[1, col] + e2[r, 2] * h[2, col]
    for r in range(3):
        last = e2[r, 2]
        for i in range(3):
            g[r, i] += last * k[1, i]
        e2[r, 0] += last * k[0, 0]
        e2[r, 1] += last * k[0, 1]
        e2[r, 2] = last * k[0, 2]


@kernel
def unfold(m, e, first_slot, store, dqa, dpb, ddrive, dy):
    """Set the increments of all segments' unknowns of beam e from those at its ends."""
    begin, end = m.beam_segment[e], m.beam_segment[e + 1]
    n0, n1, n2 = dpb[0], dpb[1], dpb[2]
    for j in range(end - 1, begin - 1, -1):
        keep = store[j]
        k, h = keep[SMALL], keep[E2]
        turn = k[1, 0] * dqa[0] + k[1, 1] * dqa[1] + k[1, 2] * dqa[2]
        last = k[0, 0] * n0 + k[0, 1] * n1 + k[0, 2] * n2 + turn + h[2, 0] + h[2, 1] * ddrive
        n0, n1, n2 = n0 + h[0, 0] + h[0, 1] * ddrive, n1 + h[1, 0] + h[1, 1] * ddrive, last
        at = first_slot[1] + 6 * j
        for r in range(3):
            dq = keep[C_D, r, 0] + keep[C_D, r, 1] * ddrive
            dq += keep[E, r, 0] * dqa[0] + keep[E, r, 1] * dqa[1] + keep[E, r, 2] * dqa[2]
            dq += keep[F, r, 0] * n0 + keep[F, r, 1] * n1 + keep[F, r, 2] * n2
            dy[at + r] = dq
        dy[at + 3], dy[at + 4], dy[at + 5] = n0, n1, n2


__all__ = ["BEFORE", "C_D", "E2", "SMALL", "E", "F", "G", "np", "pose_of", "sweep", "unfold"]
