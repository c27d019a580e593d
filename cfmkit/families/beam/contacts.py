"""Forces of contacts along the curve of a beam mechanism: columns, scalar results and findings."""

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
    groups_of_contact = [
        numbers for (contact_name, _), numbers in groups(path.network.contacts).items() if contact_name == name
    ]
    return np.asarray(sum(signed_force(path, numbers) for numbers in groups_of_contact))


def contact_columns(solution: Solution) -> LazyColumns:
    """Return the force of each stop and each pad at every point of the curve, and what happens there; when read."""
    columns = LazyMapping(("all",), lambda _: _columns(solution))
    names = _column_names(solution) if solution.path.network.contacts else []
    return {
        name: partial(lambda column: columns["all"][column], name) for name in [*names, *(["event"] if names else [])]
    }


def _column_names(solution: Solution) -> list[str]:
    """Return the names of all columns: of the side of a beam also those of where it touches."""
    forces = [column for _, column in column_names(solution.spec.mechanism)]
    contacts, names = solution.path.network.contacts, list[str]()
    for column, numbers in zip(forces, groups(contacts).values(), strict=True):
        names.append(column)
        names += _place_columns(contacts[numbers[0]], column)
        if any(contacts[number].friction for number in numbers):
            names += friction_columns(column)
    return names


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


def _columns(solution: Solution) -> dict[str, Column]:
    path, keep = solution.path, solution.keep
    names = [column for _, column in column_names(solution.spec.mechanism)]
    columns = {}
    for column, numbers in zip(names, groups(path.network.contacts).values(), strict=True):
        contact = path.network.contacts[numbers[0]]
        columns[column] = Column(signed_force(path, numbers)[keep], "torque" if contact.turns else "force")
        if any(path.network.contacts[number].friction for number in numbers):
            tangential, state = friction_columns(column)
            rubbing = [path.contact_friction(number) for number in numbers]
            signs = [getattr(path.network.contacts[number], "sense", 1.0) for number in numbers]
            total = np.sum([sign * force for sign, (force, _) in zip(signs, rubbing, strict=True)], axis=0)
            columns[tangential] = Column(total[keep], "force")
            said = [np.asarray(states)[keep] for _, states in rubbing]
            columns[state] = Column(
                np.array(["".join(marks_of_pose) for marks_of_pose in zip(*said, strict=True)], np.str_), "text"
            )
        place_columns = _place_columns(contact, column)
        if place_columns:
            places = _place_values(path, numbers)[keep]
            columns |= {name: Column(places[:, k], "ratio") for k, name in enumerate(place_columns)}
    marks = np.full(len(path), "", dtype=object)
    for event in path.contact_events:
        point = int(np.abs(np.where(path.changes_contact, path.drive, np.inf) - event.drive).argmin())
        marks[point] = f"{marks[point]}; {_mark(path, event)}".removeprefix("; ")
    return columns | {"event": Column(np.array([str(mark) for mark in marks[keep]], np.str_), "text")}


def _mark(path: Path, event: ContactEvent) -> str:
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
        motion = solution.on_path(path_at_changes).motion
        return float(motion[int(np.abs(path_at_changes.drive - first.drive).argmin())])
    closed = any(path.contact_force(number)[0] > 0 for number in range(len(contacts)))
    return float(solution.motion[0]) if closed else None


def force_extremes(
    solution: Solution, name: str, window: tuple[float, float]
) -> tuple[float, float] | tuple[None, None]:
    """Return the largest and the smallest force of a contact in a window [N]; None of a window that is not reached."""

    def signed_force(path: Path, sign: float) -> FloatArray:
        return sign * named_force(path, name)[None]

    top, bottom = (largest(solution, partial(signed_force, sign=sign), window) for sign in (1.0, -1.0))
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
    resting = [
        describe(contact) for number, contact in enumerate(path.network.contacts) if path.contact_force(number)[0] > 0
    ]
    before = [f"closed before the drive moves: {', '.join(resting)}"] if resting else []
    yield from change_sentences(solution, say, before)
    rubbing = [number for number, contact in enumerate(path.network.contacts) if contact.friction]
    sliding = [number for number in rubbing if "slip" in path.contact_friction(number)[1][solution.keep]]
    if sliding:
        names = ", ".join(describe(path.network.contacts[number]) for number in sliding[:MOST_NAMED])
        message = f"{names} slides: 'stable' says there only that the drive passes no limit point"
        yield "stability_of_sliding", message
    yield from _gap_sentences(solution)
    yield from _side_sentences(solution, say)


def change_sentences(
    solution: Solution, say: Callable[[float], str], before: Sequence[str] = ()
) -> Iterator[tuple[str, str]]:
    """Yield the same on what changes along a curve, behind sentences on what was before it."""
    path = solution.path
    sentences = [_sentence(solution, event, say(event.drive)) for event in path.contact_events]
    told = [*before, *(text for text in sentences if text)]
    if told:
        more = f"; and {len(told) - MOST_NAMED} more changes" if len(told) > MOST_NAMED else ""
        yield "contact_begins", "; ".join(told[:MOST_NAMED]) + more
    for event in path.contact_events:
        if event.states > 1:
            who = describe(path.network.contacts[event.number])
            yield (
                "friction_not_unique",
                f"where {who} changes at {say(event.drive)}, friction leaves {event.states} states that can go on: "
                f"{_state_taken(path, event)}",
            )
        if event.kind == "spreads" and isinstance(path.network.contacts[event.number], NodeOnBeam | BeamOnBeam):
            who = describe(path.network.contacts[event.number])
            yield (
                "contact_spreads_between_beams",
                f"contact of {who} spreads along a length at {say(event.drive)}: that is not modelled between parts, "
                "and the curve ends there",
            )
        if event.kind == "blocks":
            who = describe(path.network.contacts[event.number])
            yield "blocked", f"the drive is blocked by {who} at {say(event.drive)}"


def _state_taken(path: Path, event: ContactEvent) -> str:
    """Return which of several states of friction the curve goes on with: that of the next point."""
    at = int(np.abs(np.where(path.changes_contact, path.drive, np.inf) - event.drive).argmin())
    state = str(path.contact_friction(event.number)[1][min(at + 1, len(path) - 1)])
    return {"stick": "it sticks here", "slip": "it slides here"}.get(state, "it leaves here")


def describe(contact: Contact) -> str:
    """Return what a contact is called."""
    return (
        f"stop {contact.name!r}" if isinstance(contact, Stop) else f"{toucher(contact)!r} on {counterpart(contact)!r}"
    )


def _sentence(solution: Solution, event: ContactEvent, place: str) -> str:
    contact, path = solution.path.network.contacts[event.number], solution.path
    if event.kind == "blocks" or (event.kind == "spreads" and isinstance(contact, NodeOnBeam | BeamOnBeam)):
        return ""
    if not isinstance(contact, Stop):
        what, partner = toucher(contact), counterpart(contact)
        sentences = {
            "begins": f"contact begins at {place} between {what!r} and {partner!r}",
            "ends": f"{what!r} leaves {partner!r} at {place}",
            "moves": f"the contact on {partner!r} moves between an end and the side of {what!r} at {place}",
            "spreads": f"contact spreads at {place}: {what!r} lies along {partner!r} from there on",
            "closes": f"{what!r} no longer lies along {partner!r} at {place}",
            "slips": f"{what!r} slides on {partner!r} from {place} on",
            "sticks": f"{what!r} sticks to {partner!r} from {place} on",
        }
        return sentences[event.kind]
    if event.kind in ("slips", "sticks"):
        does = "slides on" if event.kind == "slips" else "sticks to"
        return f"{contact.node!r} {does} stop {contact.name!r} from {place} on"
    if event.kind == "ends":
        return f"stop {contact.name!r} is left at {place}"
    last = float(path.contact_force(event.number)[solution.keep[-1]])
    force = format_short(last, "torque" if contact.turns else "force")
    return f"stop {contact.name!r} is reached at {place}; its {'moment' if contact.turns else 'force'} at the end is " \
        f"{force}"  # fmt: skip


def _gap_sentences(solution: Solution) -> Iterator[tuple[str, str]]:
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
        gap = path.contact_gap(number)
        moved = 0.0
        if isinstance(contact, BeamSide):
            moved = float(np.hypot(*np.moveaxis(path.line_motion(contact.beam), -1, 0)).max())
        if isinstance(contact, BeamOnBeam):
            moved += float(np.hypot(*np.moveaxis(path.line_motion(contact.partner), -1, 0)).max())
        elif not isinstance(contact, BeamOnObstacle):
            moved += float(np.hypot(*path.motion(contact.node)[:, :2].T).max())
        least = float(gap.min())
        # a travel up to a rigid stop ends so near to it
        closed = 1.001 * BEFORE_STOP if isinstance(contact, Stop) else 0.0
        if max(ROUNDING_OF_GAP * path.mesh.scales.length, closed) < least < NEAR_GAP * thin:
            where = f"the gap of {describe(contact)} closes to {format_short(least, 'length')} and stays open"
            yield "near_contact", f"{where}: tolerances of that size decide whether they touch"
        elif not isinstance(contact, Stop) and least > OUT_OF_REACH * moved:
            yield (
                "obstacle_out_of_reach",
                f"{toucher(contact)!r} comes no nearer to {counterpart(contact)!r} than "
                f"{format_short(least, 'length')}, and moves by {format_short(moved, 'length')} only",
            )


def _side_sentences(solution: Solution, say: Callable[[float], str]) -> Iterator[tuple[str, str]]:
    """Yield where the side of a beam lies in an obstacle, beside the pads of nodes."""
    path, mechanism, keep = solution.path, solution.spec.mechanism, solution.keep
    for name, obstacle in mechanism.obstacles.items():
        outline = obstacle.outline()
        pads, sides = pads_of(mechanism, obstacle), sides_of(mechanism, obstacle)
        for beam, network_beam in path.network.beams.items():
            if beam in sides:
                continue
            side = states(path.network, path.take(keep).at, beam, np.linspace(0.0, 1.0, N_SIDE))
            places = np.stack([side.x, side.y], axis=-1)
            depth = 0.5 * thickest_of(network_beam.section) - outline.distance(places).value
            slack = MAX_PENETRATION_SHARE * thickest_of(network_beam.section)
            # an elastic obstacle yields at its pads, and the beam with them
            yields = max((float(-path.contact_gap(k).min()) for k, contact in enumerate(path.network.contacts)
                          if isinstance(contact, NodeOnObstacle) and contact.name == name and contact.node in pads),
                         default=0.0)  # fmt: skip
            deep = depth > slack + max(yields, 0.0)
            if deep.any():
                first = int(deep.any(axis=1).argmax())
                place = float(np.broadcast_to(side.place, depth.shape)[first, depth[first].argmax()])
                yield (
                    "side_in_obstacle",
                    f"the side of beam {beam!r} passes through {name!r} from {say(float(path.drive[keep[first]]))} on, "
                    f"at {place:.0%} of its length, where it does not touch: only with {', '.join(map(repr, pads))}; "
                    "list it in 'beams'",
                )
