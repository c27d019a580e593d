"""Positions, rotations and section forces at any places of a beam, from the unknowns of its elements.

The rotation is the polynomial of the element. The force on a section is that on the element's end plus the line load
ahead; positions and the bending moment are integrals along the element, of polynomials through its Gauss points,

    X(s) = X0 + int dX/ds ds,    M(s) = M0 - int Q (1 + (1/EA - 1/GA) N) ds,    M0 = -dP/d(rotation of the start):

by equilibrium the moment is as accurate as the force; EI times the change of curvature is one order worse.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.polynomials import basis, integrals, interpolation, shape_functions
from cfmkit.elastica.mechanics.poses import poses
from cfmkit.elastica.mechanics.wide_strip import bending

if TYPE_CHECKING:
    from cfmkit.elastica.mechanics.design_derivatives import Equilibria
    from cfmkit.elastica.mechanics.discretise import Discretisation
    from cfmkit.elastica.model.network import Network


class BeamStates(NamedTuple):
    """States at k places of a beam at p points, (p, k) each unless said otherwise; SI.

    The force is what the part after a section exerts on the part before it, in global axes.
    """

    place: Any  # (k,) fraction of the arc length
    x: Any  # [m]
    y: Any
    turn: Any  # rotation of the section from rest [rad]
    angle: Any  # (k,) of the axis at rest [rad]
    h: Any  # force along x [N]
    v: Any  # force along y [N]
    moment: Any  # [N m]
    thickness: Any  # (k,) [m]


def elements_of(network: Discretisation, beam: str) -> list[int]:
    """Return the elements of a beam, in order."""
    return [number for number, name in enumerate(network.elements.beam) if name == beam]


def states(net: Network, at: Equilibria, beam: str, fractions: Any) -> BeamStates:
    """Return states at the same fractions (k,) of each element of a beam, element after element.

    Parameters
    ----------
    net : Network
        The model that `at` is of.
    at : Equilibria
        Real, or with a complex step.
    beam : str
        Its name.
    fractions : (k,) array
        Places on every element as fractions of its parameter, from 0 to 1.
    """
    parts = [element_states(net, at, beam, element, fractions) for element in elements_of(at.network, beam)]
    return BeamStates(*(np.concatenate(columns, axis=-1) for columns in zip(*parts, strict=True)))


def element_states(net: Network, at: Equilibria, beam: str, element: int, fractions: Any) -> BeamStates:
    """Return states at fractions (k,) of one element."""
    network, scales, given = at.network, at.network.scales, tuple(np.asarray(fractions, float).tolist())
    rule, e, fitted = basis(network.degree), network.elements, network.fits[beam]
    values, cumulated, through = _matrices(network.degree, given)
    one = _one_element(network, element)
    fields = energy.fields(one, at.z, at.drive)
    speed = (e.weight[element] / rule.weights)[None]
    own = at.z[:, e.unknowns[element]]
    rotation = own[:, energy.rotation_columns(network.degree)]
    start = poses(network.attachments, at.z, e.ends[element, :1]).place[:, 0]
    slope_x, slope_y, normal, shear, curvature = (
        getattr(fields, name)[:, 0] for name in ("slope_x", "slope_y", "normal", "shear", "curvature")
    )
    softer = e.axial[element] - e.shear[element]
    turning = shear * (1 + softer * normal)
    first = e.weight[element] * bending(one.elements, curvature[:, None]).moment[:, 0]
    moment = -(first @ rule.slopes[:, 0] - (e.weight[element] * turning) @ rule.values[:, 0])
    load = energy.line_load(network, at.drive)[..., element, :]
    ahead = e.length[element] - cumulated @ speed[0]
    force = own[:, None, -2:] + load[:, None, :] * ahead[:, None]
    left, right = network.elements.cuts[element]
    t, inside = left + (right - left) * np.array(given), 0.5 * (left + right)
    known = left + (right - left) * rule.places
    bent = e.angle[element] - (fitted.angle(known, inside) + 0.0 * known)  # an imperfection
    angle = fitted.angle(t, inside) + 0.0 * t + through @ bent
    place = fitted.arc(t)
    thickness = net.beams[beam].section.thickness_at(place, float(np.real(fitted.arc(inside)))) + 0.0 * t
    return BeamStates(
        place,
        (start[:, :1] + (slope_x * speed) @ cumulated.T) * scales.length,
        (start[:, 1:] + (slope_y * speed) @ cumulated.T) * scales.length,
        rotation @ values.T,
        angle,
        force[..., 0] * scales.force,
        force[..., 1] * scales.force,
        (moment[:, None] - (turning * speed) @ cumulated.T) * scales.moment,
        thickness,
    )


@lru_cache(maxsize=64)
def _matrices(degree: int, fractions: tuple[float, ...]) -> tuple[Any, Any, Any]:
    """Return shape functions at fractions, integrals up to them and interpolation to them from the Gauss points."""
    rule, ends = basis(degree), np.array(fractions)
    return shape_functions(degree, ends)[0], integrals(rule.places, ends), interpolation(rule.places, ends)


def _one_element(network: Discretisation, element: int) -> Any:
    """Return the network as `energy.fields` sees it, with one element."""
    from dataclasses import replace

    e = network.elements
    one = slice(element, element + 1)
    named = {name: table[one] for name, table in e._asdict().items() if table is not None}
    return replace(network, elements=e._replace(**named))


def unloaded(net: Network, at: Equilibria, beam: str, fractions: Any) -> Any:
    """Return the places before any load, (k, 2) [m], at the fractions of `states`."""
    from cfmkit.elastica.mechanics.design_derivatives import Equilibria

    rest = Equilibria(at.network, np.zeros((1, at.network.size)), np.zeros(1))
    line = at.network.elements.line[:, 0]
    if line.any():  # without its loads
        from dataclasses import replace

        bare = at.network.elements._replace(line=0.0 * at.network.elements.line)
        rest = Equilibria(replace(at.network, elements=bare), rest.z, rest.drive)
    found = states(net, rest, beam, fractions)
    return np.stack([found.x[0], found.y[0]], axis=-1)


class BeamSections(NamedTuple):
    """Section forces and stresses at places of a beam, (p, k) each."""

    place: Any  # fraction of the arc length
    moment: Any  # [N m]
    normal: Any  # [N], tension positive
    shear: Any  # [N]
    bending_stress: Any  # largest of the section, M t / 2I [Pa]
    axial_stress: Any  # N / A [Pa]

    def stress(self, axial: bool = True) -> Any:
        """Return the largest magnitude over the section [Pa], without the axial part if so requested."""
        bending = np.abs(self.bending_stress)
        return bending + np.abs(self.axial_stress) if axial else bending


def sections(net: Network, beam: str, found: BeamStates) -> BeamSections:
    """Return section forces and stresses from states of a beam."""
    angle = found.angle + found.turn
    cos, sin = np.cos(angle), np.sin(angle)
    normal, shear = found.h * cos + found.v * sin, found.v * cos - found.h * sin
    area = net.beams[beam].section.width * found.thickness
    bending = 6 * found.moment / (area * found.thickness)
    place = np.broadcast_to(found.place, found.moment.shape)
    return BeamSections(place, found.moment, normal, shear, bending, normal / area)
