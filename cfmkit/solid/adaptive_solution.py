"""A part on meshes that are refined until its force is known as closely as requested; errors of force and stress.

The part is followed on a coarse mesh, then on the same mesh with every triangle split in four. What the two differ by
in an element says how much of the error was there, and how much is left follows from the order of convergence that it
has at least: at a reentrant corner or the end of a clamp the stress is singular and the error falls like the size;
elsewhere it falls like the square, and in fact like the fourth power (benchmarks/solid_mesh_error.py). Where more is
left than is allowed, the elements with the most of it are split again. Nothing is extrapolated: values are those of the
last mesh.

The force is the derivative of the energy with respect to the travel, so its error is that of the energy's: the tangent
energy of the missing displacements and of the missing slopes of the path, a sum over the elements [BR].

Reference
---------
[BR] R. Becker, R. Rannacher, An optimal control approach to a posteriori error estimation in finite element methods,
Acta Numerica 10 (2001) 1-102.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.numerics.one_blas_thread import one_blas_thread
from cfmkit.solid.few_poses import PoseGuide, follow_some, solve_some

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.solid.equilibrium import Balance
    from cfmkit.solid.mesh_refinement import RefinedMesh
    from cfmkit.solid.meshed_part import Meshed, MeshSolution, Part

    Report = Callable[[float, str], None]

SINGULAR_LEFT = 1.5
"""Error left at a singular point, in what splitting took away: 1 where it falls like the size, the least there is."""
SMOOTH_LEFT = 1.0 / 3.0  # error left elsewhere, in what splitting took away: it falls like the square at least
FORCE_ROUNDING = 5e-5  # least error of the force: poses are solved, and arcs drawn, about as closely
STRESS_LEFT, STRESS_LEAST = 1.0, 0.03
"""Error of the largest stress in what splitting changed, and the least: an average over elements scatters."""
STRESS_ALLOWED = 0.14  # error of the largest stress from which on a mesh is called coarse
MAX_NODES = 30_000  # of meshes that are refined further: beyond it a pose takes seconds
MAX_ROUNDS = 8
N_TRIAL_POSES = 4  # poses at which meshes are compared before the last one is followed
AIMED_SHARE = 0.6  # of the allowed error, that refinement is to leave
SINGULAR_AFTER_SPLIT, SMOOTH_AFTER_SPLIT = 0.5, 1.0 / 8.0
"""Error expected in a triangle once it is split, in what it was."""
CORRECTION_SHARE, CORRECTION_LARGEST = 0.04, 2e-5
"""Of the allowed error, that the difference of meshes may have between the poses that are solved on both; and how much
of the largest force that may be, whatever target is requested: a curve's shape is not to suffer."""
BETWEEN_SHARE = 0.2  # of the allowed error, that cubics between poses may have


@dataclass(frozen=True)
class MeshError:
    """Errors of force and largest stress of a part."""

    force_difference: float  # of the last two meshes, in parts of the largest force
    stress_difference: float  # the same of the largest stress
    force: float  # error of the force on the last mesh and of cubics between poses, in parts of the largest
    target: float  # error that was requested
    between: float = math.nan  # what cubics are off between poses, in parts of the largest force

    @property
    def stress(self) -> float:
        """Error of the largest stress, in parts of it."""
        return max(STRESS_LEFT * self.stress_difference, STRESS_LEAST)

    def values(self) -> dict[str, float | None]:
        """Return them by the names that every family gives them (`families.fem_results`)."""
        return {
            "mesh_force_difference": self.force_difference,
            "mesh_stress_difference": self.stress_difference,
            "mesh_force_error": self.force,
            "mesh_stress_error": self.stress,
            "curve_error": None if math.isnan(self.between) else self.between,
        }

    def worse(self, error: MeshError) -> MeshError:
        """Return the larger of both, each."""
        return MeshError(
            max(self.force_difference, error.force_difference),
            max(self.stress_difference, error.stress_difference),
            max(self.force, error.force),
            self.target,
            float(np.fmax(self.between, error.between)),
        )

    def too_large(self) -> Iterator[tuple[str, str]]:
        """Yield (finding, message) for each error that is larger than allowed."""
        if self.force > self.target or self.stress > STRESS_ALLOWED:
            yield (
                "mesh_coarse",
                f"the force is known to {100 * self.force:.2g} % of the largest (requested: "
                f"{100 * self.target:.2g} %), the largest stress to {100 * self.stress:.2g} %: meshes of more than "
                f"{MAX_NODES} nodes are not refined, and poses at most doubled",
            )


@dataclass(frozen=True)
class CriticalPoint:
    """Place at which a part leaves its path for another branch, and its error."""

    travel: float  # [m or rad]
    effort: float  # [N or N m]
    error: float  # of both, each in parts of its own value; NaN if the coarser mesh has no such point


@dataclass(frozen=True)
class AdaptiveSolution:
    """A part followed on a mesh that was refined, and how closely its force is known."""

    solution: MeshSolution
    error: MeshError
    meshed: Meshed
    critical_points: tuple[CriticalPoint, ...] = ()

    def no_curve(self, poses: int) -> str:
        """Return why there are fewer poses than a curve needs; empty if there are enough."""
        course = self.solution.course
        return course.ended if len(course.poses) < poses else ""


@dataclass(frozen=True)
class DrivenPart:
    """A part with what is needed to follow it."""

    name: str  # for files
    part: Part
    error: float  # that the force may have, in parts of the largest
    stops: tuple[float, ...]  # travels to solve for, from rest on in one direction [m or rad]
    every_pose: bool = False  # solved on the last mesh, too: reactions are not read off poses that are put together

    @one_blas_thread
    def solve(self, report: Report = lambda _share, _text: None) -> AdaptiveSolution:
        """Return the part on a mesh on which its force is known as requested, or as closely as `MAX_NODES` allow.

        Raises GeometryError if the outline cannot be meshed, or no node is where the part is held.
        """
        meshed = self.part.create_mesh()
        coarse = meshed.follow_densely(
            self.stops, lambda share: report(FIRST_SHARE * share, "coarse mesh"), BETWEEN_SHARE * self.error
        )
        if len(coarse.course.poses) < 2:
            return AdaptiveSolution(coarse, MeshError(math.nan, math.nan, math.nan, self.error), meshed)

        def report_fine(share: float) -> None:
            report(FIRST_SHARE + (1.0 - FIRST_SHARE) * share, "fine mesh")

        between = float(np.nan_to_num(coarse.between))
        correction = min(CORRECTION_SHARE * self.error, CORRECTION_LARGEST)
        allowed = self.error - correction - between
        first, guide, followed = self._first_level(meshed, coarse, report_fine)
        level = first
        for _ in range(MAX_ROUNDS):
            if level.error <= allowed or len(level.meshed.grid.nodes) > MAX_NODES:
                break
            if (refined := level.refine(allowed)) is None:
                break
            level, refinement = refined
            guide, followed = PoseGuide(coarse, level.meshed, (*guide.refinements, refinement)), None
        solution = followed
        if solution is None and not self.every_pose:
            poses = [state.pose for state in level.states]
            solution = follow_some(guide, poses, self.stops, correction, report_fine)
        if solution is None:
            solution = replace(_followed_alike(guide, self.stops, report_fine), between=coarse.between)
        left = level.error * _largest_beside(solution, guide, [state.pose.travel for state in level.states])
        force = max(left + float(np.nan_to_num(solution.between)), FORCE_ROUNDING)
        compared = meshed.collect_poses(*(guide.poses[state.pose.travel] for state in first.states))
        differences = first.states[0].solution.differences(compared)
        error = MeshError(*differences, force, self.error, solution.between)
        return AdaptiveSolution(solution, error, level.meshed, _critical_points(solution, coarse))

    def _first_level(
        self, meshed: Meshed, coarse: MeshSolution, report: Callable[[float], None]
    ) -> tuple[Level, PoseGuide, MeshSolution | None]:
        """Return the mesh with all triangles split, at trial poses; followed along its path if these are not found."""
        finer, refinement = meshed.refine()
        guide = PoseGuide(coarse, finer, (refinement,))
        poses, followed = solve_some(guide, _trial_travels(guide)), None
        if len(poses) < 2:
            followed = replace(_followed_alike(guide, self.stops, report), between=coarse.between)
            poses = tuple(pose for pose in followed.course.poses if pose.travel in guide.poses)
        states = tuple(MeshedPose(finer.collect_poses(*poses), pose) for pose in poses)
        before = tuple(MeshedPose(coarse, guide.poses[pose.travel]) for pose in poses)
        return Level.from_poses(finer, refinement, states, before), guide, followed


FIRST_SHARE = 0.25  # of the time, that the coarse mesh takes


def _followed_alike(guide: PoseGuide, stops: tuple[float, ...], report: Callable[[float], None]) -> MeshSolution:
    """Return the poses of a part at all travels at which a coarser mesh has one, and at the stops."""
    travels = sorted({*guide.travels, *stops}, reverse=bool(stops[-1] < stops[0]))
    return guide.meshed.follow_stops(travels, report, guide)


def _largest_beside(solution: MeshSolution, guide: PoseGuide, trial: Sequence[float]) -> float:
    """Return the largest difference to the coarse mesh, but near bifurcations, in that at trial poses; 1 at least."""
    kept = {*guide.travels}
    apart = {
        pose.travel: abs(pose.effort - guide.poses[pose.travel].effort)
        for pose in solution.course.poses
        if pose.travel in kept
    }
    largest = max((apart.get(travel, 0.0) for travel in trial), default=0.0)
    return max(1.0, max(apart.values(), default=0.0) / largest) if largest else 1.0


def _critical_points(solution: MeshSolution, coarse: MeshSolution) -> tuple[CriticalPoint, ...]:
    """Return the bifurcations on a mesh; the error of each is its difference from the coarser mesh."""
    span = abs(solution.course.travel[-1] - solution.course.travel[0])
    points = []
    for travel in solution.course.bifurcations:
        effort, error = float(solution.course.effort(np.array([travel]))[0]), math.nan
        nearby = [place for place in coarse.course.bifurcations if abs(place - travel) < SAME_BIFURCATION * span]
        if nearby and travel and effort:
            nearest = min(nearby, key=lambda place: abs(place - travel))
            apart = abs(float(coarse.course.effort(np.array([nearest]))[0]) - effort)
            error = max(apart / abs(effort), abs(nearest - travel) / abs(travel), CRITICAL_LEAST)
        points.append(CriticalPoint(travel, effort, error))
    return tuple(points)


SAME_BIFURCATION = 0.05
"""Distance of bifurcations on two meshes, in parts of the travel, up to which they are the same one."""
CRITICAL_LEAST = 1e-4
"""Least error of a critical travel and effort: where tangents of the curve meet is known about as closely."""


def _trial_travels(guide: PoseGuide) -> tuple[float, ...]:
    """Return travels of a few coarse poses [m or rad]: even ones, of extreme forces, on both sides of bifurcations."""
    travels = guide.travels
    force = np.array([guide.poses[travel].effort for travel in travels])
    # a pose at rest has no force and no error
    chosen = {*np.linspace(0, len(travels) - 1, N_TRIAL_POSES + 1).round().astype(int), force.argmin(), force.argmax()}
    for place in guide.coarse.course.bifurcations:
        behind = int((np.abs(travels) < abs(place)).sum())
        chosen |= {max(behind - 1, 0), min(behind, len(travels) - 1)}
    return tuple(travels[k] for k in sorted(chosen))


@dataclass(frozen=True)
class MeshedPose:
    """An equilibrium on a mesh."""

    solution: MeshSolution
    pose: Balance

    @property
    def moved(self) -> FloatArray:
        """Displacements of the nodes (n, 2) [m]."""
        return self.solution.evaluate_displacements(self.pose)

    @property
    def slope(self) -> FloatArray:
        """Derivatives of the displacements with respect to the travel (n, 2)."""
        return self.solution.slope(self.pose)


@dataclass(frozen=True)
class Level:
    """A mesh at a few poses, with the estimated error in each of its triangles."""

    meshed: Meshed
    states: tuple[MeshedPose, ...]
    left: FloatArray  # of p poses and m triangles, in parts of the largest force, (p, m)

    @property
    def error(self) -> float:
        """Error of the force, in parts of the largest, at the worst of the poses."""
        return float(self.left.sum(axis=1).max())

    @classmethod
    def from_poses(
        cls,
        meshed: Meshed,
        refinement: RefinedMesh,
        states: tuple[MeshedPose, ...],
        coarse: tuple[MeshedPose, ...],
        left: FloatArray | None = None,
    ) -> Level:
        """Return a level from poses on a mesh and on the coarser one, whose triangles had an error left (p, m)."""
        children = np.bincount(refinement.parents)[refinement.parents]
        split = children > 1
        largest = max(abs(state.pose.effort) for state in states)
        shares = np.where(meshed.singular, SINGULAR_LEFT, SMOOTH_LEFT)
        differences = np.zeros((len(states), len(split)))
        for row, (state, before) in enumerate(zip(states, coarse, strict=True)):
            missing, slope = (
                mine - refinement.interpolate(theirs)
                for mine, theirs in ((state.moved, before.moved), (state.slope, before.slope))
            )
            energy = np.zeros(len(split))
            energy[meshed.moving] = np.abs(meshed.problem.elements.tangent_energies(state.moved, missing, slope))
            energy[~split] = 0.0
            whole = float(energy.sum())
            apart = abs(state.pose.effort - before.pose.effort) / largest if largest else 0.0
            differences[row] = shares * energy * (apart / whole if whole else 0.0)
            if left is not None:
                differences[row, ~split] = left[row, refinement.parents[~split]]
        return cls(meshed, states, differences)

    def mark(self, allowed: float) -> NDArray[np.bool_]:
        """Return the triangles to split, (m,): those with the most error left, so that a part of `allowed` remains."""
        worst = self.left[self.left.sum(axis=1).argmax()]
        gain = worst * (1.0 - np.where(self.meshed.singular, SINGULAR_AFTER_SPLIT, SMOOTH_AFTER_SPLIT))
        order = np.argsort(-gain)
        needed = self.error - AIMED_SHARE * allowed
        count = int(np.searchsorted(np.cumsum(gain[order]), needed)) + 1
        # a split triangle has about eight new nodes, with those of the neighbours that follow
        count = min(count, max(1, (MAX_NODES - len(self.meshed.grid.nodes)) // 8))
        marked = np.zeros(len(worst), bool)
        marked[order[:count]] = gain[order[:count]] > 0.0
        return marked

    def refine(self, allowed: float) -> tuple[Level, RefinedMesh] | None:
        """Return the level with triangles split; None if an equilibrium is not found on it."""
        meshed, refinement = self.meshed.refine(self.mark(allowed))
        states = []
        for state in self.states:
            guess = PoseGuide(state.solution, meshed, (refinement,))(state.pose.travel)
            pose = None if guess is None else meshed.problem.solve(guess, state.pose.travel)
            if pose is None or pose.unstable > state.pose.unstable:
                return None
            states.append(MeshedPose(meshed.collect_poses(pose.drop_factors()), pose.drop_factors()))
        return Level.from_poses(meshed, refinement, tuple(states), self.states, self.left), refinement
