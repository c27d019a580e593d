"""Derivatives by design variables, of equilibria and of what is observed there: forces on supports, states along beams.

They are exact: the derivative of everything that the solver integrates and sums.

`network_array_types.DesignSlopes` holds how a model changes with each variable. At equilibria the residual stays
zero, so the unknowns change by the solution of a linear system with the tangent that Newton's method uses; its right
sides are the changes of the residual at unchanged unknowns. Along a beam those come from the drifts and kicks of the
state, differentiated: one sweep for all the variables that a beam depends on.
"""

from __future__ import annotations

import numpy as np

from cfmkit.elastica.kernels.beam_ode_design_derivatives import flow_slopes
from cfmkit.elastica.kernels.chain import BEFORE, E2, SMALL, E, F, G, places_of, pose_of
from cfmkit.elastica.kernels.compiler import inlined, kernel
from cfmkit.elastica.kernels.dense import clear, lu_solve
from cfmkit.elastica.kernels.network_array_types import DIRECTION_X, DIRECTION_Y, LINE, REST, REST_GAP, STIFFNESS, TURN
from cfmkit.elastica.kernels.newton import all_values, assemble
from cfmkit.elastica.kernels.springs_and_loads import spring_law
from cfmkit.elastica.kernels.symplectic_splitting_coefficients import ROWS


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
                turned_force(design, k, ia, pose, y[own], y[own + 1], force)
                _lower(m, ia, k, force[0], force[1], force[2], 0.0, rhs, push)
            fc, fs, ox, oy = frames[e, 0, 0], frames[e, 0, 1], frames[e, 0, 2], frames[e, 0, 3]
            fx, fy = d[e, k, 0], d[e, k, 1]
            _lower(m, ia, k, fc * fx + fs * fy, fc * fy - fs * fx, ox * fy - oy * fx, d[e, k, 2], rhs, push)
            if design.shifts[k, ib]:
                pose_slope(m, design, k, ib, values, dvalues, pose)
                for r in range(3):
                    rhs[last + r, k] += pose[r]
                turned_force(design, k, ib, pose, -y[last], -y[last + 1], force)
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


@inlined
def value_slopes(m, design, k, drive, dz, values):
    """Set the derivatives of all degrees of freedom: dz of the free ones, the held ones as prescribed."""
    for i in range(values.shape[0]):
        slot = m.slot[i]
        values[i] = dz[slot, k] if slot >= 0 else design.base[k, i] + drive * design.rate[k, i]


@inlined
def value_changes(m, design, k, drive, values):
    """Set the derivatives of all degrees of freedom at unchanged unknowns."""
    for i in range(values.shape[0]):
        values[i] = 0.0 if m.slot[i] >= 0 else design.base[k, i] + drive * design.rate[k, i]


@inlined
def turned_force(design, k, i, pose, fx, fy, out):
    """Set the changes that an unchanged force at a place makes as its frame and arm turn; pose: see `pose_slope`."""
    dc, ds = design.frame[k, i, 0], design.frame[k, i, 1]
    out[0], out[1], out[2] = dc * fx + ds * fy, dc * fy - ds * fx, pose[5] * fy - pose[6] * fx


@inlined
def pose_slope(m, design, k, i, values, dvalues, out):
    """Set the derivative of a place's pose (out[:3]), its turned arm (out[3:5]) and that arm's derivative (out[5:])."""
    d = m.place_dof[i]
    fc, fs = m.place_frame[i, 0], m.place_frame[i, 1]
    dc, ds = design.frame[k, i, 0], design.frame[k, i, 1]
    a, b, da, db, turn = values[d[0]], values[d[1]], dvalues[d[0]], dvalues[d[1]], dvalues[d[2]]
    ct, st = np.cos(values[d[2]]), np.sin(values[d[2]])
    ax, ay, px, py = m.place_arm[i, 0], m.place_arm[i, 1], design.arm[k, i, 0], design.arm[k, i, 1]
    ox, oy = ct * ax - st * ay, st * ax + ct * ay
    sx, sy = ct * px - st * py - oy * turn, st * px + ct * py + ox * turn
    out[0] = design.origin[k, i, 0] + fc * da - fs * db + dc * a - ds * b + sx
    out[1] = design.origin[k, i, 1] + fs * da + fc * db + ds * a + dc * b + sy
    out[2] = dvalues[d[3]]
    out[3], out[4], out[5], out[6] = ox, oy, sx, sy


@kernel
def _spread(m, design, k, i, pose, force, dforce, sign, out):
    """Add the derivative of the forces that a force at a place makes on its degrees of freedom; pose: as set above."""
    d = m.place_dof[i]
    fc, fs = m.place_frame[i, 0], m.place_frame[i, 1]
    dc, ds = design.frame[k, i, 0], design.frame[k, i, 1]
    out[d[0]] += sign * (fc * dforce[0] + fs * dforce[1] + dc * force[0] + ds * force[1])
    out[d[1]] += sign * (fc * dforce[1] - fs * dforce[0] + dc * force[1] - ds * force[0])
    out[d[2]] += sign * (pose[3] * dforce[1] - pose[4] * dforce[0] + pose[5] * force[1] - pose[6] * force[0])
    out[d[3]] += sign * dforce[2]


@kernel
def load_slopes(m, design, k, values, dvalues, drive, w, out):
    """Add the derivatives of the point loads."""
    pose, force, dforce = w[0], w[1], w[2]
    for q in range(m.load_place.shape[0]):
        i = m.load_place[q]
        pose_slope(m, design, k, i, values, dvalues, pose)
        for r in range(3):
            force[r] = m.load_value[q, 0, r] + drive * m.load_value[q, 1, r]
            dforce[r] = design.load[k, q, 0, r] + drive * design.load[k, q, 1, r]
        if m.load_follows[q]:
            turn, by = values[m.place_dof[i, 3]], dvalues[m.place_dof[i, 3]]
            c, s = np.cos(turn), np.sin(turn)
            fx, fy = c * force[0] - s * force[1], s * force[0] + c * force[1]
            dx, dy = c * dforce[0] - s * dforce[1], s * dforce[0] + c * dforce[1]
            force[0], force[1], dforce[0], dforce[1] = fx, fy, dx - by * fy, dy + by * fx
        _spread(m, design, k, i, pose, force, dforce, 1.0, out)


@kernel
def _law_slope(kind, value, change, gap, dforce):
    """Add to `dforce` the derivative of a spring's force on its second place by its own values at unchanged places.

    gap: vector from the first place to the second.
    """
    k = value[STIFFNESS]
    if kind == TURN:
        dforce[2] += -change[STIFFNESS] * (gap[2] - value[REST]) + k * change[REST]
        return
    dx, dy = gap[0], gap[1]
    if kind == LINE:
        length = np.sqrt(dx * dx + dy * dy)
        if length > 0.0:
            pull = k * change[REST] - change[STIFFNESS] * (length - value[REST])
            dforce[0] += pull * dx / length
            dforce[1] += pull * dy / length
        return
    ex, ey = value[DIRECTION_X], value[DIRECTION_Y]
    far = dx * ex + dy * ey - value[REST_GAP]
    by = dx * change[DIRECTION_X] + dy * change[DIRECTION_Y] - change[REST_GAP]
    pull = -change[STIFFNESS] * far - k * by
    dforce[0] += pull * ex - k * far * change[DIRECTION_X]
    dforce[1] += pull * ey - k * far * change[DIRECTION_Y]


@kernel
def spring_slopes(m, design, k, values, dvalues, w, out):
    """Add the derivatives of the springs' forces; return that of their energy."""
    pa, pb, force, dforce, block, gap = w[0], w[1], w[2], w[3], w[4:7, :3], w[7]
    sa, sb = w[8], w[9]
    places, energy = places_of(m), 0.0
    for q in range(m.spring_kind.shape[0]):
        i, j = m.spring_place[q, 0], m.spring_place[q, 1]
        pose_of(places, values, i, pa)
        pose_of(places, values, j, pb)
        pose_slope(m, design, k, i, values, dvalues, sa)
        pose_slope(m, design, k, j, values, dvalues, sb)
        spring_law(m.spring_kind[q], m.spring_value[q], 0.0, pa, pb, force, block)
        for r in range(3):
            gap[r] = pb[r] - pa[r]
            dforce[r] = 0.0
            for s in range(3):
                dforce[r] += block[r, s] * (sb[s] - sa[s])
            energy -= force[r] * (sb[r] - sa[r])
        value, change = m.spring_value[q], design.spring[k, q]
        _law_slope(m.spring_kind[q], value, change, gap, dforce)
        energy += _energy_slope(m.spring_kind[q], value, change, gap)
        _spread(m, design, k, i, sa, force, dforce, -1.0, out)
        _spread(m, design, k, j, sb, force, dforce, 1.0, out)
    return energy


@kernel
def _energy_slope(kind, value, change, gap):
    """Return the derivative of a spring's energy by its own values at unchanged places."""
    if kind == TURN:
        far, by = gap[2] - value[REST], -change[REST]
    elif kind == LINE:
        far, by = np.sqrt(gap[0] * gap[0] + gap[1] * gap[1]) - value[REST], -change[REST]
    else:
        far = gap[0] * value[DIRECTION_X] + gap[1] * value[DIRECTION_Y] - value[REST_GAP]
        by = gap[0] * change[DIRECTION_X] + gap[1] * change[DIRECTION_Y] - change[REST_GAP]
    return 0.5 * change[STIFFNESS] * far * far + value[STIFFNESS] * far * by


@kernel
def beam_slopes(m, design, k, y, n_free, values, dvalues, dstart, dend, w, out):
    """Add the derivatives of the forces at the ends of all beams; dstart, dend (beams, 3): those of the forces."""
    n = n_free + 3 * m.beam_end.shape[0]
    pose, force = w[0], w[1]
    for e in range(m.beam_end.shape[0]):
        own, last = n + 6 * m.beam_segment[e] + 3, n_free + 3 * e
        for r in range(3):
            force[r] = y[own + r]
        pose_slope(m, design, k, m.beam_end[e, 0], values, dvalues, pose)
        _spread(m, design, k, m.beam_end[e, 0], pose, force, dstart[e], 1.0, out)
        for r in range(3):
            force[r] = y[last + r]
        pose_slope(m, design, k, m.beam_end[e, 1], values, dvalues, pose)
        _spread(m, design, k, m.beam_end[e, 1], pose, force, dend[e], -1.0, out)


@kernel
def held_slopes(m, design, n_free, ys, drives, dys, out, room):
    """Set the derivatives of the forces on all degrees of freedom and of the springs' energy, (points, dofs + 1, k).

    The forces are those of `cfmkit.elastica.kernels.forces_and_beam_states.forces`.
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
def row_slopes(m, design, n_free, y, drive, dy, wanted, out, state):
    """Set the derivatives of the states at the step boundaries of wanted segments at one point by all variables.

    `design` pairs every beam with every variable. wanted (segments): the rows of others are left as they are.
    out (steps + segments, 7 k): phi, M, X, Y, energy, h, v, each by all variables. state (9 k): room.
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
            if not wanted[j]:
                row += last - first + 1
                continue
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
