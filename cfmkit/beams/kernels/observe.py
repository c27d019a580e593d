"""What holds at solved points: forces on every degree of freedom, states along the beams, closure errors."""

from __future__ import annotations

from cfmkit.beams.kernels.chain import pose_of
from cfmkit.beams.kernels.compiler import kernel
from cfmkit.beams.kernels.flow import plain_flow
from cfmkit.beams.kernels.newton import all_values, assemble
from cfmkit.beams.kernels.springs import add_springs

STATE = 7  # x, y, rotation, moment, h, v, strain energy since the segment's start


@kernel
def forces(m, n_free, ys, drives, out, scratch):
    """Set degrees of freedom, residual forces on them and the springs' energy, side by side, at each point."""
    h, _, _, residual, values, ends, rel, store, work, _ = scratch
    n = values.shape[0]
    for p in range(ys.shape[0]):
        assemble(m, ys[p], drives[p], n_free, h, residual, values, ends, rel, store, work)
        for i in range(n):
            out[p, i], out[p, n + i] = values[i], residual[i]
        for i in range(residual.shape[0]):
            residual[i] = 0.0
        out[p, 2 * n] = add_springs(m, values, h, residual, work)


@kernel
def states(m, n_free, y, drive, out):
    """Set the states at the step boundaries of all segments at one point; real or complex.

    out (steps + segments, 7): each segment has one row more than steps.
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
            plain_flow(m.table, m.width, steps, (y[at + 2], y[at + 3], y[at + 4], y[at + 5]), load, part)
            for k in range(rows):
                phi, moment, x, yy = part[k, 0], part[k, 1], part[k, 2], part[k, 3]
                part[k, 0], part[k, 1], part[k, 2], part[k, 3] = y[at] + x, y[at + 1] + yy, phi, moment
            row += rows


__all__ = ["STATE", "all_values", "forces", "pose_of", "states"]
