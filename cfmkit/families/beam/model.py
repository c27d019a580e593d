"""Analysis of beam mechanisms: paths of equilibria, stresses, forces of each beam; one alone, or many as rows.

Beams bend without stretching unless the specification says otherwise [Lan]; with stretching and shear they follow
Reissner. The force is that of all copies together; the forces of single beams are those of one copy. A curve with
hysteresis has branch `load` of the forward travel and branch `unload` of the return.

Mechanisms of one topology whose motion only increases along the path become rows. Each path is traced as that of one
mechanism is, so that a row is what a run of its own would be; efforts between points, stresses and metrics are computed
for all rows at once.

[Lan] C.-C. Lan, J.-H. Wang, Y.-H. Chen, A compliant constant-force mechanism for adaptive robot end-effector
operations (2010), sec. 2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import LazyMapping, LazySequence, read_only
from cfmkit.curves import Column, Curve
from cfmkit.elastica import Path, PathStatus, trace
from cfmkit.elastica.model.beam_fits import BeamFits, coils
from cfmkit.elastica.results.paths_of_designs import PathsOfDesigns
from cfmkit.errors import CfmError, InputError
from cfmkit.families.beam.constant_force_range_and_extremes import travel_of
from cfmkit.families.beam.contact_spec import has_friction
from cfmkit.families.beam.contacts import contact_columns, contact_values, refuse_overlap_at_rest
from cfmkit.families.beam.findings import findings_of, rules_of
from cfmkit.families.beam.network_elements_spec import LoadsDrive
from cfmkit.families.beam.network_from_spec import Assembly, assemble, resolve, thickest_of
from cfmkit.families.beam.path_ending import add_units, distance, ending_of, ways_to_supports
from cfmkit.families.beam.scalar_results import SCALAR_QUANTITIES, natural_frequencies, target_of
from cfmkit.families.beam.solution import END_FORCES, Solution, columns_of, output_columns
from cfmkit.families.beam.tip_on_uneven_surface import TIP_DEFINITIONS as OF_SURFACES
from cfmkit.families.beam.tip_on_uneven_surface import add_surface
from cfmkit.families.end_stops import CONTACT_QUANTITIES
from cfmkit.families.rows import (
    ScalarQuantity,
    SeveralSolutions,
    SolvedRows,
    each_quantity,
    each_rule,
    or_nan,
    values_of_one,
)
from cfmkit.metrics import split_name
from cfmkit.metrics.curve_rows import CurveRows, RowSamples, StressRows
from cfmkit.numerics.one_blas_thread import one_blas_thread
from cfmkit.results import Result, Status
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.model.network import Network
    from cfmkit.elastica.results.between_points import BetweenPoints
    from cfmkit.families.beam.solution import LazyColumns
    from cfmkit.families.beam.spec import BeamSpec
    from cfmkit.families.run_control import Run


_MAX_TRAVEL_RATIO = 3.0  # travel in lengths from the driven node to a support: these are at least twice as long then
_COIL_PLACES = np.linspace(0.0, 1.0, 1001)  # where a coil's radius is looked at: a polynomial of few terms


@one_blas_thread
def analyze(spec: BeamSpec, _run: Run) -> Result:
    """Return the force-displacement path of a beam mechanism, with everything that is wrong with it.

    PARTIAL if the path ends before what was asked, NO_EQUILIBRIUM if there is none under the constant loads.
    """
    solution, resolved = solve(spec), resolve(spec)
    if len(solution.keep) < 2:
        message = f"no curve: {ending_of(solution).message}"
        return Result(resolved, Status.NO_EQUILIBRIUM, message, warnings=tuple(findings_of(solution)))
    status, message = Status.COMPLETE, ""
    if solution.path.status is not PathStatus.COMPLETE:
        status, message = Status.PARTIAL, ending_of(solution).message
    result = Result(
        spec=resolved,
        status=status,
        message=message,
        curves=(_curve(solution),),
        values=values_of_one(SCALAR_QUANTITIES, solution) | contact_values(solution),
        warnings=LazySequence(partial(findings_of, solution)),
        travel=travel_of(solution),
        target=target_of(solution),
        reference=None if spec.analysis.reference is None else float(spec.analysis.reference),
        allowable_stress=solution.assembly.allowable_stress,
        closed=solution.model_between_points if solution.back is None else equilibria_of_both_branches(solution),
        winding=solution.winding,
        ends=_ends(solution),
        effort_error=solution.effort_error,
        part_efforts=None if isinstance(spec.mechanism.drive, LoadsDrive) else solution.part_efforts,
        state=solution,
    )
    return add_surface(result, solution)


def solve(spec: BeamSpec) -> Solution:
    """Return the path of a mechanism as its specification asks for it."""
    assembly = assemble(spec)
    _refuse_tight_coils(assembly)
    _refuse_torn_beams(assembly)
    refuse_overlap_at_rest(assembly)
    if not has_friction(spec.mechanism):
        path = trace(assembly.network, assembly.drive(), assembly.control())
        return Solution(assembly, path, *_keep_points(assembly, path))
    drive = assembly.drive()
    loading_and_unloading = replace(drive, points=np.concatenate([drive.points, drive.points[-2::-1]]))
    both = trace(assembly.network, loading_and_unloading, assembly.control())
    load, unload = split_at_reversal(both, len(drive.points))
    back = None if unload is None else Solution(assembly, unload, *_keep_points(assembly, unload))
    return Solution(assembly, load, *_keep_points(assembly, load), back)


def _refuse_tight_coils(assembly: Assembly) -> None:
    """Refuse coils that are wound more tightly than strips of their thickness can be: the inside would have no length.

    Thousands of steps would be needed to follow them.
    """
    network = assembly.network
    wound = [name for name, beam in network.beams.items() if coils(beam)]
    fits = BeamFits(network) if wound else {}
    for name in wound:
        turns = np.abs(np.diff(fits[name].angle(_COIL_PLACES, 0.5))) / np.diff(_COIL_PLACES)
        radius, thick = float(fits[name].length / turns.max()), thickest_of(network.beams[name].section)
        if radius < 0.5 * thick:
            raise InputError(
                f"mechanism.beams.{name}.shape winds the beam to a radius of {format_short(radius, 'length')}, less "
                f"than half of its thickness of {format_short(thick, 'length')}; use fewer turns or a thinner beam"
            )


def _refuse_torn_beams(assembly: Assembly) -> None:
    """Refuse a travel that only beams of several times their length could follow: no law of a material holds there.

    So taut beams would need thousands of segments, and minutes for every solution.
    """
    spec, network = assembly.spec, assembly.network
    drive, travel = spec.mechanism.drive, spec.analysis.travel
    if not drive.is_displacement or travel is None:
        return
    # each of several stages makes its share of the travel
    most = _MAX_TRAVEL_RATIO * spec.mechanism.layers
    straight = {name: distance(network, beam.start, beam.end) for name, beam in network.beams.items()}
    if abs(spec.extent) <= most * _way_to_support(network, drive.node, straight):
        return
    lengths = {name: fit.length for name, fit in BeamFits(network).items()}
    length = _way_to_support(network, drive.node, lengths)
    if abs(spec.extent) > most * length:
        raise InputError(
            f"analysis.travel of {format_short(spec.extent, 'length')} would stretch beams to more than twice their "
            f"length: from {drive.node!r} to a node that is held they are {format_short(length, 'length')} long; "
            f"a travel of at most {format_short(most * length, 'length')} is possible"
        )


def _way_to_support(network: Network, node: str, lengths: Mapping[str, float]) -> float:
    """Return the length of beams and links from a node to the nearest one that is held in place [m]; else infinity."""
    moved = {name: math.hypot(*at.support.displacement[:2]) for name, at in network.nodes.items()}
    ways = ways_to_supports(network, node, lengths)
    return min((length + moved[name] for name, length in ways.items()), default=math.inf)


def _keep_points(assembly: Assembly, path: Path) -> tuple[Any, Any]:
    """Return which points make the curve, and those where windows end between them.

    The curve has those requested, or all where folds may make it many-valued.
    """
    spec = assembly.spec
    if spec.analysis.through_folds or not spec.mechanism.drive.by_motion:
        keep = np.arange(len(path)) if spec.analysis.through_folds else _with_contacts(path, path.at_requested)
        return read_only(keep, np.int64), read_only(np.empty(0), np.int64)
    on_curve = assembly.on_curve[path.requested[path.at_requested]]
    keep = _with_contacts(path, path.at_requested[on_curve])
    between = sorted(set(path.at_requested[~on_curve].tolist()) - set(keep.tolist()))  # setdiff1d imports numpy.ma
    return read_only(keep, np.int64), read_only(np.array(between, dtype=np.int64), np.int64)


def _with_contacts(path: Path, points: Any) -> Any:
    """Return points of a path together with those at which a contact begins or ends."""
    return np.union1d(points, np.flatnonzero(path.changes_contact)) if path.contact_events else points


def _curve(solution: Solution) -> Curve:
    """Return the curve with stresses and the forces of each beam; with friction also of the way back."""
    branches = [solution] if solution.back is None else [solution, solution.back]
    curves = [_curve_of(branch, _columns(branch), branch.stable) for branch in branches]
    return curves[0] if len(curves) == 1 else join_branches(*curves)


def _columns(solution: Solution) -> LazyColumns:
    path, outputs = solution.path, solution.spec.analysis.outputs
    columns = {
        "max_stress": lambda: Column(solution.stress, "stress"),
        "stress_beam": lambda: Column(solution.stress_at[0], "text"),
        "stress_place": lambda: Column(solution.stress_at[1], "ratio"),
        "path": lambda: Column(_branches(solution), "text"),
    }
    for name in path.network.beams:
        columns |= columns_of(name, solution.beam_force, END_FORCES)
    columns |= output_columns(
        outputs, lambda name: path.motion(name)[solution.keep], lambda name: path.reaction(name)[solution.keep]
    )
    columns |= contact_columns(solution)
    if outputs.cross_stiffness:
        columns["cross_stiffness"] = lambda: Column(solution.cross_stiffness, "stiffness")
    if isinstance(solution.spec.mechanism.drive, LoadsDrive):
        columns["load_factor"] = lambda: Column(path.drive[solution.keep], "factor")
    if solution.spec.analysis.modes and solution.assembly.masses() is not None:
        columns |= _frequencies(solution)
    return columns


def _curve_of(solution: Solution, columns: LazyColumns, stable: Any) -> Curve:
    """Return a curve with columns that are computed when they are read."""
    extra = LazyMapping(columns, lambda name: columns[name]())
    kind = solution.spec.mechanism.drive.effort_dimension
    return Curve(solution.motion, solution.effort, "load", stable, extra, kind)  # type: ignore[arg-type]


def _ends(solution: Solution) -> Curve | None:
    """Return the points at which windows end between those of the curve, with their stress; None without any."""
    if not len(solution.ends):
        return None
    ends_only = replace(solution, keep=solution.ends)
    stress: LazyColumns = {"max_stress": lambda: Column(ends_only.stress, "stress")}
    return _curve_of(ends_only, stress, np.array(ends_only.accurate))


def _frequencies(solution: Solution) -> LazyColumns:
    """Return the natural frequencies that were requested: empty where a pose is not stable, or not accurate."""

    def column(mode: int, hold: str) -> Column:
        return Column(natural_frequencies(solution)[hold][:, mode], "frequency")

    modes = range(solution.spec.analysis.modes)
    return {f"frequency_{k + 1}_{hold}": partial(column, k, hold) for k in modes for hold in ("held", "free")}


def _branches(solution: Solution) -> Any:
    """Return the name of the branch at every point, with units."""
    names = solution.path.branch[solution.keep]
    reported = {name: add_units(solution.assembly, name) for name in sorted(set(names.tolist()))}
    return read_only(np.array([reported[name] for name in names.tolist()]), np.str_)


SAME_PLACE = 1e-9  # share of the range within which an event is at a point


def split_at_reversal(path: Path, count: int) -> tuple[Path, Path | None]:
    """Return the path up to the last of `count` requested values, and the rest, the return; None if it ends before."""
    turns = np.flatnonzero(path.requested == count - 1)
    if not len(turns) or turns[0] == len(path) - 1:
        return path, None
    turn, last = int(turns[0]), len(path)
    places = list(_points_of_events(path))
    events = path.contact_events
    load, unload = path.take(np.arange(turn + 1)), path.take(np.arange(turn, last))
    # what is requested on the way back is numbered as on the way there
    numbers = np.where(unload.requested >= count, 2 * (count - 1) - unload.requested, unload.requested)
    before, after = (
        [events[k] for k, point in enumerate(places) if (point < turn) is early] for early in (True, False)
    )
    load = replace(load, contact_events=tuple(before))
    return load, replace(unload, contact_events=tuple(after), requested=read_only(numbers, np.int64))


def _points_of_events(path: Path) -> Iterator[int]:
    """Yield the point at which each event of a contact is."""
    marked, number = np.flatnonzero(path.changes_contact), 0
    for event in path.contact_events:
        same_place = SAME_PLACE * float(np.ptp(path.drive))
        while number < len(marked) - 1 and abs(path.drive[marked[number]] - event.drive) > same_place:
            number += 1
        yield int(marked[number])


def join_branches(load: Curve, unload: Curve) -> Curve:
    """Return one curve of both branches, in the order in which the mechanism goes through them."""

    def column(name: str) -> Column:
        loading, unloading = load.extra[name], unload.extra[name]
        return Column(np.concatenate([loading.values, unloading.values]), loading.dimension)

    return Curve(
        np.concatenate([load.motion, unload.motion]),
        np.concatenate([load.effort, unload.effort]),
        np.repeat(["load", "unload"], [len(load.motion), len(unload.motion)]),
        np.concatenate([load.stable, unload.stable]),
        LazyMapping(load.extra, column),
        load.kind,
    )


def equilibria_of_both_branches(solution: Solution) -> BothBranches | None:
    """Return the equilibria between the points of both branches; None unless both cover the same motion."""
    loading = solution.model_between_points
    unloading = None if solution.back is None else solution.back.model_between_points
    if loading is None or unloading is None:
        return None
    first, second = (np.array([branch.own_points[0], branch.own_points[-1]]) for branch in (loading, unloading))
    same = np.allclose(first, second, rtol=0, atol=1e-12)
    return BothBranches({"load": loading, "unload": unloading}) if same else None


@dataclass(frozen=True, eq=False)
class BothBranches:
    """Effort and stress of both branches at every place (a `cfmkit.results.ClosedForm`)."""

    ways: dict[str, BetweenPoints]

    @property
    def places(self) -> FloatArray:
        """The points of both branches, and extremes between them, increasing [m or rad]."""
        return np.unique(np.concatenate([branch.places for branch in self.ways.values()]))

    @property
    def peaks(self) -> FloatArray:
        """Places of extremes of the effort between two points, and of corners, (m,) [m or rad]."""
        return np.unique(np.concatenate([branch.peaks for branch in self.ways.values()]))

    def effort(self, branch: str, places: FloatArray, /) -> FloatArray:
        """Return the effort of a branch at places of any shape [N or N m]."""
        return self.ways[branch].effort(branch, places)

    def stress(self, branch: str, places: FloatArray, /) -> FloatArray:
        """Return the largest stress of a branch at places of any shape [Pa]."""
        return self.ways[branch].stress(branch, places)


ROWS_TOGETHER = 64  # mechanisms that are looked at together: their unknowns at 200 points take 20 MB
ROW_COLUMNS = {name: each_quantity(quantity) for name, quantity in SCALAR_QUANTITIES.items()} | {
    split_name(name)[0]: ScalarQuantity[SeveralSolutions[Solution]](*about, lambda _: np.nan)
    for name, about in (OF_SURFACES | CONTACT_QUANTITIES).items()
}
"""What studies may ask of rows; mechanisms that follow a surface, or that may touch something, are none."""


@dataclass(frozen=True, eq=False)
class BeamRows:
    """Mechanisms of one kind (`cfmkit.families.rows.RowsSolution`)."""

    solutions: Sequence[Solution]

    def __len__(self) -> int:
        """Return the number of mechanisms."""
        return len(self.solutions)

    @cached_property
    def _laws(self) -> list[BetweenPoints]:
        return [law for solution in self.solutions if (law := solution.model_between_points) is not None]

    @property
    def branches(self) -> Mapping[str, CurveRows]:
        """The curve of each mechanism."""
        solutions, paths = self.solutions, PathsOfDesigns(self._laws)
        motions = [solution.motion for solution in solutions]
        paths.solve_knots()
        pose = np.array([or_nan(solution.spec.analysis.reference) for solution in solutions])
        allowable = np.array([or_nan(solution.assembly.allowable_stress) for solution in solutions])
        samples = RowSamples(
            _pad_rows(motions),
            _pad_rows([solution.effort for solution in solutions]),
            np.array([len(motion) for motion in motions]),
        )
        curves = CurveRows(
            samples,
            lambda: _pad_rows([law.places for law in self._laws]),
            paths.effort,
            np.array([or_nan(solution.effort_error) for solution in solutions]),
            np.array([or_nan(target_of(solution)) for solution in solutions]),
            np.array([solution.spec.analysis.band for solution in solutions]),
            (np.array([motion[0] for motion in motions]), np.array([motion[-1] for motion in motions])),
            self._part_efforts,
            StressRows(tuple, self._stress_at, allowable, paths.largest_stress),
            solutions[0].spec.mechanism.drive.effort_dimension,
            None if np.isnan(pose).any() else pose,
            _pad_rows([law.peaks for law in self._laws], np.nan),
            traced=True,
        )
        return {"load": curves}

    def _stress_at(self, places: FloatArray, rows: Any) -> FloatArray:
        return np.array([self._laws[row].stress("", row_places) for row, row_places in zip(rows, places, strict=True)])

    def _part_efforts(self, places: FloatArray) -> FloatArray:
        return np.array(
            [solution.part_efforts("", row_places) for solution, row_places in zip(self.solutions, places, strict=True)]
        )


def _pad_rows(rows: Sequence[FloatArray], behind: float | None = None) -> FloatArray:
    """Return rows of different lengths as one array, filled up with a value; None: with the last of each."""
    most = max(map(len, rows))
    return np.array([np.append(row, np.full(most - len(row), row[-1] if behind is None else behind)) for row in rows])


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
    plain = analysis.surface is None and spec.target_curve is None and not analysis.through_folds
    return plain and by_motion and spec.fidelity != "solid" and spec.extent > 0 and not analysis.imperfection


def _kind(solution: Solution) -> Hashable:
    """Return what mechanisms that are looked at together have in common."""
    path, analysis = solution.path, solution.spec.analysis
    stated = analysis.reference is None, solution.assembly.allowable_stress is None
    elements = path.mesh.elements
    absent = tuple(table is None for table in elements)  # of beams that are not wide, or do not stretch
    arrays = path.mesh.degree, elements.unknowns.tobytes(), tuple(path.network.beams), absent
    return *arrays, solution.spec.mechanism.drive.turns, solution.spec.stress, *stated


def solve_rows(specs: Sequence[BeamSpec]) -> Iterator[tuple[NDArray[np.intp], SolvedRows[BeamRows]]]:
    """Yield (indices, mechanisms that are looked at together) of those whose paths go straight on."""
    for start in range(0, len(specs), ROWS_TOGETHER):
        alike: dict[Hashable, dict[int, Solution]] = {}
        for index, solution in _solutions(specs, range(start, min(start + ROWS_TOGETHER, len(specs)))).items():
            alike.setdefault(_kind(solution), {})[index] = solution
        for members in alike.values():
            solved = BeamRows(tuple(members.values()))
            rules = [each_rule(rule) for rule in rules_of(solved.solutions[0])]
            rows = SolvedRows(solved, ROW_COLUMNS, rules, np.ones(len(members), bool), traced=True)
            yield np.array(list(members)), rows
