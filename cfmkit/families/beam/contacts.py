"""Contacts of a beam mechanism along its curve: force columns, scalar results, findings; refuses overlaps at rest."""

from __future__ import annotations

import itertools
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import LazyMapping
from cfmkit.curves import Column
from cfmkit.elastica.mechanics.discretise import discretise
from cfmkit.elastica.model.contact import BeamOnBeam, BeamOnObstacle, BeamSide, NodeOnBeam, NodeOnObstacle, Stop
from cfmkit.elastica.results.beam_states import states
from cfmkit.errors import InputError
from cfmkit.families.beam.constant_force_range_and_extremes import window_of
from cfmkit.families.beam.contact_spec import MAX_OVERLAP_SHARE, column_names, friction_columns, pads_of, sides_of
from cfmkit.families.beam.largest_in_window import largest
from cfmkit.families.beam.network_from_spec import thickest_of
from cfmkit.families.end_stops import CONTACT_QUANTITIES, LARGEST_FORCE
from cfmkit.families.end_stops_spec import BEFORE_STOP
from cfmkit.numerics.quadrature import clenshaw_curtis
from cfmkit.results import Quantity
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Path
    from cfmkit.elastica.model.contact import Contact
    from cfmkit.elastica.results.path import ContactEvent
    from cfmkit.families.beam.network_from_spec import Assembly
    from cfmkit.families.beam.solution import LazyColumns, Solution

N_SIDE = 129  # places of every element at which the side of a beam is looked at
N_MEAN = 17  # places of the rule for a mean between two corners
MAX_PENETRATION_SHARE = 0.01  # share of a beam's thickness by which its side may lie in an obstacle beside a pad
ROUNDING_OF_GAP = 1e-9  # mean beam lengths: a clamped end that lies on an obstacle stays there
NEAR_GAP = 0.01  # share of the thinnest beam's thickness below which a gap that stays open is reported
OUT_OF_REACH = 10.0  # largest motions of a pad from an obstacle, from which on it is reported
MOST_NAMED = 6


def refuse_overlap_at_rest(assembly: Assembly) -> None:
    """Refuse beams that lie in an obstacle, in the pad of a node or in another beam before any load.

    Raises InputError with the beam, what it lies in, the depth and the place.
    """
    network = assembly.network
    sides = [contact for contact in network.contacts if isinstance(contact, BeamSide)]
    if not sides:
        return
    from cfmkit.elastica.contact.pair_gaps import make_gaps
    from cfmkit.elastica.contact.side_gaps import LoadStage

    mesh = discretise(network, assembly.drive())
    rest = np.zeros((1, mesh.size))
    for contact in sides:
        least = make_gaps(mesh, contact).find_least(rest[0], LoadStage(np.zeros(1)))
        depth = -least.gap * mesh.scales.length
        if depth > MAX_OVERLAP_SHARE * mesh.scales.length:
            place = float(np.ravel(mesh.fits[contact.beam].arc(least.parameter))[0])
            by, where = format_short(depth, "length"), f"at {place:.0%} of its length before any load"
            if isinstance(contact, BeamOnBeam):
                names = f"beams {contact.beam!r} and {contact.partner!r} overlap"
                raise InputError(f"mechanism.contacts: {names} by {by} at {place:.0%} of {contact.beam!r} at rest")
            if isinstance(contact, NodeOnBeam):
                names = f"the pad of node {contact.node!r} overlaps beam {contact.beam!r}"
                raise InputError(f"mechanism.contacts: {names} by {by} {where}")
            raise InputError(f"mechanism.obstacles.{contact.name}: beam {contact.beam!r} lies {by} inside it {where}")


# -- forces ------------------------------------------------------------------------------------------------------------
def groups(contacts: tuple[Contact, ...]) -> dict[tuple[str, str], list[int]]:
    """Return the numbers of the contacts by name and node or beam: of a stop, or of what touches an obstacle.

    Those between the same parts of the mechanism have one name.
    """
    numbers_by_pad: dict[tuple[str, str], list[int]] = {}
    for number, contact in enumerate(contacts):
        key = contact.name, "" if isinstance(contact, NodeOnBeam | BeamOnBeam) else toucher(contact)
        numbers_by_pad.setdefault(key, []).append(number)
    return numbers_by_pad


def toucher(contact: Contact) -> str:
    """Return the node or the beam that touches."""
    return contact.beam if isinstance(contact, BeamOnObstacle | BeamOnBeam) else contact.node


def counterpart(contact: Contact) -> str:
    """Return the stop, the obstacle or the beam that is touched."""
    if isinstance(contact, BeamOnBeam):
        return contact.partner
    return contact.beam if isinstance(contact, NodeOnBeam) else contact.name


def signed_force(path: Path, numbers: list[int]) -> FloatArray:
    """Return the force of a stop or a pad at every point of a path, (n,) [N or N m], on one copy."""
    if len(numbers) == 1:
        return path.contact_force(numbers[0])
    return np.asarray(sum(sense_of(path.network.contacts[number]) * path.contact_force(number) for number in numbers))


def sense_of(contact: Contact) -> float:
    """Return the sign with which the force of a contact counts: of a stop that of its direction, of two beams once."""
    if isinstance(contact, BeamOnBeam):
        return float(contact.leads)
    return contact.sense if isinstance(contact, Stop) else 1.0


def numbers_of(contacts: tuple[Contact, ...], name: str) -> list[int]:
    """Return the numbers of the one-sided contacts of a stop or an obstacle."""
    return [number for number, contact in enumerate(contacts) if contact.name == name]


def named_force(path: Path, name: str) -> FloatArray:
    """Return the force of a stop, or of all pads on an obstacle, at every point of a path, (n,)."""
    pads = groups(path.network.contacts).items()
    return np.asarray(sum(signed_force(path, numbers) for (owner, _), numbers in pads if owner == name))


def contact_columns(solution: Solution) -> LazyColumns:
    """Return the force of each stop and each pad at every point of the curve, and what happens there; when read."""
    path = solution.path
    columns: LazyColumns = {}
    forces = [column for _, column in column_names(solution.spec.mechanism)]
    for column, numbers in zip(forces, groups(path.network.contacts).values(), strict=True):
        columns |= _force_columns(solution, column, numbers)
    return columns | ({"event": partial(_event_column, solution)} if columns else {})


def _force_columns(solution: Solution, column: str, numbers: list[int]) -> LazyColumns:
    """Return the force of a contact, where on the side of a beam it is, and its friction."""
    path, keep = solution.path, solution.keep
    contacts = [path.network.contacts[number] for number in numbers]

    def force() -> Column:
        return Column(signed_force(path, numbers)[keep], "torque" if contacts[0].turns else "force")

    def place(k: int) -> Column:
        return Column(_place_values(path, numbers)[keep][:, k], "ratio")

    def tangential() -> Column:
        signs = [getattr(contact, "sense", 1.0) for contact in contacts]
        forces = [path.contact_friction(number)[0] for number in numbers]
        return Column(np.sum([sign * force for sign, force in zip(signs, forces, strict=True)], axis=0)[keep], "force")

    def state() -> Column:
        marks = [np.asarray(path.contact_friction(number)[1])[keep] for number in numbers]
        return Column(np.array(["".join(pose) for pose in zip(*marks, strict=True)], np.str_), "text")

    columns: LazyColumns = {column: force}
    columns |= {name: partial(place, k) for k, name in enumerate(_place_columns(contacts[0], column))}
    if any(contact.friction for contact in contacts):
        columns |= dict(zip(friction_columns(column), (tangential, state), strict=True))
    return columns


def _place_columns(contact: Contact, column: str) -> list[str]:
    """Return the columns of where the side of a beam touches, by the column of the force."""
    ends = {BeamOnObstacle: ("from", "to"), NodeOnBeam: ("at",)}.get(type(contact), ())
    if isinstance(contact, BeamOnBeam):
        ends = f"at_{contact.beam}", f"at_{contact.partner}"
    return [f"{column.removesuffix('force')}{end}" for end in ends]


def _place_values(path: Path, numbers: list[int]) -> FloatArray:
    """Return the values of these columns at every point of a path, (n, columns)."""
    contact = path.network.contacts[numbers[0]]
    if not isinstance(contact, BeamOnBeam):
        return path.contact_places(numbers[0])
    beams = contact.beam, contact.partner
    places = np.full((len(path), 2), np.nan)
    for number in numbers:
        item: Any = path.network.contacts[number]
        touches, column = path.contact_force(number) > 0, beams.index(item.beam)
        places[touches, column] = path.contact_places(number)[touches, 0]
        if isinstance(item, NodeOnBeam):
            places[touches, 1 - column] = float(path.network.beams[beams[1 - column]].end == item.node)
    return places


def _event_column(solution: Solution) -> Column:
    """Return the changes of contacts at each point of the curve, as text."""
    path, marks = solution.path, [""] * len(solution.path)
    for event in path.contact_events:
        point = _index_of_event(path, event)
        marks[point] = f"{marks[point]}; {_describe_change(path, event)}".removeprefix("; ")
    return Column(np.array([marks[point] for point in solution.keep], np.str_), "text")


def _index_of_event(path: Path, event: ContactEvent) -> int:
    return int(np.abs(np.where(path.changes_contact, path.drive, np.inf) - event.drive).argmin())


def _describe_change(path: Path, event: ContactEvent) -> str:
    contact = path.network.contacts[event.number]
    names_both = isinstance(contact, Stop | BeamOnBeam) or contact.name == f"{toucher(contact)}_{counterpart(contact)}"
    return f"{contact.name if names_both else f'{contact.name} {toucher(contact)}'} {event.kind}"


# -- scalar results ----------------------------------------------------------------------------------------------------
def contact_values(solution: Solution) -> Mapping[str, Quantity]:
    """Return the scalar results on contacts by name, computed when they are read."""
    pushing = [number for number, contact in enumerate(solution.path.network.contacts) if not contact.turns]
    named = dict.fromkeys(solution.path.network.contacts[number].name for number in pushing)
    several = (f"{plain}[{name}]" for name in named for plain in ("contact_force", "contact_force_ripple"))
    names = ["first_contact", *(["contact_force_max"] if pushing else []), *several]
    window = window_of(solution)

    def compute(name: str) -> Quantity:
        plain, _, contact = name.partition("[")
        if plain == "first_contact":
            return Quantity(_first_contact(solution), *CONTACT_QUANTITIES[name])
        if plain == "contact_force_max":
            top = largest(solution, lambda poses: np.array([poses.contact_force(number) for number in pushing]), window)
            return Quantity(top, "force", LARGEST_FORCE)
        if plain == "contact_force":
            mean = _mean(solution, contact.removesuffix("]"), window)
            reason = "" if mean is not None else "the window is not on the curve, or the curve turns back"
            return Quantity(mean, *CONTACT_QUANTITIES["contact_force[contact]"], reason=reason)
        top, bottom = force_extremes(solution, contact.removesuffix("]"), window)
        ripple = (top - bottom) / top if top is not None and bottom is not None and top > 0 else None
        reason = "" if ripple is not None else "there is no contact in the window"
        return Quantity(ripple, *CONTACT_QUANTITIES["contact_force_ripple[contact]"], reason=reason)

    return LazyMapping(names, compute)


def _first_contact(solution: Solution) -> float | None:
    """Return the motion at which the first contact begins [m]; None if there is none, or the drive turns."""
    path, contacts = solution.path, solution.path.network.contacts
    first = next((event for event in path.contact_events if event.kind == "begins"), None)
    if solution.spec.mechanism.drive.turns or not contacts:
        return None
    if first is not None:
        path_at_changes = path.take(path.changes_contact)
        motion = solution.replace_path(path_at_changes).motion
        return float(motion[int(np.abs(path_at_changes.drive - first.drive).argmin())])
    closed = any(path.contact_force(number)[0] > 0 for number in range(len(contacts)))
    return float(solution.motion[0]) if closed else None


def force_extremes(
    solution: Solution, name: str, window: tuple[float, float]
) -> tuple[float, float] | tuple[None, None]:
    """Return the largest and the smallest force of a contact in a window [N]; None of a window that is not reached."""

    top = largest(solution, lambda path: named_force(path, name)[None], window)
    bottom = largest(solution, lambda path: -named_force(path, name)[None], window)
    return (None, None) if top is None or bottom is None else (top, -bottom)


def _mean(solution: Solution, name: str, window: tuple[float, float]) -> float | None:
    """Return the mean force of a contact over the motion in a window, piece by piece between corners [N]."""
    law = solution.model_between_points
    if law is None:
        return None
    low, high = max(window[0], float(law.places[0])), min(window[1], float(law.places[-1]))
    if not high > low or high - low < (1 - 1e-9) * (window[1] - window[0]):
        return None
    marks = [low, *(place for place in law.corners.tolist() if low < place < high), high]
    weights = clenshaw_curtis(N_MEAN)
    shares = 0.5 * (1 - np.cos(np.pi * np.arange(N_MEAN) / (N_MEAN - 1)))
    total = 0.0
    for begin, end in itertools.pairwise(marks):
        force = named_force(law.solve_at(begin + (end - begin) * shares), name)
        total += (end - begin) * float(weights @ force)
    return total / (high - low)


# -- findings ----------------------------------------------------------------------------------------------------------


def contact_sentences(solution: Solution, say: Callable[[float], str]) -> Iterator[tuple[str, str]]:
    """Yield the name and the message of each finding on contacts; `say` gives a drive as a reader wants it."""
    path = solution.path
    if not path.network.contacts or not len(solution.keep):
        return
    contacts = list(enumerate(path.network.contacts))
    resting = [describe(contact) for number, contact in contacts if path.contact_force(number)[0] > 0]
    before = [f"closed before the drive moves: {', '.join(resting)}"] if resting else []
    yield from change_sentences(solution, say, before)
    sliding = [
        describe(contact)
        for number, contact in contacts
        if contact.friction and "slip" in path.contact_friction(number)[1][solution.keep]
    ]
    if sliding:
        message = f"{', '.join(sliding[:MOST_NAMED])} slides: 'stable' says there only that the drive passes no limit"
        yield "stability_of_sliding", f"{message} point"
    yield from _gap_sentences(solution)
    yield from _side_sentences(solution, say)


def change_sentences(
    solution: Solution, say: Callable[[float], str], before: Sequence[str] = ()
) -> Iterator[tuple[str, str]]:
    """Yield the same on what changes along a curve, behind sentences on what was before it."""
    path = solution.path
    sentences = [_describe_event(solution, event, say(event.drive)) for event in path.contact_events]
    told = [*before, *(text for text in sentences if text)]
    if told:
        more = f"; and {len(told) - MOST_NAMED} more changes" if len(told) > MOST_NAMED else ""
        yield "contact_begins", "; ".join(told[:MOST_NAMED]) + more
    for event in path.contact_events:
        contact, place = path.network.contacts[event.number], say(event.drive)
        who = describe(contact)
        if event.states > 1:
            states_left = f"friction leaves {event.states} states that can go on"
            text = f"where {who} changes at {place}, {states_left}: {_state_taken(path, event)}"
            yield "friction_not_unique", text
        if event.kind == "spreads" and isinstance(contact, NodeOnBeam | BeamOnBeam):
            text = f"contact of {who} spreads along a length at {place}: that is not modelled between parts"
            yield "contact_spreads_between_beams", f"{text}, and the curve ends there"
        if event.kind == "blocks":
            yield "blocked", f"the drive is blocked by {who} at {place}"


def _state_taken(path: Path, event: ContactEvent) -> str:
    """Return which of several states of friction the curve goes on with: that of the next point."""
    point = min(_index_of_event(path, event) + 1, len(path) - 1)
    state = str(path.contact_friction(event.number)[1][point])
    return {"stick": "it sticks here", "slip": "it slides here"}.get(state, "it leaves here")


def describe(contact: Contact) -> str:
    """Return what a contact is called."""
    touches = f"{toucher(contact)!r} on {counterpart(contact)!r}"
    return f"stop {contact.name!r}" if isinstance(contact, Stop) else touches


def _describe_event(solution: Solution, event: ContactEvent, place: str) -> str:
    contact, path = solution.path.network.contacts[event.number], solution.path
    if event.kind == "blocks" or (event.kind == "spreads" and isinstance(contact, NodeOnBeam | BeamOnBeam)):
        return ""
    what, partner = f"{toucher(contact)!r}", f"{counterpart(contact)!r}"
    if isinstance(contact, Stop):
        partner = f"stop {partner}"
    if isinstance(contact, Stop) and event.kind == "begins":
        force = format_short(
            float(path.contact_force(event.number)[solution.keep[-1]]), "torque" if contact.turns else "force"
        )
        return f"{partner} is reached at {place}; its {'moment' if contact.turns else 'force'} at the end is {force}"
    if isinstance(contact, Stop) and event.kind == "ends":
        return f"{partner} is left at {place}"
    sentences = {
        "begins": f"contact begins at {place} between {what} and {partner}",
        "ends": f"{what} leaves {partner} at {place}",
        "moves": f"the contact on {partner} moves between an end and the side of {what} at {place}",
        "spreads": f"contact spreads at {place}: {what} lies along {partner} from there on",
        "closes": f"{what} no longer lies along {partner} at {place}",
        "slips": f"{what} slides on {partner} from {place} on",
        "sticks": f"{what} sticks to {partner} from {place} on",
    }
    return sentences[event.kind]


def _gap_sentences(solution: Solution) -> Iterator[tuple[str, str]]:
    """Yield a sentence on each contact that is nearly closed, or much too far away, all along the curve."""
    path = solution.path
    changed = {event.number for event in path.contact_events}
    parts = {contact.name for contact in path.network.contacts if isinstance(contact, BeamOnBeam)}
    thin = solution.spec.mechanism.thinnest
    for number, contact in enumerate(path.network.contacts):
        numbers = numbers_of(path.network.contacts, contact.name) if contact.name in parts else [number]
        if number != numbers[0] or contact.turns:  # of two beams the first has the least gap of all
            continue
        if any(k in changed or path.contact_force(k).any() for k in numbers):
            continue
        beams = [name for name in (getattr(contact, "beam", ""), getattr(contact, "partner", "")) if name]
        moved = sum((float(np.hypot(*np.moveaxis(path.line_motion(beam), -1, 0)).max()) for beam in beams), 0.0)
        if not isinstance(contact, BeamOnObstacle | BeamOnBeam):
            moved += float(np.hypot(*path.motion(contact.node)[:, :2].T).max())
        least = float(path.contact_gap(number).min())
        # a travel up to a rigid stop ends so near to it
        closed = 1.001 * BEFORE_STOP if isinstance(contact, Stop) else 0.0
        if max(ROUNDING_OF_GAP * path.mesh.scales.length, closed) < least < NEAR_GAP * thin:
            where = f"the gap of {describe(contact)} closes to {format_short(least, 'length')} and stays open"
            yield "near_contact", f"{where}: tolerances of that size decide whether they touch"
        elif not isinstance(contact, Stop) and least > OUT_OF_REACH * moved:
            who, nearest, movement = toucher(contact), format_short(least, "length"), format_short(moved, "length")
            text = f"{who!r} comes no nearer to {counterpart(contact)!r} than {nearest}, and moves by {movement} only"
            yield "obstacle_out_of_reach", text


def _side_sentences(solution: Solution, say: Callable[[float], str]) -> Iterator[tuple[str, str]]:
    """Yield where the side of a beam lies in an obstacle, beside the pads of nodes."""
    path, mechanism, keep = solution.path, solution.spec.mechanism, solution.keep
    for name, obstacle in mechanism.obstacles.items():
        outline = obstacle.outline()
        pads, sides = pads_of(mechanism, obstacle), sides_of(mechanism, obstacle)
        # an elastic obstacle yields at its pads, and the beam with them
        pressed = [number for number in numbers_of(path.network.contacts, name)
                   if isinstance(path.network.contacts[number], NodeOnObstacle)]  # fmt: skip
        yields = max((float(-path.contact_gap(number).min()) for number in pressed), default=0.0)
        for beam, network_beam in path.network.beams.items():
            if beam in sides:
                continue
            side = states(path.network, path.take(keep).at, beam, np.linspace(0.0, 1.0, N_SIDE))
            places = np.stack([side.x, side.y], axis=-1)
            thick = thickest_of(network_beam.section)
            depth = 0.5 * thick - outline.distance(places).value
            deep = depth > MAX_PENETRATION_SHARE * thick + max(yields, 0.0)
            if deep.any():
                first = int(deep.any(axis=1).argmax())
                place = float(np.broadcast_to(side.place, depth.shape)[first, depth[first].argmax()])
                passes = f"passes through {name!r} from {say(float(path.drive[keep[first]]))} on"
                touching = ", ".join(map(repr, pads))
                yield (
                    "side_in_obstacle",
                    f"the side of beam {beam!r} {passes}, at {place:.0%} of its length, where it does not touch: only "
                    f"with {touching}; list it in 'beams'",
                )
