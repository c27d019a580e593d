"""The second derivative of the energy of a network at one state: its eigenvalues and modes.

The energy is that of the poses q; the forces p in the beams follow from them. It is known by its inverse K^-1, the
part of the inverse of the tangent of both that belongs to q: that exists where beams do not stretch, too. An
eigenvalue of K is negative for every unstable direction.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from typing import Any

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.equilibrium.expanded import ExpandedSolver

_RIGID = 1e-14  # share of the largest compliance that is none
_ROUNDING = 1e-14  # share of the largest entry by which a singular tangent is made regular
_MOVED = 1e-3  # share of a mode's largest change of a pose from which a node counts as moved


class Curvature:
    """Eigenvalues `values` (m,) of the second derivative at (y, drive), rising, without those of rigid directions.

    `modes` (n, m) are the changes of z that go with them, of unit size in q; `newton` (m,) is Newton's step along them.
    """

    def __init__(self, solver: ExpandedSolver, y: FloatArray, drive: float) -> None:
        """Invert the tangent."""
        self.solver, self.y, self.drive, free = solver, y, drive, solver.n_free
        matrix, _ = solver.tangent_at(y, drive)
        residual, slot = solver.scratch[3], solver.model.slot
        forces = np.zeros(solver.n)
        forces[slot[slot >= 0]] = residual[: solver.n_dofs][slot >= 0]
        forces[free:] = residual[solver.n_dofs :]
        inverse = -_inverse(matrix)
        compliance = inverse[:free, :free]
        given, vectors = np.linalg.eigh(0.5 * (compliance + compliance.T))
        bends = _bends(given)
        given, vectors = given[bends], vectors[:, bends]
        order = (1.0 / given).argsort()
        self.values, vectors = 1.0 / given[order], vectors[:, order]
        self.modes = inverse[:, :free] @ vectors * self.values
        self.step = inverse @ forces
        self.newton = vectors.T @ self.step[:free]

    def moved(self, steps: FloatArray) -> FloatArray:
        """Return the unknowns after steps (m,) along the modes; what is not in equilibrium else is put right."""
        change = self.step + self.modes @ (steps - self.newton)
        return self.solver.shifted(self.y, self.drive, change)

    def down(self) -> FloatArray:
        """Return the steps that lead down: Newton's, but away from where the energy is highest along a mode."""
        steps: FloatArray = np.sign(self.values) * self.newton
        return steps

    def aside(self, chosen: NDArray[Any]) -> FloatArray:
        """Return steps (m,) of chosen modes, by their numbers, to one side whatever vectors span them.

        The unknown that they can change most is changed, then the one that the rest of them can change most, and so
        on: of modes of different beams each takes part. These are unknowns that every mesh has: those of nodes if they
        move, else last forces. In a symmetric network several change most: the first decides, not rounding.
        """
        solver, modes, count = self.solver, self.modes[:, chosen], len(chosen)
        poses = modes[: solver.plain_free]
        forces = modes[solver.n_free :].reshape(-1, 3, count)[solver.lasts].reshape(-1, count)
        steps, left = np.zeros(len(self.values)), np.eye(count)
        for _ in range(count):
            moves = np.linalg.norm(poses @ left, axis=1).max(initial=0.0) > _MOVED
            part = (poses if moves else forces) @ left
            sizes = np.linalg.norm(part, axis=1)
            row = part[np.flatnonzero(sizes >= 0.99 * sizes.max())[0]]
            row = row / np.linalg.norm(row)
            steps[chosen] -= row  # by choice: either sign would do, as long as it stays
            left -= np.outer(left @ row, row)
        return steps

    def null(self, chosen: NDArray[Any]) -> FloatArray:
        """Return the null vector (n,) of a singular point: chosen modes, all to one side."""
        null = self.modes @ self.aside(chosen)
        return np.asarray(null / np.linalg.norm(null))


def eigenvalues(solver: ExpandedSolver, y: FloatArray, drive: float) -> FloatArray:
    """Return only the `values` of the curvature: quicker."""
    compliance = -_inverse(solver.tangent_at(y, drive)[0])[: solver.n_free, : solver.n_free]
    given = np.asarray(np.linalg.eigvalsh(0.5 * (compliance + compliance.T)))
    return np.sort(1.0 / given[_bends(given)])


def _bends(compliances: FloatArray) -> NDArray[np.bool_]:
    """Tell which directions are not rigid."""
    size = np.abs(compliances)
    return np.asarray(size > _RIGID * size.max(initial=0.0))


def _inverse(matrix: FloatArray) -> FloatArray:
    """Return the inverse of a matrix, or of one near it where it is singular to the last bit."""
    try:
        inverse = np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        inverse = np.linalg.inv(matrix + _ROUNDING * float(np.abs(matrix).max()) * np.eye(len(matrix)))
    return np.asarray(inverse)
