"""Equilibrium: the global system of a network, Newton's method with one bordering row, inertia of the tangent."""

from __future__ import annotations

import numpy as np

from cfmkit.elastica.kernels.chain import C_D, E2, SMALL, E, F, G, flows, places_of, pose_of, sweep, unfold
from cfmkit.elastica.kernels.compiler import inlined, kernel
from cfmkit.elastica.kernels.dense import clear, copy_matrix, lu_solve, positive_count
from cfmkit.elastica.kernels.follower_stability import diverging
from cfmkit.elastica.kernels.network_array_types import LENGTH, STRETCH
from cfmkit.elastica.kernels.springs_and_loads import (
    acts,
    add_block,
    add_force,
    add_loads,
    add_springs,
    jacobian,
    wires_of,
)
from cfmkit.elastica.kernels.status_codes import (
    COMPLIANCE,
    DIVERGED,
    DRIVE,
    GROWTH,
    INCREMENT,
    JACOBIANS,
    LEAST_SHORTNESS,
    LOG_DETERMINANT,
    OF_BEAMS,
    OF_INCREMENTS,
    SINGULAR,
    SLOW,
    SOLVED,
    UNSTABLE_COUNT,
    VECTORS,
)

EPSILON = np.finfo(np.float64).eps
LARGEST_TURN = 1.0  # longest Newton step [rad or lengths]: longer ones are shortened, not refused


@kernel
def all_values(m, y, drive, values):
    """Set the values of all degrees of freedom."""
    for i in range(values.shape[0]):
        slot = m.slot[i]
        values[i] = y[slot] if slot >= 0 else m.base[i] + drive * m.rate[i]


@kernel
def assemble(m, y, drive, n_free, h, residual, values, ends, rel, store, work):
    """Set the Jacobian `h` (unknowns z, then the drive) and the residuals of equilibrium and closure.

    residual (dofs + 3 beams): forces on every degree of freedom, free or not, then closure errors; the order of the
    rows of `h` is that of z. Returns the inertia that the eliminated unknowns contribute and the shortness measure.
    """
    clear(h)
    for i in range(residual.shape[0]):
        residual[i] = 0.0
    all_values(m, y, drive, values)
    n_beams = m.beam_end.shape[0]
    n_dofs = values.shape[0]
    n = n_free + 3 * n_beams
    vectors, jacobians = work[VECTORS], work[JACOBIANS]
    ja, jb, force = jacobians[0], jacobians[1], vectors[OF_BEAMS, 0]
    places, wires = places_of(m), wires_of(m)
    index, least = 0, 1.0
    add_loads(m, values, drive, h, residual, work)
    add_springs(m, values, drive, h, residual, work)
    for e in range(n_beams):
        pose_of(places, values, m.beam_end[e, 0], ends[0])
        at = n + 6 * m.beam_segment[e]
        y[at], y[at + 1], y[at + 2] = ends[0, 0], ends[0, 1], ends[0, 2]
    flows(m, y, n, drive, work)
    for e in range(n_beams):
        ia, ib = m.beam_end[e, 0], m.beam_end[e, 1]
        arm_a, arm_b = pose_of(places, values, ia, ends[0]), pose_of(places, values, ib, ends[1])
        jacobian(m.place_frame, ia, arm_a, ja)
        jacobian(m.place_frame, ib, arm_b, jb)
        change, short = sweep(m, e, y, (n_free, n), ends, rel[e], store, work)
        index += change
        least = min(least, short)
        own = n + 6 * m.beam_segment[e] + 3
        last = n_free + 3 * e
        for r in range(3):
            force[r] = y[own + r] + rel[e, SMALL, r, 0]
        add_force(wires, h, residual, ia, arm_a, ja, force)
        for r in range(3):
            force[r] = -y[last + r]
        add_force(wires, h, residual, ib, arm_b, jb, force)
        add_block(wires, h, ia, ia, ja, rel[e, G], ja)
        _couple(m, h, e, last, ia, ib, ja, jb, rel[e])
        for r in range(3):
            residual[n_dofs + 3 * e + r] = rel[e, C_D, r, 0]
            h[last + r, n] += rel[e, C_D, r, 1]
    return index, least


@inlined
def _couple(m, h, e, last, ia, ib, ja, jb, rel):
    """Add the blocks between a beam's last force and the degrees of freedom of its ends."""
    n, wires = h.shape[0] - 1, wires_of(m)
    for a in range(4):
        da, db = m.place_dof[ia, a], m.place_dof[ib, a]
        row_a, row_b = m.slot[da], m.slot[db]
        if acts(wires, da):
            for r in range(3):
                start, closure = 0.0, 0.0
                for s in range(3):
                    start += ja[s, a] * rel[E2, s, r]
                    closure += rel[E, r, s] * ja[s, a]
                if row_a >= 0:
                    h[row_a, last + r] += start
                    h[last + r, row_a] += closure
                else:
                    h[last + r, n] += closure * m.rate[da]
        if acts(wires, db):
            for r in range(3):
                if row_b >= 0:
                    h[row_b, last + r] -= jb[r, a]
                    h[last + r, row_b] -= jb[r, a]
                else:
                    h[last + r, n] -= jb[r, a] * m.rate[db]
        if row_a >= 0:
            for s in range(3):
                h[row_a, n] += ja[s, a] * rel[SMALL, s, 1]
    for r in range(3):
        for s in range(3):
            h[last + r, last + s] += rel[F, r, s]


@kernel
def right_sides(m, residual, h, y, drive, n_free, border, target, rhs):
    """Set the two right sides: the Newton step, and the tangent with unit advance along the border."""
    n = h.shape[0] - 1
    n_dofs = m.slot.shape[0]
    clear(rhs)
    for i in range(n_dofs):
        if m.slot[i] >= 0:
            rhs[m.slot[i], 0] = -residual[i]
    for i in range(n - n_free):
        rhs[n_free + i, 0] = -residual[n_dofs + i]
    along = border[n] * drive
    for i in range(n):
        h[n, i] = border[i]
        along += border[i] * y[i]
    h[n, n] = border[n]
    rhs[n, 0] = target - along
    rhs[n, 1] = 1.0


@kernel
def tangent_index(h, n_free, eliminated, scratch):
    """Return the number of unstable directions from the Jacobian (forces positive: minus the energy's Hessian)."""
    n = h.shape[0] - 1
    for i in range(n):
        for j in range(n):
            scratch[i, j] = 0.5 * (h[i, j] + h[j, i])
    return positive_count(scratch[:n, :n]) - (n - n_free) + eliminated


@kernel
def largest(dy, y, n_free, n):
    """Return the largest increment: poses as they are, forces relative to the largest force.

    Places of segments do not count: they follow linearly from all else.
    """
    scale = 1.0
    for i in range(n_free, y.shape[0]):
        if (i < n or (i - n) % 6 > 2) and abs(y[i]) > scale:
            scale = abs(y[i])
    pose, force = 0.0, 0.0
    for i in range(y.shape[0]):
        size = abs(dy[i])
        if not np.isfinite(size):
            return np.inf, np.inf
        part = (i - n) % 6 if i >= n else -1
        if i < n_free or part == 2:
            pose = max(pose, size)
        elif part < 0 or part > 2:
            force = max(force, size)
    return pose, force / scale


@kernel
def rounding(m, y, n_free, n):
    """Return what rounding of places makes of forces, relative as in `largest`: a strip at rest has no others.

    That is a rounding error of one unit of length on the stiffest segment; Newton's method ends up to 0.1 of it off.
    """
    stiffest, scale = 0.0, 1.0
    for j in range(m.segment_turn.shape[0]):
        length, stretch = 0.0, 0.0
        for step in range(m.segment_step[j], m.segment_step[j + 1]):
            for row in range(m.table.shape[1]):
                length += m.table[step, row, LENGTH]
                stretch += m.table[step, row, STRETCH]
        bent = 12.0 / (length * length * m.segment_turn[j])
        stiffest = max(stiffest, 1.0 / stretch if stretch > 0.0 else bent)
    for i in range(n_free, y.shape[0]):
        if i < n or (i - n) % 6 > 2:
            scale = max(scale, abs(y[i]))
    return EPSILON * stiffest / scale


@kernel
def _log_determinant(factors, advance):
    """Return the logarithm of the size of the Jacobian's determinant from the factors of the bordered system.

    advance: the drive per unit along the border, which by Cramer's rule is the ratio of the two determinants.
    """
    total = np.log(abs(advance))
    for i in range(factors.shape[0]):
        total += np.log(abs(factors[i, i]))
    return total


@kernel
def solve(m, n_free, y, state, border, target, limits, tangent, scratch):
    """Newton's method for equilibrium with border . (z, drive) = target; y and the state's drive are updated.

    limits: (tolerance, most iterations). On return tangent holds d(z, drive) per unit along the border and the state
    the number of unstable directions, the shortness measure and the last increment. Its GROWTH carries from one
    solution to the next how the increment follows from the square of the one before. If its LOG_DETERMINANT is not
    zero, it is set to the logarithm of the size of the determinant of d(residual)/dz.
    Returns a code and the number of iterations.
    """
    h, h2, rhs, residual, values, ends, rel, store, work, dy = scratch
    n = h.shape[0] - 1
    before = 0.0
    for iteration in range(int(limits[1])):
        index, least = assemble(m, y, state[DRIVE], n_free, h, residual, values, ends, rel, store, work)
        right_sides(m, residual, h, y, state[DRIVE], n_free, border, target, rhs)
        copy_matrix(h2, h)
        if not lu_solve(h2, rhs):
            return SINGULAR, iteration
        for i in range(n):
            dy[i] = rhs[i, 0]
        _unfold_all(m, n_free, 1.0, rhs[n, 0], dy, scratch)
        pose, force = largest(dy, y, n_free, n)
        if not (np.isfinite(pose) and np.isfinite(force)):
            return DIVERGED, iteration
        share = min(1.0, LARGEST_TURN / pose) if pose > 0.0 else 1.0
        for i in range(dy.shape[0]):
            y[i] += share * dy[i]
        state[DRIVE] += share * rhs[n, 0]
        size = max(pose, force)
        if before > 1e-6:
            state[GROWTH] = max(0.5 * state[GROWTH], size / (before * before))
        growth = max(30.0, 10.0 * state[GROWTH])
        solved = share == 1.0 and (growth * size * size < limits[0] or size < 1e-2 * limits[0])
        if not solved and iteration + 1 == int(limits[1]) and share == 1.0 and growth * pose * pose < limits[0]:
            solved = force <= rounding(m, y, n_free, n)
            state[GROWTH] = 0.0 if solved else state[GROWTH]
        if solved:
            for i in range(n + 1):
                tangent[i] = rhs[i, 1]
            if state[LOG_DETERMINANT] != 0.0:
                state[LOG_DETERMINANT] = _log_determinant(h2, tangent[n])
            state[UNSTABLE_COUNT] = tangent_index(h, n_free, index, h2)
            if m.load_follows.shape[0] > 0 and state[UNSTABLE_COUNT] > 0.0:
                state[UNSTABLE_COUNT] = diverging(m, h, int(state[UNSTABLE_COUNT]), h2, rhs, residual, work[COMPLIANCE])
            state[LEAST_SHORTNESS], state[INCREMENT] = least, size
            return SOLVED, iteration + 1
        before = size
        if size > 1e6:
            return DIVERGED, iteration
    return SLOW, int(limits[1])


@kernel
def solve_each(m, n_free, ys, drives, limits, changes, scratch, room):
    """Solve for the equilibria near (ys, drives) at these drives, in the place of ys.

    changes (points, 3) is set to the largest changes of the free degrees of freedom, of the forces on the beams' last
    sections, and of all unknowns; infinite where there is no equilibrium.
    """
    _, (before, _, _), state, (_, tangent, unit, _), _ = room
    n = unit.shape[0] - 1
    state[LOG_DETERMINANT] = 0.0
    for p in range(ys.shape[0]):
        state[DRIVE], state[GROWTH] = drives[p], 0.0
        for i in range(before.shape[0]):
            before[i] = ys[p, i]
        code, _ = solve(m, n_free, ys[p], state, unit, drives[p], limits, tangent, scratch)
        pose, force, rest = 0.0, 0.0, 0.0
        for i in range(before.shape[0]):
            change = abs(ys[p, i] - before[i])
            if i < n_free:
                pose = max(pose, change)
            elif i < n:
                force = max(force, change)
            else:
                rest = max(rest, change)
        most = max(max(pose, force), rest)
        changes[p, 0], changes[p, 1], changes[p, 2] = pose, force, most
        if code != SOLVED:
            changes[p, 0] = changes[p, 1] = changes[p, 2] = np.inf


@kernel
def _unfold_all(m, n_free, errors, ddrive, dy, scratch):
    """Set the increments of the segments' unknowns from those of z (already in dy) and of the drive; see `unfold`."""
    h, _, _, _, values, _, _, store, work, _ = scratch
    vectors, jacobians = work[VECTORS], work[JACOBIANS]
    n, dpose, jac, pose = h.shape[0] - 1, vectors[OF_INCREMENTS, 0], jacobians[0], vectors[OF_INCREMENTS, 1]
    places = places_of(m)
    for e in range(m.beam_end.shape[0]):
        ia = m.beam_end[e, 0]
        arm = pose_of(places, values, ia, pose)
        jacobian(m.place_frame, ia, arm, jac)
        for r in range(3):
            dpose[r] = 0.0
            for a in range(4):
                d = m.place_dof[ia, a]
                slot = m.slot[d]
                change = dy[slot] if slot >= 0 else m.rate[d] * ddrive
                dpose[r] += jac[r, a] * change
        last = n_free + 3 * e
        unfold(m, e, (n_free, n), store, dpose, dy[last : last + 3], errors, ddrive, dy)


@kernel
def all_slopes(m, n_free, tangent, slope, scratch):
    """Set the derivatives of all unknowns and of the drive from those of z and the drive, after `solve`."""
    n = tangent.shape[0] - 1
    for i in range(n):
        slope[i] = tangent[i]
    _unfold_all(m, n_free, 0.0, tangent[n], slope, scratch)
    slope[slope.shape[0] - 1] = tangent[n]


__all__ = [
    "SOLVED",
    "all_slopes",
    "all_values",
    "assemble",
    "largest",
    "right_sides",
    "rounding",
    "solve",
    "solve_each",
    "tangent_index",
]
