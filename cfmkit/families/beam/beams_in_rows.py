"""Many beam mechanisms as rows of curves: those of one topology whose paths go straight on are looked at together.

Each path is traced as that of one mechanism is, so that a row is what a run of its own would be. What is asked of the
rows, efforts between points, stresses and metrics, is computed for all of them at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica import PathStatus
from cfmkit.elastica.results.paths_of_designs import PathsOfDesigns
from cfmkit.errors import CfmError
from cfmkit.families.beam.findings import rules_of
from cfmkit.families.beam.model import kind_of, solve
from cfmkit.families.beam.scalar_results import SCALAR_QUANTITIES, target_of
from cfmkit.families.beam.solution import Solution
from cfmkit.families.beam.tip_on_uneven_surface import TIP_DEFINITIONS as OF_SURFACES
from cfmkit.families.end_stops import CONTACT_QUANTITIES
from cfmkit.families.rows import ScalarQuantity, SeveralSolutions, SolvedRows, each_quantity, each_rule, or_nan
from cfmkit.metrics import split_name
from cfmkit.metrics.metrics_of_rows import CurveRows, RowSamples, StressRows
from cfmkit.numerics.one_blas_thread import one_blas_thread

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.results.between_points import BetweenPoints
    from cfmkit.families.beam.spec import BeamSpec

ROWS_TOGETHER = 64  # mechanisms that are looked at together: their unknowns at 200 points take 20 MB
ROW_COLUMNS = {name: each_quantity(quantity) for name, quantity in SCALAR_QUANTITIES.items()} | {
    split_name(name)[0]: ScalarQuantity[SeveralSolutions[Solution]](*about, lambda _: np.nan)
    for name, about in (OF_SURFACES | CONTACT_QUANTITIES).items()
}
"""What studies may ask of rows; mechanisms that follow a surface, or that may touch something, are none."""


@dataclass(frozen=True, eq=False)
class BeamRows:
    """Mechanisms of one kind (`cfmkit.families.rows.RowsSolution`)."""

    each: Sequence[Solution]

    def __len__(self) -> int:
        """Return the number of mechanisms."""
        return len(self.each)

    @cached_property
    def _laws(self) -> list[BetweenPoints]:
        return [law for solution in self.each if (law := solution.model_between_points) is not None]

    @cached_property
    def branches(self) -> Mapping[str, CurveRows]:
        """The curve of each mechanism."""
        each, paths = self.each, PathsOfDesigns(self._laws)
        paths.solve_knots()
        pose = np.array([or_nan(solution.spec.analysis.reference) for solution in each])
        allowable = np.array([or_nan(solution.assembly.allowable_stress) for solution in each])
        curves = CurveRows(
            _samples(each),
            lambda: _pad_rows([law.places for law in self._laws]),
            paths.effort,
            np.array([or_nan(solution.effort_error) for solution in each]),
            np.array([or_nan(target_of(solution)) for solution in each]),
            np.array([solution.spec.analysis.band for solution in each]),
            (np.array([solution.motion[0] for solution in each]), np.array([solution.motion[-1] for solution in each])),
            self._part_efforts,
            StressRows(tuple, self._stress_at, allowable, paths.largest_stress),
            kind_of(each[0]),
            None if np.isnan(pose).any() else pose,
            _pad_rows([law.peaks for law in self._laws], np.nan),
            traced=True,
        )
        return {"load": curves}

    def _stress_at(self, places: FloatArray, rows: Any) -> FloatArray:
        return np.array([self._laws[row].stress("", row_places) for row, row_places in zip(rows, places, strict=True)])

    def _part_efforts(self, places: FloatArray) -> FloatArray:
        return np.array(
            [solution.part_efforts("", row_places) for solution, row_places in zip(self.each, places, strict=True)]
        )


def _pad_rows(rows: Sequence[FloatArray], behind: float | None = None) -> FloatArray:
    """Return rows of different lengths as one array, filled up with a value; None: with the last of each."""
    most = max(map(len, rows))
    return np.array([np.append(row, np.full(most - len(row), row[-1] if behind is None else behind)) for row in rows])


def _samples(each: Sequence[Solution]) -> RowSamples:
    count = np.array([len(solution.motion) for solution in each])
    return RowSamples(
        _pad_rows([solution.motion for solution in each]), _pad_rows([solution.effort for solution in each]), count
    )


@one_blas_thread
def _solutions(specs: Sequence[BeamSpec], indices: range) -> dict[int, Solution]:
    """Return the solutions of those of some mechanisms whose paths go straight on, by their index."""
    solutions: dict[int, Solution] = {}
    for index in indices:
        try:
            if not _may_go_straight_on(specs[index]):
                continue
            solution = solve(specs[index])
        except CfmError:  # its own analysis says what is wrong with it
            continue
        path, law = solution.path, solution.model_between_points
        quiet = path.status is PathStatus.COMPLETE and not path.events and not path.unstable.any()
        if quiet and law is not None and solution.accurate.all():
            solutions[index] = solution
    return solutions


def _may_go_straight_on(spec: BeamSpec) -> bool:
    """Return False for what is no curve over an increasing motion, or more than that; with contacts it has corners."""
    analysis, by_motion = spec.analysis, spec.mechanism.drive.by_motion
    if spec.mechanism.has_contacts:
        return False
    plain = analysis.surface is None and getattr(spec, "target_curve", None) is None and not analysis.through_folds
    return plain and by_motion and spec.fidelity != "solid" and spec.extent > 0 and not analysis.imperfection


def _kind(solution: Solution) -> Hashable:
    """Return what mechanisms that are looked at together have in common."""
    path, analysis = solution.path, solution.spec.analysis
    stated = analysis.reference is None, solution.assembly.allowable_stress is None
    arrays = path.mesh.degree, path.mesh.elements.unknowns.tobytes(), tuple(path.network.beams)
    return *arrays, kind_of(solution), solution.spec.stress, *stated


def solve_rows(specs: Sequence[BeamSpec]) -> Iterator[tuple[NDArray[np.intp], SolvedRows[BeamRows]]]:
    """Yield (indices, mechanisms that are looked at together) of those whose paths go straight on."""
    for start in range(0, len(specs), ROWS_TOGETHER):
        alike: dict[Hashable, dict[int, Solution]] = {}
        for index, solution in _solutions(specs, range(start, min(start + ROWS_TOGETHER, len(specs)))).items():
            alike.setdefault(_kind(solution), {})[index] = solution
        for members in alike.values():
            solved = BeamRows(tuple(members.values()))
            rules = [each_rule(rule) for rule in rules_of(solved.each[0])]
            yield (
                np.array(list(members)),
                SolvedRows(solved, ROW_COLUMNS, rules, np.ones(len(members), bool), traced=True),
            )
