"""How accurate the effort of a drive is, and what single beams and springs contribute to it along a path.

The nodes do work on a member while the path goes on: on a beam with the forces on its two ends, on a spring by the
change of its energy. Per unit of the drive's motion that is the member's effort; those of all members together, less
what the loads do, are the effort of the drive.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.kernels import compiled
from cfmkit.results import ROUND_OFF

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.equilibrium.network_solver import Solver
    from cfmkit.elastica.outcome.path import Path

STEP = 1e-6
"""Of the largest unknown along the path, to either side: differences are off by 1e-10 of the effort."""

ROUNDING = 30 * np.finfo(float).eps
"""Share of the stiffest segment's force for a unit motion that rounding of places leaves, with room."""


def stiffest(solver: Solver) -> float:
    """Return the largest force on the end of a segment that is moved by a unit length, dimensionless."""
    whole = np.add.reduceat(solver.table[:, :, 1:4].sum(axis=1), solver.cut.segment_step[:-1])
    length, turn, stretch = whole.T
    bent = 12.0 / (length**2 * turn)
    return float(np.where(stretch > 0.0, 1.0 / np.where(stretch > 0.0, stretch, 1.0), bent).max())


def effort_error(path: Path, tolerance: float) -> float:
    """Return the numerical error of a path's effort [N or N m] under a drive by a motion.

    That is the estimated error of the forces, and what rounding makes of them: `ROUND_OFF` of the largest force in the
    network, and `ROUNDING`.

    Parameters
    ----------
    path : Path
        With points.
    tolerance : float
        That its accurate points reach, relative to the largest force [1].
    """
    scales, solver = path.layout.scales, path.solver
    largest = float(np.abs(path.points.y[:, solver.n_free : solver.n]).max(initial=0.0))
    error = max(min(path.error, tolerance), ROUND_OFF) * largest + ROUNDING * stiffest(solver)
    return error * scales.moment / scales.drive


def largest_member_efforts(path: Path, points: Any, motion: Callable[[Path], FloatArray]) -> FloatArray:
    """Return the largest effort of one beam or spring at points of a path, (k,) [N or N m].

    Parameters
    ----------
    path : Path
        The equilibria.
    points : (k,) int array
        Indices of points.
    motion : callable
        Returns the motion of the drive at the points of a path, (k,) [m or rad].
    """
    here = replace(path, points=path.points.take(points), branch=path.branch[points])
    ahead, behind = (_along(here, step) for step in (STEP, -STEP))
    with np.errstate(all="ignore"):
        efforts = _works(here, ahead, behind) / (motion(ahead) - motion(behind))
    sizes = np.abs(efforts)
    return np.asarray(sizes.max(axis=0, initial=0.0, where=np.isfinite(sizes)))


def _along(path: Path, step: float) -> Path:
    """Return the points of a path moved along its tangents, the largest unknown of each by `step`."""
    solver, points = path.solver, path.points
    y, drive = points.y.copy(), points.drive.copy()
    for k, at in enumerate(points.drive.tolist()):
        tangent, column = solver.tangent_at(points.y[k], at)
        try:
            way = np.append(np.linalg.solve(tangent, -column), 1.0)
        except np.linalg.LinAlgError:  # at a bifurcation, or where a force is open
            way = np.append(np.linalg.lstsq(tangent, -column)[0], 1.0)
        way *= step / np.abs(way).max()
        y[k, : solver.n] += way[:-1]
        drive[k] += way[-1]
    return replace(path, points=replace(points, y=y, drive=drive))


def _works(here: Path, ahead: Path, behind: Path) -> FloatArray:
    """Return the work that is done on each beam, then on each spring, between two neighbours, (members, points) [J]."""
    solver, moment = here.solver, here.layout.scales.moment
    n, free, model = solver.n, solver.n_free, solver.model
    moved = _ends(ahead) - _ends(behind)
    y = here.points.y
    last = y[:, free:n].reshape(len(y), -1, 3)
    first = y[:, n:].reshape(len(y), -1, 6)[:, model.beam_segment[:-1], 3:]
    beams = (last * moved[:, :, 1]).sum(axis=2) - (first * moved[:, :, 0]).sum(axis=2)
    springs = [_energy(ahead, k) - _energy(behind, k) for k in range(len(model.spring_kind))]
    return np.vstack([beams.T, *springs]) * moment


def _ends(path: Path) -> FloatArray:
    """Return the poses of both ends of every beam at points, (points, beams, 2, 3), dimensionless."""
    solver, m = path.solver, path.solver.model
    values = np.where(
        m.slot >= 0, path.points.y[:, np.maximum(m.slot, 0)], m.base + path.points.drive[:, None] * m.rate
    )
    a, b, swing, turn = np.moveaxis(values[:, m.place_dof], -1, 0)
    (c, s), (x, y) = m.place_frame.T, m.place_arm.T
    cos, sin = np.cos(swing), np.sin(swing)
    poses = np.stack([c * a - s * b + cos * x - sin * y, s * a + c * b + sin * x + cos * y, turn], axis=-1)
    return np.asarray(poses[:, m.beam_end][:, : solver.n_beams])


def _energy(path: Path, spring: int) -> FloatArray:
    """Return the energy of one spring at points, dimensionless."""
    solver, alone = path.solver, slice(spring, spring + 1)
    m = solver.model
    model = m._replace(
        spring_kind=m.spring_kind[alone], spring_place=m.spring_place[alone], spring_value=m.spring_value[alone]
    )
    out = np.empty((len(path.points.drive), solver.n_dofs + 1))
    compiled.forces(model, solver.n_free, np.ascontiguousarray(path.points.y), path.points.drive, out, solver.scratch)
    return out[:, -1]
