"""Equilibrium of a network as equations for its free unknowns: Newton's method and the natural march, in numpy.

This is the specification of `march.c`; `cfmkit.elastica.mechanics.march.equations` returns whichever is there. The way
that is followed is the drive, or, of a network under constant loads, the share of what is constant while the drive
rests.

References
----------
[De] P. Deuflhard, Newton Methods for Nonlinear Problems (2004), ch. 5: step control by what a prediction missed.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.mechanics import energy
from cfmkit.numerics.continuation.path import MarchedSteps
from cfmkit.numerics.continuation.problem import PathEquilibrium, largest_motion
from cfmkit.numerics.continuation.steps import judge
from cfmkit.numerics.dual_array import COMPLEX_STEP

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.discretise import Discretisation
    from cfmkit.numerics.continuation.path import PathBranch
    from cfmkit.numerics.continuation.problem import Border

MAX_ROUNDS = 14  # of Newton's method
LARGEST_CORRECTION = 50.0  # of a motion: beyond that Newton's method has left the path
SAME_EQUILIBRIUM = 1e-7  # motions that differ by less are one
MOTION_RTOL = 1e-9
"""Motions that change by less stand: then forces may still change by 1e-3.

Bent by a share d of its length, a beam that does not stretch moves by eps / (2 d) and bears eps / d^2 where rounding of
a place presses it. A force of 1e-3 of ten units goes with d = 1.5e-7, and with a motion of 7e-10.
"""
FORCE_CHANGE = 8.0  # of a section force in one step, in EI/L^2 of its element, besides half of what it was
LAND_FROM = 1.3  # steps to a target from which on it is hit by one
SHORTEST_STEP = 1e-13  # share of the range
N_PREDICTING = 3  # states whose polynomial predicts the next
N_POWERS = 3  # by which the flexibility of the softest mode is found
MAX_REJECTED = 7  # two for each rejected step, one less for each accepted one


class MarchCode(IntEnum):
    """Reasons for the end of a march."""

    DONE = 0  # all targets were reached
    STABILITY_CHANGES = 1  # the next step is less stable, or more
    STEPS_FAIL = 2  # too many steps in a row are rejected
    FULL = 3  # there is no room for more states
    BRANCH_ENDS = 4  # going back from the next state leads elsewhere
    NO_START = 5  # no equilibrium at the start


class LinearEquations(NamedTuple):
    """The equations at some unknowns: residual (n,), tangent (n, n), change of the residual along the way (n,)."""

    residual: FloatArray
    tangent: FloatArray
    change: FloatArray


class LineTables(NamedTuple):
    """Tables by which `gaps.c` follows the lines of elements of one degree."""

    packed: FloatArray  # places along an element, Gauss weights, matrices to these places, and to Legendre coefficients
    n_places: int


class SideData(NamedTuple):
    """Sides of beams of one thickness, and what they may touch, as `gaps.c` takes them: s sides."""

    elements: FloatArray  # (k, 2) of each side, then of its other beam: number, how far it may lie inside
    numbers: FloatArray  # (s, 12) see `side_gaps` in gaps.c
    edge: FloatArray  # (parts, 6) of outlines


class SolvedStates(NamedTuple):
    """Equilibria that Newton's method finds near k guesses."""

    converged: Any  # (k,)
    free: FloatArray  # (k, n)
    rate: FloatArray  # (k, n)
    unstable: Any  # (k,)
    effort: FloatArray  # (k,)


class ComparedStates(NamedTuple):
    """p states beside the equilibria of a higher degree near them, or beside themselves where there is none."""

    converged: Any  # (p,)
    unstable: Any  # (p,) where loads follow C may know the parity alone: -1 is even, -2 odd
    moved: FloatArray  # (p,) largest change of a motion
    force: FloatArray  # (p,) largest change of a force on an end of an element
    effort: FloatArray  # (p,) of a drive by a motion, dimensionless
    largest: FloatArray  # (p,) force or moment in a beam
    motion: FloatArray  # (p,) largest change of the motion of an end of an element
    ends: FloatArray  # (p, ends) unknowns that move these, which come first

    def is_as_stable(self, unstable: Any) -> Any:
        """Return where the number of unstable directions is as given, or may be, (p,)."""
        return np.where(self.unstable < 0, (self.unstable + unstable) % 2 == 1, self.unstable == unstable)


@dataclass(frozen=True)
class MarchPlan:
    """Start of a march and its step."""

    step: float  # first one, along the way
    span: float  # range of the way
    before: PathEquilibrium | None = None  # the state before the first, for a better prediction
    largest_turn: float = 0.35  # change of a motion in one step
    tolerance: float = 1e-10
    branch: PathBranch | None = None  # then it is checked that every state leads back: a branch may end
    room: int = 2000  # states
    any_vector: FloatArray | None = None  # then flexibilities at both ends are wanted, found from this one (compiled)
    finer_degree: int = 0  # with which the error of the whole path is estimated, if it is wanted (compiled)


@dataclass(frozen=True, eq=False)
class NaturalMarch(MarchedSteps):
    """Equilibria that were reached, and why the march ended; efforts are gradients by what the way moves."""

    code: MarchCode
    flexibilities: tuple[float, ...] = (0.0, 0.0)  # of the softest modes at both ends, if they are known
    error: float = np.nan  # estimated, of the whole path, if it is known

    @property
    def stuck(self) -> bool:
        """True if too many steps in a row were rejected."""
        return self.code is MarchCode.STEPS_FAIL


@dataclass(frozen=True, eq=False)
class NumpyEquations:
    """Equations of a network for its free unknowns, along a drive or, with `ramp`, the share of what is constant."""

    mesh: Discretisation
    ramp: bool = False
    unit: Any = field(init=False)  # (n,) unit of a section force; infinite for motions

    def __post_init__(self) -> None:
        """Set the units."""
        object.__setattr__(self, "unit", force_units(self.mesh))

    def exchange(self, mesh: Discretisation) -> NumpyEquations | None:
        """Return the equations with other contacts closed, or other elements that stretch; None: make new ones."""
        return None

    def refill(self, elements: Any, tables: Mapping[str, Any]) -> None:
        """Replace the tables of some elements, in place: only of equations whose arrays are their own."""
        for name, values in tables.items():
            getattr(self.mesh.elements, name)[elements] = values

    @property
    def motions(self) -> Any:
        """Which free unknowns are motions, or say where and how contacts touch."""
        return np.isinf(self.unit)

    @property
    def n(self) -> int:
        """Number of free unknowns."""
        return len(self.mesh.free)

    @property
    def effort_unit(self) -> float:
        """Unit of the efforts of a drive by a motion [N or N m]."""
        return self.mesh.scales.moment / self.mesh.scales.drive

    @property
    def follows(self) -> bool:
        """True if some load turns with its node: the tangent is unsymmetric."""
        return any(load.item.follows for load in self.mesh.loads)

    def factors(self, place: Any) -> tuple[Any, Any]:
        """Return drive and share at a place of the way."""
        return (0.0, place) if self.ramp else (place, 1.0)

    def values(self, free: Any, place: Any) -> Any:
        """Return all unknowns, (size,)."""
        return energy.expand_unknowns(self.mesh, free, *self.factors(place))

    def gradient(self, free: Any, place: Any) -> Any:
        """Return the gradient by all unknowns, (size,)."""
        drive, share = self.factors(place)
        return energy.gradient(self.mesh, energy.expand_unknowns(self.mesh, free, drive, share), drive, share)

    def _leave_to_functions(self, *_: Any, **__: Any) -> Any:
        """Return None: what `CompiledEquations` computes under these names functions in numpy compute elsewhere."""

    measure_nodes = measure_curvatures = search_sides = locate = compare = measure_load_work = _leave_to_functions

    def evaluate(self, z: FloatArray, drive: float, share: float = 1.0) -> tuple[FloatArray, FloatArray]:
        """Return gradient (size,) and Hessian (size, size) by all unknowns."""
        return energy.gradient(self.mesh, z, drive, share), energy.hessian(self.mesh, z, drive, share)

    def gradients(self, z: FloatArray, drive: FloatArray) -> FloatArray:
        """Return the gradients by all unknowns of states (p, size), (p, size); what is constant is all there."""
        gradients = [energy.gradient(self.mesh, *pair) for pair in zip(z, drive, strict=True)]
        return np.array(gradients).reshape(z.shape)

    def linearise(self, free: FloatArray, place: float) -> LinearEquations:
        """Return the equations linearised at some unknowns."""
        drive, share = self.factors(place)
        z, chosen = energy.expand_unknowns(self.mesh, free, drive, share), self.mesh.free
        tangent = energy.hessian(self.mesh, z, drive, share)[np.ix_(chosen, chosen)]
        stepped = self.gradient(free, place + 1j * COMPLEX_STEP)[chosen]
        return LinearEquations(stepped.real.copy(), tangent, stepped.imag / COMPLEX_STEP)

    def resolve(self, free: FloatArray, place: float, right: FloatArray) -> tuple[FloatArray, int]:
        """Return the solutions (k, n) with the tangent for right sides (k, n), and the number of unstable directions.

        Raises LinAlgError if the tangent is singular.
        """
        at = self.linearise(free, place)
        return np.asarray(np.linalg.solve(at.tangent, right.T).T, float), self.count_unstable(at)

    def count_unstable(self, at: LinearEquations) -> int:
        """Return the number of unstable directions at a held drive."""
        return energy.count_unstable(self.mesh, at.tangent)

    def solve(
        self,
        free: FloatArray,  # (n,) first guess
        place: float,
        border: Border | None = None,  # what is held instead of the way
        tolerance: float = 1e-10,  # of corrections, relative to the largest motion and force
        quick: bool = False,  # accept when the next correction would be below the tolerance
    ) -> PathEquilibrium | None:
        """Return the equilibrium at a place of the way, or where a border is met; None if there is none."""
        free, last = np.array(free, float), np.inf
        moves, size = self.motions, np.zeros(len(free))
        for _ in range(MAX_ROUNDS):
            at = self.linearise(free, place)
            try:
                step, rate = np.linalg.solve(at.tangent, -np.stack([at.residual, at.change], axis=1)).T
            except np.linalg.LinAlgError:
                return None
            along = 0.0 if border is None else border.find_drive_change(free + step, place, rate)
            change = step + along * rate
            if not (np.isfinite(change).all() and np.abs(change[moves]).max(initial=0.0) <= LARGEST_CORRECTION):
                return None
            size[moves], forces = np.abs(change[moves]), ~moves
            size[forces] = np.abs(change[forces]) / np.maximum(10 * self.unit[forces], np.abs(free[forces]))
            largest, moved = float(size.max(initial=0.0)), float(size[moves].max(initial=0.0))
            old, old_way, free, place = free, place, free + change, place + along
            if quick and largest**2 < tolerance:
                effort = self._compute_effort(old, old_way) + float(at.change @ step)
                return PathEquilibrium(free, place, rate, self.count_unstable(at), effort)
            # a large force multiplies rounding: accept where motions stand and forces no longer come nearer
            rounds = (moved < SAME_EQUILIBRIUM and largest < 2e-5) or (moved < MOTION_RTOL and largest < 1e-3)
            stands = rounds and largest > 0.3 * last
            if stands or largest < tolerance * (1 + np.abs(free[moves]).max(initial=0.0)):
                unstable = self.count_unstable(at)
                return PathEquilibrium(free, place, rate, unstable, self._compute_effort(free, place))
            last = largest
        return None

    def solve_each(
        self, free: FloatArray, places: FloatArray, tolerance: float = 1e-10, quick: bool = False
    ) -> SolvedStates:
        """Return the equilibria near k guesses (k, n) at places (k,) of the way; see `solve`."""
        return self.collect(
            [self.solve(*pair, tolerance=tolerance, quick=quick) for pair in zip(free, places, strict=True)]
        )

    def collect(self, solved: Sequence[PathEquilibrium | None]) -> SolvedStates:
        """Return single equilibria, None where there is none, as arrays."""
        nothing = PathEquilibrium(np.full(self.n, np.nan), np.nan, np.full(self.n, np.nan), 0, np.nan)
        states = [state or nothing for state in solved]
        return SolvedStates(
            np.array([state is not None for state in solved], bool),
            np.array([state.x for state in states]).reshape(len(solved), self.n),
            np.array([state.rate for state in states]).reshape(len(solved), self.n),
            np.array([state.unstable for state in states], np.int64),
            np.array([state.effort for state in states]),
        )

    def find_softest(self, free: FloatArray, place: float, vector: FloatArray, rounds: int) -> tuple[float, FloatArray]:
        """Return flexibility and shape of the softest mode of the motions after some powers of their flexibility.

        The flexibility is 0 if the tangent is singular.
        """
        moves, flexibility = self.mesh.free < self.mesh.n_motions, 0.0
        vector = np.array(vector, float)
        try:
            inverse = np.linalg.inv(self.linearise(free, place).tangent)
        except np.linalg.LinAlgError:
            return 0.0, vector
        for _ in range(rounds):
            moved = inverse[:, moves] @ vector[moves]
            flexibility = float(vector[moves] @ moved[moves] / (vector[moves] @ vector[moves]))
            vector = moved / np.linalg.norm(moved[moves])
        return flexibility, vector

    def _compute_effort(self, free: FloatArray, place: float) -> float:
        moved = self.mesh.base if self.ramp else self.mesh.rate
        return float(self.gradient(free, place) @ moved)

    def march(self, start: PathEquilibrium, targets: FloatArray, plan: MarchPlan) -> NaturalMarch:
        """Return the states on the way to targets, as far as nothing happens.

        A step is accepted if motions and forces change little, the prediction was good, and the chord agrees with the
        slopes at both of its ends; it ends before one at which the number of unstable directions changes.
        """
        return _march_in_numpy(self, start, np.asarray(targets, float), plan)


def force_units(mesh: Discretisation) -> FloatArray:
    """Return the unit of each free unknown that is a force, EI/L^2 of its element or 1; infinite for motions."""
    e = mesh.elements
    length = e.length.real.reshape(-1, len(e.beam))[0]  # those of the first of several states
    rigidity = (e.rigidity * e.weight).real.reshape(-1, *e.weight.shape[-2:])[0]
    bending = rigidity.sum(axis=1) * length
    unit = np.full(mesh.size, np.inf)
    unit[e.unknowns[:, -2:]] = (bending / length**2)[:, None]
    if mesh.contacts:
        unit[[contact.unknown for contact in mesh.contacts]] = 1.0
        unit[[contact.rub for contact in mesh.contacts if contact.rub >= 0]] = 1.0
    return np.asarray(unit[mesh.free])


# -- natural march -----------------------------------------------------------------------------------------------------
def predict(states: Sequence[PathEquilibrium], goal: float) -> FloatArray:
    """Return Hermite's polynomial through up to three states and their slopes at a place of the way.

    Of one it is the tangent, of two the cubic.
    """
    total: Any = 0.0
    for state in states:
        others = [neighbour.drive for neighbour in states if neighbour is not state]
        share = float(np.prod([(goal - place) / (state.drive - place) for place in others])) ** 2
        slope = 2 * sum(1 / (state.drive - place) for place in others)
        ahead = goal - state.drive
        total = total + share * ((1 - slope * ahead) * state.x + ahead * state.rate)
    return np.asarray(total)


def _leads_back(
    equations: NumpyEquations, current: PathEquilibrium, new: PathEquilibrium, moved: float, tolerance: float
) -> bool:
    """Return True if going back from a new state along its slope leads to the last one: else the branch has ended."""
    guess = new.x - (new.drive - current.drive) * new.rate
    back = equations.solve(guess, current.drive, tolerance=tolerance, quick=True)
    if back is None:
        return False
    return largest_motion(equations, back.x - current.x) < SAME_EQUILIBRIUM + 1e-3 * moved


def _march_in_numpy(
    equations: NumpyEquations, start: PathEquilibrium, targets: FloatArray, plan: MarchPlan
) -> NaturalMarch:
    """Return the states on the way to targets: `march` of march.c in numpy."""
    current, step = start, plan.step
    earlier = (
        [] if plan.before is None or plan.before.drive == start.drive else [plan.before]
    )  # on this way, latest first
    states, at_targets = list[PathEquilibrium](), list[int]()

    def end(code: MarchCode) -> NaturalMarch:
        shape = len(states), equations.n
        x, rate = (np.array([state[k] for state in states]).reshape(shape) for k in (0, 2))
        drive, effort = (np.array([state[k] for state in states], float) for k in (1, 4))
        unstable = np.array([state.unstable for state in states], np.int64)
        return NaturalMarch(x, drive, rate, unstable, effort, np.array(at_targets, np.int64), step, plan.branch, code)

    passed = rejected = 0
    while passed < len(targets) and len(states) < plan.room:
        left = float(targets[passed] - current.drive)
        sense, lands = np.sign(left), abs(left) <= LAND_FROM * step
        goal = float(targets[passed]) if lands else current.drive + sense * step
        ahead = goal - current.drive
        if earlier and (current.drive - earlier[0].drive) * sense < 0:
            earlier = []
        guess = predict((current, *earlier), goal)
        new = equations.solve(guess, goal, tolerance=plan.tolerance, quick=True)
        trial = judge(equations, current, new, guess, (plan.largest_turn, FORCE_CHANGE))
        if trial.excess > 1:
            step = abs(ahead) * max(0.7 / trial.excess, 1e-4)  # too long for the forces: no sign of trouble
        elif trial.new is None:
            step, rejected = 0.5 * abs(ahead), rejected + 2
        else:
            new, rejected = trial.new, max(0, rejected - 1)
            if new.unstable != start.unstable:
                return end(MarchCode.STABILITY_CHANGES)
            if plan.branch and not _leads_back(equations, current, new, trial.motion, plan.tolerance):
                return end(MarchCode.BRANCH_ENDS)
            earlier = [current, *earlier[: N_PREDICTING - 2]]
            current = new
            states.append(new)
            at_targets.append(passed if lands else -1)
            passed += lands
            if trial.misfit < 0.1:
                step = min(plan.span, 1.6 * (step if lands else max(step, abs(ahead))))
            elif trial.misfit > 0.25:
                step = 0.8 * abs(ahead)
            continue
        if earlier and step < 0.25 * abs(current.drive - earlier[0].drive):
            earlier = []
        if rejected > MAX_REJECTED or step < SHORTEST_STEP * plan.span:
            return end(MarchCode.STEPS_FAIL)
    return end(MarchCode.DONE if passed == len(targets) else MarchCode.FULL)
