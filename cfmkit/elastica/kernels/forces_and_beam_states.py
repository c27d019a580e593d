"""What holds at solved points: forces on every degree of freedom, states along the beams, closure errors."""

from __future__ import annotations

from cfmkit.elastica.kernels.beam_ode import plain_flow
from cfmkit.elastica.kernels.chain import places_of, pose_of
from cfmkit.elastica.kernels.compiler import kernel
from cfmkit.elastica.kernels.newton import all_values, assemble
from cfmkit.elastica.kernels.springs_and_loads import add_force, add_loads, add_springs, jacobian, wires_of
from cfmkit.elastica.kernels.status_codes import JACOBIANS, OF_BEAMS, VECTORS


@kernel
def forces(m, n_free, ys, drives, out, scratch):
    """Set residual forces on the degrees of freedom and the springs' energy, side by side, at solved points.

    The forces of beams are those at the ends that the solution has.
    """
    h, _, _, residual, values, _, _, _, work, _ = scratch
    n, beams = values.shape[0], m.beam_end.shape[0]
    vectors, jacobians = work[VECTORS], work[JACOBIANS]
    pose, jac, force = vectors[OF_BEAMS, 0], jacobians[0], vectors[OF_BEAMS, 1]
    places, wires = places_of(m), wires_of(m)
    for p in range(ys.shape[0]):
        y = ys[p]
        all_values(m, y, drives[p], values)
        for i in range(residual.shape[0]):
            residual[i] = 0.0
        add_loads(m, values, drives[p], h, residual, work)
        out[p, n] = add_springs(m, values, drives[p], h, residual, work)
        for e in range(beams):
            own, last = n_free + 3 * beams + 6 * m.beam_segment[e] + 3, n_free + 3 * e
            for side in range(2):
                i = m.beam_end[e, side]
                arm = pose_of(places, values, i, pose)
                jacobian(m.place_frame, i, arm, jac)
                for r in range(3):
                    force[r] = y[own + r] if side == 0 else -y[last + r]
                add_force(wires, h, residual, i, arm, jac, force)
        for i in range(n):
            out[p, i] = residual[i]


@kernel
def tangent(m, n_free, y, drive, scratch):
    """Set the first matrix of the work space to the Jacobian at a point."""
    h, _, _, residual, values, ends, rel, store, work, _ = scratch
    assemble(m, y, drive, n_free, h, residual, values, ends, rel, store, work)


@kernel
def states(m, n_free, y, drive, out):
    """Set the states at the step boundaries of all segments at one point; real or complex.

    out (steps + segments, 7): x, y, rotation, moment, h, v, and the strain energy since the segment's start; each
    segment has one row more than steps.
    """
    n = n_free + 3 * m.beam_end.shape[0]
    row = 0
    for e in range(m.beam_end.shape[0]):
        load = (
            m.line_load[e, 0, 0] + drive * m.line_load[e, 1, 0],
            m.line_load[e, 0, 1] + drive * m.line_load[e, 1, 1],
        )
        for j in range(m.beam_segment[e], m.beam_segment[e + 1]):
            at = n + 6 * j
            steps = (m.segment_step[j], m.segment_step[j + 1])
            rows = steps[1] - steps[0] + 1
            part = out[row : row + rows]
            plain_flow(m.table, steps, (y[at + 2], y[at + 3], y[at + 4], y[at + 5]), load, part)
            for k in range(rows):
                phi, moment, x, yy = part[k, 0], part[k, 1], part[k, 2], part[k, 3]
                part[k, 0], part[k, 1], part[k, 2], part[k, 3] = y[at] + x, y[at + 1] + yy, phi, moment
            row += rows


__all__ = ["forces", "states", "tangent"]
