"""A part as it is drawn (outline, widths, material, what is held or driven): meshed, checked, followed over a travel.

Between poses the effort is a cubic through efforts and stiffnesses. Where such a cubic over two neighbouring intervals
misses the pose between them most, a pose is solved in the middle of an interval and the cubic compared with it, until
that difference is small. Halving an interval reduces a smooth curve's error sixteen times [deBoor, ch. IV].

Whether the mesh is the part that was specified, its area and the section moduli of its beams say.

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
from cfmkit.export.contours import SECTION_RTOL
from cfmkit.solid.boundary_and_element_sizes import Ring
from cfmkit.solid.elements import Elements
from cfmkit.solid.equilibrium import SolidProblem
from cfmkit.solid.mesh import mesh
from cfmkit.solid.mesh_refinement import refine
from cfmkit.solid.path_following import PathEnd, PosePath, follow, pose_between
from cfmkit.solid.rigid_groups import Group, Supports, find_within

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from cfmkit.export.contours import BeamSection, Contour
    from cfmkit.solid.equilibrium import Balance
    from cfmkit.solid.followed_part import PathGuide
    from cfmkit.solid.mesh import TriangleMesh
    from cfmkit.solid.mesh_refinement import RefinedMesh
    from cfmkit.solid.plane_stress_law import Law


LINES_PER_EDGE = 8  # lines that stand for the parabola of an edge


def check_mesh(grid: TriangleMesh, area: float, sections: Sequence[BeamSection]) -> None:
    """Refuse a mesh whose area [m2] or whose beams are not those of the part.

    Pieces of beams that are shorter than they are thick are not judged: where a thickness changes from station to
    station elements smooth the kinks between them.

    Raises GeometryError with the place and the values.
    """
    if abs(grid.area - area) > SECTION_RTOL * area:
        raise GeometryError(f"the mesh covers {1e6 * grid.area:.6g} mm2 of the part's {1e6 * area:.6g} mm2")
    starts, ends = _boundary_lines(grid)
    for section in sections:
        if section.length >= section.thickness:
            section.check(sum(section.cut(starts, ends)), "mesh", "check mechanism.part")


def _boundary_lines(grid: TriangleMesh) -> tuple[FloatArray, FloatArray]:
    """Return the boundary of a mesh as short lines: starts and ends (n, 2) [m]."""
    a, b, middle = (grid.nodes[grid.edges[:, k], None] for k in range(3))
    s = np.linspace(0.0, 1.0, LINES_PER_EDGE + 1)[:, None]
    curve = (1 - s) * (1 - 2 * s) * a + 4 * s * (1 - s) * middle + s * (2 * s - 1) * b
    return curve[:, :-1].reshape(-1, 2), curve[:, 1:].reshape(-1, 2)


ELEMENTS_ACROSS, FILLET_ELEMENT_RATIO = 1.5, 0.4
"""Elements across the thinnest place, and side of an element on a fillet in radii, of the mesh that is refined: split
once, the force of Lan's part is within 1e-4 of that of much finer meshes."""
MAX_ARC_TURN = math.radians(1.0)
"""Turn between the lines that stand for an arc, at most [rad]: beside corners of 9 degrees the largest stress of a
strip with fillets of 0.3 mm was 4 % too low, and rose with finer meshes to 6 % too much."""
CLAMP_CLEARANCE = 0.15
"""Part of the thinnest place within which no stress is read beside the end of a rigid piece that an edge runs straight
into. There the model's stress grows with finer meshes, as it does not in the part, whose blocks give a little: that of
the spring of `vcfm_ding2022` was 15, 18 and 25 MPa on three meshes, and 14.2, 14.0 and 14.3 MPa beyond this."""
TANGENT_SINE = 0.5
"""Sine of the angle between an edge and the face of a rigid piece below which it is a fillet that runs out on it."""
BULKY_AREA_RATIO, BLOCK_ELEMENT_RATIO = 2.0, 4.0
"""Area of a part, in that of strips of its thinnest size along its edges, from which on blocks have elements so many
times as large: mechanisms of beams have 1.0 to 1.4, that of Lan 1.9 with fillets of 5 mm, 19 with fillets of 20 mm."""
SINGULAR_SPLITS = 3
"""How often triangles at singular points are split before a part is solved: each costs some fifteen nodes a point, and
halves the error from there."""
MAX_EFFORT_ERROR = 5e-4
"""Difference of cubic and pose, in parts of the largest effort, below which poses are dense enough."""
NODE_DISTANCE_TOL = 1e-3
"""Nodes nearer to a pad or a hole than this belong to it, and smaller steps of an edge are none: in thicknesses of the
thinnest place."""
BOUNDARY_TOLERANCE = 2e-5
"""How far the lines of a boundary may be from its arcs, in the same: their bending stiffness is then within 1e-4."""


@dataclass(frozen=True)
class HeldOrDriven:
    """Region in which a part is held or driven, and moves as one rigid piece."""

    name: str  # for messages and decks; several places of one name are one support
    shapes: tuple[FloatArray, ...]  # polygons that it covers, or lines of two points [m]
    at: FloatArray  # (2,) about which it turns [m]
    # driven, free, (3,), (3, f): as of `Group`
    driven: FloatArray = field(default_factory=lambda: np.zeros(3))
    free: FloatArray = field(default_factory=lambda: np.zeros((3, 0)))
    seams: tuple[FloatArray, ...] = ()  # lines at which it begins [m]
    load: FloatArray = field(default_factory=lambda: np.zeros(3))  # (3,) constant, as of `Group`


@dataclass(frozen=True)
class Part:
    """Problem that is solved."""

    rings: tuple[Ring, ...]  # the boundary
    thinnest: float  # of what bends, in the plane [m]
    width: float  # out of the plane, where no region says otherwise [m]
    law: Law
    places: tuple[HeldOrDriven, ...]
    regions: tuple[tuple[FloatArray, float], ...] = ()  # polygons of another width [m]
    largest: float = 1.0  # side of an element where the part is thick, in those of its thinnest place
    # polygons of what stands and is not meshed, a frame [m]: the part ends its path where it comes to one
    obstacles: tuple[FloatArray, ...] = ()
    sections: tuple[BeamSection, ...] = ()  # of its beams: meshes must have their thickness

    @property
    def near(self) -> float:
        """Largest distance of nodes of a pad or a hole from it [m]."""
        return NODE_DISTANCE_TOL * self.thinnest

    @cached_property
    def faces(self) -> tuple[FloatArray, ...]:
        """Lines at which rigid pieces begin (2, 2) [m]: seams, and of those on an edge of a pad the whole edge.

        The feet of fillets stand on the pad beside the beam. Elements across it there made a strip 8e-4 too soft.
        """
        from shapely import LineString, MultiPoint

        lines = []
        for place in self.places:
            pads = [shape for shape in place.shapes if len(shape) > 2]
            edges = [np.array(edge) for pad in pads for edge in zip(pad, np.roll(pad, -1, axis=0), strict=True)]
            for seam in place.seams:
                ends = MultiPoint(seam)
                close = (edge for edge in edges if max(map(LineString(edge).distance, ends.geoms)) <= self.near)
                lines.append(next(close, seam))
        return tuple(lines)

    def create_mesh(self, size: float | None = None) -> Meshed:
        """Return the part with elements of a size [m]; by default `ELEMENTS_ACROSS` across the thinnest place.

        A part with blocks has as many across as the size leaves, others `ELEMENTS_ACROSS` at least.

        Raises GeometryError if the outline cannot be meshed so, or no node is where the part is held.
        """
        size = self.thinnest / ELEMENTS_ACROSS if size is None else size
        share = FILLET_ELEMENT_RATIO * size / (self.thinnest / ELEMENTS_ACROSS)
        across = self.thinnest / size if self.largest > 1.0 else ELEMENTS_ACROSS
        grid = mesh(self.rings, self.largest * size, share, across, self.faces, self.near)
        check_mesh(grid, sum(ring.area for ring in self.rings), self.sections)
        meshed = self.assemble_on(grid, np.ones(len(grid.nodes), bool))
        for _ in range(SINGULAR_SPLITS):
            if meshed.singular.any():
                meshed, _ = meshed.refine(meshed.singular)
        return meshed

    def assemble_on(self, grid: TriangleMesh, holdable: NDArray[np.bool_]) -> Meshed:
        """Return the part on a mesh, of whose nodes some (n,) can be held; GeometryError if none is at a place."""
        groups, held = self._groups(grid.nodes, holdable)
        moving = np.asarray(~held[grid.triangles].all(axis=1))
        elements = Elements(grid, self.law, self._widths(grid)).only(moving)
        problem = SolidProblem(elements, Supports(grid.nodes, groups), self.obstacles)
        return Meshed(self, grid, held, moving, problem, held | self._find_nodes_beside_clamps(grid, held))

    def clamp_ends(self, grid: TriangleMesh, held: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Return the nodes (k,) at which an edge runs into the face of a rigid piece, not along it."""
        from shapely import LineString

        nodes = []
        for edge in grid.edges[held[grid.edges[:, 0]] != held[grid.edges[:, 1]]]:
            ends = grid.nodes[edge[:2]]
            along = ends[1] - ends[0]
            for seam in self.faces:
                face = seam[1] - seam[0]
                sine = abs(face[0] * along[1] - face[1] * along[0]) / (np.hypot(*face) * np.hypot(*along))
                if sine > TANGENT_SINE and LineString(seam).distance(LineString(ends)) < self.near:
                    nodes.append(edge[0] if held[edge[0]] else edge[1])
        return np.array(nodes, np.int64)

    def _find_nodes_beside_clamps(self, grid: TriangleMesh, held: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return which nodes are close to where an edge runs into the face of a rigid piece, not along it."""
        from scipy.spatial import cKDTree

        is_near, tree = np.zeros(len(grid.nodes), bool), cKDTree(grid.nodes)
        for place in grid.nodes[self.clamp_ends(grid, held)]:
            is_near[tree.query_ball_point(place, CLAMP_CLEARANCE * self.thinnest)] = True
        return is_near

    def _widths(self, grid: TriangleMesh) -> FloatArray:
        """Return the width of every element [m], by where its middle is."""
        widths = np.full(len(grid.triangles), self.width)
        if self.regions:
            from shapely import Polygon, contains_xy

            middles = grid.nodes[grid.triangles[:, :3]].mean(axis=1)
            for polygon, width in self.regions:
                widths[contains_xy(Polygon(polygon), middles)] = width
        return widths

    def _groups(self, nodes: FloatArray, holdable: NDArray[np.bool_]) -> tuple[tuple[Group, ...], NDArray[np.bool_]]:
        """Return the groups of nodes that are held or driven, and which nodes are in one."""
        taken = ~holdable
        groups: list[Group] = []
        for place in self.places:
            inside = np.flatnonzero(find_within(nodes, place.shapes, self.near) & ~taken)
            if len(inside):
                groups.append(Group(place.name, inside, place.at, place.driven, place.free, place.load))
                taken[inside] = True
            elif not any(group.name == place.name.rstrip("'") for group in groups):
                raise GeometryError(f"no node of the mesh lies where {place.name} is held")
        return tuple(groups), taken & holdable


@dataclass(frozen=True, eq=False)
class Meshed:
    """A meshed part, ready to be solved."""

    part: Part
    grid: TriangleMesh
    held: NDArray[np.bool_]  # (n,) nodes that are held or driven
    moving: NDArray[np.bool_]  # (m,) triangles that can strain: not all of their nodes move as one
    problem: SolidProblem  # of these triangles
    # (n,) nodes whose stress is not read: they are held or driven, or at the end of a rigid piece
    unjudged: NDArray[np.bool_]

    def refine(self, marked: NDArray[np.bool_] | None = None) -> tuple[Meshed, RefinedMesh]:
        """Return the part on a mesh with some triangles (m,) split in four, all without `marked`, and that mesh."""
        finer = refine(self.grid, self.part.rings, self.moving if marked is None else marked)
        return self.part.assemble_on(finer.mesh, finer.transfer_selection(self.held)), finer

    @cached_property
    def singular(self) -> NDArray[np.bool_]:
        """Triangles at a point where the stress is unbounded, (m,): a reentrant corner or the end of a clamp."""
        return np.asarray(self._singular_nodes[self.grid.triangles[:, :3]].any(axis=1))

    @cached_property
    def _singular_nodes(self) -> NDArray[np.bool_]:
        from scipy.spatial import cKDTree

        corners = [ring.points[ring.corners[ring.turns[ring.corners] < 0.0]] for ring in self.part.rings]
        ends = self.part.clamp_ends(self.grid, self.held)
        places = np.concatenate([*corners, self.grid.nodes[ends]])
        is_singular = np.zeros(len(self.grid.nodes), bool)
        is_singular[cKDTree(self.grid.nodes).query(places)[1]] = True
        return is_singular

    def collect_poses(self, *poses: Balance) -> MeshSolution:
        """Return some poses as a solution."""
        return MeshSolution(self.part, self.problem, PosePath(poses, PathEnd.COMPLETE), self.unjudged)

    def follow_stops(
        self,
        stops: Sequence[float],
        report: Callable[[float], None] = lambda _share: None,
        guide: PathGuide | None = None,
    ) -> MeshSolution:
        """Return the poses at some travels, from rest on in one direction [m or rad]; `guide` predicts unknowns."""
        return MeshSolution(self.part, self.problem, follow(self.problem, stops, report, guide=guide), self.unjudged)

    def densely(self, stops: Sequence[float], report: Callable[[float], None], allowed: float) -> MeshSolution:
        """Return the path with as many poses between the stops as the curve needs, and its error between poses."""
        course, off = refine_path(self.problem, follow(self.problem, stops, report), allowed)
        return MeshSolution(self.part, self.problem, course, self.unjudged, off)


@dataclass(frozen=True, eq=False)
class MeshSolution:
    """One mesh of the part, followed over the travel."""

    part: Part
    problem: SolidProblem
    course: PosePath
    unjudged: NDArray[np.bool_]  # (n,) nodes whose stress is not read
    # what the curve is off between poses, in parts of the largest effort; NaN where that was not looked at
    between: float = float("nan")

    @cached_property
    def along_edges(self) -> tuple[FloatArray, NDArray[np.int64]]:
        """Stress along the free edges at each pose (k, e) [Pa], and at which nodes (e,)."""
        results = [
            self.problem.elements.evaluate_edge_stress(self.evaluate_displacements(pose), self.unjudged)
            for pose in self.course.poses
        ]
        return read_only([stress for stress, _ in results]), results[0][1]

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
        _, places, places_of_coarse = np.intersect1d(self.course.travel, coarse.course.travel, return_indices=True)
        force = np.array([self.course.poses[k].effort for k in places])
        efforts = np.array([coarse.course.poses[k].effort for k in places_of_coarse])
        return _relative_difference(force, efforts), _relative_difference(
            self.peaks[0][places], coarse.peaks[0][places_of_coarse]
        )

    def evaluate_displacements(self, pose: Any) -> FloatArray:
        """Return the displacements of all nodes at a pose (n, 2) [m]."""
        return self.problem.supports.evaluate_displacements(pose.unknowns, pose.travel)

    def slope(self, pose: Any) -> FloatArray:
        """Return their derivatives with respect to the travel (n, 2)."""
        supports = self.problem.supports
        carried = supports.linearize_motion(pose.unknowns, pose.travel, np.zeros_like(supports.places))
        return carried.moves(np.append(pose.slope, 1.0))


def _relative_difference(values: FloatArray, others: FloatArray) -> float:
    """Return the largest difference of values, in parts of the largest of the first; 0 where that is 0."""
    largest = float(np.abs(values).max(initial=0.0))
    return float(np.abs(values - others).max()) / largest if largest else 0.0


def largest_size_ratio(rings: Sequence[Ring], thinnest: float) -> float:
    """Return the largest element size in those of the thinnest place: larger than 1 for a part with thick blocks."""
    area = sum(ring.area for ring in rings)
    around = sum(float(ring.places[-1]) for ring in rings)
    return BLOCK_ELEMENT_RATIO if area > BULKY_AREA_RATIO * 0.5 * around * thinnest else 1.0


def rings_of(
    contours: Sequence[Contour],  # outlines and holes
    # thinnest place of the part [m]: rings are within `BOUNDARY_TOLERANCE` of it from arcs; smooth edges are taken by
    # their points
    thinnest: float = math.inf,
) -> tuple[Ring, ...]:
    """Return the boundary that closed contours draw, as rings."""
    step = NODE_DISTANCE_TOL * thinnest if math.isfinite(thinnest) else 0.0
    return tuple(
        Ring.from_points(contour.points(BOUNDARY_TOLERANCE * thinnest, MAX_ARC_TURN), contour.hole, step)
        for contour in contours
    )


HALVING_ERROR_RATIO = 16.0  # factor by which half an interval has less error
N_CHECKS = 3
"""Intervals that must be below what is allowed, one after the other, those with the largest estimates first."""
MIN_INTERVAL_SHARE = 2.0**-10
"""Intervals are not halved below this part of the travel: there the curve has a corner, which is a pose."""


def refine_path(problem: SolidProblem, course: PosePath, allowed: float = MAX_EFFORT_ERROR) -> tuple[PosePath, float]:
    """Return a path with poses added where the curve needs them, at most as many as it has.

    And the largest difference between cubic and pose of the last checks, of the intervals with the largest estimated
    error, in parts of the largest effort; NaN where fewer than three poses are known. Poses are dense enough where it
    is below what is allowed.
    """
    if len(course.poses) < 3:
        return course, float("nan")
    size = max(abs(pose.effort) for pose in course.poses)
    if size == 0.0:
        return course, 0.0
    off: list[float] = []
    skipped: set[float] = set()
    for _ in range(len(course.poses)):
        refined = _check_interval(problem, course, skipped)
        if refined is None:
            break
        course, difference = refined
        off.append(difference / size)
        if len(off) >= N_CHECKS and max(off[-N_CHECKS:]) <= allowed:
            break
    return course, max(off[-N_CHECKS:], default=float("nan"))


def _check_interval(problem: SolidProblem, course: PosePath, skipped: set[float]) -> tuple[PosePath, float] | None:
    """Return the path with a pose in the middle of its worst interval, and how far the curve was from it [N or N m].

    None if there is no interval left that a pose could be put into.
    """
    travel = course.travel
    span = abs(travel[-1] - travel[0])
    corners = course.bifurcations
    estimates = missed_by_cubics(course.poses)
    # of estimates that are equal but for rounding, the first along the path: the same part gets the same poses
    ranks = np.round(estimates / max(float(estimates.max()), 1e-300), 3)
    for k in np.argsort(-ranks, kind="stable"):
        low, high = sorted(travel[k : k + 2].tolist())
        cornered = any(low <= place <= high for place in corners)
        if cornered or high - low < MIN_INTERVAL_SHARE * span or low in skipped:
            continue
        pose = pose_between(problem, course.poses[k], course.poses[k + 1], 0.5 * (low + high))
        if pose is None:
            skipped.add(low)
            continue
        difference = abs(float(course.effort(np.array([pose.travel]))[0]) - pose.effort)
        return replace(course, poses=(*course.poses[: k + 1], pose, *course.poses[k + 1 :])), difference
    return None


def missed_by_cubics(poses: tuple[Balance, ...]) -> FloatArray:
    """Return the estimated error of the cubic of each interval, (k - 1,) [N or N m]."""
    from scipy.interpolate import CubicHermiteSpline

    missed = np.zeros(len(poses))
    for k in range(1, len(poses) - 1):
        ends = sorted((poses[k - 1], poses[k + 1]), key=lambda pose: pose.travel)
        x, y, slope = np.array([(pose.travel, pose.effort, pose.stiffness) for pose in ends]).T
        missed[k] = abs(float(CubicHermiteSpline(x, y, slope)(poses[k].travel)) - poses[k].effort) / HALVING_ERROR_RATIO
    return np.asarray(np.maximum(missed[:-1], missed[1:]))
