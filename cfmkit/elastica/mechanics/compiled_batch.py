"""Many networks of one topology in compiled code, as rows of models: marches, and what a higher degree changes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.mechanics.compiled import CompiledEquations, angle_laws, compare_rows, plan_row_of
from cfmkit.elastica.mechanics.compiled_module import ADDRESS_FIELDS, COUNT_FIELDS, load_compiled, slope_products
from cfmkit.elastica.mechanics.equations import ComparedStates, MarchPlan
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.mechanics.polynomials import basis

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.designs import NetworkDesigns
    from cfmkit.elastica.mechanics.discretise import Discretisation


def is_compiled(mesh: Discretisation) -> bool:
    """Return True if compiled code has networks like one as rows: without contacts, which have arrays of their own."""
    own = equations(mesh)
    return isinstance(own, CompiledEquations) and not mesh.contacts and not own.follows


class CompiledBatch:
    """Real designs that were set up together, without constant loads or displaced supports, as rows of models."""

    def __init__(self, designs: NetworkDesigns) -> None:
        """Make the rows: the template's, with addresses of arrays that differ from design to design."""
        template: Any = equations(designs.template)
        mesh, tables = designs.template, designs.tables
        self.mesh, self.count, self.effort_unit = mesh, designs.count, template.effort_unit
        rule, bending = basis(mesh.degree), tables["weight"] * tables["rigidity"]
        bend = (bending[..., 0] / rule.weights[0])[..., None] * (rule.weights @ slope_products(mesh.degree))
        arrays = tables | designs.places | {"bend": bend}  # what is the same along an element, but for the weights
        self.laws = angle_laws(designs.fits[0].bundle.coefficients, mesh)
        self._kept = {name: np.ascontiguousarray(array, float) for name, array in arrays.items()}
        self.rows = np.tile(template.row, (self.count, 1))
        for name, array in self._kept.items():
            addresses = array.ctypes.data + array.strides[0] * np.arange(self.count)
            self.rows[:, len(COUNT_FIELDS) + ADDRESS_FIELDS.index(name)] = addresses

    def march(
        self,
        targets: FloatArray,
        first_step: float = 0.05,
        tolerance: float = 1e-9,
        largest_turn: float = MarchPlan.largest_turn,
        chosen: Sequence[int] = (),
    ) -> tuple[FloatArray, Any, FloatArray]:
        """Return the efforts under a drive by a motion, each design followed from rest.

        Parameters
        ----------
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
        states : (d, chosen, size) array
            All unknowns.
        """
        mesh, goals = self.mesh, np.ascontiguousarray(targets, float) / self.mesh.scales.drive
        span = max(float(goals.max()), 0.0) - min(float(goals.min()), 0.0)
        plan = MarchPlan(first_step * span, span, largest_turn=largest_turn, tolerance=tolerance)
        efforts, codes = np.full((self.count, len(goals)), np.nan), np.zeros(self.count, np.int64)
        free, some = np.full((self.count, len(chosen), len(mesh.free)), np.nan), np.array(chosen, np.int64)
        plan_row = plan_row_of(plan, 0, True)
        if not load_compiled().march_many(self.rows, plan_row, goals, efforts, codes, some, free, plan.room):
            raise MemoryError
        states = np.tile(goals[some, None] * mesh.rate, (self.count, 1, 1))
        states[..., mesh.free] = free
        return efforts * self.effort_unit, codes, states

    def compare(self, states: FloatArray, drives: FloatArray, degree: int, tolerance: float) -> ComparedStates:
        """Return how states (d, k, size) at some drives (k,) [m or rad] differ from equilibria of a higher degree."""
        ways = drives / self.mesh.scales.drive
        return compare_rows(self.rows, self.mesh, self.laws, states, ways, degree, tolerance)
