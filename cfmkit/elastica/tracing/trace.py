"""Tracing: from a network and a drive to its path, on elements and with a degree that reach the tolerance."""

from __future__ import annotations

import math
from copy import copy
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.contact.path_items import ContactChange, Remeshed, StatesOfPiece, join_pieces
from cfmkit.elastica.mechanics.design_derivatives import Equilibria
from cfmkit.elastica.mechanics.discretise import Discretisation, FlankPlace, discretise, raise_degree, refine_state
from cfmkit.elastica.mechanics.equations import NaturalMarch
from cfmkit.elastica.mechanics.plain_networks import arrange
from cfmkit.elastica.mechanics.problem import DEGREES_MORE
from cfmkit.elastica.model.beam_fits import coils
from cfmkit.elastica.model.contact import BeamSide
from cfmkit.elastica.model.drive import Control, Loading
from cfmkit.elastica.results.path import ContactEvent, Event, Path, PathStatus
from cfmkit.elastica.tracing.accuracy import (
    CORRECTION_ERROR,
    drop_locked_points,
    find_tension,
    pick_points,
    point_errors,
    polish,
)
from cfmkit.elastica.tracing.imperfection import Buckling, bend
from cfmkit.elastica.tracing.start import DriveStart, find_start, follow_network, is_stretched
from cfmkit.numerics.continuation.events import relocate
from cfmkit.numerics.continuation.path import (
    MarchedSteps,
    Options,
    PathBranch,
    PathEvent,
    PathStop,
    Point,
    PointColumns,
    WhyStopped,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.problem import NetworkProblem
    from cfmkit.elastica.model.beam_fits import BeamFits
    from cfmkit.elastica.model.drive import Drive
    from cfmkit.elastica.model.network import Network
    from cfmkit.numerics.continuation.problem import PathEquilibrium

FIRST_STEP = 0.05  # share of the range, unless a requested value is nearer
FIRST_DEGREES = 5, 14  # with which a path is tried first, by its tolerance
DEGREE_OF_MODES = 16  # where the first mode of buckling is looked for
MAX_DEGREE = 20
DEGREE_OF_PIECES = 14  # where beams are cut
DEGREE_OF_LAYERS = 10  # at least, where taut ones are
MAX_PIECES = 4
MAX_ROUNDS = 8
FEW_BEAMS = {1: 4, 2: 2, 3: 2, 4: 2, 5: 2}  # degrees more to begin with
SLOWEST_FALL = 0.9  # of coefficients from one degree to the next that a forecast is made from
MAX_RAISED_ERROR, MAX_RAISED_MOTION = 1e-2, 0.05
"""Error of a path, and motion of its points, up to which it is raised to a higher degree as it is."""
NEAR_ERROR_FACTOR = 1e3  # tolerances of error up to which points may be at fault that Newton's method left too early
MAX_TENSION_ROUNDS = 4
EVENT_TOLERANCE = 1e-7  # of bifurcations on a primary path, share of the range
SAME_PLACE = 1e-9  # share of the range within which a point lies at a bifurcation
SAME_END = 1e-3  # share of the range within which two paths end alike
RIGID_MESSAGE = "the drive cannot move the network from rest: it is rigid, or nothing holds the network"


@dataclass(frozen=True)
class DegreeAndPieces:
    """Degree, elements a smooth piece, and beams under tension."""

    degree: int
    pieces: int = 1
    tension: Mapping[str, float] | None = None

    def arrays(
        self, network: Network, drive: Drive, fits: BeamFits | None = None, flanks: tuple[FlankPlace, ...] = ()
    ) -> Discretisation:
        """Return the arrays of a network, whose beams may be fitted already, and whose sides may touch at places."""
        if self.pieces == 1 and not (self.tension or flanks):
            return arrange(network, drive, self.degree, fits)
        return discretise(network, drive, self.degree, self.pieces, self.tension, fits=fits, flanks=flanks)


class TraceAttempt(NamedTuple):
    """A path on one discretisation."""

    path: Path
    resolution: DegreeAndPieces
    start: DriveStart
    first: Buckling | None  # first loss of stability
    events: tuple[PathEvent, ...]  # along the drive
    branches: tuple[PathBranch | None, ...]  # that the points are on


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
        bent, name = bend(network, drive, _find_first_buckling(network, drive, perfect), control.imperfection)
        path = trace(bent, drive, perfect)
        branch = path.branch if bent is network else np.where(path.branch == "primary", "imperfect", path.branch)
        return replace(path, imperfection=name, branch=read_only(branch, np.str_))
    attempt = _reach_tolerance(network, drive, control)
    path, tolerance = attempt.path, control.tolerance
    if is_stretched(path.mesh, path.at.z):
        nothing = trace_on(network, drive, control, attempt.resolution, limit=0).path
        return replace(nothing, events=(), status=PathStatus.NO_START, message=RIGID_MESSAGE)
    if path.error <= tolerance or not len(path):
        return path
    accurate = point_errors(path, range(len(path))) <= tolerance
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
    resolution, best, before = DegreeAndPieces(_find_first_degree(network, tolerance)), None, None
    attempt: TraceAttempt | None = None  # raised from the one before
    fits: BeamFits | None = None
    for count in range(MAX_ROUNDS):
        attempt = attempt or trace_on(network, drive, control, resolution, fits=fits)
        fits = attempt.path.mesh.fits
        path = attempt.path
        if is_stretched(path.mesh, path.at.z):
            return attempt
        # where a path locks against a contact forces grow beyond all bounds: no layer resolves that
        locks = bool(network.contacts) and path.status is PathStatus.LIMIT_POINT
        taut = find_tension(path.take(path.at_requested) if locks else path, resolution.tension or {})
        if taut and count < MAX_TENSION_ROUNDS:
            degree = max(_find_plain_degree(tolerance), DEGREE_OF_LAYERS)
            resolution = replace(resolution, tension={**(resolution.tension or {}), **taut}, degree=degree)
            best, attempt = attempt, None
            continue
        attempt = attempt if math.isfinite(attempt.path.error) else _estimate_error(attempt)
        nearly_reached = tolerance < attempt.path.error < NEAR_ERROR_FACTOR * tolerance
        is_raised = resolution.degree < MAX_DEGREE and _can_be_raised(attempt)  # which corrects all its points
        if nearly_reached and not is_raised:
            attempt = _estimate_error(attempt._replace(path=polish(path)))
        path = attempt.path
        if best is None or not path.error > max(best.path.error, tolerance):
            best = attempt
        reached = path.error <= tolerance and path.status in (PathStatus.COMPLETE, PathStatus.FULL)
        if reached and _are_settled(attempt, control, before):
            break
        if path.status is PathStatus.NO_START and count >= 2:
            break
        if before is not None and _end_alike(path, before):
            break
        before = path
        if resolution.degree < MAX_DEGREE:
            resolution = replace(resolution, degree=_find_next_degree(path, tolerance))
            attempt = raise_attempt(attempt, resolution, control)
        elif resolution.pieces < MAX_PIECES:
            resolution, attempt = replace(resolution, pieces=2 * resolution.pieces, degree=DEGREE_OF_PIECES), None
        else:
            break
    assert best is not None
    return best


def _find_first_degree(network: Network, tolerance: float) -> int:
    """Return the degree to begin with: a higher one costs little where there are few beams, which often buckle."""
    beams = len(network.beams)
    more = FEW_BEAMS[beams] if beams in FEW_BEAMS and not any(coils(beam) for beam in network.beams.values()) else 0
    return _find_plain_degree(tolerance) + more


def _find_plain_degree(tolerance: float) -> int:
    lowest, highest = FIRST_DEGREES
    return min(max(math.ceil(1 - math.log10(tolerance)), lowest), highest)


def _find_next_degree(path: Path, tolerance: float) -> int:
    """Return the degree with which a path should reach a tolerance.

    The error of forces falls as the square of the last coefficients of the rotation.
    """
    degree, e = path.mesh.degree, path.mesh.elements
    last = np.abs(path.at.z[:, e.unknowns[:, -6:-2]]).max(axis=(0, 1)) if len(path) else np.ones(4)
    fall = float(np.sqrt(last[2:].max() / max(last[:2].max(), 1e-300)))  # from one degree to the next
    if not (np.isfinite(path.error) and 0 < fall < 1):
        return min(MAX_DEGREE, degree + 4)
    more = np.log(path.error / tolerance) / (-2 * np.log(min(fall, SLOWEST_FALL)))
    return int(min(MAX_DEGREE, degree + np.clip(2 * np.ceil(0.5 * more), 2, 8)))


def raise_attempt(attempt: TraceAttempt, resolution: DegreeAndPieces, control: Control) -> TraceAttempt | None:
    """Return a path with a higher degree: its points and events are solved for from what they were.

    None if it is another path then.
    """
    path, start = attempt.path, attempt.start
    if not _can_be_raised(attempt):
        return None
    fine = raise_degree(path.mesh, resolution.degree)
    problem = replace(start.problem, mesh=fine)
    z = refine_state(path.mesh, fine, path.at.z)
    guess = z[:, fine.free]
    solved = problem.equations.solve_each(guess, path.at.drive)
    moved = np.abs(solved.free - guess)[:, problem.motions].max(initial=0.0)
    if not solved.converged.all() or (solved.unstable != path.unstable).any() or not moved < MAX_RAISED_MOTION:
        return None
    z[:, fine.free] = solved.free
    drives = _relocate_events(attempt, problem)
    if drives is None:
        return None
    relocated = list(zip(attempt.events, drives, strict=True))
    moved_to = {event.drive: drive for event, drive in relocated}
    branches = tuple(
        branch if branch is None else branch._replace(drive=moved_to.get(branch.drive, branch.drive))
        for branch in attempt.branches
    )
    unit = path.mesh.scales.drive
    reported = tuple(_convert_event(replace(event, drive=drive), unit) for event, drive in relocated)
    at, names = Equilibria(fine, z, path.at.drive), _name_branches(branches, unit)
    raised = replace(path, at=at, branch=names, events=reported, error=math.inf)
    lifted = tuple(_raise_event(event, drive, path.mesh, fine) for event, drive in relocated)
    started = start._replace(problem=problem)
    return attempt._replace(path=raised, resolution=resolution, start=started, branches=branches, events=lifted)


def _can_be_raised(attempt: TraceAttempt) -> bool:
    path = attempt.path
    complete = path.status is PathStatus.COMPLETE
    quiet = not attempt.start.events and not path.contact_events
    return complete and quiet and path.error < MAX_RAISED_ERROR and _measure_range(path.load_case) > 0


def _relocate_events(attempt: TraceAttempt, problem: NetworkProblem) -> list[float] | None:
    """Return the drives of the events of a path on a finer resolution, None if one of them is not there."""
    path, fine = attempt.path, problem.mesh
    span = _measure_range(path.load_case) / path.mesh.scales.drive
    lift = partial(_raise_unknowns, path.mesh, fine)
    drives = []
    for event in attempt.events:
        drive = relocate(problem, event, lift, span)
        if drive is None:
            return None
        drives.append(drive)
    return drives


def _raise_unknowns(mesh: Discretisation, fine: Discretisation, x: FloatArray) -> FloatArray:
    """Return free unknowns in those of a higher degree."""
    z = np.zeros(mesh.size)
    z[mesh.free] = x
    return np.asarray(refine_state(mesh, fine, z)[fine.free])


def _raise_event(event: PathEvent, drive: float, mesh: Discretisation, fine: Discretisation) -> PathEvent:
    def lift(at: PathEquilibrium | None) -> Any:
        if at is None:
            return None
        return at._replace(x=_raise_unknowns(mesh, fine, at.x), rate=_raise_unknowns(mesh, fine, at.rate))

    within = None if event.within is None else (lift(event.within[0]), lift(event.within[1]))
    return replace(event, drive=drive, nearest=lift(event.nearest), modes=None, within=within)


def _estimate_error(attempt: TraceAttempt) -> TraceAttempt:
    """Return an attempt whose path has its error estimated."""
    path = copy(attempt.path)  # with all that is known of it
    errors = point_errors(path, pick_points(path, _list_event_drives(attempt)))
    least = CORRECTION_ERROR * attempt.start.problem.next_correction
    object.__setattr__(path, "error", max(float(errors.max()), least) if len(errors) else 0.0)
    return attempt._replace(path=path)


def _list_event_drives(attempt: TraceAttempt) -> list[float]:
    unit = attempt.path.mesh.scales.drive
    return [*(event.drive * unit for event in attempt.events), *(event.drive for event in attempt.path.contact_events)]


def _end_alike(path: Path, before: Path) -> bool:
    """Return True if two paths end early at the same place: no degree leads further."""
    early = (PathStatus.LIMIT_POINT, PathStatus.BLOCKED, PathStatus.JUMPS, PathStatus.LOST, PathStatus.OUTSIDE)
    if path.status not in early or path.status is not before.status or not len(path) or not len(before):
        return False
    return bool(abs(path.drive[-1] - before.drive[-1]) < SAME_END * _measure_range(path.load_case))


def _find_first_buckling(network: Network, drive: Drive, control: Control) -> Buckling | None:
    """Return the first loss of stability on the primary path of a network."""
    primary = replace(control, branch="primary", through_folds=False)
    network = replace(network, contacts=())  # it is a property of the beams, not of what they may meet
    return trace_on(network, drive, primary, DegreeAndPieces(DEGREE_OF_MODES), first_only=True).first


def trace_on(
    network: Network,
    drive: Drive,
    control: Control,
    resolution: DegreeAndPieces,
    first_only: bool = False,
    limit: int | None = None,
    fits: BeamFits | None = None,
) -> TraceAttempt:
    """Return the path on one discretisation: with `first_only` up to the first loss of stability, or `limit` points."""
    arrays = resolution.arrays(network, drive, fits)
    sides = any(isinstance(contact, BeamSide) for contact in network.contacts)

    def remesh(flanks: tuple[FlankPlace, ...]) -> Discretisation:
        return resolution.arrays(network, drive, arrays.fits, flanks)

    start = find_start(arrays, control, remesh if sides else None)
    events, first, points = list[PathEvent](), start.first, list[Point | MarchedSteps]()
    meshes = [(0, start.problem.mesh)]  # number of the first point of each piece, and its arrays
    changes: dict[int, list[ContactChange]] = {}  # by the points they are at
    ending = PathStop(WhyStopped.LOST, 0.0)
    unit = arrays.scales.drive
    if start.at is not None and limit != 0 and not (first_only and first):
        options = _make_options(drive, control, unit)
        for item in follow_network(start.problem, start.at, drive.points / unit, options, start.branch):
            if isinstance(item, Point | MarchedSteps):
                points.append(item)
            elif isinstance(item, Remeshed):
                meshes.append((len(points), item.problem.mesh))
            elif isinstance(item, ContactChange):
                changes.setdefault(len(points) - 1, []).append(item)
                last: Any = points[-1]
                points[-1] = last._replace(at=last.at._replace(unstable=min(item.before, item.after)))
            elif isinstance(item, PathEvent):
                events.append(item)
                if first is None and item.modes is not None:
                    first = Buckling(start.problem, item, "")
                    if first_only:
                        break
            else:
                ending = item
    while ending.end is WhyStopped.COMPLETE and points and isinstance(points[-1], Point) and points[-1].target < 0:
        points.pop()
    status, message = _explain(start, ending, unit)
    columns = PointColumns.from_points(points)
    _settle_events(columns, events, drive, unit)
    reported = (*start.events, *(_convert_event(event, unit) for event in events if event.before != event.after))
    path = _make_path(network, drive, _collect_states(start, meshes, columns), columns, reported, status, message)
    if len(points) == 2 and not events and isinstance(points[1], NaturalMarch):  # one march from the start to the end
        vars(path)["error"] = max(points[1].error, CORRECTION_ERROR * start.problem.next_correction)
    if changes:
        touched = tuple(
            ContactEvent(item.kind, item.contact, item.at.drive * unit, item.before, item.after, item.states)
            for changes_at_point in changes.values()
            for item in changes_at_point
        )
        marked = read_only(np.isin(np.arange(len(path)), list(changes)), np.bool_)
        path = replace(path, contact_events=touched, at_contact=marked)
    path = drop_locked_points(path)
    return TraceAttempt(path, resolution, start, first, tuple(events), columns.branches[: len(path)])


def _make_options(drive: Drive, control: Control, unit: float) -> Options:
    targets = (drive.points / unit).tolist()
    span = max(*targets, 0.0) - min(*targets, 0.0)
    nearest = abs(targets[0]) / span or FIRST_STEP
    return Options(
        span, control.branch, control.sign, control.through_folds, control.largest_turn,
        first_step=control.first_step or min(FIRST_STEP, nearest), most_points=control.most_points,
    )  # fmt: skip


def _collect_states(start: DriveStart, meshes: list[tuple[int, Discretisation]], points: PointColumns) -> Equilibria:
    """Return the states of all points on one network of elements."""
    pieces = []
    ends = [first for first, _ in meshes[1:]] + [len(points.x)]
    for (first, arrays), end in zip(meshes, ends, strict=True):  # without contacts there is one
        drives = points.drive if len(meshes) == 1 else points.drive[first:end]
        z: Any = arrays.base + drives[:, None] * arrays.rate
        if len(drives):
            z[:, arrays.free] = np.concatenate(points.x[first:end])
        pieces.append(StatesOfPiece(arrays, z, drives))
    if len(pieces) == 1 or start.problem.remesh is None:
        return Equilibria(*pieces[0])
    drives = np.concatenate([piece.drive for piece in pieces])
    return Equilibria(*join_pieces([piece for piece in pieces if len(piece.drive)], start.problem.remesh), drives)


def _make_path(
    network: Network, drive: Drive, states: Equilibria, points: PointColumns, events: tuple[Event, ...],
    status: PathStatus, message: str,
) -> Path:  # fmt: skip
    path = Path(
        network, drive, states,
        unstable=read_only(points.unstable, np.int64), requested=read_only(points.target, np.int64),
        branch=_name_branches(points.branches, states.mesh.scales.drive),
        status=status, message=message, events=events, error=float("inf"),
        accurate=read_only(np.ones(len(points.drive), np.bool_), np.bool_),
    )  # fmt: skip
    # the solver has them already
    if not (isinstance(drive, Loading) or np.count_nonzero(~np.isfinite(points.effort))):
        vars(path)["effort"] = read_only(points.effort * (states.mesh.scales.moment / states.mesh.scales.drive))
    return path


def _convert_event(event: PathEvent, unit: float) -> Event:
    return Event(event.kind, event.drive * unit, event.before, event.after)


def _settle_events(points: PointColumns, events: list[PathEvent], drive: Drive, unit: float) -> None:
    """Let points at a bifurcation be as stable as the path is on the better side of it.

    There the number of unstable directions is rounding.
    """
    tolerance = SAME_PLACE * _measure_range(drive) / unit if events else 0.0
    for event in reversed(events):  # of several the first counts
        if event.kind == "bifurcation":
            points.unstable[np.abs(points.drive - event.drive) <= tolerance] = min(event.before, event.after)


def _name_branches(branches: Sequence[PathBranch | None], unit: float) -> Any:
    names = {branch: _name_branch(branch, unit) for branch in set(branches)}
    if len(names) == 1:
        return read_only(np.full(len(branches), next(iter(names.values()))), np.str_)
    return read_only([names[branch] for branch in branches], np.str_)


def _name_branch(branch: PathBranch | None, unit: float) -> str:
    if branch is None:
        return "primary"
    share = f"under {100 * branch.drive:.4g} % of the {branch.label}"
    where = share if branch.label else f"at {branch.drive * unit:.6g}"
    return f"bifurcated {where}, sign {branch.sign:+d}"


def _explain(start: DriveStart, ending: PathStop, unit: float) -> tuple[PathStatus, str]:
    """Return the status of a path, and why it ended."""
    if start.at is None:
        if start.stopped is None:
            return PathStatus.NO_START, RIGID_MESSAGE
        what, stop = start.stopped
        jumps = stop.end is WhyStopped.JUMPS
        if stop.end is WhyStopped.BLOCKED:
            return PathStatus.NO_START, stop.message.format(place=f"{stop.drive:.3g} of the {what}")
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


def _are_settled(attempt: TraceAttempt, control: Control, before: Path | None) -> bool:
    """Return True if limit points, and bifurcations of the primary path, lie where they do at a higher degree.

    The path itself says little about their error: a straight column has none, while its high modes have waves.
    """
    path = attempt.path
    folds = any(event.kind == "limit point" for event in attempt.events)
    if not attempt.events or not (folds or control.branch == "primary"):
        return True
    limit = max(EVENT_TOLERANCE, control.tolerance) * _measure_range(path.load_case)
    finer = raise_degree(path.mesh, path.mesh.degree + DEGREES_MORE)
    moves = finer.moving is not None  # then events are on other elements
    drives = None if moves else _relocate_events(attempt, replace(attempt.start.problem, mesh=finer))
    if drives is not None:
        places = np.array([event.drive for event in attempt.events])
        return bool(np.abs(places - drives).max() * path.mesh.scales.drive <= limit)
    if before is None or len(before.events) != len(path.events):
        return False
    shifts = [abs(event.drive - earlier.drive) for event, earlier in zip(path.events, before.events, strict=True)]
    return max(shifts) <= limit


def _measure_range(drive: Drive) -> float:
    points = drive.points
    return max(float(points.max()), 0.0) - min(float(points.min()), 0.0)
