"""Exact derivatives of a path's outputs by design variables: complex steps of the function that builds the network.

At an equilibrium the gradient of the functional vanishes, so that its unknowns change by dz/dx = -K^-1 d(grad P)/dx;
what an output depends on besides has a complex step already, and is differentiated by computing it. Efforts of a drive
by a motion need no solution: the slope of the path is the adjoint (`cfmkit.elastica.mechanics.design_derivatives`).
Variables may change positions, shapes, sections, materials, offsets, links' arms, springs, loads, gaps and stiffnesses
of stops, support displacements and directions; not obstacles, and not the number of anything. The drive keeps its
values; a support that turns takes its drive with it. States along beams, of which there are many, are computed as dual
arrays; what depends on them otherwise, variable by variable with the complex step.

Contacts of nodes stay closed or open as they are: at a point at which one begins or ends the derivative is that of one
side.

SI, variables last; each output is computed when it is first needed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.design_derivatives import (
    Equilibria,
    dual_arrays,
    effort_motions,
    effort_slopes,
    force_slopes,
    unknown_slopes,
)
from cfmkit.elastica.mechanics.designs import design_of, make_up, set_up
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.model.contact import BeamSide
from cfmkit.elastica.model.drive import Loading
from cfmkit.elastica.results import beam_states, stress_extremes
from cfmkit.elastica.results.path import N_PLACES, load_displacement, node_motion, node_reaction, strain_energy
from cfmkit.errors import InputError
from cfmkit.numerics.dual_array import COMPLEX_STEP, DualArray, dual_of_steps, slopes_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.designs import NetworkDesigns
    from cfmkit.elastica.model.network import Network
    from cfmkit.elastica.results.path import EquilibriumPath

    Output = Callable[[Network, Equilibria], Any]

SINGULAR_MESSAGE = "the tangent is singular at a point of the path: no derivative there"


@dataclass(frozen=True, eq=False)
class Gradient:
    """Derivatives at p chosen points of a path by k design variables."""

    path: EquilibriumPath  # the path that was differentiated
    points: Any  # (p,) indices of the points
    designs: NetworkDesigns  # a complex step in each variable

    @cached_property
    def at(self) -> Equilibria:
        """The equilibria at the points."""
        return Equilibria(self.path.mesh, self.path.at.z[self.points], self.path.at.drive[self.points])

    @cached_property
    def unknowns(self) -> FloatArray:
        """Derivatives of everything that was solved for, held unknowns included, (p, k, size), dimensionless.

        Raises
        ------
        cfmkit.errors.InputError
            If the tangent is singular at a point.
        """
        try:
            return unknown_slopes(self.at, self.designs, self._forces)
        except np.linalg.LinAlgError:
            raise InputError(SINGULAR_MESSAGE) from None

    @cached_property
    def _forces(self) -> FloatArray:
        """Derivatives of the gradient of the functional while free unknowns stay, (p, k, size)."""
        return force_slopes(self.at, self.designs)

    @cached_property
    def stepped(self) -> tuple[Equilibria, ...]:
        """The equilibria with a complex step in each variable."""
        return tuple(
            Equilibria(design_of(self.designs, k), self.at.z + 1j * COMPLEX_STEP * self.unknowns[:, k], self.at.drive)
            for k in range(self.designs.count)
        )

    def differentiate(self, output: Output) -> FloatArray:
        """Return the derivatives (..., k) of an output (...) of a model and its equilibria, analytic in both."""
        pairs = zip(self.designs.networks, self.stepped, strict=True)
        return read_only(np.stack([np.imag(output(net, at)) / COMPLEX_STEP for (net, _), at in pairs], axis=-1))

    @cached_property
    def effort(self) -> FloatArray:
        """Derivatives of `EquilibriumPath.effort`, (p, k)."""
        if isinstance(self.path.load_case, Loading):
            pairs = zip(self.designs.networks, self.stepped, strict=True)
            columns = [load_displacement(at, drive) for (_, drive), at in pairs if isinstance(drive, Loading)]
            return read_only(np.imag(np.stack(columns, axis=-1)) / COMPLEX_STEP)
        try:
            if "_forces" in vars(self):  # as by `effort_slopes`, which needs less than these
                work = np.einsum("ps,pks->pk", effort_motions(self.at, self._rates), self._forces)
                return read_only(work * self.path.mesh.scales.moment / self.path.mesh.scales.drive)
            return read_only(effort_slopes(self.at, self.designs, self._rates))
        except np.linalg.LinAlgError:
            raise InputError(SINGULAR_MESSAGE) from None

    @cached_property
    def _rates(self) -> FloatArray:
        """Slopes of the free unknowns along the path at the points, (p, free)."""
        solutions = equations(self.path.mesh).solve_each(self.path.free[self.points], self.at.drive, quick=True)
        if not (solutions.converged.all() and np.isfinite(solutions.rate).all()):
            raise InputError(SINGULAR_MESSAGE)
        return solutions.rate

    def motion(self, node: str) -> FloatArray:
        """Return the derivatives of `EquilibriumPath.motion`, (p, 3, k); of linked nodes, too."""
        return self.differentiate(lambda _, at: node_motion(at, node))

    def reaction(self, node: str) -> FloatArray:
        """Return the derivatives of `EquilibriumPath.reaction`, (p, 3, k)."""

        def output(_: Network, at: Equilibria) -> Any:
            residual = [energy.gradient(at.mesh, *state) for state in zip(at.z, at.drive, strict=True)]
            return node_reaction(at, node, np.array(residual))

        return self.differentiate(output)

    def contact_force(self, number: int) -> FloatArray:
        """Return the derivatives of `EquilibriumPath.contact_force`, (p, k)."""
        mesh = self.path.mesh
        unit = mesh.scales.moment if self.path.network.contacts[number].turns else mesh.scales.force
        (unknown,) = [contact.unknown for contact in mesh.contacts if contact.number == number]
        return read_only(self.unknowns[:, :, unknown] * unit)

    def end_force(self, beam: str, end: int) -> FloatArray:
        """Return the derivatives of `EquilibriumPath.end_force`, (p, 3, k)."""

        def output(net: Network, at: Equilibria) -> Any:
            element = beam_states.elements_of(at.mesh, beam)[-1 if end else 0]
            state = beam_states.states_of_elements(net, at, [element], np.array([float(end)]))
            return np.stack([state.h[:, 0], state.v[:, 0], state.moment[:, 0]], axis=-1)

        return self.differentiate(output)

    @cached_property
    def energy(self) -> FloatArray:
        """Derivatives of `EquilibriumPath.energy`, (p, k)."""
        moment = self.path.mesh.scales.moment
        return self.differentiate(lambda _, at: strain_energy(at) * moment)

    def shape(self, beam: str) -> FloatArray:
        """Return the derivatives of `EquilibriumPath.shape`, (p, n, 2, k): of material points of the beam."""
        states = self.states(beam)
        return read_only(np.stack([states.x, states.y], axis=2))

    def states(self, beam: str, fractions: Any = None) -> beam_states.BeamStates:
        """Return the derivatives of states at fractions of every element of a beam; arrays (p, n, k)."""
        elements = beam_states.elements_of(self.path.mesh, beam)
        return beam_states.BeamStates(*map(self._slopes, self.dual_states(elements, fractions)))

    def sections(self, beam: str, fractions: Any = None) -> beam_states.BeamSections:
        """Return the derivatives of section forces and stresses at fractions of every element; arrays (p, n, k)."""
        elements = beam_states.elements_of(self.path.mesh, beam)
        return beam_states.BeamSections(*map(self._slopes, self.dual_sections(elements, fractions)))

    def dual_states(self, elements: Sequence[int], fractions: Any = None) -> beam_states.BeamStates:
        """Return states with their derivatives at fractions of elements, one after the other; dual arrays (p, n)."""
        places = tuple(np.linspace(0.0, 1.0, N_PLACES) if fractions is None else fractions)
        key = tuple(elements), places
        if key not in self._states_by_places:
            states = beam_states.states_of_designs(self.designs, self._dual, elements, places)
            self._states_by_places[key] = states
        return self._states_by_places[key]

    def dual_sections(self, elements: Sequence[int], fractions: Any = None) -> beam_states.BeamSections:
        """Return section forces and stresses with their derivatives, as of `dual_states`."""
        return beam_states.sections_of_width(*self._dual_widths_and_states(elements, fractions))

    def dual_stresses(self, elements: Sequence[int], fractions: Any = None) -> tuple[Any, Any]:
        """Return bending and axial stress with their derivatives, as of `dual_states`."""
        return beam_states.bending_and_axial_stress(*self._dual_widths_and_states(elements, fractions))

    def _dual_widths_and_states(self, elements: Sequence[int], fractions: Any) -> tuple[Any, beam_states.BeamStates]:
        """Return the beams' widths [m] at the places of `dual_states`, (n,), and these states, all with derivatives."""
        states = self.dual_states(elements, fractions)
        names = [self.path.mesh.elements.beam[element] for element in elements]
        stepped = np.array([[net.beams[name].section.width for name in names] for net, _ in self.designs.networks])
        widths = np.array([self.path.network.beams[name].section.width for name in names])
        count = len(states.place) // len(names)
        return dual_of_steps(np.repeat(widths, count), np.repeat(stepped, count, axis=1)), states

    @cached_property
    def _states_by_places(self) -> dict[Any, beam_states.BeamStates]:
        """Results of `dual_states`, by elements and fractions: positions and stresses are read one after the other."""
        return {}

    @cached_property
    def _dual(self) -> Equilibria:
        """The equilibria with unknowns and arrays that are dual."""
        z: Any = DualArray(self.at.z, np.moveaxis(self.unknowns, 1, 0))
        return Equilibria(dual_arrays(self.designs), z, self.at.drive)

    def _slopes(self, values: Any) -> FloatArray:
        """Return the derivatives (p, n, k) of values (p, n), or (n,) of those that are one at all points."""
        shape = len(self.points), values.shape[-1]
        return read_only(np.moveaxis(slopes_of(values, self.designs.count, shape), 0, -1))

    def stress_extremes(self, beam: str, axial: bool = True) -> FloatArray:
        """Return the derivatives of the values of `EquilibriumPath.stress_extremes`, (p, 2, 2, k).

        An extreme inside a beam stays one while its place moves, so that its place needs no derivative (envelope
        theorem).
        """
        peaks = self.path.stress_extremes(beam, axial)
        element, fraction = peaks.element[self.points], peaks.fraction[self.points]
        return self.differentiate(lambda net, at: stress_extremes.stress_at(net, at, beam, element, fraction, axial))


def gradient(path: EquilibriumPath, build: Callable[[Any], Any], variables: Any, points: Any = None) -> Gradient:
    """Return the derivatives of a path's outputs by design variables.

    Parameters
    ----------
    path : EquilibriumPath
        A path of ``build(variables)``.
    build : callable
        From the design variables (real or complex) to the network, or to the network and its drive where variables
        change loads or direction of the drive.
    variables : (k,) array
        Where to differentiate: the variables that the path was traced for.
    points : sequence of int, optional
        Points of the path; all those requested by default.

    Raises
    ------
    cfmkit.errors.InputError
        If a variable changes the make-up of the network, moves a corner of a beam and a step of its thickness past
        each other, or moves one side of a step only; where sides of beams may touch an obstacle, or contacts have
        friction. Outputs raise it where the tangent is singular at a point.
    """
    if any(isinstance(contact, BeamSide) for contact in path.network.contacts):
        raise InputError("derivatives by design variables are not known where sides of beams touch obstacles")
    if any(contact.friction for contact in path.network.contacts):
        raise InputError("derivatives by design variables are not known where contacts have friction")
    x = np.asarray(variables, dtype=float)
    pairs = []
    for k in range(len(x)):
        moved = x.astype(complex)
        moved[k] += 1j * COMPLEX_STEP
        built = build(moved)
        pairs.append(built if isinstance(built, tuple) else (built, path.load_case))
    common = make_up(path.network)
    for k, (network, _) in enumerate(pairs):
        if make_up(network) != common:
            raise InputError(
                f"design variable {k} changes the make-up of the network: no derivative with respect to it exists"
            )
    designs = set_up(path.mesh, (path.network, path.load_case), pairs)
    chosen = np.asarray(path.at_requested if points is None else points, dtype=np.int64)
    return Gradient(path, read_only(chosen, np.int64), designs)
