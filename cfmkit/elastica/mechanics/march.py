"""The compiled equations of a network, `march.c`, or numpy where there is no compiler.

Both give the same to rounding (tests/unit/test_elastica_march.py). C takes a model as a row of 8-byte counts and
addresses, so that an array of rows is many designs; what the addresses point to is kept with the row.
"""

from __future__ import annotations

import itertools
import os
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any, TypeGuard

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.contact.equations import ContactEquations, open_all_contacts
from cfmkit.elastica.contact.sliding import SlidingEquations
from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.contact_arrays import are_compiled, contact_arrays, last_elements
from cfmkit.elastica.mechanics.designs import design_of
from cfmkit.elastica.mechanics.discretise import BeamElements
from cfmkit.elastica.mechanics.equations import (
    FORCE_CHANGE,
    LinearEquations,
    MarchCode,
    MarchPlan,
    MarchState,
    NaturalMarch,
    NumpyEquations,
    SolvedStates,
    begin,
)
from cfmkit.elastica.mechanics.polynomials import basis
from cfmkit.elastica.model.network import LineSpring, PointLoad, SlideSpring, TorsionSpring

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.designs import NetworkDesigns
    from cfmkit.elastica.mechanics.discretise import Attached, Discretisation

MAX_DEGREE = 40
"""As in march.h: arrays of one element are on the stack."""
WITHOUT_C_VARIABLE = "CFMKIT_WITHOUT_C"
"""Environment variable that keeps everything in numpy, whatever its value."""
COMPILED_TERMS = (LineSpring, SlideSpring, TorsionSpring, PointLoad)
"""Springs and loads that march.c has; networks with others run on numpy."""

COUNT_FIELDS = (
    "elements", "points", "degree", "size", "free", "springs", "loads", "ramp", "follows", "contacts", "presses",
)  # fmt: skip
ADDRESS_FIELDS = (
    "angle", "weight", "rigidity", "axial", "shear", "ahead", "length", "line", "gap", "bend", "unknowns", "ends",
    "places", "arm", "origin", "frame", "values", "slopes", "values_by_shape", "slopes_by_shape", "products", "slot",
    "leaves", "base", "rate", "unit", "spring_at", "spring", "load_at", "load", "rest", "curl", "hindrance",
    "contact_at", "contact", "edge",
)  # fmt: skip
"""Fields of `Model` in march.h, in its order."""
OF_ELEMENTS = tuple(name for name in BeamElements._fields if name in ADDRESS_FIELDS)
WHOLE_NUMBERS = frozenset(("unknowns", "ends", "places", "slot", "leaves", "spring_at", "load_at", "contact_at"))


@cache
def _module() -> Any:
    try:
        from cfmkit.elastica.mechanics import _march  # type: ignore[attr-defined]
    except ImportError:
        return None
    return _march


def load_compiled() -> Any:
    """Return the compiled module, None if it was not built, or is switched off by `WITHOUT_C_VARIABLE`."""
    return None if WITHOUT_C_VARIABLE in os.environ else _module()


def engine() -> str:
    """Return what the beam engine runs on: "C" or "numpy"."""
    return "numpy" if load_compiled() is None else "C"


def equations(mesh: Discretisation, ramp: bool = False) -> NumpyEquations:
    """Return the equations of a network, compiled if they can be.

    Parameters
    ----------
    mesh : Discretisation
        With real arrays.
    ramp : bool
        Whether the way is the share of what is constant instead of the drive.
    """
    key = equations, ramp, load_compiled() is not None
    if key not in mesh.known:
        kinds = {type(attached.item) for attached in (*mesh.springs, *mesh.loads)}
        plain = kinds <= set(COMPILED_TERMS) and mesh.degree <= MAX_DEGREE
        if mesh.moving is not None:
            mesh.known[key] = SlidingEquations.from_mesh(mesh, ramp, equations)
        elif plain and key[2] and are_compiled(mesh):
            mesh.known[key] = CompiledEquations(mesh, ramp)
        elif mesh.contacts:
            mesh.known[key] = ContactEquations(mesh, ramp, plain=equations(open_all_contacts(mesh), ramp))
        else:
            mesh.known[key] = NumpyEquations(mesh, ramp)
    return mesh.known[key]  # type: ignore[no-any-return]


@dataclass(frozen=True, eq=False)
class CompiledEquations(NumpyEquations):
    """The same equations in compiled code."""

    arrays: Mapping[str, Any] = field(init=False)  # what the addresses point to
    row: Any = field(init=False)  # counts and addresses
    code: Any = field(init=False, default_factory=_module)  # the compiled module

    def __post_init__(self) -> None:
        """Collect the arrays."""
        super().__post_init__()
        arrays = model_arrays(self)
        counts = model_counts(self.mesh, self.ramp)
        row = np.array([*counts.values(), *(0 for _ in ADDRESS_FIELDS)], np.int64)
        self.code.place(row, len(COUNT_FIELDS), tuple(arrays.get(name) for name in ADDRESS_FIELDS))
        object.__setattr__(self, "arrays", arrays)
        object.__setattr__(self, "row", row)

    def stiffen(self, mesh: Discretisation) -> CompiledEquations:
        """Return the equations of the same network with another flexibility along its beams."""
        return self._exchange(mesh, "axial", mesh.elements.axial)

    def refill(self, elements: Any, tables: Mapping[str, Any]) -> None:
        """Replace the tables of some elements, in place: only of equations whose arrays are their own."""
        super().refill(elements, tables)
        for name, values in tables.items():
            self.arrays[name][elements] = values
        self.arrays["bend"][elements] = (tables["weight"] * tables["rigidity"]) @ slope_products(self.mesh.degree)

    def rebase(self, base: FloatArray) -> CompiledEquations:
        """Return the equations with other values of the unknowns that are held, (size,)."""
        return self._exchange(replace(self.mesh, base=base), "base", base)

    def _exchange(self, mesh: Discretisation, name: str, values: FloatArray) -> CompiledEquations:
        """Return the equations of a mesh that differs in one array."""
        exchanged, array = copy(self), np.ascontiguousarray(values, float)
        object.__setattr__(exchanged, "mesh", mesh)
        object.__setattr__(exchanged, "arrays", {**self.arrays, name: array})
        object.__setattr__(exchanged, "row", self.row.copy())
        self.code.place(exchanged.row, len(COUNT_FIELDS) + ADDRESS_FIELDS.index(name), (array,))
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

    def linearise(self, free: FloatArray, place: float) -> LinearEquations:
        """Return the equations linearised at some unknowns."""
        out = LinearEquations(np.empty(self.n), np.empty((self.n, self.n)), np.empty(self.n))
        self.code.linearise(self.row, np.ascontiguousarray(free, float), *out, place)
        return out

    def resolve(self, free: FloatArray, place: float, right: FloatArray) -> tuple[FloatArray, int]:
        """Return the solutions (k, n) with the tangent for right sides (k, n), and the number of unstable directions.

        Raises
        ------
        numpy.linalg.LinAlgError
            If the tangent is singular.
        """
        solutions, count = np.array(right, float, order="C"), np.zeros(1, np.int64)
        if self.code.resolve(self.row, np.ascontiguousarray(free, float), solutions, count, place):
            raise np.linalg.LinAlgError("the tangent is singular")
        return solutions, self._unstable(free, place, int(count[0]))

    def _unstable(self, free: FloatArray, place: float, told: int) -> int:
        """Return the count of C; where loads follow and it knows only the parity, told < 0, eigenvalues are counted."""
        return told if told >= 0 else energy.count_unstable(self.mesh, self.linearise(free, place).tangent)

    def solve(
        self,
        free: FloatArray,
        way: float,
        border: FloatArray | None = None,
        level: float = 0.0,
        push: FloatArray | None = None,
        tolerance: float = 1e-10,
        quick: bool = False,
    ) -> MarchState | None:
        """Return an equilibrium, as the method in numpy does; `quick` is for the march, which has its own loop."""
        x, at, rate, outcome = np.array(free, float), np.array([way], float), np.empty(self.n), np.empty(2)
        nothing = np.empty(0)
        inputs = [nothing if array is None else np.ascontiguousarray(array, float) for array in (border, push)]
        if self.code.solve(self.row, x, at, *inputs, rate, outcome, level, tolerance, quick):
            return None
        way = float(at[0])
        return MarchState(x, way, rate, self._unstable(x, way, int(outcome[0])), float(outcome[1]))

    def solve_each(
        self, free: FloatArray, way: FloatArray, tolerance: float = 1e-10, quick: bool = False
    ) -> SolvedStates:
        """Return the equilibria near k guesses."""
        x, ways = np.array(free, float, order="C"), np.array(way, float)
        rate, outcomes = np.empty(x.shape), np.zeros((len(x), 3))
        if self.code.solve_many(self.row, x, ways, rate, outcomes, tolerance, quick):
            raise MemoryError
        converged, unstable = outcomes[:, 0] == 0, outcomes[:, 1].astype(np.int64)
        for k in np.flatnonzero(converged & (unstable < 0)):
            unstable[k] = self._unstable(x[k], float(ways[k]), int(unstable[k]))
        return SolvedStates(converged, x, rate, unstable, outcomes[:, 2])

    def soften(self, free: FloatArray, place: float, vector: FloatArray, rounds: int) -> tuple[float, FloatArray]:
        """Return flexibility and shape of the softest mode."""
        shape = np.array(vector, float)
        return self.code.soften(self.row, np.ascontiguousarray(free, float), shape, place, rounds), shape

    def march(self, start: MarchState, targets: FloatArray, plan: MarchPlan) -> NaturalMarch:
        """Return the states on the way to targets, as far as nothing happens."""
        n, goals = self.n, np.ascontiguousarray(targets, float)
        rows, stored = np.empty((plan.room, 2 * n + 4)), np.zeros(2, np.int64)
        parity = start.unstable % 2 if self.follows else start.unstable
        plan_row = _plan_row(plan, parity, False)
        before = plan.before
        previous_row = np.empty(0) if before is None else np.concatenate([before.free, before.rate, [before.way]])
        start_row = np.concatenate([start.free, start.rate, [start.way]])
        code = self.code.march(self.row, plan_row, start_row, previous_row, goals, rows, stored)
        rows = rows[: stored[0]].copy()
        places, effort, told, target = rows[:, 2 * n :].T.tolist()
        given_states = zip(
            rows[:, :n], places, rows[:, n : 2 * n], map(int, told), effort, map(int, target), strict=True
        )
        states = tuple(itertools.starmap(MarchState, given_states))
        march = NaturalMarch(states, MarchCode(code), float(plan_row[0]))
        return self._cut_at_stability_change(march, start.unstable) if self.follows else march

    def _cut_at_stability_change(self, march: NaturalMarch, unstable: int) -> NaturalMarch:
        """Return a march with its unstable directions counted, as far as their number stays the same."""
        states: list[MarchState] = []
        for state in march.states:
            if self._unstable(state.free, state.way, state.unstable) != unstable:
                return NaturalMarch(tuple(states), MarchCode.STABILITY_CHANGES, march.step)
            states.append(state._replace(unstable=unstable))
        return replace(march, states=tuple(states))


def _plan_row(plan: MarchPlan, unstable: int, start: bool) -> FloatArray:
    """Return a `Plan` of march.h."""
    return np.array(
        [plan.step, plan.span, plan.largest_turn, FORCE_CHANGE, plan.tolerance, unstable, plan.on_branch, start], float
    )


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
            _plan_row(plan, 0, True),
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
            [[_spring(network, spring)[1] for spring in network.springs] for network in designs.each]
        )
        arrays["load"] = np.array([[_load(network, load)[1] for load in network.loads] for network in designs.each])
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


# -- arrays ------------------------------------------------------------------------------------------------------------
def model_counts(mesh: Discretisation, ramp: bool) -> dict[str, int]:
    """Return the counts of a `Model`."""
    elements, points = mesh.elements.weight.shape
    follows = any(load.item.follows for load in mesh.loads)
    presses = int(np.isin([contact.unknown for contact in mesh.contacts], mesh.free).sum())
    values = (elements, points, mesh.degree, mesh.size, len(mesh.free), len(mesh.springs))
    more = (len(mesh.loads), int(ramp), int(follows), len(mesh.contacts), presses)
    return dict(zip(COUNT_FIELDS, (*values, *more), strict=True))


def model_arrays(of: NumpyEquations) -> dict[str, Any]:
    """Return the arrays of a `Model` in C order."""
    mesh = of.mesh
    e, a = mesh.elements, mesh.attachments
    slot = np.full(mesh.size, -1, np.int64)
    slot[mesh.free] = np.arange(len(mesh.free))
    bend = (e.weight * e.rigidity) @ slope_products(mesh.degree)
    springs, loads = [_spring(mesh, s) for s in mesh.springs], [_load(mesh, load) for load in mesh.loads]
    arrays: dict[str, Any] = {name: getattr(e, name) for name in OF_ELEMENTS}
    arrays |= {"places": a.unknowns, "arm": a.arm, "origin": a.origin, "frame": a.frame}
    arrays |= _shape_tables(mesh.degree) | {"base": mesh.base, "rate": mesh.rate}
    arrays |= {"bend": bend, "slot": slot, "leaves": _leaves(mesh), "unit": of.unit}
    arrays |= {"spring_at": [at for at, _ in springs], "spring": [values for _, values in springs]}
    arrays |= {"load_at": [at for at, _ in loads], "load": [values for _, values in loads]}
    arrays |= contact_arrays(mesh) if mesh.contacts else {}
    return {
        name: np.ascontiguousarray(values, np.int64 if name in WHOLE_NUMBERS else np.float64)
        for name, values in arrays.items()
        if values is not None
    }


@lru_cache(maxsize=64)
def _shape_tables(degree: int) -> dict[str, Any]:
    rule, (i, j) = basis(degree), np.tril_indices(degree + 1)
    tables = {"values": rule.values, "slopes": rule.slopes, "values_by_shape": rule.values.T}
    tables |= {"slopes_by_shape": rule.slopes.T, "products": rule.values[:, i] * rule.values[:, j]}
    return {name: np.ascontiguousarray(table) for name, table in tables.items()}


@lru_cache(maxsize=64)
def slope_products(degree: int) -> FloatArray:
    """Return the products of the slopes of two shape functions at the Gauss points, (q, triangle), by rows of it."""
    slopes, (i, j) = basis(degree).slopes, np.tril_indices(degree + 1)
    return read_only(slopes[:, i] * slopes[:, j])


def _leaves(mesh: Discretisation) -> Any:
    """Return the last element that holds each free unknown, -1 if none does."""
    last, unknowns = np.full(mesh.size, -1, np.int64), mesh.elements.unknowns
    last[unknowns.ravel()] = np.repeat(np.arange(len(unknowns)), unknowns.shape[1])  # of several values the last stays
    return (last_elements(mesh, last) if mesh.contacts else last)[mesh.free]


def _spring(mesh: Discretisation, attached: Attached) -> tuple[tuple[int, int, int], tuple[float, ...]]:
    """Return kind and places of a spring, and its stiffness and what else it needs."""
    item, scales, attachments = attached.item, mesh.scales, mesh.attachments
    rest = attachments.origin[list(attached.places)] + attachments.arm[list(attached.places)]
    stiffness = item.stiffness * scales.length / scales.force
    if isinstance(item, SlideSpring):
        free = item.free_displacement / scales.length
        values = (stiffness, free, np.cos(item.direction), np.sin(item.direction), *rest[0])
        return (1, attached.places[0], -1), values
    if isinstance(item, LineSpring):
        ground = np.array(item.ground) / scales.length
        length = float(np.hypot(*((rest[1] if item.end else ground) - rest[0])))
        free = length if item.free_length is None else item.free_length / scales.length
        end = attached.places[1] if item.end else -1
        return (0, attached.places[0], end), (stiffness, length, free - length, *ground, 0.0)
    start, end = attached.places if item.start is not None else (-1, attached.places[0])
    return (2, start, end), (item.stiffness / scales.moment, item.free_angle, 0.0, 0.0, 0.0, 0.0)


def _load(mesh: Discretisation, attached: Attached) -> tuple[tuple[int, int, int], tuple[float, ...]]:
    """Return place of a load, whether it grows and follows, and force and moment."""
    item, scales = attached.item, mesh.scales
    unit = scales.drive if attached.grows else 1.0
    values = (item.fx * unit / scales.force, item.fy * unit / scales.force, item.moment * unit / scales.moment)
    return (attached.places[0], int(attached.grows), int(item.follows)), values
