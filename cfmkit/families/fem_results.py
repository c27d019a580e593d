"""Results of a part that is solved as a solid: errors of the mesh, and each fillet's stress over that of beams there.

Scalar results are errors of the mesh and the stress concentration; `fillets.csv` has a row for each fillet.

As handbooks do it for shoulders, the nominal stress of a fillet is that of the beam's section where the fillet ends
on the beam: bending and axial stress at the edge on which it ends. Here the beams are in large deflection, at the
displacement at which the solid's stress in the fillet is largest. Of two sections, on two beams, the more stressed one
counts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.curves import Column
from cfmkit.families.findings import describe_wide_part
from cfmkit.families.rows import with_values
from cfmkit.results import Quantity, Result, Status
from cfmkit.tables import Table, TableColumn, border_column

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Displacement, Network, Path, Rotation
    from cfmkit.elastica.model.beam import Beam
    from cfmkit.elastica.results.beam_states import BeamSections as Sections
    from cfmkit.errors import GeometryError
    from cfmkit.families.findings import Finder
    from cfmkit.results import Finding
    from cfmkit.solid.adaptive_solution import MeshError
    from cfmkit.solid.meshed_part import MeshSolution
    from cfmkit.solid.path_following import PosePath
    from cfmkit.solid.stress_along_fillets import FilletArc
    from cfmkit.specs.spec import Spec

SpecT = TypeVar("SpecT", bound="Spec")


FEM_DEFINITIONS = {
    "mesh_force_difference": (
        "ratio",
        "largest difference of the force on the first two meshes, relative to the largest force",
    ),
    "mesh_stress_difference": (
        "ratio",
        "largest difference of a pose's largest stress on the first two meshes, relative to the largest of all poses",
    ),
    "mesh_force_error": (
        "ratio",
        "error of the force, relative to the largest force: what is left of the difference of two meshes on the last "
        "one, by the order of convergence, and `curve_error`; more than `analysis.solid.error` only where "
        "`mesh_coarse` warns",
    ),
    "mesh_stress_error": (
        "ratio",
        "discretisation error of the largest stress, relative to it: `mesh_stress_difference`, at least 3 %",
    ),
    "curve_error": (
        "ratio",
        "difference between the interpolated curve and poses solved between its poses, where it is expected to be "
        "largest, relative to the largest force; poses are added, up to twice as many, until it is at most a fifth "
        "of `analysis.solid.error`",
    ),
    "stress_concentration_max": (
        "factor",
        "largest stress of a fillet over that of beams in large deflection at the same displacement: bending and axial "
        "stress of the section where the fillet ends, at its edge; of the fillets where that is at least a tenth of "
        "the beams' largest",
    ),
}
"""Name -> dimension and definition; computed by `solid.adaptive_solution` and `nominal_stresses`."""


@dataclass(frozen=True, eq=False)
class FilletRow:
    """One fillet with its largest stress."""

    place: str  # what it joins, by names of the specification
    arc: FilletArc
    stress: float  # largest in the window, tension positive [Pa]
    motion: float  # where it occurs [m or rad]
    preload: float | None = None  # at which it occurs [m], of springs that are preloaded
    # stress of beams at the end of the fillet there [Pa], see `nominal_stresses`; NaN where there is none
    nominal: float = math.nan

    @property
    def concentration(self) -> float:
        """Stress over that of beams; NaN where that is not known."""
        return abs(self.stress / self.nominal)


def remove_frame(spec: SpecT, frame: Sequence[FloatArray], pads: Sequence[FloatArray]) -> SpecT:
    """Return what bends of a part: without the frame around it, which stands, and the holes in that."""
    from cfmkit.export.ground_frame import find_outside

    holes = spec.mechanism.part.holes  # type: ignore[attr-defined]
    kept = find_outside([hole.at for hole in holes], frame, pads)
    left = tuple(hole for hole, keep in zip(holes, kept, strict=True) if keep)
    return with_values(spec, {"mechanism.part.frame.ground": None, "mechanism.part.holes": left})


def drop_repeats(travels: FloatArray, end: float) -> FloatArray:
    """Return travels in increasing order, without those that are the one before but for rounding."""
    places = np.unique(travels)
    return np.delete(places, np.flatnonzero(np.diff(places) < 1e-9 * abs(end)) + 1)


def not_meshed(spec: Spec, error: GeometryError) -> Result:
    """Return the result of a part that has no mesh."""
    return Result(spec, Status.NO_EQUILIBRIUM, f"the part cannot be meshed: {error}; check mechanism.part")


def stress_between_poses(solved: MeshSolution, motion: FloatArray) -> FloatArray:
    """Return the largest stress along a free edge [Pa]; between poses by cubics that stay between their values."""
    from scipy.interpolate import PchipInterpolator

    rising = np.argsort(solved.course.travel)
    cubics = PchipInterpolator(solved.course.travel[rising], solved.peaks[0][rising])
    return read_only(np.maximum(cubics(motion), 0.0))  # at rest rounding may be below


def stable_between_poses(course: PosePath, motion: FloatArray) -> NDArray[np.bool_]:
    """Return whether the last pose up to each point of a curve is stable."""
    before = np.searchsorted(np.abs(course.travel), np.abs(motion) * (1 + 1e-12)) - 1
    return np.array([pose.unstable == 0 for pose in course.poses])[np.clip(before, 0, None)]


def columns_of_solid(course: PosePath, motion: FloatArray, stress: FloatArray, extent: float) -> dict[str, Column]:
    """Return the columns of largest stress, and of which points are poses that were solved."""
    solved = np.isclose(motion[:, None], course.solved_travel, rtol=0, atol=1e-9 * abs(extent)).any(axis=1)
    words = read_only(np.where(solved, "yes", "between"), np.str_)
    return {"max_stress": Column(stress, "stress"), "solved": Column(words, "text")}


def findings_of_mesh(
    finding: Finder, error: MeshError, sections: Iterable[tuple[float, float]], poisson: float, wide_beams: bool
) -> Iterator[Finding]:
    """Yield which errors of a mesh are too large, and which parts, of a width and a thickness [m], are too wide."""
    for name, reported in error.too_large():
        yield finding(name, reported)
    for width, thickness in sections:
        if reported := describe_wide_part(width, thickness, poisson, wide_beams):
            yield finding("wide_beam", reported)


def with_nominal(rows: Sequence[FilletRow], stresses: FloatArray) -> tuple[FilletRow, ...]:
    """Return rows with their nominal stresses (n,) [Pa]."""
    return tuple(replace(row, nominal=float(stress)) for row, stress in zip(rows, stresses, strict=True))


def largest_concentration(rows: Sequence[FilletRow]) -> dict[str, Quantity]:
    """Return the largest stress concentration of some fillets by its name, without a value where none has one."""
    largest = max((row.concentration for row in rows if not math.isnan(row.concentration)), default=None)
    name = "stress_concentration_max"
    return {name: Quantity(largest, *FEM_DEFINITIONS[name], "" if largest else "beams have no stress at any fillet")}


def number_fillets(rows: Sequence[FilletRow], before: int = 0) -> dict[int, FilletArc]:
    """Return fillets by their numbers in the table, where so many rows stand before them."""
    return {number: row.arc for number, row in enumerate(rows, start=before + 1)}


def fillet_table(rows: Sequence[FilletRow], motion: tuple[str, str] = ("displacement", "length")) -> Table:
    """Return the table, with the name and the dimension of the motion."""
    places = np.array([row.arc.middle for row in rows]).reshape(-1, 2)
    columns = [
        TableColumn("fillet", tuple(number_fillets(rows))),
        TableColumn("place", tuple(row.place for row in rows)),
        border_column("x", places[:, 0], "length"),
        border_column("y", places[:, 1], "length"),
        border_column("radius", np.array([row.arc.radius for row in rows]), "length"),
        border_column("max_stress", np.abs([row.stress for row in rows]), "stress"),
        border_column(motion[0], np.array([row.motion for row in rows]), motion[1]),
    ]
    if any(row.preload is not None for row in rows):
        preloads = [np.nan if row.preload is None else row.preload for row in rows]
        columns.append(border_column("preload", np.array(preloads), "length"))
    columns += [
        border_column("nominal_stress", np.abs([row.nominal for row in rows]), "stress"),
        border_column("stress_concentration", np.array([row.concentration for row in rows]), "factor"),
    ]
    return Table(tuple(columns))


MIN_STRESS_SHARE = 0.1
"""Nominal stresses below this part of the beams' largest at the same displacement are none: solid and beams differ by
some hundredths of the largest for other reasons, which would make a third of such a ratio."""
N_PATH_STEPS = 40  # of the beams' path beside the requested displacements: as dense as curves are
STEP_RTOL = 1e-6  # steps nearer to a requested displacement than this part of the largest are left out
PATH_TOLERANCE = 1e-6
"""Of the beams' path: far below what a mesh is off, and slender leaves reach it where they are pulled straight."""
CHORD_TOLERANCE = 0.02
"""How far a fillet may end from the edge of its beam, in thicknesses: what lines between the places of a curved beam
are off."""


def nominal_stresses(
    rows: Sequence[FilletRow],  # the fillets with the solid's stress
    travel: FloatArray,  # (n,): where the drive of the beams is then [m or rad]
    # from travels of one sign to the paths of the beams through them: two where beams may bend to either side
    images: Callable[[FloatArray], Iterable[Path]],
    # from points of the drawing (m, 2) to the network that was solved; a mirrored half may give twice as many [m]
    placed: Callable[[FloatArray], FloatArray],
) -> FloatArray:
    """Return the nominal stress of some fillets, (n,) [Pa], tension positive.

    NaN where no beam carries the fillet, the beams have no path, or the stress is negligible. Of two paths that one
    counts whose stresses have the solid's signs.
    """
    ratios = np.full(len(rows), np.nan)
    for sense in (1.0, -1.0):
        numbers = np.flatnonzero(sense * travel > 0.0).tolist()
        solid = np.array([rows[k].stress for k in numbers])
        reported = [
            np.array([beams.evaluate_stress(placed(rows[k].arc.ends), float(travel[k])) for k in numbers])
            for beams in (map(SolvedBeams, images(travel[numbers])) if len(numbers) else ())
        ]
        if reported:
            ratios[numbers] = max(reported, key=lambda stress: float(np.nansum(stress * solid)))
    return ratios


def both_images(
    network: Network, drive: Callable[[FloatArray], Displacement | Rotation], travel: FloatArray
) -> Iterator[Path]:
    """Yield the stable path of beams through travels of one sign [m or rad], and its mirror image if it bifurcates."""
    from cfmkit.elastica import Control, trace

    points = drive(with_steps(travel))
    path = trace(network, points, Control(tolerance=PATH_TOLERANCE))
    yield path
    if any(event.kind == "bifurcation" for event in path.events):
        yield trace(network, points, Control(tolerance=PATH_TOLERANCE, sign=-1))


def with_steps(travel: FloatArray) -> FloatArray:
    """Return some travels of one sign, each once, with steps between them and rest, in the order from rest on."""
    end = float(travel[np.abs(travel).argmax()])
    wanted = np.unique(travel / end)
    wanted = wanted[np.diff(wanted, prepend=-1.0) > STEP_RTOL]
    steps = np.arange(1, N_PATH_STEPS + 1) / N_PATH_STEPS
    apart = np.abs(steps[:, None] - wanted).min(axis=1) > STEP_RTOL
    return np.asarray(end * np.sort(np.concatenate([wanted, steps[apart]])))


@dataclass(frozen=True, eq=False)
class SolvedBeams:
    """Beams at the points of a path, whose stress is wanted at places on their edges."""

    path: Path

    @cached_property
    def axes(self) -> Mapping[str, FloatArray]:
        """Centre lines before any load, (k, 2) each [m]."""
        path = self.path
        return {name: path.shape(name, 0) - path.line_motion(name)[0] for name in path.network.beams}

    @cached_property
    def sections(self) -> Mapping[str, Sections]:
        """Stresses at the places of the centre lines, at all points."""
        return {name: self.path.sections(name) for name in self.path.network.beams}

    @cached_property
    def largest(self) -> FloatArray:
        """Largest stress of all beams at each point (n,) [Pa]."""
        return self.path.peak_stress().value

    def evaluate_stress(self, edge: FloatArray, travel: float) -> float:
        """Return the stress at points on edges of beams (m, 2) [m], of largest size [Pa]; NaN where it is negligible.

        At a travel of the drive [m or rad]; NaN where the path does not come to it, or no beam is at the points.
        """
        point = self._point(travel)
        if point is None:
            return float("nan")
        stresses = [
            stress
            for name, beam in self.path.network.beams.items()
            for place in edge
            if (stress := self._evaluate_edge_stress(name, beam, place, point)) is not None
        ]
        worst = max(stresses, key=abs, default=0.0)
        return worst if abs(worst) > MIN_STRESS_SHARE * float(self.largest[point]) else float("nan")

    def _point(self, travel: float) -> int | None:
        """Return the point of the path at a travel; None if there is none that is accurate."""
        requested = self.path.at_requested
        off = np.abs(self.path.drive[requested] - travel)
        if not len(requested) or off.min() > STEP_RTOL * float(np.abs(self.path.drive).max()):
            return None
        point = int(requested[off.argmin()])
        return point if self.path.accurate[point] else None

    def _evaluate_edge_stress(self, name: str, beam: Beam, place: FloatArray, point: int) -> float | None:
        """Return the stress of a beam at a place on its edge (2,) [m]; None if it is not on it."""
        axis, sections = self.axes[name], self.sections[name]
        k, share, off = _foot(axis, place)
        along_axis = (axis[k + 1] - axis[k]) / np.hypot(*(axis[k + 1] - axis[k]))
        along, aside = float(off @ along_axis), float(along_axis[0] * off[1] - along_axis[1] * off[0])
        middle = 0.5 * float(sections.place[point, k] + sections.place[point, k + 1])
        at = sections.place[point, k] + share * (sections.place[point, k + 1] - sections.place[point, k])
        thickness = float(np.real(beam.section.thickness_at(at, middle)))
        allowed = CHORD_TOLERANCE * thickness
        if abs(along) > allowed or abs(abs(aside) - 0.5 * thickness) > allowed:
            return None
        bending, axial = (
            float(values[point, k] + share * (values[point, k + 1] - values[point, k]))
            for values in (sections.bending_stress, sections.axial_stress)
        )
        return axial - float(np.sign(aside)) * bending


def _foot(axis: FloatArray, place: FloatArray) -> tuple[int, float, FloatArray]:
    """Return the chord of a line (k, 2) nearest to a place, the share of it there, and the way from it to the place."""
    start, chord = axis[:-1], np.diff(axis, axis=0)
    square = (chord**2).sum(axis=1)
    some: NDArray[np.bool_] = square > 0.0  # places where a beam's pieces meet are there twice
    share = np.where(some, ((place - start) * chord).sum(axis=1) / np.where(some, square, 1.0), 0.0).clip(0.0, 1.0)
    off = place - start - share[:, None] * chord
    nearest = int(np.where(some, np.hypot(*off.T), np.inf).argmin())
    return nearest, float(share[nearest]), off[nearest]
