"""Items of a path with contacts: points, events, changes of contacts; and its pieces as states of one network.

Sides of beams touch at different places in each piece. The elements of all pieces end where any of them has a contact.
Where a contact is open its place is anywhere between its neighbours: it moves evenly from where it last was closed to
where it is next, so that states may be interpolated.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from cfmkit.elastica.contact.carried_states import carry
from cfmkit.elastica.contact.side_gaps import LoadStage
from cfmkit.elastica.mechanics.discretise import Discretisation, FlankPlace
from cfmkit.elastica.mechanics.elements import smooth_marks
from cfmkit.elastica.mechanics.march import equations
from cfmkit.numerics.continuation.path import PathEvent, PathStop, Point

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.contact.conditions import Condition
    from cfmkit.elastica.contact.piece import PieceOfPath
    from cfmkit.elastica.mechanics.problem import NetworkProblem
    from cfmkit.numerics.continuation.problem import PathEquilibrium


class ContactChange(NamedTuple):
    """The begin or end of a contact; unstable directions before and after it."""

    kind: Literal["begins", "ends", "blocks", "moves", "spreads", "closes", "slips", "sticks"]
    number: int  # of the contact in the arrays of its piece
    at: PathEquilibrium
    before: int
    after: int
    contact: int = -1  # in `Network.contacts`
    condition: Condition | None = None  # on the side of a beam, that is met
    piece: PieceOfPath | None = None  # whose unknowns `at` has; None: that of the piece before
    states: int = 1  # of friction that are possible behind it


class BeyondChange(NamedTuple):
    """A piece behind a change, where it begins, and the sense of the drive there."""

    piece: PieceOfPath
    at: PathEquilibrium
    sense: float
    n_states: int = 1  # of friction that can go on that way


class Remeshed(NamedTuple):
    """The points that follow have other unknowns: sides of beams touch at other places."""

    problem: NetworkProblem


class StatesOfPiece(NamedTuple):
    """States of one piece between two meshes: all unknowns (n, size) and drives (n,)."""

    mesh: Discretisation
    z: FloatArray
    drive: FloatArray


PathItem = Point | PathEvent | PathStop | ContactChange | Remeshed


FEWEST_APART = 0.02  # of the way between two neighbours, by which an open contact stays away from both
SAME_POINT = 1e-3  # motion by which a joined state may be corrected


class _Slot(NamedTuple):
    """A contact of the network, and the smooth part of its beam that it is on."""

    number: int
    part: int


def join_pieces(
    pieces: Sequence[StatesOfPiece], remesh: Callable[[tuple[FlankPlace, ...]], Discretisation]
) -> tuple[Discretisation, FloatArray]:
    """Return one network of elements for all pieces, and the states on it, (n, size)."""
    beams = list(pieces[0].mesh.fits.network.beams)
    network = pieces[0].mesh.fits.network
    sequences = [
        [_slot(piece.mesh, contact) for contact in piece.mesh.contacts if contact.slide >= 0] for piece in pieces
    ]
    slots: list[_Slot] = []
    for beam in beams:
        common: list[_Slot] = []
        for sequence in sequences:
            mine = [slot for slot in sequence if network.contacts[slot.number].beam == beam]  # type: ignore[union-attr]
            common = _common(common, mine)
        slots += common
    places = _places(pieces, sequences, slots)
    if not len(slots):
        return pieces[0].mesh, np.concatenate([piece.z for piece in pieces])
    mesh = remesh(tuple(FlankPlace(slot.number, place) for slot, place in zip(slots, places[0].tolist(), strict=True)))
    states, count = np.zeros((len(places), mesh.size)), 0
    sides = [contact for contact in mesh.contacts if contact.slide >= 0]
    for piece, sequence in zip(pieces, sequences, strict=True):
        used = _match_slots(sequence, slots)
        before = [contact for contact in piece.mesh.contacts if contact.slide >= 0]
        rows = slice(count, count + len(piece.drive))
        joined = carry(piece.mesh, piece.z, LoadStage(piece.drive), mesh, places[rows])
        for contact, slot in zip(before, used, strict=True):
            joined[:, sides[slot].unknown] = np.maximum(piece.z[:, contact.unknown], 0.0)
            joined[:, sides[slot].flag] = contact.laid
        states[rows] = joined
        count += len(piece.drive)
    return mesh, _correct_states(mesh, states, np.concatenate([piece.drive for piece in pieces]))


def _correct_states(mesh: Discretisation, states: FloatArray, drives: FloatArray) -> FloatArray:
    """Return states as equilibria of the elements that they are on now."""
    guess = states[:, mesh.free]
    solved = equations(mesh).solve_each(guess, drives)
    motions = mesh.free < mesh.n_motions
    close = solved.converged & (np.abs(solved.free - guess)[:, motions].max(axis=1, initial=0.0) < SAME_POINT)
    joined = states.copy()
    joined[:, mesh.free] = np.where(close[:, None], solved.free, guess)
    return joined


def _slot(mesh: Discretisation, contact: Any) -> _Slot:
    name = contact.item.beam
    marks = smooth_marks(mesh.fits.network.beams[name], mesh.fits[name])
    return _Slot(contact.number, int(np.searchsorted(marks, mesh.elements.cuts[contact.element, 1])))


def _common(first: list[_Slot], second: list[_Slot]) -> list[_Slot]:
    """Return the shortest sequence that has both sequences in it."""
    best: dict[tuple[int, int], list[_Slot]] = {}
    for i in range(len(first), -1, -1):
        for j in range(len(second), -1, -1):
            if i == len(first) or j == len(second):
                best[i, j] = first[i:] + second[j:]
            elif first[i] == second[j]:
                best[i, j] = [first[i], *best[i + 1, j + 1]]
            else:
                ways = [first[i], *best[i + 1, j]], [second[j], *best[i, j + 1]]
                best[i, j] = min(
                    ways, key=lambda sequence_tail: (len(sequence_tail), [slot.part for slot in sequence_tail])
                )
    return best[0, 0]


def _match_slots(sequence: list[_Slot], slots: list[_Slot]) -> list[int]:
    """Return which slots a sequence of contacts has."""
    joined, at = list[int](), 0
    for slot in sequence:
        at = slots.index(slot, at)
        joined.append(at)
        at += 1
    return joined


def _places(pieces: Sequence[StatesOfPiece], sequences: list[list[_Slot]], slots: list[_Slot]) -> FloatArray:
    """Return the place of every slot in every state, (n, slots)."""
    total = sum(len(piece.drive) for piece in pieces)
    closed_places = np.full((total, len(slots)), np.nan)
    count = 0
    for piece, sequence in zip(pieces, sequences, strict=True):
        rows = slice(count, count + len(piece.drive))
        for contact, slot in zip(
            (contact for contact in piece.mesh.contacts if contact.slide >= 0),
            _match_slots(sequence, slots),
            strict=True,
        ):
            closed_places[rows, slot] = piece.z[:, contact.slide]
        count += len(piece.drive)
    joined = closed_places.copy()
    for slot in range(len(slots)):
        at = np.flatnonzero(np.isfinite(closed_places[:, slot]))
        joined[:, slot] = np.interp(np.arange(total), at, closed_places[at, slot])
    network, fits = pieces[0].mesh.fits.network, pieces[0].mesh.fits
    for beam in network.beams:
        mine = [k for k, slot in enumerate(slots) if network.contacts[slot.number].beam == beam]  # type: ignore[union-attr]
        if mine:
            marks = smooth_marks(network.beams[beam], fits[beam])
            for row in range(total):
                joined[row, mine] = _place_between(
                    closed_places[row, mine], joined[row, mine], [slots[k].part for k in mine], marks
                )
    return joined


def _place_between(closed_places: FloatArray, wanted: FloatArray, parts: list[int], marks: list[float]) -> FloatArray:
    """Return places of slots along a beam in ascending order: known ones as they are, others near wanted places."""
    joined, k = wanted.copy(), 0
    while k < len(closed_places):
        if np.isfinite(closed_places[k]):
            k += 1
            continue
        end = k
        while end < len(closed_places) and not np.isfinite(closed_places[end]) and parts[end] == parts[k]:
            end += 1
        low, high = marks[parts[k] - 1], marks[parts[k]]
        low = max([low, *joined[:k].tolist()])
        high = min([high, *(value for value in closed_places[end:].tolist() if np.isfinite(value))])
        ends = np.concatenate([[low], joined[k:end], [high]])
        if not (np.diff(ends) > FEWEST_APART * (high - low)).all():
            joined[k:end] = low + (high - low) * np.arange(1, end - k + 1) / (end - k + 1)
        k = end
    return joined
