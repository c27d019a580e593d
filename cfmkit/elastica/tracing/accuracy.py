"""Accuracy of a path: its error against a higher degree, Newton's method repeated, taut beams that need more pieces."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.mechanics.design_derivatives import Equilibria
from cfmkit.elastica.mechanics.discretise import Discretisation, raise_degree, refine_state
from cfmkit.elastica.mechanics.elements import TAUT_RATIO
from cfmkit.elastica.mechanics.equations import ComparedStates
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.mechanics.problem import DEGREES_MORE, NetworkProblem
from cfmkit.elastica.model.drive import Loading
from cfmkit.elastica.results.path import Path, PathStatus, largest_force, load_displacement, work_with_drive

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cfmkit.arrays import FloatArray


MAX_POINTS = 6  # at which the degree is raised
BESIDE_EVENT = 5e-3  # share of the range around an event within which everything is a root
ERROR_SAFETY = 2.0  # of a change: where forms converge slowly, four degrees more still miss as much again
CORRECTION_ERROR = 300.0  # error of a stiff network's effort that a march leaves, over its next correction
ROUNDING_ERROR = 1e-13
MACHINE_EPSILON = float(np.finfo(float).eps)
ROUNDED_PLACES = 4.0  # roundings of a place by which a nearly rigid network's effort is uncertain
CRITICAL_STIFFNESS = 1e-6  # stiffness of a mode, EI / L, below which rounding decides whether it is stable
NEXT_CORRECTION = 1e-10  # square of a correction on the finer mesh from which on it is the last
SAME_POINT = 1e-3  # motion by which a point may be improved
MAX_CHANGE = 0.3  # of a motion: beyond it is another equilibrium
NO_FORCE = 1e-6  # largest force, EI/L^2, over the largest motion, that is none; effort, over both
SMALL_MOTION = 1e-3  # largest motion up to which errors of motions are relative to this


def point_errors(path: Path, indices: Sequence[int]) -> FloatArray:
    """Return the estimated errors of efforts, reactions and motions of nodes at points, relative to the largest ones.

    By the network with a degree that is `DEGREES_MORE` higher. Infinite where it has no equilibrium nearby, or one of
    another stability.
    """
    if not len(path) or not len(indices):
        return np.zeros(len(indices))
    chosen, equilibria, mesh = list(indices), path.at, path.mesh
    z, drives, degree = equilibria.z[chosen], equilibria.drive[chosen], mesh.degree + DEGREES_MORE
    compared, effort_unit = equations(mesh).compare(z, drives, degree, NEXT_CORRECTION), 1.0
    if compared is None:
        compared = compare_states(path, z, drives)
    elif isinstance(path.load_case, Loading):
        compared = compared._replace(effort=load_displacement(Equilibria(mesh, compared.ends, drives), path.load_case))
    else:
        effort_unit = mesh.scales.moment / mesh.scales.drive
    comparable = compared.converged & (compared.moved <= MAX_CHANGE)
    for row in np.flatnonzero(comparable & (compared.unstable != path.unstable[chosen])):
        alike = compared.is_as_stable(path.unstable[chosen])[row]
        comparable[row] = alike or _is_critical(mesh, z[row], float(drives[row]))
    efforts = np.abs(effort_unit * compared.effort - path.effort[chosen])
    reach = float(np.abs(equilibria.z[:, : mesh.numbering.n_ends]).max())
    largest = float(compared.largest.max(initial=0.0))
    if max(reach, largest) <= ROUNDING_ERROR:  # nothing moves and nothing bears: no share of rounding is an error
        return np.where(comparable, ROUNDING_ERROR, np.inf)
    load = max(largest, NO_FORCE * reach, ROUNDING_ERROR)
    size = max(float(np.abs(path.effort).max()), NO_FORCE * max(load, reach) * mesh.scales.moment / mesh.scales.drive)
    roundings = ROUNDED_PLACES * _measure_roundings(path)[chosen]
    bearing = np.maximum(efforts / size, compared.force / load) - roundings / size
    relative = np.maximum(bearing, compared.motion / max(reach, SMALL_MOTION))
    return np.where(comparable, ERROR_SAFETY * relative + ROUNDING_ERROR, np.inf)


def compare_states(path: Path, z: FloatArray, drives: FloatArray) -> ComparedStates:
    """Return how states (p, size) of any network differ from those of a higher degree, efforts with their units."""
    mesh = path.mesh
    finer = raise_degree(mesh, mesh.degree + DEGREES_MORE)
    n_bodies, states = mesh.numbering.n_ends, refine_state(mesh, finer, z)
    guess = states[:, finer.free]
    solved = equations(finer).solve_each(guess, drives, NEXT_CORRECTION, quick=True)
    moved = np.abs(solved.free - guess)[:, finer.free < finer.n_motions].max(axis=1, initial=0.0)
    states[:, finer.free] = np.where(solved.converged[:, None], solved.free, guess)
    fine, ends = Equilibria(finer, states, drives), states[:, :n_bodies]
    change = np.abs(fine.residual[:, :n_bodies] - Equilibria(mesh, z, drives).residual[:, :n_bodies]).max(axis=1)
    effort, motion = work_with_drive(fine, path.load_case), np.abs(ends - z[:, :n_bodies]).max(axis=1)
    largest = np.array([largest_force(fine)])
    return ComparedStates(solved.converged, solved.unstable, moved, change, effort, largest, motion, ends)


def _is_critical(mesh: Discretisation, z: FloatArray, drive: float) -> bool:
    """Return True if rounding decides at a state whether the network is stable with a higher degree."""
    finer = raise_degree(mesh, mesh.degree + DEGREES_MORE)
    problem = NetworkProblem(finer)
    (at,) = problem.solve_each([refine_state(mesh, finer, z)[finer.free]], [drive])
    return at is not None and abs(float(problem.modes(at, 1)[0][0])) < CRITICAL_STIFFNESS


def _measure_roundings(path: Path) -> FloatArray:
    """Return by how much the effort changes at every point while the drive does by one rounding of a length of one."""
    drive, effort, slope = path.at.drive, path.effort, np.zeros(len(path) + 1)
    change = np.abs(drive[1:] - drive[:-1])
    np.divide(np.abs(effort[1:] - effort[:-1]), change, out=slope[1:-1], where=change > 0)
    return np.maximum(slope[1:], slope[:-1]) * MACHINE_EPSILON


def polish(path: Path) -> Path:
    """Return the path with Newton's method repeated at every point.

    A march leaves it when the next correction would be small if it converged quadratically: beside a bifurcation it
    does not.
    """
    mesh, z = path.mesh, path.at.z.copy()
    guess = z[:, mesh.free]
    solved = NetworkProblem(mesh).equations.solve_each(guess, path.at.drive)
    count = int((mesh.free < mesh.n_motions).sum())
    accepted = solved.converged & (
        np.abs(solved.free[:, :count] - guess[:, :count]).max(axis=1, initial=0.0) < SAME_POINT
    )
    z[:, mesh.free] = np.where(accepted[:, None], solved.free, guess)
    return replace(path, at=replace(path.at, z=z))


def pick_points(path: Path, places: Sequence[float]) -> list[int]:
    """Return the indices of the points at which the error of a path is estimated, none at events at these drives."""
    if not len(path):
        return []
    at = path.at_requested if len(path.at_requested) else np.arange(len(path))
    chosen = {int(at[np.abs(path.effort[at]).argmax()]), int(at[-1])}
    if len(at) <= MAX_POINTS:
        chosen.update(at.tolist())
    else:
        highest = path.at.z[at][:, path.mesh.elements.unknowns[:, -4:-2].ravel()]
        left = np.abs(highest).max(axis=1)  # what the last polynomials say: the next may be as large
        bounds = [len(at) * k // (MAX_POINTS - 2) for k in range(MAX_POINTS - 1)]
        chosen.update(int(at[a + left[a:b].argmax()]) for a, b in itertools.pairwise(bounds))
    if not places:
        return sorted(chosen)
    width = BESIDE_EVENT * float(np.ptp(np.append(path.drive, 0.0)))
    for place in places:  # the nearest point that counts: errors grow towards an event
        apart = np.abs(path.drive[at] - place)
        apart[apart < width] = np.inf
        chosen.add(int(at[apart.argmin()]))
    return sorted(k for k in chosen if all(abs(path.drive[k] - place) >= width for place in places))


MORE_TENSION = 1.5  # times what is known, from which on layers are cut anew
MAX_TENSION = 1e4  # L sqrt(N/EI) of a beam beyond which it is pulled straight: it locks
RECUT_SHARE = 0.15  # share of a beam from which on a taut element is cut again


def find_tension(path: Path, previous: Mapping[str, float]) -> dict[str, float]:
    """Return the beams with taut elements to their largest L sqrt(N/EI), if it is far more than the previous one."""
    e, tension = path.mesh.elements, dict[str, float]()
    if not len(path):
        return {}
    force = np.abs(path.at.z[:, e.unknowns[:, -2:]])
    if not _measure_tautness(path, force.max(axis=0).max(axis=1)).max() > TAUT_RATIO:
        return {}
    tautness = _measure_tautness(path, force.max(axis=2))
    resolved = np.where(tautness < MAX_TENSION, tautness, 0.0).max(axis=0)
    for number, (beam, (left, right)) in enumerate(zip(e.beam, e.cuts, strict=True)):
        if right - left > RECUT_SHARE and resolved[number] * (right - left) > TAUT_RATIO:
            tension[beam] = max(tension.get(beam, 0.0), float(resolved[number]))
    return {beam: value for beam, value in tension.items() if MORE_TENSION * previous.get(beam, 0.0) < value}


def _measure_tautness(path: Path, force: FloatArray) -> FloatArray:
    """Return L sqrt(N/EI) of forces in elements, dimensionless, with the lengths of their beams, (..., e)."""
    e = path.mesh.elements
    bending = (e.rigidity * e.weight).sum(axis=-1) * e.length
    row = path.mesh.numbering.row
    return np.asarray(np.sqrt(force / bending) * np.bincount(row, e.length.reshape(-1, len(row))[0])[row])


def drop_locked_points(path: Path) -> Path:
    """Return a path that ends early up to where a beam that does not stretch is pulled straight: there forces soar."""
    if path.status is PathStatus.COMPLETE or not len(path):
        return path
    rigid = ~path.mesh.axial.any(axis=1)
    if not rigid.any():
        return path
    force = np.abs(path.at.z[:, path.mesh.elements.unknowns[:, -2:]]).max(axis=2)
    locked = (_measure_tautness(path, force)[:, rigid] > MAX_TENSION).any(axis=1)
    return path.take(slice(0, int(locked.argmax()))) if locked.any() else path
