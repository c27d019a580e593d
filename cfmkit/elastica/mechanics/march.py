"""The equations of a network, compiled or in numpy where there is no compiler; many designs at once.

Both give the same to rounding (tests/unit/test_elastica_march.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeGuard

import numpy as np

from cfmkit.elastica.contact.equations import ContactEquations, open_all_contacts
from cfmkit.elastica.contact.sliding import SlidingEquations
from cfmkit.elastica.mechanics.compiled import (
    ADDRESS_FIELDS,
    COUNT_FIELDS,
    CompiledEquations,
    load_compiled,
    load_row,
    plan_row_of,
    slope_products,
    spring_row,
)
from cfmkit.elastica.mechanics.compiled_sides import are_sides_compiled
from cfmkit.elastica.mechanics.contact_arrays import are_compiled, side_contacts
from cfmkit.elastica.mechanics.designs import design_of
from cfmkit.elastica.mechanics.equations import (
    LinearEquations,
    MarchCode,
    MarchPlan,
    MarchState,
    NaturalMarch,
    NumpyEquations,
    SolvedStates,
    begin,
)
from cfmkit.elastica.mechanics.moving_elements import copy_moved_tables
from cfmkit.elastica.mechanics.polynomials import basis
from cfmkit.elastica.model.network import LineSpring, PointLoad, SlideSpring, TorsionSpring

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.designs import NetworkDesigns
    from cfmkit.elastica.mechanics.discretise import Discretisation

MAX_DEGREE = 40
"""As in march.h: arrays of one element are on the stack."""
COMPILED_TERMS = (LineSpring, SlideSpring, TorsionSpring, PointLoad)
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
    if key not in mesh.known:
        kinds = {type(attached.item) for attached in (*mesh.springs, *mesh.loads)}
        plain = kinds <= set(COMPILED_TERMS) and mesh.degree <= MAX_DEGREE
        if mesh.moving is not None and plain and key[2] and are_sides_compiled(mesh):
            mesh.known[key] = CompiledSides(copy_moved_tables(mesh) if mesh.elements.weight.ndim > 2 else mesh, ramp)
        elif mesh.moving is not None:
            mesh.known[key] = SlidingEquations.from_mesh(mesh, ramp, equations)
        elif plain and key[2] and are_compiled(mesh):
            mesh.known[key] = CompiledEquations(mesh, ramp)
        elif mesh.contacts:
            mesh.known[key] = ContactEquations(mesh, ramp, plain=equations(open_all_contacts(mesh), ramp))
        else:
            mesh.known[key] = NumpyEquations(mesh, ramp)
    return mesh.known[key]  # type: ignore[no-any-return]


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
        flags = [contact.flag for contact in side_contacts(self.mesh) if contact.closed is None]
        return np.searchsorted(self.mesh.free, flags)

    def _lies(self, free: FloatArray) -> Any:
        """Return whether some side lies on its obstacle in states (..., n)."""
        return np.rint(free[..., self._flags]).any(axis=-1)

    def _exchange(self, mesh: Discretisation, arrays: Mapping[str, Any]) -> CompiledEquations:
        exchanged = super()._exchange(mesh, arrays)
        for name in ("reference", "_flags"):
            vars(exchanged).pop(name, None)
        return exchanged

    def gradient(self, free: Any, place: Any) -> Any:
        """Return the gradient by all unknowns, (size,)."""
        return self.reference.gradient(free, place)

    def measure_curvatures(self, z: FloatArray) -> FloatArray | None:
        """Return the curvatures of gaps at contacts of sides in n states, (sides, n); None where something lies."""
        curvatures, states = np.empty((len(side_contacts(self.mesh)), len(z))), np.ascontiguousarray(z, float)
        lies = self._lies(z[:, self.mesh.free]).any()
        return None if lies or not self.code.side_curvatures(self.row, states, curvatures) else curvatures

    def search_sides(self, z: FloatArray, *rest: Any, **named: Any) -> FloatArray | None:
        """Return the least gaps of sides in n states; None where something lies on an obstacle."""
        return None if self._lies(z[:, self.mesh.free]).any() else super().search_sides(z, *rest, **named)

    def locate(self, z: FloatArray, *rest: Any) -> FloatArray | None:
        """Return places and rotations in n states; None where something lies on an obstacle."""
        return None if self._lies(z[:, self.mesh.free]).any() else super().locate(z, *rest)

    def gradients(self, z: FloatArray, drive: FloatArray) -> FloatArray:
        """Return the gradients by all unknowns of states (p, size), (p, size)."""
        lies = self._lies(z[:, self.mesh.free])
        return self.reference.gradients(z, drive) if lies.any() else super().gradients(z, drive)

    def evaluate(self, z: FloatArray, drive: float, share: float = 1.0) -> tuple[FloatArray, FloatArray]:
        """Return gradient (size,) and Hessian (size, size) by all unknowns."""
        return self.reference.evaluate(z, drive, share)

    def linearise(self, free: FloatArray, place: float) -> LinearEquations:
        """Return the equations linearised at some unknowns."""
        return self.reference.linearise(free, place)

    def count_unstable(self, at: LinearEquations) -> int:
        """Return the number of unstable directions at a held drive."""
        return self.reference.count_unstable(at)

    def resolve(self, free: FloatArray, place: float, right: FloatArray) -> tuple[FloatArray, int]:
        """Return the solutions (k, n) with the tangent for right sides (k, n), and the number of unstable ones."""
        return self.reference.resolve(free, place, right)

    def soften(self, free: FloatArray, place: float, vector: FloatArray, rounds: int) -> tuple[float, FloatArray]:
        """Return flexibility and shape of the softest mode."""
        return self.reference.soften(free, place, vector, rounds)

    def solve(self, free: FloatArray, *rest: Any, **named: Any) -> MarchState | None:
        """Return an equilibrium, as the method in numpy does."""
        if self._lies(free):
            return self.reference.solve(free, *rest, **named)
        return super().solve(free, *rest, **named)

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

    def march(self, start: MarchState, targets: FloatArray, plan: MarchPlan) -> NaturalMarch:
        """Return the states on the way to targets, as far as nothing happens."""
        if self._lies(start.free):
            return self.reference.march(start, targets, plan)
        return super().march(start, targets, plan)


def march_many(
    designs: NetworkDesigns,
    targets: FloatArray,
    first_step: float = 0.05,
    tolerance: float = 1e-9,
    largest_turn: float = MarchPlan.largest_turn,
    chosen: Sequence[int] = (),
) -> tuple[FloatArray, Any, FloatArray]:
    """Return the efforts of many designs under a drive by a motion, each followed from rest.

    Parameters
    ----------
    designs : NetworkDesigns
        Real ones, without constant loads or displaced supports.
    targets : (k,) array
        Values of the drive [m or rad].
    first_step : float
        Share of the range of the drive.
    tolerance : float
        Of corrections, relative to the largest motion and force.
    largest_turn : float
        Change of a motion in one step [rad, or lengths of a beam].
    chosen : sequence of int
        Targets at which the states are wanted, too.

    Returns
    -------
    efforts : (d, k) array
        [N or N m]; not a number from where a path does not simply go on.
    codes : (d,) int array
        `MarchCode` of each.
    states : (d, chosen, n) array
        Free unknowns.
    """
    template_equations = equations(designs.template)
    goals = np.ascontiguousarray(targets, float) / designs.template.scales.drive
    span = max(float(goals.max()), 0.0) - min(float(goals.min()), 0.0)
    plan = MarchPlan(first_step * span, span, largest_turn=largest_turn, tolerance=tolerance)
    efforts, codes = np.full((designs.count, len(goals)), np.nan), np.zeros(designs.count, np.int64)
    states = np.full((designs.count, len(chosen), template_equations.n), np.nan)
    if _are_rows_of_one(template_equations):
        kept, plan_row, some = (
            design_arrays(template_equations, designs),
            plan_row_of(plan, 0, True),
            np.array(chosen, np.int64),
        )
        rows = _rows(template_equations, kept, designs.count)
        if not load_compiled().march_many(rows, plan_row, goals, efforts, codes, some, states, plan.room):
            raise MemoryError
    else:
        for number in range(designs.count):
            march = _march_one(equations(design_of(designs, number)), goals, plan)
            codes[number] = march.code
            for state in march.states:
                if state.target >= 0:
                    efforts[number, state.target] = state.effort
                    states[number, [k for k, target in enumerate(chosen) if target == state.target]] = state.free
    return efforts * template_equations.effort_unit, codes, states


def _march_one(network_equations: NumpyEquations, goals: FloatArray, plan: MarchPlan) -> NaturalMarch:
    """Return the march of one network from rest."""
    start = begin(network_equations)
    return NaturalMarch((), MarchCode.NO_START, 0.0) if start is None else network_equations.march(start, goals, plan)


def solve_designs(designs: NetworkDesigns, free: FloatArray, drives: FloatArray, tolerance: float) -> FloatArray:
    """Return the efforts of designs at equilibria near guesses, not a number where there is none [N or N m].

    Parameters
    ----------
    designs : NetworkDesigns
        As of `march_many`.
    free : (d, k, n) array
        Guesses.
    drives : (k,) array
        Values of the drive [m or rad].
    tolerance : float
        Of the next correction, relative to the largest motion and force.

    Returns
    -------
    (d, k) array
        Also not a number where an equilibrium is unstable.
    """
    template_equations = equations(designs.template)
    ways = np.ascontiguousarray(drives, float) / designs.template.scales.drive
    outcomes = np.zeros((*free.shape[:2], 3))
    if _are_rows_of_one(template_equations):
        kept = design_arrays(template_equations, designs)
        rows = _rows(template_equations, kept, designs.count)
        if load_compiled().solve_many(
            rows, np.array(free, float, order="C"), ways, np.empty(0), outcomes, tolerance, True
        ):
            raise MemoryError
    else:
        for number in range(designs.count):
            solved = equations(design_of(designs, number)).solve_each(free[number], ways, tolerance, quick=True)
            outcomes[number] = np.stack([~solved.converged, solved.unstable, solved.effort], axis=1)
    stable = (outcomes[..., 0] == 0) & (outcomes[..., 1] == 0)
    return np.where(stable, outcomes[..., 2] * template_equations.effort_unit, np.nan)


def _are_rows_of_one(template_equations: NumpyEquations) -> TypeGuard[CompiledEquations]:
    """Return True if compiled code has the equations of many designs as rows: without contacts, which have arrays."""
    compiled = isinstance(template_equations, CompiledEquations) and not template_equations.mesh.contacts
    return compiled and not template_equations.follows


def design_arrays(template_equations: CompiledEquations, designs: NetworkDesigns) -> dict[str, Any]:
    """Return the arrays of a `Model` that differ from design to design, with those as first axis."""
    rule, tables, products = (
        basis(template_equations.mesh.degree),
        designs.tables,
        slope_products(template_equations.mesh.degree),
    )
    arrays = tables | designs.places
    bend = tables["weight"] * tables["rigidity"]
    if designs.each:
        arrays["bend"] = bend @ products
        arrays["spring"] = np.array(
            [[spring_row(network, spring)[1] for spring in network.springs] for network in designs.each]
        )
        arrays["load"] = np.array([[load_row(network, load)[1] for load in network.loads] for network in designs.each])
    else:  # the same along an element, but for the weights
        arrays["bend"] = (bend[..., 0] / rule.weights[0])[..., None] * (rule.weights @ products)
    if designs.base is not None:
        arrays["base"] = designs.base
    return {name: np.ascontiguousarray(array, float) for name, array in arrays.items()}


def _rows(template_equations: CompiledEquations, kept: Mapping[str, Any], count: int) -> Any:
    """Return a `Model` for each design: the template's, with addresses of its own, good as long as `kept` is."""
    rows = np.tile(template_equations.row, (count, 1))
    for name, array in kept.items():
        rows[:, len(COUNT_FIELDS) + ADDRESS_FIELDS.index(name)] = array.ctypes.data + array.strides[0] * np.arange(
            count
        )
    return rows
