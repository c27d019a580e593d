"""Tracing: from a network and a drive to its equilibria, with a degree that reaches the tolerance."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.mechanics.design_derivatives import Equilibria
from cfmkit.elastica.mechanics.discretise import TAUT, Discretisation, discretise, without_floor
from cfmkit.elastica.mechanics.refine import has_polynomial_tables, raise_degree
from cfmkit.elastica.model.drive import Control
from cfmkit.elastica.results.path import Event, Path, PathStatus
from cfmkit.elastica.tracing.error_estimate import DEGREES_MORE, pick_points, point_errors, polish
from cfmkit.elastica.tracing.imperfection import Buckling, bend
from cfmkit.elastica.tracing.start import DriveStart, find_start, is_stretched
from cfmkit.numerics.continuation.follow import follow
from cfmkit.numerics.continuation.path import Options, PathBranch, PathEvent, PathStop, Point, WhyStopped

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.elastica.model.drive import Drive
    from cfmkit.elastica.model.network import Network

FIRST_STEP = 0.05  # share of the range, unless a requested value is nearer
DEGREES = 5, 14  # with which a path is tried first, by its tolerance
DEGREE_OF_MODES = 16  # where the first mode of buckling is looked for
MAX_DEGREE = 20
DEGREE_OF_PIECES = 14  # where beams are cut
MAX_PIECES = 4
MAX_ROUNDS = 6
FAR_OFF = 1e2  # tolerances of error from which on the degree is raised by four at once
NEARLY = 1e3  # tolerances of error up to which points may be at fault that Newton's method left too early
MAX_TENSION_ROUNDS = 4
MORE_TENSION = 1.5  # times what is known, from which on layers are cut anew
MAX_TENSION = 1e4  # L sqrt(N/EI) of a beam that is not cut: it locks
WHOLE = 0.15  # share of a beam from which on a taut element is cut again
EVENT_TOLERANCE = 1e-7  # of bifurcations on a primary path, share of the range
SAME_END = 1e-3  # share of the range within which two paths end alike
RIGID = "the drive cannot move the network from rest: it is rigid, or nothing holds the network"


@dataclass(frozen=True)
class DegreeAndPieces:
    """Degree, elements a smooth piece, and beams under tension."""

    degree: int
    pieces: int = 1
    tension: Mapping[str, float] | None = None

    def arrays(self, network: Network, drive: Drive, more: int = 0) -> Discretisation:
        """Return the arrays of a network, with a higher degree by `more`."""
        return discretise(network, drive, self.degree + more, self.pieces, self.tension)

    def finer(self, path: Path) -> Discretisation:
        """Return the arrays of a higher degree by which errors are estimated, with the same floors."""
        if has_polynomial_tables(path.net):
            return raise_degree(path.network, path.network.degree + DEGREES_MORE)
        fine = self.arrays(path.net, path.given, DEGREES_MORE)
        return without_floor(fine, np.flatnonzero(fine.floored & ~path.network.floored))


class TraceAttempt(NamedTuple):
    """A path on one discretisation."""

    path: Path
    mesh: DegreeAndPieces
    first: Buckling | None  # first loss of stability


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
    if control.imperfection:
        perfect = replace(control, imperfection=0.0)
        bent, name = bend(network, drive, _first_buckling(network, drive, perfect), control.imperfection)
        path = trace(bent, drive, perfect)
        branch = path.branch if bent is network else np.where(path.branch == "primary", "imperfect", path.branch)
        return replace(path, imperfection=name, branch=read_only(branch, np.str_))
    attempt = _reach_tolerance(network, drive, control)
    path, tolerance = attempt.path, control.tolerance
    if is_stretched(path.network, path.at.z):
        nothing = trace_on(network, drive, control, attempt.mesh, limit=0).path
        return replace(nothing, events=(), status=PathStatus.NO_START, message=RIGID)
    if path.error <= tolerance or not len(path):
        return path
    accurate = point_errors(path, attempt.mesh.finer(path), range(len(path))) <= tolerance
    text = f"the tolerance of {tolerance:.3g} was not reached: error {path.error:.3g}, "
    text += f"{(~accurate).sum()} of {len(path)} points"
    complete = path.status is PathStatus.COMPLETE
    return replace(
        path, accurate=read_only(accurate, np.bool_), status=PathStatus.INACCURATE if complete else path.status,
        message=text if complete else f"{path.message}; {text}",
    )  # fmt: skip


def _reach_tolerance(network: Network, drive: Drive, control: Control) -> TraceAttempt:
    """Return the path on the first discretisation that reaches the tolerance, or on the best that is tried."""
    tolerance = control.tolerance
    degree = int(np.clip(np.ceil(1 - np.log10(tolerance)), *DEGREES))
    mesh, best, before = DegreeAndPieces(degree), None, None
    for count in range(MAX_ROUNDS):
        attempt = trace_on(network, drive, control, mesh)
        path = attempt.path
        if is_stretched(path.network, path.at.z):
            return attempt
        taut = _tension(path, mesh.tension or {})
        if taut and count < MAX_TENSION_ROUNDS:
            mesh = replace(mesh, tension={**(mesh.tension or {}), **taut}, degree=max(mesh.degree, 10))
            best = attempt
            continue
        path = _with_error(path, mesh)
        if tolerance < path.error < NEARLY * tolerance:
            path = _with_error(polish(path), mesh)
        attempt = attempt._replace(path=path)
        if best is None or not path.error > max(best.path.error, tolerance):
            best = attempt
        settled = _are_settled(path, before, control)
        if path.error <= tolerance and settled and path.status in (PathStatus.COMPLETE, PathStatus.FULL):
            break
        if path.status is PathStatus.NO_START and count >= 2:
            break
        if before is not None and _end_alike(path, before):
            break
        before = path
        if mesh.degree < MAX_DEGREE:
            mesh = replace(mesh, degree=min(MAX_DEGREE, mesh.degree + (4 if path.error > FAR_OFF * tolerance else 2)))
        elif mesh.pieces < MAX_PIECES:
            mesh = replace(mesh, pieces=2 * mesh.pieces, degree=DEGREE_OF_PIECES)
        else:
            break
    assert best is not None
    return best


def _with_error(path: Path, mesh: DegreeAndPieces) -> Path:
    errors = point_errors(path, mesh.finer(path), pick_points(path))
    return replace(path, error=float(errors.max(initial=0.0)))


def _end_alike(path: Path, before: Path) -> bool:
    """Return True if two paths end early at the same place: no degree leads further."""
    early = (PathStatus.LIMIT_POINT, PathStatus.JUMPS, PathStatus.LOST, PathStatus.OUTSIDE)
    if path.status not in early or path.status is not before.status or not len(path) or not len(before):
        return False
    return bool(abs(path.drive[-1] - before.drive[-1]) < SAME_END * _span(path))


def _first_buckling(network: Network, drive: Drive, control: Control) -> Buckling | None:
    """Return the first loss of stability on the primary path of a network."""
    primary = replace(control, branch="primary", through_folds=False)
    return trace_on(network, drive, primary, DegreeAndPieces(DEGREE_OF_MODES), first_only=True).first


def trace_on(
    network: Network,
    drive: Drive,
    control: Control,
    mesh: DegreeAndPieces,
    first_only: bool = False,
    limit: int | None = None,
) -> TraceAttempt:
    """Return the path on one discretisation: with `first_only` up to the first loss of stability, or `limit` points."""
    arrays = mesh.arrays(network, drive)
    start = find_start(arrays, control)
    events, first, points = [*start.events], start.first, list[Point]()
    ending = PathStop(WhyStopped.LOST, 0.0)
    unit = arrays.scales.drive
    if start.at is not None and limit != 0 and not (first_only and first):
        for item in follow(start.problem, start.at, drive.points / unit, _options(drive, control, unit), start.branch):
            if isinstance(item, Point):
                points.append(item)
            elif isinstance(item, PathEvent):
                events.append(Event(item.kind, item.drive * unit, item.before, item.after))
                if first is None and item.modes is not None:
                    first = Buckling(start.problem, item, "")
                    if first_only:
                        break
            else:
                ending = item
    while ending.end is WhyStopped.COMPLETE and points and points[-1].target < 0:
        points.pop()
    status, message = _explain(start, ending, unit)
    return TraceAttempt(_path(network, drive, start, points, tuple(events), status, message), mesh, first)


def _options(drive: Drive, control: Control, unit: float) -> Options:
    targets = drive.points / unit
    span = float(np.ptp(np.append(targets, 0.0)))
    nearest = abs(float(targets[0])) / span or FIRST_STEP
    return Options(
        span, control.branch, control.sign, control.through_folds, control.largest_turn,
        first_step=control.first_step or min(FIRST_STEP, nearest), most_points=control.most_points,
    )  # fmt: skip


def _path(
    network: Network, drive: Drive, start: DriveStart, points: list[Point], events: tuple[Event, ...],
    status: PathStatus, message: str,
) -> Path:  # fmt: skip
    arrays = start.problem.network
    drives = np.array([point.at.drive for point in points])
    z: Any = arrays.base + drives[:, None] * arrays.rate
    z[:, arrays.free] = np.array([point.at.x for point in points]).reshape(len(points), len(arrays.free))
    names = [_name_branch(point.branch, arrays.scales.drive) for point in points]
    return Path(
        network, drive, Equilibria(arrays, z, drives),
        unstable=read_only(np.array([point.at.unstable for point in points]), np.int64),
        requested=read_only(np.array([point.target for point in points]), np.int64),
        branch=read_only(np.array(names, np.str_), np.str_),
        status=status, message=message, events=events, error=float("inf"),
        accurate=read_only(np.ones(len(points)), np.bool_),
    )  # fmt: skip


def _name_branch(branch: PathBranch | None, unit: float) -> str:
    if branch is None:
        return "primary"
    where = (
        f"under {100 * branch.drive:.4g} % of the {branch.label}" if branch.label else f"at {branch.drive * unit:.6g}"
    )
    return f"bifurcated {where}, sign {branch.sign:+d}"


def _explain(start: DriveStart, ending: PathStop, unit: float) -> tuple[PathStatus, str]:
    """Return the status of a path, and why it ended."""
    if start.at is None:
        if start.stopped is None:
            return PathStatus.NO_START, RIGID
        what, stop = start.stopped
        jumps = stop.end is WhyStopped.JUMPS
        if jumps:
            return PathStatus.JUMPS, f"stability is lost under {100 * stop.drive:.3g} % of the {what}"
        text = f"no equilibrium to start from: lost at {stop.drive:.3g} of the constant loads and displacements; "
        text += "or nothing holds the network, the drive cannot move it, or its springs are prestressed too far"
        return PathStatus.NO_START, text
    status = PathStatus[ending.end.name]
    text = (
        status.value if ending.end is WhyStopped.COMPLETE else ending.message.format(place=f"{ending.drive * unit:.6g}")
    )
    return status, text


def _are_settled(path: Path, before: Path | None, control: Control) -> bool:
    """Return True if limit points, and bifurcations of the primary path, lie where they do at another degree.

    The path itself says little about their error: a straight column has none, while its high modes have waves.
    """
    places = [event.drive for event in path.events]
    folds = any(event.kind == "limit point" for event in path.events)
    if not places or not (folds or control.branch == "primary"):
        return True
    if before is None or len(before.events) != len(places):
        return False
    shift = np.abs(np.array(places) - [event.drive for event in before.events]).max()
    return bool(shift <= max(EVENT_TOLERANCE, control.tolerance) * _span(path))


def _span(path: Path) -> float:
    return float(np.ptp(np.append(path.given.points, 0.0)))


def _tension(path: Path, known: Mapping[str, float]) -> dict[str, float]:
    """Return the beams whose elements are taut to their largest L sqrt(N/EI), if more than is known."""
    e = path.network.elements
    if not len(path):
        return {}
    force = np.abs(path.at.z[:, e.unknowns[:, -2:]]).max(axis=(0, 2))
    bending = (e.rigidity * e.weight).sum(axis=1) * e.length
    tautness = np.sqrt(force / bending) * e.length
    whole: dict[str, float] = {}
    for beam, length in zip(e.beam, e.length, strict=True):
        whole[beam] = whole.get(beam, 0.0) + length
    found: dict[str, float] = {}
    for beam, value, length, (left, right) in zip(e.beam, tautness, e.length, e.cuts, strict=True):
        if value > TAUT and right - left > WHOLE:
            found[beam] = max(found.get(beam, 0.0), float(value / length * whole[beam]))
    return {beam: value for beam, value in found.items() if MORE_TENSION * known.get(beam, 0.0) < value < MAX_TENSION}
