"""One beam as a chain of segments: multiple shooting with the interior eliminated.

After j segments the chain obeys, in increments from the current iterate,

    dq_j = E dq_a + F dp_j + c,      dp_a = E2 dp_j + G dq_a + d

with q = (x, y, rotation), p = (h, v, m), a the start of the beam. This mixed form (a cantilever: pose at one end,
force at the other) exists for inextensible straight beams, where a stiffness does not, and stays stable in strong
tension, where carrying initial values forward does not. c and d have a second column: derivatives by the drive.
"""

from __future__ import annotations

import numpy as np

from cfmkit.elastica.kernels.beam_ode import BY_H, BY_M, BY_ROTATION, BY_V, DRIVEN, FORCE, MOMENT, PHI, X, Y, flow
from cfmkit.elastica.kernels.compiler import inlined, kernel
from cfmkit.elastica.kernels.status_codes import OUTCOMES

E, F, E2, G, C_D, SMALL = 0, 1, 2, 3, 4, 5  # blocks of a relation; C_D: c in columns 0, 1
LARGEST, LIMIT = 3.0, 50.0  # values of a, see `sweep`, that larger ones count as: under thrust, in tension
LEAST = 1e-8  # share of its terms that a pivot is at least: see `_append`
TENSION = 5.0  # cosh of a, see `sweep`, from which a segment in tension is long: Newton's method grows unsure like that
BEFORE = 6  # of what is kept of a segment: E2 before it; its SMALL[2, 0] and E2[:, 2] hold the segment's own turns


@inlined
def places_of(m):
    """Return what `pose_of` needs of a model."""
    return m.place_dof, m.place_frame, m.place_origin, m.place_arm


@kernel
def pose_of(places, values, i, pose):
    """Set the pose of attachment i; return its arm, turned."""
    dofs, frames, origins, arms = places
    fc, fs = frames[i, 0], frames[i, 1]
    a, b, turn = values[dofs[i, 0]], values[dofs[i, 1]], values[dofs[i, 2]]
    ox = oy = 0.0
    if arms[i, 0] != 0.0 or arms[i, 1] != 0.0:
        ct, st = np.cos(turn), np.sin(turn)
        ox, oy = ct * arms[i, 0] - st * arms[i, 1], st * arms[i, 0] + ct * arms[i, 1]
    pose[0] = origins[i, 0] + fc * a - fs * b + ox
    pose[1] = origins[i, 1] + fs * a + fc * b + oy
    pose[2] = values[dofs[i, 3]]
    return ox, oy


@inlined
def _start_of(m, j, e, y, n, drive):
    """Return rotation, h, v and M at the start of segment j, on beam e, the line load on it, and how that grows."""
    at = n + 6 * j
    gx, gy = m.line_load[e, 1, 0], m.line_load[e, 1, 1]
    load = (m.line_load[e, 0, 0] + drive * gx, m.line_load[e, 0, 1] + drive * gy, gx, gy)
    return (y[at + 2], y[at + 3], y[at + 4], y[at + 5]), load


@inlined
def flows(m, y, n, drive, work):
    """Integrate over all segments, two at a time; their outcomes go into the work space."""
    outs = work[OUTCOMES]
    count, first, j, e = m.segment_step.shape[0] - 1, m.segment_step, 0, 0
    while j < count:
        while m.beam_segment[e + 1] <= j:
            e += 1
        k, other, steps = j, e, first[j + 1] - first[j]
        if j + 1 < count and first[j + 2] - first[j + 1] == steps:
            k = j + 1
            while m.beam_segment[other + 1] <= k:
                other += 1
        (one, a), (two, b) = _start_of(m, j, e, y, n, drive), _start_of(m, k, other, y, n, drive)
        flow(m.table, (first[j], first[k], steps), (one, two), (a, b), (outs[j], outs[k]))
        j, e = k + 1, other


@inlined
def sweep(m, e, y, first_slot, ends, rel, store, work):
    """Set the relation `rel` of beam e from its segments' outcomes and keep in `store` what `unfold` needs.

    ends: poses of the two ends; first_slot: index in y of the beam's last force followed by that of its segments.
    Returns the change of the inertia by the eliminated unknowns and how short the segments are for their load. With
    a^2 the thrust of a segment times its length over its bending rigidity that is the smallest cos a, or TENSION/cosh a
    in tension. The equations of a straight segment have dM1/dM0 = cos a; a step that is too long for its load has not.
    """
    outs = work[OUTCOMES]
    for k in range(6):
        for i in range(3):
            for j in range(3):
                rel[k, i, j] = 0.0
    for k in range(3):
        rel[E, k, k] = 1.0
        rel[E2, k, k] = 1.0
    index, least = 0, 1.0
    begin, end = m.beam_segment[e], m.beam_segment[e + 1]
    for j in range(begin, end):
        at, out = first_slot[1] + 6 * j, outs[j]
        h, v = out[FORCE], out[FORCE + 1]
        if j + 1 < end:
            qx, qy, qr = y[at + 6], y[at + 7], y[at + 8]
            ph, pv, pm = y[at + 9], y[at + 10], y[at + 11]
        else:
            b = first_slot[0] + 3 * e
            qx, qy, qr = ends[1, 0], ends[1, 1], ends[1, 2]
            ph, pv, pm = y[b], y[b + 1], y[b + 2]
        rq = (y[at] + out[X] - qx, y[at + 1] + out[Y] - qy, out[PHI] - qr)
        rp = (h - ph, v - pv, out[MOMENT] - pm)
        pivot = _append(rel, store, j, out, rq, rp)
        own = out[MOMENT + BY_M]
        pulled = m.segment_turn[j] * (y[at + 3] * out[X] + y[at + 4] * out[Y])
        if pulled < 0.0:
            least = min(least, np.cos(min(np.sqrt(-pulled), LARGEST)))
        elif pulled > 1.0:
            least = min(least, TENSION / np.cosh(min(np.sqrt(pulled), LIMIT)))
        if j > begin and own != 0.0 and pivot / own < 0.0:
            index += 1 if out[MOMENT + BY_ROTATION] / own < 0.0 else -1
        if pivot == 0.0:
            return index, np.nan
    return index, least


@kernel
def _append(rel, store, n, out, rq, rp):
    """Append segment n to the relation; return the scalar pivot of the elimination.

    The pivot vanishes where the beam up to here is critical as a cantilever. From a pin to where the moment is
    largest it is so all along its bent path: there the pivot is rounding, and of no sign. The tangent with a pivot a
    little off is that of a network with a slightly other rigidity: Newton's method converges with it, and its inertia
    is right.

    Whole arrays with all their indices, here and below: views of them cost more than the arithmetic.
    """
    for i in range(3):
        for j in range(3):
            store[n, E, i, j], store[n, F, i, j] = rel[E, i, j], rel[F, i, j]
            store[n, C_D, i, j], store[n, BEFORE, i, j] = rel[C_D, i, j], rel[E2, i, j]
    turn = out[MOMENT + BY_ROTATION]  # dM1 by the start's rotation: the only entry of dp1/dq0
    g0, g1 = out[MOMENT + BY_H] + turn * rel[F, 2, 0], out[MOMENT + BY_V] + turn * rel[F, 2, 1]
    pivot = out[MOMENT + BY_M] + turn * rel[F, 2, 2]
    floor = LEAST * (abs(out[MOMENT + BY_M]) + abs(turn * rel[F, 2, 2]))
    if abs(pivot) < floor:
        pivot = -floor if pivot < 0.0 else floor
    if pivot == 0.0:
        return pivot
    # dp_j = W dp_{j+1} + e3 (hq . dq_a) + hb; W differs from 1 in its last row only
    k0, k1, k2 = -g0 / pivot, -g1 / pivot, 1.0 / pivot
    store[n, SMALL, 0, 0], store[n, SMALL, 0, 1], store[n, SMALL, 0, 2] = k0, k1, k2
    for i in range(3):
        store[n, SMALL, 1, i] = -turn * rel[E, 2, i] / pivot
    store[n, SMALL, 2, 0] = turn
    # hb, for the residual and for the drive
    b0, b1 = -rp[0], -rp[1]
    store[n, E2, 0, 0], store[n, E2, 1, 0] = b0, b1
    store[n, E2, 2, 0] = k0 * b0 + k1 * b1 - k2 * (rp[2] + turn * rel[C_D, 2, 0])
    b0, b1 = -out[DRIVEN + 3], -out[DRIVEN + 4]
    store[n, E2, 0, 1], store[n, E2, 1, 1] = b0, b1
    store[n, E2, 2, 1] = k0 * b0 + k1 * b1 - k2 * (out[DRIVEN + 5] + turn * rel[C_D, 2, 1])
    _propagate(rel, store, n, out, rq)
    return pivot


@kernel
def _propagate(rel, store, n, out, rq):
    """Replace the relation by that after segment n."""
    ax, ay, ar = out[X + BY_ROTATION], out[Y + BY_ROTATION], out[PHI + BY_ROTATION]
    store[n, E2, 0, 2], store[n, E2, 1, 2], store[n, E2, 2, 2] = ax, ay, ar
    k0, k1, k2 = store[n, SMALL, 0, 0], store[n, SMALL, 0, 1], store[n, SMALL, 0, 2]
    for i in range(3):  # P = A F + B
        store[n, G, 0, i] = store[n, F, 0, i] + ax * store[n, F, 2, i] + out[X + BY_H + i]
        store[n, G, 1, i] = store[n, F, 1, i] + ay * store[n, F, 2, i] + out[Y + BY_H + i]
        store[n, G, 2, i] = ar * store[n, F, 2, i] + out[PHI + BY_H + i]
    for r in range(3):
        last, own = store[n, G, r, 2], (0.0 if r == 2 else 1.0)
        along = ax if r == 0 else (ay if r == 1 else ar)
        rel[F, r, 0], rel[F, r, 1] = store[n, G, r, 0] + last * k0, store[n, G, r, 1] + last * k1
        rel[F, r, 2] = last * k2
        for i in range(3):
            moved = own * store[n, E, r, i] + along * store[n, E, 2, i]
            rel[E, r, i] = moved + last * store[n, SMALL, 1, i]
        for col in range(2):
            closes = rq[r] if col == 0 else out[DRIVEN + r]
            moved = own * store[n, C_D, r, col] + along * store[n, C_D, 2, col] + closes
            for i in range(3):
                moved += store[n, G, r, i] * store[n, E2, i, col]
                rel[SMALL, r, col] += rel[E2, r, i] * store[n, E2, i, col]
            rel[C_D, r, col] = moved
    for r in range(3):
        last = rel[E2, r, 2]
        for i in range(3):
            rel[G, r, i] += last * store[n, SMALL, 1, i]
        rel[E2, r, 0] += last * k0
        rel[E2, r, 1] += last * k1
        rel[E2, r, 2] = last * k2


@inlined
def unfold(m, e, first_slot, store, dqa, dpb, errors, ddrive, dy):
    """Set the increments of all segments' unknowns of beam e from those at its ends.

    errors: share of the segments' closure errors that they take away, 1 for Newton's step and 0 for a derivative.
    """
    begin, end = m.beam_segment[e], m.beam_segment[e + 1]
    n0, n1, n2 = dpb[0], dpb[1], dpb[2]
    for j in range(end - 1, begin - 1, -1):
        last = store[j, E2, 2, 0] * errors + store[j, E2, 2, 1] * ddrive
        last += store[j, SMALL, 0, 0] * n0 + store[j, SMALL, 0, 1] * n1 + store[j, SMALL, 0, 2] * n2
        for r in range(3):
            last += store[j, SMALL, 1, r] * dqa[r]
        n0 += store[j, E2, 0, 0] * errors + store[j, E2, 0, 1] * ddrive
        n1 += store[j, E2, 1, 0] * errors + store[j, E2, 1, 1] * ddrive
        n2 = last
        at = first_slot[1] + 6 * j
        for r in range(3):
            dq = store[j, C_D, r, 0] * errors + store[j, C_D, r, 1] * ddrive
            for i in range(3):
                dq += store[j, E, r, i] * dqa[i]
            dq += store[j, F, r, 0] * n0 + store[j, F, r, 1] * n1 + store[j, F, r, 2] * n2
            dy[at + r] = dq
        dy[at + 3], dy[at + 4], dy[at + 5] = n0, n1, n2


__all__ = ["BEFORE", "C_D", "E2", "SMALL", "E", "F", "G", "flows", "places_of", "pose_of", "sweep", "unfold"]
