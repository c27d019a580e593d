"""Why solutions and marches end, and the names of the columns of what they work in: known without the compiler."""

from __future__ import annotations

SOLVED, SINGULAR, DIVERGED, SLOW = 0, 1, 2, 3
"""How Newton's method ended."""

DONE, STALLED, INERTIA, LONG, FULL, OUTSIDE, NO_START, DENIED = range(8)
"""Why a march ended: all requested points reached; the smallest step failed; the number of unstable directions changed;
a segment is too long for its load; no room for more points; the drive left its range; no equilibrium to start from;
a requested value was tried for so often in vain that it may lie at a bifurcation."""

TOLERANCE, ITERATIONS, BY_DRIVE, STEP, SMALLEST, LONGEST, CHANGE, WEIGHT, LOWEST, HIGHEST = range(10)
WATCHED, INERTIA_BEFORE, SENSE, LANDINGS = range(10, 14)
"""Columns of the options of a march: see `cfmkit.elastica.kernels.march.march`."""

UNSTABLE, REQUESTED, REACHED, SPENT, DRIVE_RATE, SHORTNESS = range(6)
"""What is stored with a point: number of unstable directions, index of the requested value or -1, parameter (drive, or
arc length since the march began, -1 between two of its steps), iterations, d(drive)/d(parameter), shortness."""

DRIVE, UNSTABLE_COUNT, LEAST_SHORTNESS, INCREMENT, GROWTH, LOG_DETERMINANT = range(6)
"""State of a solution: see `cfmkit.elastica.kernels.newton.solve`."""

VECTORS, JACOBIANS, BLOCK, OUTCOMES, COMPLIANCE = range(5)
"""Arrays to assemble the equations in: small vectors, Jacobians of poses by degrees of freedom, a spring's block,
outcomes of the segments (see `cfmkit.elastica.kernels.beam_ode.flow`), compliance for loads that turn."""

OF_BEAMS, OF_LOADS, OF_SPRINGS, OF_INCREMENTS = range(4)
"""Who uses which of the small vectors."""

SHORT = 0.25  # dM1/dM0 of a segment below which it must be split
KEPT, KEPT_WITH_SLOPES = 6, 3  # points that the extrapolation uses
