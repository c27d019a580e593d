"""The equilibrium that a drive begins at, at rest or under constant loads applied by shares; the path from there."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.contact.path_items import ContactChange, Remeshed
from cfmkit.elastica.mechanics.discretise import Discretisation, FlankPlace, make_inextensible
from cfmkit.elastica.mechanics.numbering import number_free
from cfmkit.elastica.mechanics.problem import NetworkProblem
from cfmkit.elastica.results.path import Event
from cfmkit.elastica.tracing.imperfection import Buckling
from cfmkit.numerics.continuation.follow import each_point, follow_together
from cfmkit.numerics.continuation.path import Options, PathBranch, PathEvent, PathStop, Point, WhyStopped
from cfmkit.numerics.continuation.steps import correct

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.contact.path_items import PathItem
    from cfmkit.elastica.model.drive import Control
    from cfmkit.numerics.continuation.path import MarchedSteps
    from cfmkit.numerics.continuation.problem import PathEquilibrium

    Remesh = Callable[[tuple[FlankPlace, ...]], Discretisation]
    Change = Callable[[Discretisation], Discretisation]

FIRST_SHARE = 0.5  # of what is constant, in the first step
LOOSEST_CORRECTION, CORRECTION_SHARE = 1e-10, 1e-6
"""Next correction at which a march accepts an equilibrium: at most, and as a share of the path's tolerance."""
FLOOR_SHARE = 0.01
"""Part of the flexibility along a straight beam that its floor may bear: where it bears less, it is taken away."""
FLOOR_STRAIN = 1e-7  # of a beam that does not stretch, from which on the drive stretches it


class DriveStart(NamedTuple):
    """Start of a path."""

    problem: NetworkProblem  # along the drive
    at: PathEquilibrium | None  # None: nothing to begin at
    events: tuple[Event, ...]  # on the way; drives are shares of what is applied
    branch: PathBranch | None  # on which that is
    first: Buckling | None  # on the way
    stopped: tuple[str, PathStop] | None  # what could not be applied, and how the way to it ended


def find_start(mesh: Discretisation, control: Control, remesh: Remesh | None = None) -> DriveStart:
    """Return the equilibrium under what is constant, on a stable branch if there is one.

    Springs are tightened first and beams forced into place, then constant loads and displacements of supports are
    applied: of several stable states it is the one to which this way leads. `remesh` returns the arrays with other
    places at which sides of beams touch.
    """
    problem = NetworkProblem(mesh, next_correction=next_correction(control), remesh=remesh)
    events: list[Event] = []
    branch: PathBranch | None = None
    first: Buckling | None = None
    ramps = list(_list_ramps(mesh))
    at_rest = NetworkProblem(_remove_loads(mesh), ramp=True) if ramps else problem
    at = correct(at_rest, np.zeros(len(mesh.free)), 0.0)
    if at is None:
        return DriveStart(problem, None, (), None, None, None)
    flanks: tuple[FlankPlace, ...] = ()
    for what, change in ramps:
        ramp = _make_ramp(change, mesh if remesh is None or not flanks else remesh(flanks), remesh)
        options = Options(
            1.0, control.branch, control.sign, largest_motion=control.largest_turn, first_step=FIRST_SHARE
        )
        begin = correct(ramp, at.x, 0.0)
        if begin is None:
            return DriveStart(problem, None, tuple(events), branch, first, (what, PathStop(WhyStopped.LOST, 0.0)))
        for item in each_point(follow_network(ramp, begin, np.ones(1), options, branch)):
            if isinstance(item, ContactChange):
                continue
            if isinstance(item, Remeshed):
                touching = item.problem.mesh
                cuts = touching.elements.cuts
                flanks = tuple(
                    FlankPlace(contact.number, float(cuts[contact.element, 1]), contact.laid)
                    for contact in touching.contacts
                    if contact.slide >= 0
                )
                continue
            if isinstance(item, PathEvent):
                if control.branch != "primary" and item.before != item.after:  # nothing is lost on a path straight on
                    events.append(Event(f"{item.kind} under {what}", item.drive, item.before, item.after))
                if first is None and item.modes is not None:
                    first = Buckling(ramp, item, what)
            elif isinstance(item, Point):  # there are some behind the whole of it, on a branch that begins just before
                at, branch = (item.at, item.branch) if item.at.drive <= 1.0 else (at, branch)
            elif item.end is not WhyStopped.COMPLETE:
                return DriveStart(problem, None, tuple(events), branch, first, (what, item))
        if branch is not None and not branch.label:
            branch = branch._replace(label=what)
    # just at a bifurcation Newton's method fails where the way there has led
    if flanks and remesh is not None:
        problem = replace(problem, mesh=remesh(flanks))
    if ramps:
        at = correct(problem, at.x, 0.0) or at._replace(drive=0.0, rate=np.zeros_like(at.x), effort=np.nan)
    problem, at = _remove_floors(problem, at)
    if not ramps:  # at rest nothing bears anything: forces that Newton's method leaves there are rounding
        at = at._replace(x=np.zeros(len(at.x)), effort=0.0)
    return DriveStart(problem, at, tuple(events), branch, first, None)


def next_correction(control: Control) -> float:
    """Return the next correction at which a march accepts an equilibrium."""
    return min(LOOSEST_CORRECTION, CORRECTION_SHARE * control.tolerance)


def _list_ramps(mesh: Discretisation) -> Iterator[tuple[str, tuple[Change, bool]]]:
    """Yield what is constant, in the order in which it is applied, and how the arrays are along the share of it.

    The second of these says whether the share, not the drive, is the way.
    """
    if any(is_tight(spring.item) for spring in mesh.springs) or np.count_nonzero(mesh.elements.gap):
        yield "prestress", (_remove_loads, True)
    fixed = any(not load.grows for load in mesh.loads) or np.count_nonzero(mesh.base)
    if fixed or np.count_nonzero(mesh.elements.line[:, 0]):
        yield "constant loads", (_convert_loads_to_drive, False)


def is_tight(spring: Any) -> bool:
    """Return True if a spring may bear a force before any load; a line spring may have a free length of zero."""
    if getattr(spring, "free_length", None) is not None:
        return True
    return bool(getattr(spring, "free_angle", 0.0) or getattr(spring, "free_displacement", 0.0))


def _make_ramp(change: tuple[Change, bool], mesh: Discretisation, remesh: Remesh | None) -> NetworkProblem:
    """Return the problem whose way applies what is constant (`_list_ramps`), prestress or loads, from none to all."""
    alter, ramp = change
    remesh_altered = None if remesh is None else (lambda flanks: alter(remesh(flanks)))
    return NetworkProblem(alter(mesh), ramp=ramp, remesh=remesh_altered)


def _remove_loads(mesh: Discretisation) -> Discretisation:
    """Return the network with its supports at rest and no loads."""
    elements = mesh.elements._replace(line=np.zeros_like(mesh.elements.line))
    return replace(mesh, loads=(), elements=elements, base=np.zeros(mesh.size), rate=np.zeros(mesh.size))


def _convert_loads_to_drive(mesh: Discretisation) -> Discretisation:
    """Return the network with constant loads and displacements of supports as what grows with the drive."""
    line = mesh.elements.line
    grown = np.stack([np.zeros_like(line[:, 0]), line[:, 0]], axis=1)
    loads = tuple(load._replace(grows=True) for load in mesh.loads if not load.grows)
    return replace(
        mesh, loads=loads, elements=mesh.elements._replace(line=grown), scales=mesh.scales._replace(drive=1.0),
        rate=mesh.base, base=np.zeros(mesh.size),
    )  # fmt: skip


def _remove_floors(problem: NetworkProblem, at: PathEquilibrium) -> tuple[NetworkProblem, PathEquilibrium]:
    """Return the problem without the floors of flexibility that bear nothing, and its equilibrium.

    Left in, nearly rigid networks of thin straight beams have errors of 1e-5 and more.
    """
    mesh = problem.mesh
    if not np.count_nonzero(mesh.floored):
        return problem, at
    elements = np.flatnonzero(mesh.floored)
    rows = number_free(mesh.free, mesh.size)[mesh.elements.unknowns[elements, -2:]]
    unit = np.zeros((rows.size, len(mesh.free)))
    unit[np.arange(rows.size), rows.ravel()] = 1.0
    try:
        inverse, _ = problem.equations.resolve(at.x, at.drive, unit)
    except np.linalg.LinAlgError:
        return problem, at
    share = np.abs(inverse[np.arange(rows.size), rows.ravel()]).reshape(rows.shape).max(axis=1)
    share *= mesh.elements.axial[elements].max(axis=1) * mesh.elements.length[elements]
    needless = elements[share < FLOOR_SHARE]
    if not needless.size:
        return problem, at
    stiff = replace(problem, mesh=make_inextensible(mesh, needless))
    if problem.remesh is not None:
        beams, remesh = {mesh.elements.beam[number] for number in needless.tolist()}, problem.remesh

        def remesh_stiff(flanks: tuple[FlankPlace, ...]) -> Discretisation:
            arrays = remesh(flanks)
            return make_inextensible(arrays, [k for k, name in enumerate(arrays.elements.beam) if name in beams])

        stiff = replace(stiff, remesh=remesh_stiff)
    return stiff, correct(stiff, at.x, at.drive) or at


def is_stretched(mesh: Discretisation, z: np.ndarray) -> bool:
    """Return True if a beam that does not stretch was stretched through its floor at any of k states, (k, size)."""
    if not len(z) or not np.count_nonzero(mesh.floored):
        return False
    elements = np.flatnonzero(mesh.floored)
    force = np.abs(z[:, mesh.elements.unknowns[elements][:, -2:]]).max(axis=(0, 2))
    return bool((force * mesh.axial[elements].max(axis=1) > FLOOR_STRAIN).any())


def follow_network(
    problem: NetworkProblem,
    start: PathEquilibrium,
    targets: FloatArray,
    options: Options,
    branch: PathBranch | None = None,
) -> Iterator[PathItem | MarchedSteps]:
    """Yield points, events and changes of contacts of a path in order, and its ending at last; see `follow_together`.

    Every change comes behind a point that lies at it.
    """
    if not problem.mesh.fits.network.contacts:
        return follow_together(problem, start, targets, options, branch)
    from cfmkit.elastica.contact.follow import follow_in_contact

    return follow_in_contact(problem, start, targets, options, branch)
