"""A part on two meshes: the finer one's values, and how far they may be from those of an endlessly fine one.

Two meshes of a free mesher are not nested: their differences show no order, so nothing is extrapolated from them. What
they differ by, times a factor, is given as the error. The factors are read off parts that were solved a third time, on
much finer meshes (`benchmarks/solid_mesh_error.py`, table in docs/solid.md).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.numerics.one_blas_thread import one_blas_thread

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from cfmkit.solid.meshed_part import MeshSolution, Part

FORCE_FACTOR, STRESS_FACTOR = 1.4, 2.8
"""Errors in differences of the two meshes: 95 % of those of the 28 parts in docs/solid.md are below 1.1 and 2.0. These
are from when arcs were lines of 7 degrees, and are kept until more parts than those have been compared."""
FORCE_LEAST, STRESS_LEAST = 1e-4, 0.02
"""Differences count as these at least: two free meshes agree better by chance only. The leaf of `vcfm_ding2022` has
0.7 % between its meshes and 2 % of error in its stress."""
FORCE_ALLOWED, STRESS_ALLOWED = 3e-3, 0.14
"""Errors from which on a mesh is called coarse: those of differences of 2e-3 and 5 %."""


@dataclass(frozen=True)
class DrivenPart:
    """A part with what is needed to follow it.

    Attributes
    ----------
    name : str
        For files.
    part : Part
    size : float
        Side of an element of the finer mesh [m].
    stops : tuple of float
        Travels to solve for, from rest on in one direction [m or rad].
    """

    name: str
    part: Part
    size: float
    stops: tuple[float, ...]

    @one_blas_thread
    def solved(self, report: Callable[[float, str], None] = lambda _share, _text: None) -> TwoMeshes:
        """Return the part on both meshes, on the coarser one at every second stop.

        Raises
        ------
        cfmkit.errors.GeometryError
            If the outline cannot be meshed so, or no node is where the part is held.
        """
        from cfmkit.solid.meshed_part import COARSER, LEAST_ACROSS

        second = (*self.stops[:-1:2], self.stops[-1])
        # of sizes that leave the finer mesh no fewer elements across, the coarser one must not be the same mesh again
        limited = self.size * LEAST_ACROSS >= self.part.thinnest
        across = LEAST_ACROSS / COARSER if limited else LEAST_ACROSS
        coarse = self.part.meshed(COARSER * self.size, across).followed(
            second, lambda share: report(FIRST * share, "coarser mesh")
        )
        fine = self.part.meshed(self.size).densely(
            self.stops, lambda share: report(FIRST + (1 - FIRST) * share, "finer mesh")
        )
        return TwoMeshes(fine, coarse)


FIRST = 0.3
"""Share of the time that the coarser mesh takes."""


@dataclass(frozen=True, eq=False)
class TwoMeshes:
    """What was found on both.

    Attributes
    ----------
    fine : MeshSolution
        The one whose values are reported.
    coarse : MeshSolution
        With elements `COARSER` times as large.
    """

    fine: MeshSolution
    coarse: MeshSolution

    def no_curve(self, poses: int) -> str:
        """Return why one of the meshes has fewer poses than a curve needs; empty if none has."""
        short = (one.course.ended for one in (self.coarse, self.fine) if len(one.course.poses) < poses)
        return next(short, "")

    @property
    def error(self) -> MeshError:
        """What they differ by, and what it says."""
        return MeshError(*self.fine.differences(self.coarse), self.fine.between)


@dataclass(frozen=True)
class MeshError:
    """What two meshes of a part differ by.

    Attributes
    ----------
    force_difference, stress_difference : float
        In parts of the largest force and of the largest stress.
    between : float
        What the curve is off between poses, in parts of the largest force; NaN where that is not known.
    """

    force_difference: float
    stress_difference: float
    between: float = float("nan")

    @property
    def force(self) -> float:
        """Error of the force, in parts of the largest."""
        return FORCE_FACTOR * max(self.force_difference, FORCE_LEAST)

    @property
    def stress(self) -> float:
        """Error of the largest stress, in parts of it."""
        return STRESS_FACTOR * max(self.stress_difference, STRESS_LEAST)

    def values(self) -> dict[str, float | None]:
        """Return them by the names that every family gives them (`families.fem_results`)."""
        return {
            "mesh_force_difference": self.force_difference,
            "mesh_stress_difference": self.stress_difference,
            "mesh_force_error": self.force,
            "mesh_stress_error": self.stress,
            "curve_error": None if math.isnan(self.between) else self.between,
        }

    def worse(self, other: MeshError) -> MeshError:
        """Return the larger difference of both, each."""
        return MeshError(
            max(self.force_difference, other.force_difference),
            max(self.stress_difference, other.stress_difference),
            float(np.fmax(self.between, other.between)),
        )

    def too_large(self) -> Iterator[tuple[str, str]]:
        """Yield the name of a finding and what it says, where the mesh is too coarse."""
        if self.force > FORCE_ALLOWED or self.stress > STRESS_ALLOWED:
            yield (
                "mesh_coarse",
                f"by the difference of two meshes, the force is accurate to {100 * self.force:.2g} % and the largest "
                f"stress to {100 * self.stress:.2g} %: use a smaller analysis.solid.mesh",
            )
