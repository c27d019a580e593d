"""Positions, rotations and section forces at any places of a beam, from the unknowns of its elements.

The force on a section is that on the element's end plus the line load ahead; positions, the bending moment and, from
it, the rotation are integrals along the element, of polynomials through its Gauss points,

    X(s) = X0 + int dX/ds ds,    M(s) = M0 - int Q (1 + (1/EA - 1/GA) N) ds,    M0 = -dP/d(rotation of the start),
    phi(s) = phi0 + int M/EI ds:

by equilibrium the moment is as accurate as the force; EI times the change of curvature is one order worse, and so is
the polynomial of the rotation between its ends. Of wide strips, whose law is not inverted, the rotation is that.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.designs import CURLING, design_of
from cfmkit.elastica.mechanics.polynomials import basis, integrals, integrals_to_points, interpolation, shape_functions
from cfmkit.elastica.mechanics.poses import poses
from cfmkit.elastica.mechanics.wide_strip import bending

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.design_derivatives import Equilibria
    from cfmkit.elastica.mechanics.designs import NetworkDesigns
    from cfmkit.elastica.mechanics.discretise import BeamElements, Discretisation
    from cfmkit.elastica.model.network import Network


class BeamStates(NamedTuple):
    """States at k places of a beam at p points, (p, k) each unless said otherwise; SI.

    Of several designs they have an axis before.

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
    return _joined([element_states(net, at, beam, k, fractions) for k in elements_of(at.network, beam)])


def _joined(parts: list[BeamStates]) -> BeamStates:
    return BeamStates(*(np.concatenate(columns, axis=-1) for columns in zip(*parts, strict=True)))


def element_states(net: Network, at: Equilibria, beam: str, element: int, fractions: Any) -> BeamStates:
    """Return states at fractions (k,) of one element."""
    given = np.asarray(fractions, float)
    rest = _rest(net, at.network, beam, element, given)
    return _element_states(at, element, given, rest)


def states_of_designs(designs: NetworkDesigns, stepped: Equilibria, beam: str, fractions: Any) -> BeamStates:
    """Return the states of all designs: arrays (d, p, k); those that do not change along the path (d, 1, k).

    Parameters
    ----------
    designs : NetworkDesigns
        A complex step in each of d variables.
    stepped : Equilibria
        Their equilibria as one: unknowns (d, p, size), tables of all designs (d, 1, e, q).
    beam : str
        Its name.
    fractions : (k,) array
        As of `states`.
    """
    given, parts = np.asarray(fractions, float), []
    for element in elements_of(designs.template, beam):
        each = (_rest(net, design_of(designs, d), beam, element, given) for d, (net, _) in enumerate(designs.networks))
        place, angle, thickness = (np.array(rows)[:, None] for rows in zip(*each, strict=True))
        rest = _BeamAtRest(place[0, 0], angle, thickness)
        parts.append(_element_states(stepped, element, given, rest))
    return _joined(parts)


class _BeamAtRest(NamedTuple):
    """A beam at places of an element before any load, (k,) each, or (d, 1, k)."""

    place: Any
    angle: Any
    thickness: Any


def _rest(net: Network, network: Discretisation, beam: str, element: int, given: FloatArray) -> _BeamAtRest:
    """Return a beam at fractions of one element before any load."""
    rule, e, fitted = basis(network.degree), network.elements, network.fits[beam]
    _, _, through = _matrices(network.degree, tuple(given.tolist()))
    left, right = e.cuts[element]
    t, middle = left + (right - left) * given, 0.5 * (left + right)
    known = left + (right - left) * rule.places
    added = e.angle[element] - (fitted.angle(known, middle) + 0.0 * known)  # an imperfection
    place = fitted.arc(t)
    thickness = net.beams[beam].section.thickness_at(place, float(np.real(fitted.arc(middle)))) + 0.0 * t
    return _BeamAtRest(place, fitted.angle(t, middle) + 0.0 * t + through @ added, thickness)


def _element_states(at: Equilibria, element: int, given: FloatArray, rest: _BeamAtRest) -> BeamStates:
    """Return states at fractions (k,) of one element of one network, or of several designs."""
    network, scales = at.network, at.network.scales
    rule, e = basis(network.degree), network.elements
    values, cumulated, _ = _matrices(network.degree, tuple(given.tolist()))
    weight = e.weight[..., element, :]
    speed, own = weight / rule.weights, at.z[..., e.unknowns[element]]
    rotation = own[..., energy.rotation_columns(network.degree)]
    load = energy.line_load(network, at.drive)[..., element, :]
    fields = _fields(e, element, own, load, rotation @ rule.values.T)
    first = weight * _bending_moment(e, element, rotation @ rule.slopes.T)
    moment = -(first @ rule.slopes[:, 0] - (weight * fields.turning) @ rule.values[:, 0])[..., None]
    turn = rotation @ values.T
    if e.curl is None:
        inside, stiff = integrals_to_points(network.degree), e.rigidity[..., element, :] * speed
        for places, within in ((rule.places, inside), (given, cumulated)):
            curvature = (moment - (fields.turning * speed) @ inside.T) / stiff
            missed = rotation[..., 1] - rotation[..., 0] - curvature @ rule.weights
            turn = rotation[..., :1] + curvature @ within.T + missed[..., None] * places
            if within is inside:
                fields = _fields(e, element, own, load, turn)
    ahead = e.length[..., element, None] - speed @ cumulated.T
    force = own[..., None, -2:] + load[..., None, :] * ahead[..., None]
    start = poses(network.attachments, at.z, e.ends[element, :1]).place[..., 0, :]
    return BeamStates(
        rest.place,
        (start[..., :1] + (fields.slope_x * speed) @ cumulated.T) * scales.length,
        (start[..., 1:] + (fields.slope_y * speed) @ cumulated.T) * scales.length,
        turn,
        rest.angle,
        force[..., 0] * scales.force,
        force[..., 1] * scales.force,
        (moment - (fields.turning * speed) @ cumulated.T) * scales.moment,
        rest.thickness,
    )


class _Fields(NamedTuple):
    """What is integrated along an element, at its Gauss points (..., q)."""

    slope_x: Any  # dX/ds
    slope_y: Any
    turning: Any  # -dM/ds


def _fields(e: BeamElements, element: int, own: Any, load: Any, turn: Any) -> _Fields:
    """Return the fields of an element from the rotations at its Gauss points, (..., q)."""
    angle, axial, shearing = (table[..., element, :] for table in (e.angle, e.axial, e.shear))
    cos, sin = np.cos(angle + turn), np.sin(angle + turn)
    h, v = (own[..., axis - 2, None] + load[..., axis, None] * e.ahead[..., element, :] for axis in (0, 1))
    normal, shear = h * cos + v * sin, v * cos - h * sin
    stretch, slip = 1 + axial * normal, shearing * shear
    return _Fields(stretch * cos - slip * sin, stretch * sin + slip * cos, shear * (1 + (axial - shearing) * normal))


def _bending_moment(e: BeamElements, element: int, curvature: Any) -> Any:
    """Return the bending moment by the element's parameter at its Gauss points, (..., q)."""
    if e.curl is None:
        return e.rigidity[..., element, :] * curvature
    one = {name: table[..., element, :] for name, table in e._asdict().items() if name in ("rigidity", *CURLING)}
    return bending(e._replace(**one), curvature).moment


@lru_cache(maxsize=64)
def _matrices(degree: int, fractions: tuple[float, ...]) -> tuple[Any, Any, Any]:
    """Return shape functions at fractions, integrals up to them and interpolation to them from the Gauss points."""
    rule, ends = basis(degree), np.array(fractions)
    return shape_functions(degree, ends)[0], integrals(rule.places, ends), interpolation(rule.places, ends)


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
    return sections_of_width(net.beams[beam].section.width, found)


def sections_of_width(width: Any, found: BeamStates) -> BeamSections:
    """Return section forces and stresses from states of a beam of a width [m], or of designs with widths (d, 1, 1)."""
    angle = found.angle + found.turn
    cos, sin = np.cos(angle), np.sin(angle)
    normal, shear = found.h * cos + found.v * sin, found.v * cos - found.h * sin
    area = width * found.thickness
    bending = 6 * found.moment / (area * found.thickness)
    place = np.broadcast_to(found.place, found.moment.shape)
    return BeamSections(place, found.moment, normal, shear, bending, normal / area)
