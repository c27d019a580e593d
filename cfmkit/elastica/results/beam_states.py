"""Positions, rotations and section forces at any places of a beam, from the unknowns of its elements.

The force on a section is that on the element's end plus the line load ahead; positions, the bending moment and, from
it, the rotation are integrals along the element, of polynomials through its Gauss points,

    X(s) = X0 + int dX/ds ds,    M(s) = M0 - int Q (1 + (1/EA - 1/GA) N) ds,    M0 = -dP/d(rotation of the start),
    phi(s) = phi0 + int M/EI ds:

by equilibrium the moment is as accurate as the force; EI times the change of curvature is one order worse, and so is
the polynomial of the rotation between its ends. Of wide strips, whose law is not inverted, the rotation is that.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.designs import CURLING_TABLES, design_of
from cfmkit.elastica.mechanics.elements import MechanicsUnits
from cfmkit.elastica.mechanics.polynomials import (
    basis,
    integrals,
    integrals_to_points,
    interpolation,
    shape_functions,
)
from cfmkit.elastica.mechanics.poses import poses
from cfmkit.elastica.mechanics.wide_strip import bending_moment
from cfmkit.numerics.dual_array import DualArray, dual_of_steps, plain

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.design_derivatives import Equilibria
    from cfmkit.elastica.mechanics.designs import NetworkDesigns
    from cfmkit.elastica.mechanics.discretise import BeamElements, Discretisation
    from cfmkit.elastica.model.network import Network

ON_POINTS = ("angle", "weight", "rigidity", "axial", "shear", "ahead", *CURLING_TABLES)
"""Tables of elements at their Gauss points."""


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


def elements_of(mesh: Discretisation, beam: str) -> list[int]:
    """Return the elements of a beam, in order."""
    return [number for number, name in enumerate(mesh.elements.beam) if name == beam]


def states(
    net: Network,  # the model that `at` is of
    at: Equilibria,  # real, or with a complex step
    beam: str,  # its name
    fractions: Any,  # (k,): places on every element as fractions of its parameter, from 0 to 1
) -> BeamStates:
    """Return states at the same fractions (k,) of each element of a beam, element after element."""
    return states_of_elements(net, at, elements_of(at.mesh, beam), fractions)


def states_of_elements(net: Network, at: Equilibria, elements: Sequence[int], fractions: Any) -> BeamStates:
    """Return states at the same fractions (k,) of each of m elements, one after the other: (p, m k)."""
    places = np.asarray(fractions, float)
    by_element = _states(at, list(elements), places, _find_rest(net, at.mesh, elements, places))
    return BeamStates(*map(_join_elements, by_element))


def forces_of_elements(net: Network, at: Equilibria, elements: Sequence[int], fractions: Any) -> BeamStates:
    """Return such states without x and y, which stresses do not need."""
    places = np.asarray(fractions, float)
    states = _forces(at, list(elements), places, _find_rest(net, at.mesh, elements, places)).states
    return BeamStates(*map(_join_elements, states))


def forces_of_designs(
    networks: Sequence[Network], meshes: Sequence[Discretisation], at: Equilibria, row: Any, fractions: Any
) -> tuple[BeamStates, Any]:
    """Return section forces of some designs of one topology and degree, without x and y, and widths, (p, e k).

    `at` has points of all of them, with the arrays of any; `row` (p,) says which design each point is of. Places are at
    the same fractions (k,) of e elements, one after the other.
    """
    places, elements = np.asarray(fractions, float), list(range(len(at.mesh.elements.length)))
    names = ("length", "line", *(name for name in ON_POINTS if getattr(at.mesh.elements, name) is not None))
    tables = {name: np.array([getattr(mesh.elements, name) for mesh in meshes])[row] for name in names}
    units = np.array([mesh.scales for mesh in meshes]).T[:, row, None, None]
    mesh = replace(at.mesh, elements=at.mesh.elements._replace(**tables), scales=MechanicsUnits(*units))
    at_rest = zip(*(_find_rest(*pair, elements, places) for pair in zip(networks, meshes, strict=True)), strict=True)
    rest = _BeamAtRest(*(np.array(column)[row] for column in at_rest))
    states = _forces(replace(at, mesh=mesh), elements, places, rest).states
    widths = np.array([[net.beams[name].section.width for name in at.mesh.elements.beam] for net in networks])
    return BeamStates(*map(_join_elements, states)), np.repeat(widths, len(places), axis=1)[row]


def states_of_designs(
    designs: NetworkDesigns,  # a complex step in each variable
    at: Equilibria,  # of `dual_arrays`, with dual unknowns
    # elements, fractions: (m,), (k,): as of `states_of_elements`
    elements: Sequence[int],
    fractions: Any,
) -> BeamStates:
    """Return states with their derivatives: dual arrays (p, m k), (m k) of those that do not change along the path."""
    places, numbers = np.asarray(fractions, float), list(elements)
    by_element = _states(at, numbers, places, _unloaded_designs(designs, at.mesh, numbers, places))
    return BeamStates(*map(_join_elements, by_element))


def _join_elements(values: Any) -> Any:
    """Return values (..., m, k) of one element after the other, (..., m k)."""
    if values is None:
        return None
    if isinstance(values, DualArray):
        return DualArray(_join_elements(values.value), _join_elements(values.all_slopes))
    return values.reshape(*values.shape[:-2], -1)


class _BeamAtRest(NamedTuple):
    """Beams at k places of m elements before any load, (m, k) each."""

    place: Any
    angle: Any
    thickness: Any


def _find_rest(net: Network, mesh: Discretisation, elements: Sequence[int], places: FloatArray) -> _BeamAtRest:
    """Return beams at fractions of elements before any load."""
    rule, e = basis(mesh.degree), mesh.elements
    through = _matrices_at(mesh.degree, tuple(places.tolist())).interpolation
    bundle = mesh.fits.bundle
    if not bundle.others and e.moved_cuts is None and bundle.coefficients.shape[-1] <= len(rule.places):
        thickness = np.array([net.beams[e.beam[element]].section.thickness for element in elements])
        return _unloaded_plain(mesh, elements, places, thickness[:, None])
    rows = []
    for element in elements:
        cuts = e.cuts[element] if e.moved_cuts is None else e.moved_cuts[..., element, :]
        beam, left, right = e.beam[element], cuts[..., :1], cuts[..., 1:]
        fitted, middle = mesh.fits[beam], 0.5 * float(e.cuts[element].sum())
        t, known_places = left + (right - left) * places, left + (right - left) * rule.places
        added = e.angle[..., element, :] - (fitted.angle(known_places, middle) + 0.0 * known_places)  # an imperfection
        place = fitted.arc(t)
        thickness = net.beams[beam].section.thickness_at(place, float(np.real(fitted.arc(middle)))) + 0.0 * t
        rows.append(
            (
                place,
                fitted.angle(t, middle) + 0.0 * t + (through @ added if added.ndim == 1 else added @ through.T),
                thickness,
            )
        )
    return _BeamAtRest(*(np.stack(column, axis=-2) for column in zip(*rows, strict=True)))


def _unloaded_designs(
    designs: NetworkDesigns, mesh: Discretisation, elements: list[int], places: FloatArray
) -> _BeamAtRest:
    """Return beams at fractions of elements before any load with their derivatives, dual where they have some."""
    template, names = designs.template, [designs.template.elements.beam[element] for element in elements]
    if template.fits.bundle.others:
        template_beam = _find_rest(template.fits.network, template, elements, places)
        beams = [
            _find_rest(net, design_of(designs, d), elements, places) for d, (net, _) in enumerate(designs.networks)
        ]
        return _BeamAtRest(
            template_beam.place,
            dual_of_steps(template_beam.angle, [beam.angle for beam in beams]),
            dual_of_steps(template_beam.thickness, [beam.thickness for beam in beams]),
        )
    steps: Any = np.array([[net.beams[name].section.thickness for name in names] for net, _ in designs.networks])
    first: Any = np.array([template.fits.network.beams[name].section.thickness for name in names])
    return _unloaded_plain(mesh, elements, places, dual_of_steps(first[:, None], steps[..., None]))


def _unloaded_plain(mesh: Discretisation, elements: Sequence[int], places: FloatArray, thickness: Any) -> _BeamAtRest:
    """Return plain beams of a thickness (m, 1): their angle is a polynomial, their speed is even."""
    cuts, through = mesh.elements.cuts[elements], _matrices_at(mesh.degree, tuple(places.tolist())).interpolation
    place = cuts[:, :1] + (cuts[:, 1:] - cuts[:, :1]) * places
    return _BeamAtRest(place, mesh.elements.angle[elements] @ through.T, thickness + 0.0 * places)


def _states(at: Equilibria, elements: list[int], places: FloatArray, rest: _BeamAtRest) -> BeamStates:
    """Return states at k fractions of m elements, (p, m, k); dual if the equilibria are."""
    states, fields, speed, upto = _forces(at, elements, places, rest)
    start = poses(at.mesh.attachments, at.z, at.mesh.elements.ends[elements, 0]).place
    x = (start[..., :1] + (fields.slope_x * speed) @ upto) * at.mesh.scales.length
    y = (start[..., 1:] + (fields.slope_y * speed) @ upto) * at.mesh.scales.length
    return states._replace(x=x, y=y)


class _Forces(NamedTuple):
    """States without places, and what places are integrals of."""

    states: BeamStates
    fields: energy.SectionFields  # at Gauss points
    speed: Any
    upto: Any  # (q, k) integrals up to each place


def _forces(at: Equilibria, elements: list[int], places: FloatArray, rest: _BeamAtRest) -> _Forces:
    """Return section forces and rotations at k fractions of m elements; tables may differ from point to point."""
    mesh, scales, whole = at.mesh, at.mesh.scales, at.mesh.elements
    rule, unknowns = basis(mesh.degree), at.z[..., whole.unknowns[elements]]
    tables = {name: getattr(whole, name) for name in ON_POINTS}
    picked = {name: table[..., elements, :] for name, table in tables.items() if table is not None}
    laid = None if whole.laid is None else whole.laid[..., elements]
    e = whole._replace(**picked, length=whole.length[..., elements], laid=laid)
    load = energy.line_load(mesh, at.drive)[..., elements, :]
    rotation, end = unknowns[..., energy.rotation_columns(mesh.degree)], unknowns[..., -2:]
    speed, reached = e.weight / rule.weights, _matrices_at(mesh.degree, tuple(places.tolist()))
    upto = reached.integrals.T
    h, v = (end[..., axis, None] + load[..., axis, None] * e.ahead for axis in (0, 1))
    fields = energy.SectionFields(e, e.angle + rotation @ rule.values.T, h, v)
    turning = fields.turning * speed
    first = e.weight * bending_moment(e, rotation @ rule.slopes.T)
    moment = -(first @ rule.slopes[:, 0] - turning @ (rule.weights * rule.values[:, 0]))[..., None]
    if e.curl is None:  # rotations from moments, and once more
        inside = integrals_to_points(mesh.degree).T
        curvature, missed = _change_of_curvature(e, rotation, moment + turning @ -inside)
        turn = rotation[..., :1] + missed * rule.places + curvature @ inside
        fields = energy.SectionFields(e, e.angle + turn, h, v)
        turning = fields.turning * speed
        curvature, missed = _change_of_curvature(e, rotation, moment + turning @ -inside)
        turn = rotation[..., :1] + missed * places + curvature @ upto
    else:
        turn = rotation @ reached.values.T
    ahead = e.length[..., None] - speed @ upto
    if not (isinstance(load, DualArray) or load.any()):
        ahead = 0.0 * plain(ahead)  # so that forces have the derivatives of those on the end
    states = BeamStates(
        rest.place,
        None,
        None,
        turn,
        rest.angle,
        (end[..., :1] + load[..., :1] * ahead) * scales.force,
        (end[..., 1:] + load[..., 1:] * ahead) * scales.force,
        (moment + turning @ -upto) * scales.moment,
        rest.thickness,
    )
    if e.laid is not None:
        states = _lie_down(e, rotation, end[..., 0], places, states, fields, scales)
    return _Forces(states, fields, speed, upto)


def _lie_down(
    e: BeamElements, rotation: Any, tension: Any, places: FloatArray, states: BeamStates, fields: Any, scales: Any
) -> BeamStates:
    """Return states with those of elements that lie on an obstacle: even tension and moment, rotations in a line.

    Their fields become those of such elements, too.
    """
    rule, lies = basis(rotation.shape[-1] - 1), e.laid[..., None]
    change = (rotation[..., 1] - rotation[..., 0])[..., None]
    turn = rotation[..., :1] + change * places
    angle = states.angle + turn
    moment = (e.rigidity * e.weight / rule.weights)[..., :1] * change * scales.moment
    force = tension[..., None] * scales.force
    laid = states._replace(turn=turn, h=force * np.cos(angle), v=force * np.sin(angle), moment=moment + 0.0 * turn)
    merged = {name: np.where(lies, getattr(laid, name), getattr(states, name)) for name in ("turn", "h", "v", "moment")}
    direction = e.angle + rotation[..., :1] + change * rule.places
    fields.cos, fields.sin = (
        np.where(lies, turned, field) for turned, field in
        ((np.cos(direction), fields.cos), (np.sin(direction), fields.sin))
    )  # fmt: skip
    fields.normal, fields.shear = np.where(lies, tension[..., None], fields.normal), np.where(lies, 0.0, fields.shear)
    return states._replace(**merged)


def _change_of_curvature(e: BeamElements, rotation: Any, moment: Any) -> tuple[Any, Any]:
    """Return the change of curvature by the parameter at Gauss points (..., q), and what it misses of the turn."""
    rule = basis(rotation.shape[-1] - 1)
    curvature = moment / (e.rigidity * e.weight / rule.weights)
    return curvature, (rotation[..., 1] - rotation[..., 0] - curvature @ rule.weights)[..., None]


class _AtFractions(NamedTuple):
    """Matrices from an element's unknowns, and values at its Gauss points, to k fractions of it."""

    values: FloatArray  # (k, degree + 1) of the rotation
    integrals: FloatArray  # (k, q) up to each
    interpolation: FloatArray  # (k, q)


@lru_cache(maxsize=64)
def _matrices_at(degree: int, fractions: tuple[float, ...]) -> _AtFractions:
    rule, ends = basis(degree), np.array(fractions)
    return _AtFractions(
        shape_functions(degree, ends)[0], integrals(rule.places, ends), interpolation(rule.places, ends)
    )


def unloaded_places(net: Network, at: Equilibria, beam: str, fractions: Any) -> Any:
    """Return the places before any load, (k, 2) [m], at the fractions of `states`."""
    from cfmkit.elastica.mechanics.design_derivatives import Equilibria

    rest = Equilibria(drop_line_loads(at.mesh), np.zeros((1, at.mesh.size)), np.zeros(1))
    unloaded = states(net, rest, beam, fractions)
    return np.stack([unloaded.x[0], unloaded.y[0]], axis=-1)


def drop_line_loads(mesh: Discretisation) -> Discretisation:
    """Return the arrays without line loads, under which beams stretch also where all unknowns are zero."""
    if not mesh.elements.line.any():
        return mesh
    return replace(mesh, elements=mesh.elements._replace(line=0.0 * mesh.elements.line))


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


def sections(net: Network, beam: str, beam_states: BeamStates) -> BeamSections:
    """Return section forces and stresses from states of a beam."""
    return sections_of_width(net.beams[beam].section.width, beam_states)


def sections_of_width(width: Any, beam_states: BeamStates) -> BeamSections:
    """Return section forces and stresses from states of a beam of a width [m], or of widths at all places."""
    at = energy.SectionForces(beam_states.angle + beam_states.turn, beam_states.h, beam_states.v)
    bending, axial = _bending_and_axial(width, beam_states, at)
    return BeamSections(
        beam_states.place + 0.0 * plain(beam_states.moment), beam_states.moment, at.along, at.across, bending, axial
    )


def bending_and_axial_stress(width: Any, beam_states: BeamStates) -> tuple[Any, Any]:
    """Return bending stress (signed) and axial stress [Pa] at all places of a beam of a width [m]."""
    at = energy.SectionForces(beam_states.angle + beam_states.turn, beam_states.h, beam_states.v)
    return _bending_and_axial(width, beam_states, at)


def _bending_and_axial(width: Any, beam_states: BeamStates, at: energy.SectionForces) -> tuple[Any, Any]:
    area = width * beam_states.thickness
    return 6 * beam_states.moment / (area * beam_states.thickness), at.along / area
