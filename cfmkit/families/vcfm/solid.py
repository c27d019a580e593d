"""Leaves and spring as they are drawn, as planar solids: what fillets and the true roots change against beams.

One leaf, or both of a V whose shuttle can turn, and one chain of the spring are solved and counted as those of the
exact model are: the shuttle is rigid, so that all leaves do the same. Shuttle, walls and blocks are held from their
faces on; the corners of a diamond bend.

Assumes: plane stress. No contact, no plasticity.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import GeometryError
from cfmkit.families.vcfm.build import coils, parts
from cfmkit.families.vcfm.exact_model import ExactSampler, problem_of, spring_chain
from cfmkit.families.vcfm.findings import finding
from cfmkit.families.vcfm.model import LawSampler, rest_of, result_of, solve, travel_grid
from cfmkit.families.vcfm.outline import solved_leaf, solved_spring
from cfmkit.results import Result, Status
from cfmkit.stock.spec import CutPart

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.families.base import Run
    from cfmkit.families.vcfm.outline import SolvedPiece
    from cfmkit.families.vcfm.spec import VcfmSpec
    from cfmkit.results import Finding
    from cfmkit.solid.meshed_part import MeshSolution, Part

GATHERED = 1.5
"""Poses stand at (k/n) to this power of the travel: the peak of thin leaves is within its first twentieth."""
FORCE_APART, STRESS_APART = 2e-3, 0.05
"""Differences of two meshes from which on they are called coarse."""


@dataclass(frozen=True, eq=False)
class SolidPath:
    """A part that is followed from rest in one direction, asked like a path of beams (`traced.Traced`).

    Attributes
    ----------
    solved : MeshSolution
        The finer mesh.
    coarse : MeshSolution or None
        The coarser one, where there is one.
    end : float
        How far it was to go [m], of either sign.
    """

    solved: MeshSolution
    coarse: MeshSolution | None
    end: float

    @property
    def edges(self) -> tuple[float, ...]:
        """Zero, the bifurcations and the end [m]."""
        course = self.solved.course
        return (0.0, *course.bifurcations, float(course.travel[-1]) if len(course.poses) else 0.0)

    @property
    def problem(self) -> str:
        """Why the path ends early; empty if it does not."""
        return self.solved.course.ending.value

    @property
    def buckled_range(self) -> tuple[float, float]:
        """Where another form than as made is taken, from and to [m]; NaN where none is."""
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

    def at(self, travel: FloatArray) -> tuple[FloatArray, FloatArray, Any, Any]:
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

    @property
    def differences(self) -> tuple[float, float]:
        """Of force and of largest stress between the meshes, in parts of the finer one's largest; 0 without two."""
        return (0.0, 0.0) if self.coarse is None else self.solved.differences(self.coarse)


class SolidSampler(ExactSampler):
    """Samples of leaves and spring as solids, over what an analysis needs.

    Parameters
    ----------
    spec : VcfmSpec
        What is analysed.
    end : float
        How far the shuttle goes [m].
    back : float
        How far it is pulled back at most, positive [m].
    run : Run
        Its progress is reported.
    """

    def __init__(self, spec: VcfmSpec, end: float, back: float, run: Run) -> None:
        """Mesh and follow leaf and spring."""
        about, preloads, back = spec.mechanism.bistable, spec.analysis.preloads, max(back, 0.02 * end)
        self.each = about.half_beams * (1.0 if about.guided else 0.5)
        leaf = part_of(spec, solved_leaf(spec))
        self.coils = None if spec.mechanism.springs is None else coils(spec.mechanism.springs)
        self.pushed = followed(spec, leaf, end, True, lambda part: run.progress(0.6 * part, "leaf"))
        self.pulled = followed(spec, leaf, -back, False, lambda part: run.progress(0.6 + 0.1 * part, "leaf, back"))
        self.sides, self.problem = [], problem_of("leaves were", (self.pushed, self.pulled), 1.0)
        if self.coils is not None:
            return
        self.chain = spring_chain(spec)
        spring, share = part_of(spec, solved_spring(spec)), self.chain.travel
        forth, back_again = share * (max(preloads) + end), share * min(min(preloads) - back, -0.02 * end)
        press = followed(spec, spring, forth, True, lambda part: run.progress(0.7 + 0.2 * part, "spring"))
        pull = followed(spec, spring, back_again, False, lambda part: run.progress(0.9 + 0.1 * part, "spring, back"))
        self.sides = [press, pull]
        self.problem = self.problem or problem_of("spring was", self.sides, self.chain.travel)

    @property
    def mesh_differences(self) -> dict[str, float | None]:
        """Values of what two meshes differ by, the larger of leaf and spring."""
        leaf = self.pushed.differences
        spring = self.sides[0].differences if self.sides else (0.0, 0.0)
        return {
            "mesh_force_difference": max(leaf[0], spring[0]),
            "mesh_stress_difference": max(leaf[1], spring[1]),
        }


def part_of(spec: VcfmSpec, piece: SolvedPiece) -> Part:
    """Return a piece of the drawing as it is solved."""
    from cfmkit.solid.meshed_part import Part, Place, rings_of
    from cfmkit.solid.plane_stress_law import LAWS

    mechanism = spec.mechanism
    about = mechanism.bistable if piece.of_leaf else mechanism.flexures
    turns = piece.of_leaf and not mechanism.bistable.guided
    law = LAWS[spec.analysis.solid.law](mechanism.material.modulus, mechanism.material.poisson)
    across = np.array([[1.0], [0.0], [0.0]]) if piece.glides else np.zeros((3, 0))
    turning = np.array([[0.0], [0.0], [1.0]]) if turns else np.zeros((3, 0))
    shuttle = Place(
        "shuttle", (piece.moved,), piece.moved.mean(axis=0), np.array([0.0, -1.0, 0.0]), turning, _seams(piece.moved)
    )
    walls = [
        Place(f"wall-{number}", (one,), one.mean(axis=0), np.zeros(3), across, _seams(one) if len(one) > 2 else ())
        for number, one in enumerate(piece.held, start=1)
    ]
    return Part(rings_of((piece.contour,)), about.thickness, about.width, law, (shuttle, *walls))


def decks(spec: VcfmSpec) -> dict[str, bytes]:
    """Return leaf and spring as input decks of a finite-element solver, by file name."""
    from cfmkit.solid.input_deck import deck
    from cfmkit.solid.meshed_part import ACROSS

    spec = spec.replace({"analysis.fidelity": "solid"})
    pieces, ends = {"leaf": solved_leaf(spec)}, {"leaf": spec.travel}
    if spec.mechanism.springs is None:
        pieces["spring"] = solved_spring(spec)
        ends["spring"] = spring_chain(spec).travel * (max(*spec.analysis.preloads, 0.0) + spec.travel)
    found = {}
    for name, piece in pieces.items():
        part = part_of(spec, piece)
        meshed = part.meshed(spec.analysis.solid.mesh or part.thinnest / ACROSS)
        found[f"vcfm-{name}.inp"] = deck(f"{spec.name} {name}", part, meshed, ends[name], spec.analysis.solid.poses)
    return found


def _seams(polygon: FloatArray) -> tuple[FloatArray, ...]:
    """Return the edges of a rigid block, where elements are to meet."""
    return tuple(np.array([a, b]) for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True))


def followed(spec: VcfmSpec, part: Part, end: float, twice: bool, report: Any) -> SolidPath:
    """Return a part that is followed to a travel [m]: on two meshes, or on one and with a quarter of the poses."""
    from cfmkit.solid.meshed_part import ACROSS, COARSER

    about = spec.analysis.solid
    size = about.mesh or part.thinnest / ACROSS
    count = about.poses if twice else max(5, about.poses // 4)
    stops = (end * np.linspace(0.0, 1.0, count) ** GATHERED).tolist()
    second = [*stops[:-1:2], stops[-1]]
    coarse = part.meshed(COARSER * size).followed(second, lambda done: report(0.3 * done)) if twice else None
    return SolidPath(part.meshed(size).followed(stops, lambda done: report(0.3 + 0.7 * done)), coarse, end)


def analyze(spec: VcfmSpec, run: Run) -> Result:
    """Return the curves of a mechanism as drawn, with everything that is wrong with it.

    As `cfmkit.families.vcfm.exact_model.analyze`; NO_EQUILIBRIUM if a part cannot be meshed.
    """
    made = parts(spec)
    rests = [rest_of(LawSampler(made), preload, travel_grid(spec)) for preload in spec.analysis.preloads]
    back = 1.3 * max([-(rest or 0.0) for rest in rests] + [0.0])
    try:
        sampler = SolidSampler(spec, spec.travel, back, run)
    except GeometryError as error:
        message = f"the part cannot be meshed: {error}; look at analysis.solid.mesh and mechanism.part"
        return Result(spec, Status.NO_EQUILIBRIUM, message)
    found = result_of(solve(spec, made, sampler))
    return replace(found, warnings=(*found.warnings, *_findings(spec, sampler)))


def _findings(spec: VcfmSpec, sampler: SolidSampler) -> Iterator[Finding]:
    if (spec.mechanism.part or CutPart()).fillet == 0:
        told = "without fillets the stress in inside corners has no value"
        yield finding("sharp_corners", told, "mechanism.part.fillet=0.5 mm")
    force, stress = sampler.mesh_differences.values()
    if (force or 0.0) > FORCE_APART or (stress or 0.0) > STRESS_APART:
        yield finding(
            "mesh_coarse",
            f"two meshes differ by {100 * (force or 0.0):.2g} % in force and {100 * (stress or 0.0):.2g} % in stress: "
            "give a smaller analysis.solid.mesh",
        )
