"""A network as a problem of path following, along its drive or a share of constant loads: solutions, marches, modes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.compiled import CompiledEquations
from cfmkit.elastica.mechanics.equations import N_POWERS, MarchCode, MarchPlan, NaturalMarch
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.mechanics.polynomials import shape_functions
from cfmkit.numerics.continuation.problem import PathEquilibrium

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.discretise import Discretisation, FlankPlace
    from cfmkit.elastica.mechanics.equations import LinearEquations, NumpyEquations
    from cfmkit.numerics.continuation.path import MarchedSteps, Walk
    from cfmkit.numerics.continuation.problem import Border

SAME_SIZE = 0.99  # share of the largest part of a mode from which on an earlier part is taken as the largest
N_SPARE_STATES = 50  # states of a march besides two for each requested value, until it is looked at again
ROOM_IN_CONTACT, ROOM_IN_NUMPY = 40, 8
"""States of a march with closed contacts, behind which it is seen whether one begins or ends; fewer where they cost."""
DEGREES_MORE = 4  # with which the error of a path is estimated
FIRST_POWERS, STIFF_SHARE = 8, 1e-2
"""Powers by which the softest mode is estimated first, and its flexibility as a share of a critical one's."""
MODE_MIX_SHARE = 0.1  # of any vector, that is added to a mode which may have no share of the one looked for
NO_MOTION = 1e-3  # share of a mode's largest part below which the nodes do not move


@dataclass(frozen=True, eq=False)
class NetworkProblem:
    """Equilibria of a network: its free unknowns over the drive.

    With `ramp` the drive rests, and what is followed is the share of everything constant: loads, displaced supports,
    free lengths of springs, the gap of beams that are forced into place.
    """

    mesh: Discretisation
    ramp: bool = False
    next_correction: float = 1e-10
    """Size of the next of Newton's corrections, as the square of the last, at which a march accepts an equilibrium."""
    remesh: Callable[[tuple[FlankPlace, ...]], Discretisation] | None = None
    """Returns the same arrays with other places at which sides of beams touch; None if none may."""

    @cached_property
    def motions(self) -> Any:
        """Which free unknowns are motions."""
        return self.mesh.free < self.mesh.n_motions

    @cached_property
    def equations(self) -> NumpyEquations:
        """Residual, tangent and Newton's method, compiled where they can be."""
        return equations(self.mesh, self.ramp)

    @cached_property
    def unit(self) -> FloatArray:
        """Sizes of the free unknowns: 1 for motions, EI/L^2 of its element for a section force."""
        return np.where(self.motions, 1.0, self.equations.unit)

    def values(self, x: FloatArray, drive: float) -> FloatArray:
        """Return all unknowns, held ones included."""
        return np.asarray(self.equations.values(x, drive))

    def linearise(self, x: FloatArray, drive: float) -> Tangent:
        """Return residual, tangent and the residual's change with the drive."""
        return Tangent(self.equations, self.equations.linearise(x, drive))

    def solve(self, x: FloatArray, drive: float, border: Border | None = None) -> PathEquilibrium | None:
        """Return the equilibrium near a guess: Newton's method of the protocol, in compiled code."""
        return self.equations.solve(x, drive, border)

    def solve_each(self, guesses: Sequence[FloatArray], drives: Sequence[float]) -> list[PathEquilibrium | None]:
        """Return the equilibria near guesses at their drives, in compiled code."""
        solved = self.equations.solve_each(np.array(guesses), np.array(drives))
        columns = zip(solved.free, drives, solved.rate, solved.unstable.tolist(), solved.effort.tolist(), strict=True)
        return [
            PathEquilibrium(*values) if well else None for values, well in zip(columns, solved.converged, strict=True)
        ]

    def march_whole(self, walk: Walk, stiffnesses: tuple[float, float]) -> MarchedSteps | None:
        """Return the steps to the last requested value, None if something may happen: then `march` begins with them.

        Nothing happens if all is stable, and no eigenvalue at either end as small as a stiffness by far.
        """
        system = self.equations
        if not isinstance(system, CompiledEquations) or system.follows or self.mesh.fits.network.contacts:
            return None
        march = self._run_march(walk, whole=True)
        ends = zip(march.flexibilities, stiffnesses, strict=True)
        if march.code is MarchCode.DONE and all(0 < abs(soft) * stiffness < STIFF_SHARE for soft, stiffness in ends):
            return march
        vars(self)["_begun"] = walk.current, march
        return None

    def march(self, walk: Walk) -> MarchedSteps:
        """Return the equilibria on the way to the next requested values, as far as nothing happens."""
        begun: tuple[PathEquilibrium | None, Any] = vars(self).pop("_begun", (None, None))
        taken: NaturalMarch | None = begun[1] if begun[0] is walk.current and walk.before is None else None
        return taken or self._run_march(walk)

    def _run_march(self, walk: Walk, whole: bool = False) -> NaturalMarch:
        """Return the steps from where a walk is; of a `whole` one with its softest modes and its error, too."""
        left = walk.targets[walk.number :]
        room = 2 * len(left) + N_SPARE_STATES
        if self.mesh.contacts:
            room = ROOM_IN_CONTACT if isinstance(self.equations, CompiledEquations) else ROOM_IN_NUMPY
        plan = MarchPlan(
            walk.step, walk.options.span, walk.before, walk.options.largest_motion, self.next_correction,
            branch=walk.branch, room=room, any_vector=self._any_vector if whole else None,
            finer_degree=self.mesh.degree + DEGREES_MORE if whole and not (self.ramp or walk.number) else 0,
        )  # fmt: skip
        marched = self.equations.march(walk.current, left, plan)
        marched.target[marched.target >= 0] += walk.number
        return marched

    # -- modes -----------------------------------------------------------------------------------------------------
    def modes(self, at: PathEquilibrium, count: int) -> tuple[FloatArray, FloatArray]:
        """Return the eigenvalues of the motions' stiffness nearest to zero, and the modes with their section forces.

        Directions that constraints or stiff beams hold are none: their flexibility is rounding.
        """
        tangent, moves = self.linearise(at.x, at.drive).tangent, np.flatnonzero(self.motions)
        unit = np.zeros((len(tangent), len(moves)))
        unit[moves, np.arange(len(moves))] = 1.0
        try:
            flexibility = np.linalg.solve(tangent, unit)
        except np.linalg.LinAlgError:
            shift = energy.SINGULAR_SHIFT * np.diag(self.motions.astype(float))
            flexibility = np.linalg.solve(tangent + shift, unit)
        inner = flexibility[moves]
        if self.equations.follows:
            inverse, vectors = np.linalg.eig(inner)
            real = np.abs(inverse.imag) <= energy.REAL_SHARE * np.abs(inverse)
            inverse, vectors = inverse[real].real, vectors[:, real].real
        else:
            inverse, vectors = np.linalg.eigh(0.5 * (inner + inner.T))
        inverse = np.where(inverse == 0, np.finfo(float).tiny, inverse)
        flexible = int((np.abs(inverse) > energy.FLEXIBLE_SHARE * np.abs(inverse).max()).sum())
        order = np.argsort(-np.abs(inverse))[: min(count, flexible)]
        return 1 / inverse[order], flexibility @ vectors[:, order] / inverse[order]

    def is_stiff(self, at: PathEquilibrium, stiffness: float) -> bool:
        """Return True if no eigenvalue is as small as a stiffness by far: two powers of the flexibility say so."""
        flexibility, _ = self.equations.find_softest(at.x, at.drive, self._any_vector, N_POWERS)
        return 0 < abs(flexibility) * stiffness < STIFF_SHARE

    def softest(self, at: PathEquilibrium, nearby_mode: FloatArray | None = None) -> tuple[float, FloatArray | None]:
        """Return the size of the smallest eigenvalue and its mode, better where another is known that is near."""
        if self.equations.follows:
            return abs(float(self.modes(at, 1)[0][0])), None
        vector = self._any_vector if nearby_mode is None else nearby_mode + MODE_MIX_SHARE * self._any_vector
        rounds = FIRST_POWERS if nearby_mode is None else N_POWERS
        flexibility, mode = self.equations.find_softest(at.x, at.drive, vector, rounds)
        return (1 / abs(flexibility) if flexibility else 0.0), mode

    @property
    def _any_vector(self) -> FloatArray:
        """Unit vector that has a share of every mode."""
        return _any_vector(len(self.mesh.free))

    def orient(self, modes: FloatArray) -> FloatArray:
        """Return one combination of modes, its largest motion one, on the side that `Control.sign` 1 names.

        The motion of a node that changes most goes to the negative side; modes that move no node are told by the
        moments at the beams' ends. With several modes that is repeated on the rest, whatever spans them.
        """
        nodes = modes[self._node_rows]
        size = np.abs(modes[self.motions]).max()
        rest, amounts = np.eye(modes.shape[1]), np.zeros(modes.shape[1])
        for _ in range(modes.shape[1]):
            parts = nodes @ rest
            if not np.abs(parts).max(initial=0.0) > NO_MOTION * size:
                parts = self._end_moments(modes) @ rest
            sizes = np.linalg.norm(parts, axis=1)
            if not sizes.max(initial=0.0) > 0:
                break
            row = parts[np.flatnonzero(sizes >= SAME_SIZE * sizes.max())[0]]
            row = row / np.linalg.norm(row)
            amounts -= row
            rest -= np.outer(rest @ row, row)
        mode = modes @ amounts
        return np.asarray(mode / np.abs(mode[self.motions]).max())

    @cached_property
    def _node_rows(self) -> Any:
        """Which free unknowns move nodes."""
        return np.flatnonzero(self.mesh.free < 3 * len(self.mesh.bodies))  # they come first

    def _end_moments(self, modes: FloatArray) -> FloatArray:
        """Return the moments at the ends of the beams in modes, (beams, k)."""
        z = np.zeros((self.mesh.size, modes.shape[1]))
        z[self.mesh.free] = modes
        e = self.mesh.elements
        last = np.array([number for number, (_, right) in enumerate(e.cuts) if right == 1.0])
        unknowns = e.unknowns[last][:, energy.rotation_columns(self.mesh.degree)]
        return np.asarray(np.einsum("e,c,eck->ek", e.rigidity[last, -1], _end_slopes(self.mesh.degree), z[unknowns]))


@lru_cache(maxsize=64)
def _end_slopes(degree: int) -> FloatArray:
    """Return the slopes of the shape functions at the end of an element, (degree + 1,)."""
    return read_only(shape_functions(degree, np.ones(1))[1][0])


@lru_cache(maxsize=64)
def _any_vector(count: int) -> FloatArray:
    """Return a unit vector (count,) that has a share of every mode."""
    vector = np.cos(np.arange(count) * np.arange(1, count + 1))
    return read_only(vector / np.linalg.norm(vector))


class Tangent:
    """Residual and tangent of a network at one place."""

    def __init__(self, equations: NumpyEquations, at: LinearEquations) -> None:
        self.equations, self.at = equations, at
        # forces out of balance, their change with the drive (n,), their derivatives (n, n)
        self.residual, self.rate, self.tangent = at.residual, at.change, at.tangent

    @property
    def unstable(self) -> int:
        """Number of unstable directions at a held drive."""
        return self.equations.count_unstable(self.at)

    def solve(self, right: FloatArray) -> FloatArray | None:
        """Return the tangent's inverse times columns."""
        try:
            return np.asarray(np.linalg.solve(self.tangent, right))
        except np.linalg.LinAlgError:
            return None
