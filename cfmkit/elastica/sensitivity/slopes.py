"""Derivatives of what was solved for, by design variables: what the derivatives of all outputs come from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import InputError

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.kernels.model import DesignSlopes
    from cfmkit.elastica.outcome.path import Path
    from cfmkit.elastica.sensitivity.complex_steps import ComplexSteps


@dataclass(frozen=True, eq=False)
class Slopes:
    """Derivatives of the unknowns and the forces at p chosen points of a path by k design variables.

    Attributes
    ----------
    path : Path
        What was differentiated.
    points : (p,) int array
        Indices of the points.
    complex_steps, design : ComplexSteps, DesignSlopes
        How the network and its arrays change.
    """

    path: Path
    points: Any
    complex_steps: ComplexSteps
    design: DesignSlopes

    @property
    def unknowns(self) -> FloatArray:
        """Derivatives of everything that was solved for, (p, unknowns, k), dimensionless."""
        return self._all[0]

    @cached_property
    def push(self) -> FloatArray:
        """Derivatives of the force on what the drive moves, (p, k), dimensionless, where no force turns with its node.

        They are ready with the unknowns; without them they take less time.
        """
        return self._all[1] if "_all" in vars(self) else self._slopes(0)[1]

    @cached_property
    def _all(self) -> tuple[FloatArray, FloatArray]:
        return self._slopes(self.path.solver.size)

    def _slopes(self, size: int) -> tuple[FloatArray, FloatArray]:
        """Return derivatives of the unknowns, (p, size, k), none if the size is zero, and of the force, (p, k)."""
        from cfmkit.elastica.kernels import compiled

        s, count = self.path.solver, len(self.complex_steps)
        unknowns = np.empty((len(self.points) if size else 0, size, count))
        push = np.empty((len(self.points), count))
        ys, drives = self.path.points.y[self.points], self.path.points.drive[self.points]
        if not compiled.slopes(s.model, self.design, s.n_free, ys, drives, (unknowns, push), s.scratch):
            raise InputError("the tangent is singular at a point of the path: no derivative there")
        return unknowns, push

    @cached_property
    def held(self) -> FloatArray:
        """Derivatives of the forces on all degrees of freedom and of the springs' energy, (p, dofs + 1, k)."""
        from cfmkit.elastica.kernels import compiled

        s = self.path.solver
        out = np.empty((len(self.points), s.n_dofs + 1, len(self.complex_steps)))
        ys, drives = self.path.points.y[self.points], self.path.points.drive[self.points]
        compiled.held_slopes(s.model, self.design, s.n_free, ys, drives, self.unknowns, out)
        return out

    @cached_property
    def rows(self) -> FloatArray:
        """Derivatives of the sampled states, (p, rows, 7, k): x, y, turn, moment, h, v, energy; dimensionless."""
        from cfmkit.elastica.kernels import compiled

        sampler, solver = self.path.sampler, self.path.solver
        design = self.complex_steps.arrays(sampler.model, sampler.cut, every=True)
        out = np.empty((len(self.points), sampler.states.shape[1], 7 * len(self.complex_steps)))
        ys, drives = self.path.points.y[self.points], self.path.points.drive[self.points]
        compiled.row_slopes(sampler.model, design, solver.n_free, ys, drives, self.unknowns, out)
        return out.reshape(*out.shape[:2], 7, -1)[:, :, [2, 3, 0, 1, 5, 6, 4]]
