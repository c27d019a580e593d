"""Natural frequencies about equilibria of the functional, with the drive held and with it free, and flutter.

To what the functional has, each element gets positions and section forces that vary along it: with bubbles b_k of the
positions and Legendre polynomials P_j of the force beside its mean,

    X(u) = (1 - u) X0 + u X1 + sum b_k N_k(u),    n(u) = n + sum a_j P_j(2u - 1),    int n . X' du = n . (X1 - X0)
    + sum a_j . b_(j+1) / sqrt(j + 1/2):

in equilibrium, without inertia, they stay what they are. Positions and rotations have mass, forces none. With
M = R R^T the frequencies are 1 / (omega^2 + s) = eig(R^T (K + s M)^-1 R) for any s: forces drop out, an inextensible
beam needs no rule, and with s > 0 nor does what moves freely.

Assumes: small motions, no damping, what is held does not move.

References
----------
[Me] L. Meirovitch, Principles and Techniques of Vibrations (1997): the eigenvalue problem.
[Re] E. Reissner, J. Math. Phys. 29 (1950) 90: the mixed functional.
[Be] M. Beck, Z. angew. Math. Phys. 3 (1952) 225: the column under a force that turns with its end.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial import legendre

from cfmkit.arrays import ShortRepr, read_only
from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.discretise import Discretisation, raise_degree, refine_state
from cfmkit.elastica.mechanics.polynomials import basis, shape_functions
from cfmkit.elastica.mechanics.poses import poses
from cfmkit.elastica.model.drive import Loading
from cfmkit.errors import InputError
from cfmkit.numerics.one_blas_thread import one_blas_thread

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.results.path import EquilibriumPath

DEGREE_OF_FIRST, DEGREE_PER_MODE = 9, 1.5
"""Degree of rotations for the first mode of a beam, and for each more: six modes of a cantilever to 1e-9."""
DEGREES_BESIDE_STATICS = 3  # more than what the bent shape needs: modes multiply it
LONG_CHAIN, ORDER_IN_CHAIN = 8, 6
"""Elements a beam from which on it is a chain, and the order of forces in one: coils of many turns."""
MAX_DEGREE = 36
MAX_UNKNOWNS = 4000  # dense matrices of this size take 130 MB each
ZERO_FREQUENCY_RTOL = 1e-9  # share of the shift within which the square of a frequency is zero
INSTABILITY_RTOL = (
    1e-7  # the same for a negative square: the end of a branch is located to 1e-8, and has a frequency of zero
)
FLEXIBILITY_RTOL = 1e-10  # share of the largest flexibility below which a negative one is none
COMPLEX_SHARE = 1e-5  # imaginary part of a square of a frequency from which on two have met, of its size
N_RESOLVED = 3  # so many times the modes wanted are examined for flutter


@dataclass(frozen=True)
class NetworkMasses:
    """Masses of a network, by names."""

    density: Mapping[str, float]  # of every beam [kg/m^3]
    # mass [kg] and moment of inertia [kg m^2] of what is fixed to nodes
    nodes: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, value in self.density.items():
            if not (value > 0 and isfinite(value)):
                raise InputError(f"the density of beam {name!r} must be positive, got {value}")
        for name, values in self.nodes.items():
            if not all(value >= 0 and isfinite(value) for value in values):
                raise InputError(f"mass and inertia of node {name!r} must not be negative, got {values}")
        object.__setattr__(self, "density", MappingProxyType(dict(self.density)))
        object.__setattr__(self, "nodes", MappingProxyType(dict(self.nodes)))


@dataclass(frozen=True, repr=False)
class Frequencies(ShortRepr):
    """Natural frequencies of a network about some equilibria."""

    points: Any  # (p,) indices of the points of the path
    # held, free, (p, n): the lowest ones with the drive held, and with it free, ascending [Hz]. Zero where a motion has
    # no stiffness; nan where the pose is unstable, and where a network has fewer
    held: FloatArray
    free: FloatArray
    # flutters, diverges, (p,): whether loads that turn with their node make motions grow that swing, or that do not:
    # two squares of frequencies are complex, or one is negative. As the drive has it: held if it is a motion, free if
    # it is a load. Other networks do not flutter, and whether they diverge is reported by the path
    flutters: Any
    diverges: Any


@one_blas_thread
def frequencies(
    path: EquilibriumPath,  # the equilibria
    masses: NetworkMasses,  # density of every beam, masses of nodes. Sections rotate with inertia where they shear, too
    count: int,  # how many frequencies, at least 1
    points: Any = None,  # (p,) int: indices of the points of the path; all unless given
    # (str, float or None): of a drive by loads: which node stands still while the drive is held, along which direction
    # [rad]; None: it does not rotate. Without it, held and free are the same
    hold: tuple[str, float | None] | None = None,
) -> Frequencies:
    """Return the lowest `count` natural frequencies of a network about equilibria of its path.

    Raises InputError if a beam has no density, a mass is at no node, the count is not positive, the unknowns are too
    many, or there are contacts.
    """
    _check_arguments(path, masses, count)
    chosen = np.arange(len(path)) if points is None else np.asarray(points, dtype=np.int64)
    fine = raise_degree(path.mesh, _degree_of_rotations(path.mesh, count))
    system = _VibratingNetwork(path, fine, masses)
    by_load = isinstance(path.load_case, Loading)
    held, free = (np.full((len(chosen), count), np.nan) for _ in range(2))
    grows = np.zeros((2, len(chosen)), dtype=bool)
    unit = np.sqrt(fine.scales.force / fine.scales.length) / (2 * np.pi)
    for k, point in enumerate(chosen.tolist()):
        z = refine_state(path.mesh, fine, path.at.z[point])
        matrices = system.assemble_matrices(z, float(path.at.drive[point]))
        row = system.row_of(z, *hold) if hold is not None and by_load else None
        (squares, *still), (others, *loose) = (
            _lowest_squares(*_choose_unknowns(fine, matrices, is_held, row), count) for is_held in (True, False)
        )
        held[k], free[k] = unit * np.sqrt(squares), unit * np.sqrt(others)
        grows[:, k] = loose if by_load else still
    flutters, diverges = (read_only(row, np.bool_) for row in grows)
    return Frequencies(read_only(chosen, np.int64), read_only(held), read_only(free), flutters, diverges)


def _check_arguments(path: EquilibriumPath, masses: NetworkMasses, count: int) -> None:
    if count < 1:
        raise InputError(f"at least one frequency must be requested, got {count}")
    if path.network.contacts:
        raise InputError("natural frequencies are not known of networks with contacts")
    if missing := [name for name in path.network.beams if name not in masses.density]:
        raise InputError(f"no density is given for the beams {', '.join(missing)}")
    for name in masses.nodes:
        if name not in path.network.nodes:
            raise InputError(f"a mass is given for {name!r}, which is not a node")
    elements, degree = len(path.mesh.elements.length), _degree_of_rotations(path.mesh, count)
    size = path.mesh.size + elements * (degree - path.mesh.degree + 4 * _degree_of_inner_forces(path.mesh, degree))
    if size > MAX_UNKNOWNS:
        raise InputError(
            f"natural frequencies need {size} unknowns, more than {MAX_UNKNOWNS}: the beams have too many windings "
            "or too much tension"
        )


def _degree_of_rotations(mesh: Discretisation, count: int) -> int:
    """Return the degree of the rotations: modes of a beam are spread over its elements."""
    wanted = DEGREE_OF_FIRST + int(DEGREE_PER_MODE * count / _elements_a_beam(mesh))
    return max(mesh.degree, min(MAX_DEGREE, max(wanted, mesh.degree + DEGREES_BESIDE_STATICS)))


def _degree_of_inner_forces(mesh: Discretisation, degree: int) -> int:
    """Return the degree of inner forces: one below that of rotations, in long chains at most `ORDER_IN_CHAIN`."""
    return degree - 1 if _elements_a_beam(mesh) < LONG_CHAIN else min(degree - 1, ORDER_IN_CHAIN)


def _elements_a_beam(mesh: Discretisation) -> float:
    return len(mesh.elements.beam) / len(set(mesh.elements.beam))


@dataclass(frozen=True)
class _Matrices:
    """Stiffness and the root of the mass, M = R R^T, of all unknowns: elements' insides behind the others; kg."""

    stiffness: FloatArray  # (n, n)
    root: FloatArray  # (n, m) what the unknowns move a point by, times the root of its mass


class _VibratingNetwork:
    """Stiffness and mass about one pose after another."""

    def __init__(self, path: EquilibriumPath, fine: Discretisation, masses: NetworkMasses) -> None:
        self.network, self.fine, self.masses = path.network, fine, masses
        self.order = _degree_of_inner_forces(fine, fine.degree)
        rule = basis(fine.degree)
        self.rule = rule
        self.bubbles = shape_functions(self.order + 1, rule.places)[0][:, 2:]
        self.forces = legendre.legvander(2 * rule.places - 1, self.order)[:, 1:]
        elements, inner_count = len(fine.elements.length), 4 * self.order
        self.size = fine.size + elements * inner_count
        inner = fine.size + np.arange(elements * inner_count).reshape(elements, 2, 2, self.order)
        self.positions, self.varying = inner[:, 0], inner[:, 1]  # (e, axis, order) unknowns: bubbles; forces

    def assemble_matrices(self, z: FloatArray, drive: float) -> _Matrices:
        """Return the matrices about a pose."""
        stiffness = np.zeros((self.size, self.size))
        stiffness[: self.fine.size, : self.fine.size] = energy.hessian(self.fine, z, drive)
        self._add_inner_forces(stiffness, z, drive)
        columns = [self._root_columns(*mass) for mass in self._iterate_masses(z)]
        for name, (weight, inertia) in self.masses.nodes.items():
            moves, unknowns = self._node_motion(z, name)
            size = np.array([weight, weight, inertia / self.fine.scales.length**2])
            columns.append(self._root_columns(unknowns, moves, size))
        return _Matrices(stiffness, np.hstack(columns))

    def _root_columns(self, unknowns: Any, moves: FloatArray, masses: FloatArray) -> FloatArray:
        """Return columns of the root, (size, m), of points that some unknowns move by moves (m, unknowns)."""
        column = np.zeros((self.size, len(moves)))
        np.add.at(column, unknowns, moves.T * np.sqrt(masses))
        return column

    def _add_inner_forces(self, stiffness: FloatArray, z: FloatArray, drive: float) -> None:
        """Add what forces that vary along elements do, and what positions inside do to them."""
        e, at = self.fine.elements, energy.compute_fields(self.fine, z, drive)
        softer, order = e.axial - e.shear, self.order
        f, g = 1 + softer * at.normal, softer * at.shear
        by_force = (g * at.cos - f * at.sin, g * at.sin + f * at.cos)
        rotations = e.unknowns[:, energy.rotation_columns(self.fine.degree)]
        soft = (
            (e.axial * at.cos**2 + e.shear * at.sin**2, softer * at.cos * at.sin),
            (softer * at.cos * at.sin, e.axial * at.sin**2 + e.shear * at.cos**2),
        )
        couple = 1 / np.sqrt(np.arange(order) + 1.5)
        for k in range(len(e.length)):
            for axis in (0, 1):
                rows, weight = self.varying[k, axis], e.weight[k]
                turning = -(self.forces.T * (weight * by_force[axis][k])) @ self.rule.values
                np.add.at(stiffness, (rows[:, None], rotations[k]), turning)
                np.add.at(stiffness, (rotations[k][:, None], rows), turning.T)
                inside = self.positions[k, axis]
                stiffness[rows, inside] = stiffness[inside, rows] = couple
                for column_axis in (0, 1):
                    mean, share = e.unknowns[k, column_axis - 2], weight * soft[axis][column_axis][k]
                    stiffness[rows, mean] = stiffness[mean, rows] = -(self.forces.T @ share)
                    stiffness[np.ix_(rows, self.varying[k, column_axis])] = -(self.forces.T * share) @ self.forces

    def _iterate_masses(self, z: FloatArray) -> Iterator[tuple[Any, FloatArray, FloatArray]]:
        """Yield unknowns, what they move the points of beams by, and masses; and the same of sections' rotations."""
        fine, e, u = self.fine, self.fine.elements, self.rule.places
        ends = [poses(fine.attachments, z, e.ends[:, side]).jacobian for side in (0, 1)]
        rotations = e.unknowns[:, energy.rotation_columns(fine.degree)]
        for k, name in enumerate(e.beam):
            section, fitted = self.network.beams[name].section, fine.fits[name]
            left, right = e.cuts[k]
            inside = float(np.real(fitted.arc(0.5 * (left + right))))
            thickness = section.thickness_at(fitted.arc(left + (right - left) * u), inside) + 0.0 * u
            density = self.masses.density[name] * section.width * thickness * e.weight[k] * fine.scales.length
            for axis in (0, 1):
                moves = np.hstack([np.outer(1 - u, ends[0][k, axis]), np.outer(u, ends[1][k, axis]), self.bubbles])
                unknowns = np.concatenate([e.unknowns[k, [0, 1, 2, 4, 5, 6]], self.positions[k, axis]])
                yield unknowns, moves, density
            if section.shear:  # slenderness at which inertia of sections counts is that at which shear does
                yield rotations[k], self.rule.values, density * (thickness / fine.scales.length) ** 2 / 12

    def _node_motion(self, z: FloatArray, name: str) -> tuple[FloatArray, Any]:
        """Return the motion of a node (3, 4) by its unknowns, and their numbers."""
        pose = poses(self.fine.attachments, z, [self.fine.nodes[name]])
        moves = np.zeros((3, 4))
        moves[:2, :3], moves[2, 3] = pose.jacobian[0], 1.0
        return moves, pose.unknowns[0]

    def row_of(self, z: FloatArray, name: str, direction: float | None) -> FloatArray:
        """Return the row (size,) that gives a node's motion along a direction, or its rotation, from all unknowns."""
        moves, unknowns = self._node_motion(z, name)
        row = moves[2] if direction is None else np.cos(direction) * moves[0] + np.sin(direction) * moves[1]
        combination = np.zeros(self.size)
        np.add.at(combination, unknowns, row)
        return combination


def _choose_unknowns(
    fine: Discretisation, matrices: _Matrices, is_held: bool, row: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    """Return the matrices of the unknowns that move while the drive is held, or free; a row that is held as a force."""
    driven = np.empty(0, int) if is_held else np.flatnonzero(fine.rate)
    moving = np.concatenate([fine.free, driven, np.arange(fine.size, len(matrices.root))])
    stiffness, root = matrices.stiffness[np.ix_(moving, moving)], matrices.root[moving]
    if row is None or not is_held:
        return stiffness, root
    tied = np.append(row[moving], 0.0)
    stiffness, root = np.pad(stiffness, (0, 1)), np.pad(root, ((0, 1), (0, 0)))
    stiffness[-1], stiffness[:, -1] = tied, tied
    return stiffness, root


def _lowest_squares(stiffness: FloatArray, root: FloatArray, count: int) -> tuple[FloatArray, bool, bool]:
    """Return the lowest squares of frequencies, nan where it is unstable; whether it flutters, and diverges."""
    lowest_squares = np.full(count, np.nan)
    shift = len(root) / max(float((root**2).sum()), np.finfo(float).tiny)  # EI / (mass length^3) or so
    symmetric = np.abs(stiffness - stiffness.T).max() <= np.finfo(float).eps * np.abs(stiffness).max()
    try:
        flexible = root.T @ np.linalg.solve(stiffness + shift * root @ root.T, root)
    except np.linalg.LinAlgError:
        return lowest_squares, False, not symmetric
    if symmetric:
        inverse = np.linalg.eigvalsh(0.5 * (flexible + flexible.T))
        largest = float(np.abs(inverse).max(initial=0.0))
        lowest = inverse[inverse > np.finfo(float).eps * largest][::-1][:count]
        squares = 1 / lowest - shift
        if inverse[0] < -FLEXIBILITY_RTOL * largest or (squares < -INSTABILITY_RTOL * shift).any():
            return lowest_squares, False, False
        lowest_squares[: len(squares)] = np.where(squares < ZERO_FREQUENCY_RTOL * shift, 0.0, squares)
        return lowest_squares, False, False
    return _lowest_squares_when_turning(np.linalg.eigvals(flexible), shift, count)


def _lowest_squares_when_turning(inverse: Any, shift: float, count: int) -> tuple[FloatArray, bool, bool]:
    """Return squares of frequencies, flutter and divergence under loads that turn with their node."""
    lowest_squares = np.full(count, np.nan)
    lowest = inverse[np.argsort(-np.abs(inverse))][: N_RESOLVED * (count + 1)]
    squares = 1.0 / lowest[np.abs(lowest) > np.finfo(float).eps * np.abs(lowest[0])] - shift
    complex_ones = np.abs(squares.imag) > COMPLEX_SHARE * np.abs(squares)
    swings, falls = bool(complex_ones.any()), bool((squares.real[~complex_ones] <= 0.0).any())
    if not (swings or falls):
        real = np.sort(squares.real)[:count]
        lowest_squares[: len(real)] = real
    return lowest_squares, swings, falls
