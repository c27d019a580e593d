"""Equilibrium of a part of plane finite elements at a given travel, by Newton's method, and its stability.

`SolidProblem` (elements, supports, obstacles) is the problem that the path-following of `cfmkit.numerics.continuation`
calls; `Balance` is an equilibrium. Loose displacements are those that no support holds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import block_array, csc_array
from scipy.sparse.linalg import splu

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.numerics.continuation.problem import Border
    from cfmkit.solid.elements import Elements
    from cfmkit.solid.rigid_groups import Supports

RESIDUAL_RTOL = 1e-9
"""Largest force out of balance, in parts of the largest nodal force: Newton's last step is then below 1e-9, too."""
CORRECTION_RTOL = 1e-13
"""Correction, in parts of the part's size, below which it is rounding. In a strip 400 times as long as thick forces
are out of balance by 2e-9 at best, with corrections of 1e-15."""
ROUGH_RESIDUAL, ROUGH_CORRECTION = 1e-8, 1e-11
"""Force out of balance and correction, in the same parts, at which both are rounding if the force falls no more: in
that strip, bent to a large angle, corrections of 1e-12 are made over and over, while 1.5e-9 stays out of balance."""
MAX_NEWTON_STEPS = 12
"""Most steps of Newton's method; a travel that needs more was too long a step: three to five are usual."""
MAX_CORRECTIONS, CORRECTION_RATIO = 10, 0.25
"""Most corrections with the factors of one tangent, and by what factor each must be smaller than the one before: a
correction costs a sixth of new factors."""
MAX_REFINEMENTS, REFINEMENT_RTOL = 6, 1e-5
"""Most refinements of the path's slope with factors of a tangent nearby, and the relative change at which they end. The
slope predicts poses and motions between them; the stiffness is more accurate than it."""
PANEL_COLUMNS = 1
"""Columns that SuperLU updates together: in slender parts a column has few others beside it, and the 20 of the default
take a third more time."""
MAX_CORRECTION = 0.5
"""Largest correction in one round, in parts of the part's size: farther away the tangent says nothing."""


@dataclass(frozen=True)
class Balance:
    """Equilibrium at a travel."""

    travel: float  # [m or rad]
    unknowns: FloatArray  # (q,) [m or rad]
    effort: float  # on the drive, along its motion [N or N m]
    stiffness: float  # derivative of the effort along the path [N/m or N m/rad]
    unstable: int  # number of directions in which the part moves on by itself, the drive held
    slope: FloatArray  # (q,) of the unknowns along the path, per unit of travel
    factors: Factors | None  # of the tangent
    solved: bool = True  # false if it is put together from poses that are

    def drop_factors(self) -> Balance:
        """Return the equilibrium without the factors, which take most of its memory."""
        return replace(self, factors=None)


@dataclass(frozen=True)
class Factors:
    """A factored symmetric matrix."""

    lower_upper: Any  # of scipy, of the matrix in another order
    order: NDArray[np.int64]  # (q,) place of each row in that order

    def solve(self, right: FloatArray) -> FloatArray:
        """Return the solution of a system."""
        solution = np.empty_like(right)
        solution[self.order] = self.lower_upper.solve(right[self.order])
        return solution

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues: of negative pivots, as rows and columns were exchanged alike (Sylvester)."""
        return int((self.lower_upper.U.diagonal() < 0).sum())


@dataclass(frozen=True)
class LinearisedPart:
    """A linearised problem."""

    matrix: csc_array  # the tangent (q, q), unknowns in the order of `order`
    order: NDArray[np.int64]  # (q,)
    slope: FloatArray  # (q,) derivative of the residual with respect to the travel
    residual: FloatArray  # (q,) what is out of balance [N or N m]
    forces: FloatArray  # (n, 2) on the nodes [N]

    @cached_property
    def factors(self) -> Factors:
        """The tangent's factors; RuntimeError where it is singular."""
        options = {"SymmetricMode": True}
        factors = splu(self.matrix, "NATURAL", diag_pivot_thresh=0.0, panel_size=PANEL_COLUMNS, options=options)
        return Factors(factors, self.order)


@dataclass(frozen=True)
class Selection:
    """Indices of the stiffnesses of loose nodes by each other among all, in an order in which factors stay sparse."""

    order: NDArray[np.int64]  # (l,) of the loose displacements: minimum degree
    # entries, indices, starts: which entries of the whole matrix, and the pattern of what they make
    entries: NDArray[np.int64]
    indices: NDArray[np.int32]
    starts: NDArray[np.int32]

    @classmethod
    def from_matrix(cls, stiffness: csc_array, loose: NDArray[np.int64]) -> Selection:
        """Return the selection of some displacements of a matrix, whose pattern stays."""
        block = csc_array(stiffness[loose][:, loose])
        first = splu(block, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        order = np.argsort(first.perm_c)
        count = np.arange(1.0, stiffness.nnz + 1)  # numbers of the entries: none is 0, none is lost
        numbers = csc_array((count, stiffness.indices, stiffness.indptr), shape=stiffness.shape)
        kept = csc_array(numbers[loose[order]][:, loose[order]])
        kept.sort_indices()
        return cls(order, kept.data.astype(np.int64) - 1, kept.indices, kept.indptr)

    def extract(self, stiffness: csc_array) -> csc_array:
        """Return these entries as a matrix (l, l)."""
        size = len(self.order)
        return csc_array((stiffness.data[self.entries], self.indices, self.starts), shape=(size, size))


@dataclass(frozen=True)
class SolidProblem:
    """A part of finite elements with its supports and obstacles, solved for equilibria."""

    elements: Elements
    supports: Supports
    obstacles: tuple[FloatArray, ...] = ()  # polygons that stand and that the part must not enter [m]

    @cached_property
    def size(self) -> float:
        """Larger side of the box around the part [m]."""
        return float(np.ptp(self.elements.mesh.nodes, axis=0).max())

    def scale_loads(self, share: float) -> SolidProblem:
        """Return the part under a share of its constant loads."""
        part = replace(self, supports=self.supports.scale_loads(share))
        part.__dict__.update({name: self.__dict__[name] for name in ("size", "_selection") if name in self.__dict__})
        return part

    def linearise(self, unknowns: FloatArray, travel: float) -> LinearisedPart:
        """Return the problem's linearisation at some displacements; RuntimeError where it is singular at first."""
        moved = self.supports.evaluate_displacements(unknowns, travel)
        forces, stiffness = self.elements.tangent(moved)
        beside, corner, slope = self.supports.linearize_motion(unknowns, travel, forces).borders(stiffness)
        if (selection := self.__dict__.get("_selection")) is None:  # found once, from a matrix with the pattern of all
            selection = self.__dict__["_selection"] = Selection.from_matrix(stiffness, self.supports.loose)
        order = np.concatenate([selection.order, np.arange(len(selection.order), self.supports.size)])
        matrix = selection.extract(stiffness)
        if len(corner):  # free motions are last: their full rows fill nothing in
            side = csc_array(beside[selection.order])
            matrix = csc_array(block_array([[matrix, side], [side.T, csc_array(corner)]], format="csc"))
        return LinearisedPart(matrix, order, slope, self.supports.residual(unknowns, travel, forces), forces)

    def solve(self, guess: FloatArray, travel: float, border: Border | None = None) -> Balance | None:
        """Return the equilibrium near a guess, at its travel or where a border's condition holds; None if none is near.

        Factors of a tangent serve as long as each correction is much smaller than the last.
        """
        place, least, on_border = np.append(guess, travel), np.inf, border is None
        with np.errstate(all="ignore"):
            for _ in range(MAX_NEWTON_STEPS):
                try:
                    linear = self.linearise(place[:-1], place[-1])
                    rate = np.empty(0) if border is None else -linear.factors.solve(linear.slope)
                    correct = _Correction(linear.factors, border, rate)
                except RuntimeError:  # exactly singular
                    return None
                step = correct(linear.residual, place)
                if not self._is_credible(linear.forces, step):
                    return None
                left = float(np.abs(linear.residual).max(initial=0.0) / np.abs(linear.forces).max())
                rounded = 0.5 * least < left <= ROUGH_RESIDUAL and self._is_negligible(step, ROUGH_CORRECTION)
                if on_border and (
                    self._is_balanced(linear.residual, linear.forces) or self._is_negligible(step) or rounded
                ):
                    return self._balance(place, linear.factors)
                place, least, on_border = place - step, min(least, left), True
                for _ in range(MAX_CORRECTIONS):
                    forces = self.elements.forces(self.supports.evaluate_displacements(place[:-1], place[-1]))
                    residual = self.supports.residual(place[:-1], place[-1], forces)
                    if self._is_balanced(residual, forces):
                        return self._balance(place, linear.factors)
                    more = correct(residual, place)
                    if self._is_negligible(more):
                        return self._balance(place, linear.factors)
                    if not np.abs(more[:-1]).max() <= CORRECTION_RATIO * np.abs(step[:-1]).max():
                        break
                    place, step = place - more, more
        return None

    def _is_balanced(self, residual: FloatArray, forces: FloatArray) -> bool:
        return bool(np.abs(residual).max(initial=0.0) <= RESIDUAL_RTOL * np.abs(forces).max())

    def _is_negligible(self, step: FloatArray, part: float = CORRECTION_RTOL) -> bool:
        return bool(np.abs(step[:-1]).max(initial=0.0) <= part * self.size)

    def _is_credible(self, forces: FloatArray, step: FloatArray) -> bool:
        """Return True if a correction is small enough to be believed."""
        finite = np.isfinite(np.abs(forces).max())
        return bool(finite and np.abs(step[: len(self.supports.loose)]).max(initial=0.0) < MAX_CORRECTION * self.size)

    def _balance(self, place: FloatArray, factors: Factors) -> Balance:
        """Return the equilibrium, with factors of a tangent close to its own; with its own if they are not close."""
        unknowns, travel = place[:-1], float(place[-1])
        forces, pull = self.elements.linearize(self.supports.evaluate_displacements(unknowns, travel))
        carried = self.supports.linearize_motion(unknowns, travel, forces)
        path = np.append(np.zeros(self.supports.size), 1.0)
        beside = carried.times(pull, path)
        path[:-1] = -factors.solve(beside[:-1])
        for _ in range(MAX_REFINEMENTS):
            pulled = carried.times(pull, path)
            more = factors.solve(pulled[:-1])
            # of second order in what the slope was off before: far closer than what it is off now
            stiffness = float(path @ pulled - more @ pulled[:-1])
            path[:-1] -= more
            if np.abs(more).max(initial=0.0) <= REFINEMENT_RTOL * np.abs(path[:-1]).max(initial=0.0):
                break
        else:
            factors = self.linearise(unknowns, travel).factors
            path[:-1] = -factors.solve(beside[:-1])
            stiffness = float(path @ beside)
        effort = self._effort(unknowns, travel, forces)
        return Balance(travel, unknowns, effort, stiffness, factors.negative, path[:-1], factors)

    def measure(self, unknowns: FloatArray, travel: float, slope: FloatArray, unstable: int) -> Balance:
        """Return the equilibrium at unknowns that are solved for already, with the effort and the stiffness there."""
        forces, pull = self.elements.linearize(self.supports.evaluate_displacements(unknowns, travel))
        path = np.append(slope, 1.0)
        stiffness = float(path @ self.supports.linearize_motion(unknowns, travel, forces).times(pull, path))
        return Balance(travel, unknowns, self._effort(unknowns, travel, forces), stiffness, unstable, slope, None)

    def _effort(self, unknowns: FloatArray, travel: float, forces: FloatArray) -> float:
        reactions = self.supports.reactions(unknowns, travel, forces)
        return float(
            sum(group.driven @ reaction for group, reaction in zip(self.supports.groups, reactions, strict=True))
        )


@dataclass(frozen=True)
class _Correction:
    """Newton's correction with the factors of one tangent, of unknowns and travel (q + 1,)."""

    factors: Factors
    border: Border | None
    rate: FloatArray  # of the unknowns by the travel, (q,); empty without a border

    def __call__(self, residual: FloatArray, place: FloatArray) -> FloatArray:
        """Return what is to be subtracted from a place where a residual is left."""
        step = np.append(self.factors.solve(residual), 0.0)
        if self.border is not None:
            row, level = self.border
            step[-1] = (row @ (place - step) - level) / (row[-1] + row[:-1] @ self.rate)
            step[:-1] += step[-1] * self.rate
        return step
