"""Leaves and spring as they are drawn, as planar solids: what fillets and the true roots change against beams.

One leaf, or both of a V whose shuttle can turn, and one chain of the spring are solved and counted as those of the
exact model are: the shuttle is rigid, so that all leaves do the same. Shuttle, walls and blocks are held from their
faces on; the corners of a diamond bend. Each fillet has its largest stress over the preloads of an analysis; nominal
stresses are those of the beams that the exact model traces, as straight as they are drawn.

Assumes: plane stress. No contact, no plasticity.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import GeometryError, SolutionError
from cfmkit.export.arc_outlines import outlines
from cfmkit.families.fem_results import (
    FilletRow,
    both_images,
    drop_repeats,
    fillet_table,
    findings_of_mesh,
    largest_concentration,
    nominal_stresses,
    not_meshed,
    with_nominal,
)
from cfmkit.families.findings import sharp_inside
from cfmkit.families.vcfm.exact_model import DOWN_ANGLE, ExactSampler, leaf_network, problem_of, spring_chain
from cfmkit.families.vcfm.findings import finding
from cfmkit.families.vcfm.leaf_laws_from_spec import parts, strip_of
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import Coils
from cfmkit.families.vcfm.model import farthest_back, result_of, solve
from cfmkit.families.vcfm.outline import drawing, sharp_corners
from cfmkit.families.vcfm.part import solved_leaf, solved_spring
from cfmkit.results import Result, Status
from cfmkit.specs.units import window_places
from cfmkit.stock.material_and_part_spec import usual_fillet

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Network
    from cfmkit.families.run_control import Run
    from cfmkit.families.vcfm.part import SolvedPiece
    from cfmkit.families.vcfm.solution import Solution
    from cfmkit.families.vcfm.spec import VcfmSpec
    from cfmkit.results import Finding
    from cfmkit.solid.adaptive_solution import AdaptiveSolution, DrivenPart
    from cfmkit.solid.meshed_part import MeshSolution, Part
    from cfmkit.solid.stress_along_fillets import FilletStress


POSE_EXPONENT = 1.5
"""Poses stand at (k/n) to this power of the travel: the peak of thin leaves is within its first twentieth."""


@dataclass(frozen=True, eq=False)
class SolidPath:
    """A part that is followed from rest in one direction.

    It answers as a path of beams does (`interpolated_equilibrium_path.Traced`).
    """

    solved: MeshSolution

    @property
    def edges(self) -> tuple[float, ...]:
        """Zero, the bifurcations and the end [m]."""
        course = self.solved.course
        return (0.0, *course.bifurcations, float(course.travel[-1]) if len(course.poses) else 0.0)

    @property
    def problem(self) -> str:
        """Why the path ends early; empty if it does not."""
        return self.solved.course.ended

    @property
    def buckled_range(self) -> tuple[float, float]:
        """Range in which another form than unloaded is taken, from and to [m]; NaN where none is."""
        edges = self.edges
        return (edges[1], edges[2]) if len(edges) > 2 else (np.nan, np.nan)

    @property
    def stiffness(self) -> float:
        """At rest [N/m]."""
        return self.solved.course.poses[0].stiffness

    @cached_property
    def _stress(self) -> Any:
        from scipy.interpolate import PchipInterpolator

        return PchipInterpolator(np.abs(self.solved.course.travel), self.solved.peaks[0])

    def evaluate(self, travel: FloatArray) -> tuple[FloatArray, FloatArray, Any, Any]:
        """Return force, stress, stability and form at some travels [m]; NaN beyond the end."""
        x, reached = np.asarray(travel, dtype=float), self.edges[-1]
        beyond = np.abs(x) > abs(reached) * (1 + 1e-9) + 1e-15
        inside = np.where(beyond, 0.0, x)
        poses = self.solved.course.poses
        before = np.clip(np.searchsorted(np.abs(self.solved.course.travel), np.abs(x)) - 1, 0, len(poses) - 1)
        stable = np.array([pose.unstable == 0 for pose in poses])[before]
        first, last = self.buckled_range
        force = np.where(beyond, np.nan, self.solved.course.effort(inside))
        stress = np.where(beyond, np.nan, np.maximum(self._stress(np.abs(inside)), 0.0))
        return force, stress, stable, (np.abs(x) >= abs(first)) & (np.abs(x) <= abs(last))


class SolidSampler(ExactSampler):
    """Samples of leaves and spring as solids, over what an analysis needs; the progress of `run` is reported."""

    def __init__(self, spec: VcfmSpec, end: float, back: float, run: Run) -> None:
        """Mesh and follow leaf and spring."""
        about, preloads, back = spec.mechanism.bistable, spec.analysis.preloads, max(back, 0.02 * end)
        self.each = about.half_beams * (1.0 if about.guided else 0.5)
        self.coils = None if spec.mechanism.springs is None else Coils.from_springs(spec.mechanism.springs)
        leaf, *spring = elastic_parts(spec)
        leaves = leaf.solve(lambda part, _: run.progress(0.6 * part, "leaf"))
        self.pushed, self.mesh_error = _path(leaves.solution), leaves.error
        self.pulled = _pull_back(spec, leaves, -back, lambda part: run.progress(0.6 + 0.1 * part, "leaf, back"))
        self.sides, self.problem = [], problem_of("bistable", (self.pushed, self.pulled), 1.0)
        for solver in spring:
            self.chain = spring_chain(spec)
            back_again = self.chain.travel * min(min(preloads) - back, -0.02 * end)
            springs = solver.solve(lambda part, _: run.progress(0.7 + 0.2 * part, "spring"))
            pull = _pull_back(spec, springs, back_again, lambda part: run.progress(0.9 + 0.1 * part, "spring, back"))
            self.sides, self.mesh_error = [_path(springs.solution), pull], self.mesh_error.worse(springs.error)
            self.problem = self.problem or problem_of("positive", self.sides, self.chain.travel)
        self.accuracy = self.mesh_error.force

    def find_solved(self, travel: FloatArray, preload: float) -> NDArray[np.bool_]:
        """Return at which travels (n,) [m] leaves and spring (unless bought) were solved for, not interpolated."""
        is_solved = _is_solved_at(travel, (self.pushed, self.pulled))
        if self.coils is None:
            is_solved &= _is_solved_at(self.chain.travel * (travel + preload), self.sides)
        return is_solved


def _is_solved_at(places: FloatArray, paths: Sequence[SolidPath]) -> NDArray[np.bool_]:
    """Return at which travels (n,) [m] one of some paths was solved for."""
    travels = np.concatenate([path.solved.course.solved_travel for path in paths])
    same_travel = 1e-9 * float(np.abs(travels).max(initial=0.0))
    return np.asarray((np.abs(places[:, None] - travels) <= same_travel).any(axis=1))


def part_of(spec: VcfmSpec, piece: SolvedPiece) -> Part:
    """Return a piece of the drawing as it is solved."""
    from cfmkit.solid.meshed_part import HeldOrDriven, Part, rings_of
    from cfmkit.solid.plane_stress_law import MATERIAL_LAWS

    mechanism = spec.mechanism
    about = mechanism.bistable if piece.of_leaf else mechanism.flexures
    turns = piece.of_leaf and not mechanism.bistable.guided
    law = MATERIAL_LAWS[mechanism.material.law](mechanism.material.modulus, mechanism.material.poisson)
    across = np.array([[1.0], [0.0], [0.0]]) if piece.glides else np.zeros((3, 0))
    turning = np.array([[0.0], [0.0], [1.0]]) if turns else np.zeros((3, 0))
    shuttle = HeldOrDriven(
        "shuttle", (piece.moved,), piece.moved.mean(axis=0), np.array([0.0, -1.0, 0.0]), turning, _seams(piece.moved)
    )
    walls = [
        HeldOrDriven(
            f"wall-{number}", (edge,), edge.mean(axis=0), np.zeros(3), across, _seams(edge) if len(edge) > 2 else ()
        )
        for number, edge in enumerate(piece.held, start=1)
    ]
    rings, places = rings_of((piece.contour,), about.thickness), (shuttle, *walls)
    return Part(rings, about.thickness, about.width, law, places, sections=piece.sections)


def elastic_parts(spec: VcfmSpec) -> tuple[DrivenPart, ...]:
    """Return leaf and, unless it is bought, spring as solved: pushed. Decks and studies of meshes ask for them, too."""
    from cfmkit.solid.adaptive_solution import DrivenPart

    spec = spec.replace({"analysis.fidelity": "solid"})
    pieces, ends = {"leaf": solved_leaf(spec)}, {"leaf": spec.travel}
    if spec.mechanism.springs is None:
        pieces["spring"] = solved_spring(spec)
        ends["spring"] = spring_chain(spec).travel * (max(*spec.analysis.preloads, 0.0) + spec.travel)
    leaf_places = [place for _, window in spec.windows() for place in window_places(window, (0.0, spec.travel))]
    places = {"leaf": leaf_places}
    if spec.mechanism.springs is None:
        share, preload = spring_chain(spec).travel, spec.analysis.preloads[0]
        places["spring"] = [share * (preload + place) for place in leaf_places]
    driven_parts = []
    for name, piece in pieces.items():
        part, stops = part_of(spec, piece), _stops(spec, ends[name], 1, places[name])
        driven_parts.append(DrivenPart(f"vcfm-{name}", part, spec.analysis.solid.error, stops))
    return tuple(driven_parts)


def _seams(polygon: FloatArray) -> tuple[FloatArray, ...]:
    """Return the edges of a rigid block, where elements are to meet."""
    return tuple(np.array([a, b]) for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True))


def _stops(spec: VcfmSpec, end: float, fewer: int, places: Sequence[float] = ()) -> tuple[float, ...]:
    """Return the travels to solve for, up to an end [m]: of the poses wanted one in `fewer`, and places on the way."""
    count = max(5, spec.analysis.solid.poses // fewer)
    shares = np.linspace(0.0, 1.0, count) ** POSE_EXPONENT
    more = [place / end for place in places if 0.0 < place / end < 1.0]
    return tuple((end * drop_repeats(np.concatenate([shares, more]), 1.0)).tolist())


def _pull_back(spec: VcfmSpec, pushed: AdaptiveSolution, end: float, report: Callable[[float], None]) -> SolidPath:
    """Return a part that is pulled back to a travel [m], on the mesh found for pushing, with a quarter of the poses."""
    from cfmkit.solid.adaptive_solution import BETWEEN_SHARE

    return _path(pushed.meshed.densely(_stops(spec, end, 4), report, BETWEEN_SHARE * pushed.error.target))


def _path(solved: MeshSolution) -> SolidPath:
    """Return a path that has a curve; SolutionError where a part has no second pose."""
    if len(solved.course.poses) < 2:
        raise SolutionError(solved.course.ended)
    return SolidPath(solved)


def analyze(spec: VcfmSpec, run: Run) -> Result:
    """Return the curves of a mechanism as drawn, with everything that is wrong with it.

    As `cfmkit.families.vcfm.exact_model.analyze`; NO_EQUILIBRIUM if a part cannot be meshed.
    """
    made = parts(spec)
    back = 1.3 * farthest_back(spec, spec.analysis.preloads)
    try:
        outlines(drawing(spec))  # what cannot be cut is not solved: fillets too large make mountains of elements
        sampler = SolidSampler(spec, spec.travel, back, run)
    except GeometryError as error:
        return not_meshed(spec, error)
    except SolutionError as error:
        return Result(spec, Status.NO_EQUILIBRIUM, f"no curve: {error}")
    result = result_of(solution := solve(spec, made, sampler))
    warnings = (*result.warnings, *_findings(spec, sampler))
    if not result.curves:
        return replace(result, warnings=warnings)
    rows = sum(fillets(solution), ())
    tables = dict(result.tables)
    tables["fillets"] = partial(fillet_table, rows)
    values = {**result.values, **largest_concentration(rows)}
    return replace(result, values=values, warnings=warnings, tables=tables)


def _findings(spec: VcfmSpec, sampler: SolidSampler) -> Iterator[Finding]:
    if reported := sharp_inside(spec.mechanism.fillet, sharp_corners(spec)):
        yield finding("sharp_corners", reported, usual_fillet(spec.mechanism.thinnest))
    about = spec.mechanism
    sections = [(part.width, part.thickness) for part in (about.bistable, about.positive) if part is not None]
    yield from findings_of_mesh(finding, sampler.mesh_error, sections, about.material.poisson, about.wide_beams)


def fillets(solution: Solution) -> tuple[tuple[FilletRow, ...], tuple[FilletRow, ...]]:
    """Return the fillets of a leaf, and of a chain of the spring, with their largest stress up to the window's end.

    That of all preloads, as in `spring_stress_max` and `bistable_stress_max`. A bought spring has none.
    """
    sampler: Any = solution.sampler  # of solids
    leaf = _rows(solution, "leaf", "shuttle", (sampler.pushed, sampler.pulled))
    network, placed = leaf_network(solution.spec), partial(_to_leaf_network, solution.spec)
    leaf = _with_nominal(leaf, [row.motion for row in leaf], network, "shuttle", placed)
    if not sampler.sides:
        return leaf, ()
    chain, spring = sampler.chain, _rows(solution, "spring", "block", sampler.sides)
    travel = [chain.travel * (row.motion + (row.preload or 0.0)) for row in spring]
    return leaf, _with_nominal(spring, travel, chain.network, chain.node, partial(_to_spring_network, solution.spec))


def _rows(solution: Solution, piece: str, moved: str, ways: Sequence[Any]) -> tuple[FilletRow, ...]:
    """Return the fillets of one piece that is pushed and pulled."""
    radius = solution.spec.mechanism.fillet
    pushed, pulled = (direction.solved for direction in ways)
    rows = []
    for fillet in _both_ways(pushed, pulled, radius):
        joined = fillet.arc.find_touched(_rigid(pushed, moved))
        row = _largest(solution, fillet, f"{piece} at {joined[0] if joined else 'corner'}", piece == "spring")
        rows += [] if row is None else [row]
    return tuple(rows)


def _with_nominal(
    rows: Sequence[FilletRow],
    travel: Sequence[float],
    network: Network,
    node: str,
    placed: Callable[[FloatArray], FloatArray],
) -> tuple[FilletRow, ...]:
    """Return rows with the nominal stress of beams whose node has some travels (n,) [m]."""
    from cfmkit.elastica import Displacement

    paths = partial(both_images, network, partial(Displacement, node, DOWN_ANGLE))
    return with_nominal(rows, nominal_stresses(rows, np.array(travel), paths, placed))


def _to_leaf_network(spec: VcfmSpec, points: FloatArray) -> FloatArray:
    """Return points of the drawing, (m, 2) [m], in axes of the leaf network: right wall at x = 0, x to the left."""
    strip, half = strip_of(spec.mechanism.bistable, spec.mechanism.material), 0.5 * spec.mechanism.frame.shuttle_width
    x, y = points.T
    return np.column_stack([float(strip.reach) + half * np.sign(x) - x, y + float(strip.rise)])


def _to_spring_network(spec: VcfmSpec, points: FloatArray) -> FloatArray:
    """Return points of the drawing, (m, 2) [m], in axes of the spring's network, in which the block stands."""
    block = spec.mechanism.frame.block
    return np.column_stack([points[:, 0] - 0.5 * block, -points[:, 1] - block])


def _both_ways(pushed: MeshSolution, pulled: MeshSolution, radius: float) -> Iterator[FilletStress]:
    """Yield the fillets of a part with the poses of both ways: they are of one mesh, and begin with the same pose."""
    from cfmkit.solid.stress_along_fillets import FilletStress, stressed_fillets

    back = {tuple(fillet.arc.middle.tolist()): fillet for fillet in stressed_fillets(pulled, radius)}
    for fillet in stressed_fillets(pushed, radius):
        pulled_fillet = back.get(tuple(fillet.arc.middle.tolist()))
        if pulled_fillet is None:
            yield fillet
        else:
            travel, stress = (
                np.concatenate([a[:-1], b]) for a, b in zip(_poses(pulled_fillet), _poses(fillet), strict=True)
            )
            yield FilletStress(fillet.arc, travel, stress)


def _poses(fillet: FilletStress) -> tuple[Any, Any]:
    return fillet.travel, fillet.stress


def _rigid(solved: MeshSolution, moved: str) -> dict[str, list[Any]]:
    """Return the polygons of what moves and of what stands [m]; the middle of a corner is a line, and no piece."""
    polygons: dict[str, list[Any]] = {}
    for place in solved.part.places:
        name = moved if place.name == "shuttle" else {"shuttle": "wall"}.get(moved, moved)
        polygons.setdefault(name, []).extend(shape for shape in place.shapes if len(shape) > 2)
    return polygons


def _largest(solution: Solution, fillet: FilletStress, place: str, of_spring: bool) -> FilletRow | None:
    """Return the row of a fillet: at the preload and the travel of the shuttle where its stress is largest."""
    rows = []
    for push in solution.pushes:
        share, ahead = (solution.sampler.chain.travel, push.preload) if of_spring else (1.0, 0.0)  # type: ignore[attr-defined]
        start, end = float(push.travel[0]), min(solution.window_of_one[1], float(push.travel[-1]))
        if (worst := fillet.largest(share * (start + ahead), share * (end + ahead))) is not None:
            rows.append(FilletRow(place, fillet.arc, worst[0], worst[1] / share - ahead, push.preload))
    return max(rows, key=lambda row: abs(row.stress), default=None)
