"""Gaps between the sides of two beams: how near each place of one is to the other, whose nearest place is found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.contact.edges import half_thickness_of
from cfmkit.elastica.contact.line_tangent import measure_compliances
from cfmkit.elastica.contact.side_gaps import LoadStage, SideGaps, find_lines, interpolate_line
from cfmkit.elastica.mechanics.moving_elements import cuts_at
from cfmkit.elastica.model.contact import BeamOnBeam, NodeOnBeam

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.contact.side_gaps import ElementLines
    from cfmkit.elastica.mechanics.discretise import Discretisation
    from cfmkit.elastica.model.contact import BeamSide

NEAR_DISTANCE = 0.1  # mean beam lengths within which the nearest place of a beam is found exactly
N_FOOT_STEPS = 10  # of Newton's method without the curvature: its error falls by distance times curvature in each
FOOT_RESOLUTION = 1e-12  # of an element: its square is the error of the distance


class Feet(NamedTuple):
    """Nearest places of a beam, (n, p) each."""

    place: Any  # (n, p, 2)
    parameter: Any
    is_inside: Any  # False at an end of the beam


@dataclass(frozen=True, eq=False)
class PairGaps(SideGaps):
    """Gaps of the side of one beam to another beam, which has round ends."""

    def find_kinks(self, lines: ElementLines) -> FloatArray:
        """Return how steeply the gap falls, by the kinks of both lines, from ends of elements, (n, m, 2)."""
        mesh, item, z, numbers = self.mesh, self.item, lines.z, lines.elements
        assert isinstance(item, BeamOnBeam)
        beam, kinks = mesh.fits.network.beams[item.beam], np.zeros((len(z), len(numbers), 2))
        shear = sum(measure_compliances(mesh, name, 0.5)[1] for name in (item.beam, item.partner))
        for contact in mesh.side_contacts:
            touching: Any = contact.item
            if touching.name != item.name:
                continue
            ends = [(contact.element, 1), (contact.element + 1, 0)] if touching.beam == item.beam else []
            node = touching.node if isinstance(touching, NodeOnBeam) else None
            ends += [(self.elements[0], 0)] * (node == beam.start) + [(self.elements[-1], 1)] * (node == beam.end)
            for element, end in ends:
                kinks[:, numbers == element, end] = 0.5 * shear * z[:, [contact.unknown]]
        return kinks

    def distance(self, places: Any, z: FloatArray, stage: LoadStage) -> tuple[Any, Any]:
        """Return the distances of places (n, ..., 2) from the other beam in n states, and their gradients."""
        feet = self.find_feet(places.reshape(len(z), -1, 2), z, stage)
        away = places - feet.place.reshape(places.shape)
        reach = np.hypot(away[..., 0], away[..., 1])
        return reach - half_thickness_of(self.mesh, self.item.partner), away / reach[..., None]  # type: ignore[union-attr]

    def find_feet(self, places: FloatArray, z: FloatArray, stage: LoadStage) -> Feet:
        """Return the places of the other beam that are nearest to places (n, p, 2) in n states.

        Of places that are farther than `NEAR_DISTANCE` it is the nearest of those at which the beam is sampled.
        """
        lines = find_lines(self.mesh, z, stage, self.partner_elements)
        sampled = lines.evaluate(self.fractions).place.reshape(len(z), -1, 2)
        pairs = zip(places, sampled, strict=True)  # one state after the other: together they may be too many
        nearest = np.array([((at[:, None] - line) ** 2).sum(axis=-1).argmin(axis=-1) for at, line in pairs])
        row, fraction = nearest // len(self.fractions), self.fractions[nearest % len(self.fractions)]
        place = np.take_along_axis(sampled, nearest[..., None], axis=1)
        ids = np.nonzero(np.hypot(*np.moveaxis(places - place, -1, 0)) < NEAR_DISTANCE)
        row[ids], fraction[ids], place[ids] = self._approach(places[ids], ids[0], row[ids], fraction[ids], lines)
        last = len(self.partner_elements) - 1
        is_end = ((row == 0) & (fraction == 0)) | ((row == last) & (fraction == 1))
        cuts = lines.cuts[np.arange(len(z))[:, None], row]
        return Feet(place, cuts[..., 0] + (cuts[..., 1] - cuts[..., 0]) * fraction, ~is_end)

    def _approach(
        self, places: FloatArray, states: Any, row: Any, fraction: FloatArray, lines: ElementLines
    ) -> tuple[Any, FloatArray, FloatArray]:
        """Return rows of elements, fractions and places of the feet of k places (k, 2), from nearby ones (k,)."""
        last = len(self.partner_elements) - 1
        for _ in range(N_FOOT_STEPS):
            segment = lines.start[states, row], lines.slope[states, row]
            place, tangent = interpolate_line(self.mesh.degree, fraction, *segment)
            step = ((places - place) * tangent).sum(axis=-1) / (tangent * tangent).sum(axis=-1)
            before, behind = (fraction + step < 0) & (row > 0), (fraction + step > 1) & (row < last)
            row = row - before + behind
            advanced = np.clip(np.where(before, 1.0, np.where(behind, 0.0, fraction + step)), 0.0, 1.0)
            stands = np.abs(advanced - fraction).max(initial=0.0) < FOOT_RESOLUTION
            fraction = advanced
            if stands:
                break
        segment = lines.start[states, row], lines.slope[states, row]
        place, _ = interpolate_line(self.mesh.degree, fraction, *segment)
        return row, fraction, place

    def find_partner_place(self, z: FloatArray, stage: LoadStage, parameter: float) -> float | None:
        """Return the parameter of the place of the other beam that is nearest in a state; None if it is an end."""
        cuts = cuts_at(self.mesh, z)[self.elements]
        row = int(np.clip(np.searchsorted(cuts[:, 1], parameter), 0, len(cuts) - 1))
        fraction = np.array([(parameter - cuts[row, 0]) / (cuts[row, 1] - cuts[row, 0])])
        place = find_lines(self.mesh, z[None], stage, self.elements[row : row + 1]).evaluate(fraction).place
        feet = self.find_feet(place.reshape(1, 1, 2), z[None], stage)
        return float(feet.parameter[0, 0]) if feet.is_inside[0, 0] else None


def make_gaps(
    mesh: Discretisation, item: BeamSide, touched: tuple[int, ...] = (), laid: tuple[int, ...] = ()
) -> SideGaps:
    """Return the gaps of a side: to an obstacle, to a pad, or to another beam."""
    return (PairGaps if isinstance(item, BeamOnBeam) else SideGaps)(mesh, item, touched, laid)


def least_side_gaps(mesh: Discretisation, item: BeamSide, z: FloatArray, drive: FloatArray) -> FloatArray:
    """Return the least gap of the side of a beam in each of n states, (n,) [mean beam lengths]."""
    return make_gaps(mesh, item).least(z, LoadStage(drive))
