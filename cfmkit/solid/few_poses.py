"""The path of a part on a fine mesh, from that on a coarse mesh and a few poses on the fine one.

What two meshes differ by changes much more slowly along the path than the poses themselves. It is known at poses that
are solved on both, with its slope, and between them by cubics. Poses are solved in the middle of intervals where such a
cubic may be off most, until it predicts their force: as for the curve between poses (`meshed_part.refine_path`), of
which this is the curve of the difference. Every pose that is not solved says so (`Balance.solved`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.solid.meshed_part import MeshSolution, missed_by_cubics
from cfmkit.solid.path_following import PathEnd

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from scipy.interpolate import CubicHermiteSpline

    from cfmkit.arrays import FloatArray
    from cfmkit.solid.equilibrium import Balance
    from cfmkit.solid.mesh_refinement import RefinedMesh
    from cfmkit.solid.meshed_part import Meshed


CORRECTION_CHECKS = 2
"""Poses that must be as predicted, one after the other: those of Lan's part are predicted to 1e-6 from seven."""
MAX_CURVE_ERROR = 0.01
"""Part of the largest effort within which the solved poses must draw the coarse curve: what two meshes differ by, a
thousandth of it, is then known to some 1e-5."""
CORNER_STEP_SHARE = 1.0 / 8.0
"""Part of the steps between stops: where steps are shorter, the path has nearly a corner, and all poses are solved."""


@dataclass(frozen=True, eq=False)
class PoseGuide:
    """Unknowns on a mesh predicted from those of a coarser one that it was refined from."""

    coarse: MeshSolution
    meshed: Meshed
    refinements: tuple[RefinedMesh, ...]

    @cached_property
    def poses(self) -> dict[float, Balance]:
        """Poses on the coarser mesh by their travel [m or rad]."""
        return {pose.travel: pose for pose in self.coarse.course.poses}

    def __call__(self, travel: float) -> FloatArray | None:
        """Return the unknowns at a travel [m or rad]; None if the coarser mesh has no pose there."""
        pose = self.poses.get(travel)
        return None if pose is None else self._interpolate(self.coarse.evaluate_displacements(pose), pose.unknowns)

    def interpolate(self, travel: float) -> Balance:
        """Return the coarse pose at one of its travels [m or rad] as one on this mesh: unknowns and their slope."""
        if travel not in self._interpolated_poses:
            pose = self.poses[travel]
            unknowns = self._interpolate(self.coarse.evaluate_displacements(pose), pose.unknowns)
            slope = self._interpolate(self.coarse.slope(pose), pose.slope)
            self._interpolated_poses[travel] = replace(pose, unknowns=unknowns, slope=slope, solved=False)
        return self._interpolated_poses[travel]

    @cached_property
    def _interpolated_poses(self) -> dict[float, Balance]:
        return {}

    @cached_property
    def branch_steps(self) -> tuple[FloatArray, ...]:
        """Changes of the unknowns across the bifurcations on the coarser mesh, from and to poses apart from them."""
        places, travels = self.coarse.course.bifurcations, self.travels
        behind = [sum(abs(travel) < abs(place) for travel in travels) for place in places]
        pairs = [travels[k - 1 : k + 1] for k in behind if 0 < k < len(travels)]
        return tuple(np.subtract(*(self.interpolate(travel).unknowns for travel in pair[::-1])) for pair in pairs)

    def _interpolate(self, field: FloatArray, unknowns: FloatArray) -> FloatArray:
        """Return a field of the coarse nodes (n, 2) as unknowns, with the free motions of rigid pieces."""
        for refinement in self.refinements:
            field = refinement.interpolate(field)
        free = unknowns[len(self.coarse.problem.supports.loose) :]
        return np.concatenate([field.ravel()[self.meshed.problem.supports.loose], free])

    @property
    def travels(self) -> tuple[float, ...]:
        """Travels of the poses that are not close to a bifurcation [m or rad]: it is elsewhere on each mesh."""
        course = self.coarse.course
        distance = BIFURCATION_DISTANCE * abs(course.poses[-1].travel - course.poses[0].travel)
        travels = (pose.travel for pose in course.poses)
        return tuple(
            travel for travel in travels if all(abs(travel - place) > distance for place in course.bifurcations)
        )


BIFURCATION_DISTANCE = 0.01
"""Distance from a bifurcation within which poses of a coarser mesh are not repeated, in parts of the travel."""


@dataclass(frozen=True, eq=False)
class Correction:
    """Difference of the solved poses on a fine mesh from those on a coarse one, as a curve."""

    guide: PoseGuide
    solved: tuple[Balance, ...]  # along the path, at travels of the coarse mesh

    @property
    def differences(self) -> tuple[Balance, ...]:
        """The differences at the solved poses."""
        return tuple(_difference(pose, self.guide.interpolate(pose.travel)) for pose in self.solved)

    @cached_property
    def _cubics(self) -> CubicHermiteSpline:
        """The cubics through them, of the travel times the sense of the path: unknowns, then the effort."""
        from scipy.interpolate import CubicHermiteSpline

        poses = self.differences
        values = np.array([np.append(pose.unknowns, pose.effort) for pose in poses])
        slopes = np.array([np.append(pose.slope, pose.stiffness) for pose in poses])
        return CubicHermiteSpline([self._path_sense * pose.travel for pose in poses], values, self._path_sense * slopes)

    @property
    def _path_sense(self) -> float:
        return float(np.sign(self.solved[-1].travel - self.solved[0].travel))

    def pose_at(self, travel: float) -> Balance:
        """Return the pose on the fine mesh at a travel of the coarse one [m or rad], by what they differ by there."""
        coarse, at = self.guide.interpolate(travel), self._path_sense * travel
        more, slope = self._cubics(at), self._path_sense * self._cubics(at, 1)
        return replace(
            coarse,
            unknowns=coarse.unknowns + more[:-1],
            effort=coarse.effort + float(more[-1]),
            stiffness=coarse.stiffness + float(slope[-1]),
            slope=coarse.slope + slope[:-1],
        )

    def next_travel(self, travels: Sequence[float]) -> float | None:
        """Return the travel, of some, where the curve may be off most; None if all are solved.

        First where cubics through the coarse poses at the same travels miss the coarse curve: it has no shape there
        that the solved poses do not see. Then in the middle of the interval where those of the difference may be off.
        """
        places = np.array([self._path_sense * pose.travel for pose in self.solved])
        missed = self._measure_coarse_error(travels)
        if missed.max() > MAX_CURVE_ERROR:
            return travels[int(missed.argmax())]
        for k in np.argsort(-missed_by_cubics(self.differences), kind="stable"):
            inside = [travel for travel in travels if places[k] < self._path_sense * travel < places[k + 1]]
            if inside:
                middle = 0.5 * (places[k] + places[k + 1])
                return min(inside, key=lambda travel: abs(self._path_sense * travel - middle))
        return None

    def _measure_coarse_error(self, travels: Sequence[float]) -> FloatArray:
        """Return what the coarse curve is off at travels, drawn through the solved ones only, of its largest effort."""
        poses = self.guide.poses
        drawn = replace(self.guide.coarse.course, poses=tuple(poses[pose.travel] for pose in self.solved))
        effort = np.array([poses[travel].effort for travel in travels])
        size = float(np.abs(effort).max())
        return np.abs(drawn.effort(np.array(travels)) - effort) / size if size else np.zeros(len(travels))


def _difference(pose: Balance, reference: Balance) -> Balance:
    fields = ("unknowns", "effort", "stiffness", "slope")
    return replace(pose, **{name: getattr(pose, name) - getattr(reference, name) for name in fields})


def solve_some(guide: PoseGuide, travels: Sequence[float]) -> tuple[Balance, ...]:
    """Return the poses on a fine mesh at some travels of the coarse one, where they exist and are as stable."""
    poses: list[Balance] = []
    for travel in travels:
        coarse = guide.interpolate(travel)
        more = _difference(poses[-1], guide.interpolate(poses[-1].travel)).unknowns if poses else 0.0
        pose = guide.meshed.problem.solve(coarse.unknowns + more, travel)
        if pose is not None and pose.unstable <= coarse.unstable:
            poses.append(pose.drop_factors())
    return tuple(poses)


def follow_some(
    guide: PoseGuide,  # with the path on the coarse mesh
    poses: Sequence[Balance],  # that are solved on the fine mesh, the first and the last one of the path among them
    stops: Sequence[float],  # travels at which poses were wanted, before steps were cut [m or rad]
    # difference of the cubics and a pose, in parts of the largest effort, below which enough are solved
    allowed: float,
    report: Callable[[float], None],  # is given the share that is done
) -> MeshSolution | None:
    """Return the path on a fine mesh at all travels of the coarse one; None if the courses differ."""
    course, travels = guide.coarse.course, guide.coarse.course.travel.tolist()
    if course.ending is not PathEnd.COMPLETE or course.bifurcations or len(poses) < 3:
        return None
    if is_sharp(np.abs(travels), np.abs(stops)) or (poses[0].travel, poses[-1].travel) != (travels[0], travels[-1]):
        return None
    size = max(abs(pose.effort) for pose in course.poses)
    correction = Correction(guide, tuple(poses))
    off: list[float] = []
    while len(off) < CORRECTION_CHECKS or max(off[-CORRECTION_CHECKS:]) > allowed:
        if (travel := correction.next_travel(travels)) is None:
            break
        guess = correction.pose_at(travel)
        pose = guide.meshed.problem.solve(guess.unknowns, travel)
        if pose is None or pose.unstable > guess.unstable:
            return None
        off.append(abs(pose.effort - guess.effort) / size if size else 0.0)
        along = sorted([*correction.solved, pose.drop_factors()], key=lambda item: travels.index(item.travel))
        correction = Correction(guide, tuple(along))
        report(len(along) / len(travels))
    by_travel = {pose.travel: pose for pose in correction.solved}
    whole = tuple(by_travel.get(travel) or correction.pose_at(travel) for travel in travels)
    between = float(np.nan_to_num(guide.coarse.between)) + max(off[-CORRECTION_CHECKS:], default=0.0)
    return MeshSolution(
        guide.meshed.part, guide.meshed.problem, replace(course, poses=whole), guide.meshed.unjudged, between
    )


def is_sharp(travels: FloatArray, stops: FloatArray) -> bool:
    """Return True if two steps in a row had to be much shorter than those between stops; one may be what was left."""
    interval = np.clip(np.searchsorted(stops, travels[1:], side="left"), 1, len(stops) - 1)
    steps = np.diff(stops)[interval - 1]
    short = np.diff(travels) < CORNER_STEP_SHARE * (1.0 - 1e-9) * steps
    return bool((short[:-1] & short[1:]).any())
