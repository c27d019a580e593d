"""Where contacts of the sides of beams begin, end, move from and to the ends of beams, part and join.

Each change is located by its own equations: a contact that begins has no force and no gap; one that moves from the end
of a beam into it, or back, is tangent there; one that parts has a gap whose curvature vanishes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cfmkit.elastica.contact.changes import ContactChange, PieceOfPath, StepBetween
from cfmkit.elastica.contact.side_conditions import NEW_PLACE
from cfmkit.elastica.contact.side_gaps import Stage
from cfmkit.elastica.mechanics.discretise import FlankPlace
from cfmkit.elastica.model.contact import NodeOnObstacle
from cfmkit.numerics.continuation.path import PathStop, WhyStopped

if TYPE_CHECKING:
    from cfmkit.elastica.contact.side_conditions import SideCondition
    from cfmkit.numerics.continuation.problem import PathEquilibrium

BESIDE = 0.05  # of a step, by which a located change may lie beside it
N_SECANTS, EXACT = 12, 1e-13
RATE_STEP = 1e-6  # motion by which rates of conditions are differentiated
REACHES = "the contact of {names} reaches {mark} at {{place}}, which it cannot pass"
PINCHES = "two contacts of beam {beam!r} meet at {{place}}"
NO_WAY = "no equilibrium was found behind the change of the contact of {names} at {{place}}"


def locate_side_change(piece: PieceOfPath, step: StepBetween, row: int) -> ContactChange | PathStop | None:
    """Return where a condition on a side is first violated within a step; None if that is not found."""
    condition = piece.sides.all[row - len(piece.whole.mesh.contacts)]
    unstable = step.first.unstable
    if condition.kind == "touch":
        return _locate_touch(piece, step, row, condition)
    at = step.bisect(row)
    if at is None:
        return None
    if condition.kind == "pinch":
        return PathStop(WhyStopped.LOST, at.drive, PINCHES.format(beam=condition.item.beam))
    contact = condition.number if condition.kind != "tangent" else _side_number(piece, condition)
    number = contact if condition.kind == "tangent" else piece.whole.mesh.contacts[condition.number].number
    if condition.kind in ("tangent", "spreads"):
        kind: Literal["moves", "spreads"] = "moves" if condition.kind == "tangent" else "spreads"
        return ContactChange(kind, condition.number, at, unstable, unstable, number, condition)
    if condition.kind == "end":
        beyond = _onto_node(piece, condition)
        if beyond is None:
            return PathStop(WhyStopped.LOST, at.drive, REACHES.format(
                names=piece.say(condition.number), mark=_mark(piece, condition)))  # fmt: skip
        begin, wanted = _with_force(piece, at, beyond, condition.number), ("tangent", condition.last)
    else:
        beyond = _joined(piece, condition, at)
        begin, wanted = _with_force(piece, at, beyond, condition.number, condition.number + 1), ("spreads", False)
    exact = _zero_of(beyond, begin, _find(beyond, condition, wanted))
    if exact is None:
        return None
    kind_of: Literal["moves", "closes"] = "moves" if condition.kind == "end" else "closes"
    return ContactChange(kind_of, condition.number, exact, unstable, unstable, number, condition, beyond)


def _side_number(piece: PieceOfPath, condition: SideCondition) -> int:
    return next(k for k, item in enumerate(piece.whole.mesh.fits.network.contacts) if item is condition.item)


def _mark(piece: PieceOfPath, condition: SideCondition) -> str:
    """Return what a contact has come to."""
    beam = piece.whole.mesh.fits.network.beams[condition.item.beam]
    if condition.mark in (0.0, 1.0):
        return f"node {beam.end if condition.last else beam.start!r}"
    return f"a corner or a step of the beam at {condition.mark:.3g} of it"


def _locate_touch(piece: PieceOfPath, step: StepBetween, row: int, condition: SideCondition) -> ContactChange | None:
    """Return where a side begins to touch."""
    share = step.crossing(row)
    if share is None:
        return None
    x, drive = step.at(share)
    guess = step.first._replace(x=x, drive=float(drive))
    for _ in range(2):
        stage = Stage.of(piece.whole, np.array([guess.drive]))
        least = piece.sides.gaps_of(condition.item).find_least(piece.whole.values(guess.x, guess.drive), stage)
        if 0.5 * NEW_PLACE < least.parameter < 1 - 0.5 * NEW_PLACE:
            flanks = [*piece.flanks, FlankPlace(condition.number, least.parameter)]
            beyond = piece.with_flanks(flanks, piece.closed)
            near = beyond.shrink(piece.carry(guess, beyond))
            number = _new_side(piece, beyond, condition.number, least.parameter)
            border = np.zeros(len(near.x) + 1)
            border[beyond.slot_in_own(number)] = 1.0
            state = beyond.own.equations.solve(near.x, near.drive, border, 0.0)
            if state is not None and np.isfinite(state.rate).all():
                at = beyond.grow(near._replace(x=state.free, drive=float(state.way), rate=state.rate))
                back = beyond.carry(at, piece)
                if -BESIDE <= step.share_of(back) <= 1 + BESIDE:
                    return ContactChange("begins", number, at, step.first.unstable, step.first.unstable,
                                         condition.number, condition, beyond)  # fmt: skip
        elif _pads_at(piece, condition, least.parameter):  # it is the node that begins to touch
            return None
        closer = step.bisect(row)
        if closer is None:
            return None
        guess = closer
    return None


def _new_side(piece: PieceOfPath, beyond: PieceOfPath, number: int, parameter: float) -> int:
    """Return the number in the arrays of a contact at a place."""
    mesh = beyond.whole.mesh
    sides = [k for k, one in enumerate(mesh.contacts) if one.slide >= 0 and one.number == number]
    return min(sides, key=lambda k: abs(mesh.elements.cuts[mesh.contacts[k].element, 1] - parameter))


def _onto_node(piece: PieceOfPath, condition: SideCondition) -> PieceOfPath | None:
    """Return the piece in which the node at the end of a beam touches instead of its side; None if none may."""
    pads = _pads_at(piece, condition, 1.0 if condition.last else 0.0)
    if not pads or condition.mark not in (0.0, 1.0):
        return None
    return piece.with_flanks(_without(piece, condition.number), (piece.closed - {condition.number}) | {pads[0]})


def _pads_at(piece: PieceOfPath, condition: SideCondition, end: float) -> list[int]:
    """Return the numbers of the pads on the same obstacle of the node at the end of a beam that is near."""
    mesh = piece.whole.mesh
    beam = mesh.fits.network.beams[condition.item.beam]
    node = beam.end if end > 0.5 else beam.start
    return [
        k
        for k, one in enumerate(mesh.contacts)
        if isinstance(one.item, NodeOnObstacle) and one.item.name == condition.item.name and one.item.node == node
    ]


def _without(piece: PieceOfPath, *numbers: int) -> list[FlankPlace]:
    """Return the places at which sides touch but for some contacts."""
    mesh = piece.whole.mesh
    return [
        FlankPlace(one.number, float(mesh.elements.cuts[one.element, 1]))
        for k, one in enumerate(mesh.contacts)
        if one.slide >= 0 and k not in numbers
    ]


def _joined(piece: PieceOfPath, condition: SideCondition, at: PathEquilibrium) -> PieceOfPath:
    """Return the piece in which two contacts are one."""
    z, mesh = piece.whole.values(at.x, at.drive), piece.whole.mesh
    pair = mesh.contacts[condition.number], mesh.contacts[condition.number + 1]
    middle = 0.5 * float(sum(z[one.slide] for one in pair))
    flanks = [*_without(piece, condition.number, condition.number + 1), FlankPlace(pair[0].number, middle)]
    return piece.with_flanks(flanks, piece.closed)


def _with_force(piece: PieceOfPath, at: PathEquilibrium, beyond: PieceOfPath, *numbers: int) -> PathEquilibrium:
    """Return a guess in another piece, whose new contact bears the forces of some that are left."""
    mesh, z = beyond.whole.mesh, piece.whole.values(at.x, at.drive)
    near = piece.carry(at, beyond)
    force = sum(float(z[piece.whole.mesh.contacts[k].unknown]) for k in numbers)
    full = beyond.whole.values(near.x, near.drive)
    idle = [one.unknown for k, one in enumerate(mesh.contacts) if k in beyond.closed and full[one.unknown] == 0.0]
    full[idle] = force / max(len(idle), 1)
    return near._replace(x=full[mesh.free])


def _find(beyond: PieceOfPath, condition: SideCondition, wanted: tuple[str, bool]) -> int:
    """Return the row of a condition on the same side."""
    kind, last = wanted
    return len(beyond.whole.mesh.contacts) + next(
        k for k, one in enumerate(beyond.sides.all)
        if one.kind == kind and one.item is condition.item and (kind != "tangent" or one.last == last)
    )  # fmt: skip


def _zero_of(piece: PieceOfPath, begin: PathEquilibrium, row: int) -> PathEquilibrium | None:
    """Return the equilibrium at which a condition is just met, near a guess: by secants of the drive."""
    at = piece.own.solve(piece.shrink(begin).x, begin.drive)
    if at is None:
        return None
    drives, values = list[float](), list[float]()
    for _ in range(N_SECANTS):
        whole = piece.grow(at)
        value = piece.row_value(whole, row)
        drives.append(at.drive)
        values.append(value)
        if abs(value) < EXACT:
            return whole
        slope = (
            (values[-1] - values[-2]) / (drives[-1] - drives[-2]) if len(values) > 1 else row_rate(piece, whole, row)
        )
        if slope == 0 or not np.isfinite(slope):
            return None
        goal = at.drive - value / slope
        if goal == at.drive or (len(values) > 3 and abs(value) >= abs(values[-2])):
            return whole
        found = piece.own.solve(at.x + (goal - at.drive) * at.rate, goal)
        if found is None:
            return None
        at = found
    return piece.grow(at)


def row_rate(piece: PieceOfPath, at: PathEquilibrium, row: int) -> float:
    """Return how a row of `PieceOfPath.values` changes with the drive at an equilibrium."""
    step = RATE_STEP / max(1.0, float(np.abs(at.rate).max(initial=0.0)))
    sides = [at._replace(x=at.x + way * at.rate, drive=at.drive + way) for way in (step, -step)]
    ahead, behind = (piece.row_value(side, row) for side in sides)
    return (ahead - behind) / (2 * step)


def enter_side_change(
    piece: PieceOfPath, change: ContactChange, sense: float
) -> PathStop | tuple[PieceOfPath, PathEquilibrium, float, bool]:
    """Return the piece behind a change of a side, its start, the sense of the drive there, and whether it has turned."""
    condition = change.condition
    lost = PathStop(WhyStopped.LOST, change.at.drive, NO_WAY.format(names=piece.say(change.number)
                    if change.piece is None else change.piece.say(min(change.number, 0))))  # fmt: skip
    if condition is None:  # a contact of a side ends
        item = piece.whole.mesh.contacts[change.number]
        beyond = piece.with_flanks(_without(piece, change.number), piece.closed - {change.number})
        near = beyond.shrink(piece.carry(change.at, beyond))
        at = beyond.own.solve(near.x, near.drive)
        if at is None:
            return lost
        row = len(beyond.whole.mesh.contacts) + next(
            k for k, one in enumerate(beyond.sides.all) if one.kind == "touch" and one.number == item.number
        )
        whole = beyond.grow(at)
        grows = row_rate(beyond, whole, row)
    elif change.piece is not None:  # begins, moves onto a node, joins another
        beyond = change.piece
        near = beyond.shrink(change.at)
        at = beyond.own.solve(near.x, near.drive)
        if at is None:
            return lost
        whole = beyond.grow(at)
        if condition.kind == "touch":
            grows = beyond.grows_along(whole, change.number)
        else:
            wanted = ("tangent", condition.last) if condition.kind == "end" else ("spreads", False)
            grows = row_rate(beyond, whole, _find(beyond, condition, wanted))
    else:
        part = _into_beam(piece, change) if condition.kind == "tangent" else _apart(piece, change)
        if part is None:
            return lost
        beyond, whole, grows = part
    turned = bool(grows * sense < 0)
    return beyond, whole, (-sense if turned else sense), turned


Entered = tuple[PieceOfPath, "PathEquilibrium", float]


def _into_beam(piece: PieceOfPath, change: ContactChange) -> Entered | None:
    """Return the piece in which the side of a beam touches instead of the node at its end, and how the way there grows."""
    condition: Any = change.condition
    place = 1 - NEW_PLACE if condition.last else NEW_PLACE
    beyond = piece.with_flanks([*piece.flanks, FlankPlace(change.contact, place)], piece.closed - {change.number})
    number = _new_side(piece, beyond, change.contact, place)
    begin = _with_force(piece, change.at, beyond, change.number)
    slide = beyond.slot_in_own(number, slide=True)
    at = _at_level(beyond, begin, {slide: 1.0}, place)
    if at is None:
        return None
    return beyond, beyond.grow(at), float(at.rate[slide]) * (-1.0 if condition.last else 1.0)


def _apart(piece: PieceOfPath, change: ContactChange) -> Entered | None:
    """Return the piece in which a contact has parted into two, and how the way between them grows."""
    mesh, z = piece.whole.mesh, piece.whole.values(change.at.x, change.at.drive)
    middle = float(z[mesh.contacts[change.number].slide])
    both = [FlankPlace(change.contact, middle + side * NEW_PLACE) for side in (-1.0, 1.0)]
    beyond = piece.with_flanks([*_without(piece, change.number), *both], piece.closed)
    first, last = (_new_side(piece, beyond, change.contact, one.parameter) for one in both)
    begin = _with_force(piece, change.at, beyond, change.number)
    own = beyond.whole.mesh
    full = beyond.whole.values(begin.x, begin.drive)
    force = float(z[mesh.contacts[change.number].unknown])
    for number, one in zip((first, last), both, strict=True):
        full[own.contacts[number].slide], full[own.contacts[number].unknown] = one.parameter, 0.5 * force
    begin = begin._replace(x=full[own.free])
    low, high = (beyond.slot_in_own(number, slide=True) for number in (first, last))
    at = _at_level(beyond, begin, {high: 1.0, low: -1.0}, 2 * NEW_PLACE)
    return None if at is None else (beyond, beyond.grow(at), float(at.rate[high] - at.rate[low]))


def _at_level(piece: PieceOfPath, begin: PathEquilibrium, row: dict[int, float], level: float) -> Any:
    """Return the equilibrium of a piece at which a combination of its unknowns has a value."""
    near = piece.shrink(begin)
    border = np.zeros(len(near.x) + 1)
    for slot, factor in row.items():
        border[slot] = factor
    state = piece.own.equations.solve(near.x, near.drive, border, level)
    if state is None or not np.isfinite(state.rate).all():
        return None
    return near._replace(x=state.free, drive=float(state.way), rate=state.rate, unstable=state.unstable,
                         effort=state.effort)  # fmt: skip
