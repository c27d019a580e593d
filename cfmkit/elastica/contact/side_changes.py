"""Changes of contacts of sides of beams (begin, end, move, part, join, lie down): located, and the piece behind each.

Each change is located by its own equations: a contact that begins has no force and no gap; one that moves from the end
of a beam into it, or back, is tangent there; one that parts has a gap whose curvature vanishes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cfmkit.elastica.contact.beam_lines import find_end
from cfmkit.elastica.contact.conditions import NEW_PLACE, step_inwards
from cfmkit.elastica.contact.edges import find_mate
from cfmkit.elastica.contact.line_tangent import KINK_REACH
from cfmkit.elastica.contact.path_items import BeyondChange, ContactChange
from cfmkit.elastica.contact.places_of_sides import (
    find_nearest_places,
    find_pads_at,
    find_partner,
    guess_laid,
    lay_anew,
    list_remaining_places,
    may_lie,
    presses,
    presses_where_it_spreads,
    why_not_laid,
)
from cfmkit.elastica.contact.side_gaps import LoadStage
from cfmkit.elastica.mechanics.discretise import FlankPlace
from cfmkit.elastica.model.contact import BeamOnBeam, BeamOnObstacle, NodeOnBeam, describe
from cfmkit.numerics.continuation.path import PathStop, WhyStopped

if TYPE_CHECKING:
    from cfmkit.elastica.contact.conditions import Condition
    from cfmkit.elastica.contact.piece import PieceOfPath
    from cfmkit.elastica.contact.step_between import StepBetween
    from cfmkit.elastica.model.contact import Contact
    from cfmkit.numerics.continuation.problem import PathEquilibrium

BESIDE_SHARE = 0.05  # of a step, by which a located change may lie beside it
N_SECANTS, ZERO_LEVEL = 12, 1e-13
RATE_STEP = 1e-6  # motion by which rates of conditions are differentiated
FROM_ROOT, BESIDE_ROOT = 1e-3, 1e-2  # of a beam from a clamped end on the obstacle: what lies there first; a point
BEGINS_TO_LIE = "{names} begins to lie on it along a length at {{place}}: {why}"
SPREADS_MESSAGE = "contact of {names} spreads along a length at {{place}}: {why}"
TOUCHES_TWICE = "{names} touch at a second place at {{place}}: that is not modelled"
MEETS_WHOLE = "{names} is met along the whole length at {{place}}: no place touches first"
REACHES_MARK = "the contact of {names} reaches {mark} at {{place}}, which it cannot pass"
CONTACTS_MEET = "two contacts of beam {beam!r} meet at {{place}}"
MEETS_END = "{names} meets an end of the beam at {{place}}: pads touch sides only"
NO_WAY = "no equilibrium was found behind the change of the contact of {names} at {{place}}"


def locate_side_change(piece: PieceOfPath, step: StepBetween, row: int) -> ContactChange | PathStop | None:
    """Return where a condition on a side is first violated within a step; None if that is not found."""
    condition, unstable = piece.conditions.all[row], step.first.unstable
    if condition.kind == "touch":
        return _locate_touch(piece, step, row, condition)
    at = _locate_zero(piece, step, row)
    if at is None:
        return None
    if condition.kind == "tangent" and _is_parallel(piece, condition, at):
        return _stop_lost(at, MEETS_WHOLE, condition.item)
    if condition.kind == "pinch":
        return _stop_lost(at, CONTACTS_MEET, condition.item, beam=condition.item.beam)
    items = piece.whole.mesh.fits.network.contacts
    number = next(k for k, item in enumerate(items) if item is condition.item)
    if condition.kind in ("wraps", "pulls", "tangent", "spreads"):
        kinds: dict[str, Literal["spreads", "closes", "moves"]] = {"pulls": "closes", "tangent": "moves"}
        kind = kinds.get(condition.kind, "spreads")
        return ContactChange(kind, condition.number, at, unstable, unstable, number, condition)
    beyond = _enter_neighbour(piece, condition, at)
    if beyond is None:
        item = piece.whole.mesh.contacts[condition.number].item
        return _stop_lost(at, REACHES_MARK, item, mark=_describe_mark(piece, condition))
    wanted = _condition_beyond(beyond, condition)
    if wanted[0] == "wraps":
        begin = piece.carry(at, beyond)
    else:
        left = (condition.number, condition.number + 1) if condition.kind == "closes" else (condition.number,)
        begin = _pass_force_on(piece, at, beyond, *left)
    exact = _zero_of(beyond, begin, beyond.conditions.find_row(wanted[0], condition.item, wanted[1]))
    if exact is None:
        return None
    change: Literal["moves", "closes"] = "moves" if wanted[0] == "tangent" else "closes"
    return ContactChange(change, condition.number, exact, unstable, unstable, number, condition, beyond)


def _enter_neighbour(piece: PieceOfPath, condition: Condition, at: PathEquilibrium) -> PieceOfPath | None:
    """Return the piece behind a contact that reaches an end of its beam, or another one; None if there is none."""
    if condition.kind == "closes":
        return _join_contacts(piece, condition, at)
    if condition.mark in (0.0, 1.0) and condition.last in piece.conditions.roots(condition.item):
        return piece.with_flanks(list_remaining_places(piece, condition.number), piece.closed - {condition.number})
    return _move_onto_node(piece, condition, at)


def _condition_beyond(beyond: PieceOfPath, condition: Condition) -> tuple[str, bool | None]:
    """Return kind and end of the condition that is met from the other side of a change."""
    if condition.kind == "closes":
        return "spreads", None
    rooted = condition.last in beyond.conditions.roots(condition.item)
    return ("wraps" if rooted and condition.mark in (0.0, 1.0) else "tangent"), condition.last


def _stop_lost(at: PathEquilibrium, message: str, item: Contact, **words: str) -> PathStop:
    """Return the end of a path at an equilibrium that contact does not let it pass."""
    return PathStop(WhyStopped.LOST, at.drive, message.format(names=describe(item), **words))


def _describe_mark(piece: PieceOfPath, condition: Condition) -> str:
    """Return the words for the node, corner or step that a contact has reached."""
    beam = piece.whole.mesh.fits.network.beams[condition.item.beam]
    if condition.mark in (0.0, 1.0):
        return f"node {beam.end if condition.last else beam.start!r}"
    return f"a corner or a step of the beam at {condition.mark:.3g} of it"


def _locate_touch(
    piece: PieceOfPath, step: StepBetween, row: int, condition: Condition
) -> ContactChange | PathStop | None:
    """Return where a side begins to touch."""
    share, unstable = step.crossing(row), step.first.unstable
    if share is None:
        return None
    guess = step.guess(share)
    if _is_parallel(piece, condition, guess):
        return _stop_lost(guess, MEETS_WHOLE, condition.item)
    for _ in range(2):
        stage = LoadStage.from_problem(piece.whole, np.array([guess.drive]))
        least = piece.conditions.gaps_of(condition.item).find_least(piece.whole.values(guess.x, guess.drive), stage)
        if _is_beside_kink(piece, condition, guess, least.parameter):
            return _stop_lost(guess, SPREADS_MESSAGE, condition.item, why=why_not_laid(piece, condition.item))
        between = _contact_around(piece, condition, least.parameter)
        if between is not None:
            at, lies = step.bisect(row), condition._replace(kind="lies", number=between)
            number = condition.number
            return None if at is None else ContactChange("spreads", between, at, unstable, unstable, number, lies)
        if isinstance(condition.item, BeamOnBeam) and condition.number in {
            contact.number for contact in piece.whole.mesh.contacts
        }:
            return _stop_lost(guess, TOUCHES_TWICE, condition.item)
        places = find_nearest_places(piece, condition, guess, least.parameter)
        if places:
            beyond = piece.with_flanks([*piece.flanks, *places], piece.closed)
            begin = piece.carry(guess, beyond)
            number = _new_side(beyond, condition.number, least.parameter)
            slot = beyond.find_own_slot(number)
            state = beyond.solve_at_level(begin, {slot: 1.0}, 0.0)
            if state is not None:
                x = np.array(state.x)
                x[slot] = 0.0  # but for rounding
                at = beyond.grow(beyond.shrink(begin)._replace(x=x, drive=state.drive, rate=state.rate))
                if -BESIDE_SHARE <= step.find_share(at, beyond) <= 1 + BESIDE_SHARE:
                    return ContactChange("begins", number, at, unstable, unstable, condition.number, condition, beyond)
        elif isinstance(condition.item, BeamOnBeam) or find_pads_at(piece, condition, least.parameter):
            return None  # it is the node that begins to touch
        closer = step.bisect(row)
        if closer is None:
            return None
        guess = closer
    if isinstance(condition.item, NodeOnBeam) and not 0.5 * NEW_PLACE < least.parameter < 1 - 0.5 * NEW_PLACE:
        return _stop_lost(guess, MEETS_END, condition.item)
    return None


def _is_beside_kink(piece: PieceOfPath, condition: Condition, at: PathEquilibrium, parameter: float) -> bool:
    """Return True if a side that shears touches so near to a place that its kink lies there."""
    mesh, z, beam = piece.whole.mesh, piece.whole.values(at.x, at.drive), condition.item.beam
    section = mesh.fits.network.beams[beam].section
    places = [float(z[contact.slide]) for contact in mesh.contacts if contact.number == condition.number]
    distance = KINK_REACH * section.thinnest / mesh.fits[beam].length
    return section.shear and any(abs(place - parameter) < distance for place in places)


def _is_parallel(piece: PieceOfPath, condition: Condition, at: PathEquilibrium) -> bool:
    stage = LoadStage.from_problem(piece.whole, np.array([at.drive]))
    return piece.conditions.gaps_of(condition.item).is_parallel(piece.whole.values(at.x, at.drive), stage)


def _new_side(beyond: PieceOfPath, number: int, parameter: float) -> int:
    """Return the number in the arrays of a contact at a place."""
    mesh = beyond.whole.mesh
    sides = [k for k, contact in enumerate(mesh.contacts) if contact.slide >= 0 and contact.number == number]
    return min(sides, key=lambda k: abs(mesh.elements.cuts[mesh.contacts[k].element, 1] - parameter))


def _move_onto_node(piece: PieceOfPath, condition: Condition, at: PathEquilibrium) -> PieceOfPath | None:
    """Return the piece in which the node at the end of a beam touches instead of its side; None if none may."""
    pads = find_pads_at(piece, condition, 1.0 if condition.last else 0.0)
    if not pads or condition.mark not in (0.0, 1.0):
        return None
    left = list_remaining_places(piece, condition.number)
    if isinstance(condition.item, BeamOnBeam):  # the node touches the other beam where its side did
        mate = find_mate(piece.whole.mesh, condition.item)
        left.append(FlankPlace(pads[0], float(piece.whole.values(at.x, at.drive)[mate.slide])))
        return piece.with_flanks(left, piece.closed)
    return piece.with_flanks(left, (piece.closed - {condition.number}) | {pads[0]})


def _contact_around(piece: PieceOfPath, condition: Condition, parameter: float) -> int | None:
    """Return the contact at an end of a free part of a side between two contacts.

    One of these may be a clamped end on the obstacle. None if the part may touch at a point: a straight beam at a
    straight wall.
    """
    mesh, item = piece.whole.mesh, condition.item
    of_beam = piece.list_sides(item.beam)
    sides = [(k, mesh.contacts[k]) for k in of_beam]
    before = [k for k, contact in sides if mesh.elements.cuts[contact.element, 1] < parameter]
    after = [k for k, contact in sides if mesh.elements.cuts[contact.element, 1] > parameter]
    roots = piece.conditions.roots(item)
    if not may_lie(piece, item, parameter):
        return None
    if before and after:
        pair = before[-1], after[0]
        return pair[0] if all(mesh.contacts[k].item is item for k in pair) else None
    if after and not before and False in roots and mesh.contacts[after[0]].item is item:
        return after[0]
    if before and not after and True in roots and mesh.contacts[before[-1]].item is item:
        return before[-1]
    return None


def _join_contacts(piece: PieceOfPath, condition: Condition, at: PathEquilibrium) -> PieceOfPath:
    """Return the piece in which two contacts are one."""
    z, mesh = piece.whole.values(at.x, at.drive), piece.whole.mesh
    pair = mesh.contacts[condition.number], mesh.contacts[condition.number + 1]
    middle = 0.5 * float(sum(z[contact.slide] for contact in pair))
    flanks = [*list_remaining_places(piece, condition.number, condition.number + 1), FlankPlace(pair[0].number, middle)]
    return piece.with_flanks(flanks, piece.closed)


def _pass_force_on(piece: PieceOfPath, at: PathEquilibrium, beyond: PieceOfPath, *numbers: int) -> PathEquilibrium:
    """Return a guess in another piece, whose new contact bears the forces of some that are left."""
    mesh, z = beyond.whole.mesh, piece.whole.values(at.x, at.drive)
    begin_guess = piece.carry(at, beyond)
    force = sum(float(z[piece.whole.mesh.contacts[k].unknown]) for k in numbers)
    full = beyond.whole.values(begin_guess.x, begin_guess.drive)
    idle = [contact for k, contact in enumerate(mesh.contacts) if k in beyond.closed and full[contact.unknown] == 0.0]
    n_forces = sum(not isinstance(contact.item, BeamOnBeam) or contact.item.leads for contact in idle)
    full[[contact.unknown for contact in idle]] = force / max(n_forces, 1)
    return begin_guess._replace(x=full[mesh.free])


def _zero_of(piece: PieceOfPath, begin: PathEquilibrium, row: int) -> PathEquilibrium | None:
    """Return the equilibrium at which a condition is just met, near a guess: by secants of the drive."""
    at = piece.own_problem.solve(piece.shrink(begin).x, begin.drive)
    if at is None:
        return None
    drives, values = list[float](), list[float]()
    for _ in range(N_SECANTS):
        whole = piece.grow(at)
        value = piece.measure_condition(whole, row)
        drives.append(at.drive)
        values.append(value)
        if abs(value) < ZERO_LEVEL:
            return whole
        slope = (
            (values[-1] - values[-2]) / (drives[-1] - drives[-2]) if len(values) > 1 else row_rate(piece, whole, row)
        )
        if slope == 0 or not np.isfinite(slope):
            return None
        goal = at.drive - value / slope
        if goal == at.drive or (len(values) > 3 and abs(value) >= abs(values[-2])):
            return whole
        solved = piece.own_problem.solve(at.x + (goal - at.drive) * at.rate, goal)
        if solved is None:
            return None
        at = solved
    return piece.grow(at)


def _locate_zero(piece: PieceOfPath, step: StepBetween, row: int) -> PathEquilibrium | None:
    """Return the equilibrium of a step at which a condition is just met: by secants, else by bisection."""
    share = step.crossing(row)
    if share is not None:
        guess = step.guess(share)
        at = _zero_of(piece, guess, row)
        if at is not None and step.contains(at, guess.x):
            return at
    return step.bisect(row)


def row_rate(piece: PieceOfPath, at: PathEquilibrium, row: int) -> float:
    """Return how a row of `PieceOfPath.values` changes with the drive at an equilibrium."""
    step = RATE_STEP / max(1.0, float(np.abs(at.rate).max(initial=0.0)))
    sides = [at._replace(x=at.x + change * at.rate, drive=at.drive + change) for change in (step, -step)]
    ahead, behind = (piece.measure_condition(side, row) for side in sides)
    return (ahead - behind) / (2 * step)


def enter_side_change(piece: PieceOfPath, change: ContactChange, sense: float) -> PathStop | BeyondChange:
    """Return the piece behind a change of a side, its start, and the sense of the drive there."""
    condition = change.condition
    if condition is not None and condition.kind in ("wraps", "spreads", "lies"):
        why = why_not_laid(piece, condition.item)
        if why and (condition.kind == "wraps" or may_lie(piece, condition.item, 0.5)):
            message = BEGINS_TO_LIE if isinstance(condition.item, BeamOnObstacle) else SPREADS_MESSAGE
            return _stop_lost(change.at, message, condition.item, why=why)
    if condition is None:
        entered = _end_contact(piece, change)
    elif change.piece is not None:
        entered = _enter_located(change, condition, change.piece)
    else:
        ways = {"tangent": _move_into_beam, "spreads": _part_contact, "wraps": _lie_from_root}
        entered = ways[condition.kind](piece, change) if condition.kind in ways else _lay_or_free(piece, change, sense)
    if entered is None:
        return _stop_lost(change.at, NO_WAY, piece.whole.mesh.fits.network.contacts[change.contact])
    beyond, at, grows = entered
    return BeyondChange(beyond, at, -sense if grows * sense < 0 else sense)


def _end_contact(piece: PieceOfPath, change: ContactChange) -> Entered | None:
    """Return the piece in which a contact of a side has ended, and how its gap grows."""
    contact = piece.whole.mesh.contacts[change.number]
    beyond = piece.with_flanks(list_remaining_places(piece, change.number), piece.closed - {change.number})
    at = beyond.solve_near(piece.carry(change.at, beyond))
    if at is None:
        return None
    item = contact.item
    if isinstance(item, BeamOnBeam) and not item.leads:
        item = piece.whole.mesh.fits.network.contacts[find_partner(piece, contact.number)]
    return beyond, at, row_rate(beyond, at, beyond.conditions.find_row("touch", item))


def _enter_located(change: ContactChange, condition: Condition, beyond: PieceOfPath) -> Entered | None:
    """Return the piece in which a side begins to touch, moves onto a node or joins another one, and how that grows."""
    at = beyond.solve_near(change.at)
    if at is None:
        return None
    if condition.kind == "touch":
        return beyond, at, beyond.measure_growth(at, change.number)
    kind, last = _condition_beyond(beyond, condition)
    return beyond, at, row_rate(beyond, at, beyond.conditions.find_row(kind, condition.item, last))


Entered = tuple["PieceOfPath", "PathEquilibrium", float]


def _move_into_beam(piece: PieceOfPath, change: ContactChange) -> Entered | None:
    """Return the piece in which a side touches instead of the node at its end, and how the way from there grows."""
    condition: Any = change.condition
    place = 1 - NEW_PLACE if condition.last else NEW_PLACE
    left, new = piece.flanks, [FlankPlace(change.contact, place)]
    if isinstance(condition.item, BeamOnBeam):
        pad, z = piece.whole.mesh.contacts[change.number], piece.whole.values(change.at.x, change.at.drive)
        left = tuple(list_remaining_places(piece, change.number))
        new.append(FlankPlace(find_partner(piece, change.contact), float(z[pad.slide])))
    beyond = piece.with_flanks([*left, *new], piece.closed - {change.number})
    number = _new_side(beyond, change.contact, place)
    begin = _pass_force_on(piece, change.at, beyond, change.number)
    slide = beyond.find_own_slot(number, slide=True)
    at = beyond.solve_at_level(begin, {slide: 1.0}, place)
    if at is None:
        return None
    return beyond, beyond.grow(at), float(at.rate[slide]) * (-1.0 if condition.last else 1.0)


def _part_contact(piece: PieceOfPath, change: ContactChange, free: bool = False) -> Entered | None:
    """Return the piece in which a contact has parted into two, and how the way between them grows."""
    mesh, z = piece.whole.mesh, piece.whole.values(change.at.x, change.at.drive)
    side_contact = mesh.contacts[change.number]
    item: Any = side_contact.item
    middle = float(z[side_contact.slide])
    x, y, turn, _ = mesh.attachments.unknowns[side_contact.place]
    angle = float(np.real(mesh.fits[item.beam].angle(middle, middle))) + float(z[turn])
    force = 0.5 * sum(z[mesh.elements.unknowns[side_contact.element + k, -2:]] for k in (0, 1))
    place = mesh.attachments.origin[side_contact.place] + z[[x, y]]
    lies = may_lie(piece, item, middle) and presses_where_it_spreads(piece, item, place, force, angle)
    lies = lies and not free
    both = [FlankPlace(change.contact, middle + side * NEW_PLACE, int(lies and side < 0)) for side in (-1.0, 1.0)]
    beyond = piece.with_flanks([*list_remaining_places(piece, change.number), *both], piece.closed)
    first, last = (_new_side(beyond, change.contact, contact.parameter) for contact in both)
    begin = _pass_force_on(piece, change.at, beyond, change.number)
    new = beyond.whole.mesh
    full = beyond.whole.values(begin.x, begin.drive)
    for number, contact in zip((first, last), both, strict=True):
        full[new.contacts[number].slide] = contact.parameter
        full[new.contacts[number].unknown] = 0.5 * float(z[side_contact.unknown])
    if lies:
        guess_laid(new, full, new.contacts[last].element, float(force @ [np.cos(angle), np.sin(angle)]))
    begin = begin._replace(x=full[new.free])
    low, high = (beyond.find_own_slot(number, slide=True) for number in (first, last))
    at = beyond.solve_at_level(begin, {high: 1.0, low: -1.0}, 2 * NEW_PLACE)
    if lies and (at is None or not presses(beyond, at)):
        return _part_contact(piece, change, free=True)
    return None if at is None else (beyond, beyond.grow(at), float(at.rate[high] - at.rate[low]))


def _lie_from_root(piece: PieceOfPath, change: ContactChange, free: bool = False) -> Entered | None:
    """Return the piece in which a side lies from a clamped end on, or touches beside it, and how that grows."""
    condition: Any = change.condition
    mesh, z, item = piece.whole.mesh, piece.whole.values(change.at.x, change.at.drive), condition.item
    element, angle, place = find_end(mesh, item.beam, condition.last, z)
    force, place = z[mesh.elements.unknowns[element, -2:]], step_inwards(item, place, angle, condition.last)
    lies = presses_where_it_spreads(piece, item, place, force, angle) and not free
    first = FROM_ROOT if lies else BESIDE_ROOT
    parameter, laid = (1 - first, 1) if condition.last else (first, -1)
    beyond = piece.with_flanks(
        [*piece.flanks, FlankPlace(change.contact, parameter, laid if lies else 0)], piece.closed
    )
    number = _new_side(beyond, change.contact, parameter)
    begin, new = piece.carry(change.at, beyond), beyond.whole.mesh
    full = beyond.whole.values(begin.x, begin.drive)
    if lies:
        at = new.contacts[number].element + (laid > 0)
        guess_laid(new, full, at, float(force @ [np.cos(angle), np.sin(angle)]))
    slide = beyond.find_own_slot(number, slide=True)
    solved = beyond.solve_at_level(begin._replace(x=full[new.free]), {slide: 1.0}, parameter)
    if lies and (solved is None or not presses(beyond, solved)):
        return _lie_from_root(piece, change, free=True)
    if solved is None:
        return None
    return beyond, beyond.grow(solved), float(solved.rate[slide]) * (-1.0 if condition.last else 1.0)


def _lay_or_free(piece: PieceOfPath, change: ContactChange, sense: float) -> Entered | None:
    """Return the piece in which a free part lies on an obstacle, or one that lay there is free; the drive goes on."""
    condition: Any = change.condition
    mesh, z = piece.whole.mesh, piece.whole.values(change.at.x, change.at.drive)
    contact = mesh.contacts[change.number]
    item: Any = contact.item
    sides = piece.list_sides(item.beam)
    if condition.kind == "lies":
        laid = -1 if change.number == sides[0] and False in piece.conditions.roots(item) else 1
        laid = laid if laid < 0 or change.number == sides[-1] or change.number + 1 in sides else -1
    else:
        laid = contact.laid
    element = contact.element + (laid > 0)
    beyond = lay_anew(piece, change.number, laid if condition.kind == "lies" else 0)
    begin, new = piece.carry(change.at, beyond), beyond.whole.mesh
    full = beyond.whole.values(begin.x, begin.drive)
    side_contact = mesh.elements.unknowns[element]
    inside = float(mesh.elements.cuts[element].mean())
    angle = float(np.real(mesh.fits[item.beam].angle(inside, inside))) + 0.5 * float(
        z[side_contact[3]] + z[side_contact[7]]
    )
    along = np.array([np.cos(angle), np.sin(angle)])
    if condition.kind == "lies":
        guess_laid(new, full, element, float(z[side_contact[-2:]] @ along))
    else:
        full[new.elements.unknowns[element, -2:]] = z[side_contact[-2]] * along
    at = beyond.own_problem.solve(full[new.free][beyond.own_mask], change.at.drive)
    return None if at is None else (beyond, beyond.grow(at), sense)
