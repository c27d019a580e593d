"""Places at which sides of beams touch: those that are new, that remain, or that a pad takes over."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.contact.edges import find_mate
from cfmkit.elastica.contact.pair_gaps import PairGaps
from cfmkit.elastica.contact.side_conditions import NEW_PLACE, PAD_OF_SIDE
from cfmkit.elastica.contact.side_gaps import LoadStage
from cfmkit.elastica.mechanics.discretise import FlankPlace
from cfmkit.elastica.model.contact import BeamOnBeam, NodeOnBeam

if TYPE_CHECKING:
    from cfmkit.elastica.contact.changes import PieceOfPath
    from cfmkit.elastica.contact.side_conditions import SideCondition
    from cfmkit.numerics.continuation.problem import PathEquilibrium


def find_nearest_places(
    piece: PieceOfPath, condition: SideCondition, at: PathEquilibrium, parameter: float
) -> list[FlankPlace]:
    """Return the place at which a side is nearest, of two beams that of each; none where one is an end."""
    places = [FlankPlace(condition.number, parameter)]
    gaps = piece.sides.gaps_of(condition.item)
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


def find_pads_at(piece: PieceOfPath, condition: SideCondition, end: float) -> list[int]:
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
