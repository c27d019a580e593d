"""Equilibrium of a part at a given travel, and whether it is stable."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.solid.elements import Elements
    from cfmkit.solid.supports import Supports

CLOSE = 1e-9
"""Largest force out of balance, in parts of the largest nodal force: Newton's last step is then below 1e-9, too."""
ROUNDS = 12
"""Of Newton's method; steps that need more are too long: from a predictor three to five are usual."""
FAR = 0.5
"""Largest correction in one round, in parts of the part's size: farther away the tangent says nothing."""


@dataclass(frozen=True)
class Balance:
    """Equilibrium at a travel.

    Attributes
    ----------
    travel : float
        [m or rad]
    unknowns : (q,) array
        [m or rad]
    effort : float
        On the drive, along its motion [N or N m].
    stiffness : float
        Derivative of the effort along the path [N/m or N m/rad].
    unstable : int
        Number of directions in which the part moves on by itself, the drive held.
    slope : (q,) array
        Of the unknowns along the path, per unit of travel.
    factors : Factors or None
        Of the tangent.
    """

    travel: float
    unknowns: FloatArray
    effort: float
    stiffness: float
    unstable: int
    slope: FloatArray
    factors: Factors | None

    def kept(self) -> Balance:
        """Return the same without the factors, which take a hundred times the room of all the rest."""
        return replace(self, factors=None)


@dataclass(frozen=True)
class Factors:
    """A factored symmetric matrix.

    Attributes
    ----------
    lower_upper : object
        Of scipy, of the matrix in another order.
    order : (q,) array of int
        Place of each row in that order.
    """

    lower_upper: Any
    order: NDArray[np.int64]

    def solve(self, right: FloatArray) -> FloatArray:
        """Return the solution of a system."""
        found = np.empty_like(right)
        found[self.order] = self.lower_upper.solve(right[self.order])
        return found

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues: of negative pivots, as rows and columns were exchanged alike (Sylvester)."""
        return int((self.lower_upper.U.diagonal() < 0).sum())


@dataclass(frozen=True)
class Linear:
    """A linearised problem.

    Attributes
    ----------
    factors : Factors
        Of the tangent.
    slope : (q,) array
        Derivative of the residual with respect to the travel.
    pinned : float
        Derivative of the effort with respect to the travel, the unknowns held.
    residual : (q,) array
        What is out of balance [N or N m].
    forces : (n, 2) array
        On the nodes [N].
    """

    factors: Factors
    slope: FloatArray
    pinned: float
    residual: FloatArray
    forces: FloatArray


@dataclass(frozen=True)
class Problem:
    """A part, its supports, and how to solve for it.

    Attributes
    ----------
    elements : Elements
    supports : Supports
    """

    elements: Elements
    supports: Supports

    @cached_property
    def _scale(self) -> float:
        return float(np.ptp(self.elements.mesh.nodes, axis=0).max())

    def linearised(self, unknowns: FloatArray, travel: float) -> Linear:
        """Return the problem's linearisation at some displacements; RuntimeError where the tangent is singular."""
        moved = self.supports.displaced(unknowns, travel)
        forces, stiffness = self.elements.tangent(moved)
        matrix, slope, pinned = self.supports.condensed(unknowns, travel, forces, stiffness)
        order = self._order(matrix)
        shuffled = csc_array(matrix[order][:, order])
        found = splu(shuffled, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        residual = self.supports.residual(unknowns, travel, forces)
        return Linear(Factors(found, order), slope, pinned, residual, forces)

    def _order(self, matrix: csc_array) -> NDArray[np.int64]:
        """Return the order of the unknowns in which factors stay sparse: minimum degree, found once."""
        found: NDArray[np.int64] | None = self.__dict__.get("_found_order")
        if found is None:
            first = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
            found = np.argsort(first.perm_c)
            self.__dict__["_found_order"] = found
        return found

    def solve(self, guess: FloatArray, travel: float) -> Balance | None:
        """Return the equilibrium near a guess; None where Newton's method finds none."""
        unknowns = guess.copy()
        with np.errstate(all="ignore"):
            for _ in range(ROUNDS):
                try:
                    here = self.linearised(unknowns, travel)
                except RuntimeError:  # exactly singular
                    return None
                largest = float(np.abs(here.forces).max())
                step = here.factors.solve(here.residual)
                if not np.isfinite(largest) or not self._near(step):
                    return None
                if np.abs(here.residual).max(initial=0.0) <= CLOSE * largest:
                    return self._balance(unknowns, travel, here)
                unknowns = unknowns - step
        return None

    def _near(self, step: FloatArray) -> bool:
        """Tell whether a correction is small enough to be believed."""
        return bool(np.abs(step[: len(self.supports.loose)]).max(initial=0.0) < FAR * self._scale)

    def _balance(self, unknowns: FloatArray, travel: float, here: Linear) -> Balance:
        slope = -here.factors.solve(here.slope)
        return Balance(
            travel,
            unknowns,
            self._effort(unknowns, travel, here.forces),
            here.pinned + float(slope @ here.slope),
            here.factors.negative,
            slope,
            here.factors,
        )

    def _effort(self, unknowns: FloatArray, travel: float, forces: FloatArray) -> float:
        reactions = self.supports.reactions(unknowns, travel, forces)
        return float(sum(group.driven @ one for group, one in zip(self.supports.groups, reactions, strict=True)))
