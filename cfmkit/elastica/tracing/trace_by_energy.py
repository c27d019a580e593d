"""Tracing: from a network and a drive to its equilibria, with a degree that reaches the tolerance."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.mechanics.discretise import TAUT, Discretisation, discretise, without_floor
from cfmkit.elastica.model.drive import Control
from cfmkit.elastica.outcome.path import Event, PathStatus
from cfmkit.elastica.tracing.error_estimate import DEGREES_MORE, estimate_error
from cfmkit.elastica.tracing.imperfection import Buckling, bend
from cfmkit.elastica.tracing.record import TracedPath
from cfmkit.elastica.tracing.start import Start, find_start, is_stretched
from cfmkit.numerics.continuation.follow import follow
from cfmkit.numerics.continuation.path import End, Ending, Options, Point
from cfmkit.numerics.continuation.path import Event as FoundEvent

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.elastica.model.drive import Drive
    from cfmkit.elastica.model.network import Network

FIRST_STEP = 0.05  # share of the range, unless a requested value is nearer
DEGREES = 5, 14  # with which a path is tried first, by its tolerance
MORE_FOR_FOLDS = 2  # degrees
DEGREE_OF_MODES = 16  # where the first mode of buckling is looked for
MAX_DEGREE = 20
DEGREE_OF_PIECES = 14  # where beams are cut
MAX_PIECES = 4
MAX_ROUNDS = 6
FAR_OFF = 1e2  # tolerances of error from which on the degree is raised by four at once
MAX_TENSION_ROUNDS = 4
MORE_TENSION = 1.5  # times what is known, from which on layers are cut anew
TENSION_FROM = 8.0  # L sqrt(N/EI) of an element
EVENT_TOLERANCE = 1e-7  # of bifurcations on a primary path, share of the range
SAME_END = 1e-3  # share of the range within which two paths end alike
WHOLE = 0.15  # share of a beam from which on a taut element is cut again


@dataclass(frozen=True)
class Mesh:
    """Degree, elements a smooth piece, and beams under tension."""

    degree: int
    pieces: int = 1
    tension: Mapping[str, float] | None = None

    def arrays(self, network: Network, drive: Drive, more: int = 0) -> Discretisation:
        """Return the arrays of a network, with a higher degree by `more`."""
        return discretise(network, drive, self.degree + more, self.pieces, self.tension)


def trace(network: Network, drive: Drive, control: Control | None = None) -> TracedPath:
    """Return the path of equilibria of a network under a drive, from rest through all requested points."""
    control = control or Control()
    if control.imperfection:
        perfect = replace(control, imperfection=0.0)
        bent, name = bend(network, drive, _first_buckling(network, drive, perfect), control.imperfection)
        return replace(trace(bent, drive, perfect), imperfection=name)
    degree = int(np.clip(np.ceil(1 - np.log10(control.tolerance)), *DEGREES)) + MORE_FOR_FOLDS * control.through_folds
    mesh, best, ended = Mesh(degree), None, None
    before: TracedPath | None = None
    for attempt in range(MAX_ROUNDS):
        path = trace_on(network, drive, control, mesh)
        if is_stretched(path.problem.network, path.z):
            text = "the drive cannot move the network from rest: it is rigid, or nothing holds the network"
            return replace(path, points=(), events=(), status=PathStatus.NO_START, message=text)
        taut = _tension(path, mesh.tension or {})
        if taut and attempt < MAX_TENSION_ROUNDS:
            mesh = replace(mesh, tension={**(mesh.tension or {}), **taut}, degree=max(mesh.degree, 10))
            best = path
            continue
        path = replace(path, error=estimate_error(path, _finer(network, drive, mesh, path)))
        if best is None or not path.error > best.error:
            best = path
        settled, before = _are_settled(path, before, control), path
        if path.error <= control.tolerance and settled and path.status not in (PathStatus.LOST, PathStatus.NO_START):
            break
        if path.status is PathStatus.NO_START and attempt >= 2:
            break
        end = float(path.drive[-1]) if len(path) else None
        early = path.status in (PathStatus.LIMIT_POINT, PathStatus.JUMPS, PathStatus.LOST)
        if early and end is not None and ended is not None and abs(end - ended) < SAME_END * _span(path):
            break
        ended = end
        if mesh.degree < MAX_DEGREE:
            more = 4 if path.error > FAR_OFF * control.tolerance else 2
            mesh = replace(mesh, degree=min(MAX_DEGREE, mesh.degree + more))
        elif mesh.pieces < MAX_PIECES:
            mesh = replace(mesh, pieces=2 * mesh.pieces, degree=DEGREE_OF_PIECES)
        else:
            break
    assert best is not None
    if best.status is PathStatus.COMPLETE and not best.error <= control.tolerance:
        text = f"the tolerance of {control.tolerance:.3g} was not reached: error {best.error:.3g}"
        best = replace(best, status=PathStatus.INACCURATE, message=text)
    return best


def _first_buckling(network: Network, drive: Drive, control: Control) -> Buckling | None:
    """Return the first loss of stability on the primary path of a network."""
    path = trace_on(network, drive, replace(control, branch="primary", through_folds=False), Mesh(DEGREE_OF_MODES))
    return path.first


def trace_on(network: Network, drive: Drive, control: Control, mesh: Mesh) -> TracedPath:
    """Return the path on one discretisation."""
    arrays = mesh.arrays(network, drive)
    start = find_start(arrays, control)
    events: list[Event] = list(start.events)
    first = start.first
    if start.at is None:
        text = "no equilibrium to start from"
        if start.stopped:
            what, stop = start.stopped
            text = f"no equilibrium beyond {100 * stop.drive:.3g} % of the {what}: {stop.message}"
        return TracedPath(network, drive, start.problem, (), start.events, _start_status(start), text)
    unit = arrays.scales.drive
    targets = drive.points / unit
    span = float(np.ptp(np.append(targets, 0.0)))
    step = control.first_step or (min(FIRST_STEP, abs(float(targets[0])) / span) if targets[0] else FIRST_STEP)
    options = Options(
        span, control.branch, control.sign, control.through_folds, control.largest_turn, first_step=step,
        most_points=control.most_points,
    )  # fmt: skip
    points: list[Point] = []
    ending = Ending(End.LOST, 0.0)
    for item in follow(start.problem, start.at, targets, options):
        if isinstance(item, Point):
            points.append(item)
        elif isinstance(item, FoundEvent):
            events.append(Event(item.kind, item.drive * unit, item.before, item.after))
            if first is None and item.modes is not None:
                first = Buckling(start.problem, item, "")
        else:
            ending = item
    status = PathStatus[ending.end.name]
    text = status.value if ending.end is End.COMPLETE else f"{ending.message} at {ending.drive * unit:.6g}"
    return TracedPath(network, drive, start.problem, tuple(points), tuple(events), status, text, first)


def _start_status(start: Start) -> PathStatus:
    jumps = start.stopped is not None and start.stopped[1].end is End.JUMPS
    return PathStatus.JUMPS if jumps else PathStatus.NO_START


def _finer(network: Network, drive: Drive, mesh: Mesh, path: TracedPath) -> Discretisation:
    """Return the arrays of a higher degree, with the same floors."""
    finer = mesh.arrays(network, drive, DEGREES_MORE)
    return without_floor(finer, np.flatnonzero(finer.floored & ~path.problem.network.floored))


def _are_settled(path: TracedPath, before: TracedPath | None, control: Control) -> bool:
    """Return True if bifurcations far along the primary path lie where they do at another degree.

    The path itself says nothing about their error: a straight column has none, while its high modes have waves.
    """
    places = [event.drive for event in path.events]
    if control.branch != "primary" or not places:
        return True
    if before is None or len(before.events) != len(places):
        return False
    shift = np.abs(np.array(places) - [event.drive for event in before.events]).max()
    return bool(shift <= max(EVENT_TOLERANCE, control.tolerance) * _span(path))


def _span(path: TracedPath) -> float:
    return float(np.ptp(np.append(path.load.points, 0.0)))


def _tension(path: TracedPath, known: Mapping[str, float]) -> dict[str, float]:
    """Return the beams whose elements are taut to their largest L sqrt(N/EI), if more than is known."""
    network = path.problem.network
    e = network.elements
    if not len(path):
        return {}
    force = np.abs(path.z[:, e.unknowns[:, -2:]]).max(axis=(0, 2))
    bending = (e.rigidity * e.weight).sum(axis=1) * e.length
    tautness = np.sqrt(force / bending) * e.length
    whole: dict[str, float] = {}
    for beam, length in zip(e.beam, e.length, strict=True):
        whole[beam] = whole.get(beam, 0.0) + length
    found: dict[str, float] = {}
    for beam, value, length, (left, right) in zip(e.beam, tautness, e.length, e.cuts, strict=True):
        if value > max(TAUT, TENSION_FROM) and right - left > WHOLE:
            found[beam] = max(found.get(beam, 0.0), float(value / length * whole[beam]))
    return {beam: value for beam, value in found.items() if value > MORE_TENSION * known.get(beam, 0.0)}
