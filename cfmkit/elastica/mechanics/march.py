"""The equations of a network, compiled or in numpy where C has not all of it; both give the same to rounding."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, wraps
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.contact.equations import ContactEquations, open_all_contacts
from cfmkit.elastica.contact.sliding import SlidingEquations
from cfmkit.elastica.mechanics.compiled import CompiledEquations
from cfmkit.elastica.mechanics.compiled_module import MAX_DEGREE, load_compiled
from cfmkit.elastica.mechanics.equations import (
    MarchPlan,
    NaturalMarch,
    NumpyEquations,
    SolvedStates,
)
from cfmkit.elastica.mechanics.moving_elements import copy_moved_tables
from cfmkit.elastica.model.beam_fits import has_polynomial_angle
from cfmkit.elastica.model.network import LineSpring, PointLoad, SlideSpring, TorsionSpring

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.discretise import Discretisation
    from cfmkit.numerics.continuation.problem import PathEquilibrium

COMPILED_TERMS = {LineSpring, SlideSpring, TorsionSpring, PointLoad}
"""Springs and loads that march.c has; networks with others run on numpy."""


def engine() -> str:
    """Return what the beam engine runs on: "C" or "numpy"."""
    return "numpy" if load_compiled() is None else "C"


def equations(
    mesh: Discretisation,  # with real arrays
    ramp: bool = False,  # whether the way is the share of what is constant instead of the drive
) -> NumpyEquations:
    """Return the equations of a network, compiled if they can be."""
    key = equations, ramp, load_compiled() is not None
    if key not in mesh.cache:
        compiled = key[2] and _is_compiled(mesh)
        if mesh.moving is not None and compiled:
            mesh.cache[key] = CompiledSides(copy_moved_tables(mesh) if mesh.elements.weight.ndim > 2 else mesh, ramp)
        elif mesh.moving is not None:
            mesh.cache[key] = SlidingEquations.from_mesh(mesh, ramp, equations)
        elif compiled:
            mesh.cache[key] = CompiledEquations(mesh, ramp)
        elif mesh.contacts:
            mesh.cache[key] = ContactEquations(mesh, ramp, plain=equations(open_all_contacts(mesh), ramp))
        else:
            mesh.cache[key] = NumpyEquations(mesh, ramp)
    return mesh.cache[key]  # type: ignore[no-any-return]


def _is_compiled(mesh: Discretisation) -> bool:
    """Return True if C has everything of a network.

    With contacts: they do not rub, no load follows, and sides of beams, which are uniform, touch at points.
    """
    acting, contacts = (*mesh.springs, *mesh.loads), mesh.contacts
    if not {type(attached.item) for attached in acting} <= COMPILED_TERMS or mesh.degree > MAX_DEGREE:
        return False
    follows = any(load.item.follows for load in mesh.loads)
    if contacts and (follows or any(contact.rub >= 0 or contact.laid for contact in contacts)):
        return False
    moving = () if mesh.moving is None else mesh.moving.elements
    beams = [mesh.fits.network.beams[mesh.elements.beam[number]] for number in moving]
    return all(has_polynomial_angle(beam) and not beam.section.shear for beam in beams)


def _delegate(name: str) -> Any:
    """Return a method of `CompiledSides` that is that of the same equations in numpy."""

    @wraps(getattr(NumpyEquations, name))
    def method(equations: CompiledSides, *arguments: Any, **options: Any) -> Any:
        return getattr(equations.reference, name)(*arguments, **options)

    return method


@dataclass(frozen=True, eq=False)
class CompiledSides(CompiledEquations):
    """Equations with sides of beams on obstacles in compiled code; states in which some lie there are left to numpy."""

    @cached_property
    def reference(self) -> SlidingEquations:
        """The same equations in numpy."""
        return SlidingEquations.from_mesh(self.mesh, self.ramp, equations)

    @cached_property
    def _flags(self) -> Any:
        """Free unknowns that say whether a side lies on its obstacle."""
        flags = [contact.flag for contact in self.mesh.side_contacts if contact.closed is None]
        return np.searchsorted(self.mesh.free, flags)

    def _lies(self, free: FloatArray) -> Any:
        """Return whether some side lies on its obstacle in states (..., n)."""
        return np.rint(free[..., self._flags]).any(axis=-1)

    def _any_lies(self, z: FloatArray) -> bool:
        return bool(self._lies(z[:, self.mesh.free]).any())

    def exchange(self, mesh: Discretisation) -> CompiledEquations:
        """Return the equations with other contacts closed; their free unknowns are among these."""
        exchanged = super().exchange(mesh)
        for name in ("reference", "_flags"):
            vars(exchanged).pop(name, None)
        return exchanged

    gradient = _delegate("gradient")
    evaluate = _delegate("evaluate")
    linearise = _delegate("linearise")
    count_unstable = _delegate("count_unstable")
    resolve = _delegate("resolve")
    find_softest = _delegate("find_softest")

    def measure_curvatures(self, z: FloatArray) -> FloatArray | None:
        """Return the curvatures of gaps at contacts of sides in n states, (sides, n); None where something lies."""
        curvatures, states = np.empty((len(self.mesh.side_contacts), len(z))), np.ascontiguousarray(z, float)
        return None if self._any_lies(z) or not self.code.side_curvatures(self.row, states, curvatures) else curvatures

    def search_sides(self, z: FloatArray, *rest: Any, **named: Any) -> FloatArray | None:
        """Return the least gaps of sides in n states; None where something lies on an obstacle."""
        return None if self._any_lies(z) else super().search_sides(z, *rest, **named)

    def locate(self, z: FloatArray, *rest: Any) -> FloatArray | None:
        """Return places and rotations in n states; None where something lies on an obstacle."""
        return None if self._any_lies(z) else super().locate(z, *rest)

    def gradients(self, z: FloatArray, drive: FloatArray) -> FloatArray:
        """Return the gradients by all unknowns of states (p, size), (p, size)."""
        return self.reference.gradients(z, drive) if self._any_lies(z) else super().gradients(z, drive)

    def solve(self, free: FloatArray, *rest: Any, **named: Any) -> PathEquilibrium | None:
        """Return an equilibrium, as the method in numpy does."""
        return self.reference.solve(free, *rest, **named) if self._lies(free) else super().solve(free, *rest, **named)

    def solve_each(
        self, free: FloatArray, places: FloatArray, tolerance: float = 1e-10, quick: bool = False
    ) -> SolvedStates:
        """Return the equilibria near k guesses."""
        lies = self._lies(free)
        solved = super().solve_each(free, places, tolerance, quick)
        if lies.any():
            beside = self.reference.solve_each(free[lies], places[lies], tolerance, quick)
            for total, some in zip(solved, beside, strict=True):
                total[lies] = some
        return solved

    def march(self, start: PathEquilibrium, targets: FloatArray, plan: MarchPlan) -> NaturalMarch:
        """Return the states on the way to targets, as far as nothing happens."""
        lies = self._lies(start.x)
        return self.reference.march(start, targets, plan) if lies else super().march(start, targets, plan)
