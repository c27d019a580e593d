"""Tracing: from a network and a drive to the path of its equilibria, on a mesh that reaches the tolerance.

How accurate points are is told by the same equilibria on a mesh with half the step.
"""

from __future__ import annotations

from dataclasses import replace
from math import ceil
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.continuation import ending_messages
from cfmkit.elastica.continuation.decision_loop import follow
from cfmkit.elastica.continuation.path_and_moves import MOST_SEGMENTS, PathProblem
from cfmkit.elastica.equilibrium.mesh import Mesh
from cfmkit.elastica.kernels.status_codes import STALLED
from cfmkit.elastica.model.drive import Control, Displacement, Drive, Loading
from cfmkit.elastica.model.network import PointLoad
from cfmkit.elastica.model.network_under_drive import Layout
from cfmkit.elastica.outcome.member_efforts import ROUNDING, stiffest
from cfmkit.elastica.outcome.path import Path, PathStatus

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.continuation.critical_points import Singular
    from cfmkit.elastica.continuation.path_and_moves import Trail
    from cfmkit.elastica.equilibrium.network_solver import Solver
    from cfmkit.elastica.model.network import Network

_EARLY = 0.1  # share of the drive's range: segments that are too long before it are cut in four, later in two
_MOST_PULLED = 2048  # segments of a beam that is only pulled: L/t = 10 000 at 3 % takes 1600; films would take minutes
_LOADS = (1e1, 1e2, 1e3, 1e4, 1e5)
"""Loads [EI/L^2 of the mean beam] up to which a network that a displacement cannot move is looked at for buckling.

Columns of the mean length buckle between 2.5 and 39, those of a fiftieth of it at 1e5; each tenfold load is tried by
itself, for a path meets its first bifurcations one by one only in steps that are not far beyond them."""

_ROUNDS = 8  # meshes tried before giving up on the tolerance
_GAIN = 0.005  # share of the drive's range, or of the constant loads, that is some
_SURE = 1e-3  # error of a path that ends early from which on that may be the mesh's fault
_COILED = 4.0  # turn of an unloaded shape in a step [rad] up to which that sees it: 14 kicks for two thirds of a turn
_STARTS = 4  # of them where nothing bears the constant loads, if each bears more of them than the one before
_NOISE = 0.1  # change of forces that small, by half the step, as a share of themselves: there is no force


def trace(network: Network, drive: Drive, control: Control | None = None) -> Path:
    """Return the path of equilibria of a network under a drive, from rest through all requested points.

    Parameters
    ----------
    network : Network
        What it is.
    drive : Displacement, Rotation or Loading
        What is done to it.
    control : Control, optional
        Accuracy, folds, branches.

    Returns
    -------
    Path
        Converged points only. `Path.status` says whether the path reaches all requested points, and if not, why.
    """
    control = control or Control()
    if control.imperfection == 0.0:
        return _solved(network, drive, control).path()
    from cfmkit.elastica.continuation.imperfection import imperfect

    perfect = replace(control, imperfection=0.0)
    primary = _solved(network, drive, replace(perfect, branch="primary"), True)
    first, unit = primary.first, ""
    if primary.trail.ending.status is PathStatus.NO_START:  # a straight beam that does not stretch is rigid, say
        first, unit = _under_load(network, drive, perfect), "N" if isinstance(drive, Displacement) else "N m"
    bent, name = imperfect(network, first, control.imperfection, unit)
    path = _solved(bent, drive, perfect).path()
    branch = path.branch if bent is network else np.where(path.branch == "primary", "imperfect", path.branch)
    return replace(path, imperfection=name, branch=read_only(branch, np.str_))


def _under_load(network: Network, drive: Drive, control: Control) -> tuple[PathProblem, Singular] | None:
    """Return the first bifurcation under the force or moment of a drive by a motion."""
    if isinstance(drive, Loading):
        return None
    scales = Layout(network, drive).scales
    if isinstance(drive, Displacement):
        load, unit = PointLoad(drive.node, float(np.cos(drive.direction)), float(np.sin(drive.direction))), scales.force
    else:
        load, unit = PointLoad(drive.node, moment=1.0), scales.moment
    sense = float(np.sign(drive.points[np.flatnonzero(drive.points)[0]]))
    for largest in _LOADS:
        loading = Loading((load,), np.array([sense * largest * unit]))
        first = _solved(network, loading, replace(control, branch="primary"), True).first
        if first is not None:
            return first
    return None


class Attempt(NamedTuple):
    """A path on one mesh, with its estimated error; `first`: see `decision_loop.Followed`."""

    problem: PathProblem
    trail: Trail
    error: float
    first: tuple[PathProblem, Singular] | None

    def path(self) -> Path:
        """Return the outcome; where the tolerance is not reached, every point is judged by itself."""
        problem, trail, tolerance = self.problem, self.trail, self.problem.control.tolerance
        accurate: Any = np.ones(len(trail.points), dtype=bool)
        if not self.error <= tolerance:
            largest = float(largest_force(trail).max())
            accurate = np.array(errors(problem, trail, [*range(len(trail.points))], largest)) <= tolerance
            trail = ending_messages.inaccurate(problem, trail, self.error, int((~accurate).sum()))
        accurate.setflags(write=False)
        return Path(
            solver=trail.solver,
            points=trail.points,
            branch=np.array(trail.branches, dtype=np.str_),
            status=trail.ending.status,
            message=trail.ending.message or trail.ending.status.value,
            events=trail.events,
            error=self.error,
            accurate=accurate,
        )


def _solved(network: Network, drive: Drive, control: Control, first_only: bool = False) -> Attempt:
    """Return the path on the first mesh that reaches the tolerance, or on the last that is tried.

    first_only: only as far as the first bifurcation.
    """
    layout = Layout(network, drive)
    mesh, borne = first_mesh(layout, control.tolerance), -1.0
    before: Trail | None = None
    round_ = 0
    while True:
        problem = PathProblem(layout, mesh, control, first_only)
        followed = follow(problem)
        trail, last = followed.trail, round_ == _ROUNDS - 1
        cut = mesh.shorter(4 if _early(problem, trail) else 2)
        if trail.ending.too_long and before is not None and not _further(problem, trail, before):
            trail = ending_messages.stop(problem, trail, STALLED).trail
        elif trail.ending.too_long and not last and cut.segments <= most_segments(trail):
            round_ += cut.segments <= MOST_SEGMENTS  # the finest cuts are no rounds: each is followed four times as far
            before, mesh = trail, cut
            continue
        status = trail.ending.status
        if status is PathStatus.NO_START and round_ < _STARTS and followed.share > borne + _GAIN:
            mesh, borne, round_ = mesh.shorter(), followed.share, round_ + 1
            continue
        error = estimate(problem, trail)
        limit = control.tolerance if status is PathStatus.COMPLETE else min(control.tolerance, _SURE)
        if error <= limit or last:
            break
        mesh, round_ = mesh.finer(), round_ + 1
    return Attempt(problem, trail, error, followed.first)


def _early(problem: PathProblem, trail: Trail) -> bool:
    """Tell whether a path ended in the first part of the drive's range."""
    return not len(trail.points) or abs(trail.drive) < _EARLY * problem.span


def most_segments(trail: Trail) -> int:
    """Return how many segments a beam may be cut into: more where it is pulled and nothing but forces changes.

    A segment bears a tension N over a length of 3.7 sqrt(EI/N): a strip of L/t = 10 000 at a strain of 3 % needs 1600.
    """
    calm = not trail.events and not trail.points.unstable.any()
    return _MOST_PULLED if calm else MOST_SEGMENTS


def _further(problem: PathProblem, trail: Trail, before: Trail) -> bool:
    """Tell whether shorter segments lead any further: a path pulled straight is only followed nearer to its end."""
    from cfmkit.elastica.continuation.switch_to_uncondensed_solver import pulled_straight

    if not pulled_straight(trail) or not len(before.points) or trail.requested != before.requested:
        return True
    return abs(trail.drive - before.drive) > _GAIN * problem.span


def first_mesh(layout: Layout, tolerance: float) -> Mesh:
    """Return the mesh that is tried first for a tolerance: straight beams need fewer segments than curved ones.

    Coils need more steps than their loads do.
    """
    if tolerance >= 4e-6:
        mesh = Mesh(3 if tolerance < 2e-5 and layout.bundle.curved else 2, 1)
    else:
        mesh = Mesh(2, 2 if tolerance >= 1e-7 else 4)
    if not layout.bundle.others:  # coils are none of the plain beams
        return mesh
    return replace(mesh, steps=max(mesh.steps, ceil(layout.turn / (mesh.segments * _COILED))))


def largest_force(trail: Trail) -> FloatArray:
    """Return the largest dimensionless force or moment at the end of a beam at every point."""
    forces: FloatArray = np.abs(trail.points.y[:, trail.solver.n_free : trail.solver.n]).max(axis=1)
    return forces


def estimate(problem: PathProblem, trail: Trail) -> float:
    """Return the largest of `errors` at up to three points: middle, last, and where the forces are largest."""
    count = len(trail.points)
    if not count:
        return 0.0
    forces = largest_force(trail)
    hardest = int(forces.argmax())
    chosen = {count // 2, count - 1, hardest}
    if trail.pinned:  # at a bifurcation no mesh is near another
        chosen = {k for k in chosen if float(trail.points.drive[k]) not in trail.pinned} or {0}
    return max(errors(problem, trail, sorted(chosen), float(forces[hardest])))


def errors(problem: PathProblem, trail: Trail, indices: list[int], largest: float) -> list[float]:
    """Return the difference to a mesh of twice the steps at points: forces and positions, relative to the path.

    `largest` is the path's largest force. Infinite where the finer mesh has no equilibrium nearby.
    """
    tolerance = max(trail.solver.tolerance, 0.02 * problem.control.tolerance)
    fine, scale = trail.solver.finer(tolerance), max(1e-12, largest)
    ys, drives, far = trail.points.y[indices], trail.points.drive[indices], 0.1 * max(1.0, scale)
    found = []
    changes = fine.solve_each(ys, drives)[1].tolist()
    if max(change[1] for change in changes) > _NOISE * scale and largest < ROUNDING * stiffest(fine):
        scale = 1.0  # nothing bears a load: forces are errors themselves
    for k, (pose, force, most) in zip(indices, changes, strict=True):
        found.append(max(pose, force / scale) if most <= far else _across(trail, fine, k, scale, far))
    return found


def _across(trail: Trail, fine: Solver, index: int, scale: float, far: float) -> float:
    """Return the difference at a point that has no equilibrium nearby at its own drive: where the path turns back."""
    n, free, y, drive = trail.solver.n, trail.solver.n_free, trail.points.y[index], float(trail.points.drive[index])
    border = trail.spot(index).tangent
    across = fine.solve(y, drive, border, float(border[:-1] @ y[:n] + border[-1] * drive))
    if across is None:
        return np.inf
    change = np.abs(across.y - y)
    if change.max() > far:
        return np.inf
    poses, forces = change[:free].max(initial=0.0), change[free:n].max() / scale
    return float(max(poses, forces, abs(across.drive - drive)))
