"""The equations of a network in compiled code: energy, Newton's method, march, least gaps, errors of states.

Sides of beams that touch at points are in `sides.c`; what lies on an obstacle is in numpy, and `SlidingEquations` is
the specification of both (tests/elastica/test_elastica_march.py).
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.compiled_module import (
    MAX_DEGREE,
    N_LAW,
    find_module,
    make_row,
    numbered_row,
    shape_row,
    slope_products,
)
from cfmkit.elastica.mechanics.equations import (
    FORCE_CHANGE,
    N_POWERS,
    ComparedStates,
    LinearEquations,
    LineTables,
    MarchCode,
    MarchPlan,
    NaturalMarch,
    NumpyEquations,
    SideData,
    SolvedStates,
)
from cfmkit.elastica.mechanics.model_arrays import CLOSED_NODE, has_more_unknowns, model_arrays
from cfmkit.elastica.mechanics.numbering import number_free
from cfmkit.numerics.continuation.problem import PathEquilibrium

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.discretise import Discretisation
    from cfmkit.numerics.continuation.problem import Border


CLOSED_SIDE = 5  # column of `side_at`
NO_NUMBERS = read_only([])
N_COMPARED = 7  # as in compare.c


@dataclass(frozen=True, eq=False)
class CompiledEquations(NumpyEquations):
    """The same equations in compiled code."""

    arrays: Mapping[str, Any] = field(init=False)  # what the addresses point to
    row: Any = field(init=False)  # counts and addresses
    code: Any = field(init=False)  # the compiled module

    def __post_init__(self) -> None:
        """Collect the arrays."""
        super().__post_init__()
        mesh, arrays = self.mesh, model_arrays(self)
        free = mesh.free[mesh.free < mesh.numbering.size] if has_more_unknowns(mesh) else mesh.free
        numbered, fixed = numbered_row(mesh.numbering, free.tobytes())
        row = make_row(arrays, self._count_parts(arrays), numbered)
        vars(self).update(arrays=fixed | arrays, row=row, code=find_module())

    def _count_parts(self, arrays: Mapping[str, Any]) -> dict[str, int]:
        """Return the counts of a `Model` that depend on more than topology."""
        mesh = self.mesh
        counts = {"springs": len(mesh.springs), "loads": len(mesh.loads), "ramp": self.ramp, "follows": self.follows}
        if has_more_unknowns(mesh):
            counts |= {"size": mesh.size, "free": len(mesh.free)}
        if mesh.contacts:
            nodes, sides = mesh.node_contacts, mesh.side_contacts
            presses = len({at.unknown for at in nodes}.intersection(mesh.free.tolist()))
            counts |= {"contacts": len(nodes), "presses": presses, "sides": len(sides)}
        if "moved_law" in arrays:
            moved, wide = arrays["moved_law"].shape
            counts |= {"moved": moved, "coefficients": wide - N_LAW}
        return counts

    def refill(self, elements: Any, tables: Mapping[str, Any]) -> None:
        """Replace the tables of some elements, in place: only of equations whose arrays are their own."""
        super().refill(elements, tables)
        for name, values in tables.items():
            self.arrays[name][elements] = values
        self.arrays["bend"][elements] = (tables["weight"] * tables["rigidity"]) @ slope_products(self.mesh.degree)

    def exchange(self, mesh: Discretisation) -> CompiledEquations:
        """Return the equations with other contacts closed, or other elements that stretch, for some of its unknowns."""
        exchanged, unit, counts = copy(self), self.unit, dict[str, int]()
        arrays: dict[str, Any] = {"axial": np.ascontiguousarray(mesh.elements.axial)} if mesh.moving is None else {}
        if mesh.free is not self.mesh.free:
            slot, kept = number_free(mesh.free, mesh.size), np.searchsorted(self.mesh.free, mesh.free)
            unit, nodes = self.unit[kept], mesh.node_contacts
            arrays |= {"slot": slot, "leaves": self.arrays["leaves"][kept], "unit": unit}
            for name, column, contacts in (
                ("contact_at", CLOSED_NODE, nodes),
                ("side_at", CLOSED_SIDE, mesh.side_contacts),
            ):
                if contacts:
                    arrays[name] = self.arrays[name].copy()
                    arrays[name][:, column] = [-1 if at.closed is None else at.closed for at in contacts]
            presses = sum(bool(slot[contact.unknown] >= 0) for contact in nodes)
            counts = {"free": len(mesh.free), "presses": presses, "contacts": len(nodes)}
        row = make_row(arrays, counts, self.row)
        vars(exchanged).update(mesh=mesh, unit=unit, arrays={**self.arrays, **arrays}, row=row)
        return exchanged

    def evaluate(self, z: FloatArray, drive: float, share: float = 1.0) -> tuple[FloatArray, FloatArray]:
        """Return gradient (size,) and Hessian (size, size) by all unknowns."""
        gradient, hessian = np.empty(len(z)), np.empty((len(z), len(z)))
        self.code.evaluate(self.row, np.ascontiguousarray(z, float), np.array([drive], float), gradient, hessian, share)
        return gradient, hessian

    def gradients(self, z: FloatArray, drive: FloatArray) -> FloatArray:
        """Return the gradients by all unknowns of states (p, size), (p, size)."""
        gradients = np.empty(z.shape)
        inputs = np.ascontiguousarray(z, float), np.ascontiguousarray(drive, float)
        self.code.evaluate(self.row, *inputs, gradients, np.empty(0), 1.0)
        return gradients

    def measure_nodes(self, z: FloatArray) -> FloatArray | None:
        """Return the gaps of all contacts of nodes in states (n, size), (contacts, n)."""
        gaps = np.empty((len(self.mesh.node_contacts), len(z)))
        self.code.contact_gaps(self.row, np.ascontiguousarray(z, float), gaps)
        return gaps

    def search_sides(
        self, z: FloatArray, stages: FloatArray, sides: SideData, tables: LineTables, watch: bool = False
    ) -> FloatArray | None:
        """Return the least gaps of sides in n states, (n, s, 5); None if an element vanishes in one.

        Least gap with its slack, the gap, the row of its element, the place on it, and the range of all gaps seen. To
        `watch` for contact a gap that is not near may be a lower bound, and alone: that takes a fraction of the time.
        """
        result = np.empty((len(z), len(sides.numbers), 5))
        inputs = np.ascontiguousarray(z, float), np.ascontiguousarray(stages, float)
        good = self.code.side_gaps(self.row, *inputs, *sides, tables.packed, result, tables.n_places, watch)
        return result if good else None

    def locate(self, z: FloatArray, stages: FloatArray, places: FloatArray, tables: LineTables) -> FloatArray | None:
        """Return place and rotation from rest in n states at places (n, k, 2); None if an element vanishes.

        (n, k, 4): x, y, rotation, arc length from there to the end of the element.
        A place is the number of an element and a fraction of it.
        """
        result = np.empty((*places.shape[:2], 4))
        inputs = (np.ascontiguousarray(array, float) for array in (z, stages, places))
        return result if self.code.side_places(self.row, *inputs, tables.packed, result, tables.n_places) else None

    def linearise(self, free: FloatArray, place: float) -> LinearEquations:
        """Return the equations linearised at some unknowns."""
        out = LinearEquations(np.empty(self.n), np.empty((self.n, self.n)), np.empty(self.n))
        self.code.linearise(self.row, np.ascontiguousarray(free, float), *out, place)
        return out

    def resolve(self, free: FloatArray, place: float, right: FloatArray) -> tuple[FloatArray, int]:
        """Return the solutions (k, n) with the tangent for right sides (k, n), and the number of unstable directions.

        Raises LinAlgError if the tangent is singular.
        """
        solutions, count = np.array(right, float, order="C"), np.zeros(1, np.int64)
        if self.code.resolve(self.row, np.ascontiguousarray(free, float), solutions, count, place):
            raise np.linalg.LinAlgError("the tangent is singular")
        return solutions, int(self._count_unstable_each(free[None], np.array([place]), count)[0])

    def _count_unstable_each(self, free: FloatArray, places: FloatArray, counts: Any) -> Any:
        """Return numbers of unstable directions (k,) from those of C, where loads follow a negative one is a parity."""
        unknown = np.flatnonzero(counts < 0)
        if self.follows and len(unknown):
            tangents = [self.linearise(free[k], places[k]).tangent for k in unknown.tolist()]
            counts[unknown] = energy.count_divergent(self.mesh, np.array(tangents))
        return counts

    def solve(
        self,
        free: FloatArray,
        place: float,
        border: Border | None = None,
        tolerance: float = 1e-10,
        quick: bool = False,
    ) -> PathEquilibrium | None:
        """Return an equilibrium, as the method in numpy does; `quick` is for the march, which has its own loop."""
        solved = self._solve_newton(free[None], [place], border, tolerance, quick)
        x, at, rate, (code, count, effort) = (values[0] for values in solved)
        if code:
            return None
        unstable = count if count >= 0 else self._count_unstable_each(x[None], solved[1], solved[3][:, 1])[0]
        return PathEquilibrium(x, float(at), rate, int(unstable), float(effort))

    def solve_each(
        self, free: FloatArray, places: FloatArray, tolerance: float = 1e-10, quick: bool = False
    ) -> SolvedStates:
        """Return the equilibria near k guesses."""
        x, at, rate, outcomes = self._solve_newton(free, places, None, tolerance, quick)
        converged = outcomes[:, 0] == 0
        unstable = self._count_unstable_each(x, at, np.where(converged, outcomes[:, 1], 0.0).astype(np.int64))
        return SolvedStates(converged, x, rate, unstable, outcomes[:, 2])

    def _solve_newton(self, free: Any, places: Any, border: Border | None, *numbers: float) -> tuple[FloatArray, ...]:
        """Return unknowns, places, slopes, and codes, unstable directions and efforts (k, 3), from k guesses."""
        x, at = np.array(free, float, order="C"), np.array(places, float)
        rate, outcomes = np.empty(x.shape), np.zeros((len(x), 3))
        row, level = (NO_NUMBERS, 0.0) if border is None else (np.ascontiguousarray(border.row, float), border.level)
        if self.code.solve(self.row, x, at, row, rate, outcomes, level, *numbers):
            raise MemoryError
        return x, at, rate, outcomes

    def compare(self, z: FloatArray, drive: FloatArray, degree: int, tolerance: float) -> ComparedStates | None:
        """Return how states (p, size) differ from equilibria of a higher degree; None unless all beams are plain."""
        laws = self._find_laws(degree)
        if not len(laws):
            return None
        compared = compare_rows(self.row, self.mesh, laws, np.ascontiguousarray(z, float), drive, degree, tolerance)
        return None if not self.follows and (compared.unstable < 0).any() else compared

    def _find_laws(self, degree: int) -> FloatArray:
        """Return the laws by which tables of a higher degree are made, empty unless all beams are plain."""
        if degree > MAX_DEGREE:
            return NO_NUMBERS
        if "laws" in self.arrays:
            return self.arrays["laws"]  # type: ignore[no-any-return]
        mesh, bundle = self.mesh, self.mesh.fits.bundle
        if has_more_unknowns(mesh) or bundle.others or np.count_nonzero(mesh.elements.line):
            return NO_NUMBERS
        return angle_laws(bundle.coefficients[mesh.fits.number], mesh)

    def measure_load_work(self, z: FloatArray) -> FloatArray | None:
        """Return the displacements that growing loads work on in states (n, size), (n,); None under line loads."""
        work = np.empty(len(z))
        if np.count_nonzero(self.mesh.elements.line):
            return None
        self.code.load_work(self.row, np.ascontiguousarray(z, float), work)
        return work

    def find_softest(self, free: FloatArray, place: float, vector: FloatArray, rounds: int) -> tuple[float, FloatArray]:
        """Return flexibility and shape of the softest mode."""
        shape = np.array(vector, float)
        return self.code.soften(self.row, np.ascontiguousarray(free, float), shape, place, rounds), shape

    def march(self, start: PathEquilibrium, targets: FloatArray, plan: MarchPlan) -> NaturalMarch:
        """Return the states on the way to targets, as far as nothing happens."""
        n, goals = self.n, np.ascontiguousarray(targets, float)
        rows, stored = np.empty((plan.room + 1, 2 * n + 4)), np.zeros(2, np.int64)
        parity = start.unstable % 2 if self.follows else start.unstable
        rows[0, :n], rows[0, n : 2 * n] = start.x, start.rate
        rows[0, 2 * n :] = start.drive, start.effort, parity, -1.0
        plan_row = pack_plan(plan, parity, False)
        before = plan.before
        previous_row = NO_NUMBERS if before is None else np.concatenate([before.x, before.rate, [before.drive]])
        any_vector = NO_NUMBERS if plan.any_vector is None else plan.any_vector
        shapes, laws = NO_NUMBERS, NO_NUMBERS
        if plan.finer_degree:
            shapes, laws = shape_row(plan.finer_degree)[0], self._find_laws(plan.finer_degree)
        code = self.code.march(self.row, plan_row, previous_row, goals, rows, stored, any_vector, shapes, laws)
        rows = rows[1 : 1 + stored[0]].copy()
        drive, effort, counts, target = rows[:, 2 * n :].T
        unstable, at_targets = counts.astype(np.int64), target.astype(np.int64)
        x, rate, step = rows[:, :n], rows[:, n : 2 * n], float(plan_row[0])
        *ends, error = plan_row[-3:].tolist()
        reason = MarchCode(code)
        march = NaturalMarch(
            x, drive, rate, unstable, effort, at_targets, step, plan.branch, reason, tuple(ends), error
        )
        return self._cut_at_stability_change(march, start.unstable) if self.follows else march

    def _cut_at_stability_change(self, march: NaturalMarch, unstable: int) -> NaturalMarch:
        """Return a march with its unstable directions counted, as far as their number stays the same."""
        counts = self._count_unstable_each(march.x, march.drive, march.unstable)
        changed = np.flatnonzero(counts != unstable).tolist()
        names = ("x", "drive", "rate", "effort", "target")
        same: dict[str, Any] = {name: getattr(march, name)[: changed[0] if changed else None] for name in names}
        same["unstable"] = np.full(len(same["drive"]), unstable)
        return replace(march, **same, code=MarchCode.STABILITY_CHANGES if changed else march.code)


def angle_laws(coefficients: Any, mesh: Discretisation) -> FloatArray:
    """Return where each element begins on the shape of its beam, its width, and its coefficients, (..., e, n)."""
    row, cuts = mesh.numbering.row, mesh.elements.cuts
    laws = np.empty((*coefficients.shape[:-2], len(row), 2 + coefficients.shape[-1]))
    laws[..., 0], laws[..., 1], laws[..., 2:] = cuts[:, 0], cuts[:, 1] - cuts[:, 0], coefficients[..., row, :]
    return laws


def compare_rows(
    rows: Any,  # (d, fields) or (fields,) Models of plain beams
    mesh: Discretisation,  # of one of them
    laws: FloatArray,  # as `angle_laws` returns them
    z: FloatArray,  # (d, p, size) or (p, size)
    drive: FloatArray,  # (p,)
    degree: int,  # with which they are compared
    tolerance: float,  # of the next correction
) -> ComparedStates:
    """Return how states of designs differ from equilibria of a higher degree."""
    ends, outcomes = np.empty((*z.shape[:-1], mesh.numbering.n_ends)), np.empty((*z.shape[:-1], N_COMPARED))
    drives = np.ascontiguousarray(drive, float)
    if not find_module().compare(rows, shape_row(degree)[0], laws, z, drives, ends, outcomes, tolerance):
        raise MemoryError
    code, *numbers = outcomes.transpose(-1, *range(outcomes.ndim - 1))
    return ComparedStates._make((code == 0, *numbers, ends))


def pack_plan(plan: MarchPlan, unstable: int, start: bool) -> FloatArray:
    """Return the numbers of a plan as `Plan` of march.h has them."""
    on_branch = plan.branch is not None
    numbers = plan.step, plan.span, plan.largest_turn, FORCE_CHANGE, plan.tolerance, unstable, on_branch, start
    return np.array((*numbers, N_POWERS, 0.0, 0.0, np.nan), float)
