"""A part as it is drawn: outline, widths, material and what is held or driven; meshed, and followed over a travel.

How far a curve between solved poses can be trusted, by poses in between; more poses where it cannot. Between poses
the effort is a cubic through efforts and stiffnesses. Where such a cubic over two neighbouring intervals misses the
pose between them most, a pose is solved in the middle of an interval and the cubic compared with it, until that
difference is small. Halving an interval reduces a smooth curve's error sixteen times [deBoor, ch. IV].

Reference
---------
[deBoor] C. de Boor, A Practical Guide to Splines, Springer 1978.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import FloatArray, read_only
from cfmkit.errors import GeometryError
from cfmkit.solid.boundary_and_element_sizes import Ring
from cfmkit.solid.elements import Elements
from cfmkit.solid.equilibrium import SolidProblem
from cfmkit.solid.mesh import mesh
from cfmkit.solid.path_following import advanced, follow
from cfmkit.solid.rigid_groups import Group, Supports, within
from cfmkit.solid.sections_of_mesh import check_mesh

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from cfmkit.export.beam_sections import BeamSection
    from cfmkit.export.contours import Contour
    from cfmkit.solid.equilibrium import Balance
    from cfmkit.solid.mesh import TriangleMesh
    from cfmkit.solid.path_following import PosePath
    from cfmkit.solid.plane_stress_law import Law


ACROSS, SHARE = 2.5, 0.2
"""Elements across the thinnest place, and side of an element on a fillet in radii, of the finer mesh: the force of
Lan's part at 2 mm is then within 3e-4 of that of elements of 0.6 times the size (4.94735 N)."""
LEAST_ACROSS = 2.0
"""Elements across the thickness, whatever the requested size: fewer are too stiff."""
COARSER = 1.5
"""Sides of the coarser mesh in those of the finer one: half as many nodes, so that the check costs a third more."""
TURN = math.radians(1.0)
"""Turn between the lines that stand for an arc, at most [rad]: beside corners of 9 degrees the largest stress of a
strip with fillets of 0.3 mm was 4 % too low, and rose with finer meshes to 6 % too much."""
BESIDE = 0.15
"""Part of the thinnest place within which no stress is read beside the end of a rigid piece that an edge runs straight
into. There the model's stress grows with finer meshes, as it does not in the part, whose blocks give a little: that of
the spring of `vcfm_ding2022` was 15, 18 and 25 MPa on three meshes, and 14.2, 14.0 and 14.3 MPa beyond this."""
TANGENT = 0.5
"""Sine of the angle between an edge and the face of a rigid piece below which it is a fillet that runs out on it."""
BULKY, COARSE = 2.0, 4.0
"""Area of a part, in that of strips of its thinnest size along its edges, from which on blocks have elements so many
times as large: mechanisms of beams have 1.0 to 1.4, that of Lan 1.9 with fillets of 5 mm, 19 with fillets of 20 mm."""
ON = 1e-3
"""Nodes nearer to a pad or a hole than this belong to it, and smaller steps of an edge are none: in thicknesses of the
thinnest place."""
RING = 2e-5
"""How far the lines of a boundary may be from its arcs, in the same: their bending stiffness is then within 1e-4."""


@dataclass(frozen=True)
class HeldOrDriven:
    """Where a part is held or driven, and moves as one rigid piece.

    Attributes
    ----------
    name : str
        For messages and decks; several places of one name are one support.
    shapes : tuple of (n, 2) arrays
        Polygons that it covers, or lines of two points [m].
    at : (2,) array
        About which it turns [m].
    driven, free : (3,) array, (3, f) array
        As of `Group`.
    seams : tuple of (2, 2) arrays
        Lines at which it begins [m].
    load : (3,) array
        Constant, as of `Group`.
    """

    name: str
    shapes: tuple[FloatArray, ...]
    at: FloatArray
    driven: FloatArray = field(default_factory=lambda: np.zeros(3))
    free: FloatArray = field(default_factory=lambda: np.zeros((3, 0)))
    seams: tuple[FloatArray, ...] = ()
    load: FloatArray = field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True)
class Part:
    """What is solved.

    Attributes
    ----------
    rings : tuple of Ring
        The boundary.
    thinnest : float
        Of what bends, in the plane [m].
    width : float
        Out of the plane, where no region says otherwise [m].
    law : Law
    places : tuple of HeldOrDriven
    regions : tuple of ((n, 2) array, float)
        Polygons of another width [m].
    largest : float
        Side of an element where the part is thick, in those of its thinnest place.
    obstacles : tuple of (n, 2) arrays
        Polygons of what stands and is not meshed, a frame [m]: the part ends its path where it comes to one.
    sections : tuple of BeamSection
        Of its beams: meshes must have their thickness.
    """

    rings: tuple[Ring, ...]
    thinnest: float
    width: float
    law: Law
    places: tuple[HeldOrDriven, ...]
    regions: tuple[tuple[FloatArray, float], ...] = ()
    largest: float = 1.0
    obstacles: tuple[FloatArray, ...] = ()
    sections: tuple[BeamSection, ...] = ()

    @property
    def near(self) -> float:
        """How far nodes of a pad or a hole may be from it [m]."""
        return ON * self.thinnest

    def meshed(self, size: float, across: float = LEAST_ACROSS) -> Meshed:
        """Return the part with elements of a size [m], and of so many across the thickness at least.

        A part with blocks has as many across as the size leaves.

        Raises
        ------
        cfmkit.errors.GeometryError
            If the outline cannot be meshed so, or no node is where the part is held.
        """
        share = SHARE * size / (self.thinnest / ACROSS)
        across = self.thinnest / size if self.largest > 1.0 else across
        seams = [seam for place in self.places for seam in place.seams]
        grid = mesh(self.rings, self.largest * size, share, across, seams, self.near)
        check_mesh(grid, sum(ring.area for ring in self.rings), self.sections)
        groups, held = self._groups(grid.nodes)
        elements = Elements(grid, self.law, self._widths(grid)).without(held)
        unjudged = held | self._beside_clamps(grid, held)
        return Meshed(self, SolidProblem(elements, Supports(grid.nodes, groups), self.obstacles), unjudged)

    def _beside_clamps(self, grid: TriangleMesh, held: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Tell which nodes are close to where an edge runs into the face of a rigid piece, not along it."""
        from scipy.spatial import cKDTree
        from shapely import LineString, Point

        near, tree = np.zeros(len(grid.nodes), bool), cKDTree(grid.nodes)
        starts = [k for k, edge in enumerate(grid.edges) if held[edge[0]] != held[edge[1]]]
        for k in starts:
            ends = grid.nodes[grid.edges[k, :2]]
            along = ends[1] - ends[0]
            for seam in (seam for place in self.places for seam in place.seams):
                face = seam[1] - seam[0]
                sine = abs(face[0] * along[1] - face[1] * along[0]) / (np.hypot(*face) * np.hypot(*along))
                if sine > TANGENT and LineString(seam).distance(LineString(ends)) < self.near:
                    around = LineString(seam).interpolate(LineString(seam).project(Point(ends.mean(axis=0))))
                    near[tree.query_ball_point(around.coords[0], BESIDE * self.thinnest)] = True
        return near

    def _widths(self, grid: TriangleMesh) -> FloatArray:
        """Return the width of every element [m], by where its middle is."""
        widths = np.full(len(grid.triangles), self.width)
        if self.regions:
            from shapely import Polygon, contains_xy

            middles = grid.nodes[grid.triangles[:, :3]].mean(axis=1)
            for polygon, width in self.regions:
                widths[contains_xy(Polygon(polygon), middles)] = width
        return widths

    def _groups(self, nodes: FloatArray) -> tuple[tuple[Group, ...], NDArray[np.bool_]]:
        """Return the groups of nodes that are held or driven, and which nodes are in one."""
        taken = np.zeros(len(nodes), bool)
        found: list[Group] = []
        for place in self.places:
            inside = np.flatnonzero(within(nodes, place.shapes, self.near) & ~taken)
            if len(inside):
                found.append(Group(place.name, inside, place.at, place.driven, place.free, place.load))
                taken[inside] = True
            elif not any(one.name == place.name.rstrip("'") for one in found):
                raise GeometryError(f"no node of the mesh lies where {place.name} is held")
        return tuple(found), taken


@dataclass(frozen=True, eq=False)
class Meshed:
    """A meshed part, ready to be solved.

    Attributes
    ----------
    part : Part
    problem : SolidProblem
    unjudged : (n,) array of bool
        Nodes whose stress is not read: they are held or driven, or at the end of a rigid piece.
    """

    part: Part
    problem: SolidProblem
    unjudged: NDArray[np.bool_]

    def followed(self, stops: Sequence[float], report: Callable[[float], None] = lambda _share: None) -> MeshSolution:
        """Return the poses at some travels, from rest on in one direction [m or rad]."""
        return MeshSolution(self.part, self.problem, follow(self.problem, stops, report), self.unjudged)

    def densely(self, stops: Sequence[float], report: Callable[[float], None] = lambda _share: None) -> MeshSolution:
        """Return the same with poses in between, as many as the curve needs, and what it is off between poses."""
        course, off = refined(self.problem, follow(self.problem, stops, report))
        return MeshSolution(self.part, self.problem, course, self.unjudged, off)


@dataclass(frozen=True, eq=False)
class MeshSolution:
    """One mesh of the part, followed over the travel.

    Attributes
    ----------
    part : Part
    problem : SolidProblem
    course : PosePath
    unjudged : (n,) array of bool
        Nodes whose stress is not read.
    between : float
        What the curve is off between poses, in parts of the largest effort; NaN where that was not looked at.
    """

    part: Part
    problem: SolidProblem
    course: PosePath
    unjudged: NDArray[np.bool_]
    between: float = float("nan")

    @cached_property
    def along_edges(self) -> tuple[FloatArray, NDArray[np.int64]]:
        """Stress along the free edges at each pose (k, e) [Pa], and at which nodes (e,)."""
        found = [self.problem.elements.along_edges(self.moved(pose), self.unjudged) for pose in self.course.poses]
        return read_only([stress for stress, _ in found]), found[0][1]

    @cached_property
    def peaks(self) -> tuple[FloatArray, FloatArray]:
        """Largest stress along a free edge at each pose (k,) [Pa], and where in the unloaded part (k, 2) [m]."""
        stress, nodes = self.along_edges
        worst = np.abs(stress).argmax(axis=1)
        largest = np.abs(stress[np.arange(len(stress)), worst])
        return read_only(largest), read_only(self.problem.elements.mesh.nodes[nodes[worst]])

    def differences(self, coarse: MeshSolution) -> tuple[float, float]:
        """Return by how much a coarser mesh differs at the poses of both: in force and in their largest stresses.

        Both in parts of this one's largest. All poses count: at a single one two meshes may agree by chance.
        """
        _, own, other = np.intersect1d(self.course.travel, coarse.course.travel, return_indices=True)
        force = np.array([self.course.poses[k].effort for k in own])
        there = np.array([coarse.course.poses[k].effort for k in other])
        return _apart(force, there), _apart(self.peaks[0][own], coarse.peaks[0][other])

    def moved(self, pose: Any) -> FloatArray:
        """Return the displacements of all nodes at a pose (n, 2) [m]."""
        return self.problem.supports.displaced(pose.unknowns, pose.travel)


def _apart(values: FloatArray, others: FloatArray) -> float:
    """Return the largest difference of values, in parts of the largest of the first; 0 where that is 0."""
    largest = float(np.abs(values).max(initial=0.0))
    return float(np.abs(values - others).max()) / largest if largest else 0.0


def largest_in(rings: Sequence[Ring], thinnest: float) -> float:
    """Return how large elements may be where a part of beams is thick, in those of its thinnest place [m]."""
    area = sum(ring.area for ring in rings)
    around = sum(float(ring.places[-1]) for ring in rings)
    return COARSE if area > BULKY * 0.5 * around * thinnest else 1.0


def rings_of(contours: Sequence[Contour], thinnest: float = math.inf) -> tuple[Ring, ...]:
    """Return the boundary that closed contours draw, as rings.

    Parameters
    ----------
    contours : sequence of Contour
        Outlines and holes.
    thinnest : float
        Thinnest place of the part [m]: rings are within `RING` of it from arcs; smooth edges are taken by their
        points.
    """
    step = ON * thinnest if math.isfinite(thinnest) else 0.0
    return tuple(Ring.of(contour.points(RING * thinnest, TURN), contour.hole, step) for contour in contours)


ALLOWED = 5e-4
"""Difference of cubic and pose, in parts of the largest effort, below which poses are dense enough."""
HALVED = 16.0
"""Factor by which half an interval has less error."""
CHECKS = 3
"""Intervals that must be below `ALLOWED`, one after the other, those with the largest estimates first."""
SHORTEST = 2.0**-10
"""Intervals are not halved below this part of the travel: there the curve has a corner, which is a pose."""


def refined(problem: SolidProblem, course: PosePath) -> tuple[PosePath, float]:
    """Return a path with poses added where the curve needs them, and what the curve is off between poses.

    Parameters
    ----------
    problem : SolidProblem
    course : PosePath
        At most as many poses are added as it has.

    Returns
    -------
    PosePath
        With the poses that were solved for the check.
    float
        Largest difference between cubic and pose of the last checks, in parts of the largest effort: intervals with
        the largest estimated error were checked. NaN where fewer than three poses are known.
    """
    if len(course.poses) < 3:
        return course, float("nan")
    size = max(abs(pose.effort) for pose in course.poses)
    if size == 0.0:
        return course, 0.0
    off: list[float] = []
    skipped: set[float] = set()
    for _ in range(len(course.poses)):
        found = _checked(problem, course, skipped)
        if found is None:
            break
        course, difference = found
        off.append(difference / size)
        if len(off) >= CHECKS and max(off[-CHECKS:]) <= ALLOWED:
            break
    return course, max(off[-CHECKS:], default=float("nan"))


def _checked(problem: SolidProblem, course: PosePath, skipped: set[float]) -> tuple[PosePath, float] | None:
    """Return the path with a pose in the middle of its worst interval, and how far the curve was from it [N or N m]."""
    travel = course.travel
    span = abs(travel[-1] - travel[0])
    corners = course.bifurcations
    estimates = _estimates(course.poses)
    # of estimates that are equal but for rounding, the first along the path: the same part gets the same poses
    ranks = np.round(estimates / max(float(estimates.max()), 1e-300), 3)
    for k in np.argsort(-ranks, kind="stable"):
        low, high = sorted(travel[k : k + 2].tolist())
        cornered = any(low <= place <= high for place in corners)
        if cornered or high - low < SHORTEST * span or low in skipped:
            continue
        first = course.poses[k]
        pose = advanced(problem, first, 0.5 * (low + high), course.poses[k - 1] if k else None)
        if pose is None or pose.unstable > first.unstable:
            skipped.add(low)
            continue
        difference = abs(float(course.effort(np.array([pose.travel]))[0]) - pose.effort)
        return replace(course, poses=(*course.poses[: k + 1], pose.kept(), *course.poses[k + 1 :])), difference
    return None


def _estimates(poses: tuple[Balance, ...]) -> FloatArray:
    """Return what the cubic of each interval may be off, (k - 1,) [N or N m]: the larger value of its two ends."""
    from scipy.interpolate import CubicHermiteSpline

    missed = np.zeros(len(poses))
    for k in range(1, len(poses) - 1):
        ends = sorted((poses[k - 1], poses[k + 1]), key=lambda pose: pose.travel)
        x, y, slope = np.array([(pose.travel, pose.effort, pose.stiffness) for pose in ends]).T
        missed[k] = abs(float(CubicHermiteSpline(x, y, slope)(poses[k].travel)) - poses[k].effort) / HALVED
    return np.asarray(np.maximum(missed[:-1], missed[1:]))
