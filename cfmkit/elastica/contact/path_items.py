"""Items of a path with contacts (points, events, changes of contacts), and its pieces joined as states of one network.

The elements of all pieces end where any of them has a contact. Where a contact is open its place is anywhere between
its neighbours: it moves evenly from where it last was closed to where it is next, so that states may be interpolated.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Literal, NamedTuple

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

    beam: int
    part: int
    number: int


def join_pieces(
    pieces: Sequence[StatesOfPiece], remesh: Callable[[tuple[FlankPlace, ...]], Discretisation]
) -> tuple[Discretisation, FloatArray]:
    """Return one network of elements for all pieces, and the states on it, (n, size)."""
    slots: list[_Slot] = []
    for piece in pieces:
        slots = _shortest_common_sequence(slots, _slots_of(piece.mesh))
    if not slots:
        return pieces[0].mesh, np.concatenate([piece.z for piece in pieces])
    ends = np.cumsum([0, *(len(piece.drive) for piece in pieces)]).tolist()
    rows = [slice(*pair) for pair in itertools.pairwise(ends)]
    used = [_match_slots(_slots_of(piece.mesh), slots) for piece in pieces]
    places = np.full((ends[-1], len(slots)), np.nan)
    for piece, some, numbers in zip(pieces, rows, used, strict=True):
        for contact, slot in zip(piece.mesh.side_contacts, numbers, strict=True):
            places[some, slot] = piece.z[:, contact.slide]
    places = _fill_places(pieces[0].mesh, places, slots)
    mesh = remesh(tuple(FlankPlace(slot.number, place) for slot, place in zip(slots, places[0].tolist(), strict=True)))
    states, sides = np.zeros((ends[-1], mesh.size)), mesh.side_contacts
    for piece, some, numbers in zip(pieces, rows, used, strict=True):
        states[some] = carry(piece.mesh, piece.z, LoadStage(piece.drive), mesh, places[some])
        for contact, slot in zip(piece.mesh.side_contacts, numbers, strict=True):
            states[some, sides[slot].unknown] = np.maximum(piece.z[:, contact.unknown], 0.0)
            states[some, sides[slot].flag] = contact.laid
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


def _slots_of(mesh: Discretisation) -> list[_Slot]:
    slots, names = list[_Slot](), list(mesh.fits.network.beams)
    for contact in mesh.side_contacts:
        beam: str = contact.item.beam  # type: ignore[union-attr]
        marks = smooth_marks(mesh.fits.network.beams[beam], mesh.fits[beam])
        part = int(np.searchsorted(marks, mesh.elements.cuts[contact.element, 1]))
        slots.append(_Slot(names.index(beam), part, contact.number))
    return slots


def _shortest_common_sequence(first: list[_Slot], second: list[_Slot]) -> list[_Slot]:
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
                best[i, j] = min(ways, key=lambda tail: (len(tail), [slot[:2] for slot in tail]))
    return best[0, 0]


def _match_slots(sequence: list[_Slot], slots: list[_Slot]) -> list[int]:
    """Return which slots a sequence of contacts has."""
    joined, at = list[int](), 0
    for slot in sequence:
        at = slots.index(slot, at)
        joined.append(at)
        at += 1
    return joined


def _fill_places(mesh: Discretisation, closed_places: FloatArray, slots: list[_Slot]) -> FloatArray:
    """Return the place of every slot in every state, from known ones (n, slots): nan where it is open."""
    joined, total = closed_places.copy(), len(closed_places)
    for slot in range(len(slots)):
        at = np.flatnonzero(np.isfinite(closed_places[:, slot]))
        joined[:, slot] = np.interp(np.arange(total), at, closed_places[at, slot])
    for number, (name, beam) in enumerate(mesh.fits.network.beams.items()):
        mine = [k for k, slot in enumerate(slots) if slot.beam == number]
        parts, marks = [slots[k].part for k in mine], smooth_marks(beam, mesh.fits[name]) if mine else []
        for row in range(total if mine else 0):
            joined[row, mine] = _place_between(closed_places[row, mine], joined[row, mine], parts, marks)
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
