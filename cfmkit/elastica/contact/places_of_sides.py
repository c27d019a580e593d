"""Places at which sides of beams touch: new, remaining, with a pad instead, or spread to a length on an obstacle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.contact.conditions import NEW_PLACE, PAD_OF_SIDE, ROUNDING_OF_KIND
from cfmkit.elastica.contact.edges import find_mate
from cfmkit.elastica.contact.pair_gaps import PairGaps
from cfmkit.elastica.contact.side_gaps import LoadStage
from cfmkit.elastica.mechanics.discretise import Discretisation, FlankPlace
from cfmkit.elastica.mechanics.moving_elements import PLACE_STEP
from cfmkit.elastica.model.contact import BeamOnBeam, BeamOnObstacle, NodeOnBeam
from cfmkit.elastica.model.section import Taper
from cfmkit.elastica.model.shapes import Polynomial

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.contact.conditions import Condition
    from cfmkit.elastica.contact.piece import PieceOfPath
    from cfmkit.elastica.model.contact import BeamSide
    from cfmkit.numerics.continuation.problem import PathEquilibrium


NO_TENSION = 1e-9  # share of a force along an obstacle that is none
STRAIGHT_TURN = 1e-9  # turn of an unloaded beam that is none [rad]


def may_lie(piece: PieceOfPath, item: BeamSide, parameter: float) -> bool:
    """Return True if a side takes on another curvature where it lies on an obstacle."""
    is_round = not isinstance(item, BeamOnObstacle) or len(item.outline.radius) > 0
    return is_round or abs(_measure_unloaded_bend(piece, item, parameter)) > STRAIGHT_TURN


def _measure_unloaded_bend(piece: PieceOfPath, item: BeamSide, parameter: float) -> float:
    """Return the curvature of an unloaded beam by its parameter [rad]."""
    fitted = piece.whole.mesh.fits[item.beam]
    sides = [float(np.real(fitted.angle(parameter + step, parameter))) for step in (PLACE_STEP, -PLACE_STEP)]
    return (sides[0] - sides[1]) / (2 * PLACE_STEP)


def presses_where_it_spreads(piece: PieceOfPath, item: BeamOnObstacle, place: Any, force: Any, angle: float) -> bool:
    """Return True if a side that spreads lies on the obstacle; else it touches at points, with a free part between.

    Where nothing pulls along a round obstacle it is tried: with what lies there the tension grows, or is none.
    """
    mesh = piece.whole.mesh
    bulge = float(item.outline.distance(np.asarray(place) * mesh.scales.length).curvature)
    if bulge:
        tension = float(np.array([np.cos(angle), np.sin(angle)]) @ force)
        return bool(np.sign(bulge) * tension > -NO_TENSION * float(np.hypot(*force)))
    return True


def why_not_laid(piece: PieceOfPath, item: BeamSide) -> str:
    """Return why a beam cannot lie on an obstacle along a length; empty if it can."""
    if not isinstance(item, BeamOnObstacle):
        return "between parts of the mechanism that is not modelled"
    beam = piece.whole.mesh.fits.network.beams[item.beam]
    shape, section = beam.shape, beam.section
    if section.shear:
        return "with shear deformation that is not modelled: leave it out of the beam"
    if isinstance(section.thickness, Taper) or not isinstance(shape, Polynomial) or len(shape.coefficients) > 2:
        return "that is modelled for beams of one thickness and curvature only"
    return ""


def guess_laid(mesh: Discretisation, z: FloatArray, element: int, tension: float) -> None:
    """Put what is known of an element that lies on an obstacle into a state."""
    side_contact = mesh.elements.unknowns[element]
    z[side_contact[8:-2]] = 0.0
    z[side_contact[-2]], z[side_contact[-1]] = tension, 0.0


def presses(piece: PieceOfPath, at: PathEquilibrium) -> bool:
    """Return True if everything that lies on an obstacle presses on it."""
    whole, rows = piece.grow(at), piece.conditions.rows_of("pulls")
    return all(piece.measure_condition(whole, row) > -ROUNDING_OF_KIND["pulls"] for row in rows)


def find_nearest_places(
    piece: PieceOfPath, condition: Condition, at: PathEquilibrium, parameter: float
) -> list[FlankPlace]:
    """Return the place at which a side is nearest, of two beams that of each; none where one is an end."""
    places = [FlankPlace(condition.number, parameter)]
    gaps = piece.conditions.gaps_of(condition.item)
    if isinstance(gaps, PairGaps):
        stage = LoadStage.from_problem(piece.whole, np.array([at.drive]))
        on_partner = gaps.find_partner_place(piece.whole.values(at.x, at.drive), stage, parameter)
        places += [] if on_partner is None else [FlankPlace(find_partner(piece, condition.number), on_partner)]
        places = places if len(places) > 1 else []
    return places if all(0.5 * NEW_PLACE < place.parameter < 1 - 0.5 * NEW_PLACE for place in places) else []


def find_partner(piece: PieceOfPath, number: int) -> int:
    """Return the number in `Network.contacts` of the other beam of a pair."""
    items = piece.whole.mesh.fits.network.contacts
    pair: Any = items[number]
    partner = BeamOnBeam(pair.name, pair.partner, pair.beam, not pair.leads)
    return items.index(partner)


def find_pads_at(piece: PieceOfPath, condition: Condition, end: float) -> list[int]:
    """Return the numbers of the pads of the node at the end of a beam that is near, on what the side may touch.

    They are numbers in the arrays; of pads on beams, which are there only while they touch, in `Network.contacts`.
    """
    mesh, kind = piece.whole.mesh, PAD_OF_SIDE.get(type(condition.item), ())
    beam = mesh.fits.network.beams[condition.item.beam]
    node = beam.end if end > 0.5 else beam.start
    items = mesh.fits.network.contacts if kind is NodeOnBeam else [contact.item for contact in mesh.contacts]
    return [
        k
        for k, item in enumerate(items)
        if isinstance(item, kind) and item.name == condition.item.name and item.node == node
    ]


def list_remaining_places(piece: PieceOfPath, *numbers: int) -> list[FlankPlace]:
    """Return the places at which sides touch but for some contacts, and what lay on an obstacle beside these."""
    mesh = piece.whole.mesh
    pairs = [contact.item for k, contact in enumerate(mesh.contacts) if k in numbers]
    mates = [find_mate(mesh, item) for item in pairs if isinstance(item, BeamOnBeam)]
    numbers = (*numbers, *(mesh.contacts.index(mate) for mate in mates))
    return [
        FlankPlace(
            contact.number,
            float(mesh.elements.cuts[contact.element, 1]),
            0 if k + contact.laid in numbers else contact.laid,
        )
        for k, contact in enumerate(mesh.contacts)
        if contact.slide >= 0 and k not in numbers
    ]


def lay_anew(piece: PieceOfPath, number: int, laid: int) -> PieceOfPath:
    """Return the piece in which the side beside a contact lies on its obstacle, or does not."""
    mesh = piece.whole.mesh
    return piece.with_flanks([
        FlankPlace(contact.number, float(mesh.elements.cuts[contact.element, 1]), laid if k == number else contact.laid)
        for k, contact in enumerate(mesh.contacts)
        if contact.slide >= 0
    ], piece.closed)  # fmt: skip
