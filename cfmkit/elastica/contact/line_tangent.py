"""Tangent of the middle line of beams that shear or stretch, with kinks at contacts; gaps without these kinks.

The line of a beam that shears has a kink under a force f along a normal n: F jumps by f n, and with it the slope x' of
the line. The place S of the contact is where P - f g is stationary. With dP/dS = [F . x' + M theta' - W], whose jump is
f n . (x'(S-) + x'(S+))/2, the mean of both tangents is along the edge. Close beside the kink the line is then beyond
the edge, by some 1e-4 of the thickness: in truth the force is spread over that length.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.contact.beam_lines import list_elements
from cfmkit.elastica.mechanics.moving_elements import lengths_at
from cfmkit.elastica.model.section import Taper

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.discretise import ContactAt, Discretisation
    from cfmkit.elastica.model.contact import BeamSide
    from cfmkit.elastica.model.section import Section


FLAT_END_MARGIN = 1e-3  # share of what a kink lowers: its square
KINK_REACH = 2.0  # thicknesses along which a force at a point counts as spread


def line_leaves_normal(section: Section) -> bool:
    """Return True if the slope of a beam's side does not follow from the rotation of its section alone."""
    return section.shear or (section.axial and isinstance(section.thickness, Taper))


class Compliances(NamedTuple):
    """Dimensionless compliances of a section."""

    axial: float
    shear: float


def measure_compliances(mesh: Discretisation, beam: str, place: float) -> Compliances:
    """Return 1/EA and 1/GA of a beam at a parameter, dimensionless."""
    fitted, section = mesh.fits[beam], mesh.fits.network.beams[beam].section
    along = np.real(fitted.arc(np.array([place])))
    _, axial, shear = section.rigidities(along, float(along[0]))
    return Compliances(*(float(np.ravel(value)[0]) * mesh.scales.force for value in (axial, shear)))


def round_off(gap: Any, slope: Any, behind: Any, ahead: Any, kinks: FloatArray, reach: Any) -> tuple[Any, Any]:
    """Return gaps and slopes without the kinks (..., 2) at both ends of elements, at ways (..., k) or (...) from these.

    The fall of the gap is taken off up to a reach from them: it is that of a force at a point.
    """
    for far, kink, sense in ((behind, kinks[..., 0], 1.0), (ahead, kinks[..., 1], -1.0)):
        kink = kink[..., None] if np.ndim(far) > np.ndim(kink) else kink
        share = np.clip(far / reach, 0.0, 1.0)
        taken = (1 - share) ** 2 * (1 + 2 * share)
        gap = gap + kink * far * taken
        slope = slope + sense * kink * (taken - 6 * share**2 * (1 - share))
    return gap, slope


def find_reach(mesh: Discretisation, item: BeamSide, elements: Any) -> FloatArray:
    """Return how far from kinks at ends of elements these are taken off, (m, 1): all of it up to an end with a pad."""
    network = mesh.fits.network
    beam, elements_of_beam = network.beams[item.beam], list_elements(mesh, item.beam)
    pads = [getattr(contact, "node", "") for contact in network.contacts if contact.name == item.name]
    loose = [k for k, node in ((elements_of_beam[0], beam.start), (elements_of_beam[-1], beam.end)) if node in pads]
    reach = KINK_REACH * beam.section.thinnest / mesh.scales.length
    return np.where(np.isin(elements, loose), np.inf, reach)[:, None]


def raise_pad(mesh: Discretisation, pad: ContactAt, z: FloatArray) -> FloatArray:
    """Return by how much the kink where a side touches brings the pad at its end nearer to the same edge, (n,).

    In truth what is beyond the force is parallel to the edge there.
    """
    total, beams = np.zeros(len(z)), mesh.fits.network.beams
    for contact in mesh.side_contacts:
        side: Any = contact.item
        beam, elements = beams[side.beam], list_elements(mesh, side.beam)
        if side.name != pad.item.name or not beam.section.shear:
            continue
        ends = (contact.element, elements[0], beam.start), (contact.element + 1, elements[-1], beam.end)
        for beside, element, node in ends:
            if beside == element and node == getattr(pad.item, "node", None):
                shear = measure_compliances(mesh, side.beam, float(mesh.elements.cuts[contact.element, 1])).shear
                total += 0.5 * shear * z[:, contact.unknown] * lengths_at(mesh, z, element) * (1 + FLAT_END_MARGIN)
    return total


class LineTangent(NamedTuple):
    """The slope x' of the middle line along a normal, with its derivatives; all axes in front are those of states."""

    across: Any  # (...) n . x'
    by_turn: Any  # (...) by the rotation of the section
    by_force: Any  # (..., 2) by the section force
    slope: FloatArray  # (..., 2) x': also the derivative by the normal


def measure_line_tangent(angle: Any, normal: Any, force: Any, axial: float, shear: float) -> LineTangent:
    """Return the slope of a line where its section has an angle (...) and a force (..., 2), along normals (..., 2)."""
    along = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    across = np.stack([-along[..., 1], along[..., 0]], axis=-1)
    tension, thrust = (force * along).sum(axis=-1), (force * across).sum(axis=-1)
    cos, sin = (normal * along).sum(axis=-1), (normal * across).sum(axis=-1)
    stretch, slip = 1 + axial * tension, shear * thrust
    return LineTangent(
        stretch * cos + slip * sin,
        stretch * sin + axial * thrust * cos - slip * cos - shear * tension * sin,
        axial * cos[..., None] * along + shear * sin[..., None] * across,
        stretch[..., None] * along + slip[..., None] * across,
    )
