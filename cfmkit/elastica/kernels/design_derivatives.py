"""Derivatives of equilibria by design variables: the exact derivative of everything the solver integrates and sums.

`cfmkit.elastica.kernels.model.DesignSlopes` holds how a model changes with each variable. At equilibria the
residual stays zero, so the unknowns change by the solution of a linear system with the tangent that Newton's method
uses; its right sides are the changes of the residual at unchanged unknowns. Along a beam those come from the
drifts and kicks of the state, differentiated: one sweep for all the variables that a beam depends on.
"""

from __future__ import annotations

from cfmkit.elastica.kernels.beam_ode_slopes import flow_slopes
from cfmkit.elastica.kernels.chain import BEFORE, E2, SMALL, E, F, G, places_of, pose_of
from cfmkit.elastica.kernels.compiler import inlined, kernel
from cfmkit.elastica.kernels.dense import clear, lu_solve
from cfmkit.elastica.kernels.force_slopes import (
    load_slopes,
    pose_slope,
    spring_slopes,
    turned_force,
    value_changes,
    value_slopes,
)
from cfmkit.elastica.kernels.newton import assemble
from cfmkit.elastica.kernels.splitting import ROWS


@kernel
def _segment_slopes(m, design, e, y, n, drive, ends, none):
    """Set the derivatives of the end states of a beam's segments at unchanged starts: ends (segments, 9 count)."""
    begin, count = m.beam_segment[e], design.first[e + 1] - design.first[e]
    load = (m.line_load[e, 0, 0] + drive * m.line_load[e, 1, 0], m.line_load[e, 0, 1] + drive * m.line_load[e, 1, 1])
    for j in range(begin, m.beam_segment[e + 1]):
        first = m.segment_step[j]
        state = ends[j - begin]
        for q in range(count):
            k = design.variable[design.first[e] + q]
            for r in range(7):
                state[r * count + q] = 0.0
            for r in range(2):
                state[(7 + r) * count + q] = design.line[k, e, 0, r] + drive * design.line[k, e, 1, r]
        o = n + 6 * j
        start = (y[o + 2], y[o + 3], y[o + 4], y[o + 5])
        at = design.begin[e] + (first - m.segment_step[begin]) * ROWS * m.table.shape[2] * count
        flow_slopes(m.table, (first, m.segment_step[j + 1]), start, load, design.table, at, state, none)


@kernel
def _chain_slopes(m, design, e, ends, store, c, d, parts):
    """Carry the changes of the segments through the chain of beam e: c (k, 3) closure, d (k, 3) start force.

    parts (segments, k, 6) keeps the closure before each segment and what `_unfold_slopes` needs.
    """
    begin, first = m.beam_segment[e], design.first[e]
    n = design.first[e + 1] - first
    for j in range(begin, m.beam_segment[e + 1]):
        t = j - begin
        for q in range(n):
            k = design.variable[first + q]
            for r in range(3):
                parts[j, k, r] = c[k, r]
            turn, b0, b1 = c[k, 2], -ends[t, 5 * n + q], -ends[t, 6 * n + q]
            b2 = store[j, SMALL, 0, 0] * b0 + store[j, SMALL, 0, 1] * b1
            b2 -= store[j, SMALL, 0, 2] * (ends[t, n + q] + store[j, SMALL, 2, 0] * turn)
            parts[j, k, 3], parts[j, k, 4], parts[j, k, 5] = b0, b1, b2
            for r in range(3):
                d[k, r] += store[j, BEFORE, r, 0] * b0 + store[j, BEFORE, r, 1] * b1 + store[j, BEFORE, r, 2] * b2
                moved = store[j, E2, r, 2] * turn + ends[t, (2 + r if r < 2 else 0) * n + q]
                moved += store[j, G, r, 0] * b0 + store[j, G, r, 1] * b1 + store[j, G, r, 2] * b2
                c[k, r] = moved + (c[k, r] if r < 2 else 0.0)


@inlined
def _unfold_slopes(m, e, k, n, store, parts, dqa, dpb, dy):
    """Set the derivatives of the unknowns of all segments of beam e by variable k."""
    n0, n1, n2 = dpb[0], dpb[1], dpb[2]
    for j in range(m.beam_segment[e + 1] - 1, m.beam_segment[e] - 1, -1):
        last = store[j, SMALL, 0, 0] * n0 + store[j, SMALL, 0, 1] * n1 + store[j, SMALL, 0, 2] * n2 + parts[j, k, 5]
        for r in range(3):
            last += store[j, SMALL, 1, r] * dqa[r]
        n0, n1, n2 = n0 + parts[j, k, 3], n1 + parts[j, k, 4], last
        at = n + 6 * j
        for r in range(3):
            dq = parts[j, k, r]
            for i in range(3):
                dq += store[j, E, r, i] * dqa[i]
            dy[at + r, k] = dq + store[j, F, r, 0] * n0 + store[j, F, r, 1] * n1 + store[j, F, r, 2] * n2
        dy[at + 3, k], dy[at + 4, k], dy[at + 5, k] = n0, n1, n2


@kernel
def _frames(m, values, pose, frames):
    """Set for both ends of every beam cos and sin of the frame and the turned arm, (beams, 2, 4)."""
    places = places_of(m)
    for e in range(m.beam_end.shape[0]):
        for side in range(2):
            i = m.beam_end[e, side]
            ox, oy = pose_of(places, values, i, pose)
            frames[e, side, 0], frames[e, side, 1] = m.place_frame[i, 0], m.place_frame[i, 1]
            frames[e, side, 2], frames[e, side, 3] = ox, oy


@kernel
def _beam_sides(m, design, y, drive, n_free, values, frames, rel, c, d, rhs, push, work):
    """Set the right sides as far as beams make them: minus the changes of the residual at unchanged unknowns.

    push (k) collects the change of the force that the drive works against.
    """
    dvalues, force, _, pose = work
    n = n_free + 3 * m.beam_end.shape[0]
    for e in range(m.beam_end.shape[0]):
        ia, ib, last, own = m.beam_end[e, 0], m.beam_end[e, 1], n_free + 3 * e, n + 6 * m.beam_segment[e] + 3
        for k in range(design.moves.shape[0]):
            if not design.touches[e, k]:
                continue
            for r in range(3):
                rhs[last + r, k] = -c[e, k, r]
            if design.shifts[k, ia] or design.shifts[k, ib]:
                value_changes(m, design, k, drive, dvalues)
            if design.shifts[k, ia]:
                pose_slope(m, design, k, ia, values, dvalues, pose)
                for r in range(3):
                    for s in range(3):
                        d[e, k, r] += rel[e, G, r, s] * pose[s]
                        rhs[last + r, k] -= rel[e, E, r, s] * pose[s]
                turned_force(m, design, k, ia, pose, y[own], y[own + 1], force)
                _lower(m, ia, k, force[0], force[1], force[2], 0.0, rhs, push)
            fc, fs, ox, oy = frames[e, 0, 0], frames[e, 0, 1], frames[e, 0, 2], frames[e, 0, 3]
            fx, fy = d[e, k, 0], d[e, k, 1]
            _lower(m, ia, k, fc * fx + fs * fy, fc * fy - fs * fx, ox * fy - oy * fx, d[e, k, 2], rhs, push)
            if design.shifts[k, ib]:
                pose_slope(m, design, k, ib, values, dvalues, pose)
                for r in range(3):
                    rhs[last + r, k] += pose[r]
                turned_force(m, design, k, ib, pose, -y[last], -y[last + 1], force)
                _lower(m, ib, k, force[0], force[1], force[2], 0.0, rhs, push)


@inlined
def _lower(m, i, k, along, across, arm, turn, rhs, push):
    """Take changes of the forces on a place's degrees of freedom off the right side; the drive's share to `push`."""
    for r in range(4):
        dof = m.place_dof[i, r]
        force = along if r == 0 else (across if r == 1 else (arm if r == 2 else turn))
        if m.slot[dof] >= 0:
            rhs[m.slot[dof], k] -= force
        push[k] += m.rate[dof] * force


@kernel
def _other_sides(m, design, k, drive, values, rhs, push, work):
    """Add to the right side of variable k what loads and springs make."""
    dvalues, force, w, _ = work
    value_changes(m, design, k, drive, dvalues)
    for i in range(force.shape[0]):
        force[i] = 0.0
    load_slopes(m, design, k, values, dvalues, drive, w, force)
    spring_slopes(m, design, k, values, dvalues, w, force)
    for i in range(force.shape[0]):
        if m.slot[i] >= 0:
            rhs[m.slot[i], k] -= force[i]
        push[k] += m.rate[i] * force[i]


@inlined
def _start_slope(m, design, e, k, frames, values, dvalues, pose):
    """Set the derivative of the pose of the start of a beam."""
    i = m.beam_end[e, 0]
    if design.shifts[k, i]:
        pose_slope(m, design, k, i, values, dvalues, pose)
        return
    fc, fs, ox, oy = frames[e, 0, 0], frames[e, 0, 1], frames[e, 0, 2], frames[e, 0, 3]
    a, b, turn = dvalues[m.place_dof[i, 0]], dvalues[m.place_dof[i, 1]], dvalues[m.place_dof[i, 2]]
    pose[0], pose[1] = fc * a - fs * b - oy * turn, fs * a + fc * b + ox * turn
    pose[2] = dvalues[m.place_dof[i, 3]]


@kernel
def slopes(m, design, n_free, ys, drives, out, pushes, scratch, spaces):
    """Set the derivatives of the unknowns at points by all variables; tell whether every tangent is regular.

    out (points, unknowns, k); pushes (points, k): derivatives of the force on what the drive moves, in the drive's
    sense, where the tangent is symmetric (no force turns with its node). If `out` has no points, only those are set:
    one solution for the force (the adjoint) takes the place of one for each variable. spaces: see
    `cfmkit.elastica.kernels.workspace`.
    """
    h, _, _, residual, values, ends, rel, store, work, _ = scratch
    n, count, beams = h.shape[0] - 1, design.moves.shape[0], m.beam_end.shape[0]
    (c, d, parts, frames), (moved, none, matrix, rhs, adjoint), room, dpb = spaces
    pose, others = room[3], m.load_place.shape[0] + m.spring_kind.shape[0] > 0
    whole = out.shape[0] > 0
    for p in range(ys.shape[0]):
        y, drive, push = ys[p], drives[p], pushes[p]
        assemble(m, y, drive, n_free, h, residual, values, ends, rel, store, work)
        _frames(m, values, pose, frames)
        clear(rhs)
        for k in range(count):
            push[k] = 0.0
        for e in range(beams):
            clear(c[e])
            clear(d[e])
            own = design.first[e + 1] - design.first[e]
            if own > 0:
                block = moved[:, : 9 * own]
                _segment_slopes(m, design, e, y, n, drive, block, none)
                _chain_slopes(m, design, e, block, store, c[e], d[e], parts)
        _beam_sides(m, design, y, drive, n_free, values, frames, rel, c, d, rhs, push, room)
        for k in range(count):
            if others and design.moves[k]:
                _other_sides(m, design, k, drive, values, rhs, push, room)
        for i in range(n):
            adjoint[i, 0] = h[i, n]
            for j in range(n):
                matrix[i, j] = h[i, j]
        if not lu_solve(matrix, rhs if whole else adjoint):
            return False
        if whole:
            inside = (room[0], pose, dpb)
            _spread_out(m, design, drive, n_free, (values, frames, h), (store, parts), rhs, out[p], push, inside)
            continue
        for i in range(n):
            for k in range(count):
                push[k] += adjoint[i, 0] * rhs[i, k]
    return True


@kernel
def _spread_out(m, design, drive, n_free, state, chains, dz, dy, push, work):
    """Set the derivatives of all unknowns from those of z."""
    (values, frames, h), (store, parts), (dvalues, pose, dpb) = state, chains, work
    n = dz.shape[0]
    for k in range(dz.shape[1]):
        for i in range(n):
            dy[i, k] = dz[i, k]
            push[k] += h[i, n] * dz[i, k]
        value_slopes(m, design, k, drive, dz, dvalues)
        for e in range(m.beam_end.shape[0]):
            _start_slope(m, design, e, k, frames, values, dvalues, pose)
            for r in range(3):
                dpb[r] = dz[n_free + 3 * e + r, k]
            _unfold_slopes(m, e, k, n, store, parts, pose, dpb, dy)
