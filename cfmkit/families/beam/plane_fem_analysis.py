"""Analysis of the part as drawn, a planar solid: force, stress per fillet, mesh error; its models for other FE solvers.

Assumes: plane stress; pads and what joins the moving pads of two halves are rigid from the root plane on, as in the
model of beams; an eye turns about its hole as one piece. No contact, no plasticity.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import ShortRepr, read_only
from cfmkit.curves import Column, Curve
from cfmkit.errors import GeometryError
from cfmkit.families.beam.constant_force_range_and_extremes import AlongMotion
from cfmkit.families.beam.finding_names import finding
from cfmkit.families.beam.network_from_spec import assemble, resolve
from cfmkit.families.beam.outline import drawing
from cfmkit.families.beam.part import drawn_fillet
from cfmkit.families.beam.scalar_results import EXTREME_METRICS, RANGE_METRICS, SCALAR_DEFINITIONS, number_of, target_of
from cfmkit.families.beam.solid_nodes_and_fillets import SolidNodes, fillets
from cfmkit.families.beam.solid_part import driven_part, ends_of_windows, load_of_drawn_leg, move_far_enough
from cfmkit.families.beam.solution import output_columns
from cfmkit.families.beam.tip_on_uneven_surface import N_PLACES, add_surface
from cfmkit.families.fem_results import (
    columns_of_solid,
    fillet_table,
    findings_of_mesh,
    largest_concentration,
    not_meshed,
    stable_between_poses,
    stress_between_poses,
)
from cfmkit.families.findings import sharp_inside
from cfmkit.results import Quantity, Result, Status, quantities
from cfmkit.specs.units import format_short, window_places
from cfmkit.stock.material_and_part_spec import usual_fillet

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.export.beam_deck_for_abaqus import DrivenNetwork
    from cfmkit.families.beam.network_from_spec import Assembly
    from cfmkit.families.beam.spec import BeamSpec
    from cfmkit.families.fem_results import FilletRow
    from cfmkit.families.run_control import Run
    from cfmkit.results import Finding
    from cfmkit.solid.adaptive_solution import AdaptiveSolution, DrivenPart, MeshError
    from cfmkit.solid.meshed_part import MeshSolution
    from cfmkit.solid.path_up_to_load import LoadPath
    from cfmkit.tables import Table


@dataclass(frozen=True, eq=False, repr=False)
class SolidSolution(ShortRepr):
    """A part that was solved."""

    assembly: Assembly  # the network that the part is drawn from
    solved: AdaptiveSolution
    # (n,) travel of the points of the curve [m or rad]
    motion: FloatArray = field(default_factory=lambda: np.zeros(0))
    reached: LoadPath | None = None  # how far a load leads that drives the part; None if its motion is given

    @property
    def spec(self) -> BeamSpec:
        """The specification; that of a part under a load has its motion instead."""
        return self.assembly.spec

    @property
    def end(self) -> float:
        """Requested end of the travel, or the reached one of a load [m or rad]."""
        return self.spec.extent if self.reached is None else self.reached.end

    @property
    def fine(self) -> MeshSolution:
        """The part on its mesh."""
        return self.solved.solution

    @property
    def copies(self) -> int:
        """Number of drawn parts that act side by side."""
        return self.spec.mechanism.legs

    @cached_property
    def effort(self) -> FloatArray:
        """Force [N] or torque [N m] at the points of the curve, of all parts: cubics between the poses."""
        return read_only(self.copies * self.fine.course.effort(self.motion))

    @cached_property
    def accurate(self) -> NDArray[np.bool_]:
        """Every point of the curve: no pose is kept that did not converge."""
        return np.ones(len(self.motion), bool)

    @cached_property
    def stress(self) -> FloatArray:
        """Largest stress along a free edge [Pa]."""
        return stress_between_poses(self.fine, self.motion)

    @cached_property
    def along(self) -> AlongMotion:
        """The curve along its motion."""
        return AlongMotion(self)

    @property
    def densely(self) -> SolidSolution:
        """The same at many points: what is found along a surface does not depend on how many rows a curve has."""
        return replace(self, motion=read_only(np.linspace(0.0, self.motion[-1], N_PLACES)))

    @cached_property
    def stable(self) -> NDArray[np.bool_]:
        """Whether the equilibrium of each point is stable; under a load also the drive gives way if its force falls."""
        stable = stable_between_poses(self.fine.course, self.motion)
        return stable if self.reached is None else stable & (self.fine.course.law().derivative()(self.motion) > 0.0)

    @property
    def effort_error(self) -> float:
        """Error of the mesh [N or N m]."""
        return self.error.force * float(np.abs(self.effort).max())

    @property
    def model_between_points(self) -> None:
        """Nothing: a pose between two of these takes seconds."""

    @property
    def stresses(self) -> Mapping[str, tuple[FloatArray, FloatArray]]:
        """Of the part, the largest stress [Pa] at every point of the curve, without a place on a beam: zero."""
        return {"part": (self.stress, np.zeros_like(self.stress))}

    @property
    def window(self) -> tuple[float, float]:
        """Range in which stress is judged, from the smaller end on [m or rad]; without a window the whole travel."""
        end, window = self.end, self.spec.analysis.window
        low, high = sorted((0.0, end) if window is None else window_places(window, (0.0, end)))
        return low, high

    @cached_property
    def worst(self) -> tuple[float, FloatArray] | None:
        """Largest stress of the poses in the window [Pa] and its place in the unloaded part (2,) [m]; None without any.

        Without a window over the whole travel.
        """
        travel, (low, high) = self.fine.course.travel, self.window
        slack = 1e-9 * abs(self.spec.extent)  # an end of the window is a pose, but for rounding
        inside = np.flatnonzero((travel >= low - slack) & (travel <= high + slack))
        if not len(inside):
            return None
        stresses, places = self.fine.peaks
        pose = inside[stresses[inside].argmax()]
        return float(stresses[pose]), places[pose]

    @cached_property
    def error(self) -> MeshError:
        """Errors of force and stress."""
        return self.solved.error

    @cached_property
    def fillets(self) -> tuple[FilletRow, ...]:
        """Stress fillet by fillet."""
        return fillets(self.assembly, self.fine, self.window)


def analyze(spec: BeamSpec, run: Run) -> Result:
    """Return the force-displacement curve of the part as drawn, with everything that is wrong with it.

    PARTIAL if the path ends before the travel, NO_EQUILIBRIUM if there is no first pose.
    """
    try:
        assembly, solved = _solve_part(spec, run)
    except GeometryError as error:
        return not_meshed(resolve(spec), error)
    if why := solved.no_curve(2):
        keys = ", ".join(f"mechanism.nodes.{name}.support" for name in spec.mechanism.nodes)
        message = f"no curve: {why}; check mechanism.drive, {keys}"
        return Result(resolve(spec), Status.NO_EQUILIBRIUM, message)
    by_load = spec.mechanism.drive.by_load
    solution = _solve_loaded_part(spec, assembly, solved) if by_load else _solve_moved_part(assembly, solved)
    message = _explain_ending(solution)
    if len(solution.motion) < 2:
        return Result(resolve(spec), Status.NO_EQUILIBRIUM, f"no curve: {message}")
    result = Result(
        spec=resolve(spec),
        status=Status.PARTIAL if message else Status.COMPLETE,
        message=message,
        curves=(_curve(solution),),
        values=_values(solution),
        warnings=tuple(_findings(solution)),
        travel=(0.0, solution.end),
        target=target_of(solution),
        reference=None if spec.analysis.reference is None else float(spec.analysis.reference),
        allowable_stress=assembly.allowable_stress,
        effort_error=solution.effort_error,
        tables={"fillets": partial(_fillet_table, solution)},
        state=solution,
    )
    return add_surface(result, solution.densely)


def _solve_part(spec: BeamSpec, run: Run) -> tuple[Assembly, AdaptiveSolution]:
    """Return the network that a part is drawn from and the part, moved far enough where a load drives it.

    Raises GeometryError if the part cannot be meshed.
    """
    if spec.mechanism.drive.by_load:
        spec = move_far_enough(spec, run.progress)
    assembly = assemble(spec)
    return assembly, driven_part(spec, assembly).solve(run.progress)


def _solve_moved_part(assembly: Assembly, solved: AdaptiveSolution) -> SolidSolution:
    """Return the points of the curve of a part that is moved: even ones, as far as its path leads."""
    spec, travel = assembly.spec, solved.solution.course.travel
    asked, forwards = np.linspace(0.0, spec.extent, spec.analysis.points), np.sign(spec.extent)
    reached = forwards * asked <= forwards * travel[-1] * (1 + 1e-12)
    return SolidSolution(assembly, solved, read_only(asked[reached]))


def _solve_loaded_part(spec: BeamSpec, assembly: Assembly, solved: AdaptiveSolution) -> SolidSolution:
    """Return the points of the curve of a part under a load: even loads, or an even travel through its maxima."""
    from cfmkit.solid.path_up_to_load import follow_to_load, travels_at, with_poses

    load, through = load_of_drawn_leg(spec), spec.analysis.through_folds
    fine, reached = follow_to_load(solved.solution, load, through)
    solved = replace(solved, solution=with_poses(fine, ends_of_windows(spec, reached.end)))
    if through:
        motion = read_only(np.linspace(0.0, reached.end, spec.analysis.points))
    else:
        motion = travels_at(fine.course, np.linspace(0.0, load, spec.analysis.points))
    return SolidSolution(assembly, solved, motion, reached)


def elastic_parts(spec: BeamSpec) -> tuple[DrivenPart, ...]:
    """Return what is solved of a mechanism, for decks of other solvers and for studies of meshes."""
    spec = spec.replace({"analysis.fidelity": "solid"})
    if spec.mechanism.drive.by_load:
        spec = move_far_enough(spec)
    return (driven_part(spec, assemble(spec)),)


def elastic_networks(spec: BeamSpec) -> tuple[DrivenNetwork, ...]:
    """Return the same as beams, for decks of other solvers; none where a node is turned that is free to move."""
    from cfmkit.elastica import Displacement, Rotation
    from cfmkit.export.beam_deck_for_abaqus import DrivenNetwork

    assembly = assemble(spec)
    drive = assembly.drive()
    if isinstance(drive, Rotation):
        support = assembly.network.nodes[drive.node].support
        return (DrivenNetwork("beams", assembly.network, drive),) if support.along and support.across else ()
    return (DrivenNetwork("beams", assembly.network, drive),) if isinstance(drive, Displacement) else ()


def _explain_ending(solution: SolidSolution) -> str:
    """Return why the curve ends early, and where; empty if it does not."""
    from cfmkit.solid.path_up_to_load import LoadEnd

    course, drive = solution.fine.course, solution.spec.mechanism.drive
    where = format_short(solution.end if solution.reached else float(course.travel[-1]), drive.motion_dimension)
    if solution.reached is not None and solution.reached.how is LoadEnd.MAXIMUM:
        largest = format_short(solution.copies * solution.reached.effort, drive.effort_dimension)
        reported = f"the part snaps at {largest}, at {where}: the load cannot grow further"
        return f"{reported}; follow the curve beyond its maximum (analysis.through_folds)"
    if course.ended:
        return f"{course.ended}, at {where}"
    if solution.reached is not None and solution.reached.how is LoadEnd.SHORT:
        return f"the part does not carry the load within {where}"
    return ""


def _curve(solution: SolidSolution) -> Curve:
    extra = columns_of_solid(solution.fine.course, solution.motion, solution.stress, solution.spec.extent)
    kind = solution.spec.mechanism.drive.effort_dimension
    return Curve(solution.motion, solution.effort, stable=solution.stable, extra=extra | _outputs(solution), kind=kind)


def _outputs(solution: SolidSolution) -> dict[str, Column]:
    """Return the motions and reactions that the specification names, of one copy."""
    nodes = SolidNodes(solution.assembly, solution.fine)
    columns = output_columns(
        solution.spec.analysis.outputs,
        lambda name: read_only(nodes.motion(name)(solution.motion)),
        lambda name: read_only(nodes.reaction(name)(solution.motion)),
    )
    return {name: compute() for name, compute in columns.items()}


def _fillet_table(solution: SolidSolution) -> Table:
    motion = ("angle", "angle") if solution.spec.mechanism.drive.turns else ("displacement", "length")
    return fillet_table(solution.fillets, motion)


def _values(solution: SolidSolution) -> Mapping[str, Quantity]:
    """Return the scalar results by name; None if the model does not know a value."""
    numbers: dict[str, float | None] = dict.fromkeys(SCALAR_DEFINITIONS) | {
        "allowable_stress": solution.assembly.allowable_stress,
        **solution.error.values(),
    }
    if solution.worst is not None:
        numbers["peak_stress_x"], numbers["peak_stress_y"] = solution.worst[1].tolist()
    if not solution.spec.mechanism.drive.turns:
        numbers |= {"travel_end": float(solution.motion[-1])} | _load_limit_values(solution)
        names = (*EXTREME_METRICS, *(RANGE_METRICS if solution.reached is None else ()))
        numbers |= {name: number_of(name, solution) for name in names}
        if solution.solved.critical_points:
            first = solution.solved.critical_points[0]
            numbers |= {
                "bifurcation_displacement": first.travel,
                "critical_force": solution.copies * first.effort,
                "critical_error": None if math.isnan(first.error) else first.error,
            }
    return quantities(SCALAR_DEFINITIONS, numbers) | largest_concentration(solution.fillets)


def _load_limit_values(solution: SolidSolution) -> dict[str, float | None]:
    """Return the first maximum of a load; nothing of parts that are moved."""
    from cfmkit.solid.path_up_to_load import LoadEnd, first_maximum

    reached, course = solution.reached, solution.fine.course
    if reached is None:
        return {}
    if reached.how is LoadEnd.MAXIMUM:
        return {"limit_force": solution.copies * reached.effort}
    sense = float(np.sign(reached.end))
    first = first_maximum(course, sense)
    law = course.law(sense)
    return {"limit_force": solution.copies * sense * float(law(first)) if first < law.x[-1] else None}


def _explain_sharp_corners(spec: BeamSpec) -> str:
    """Return what is wrong with fillets that the outline does not have; empty if it has them."""
    fillet = spec.mechanism.fillet
    if fillet > 0.0 == drawn_fillet(spec):
        radius = format_short(fillet, "length")
        return f"in the outline, fillets of {radius} are sharp corners: the stress there has no value"
    return sharp_inside(fillet, ())


def _findings(solution: SolidSolution) -> Iterator[Finding]:
    spec, course, drive = solution.spec, solution.fine.course, solution.spec.mechanism.drive
    if reported := _explain_ending(solution):
        yield finding("ends_early" if course.touching is None else "self_contact", reported)
    for point in solution.solved.critical_points:
        at = format_short(point.travel, drive.motion_dimension)
        load = format_short(solution.copies * point.effort, drive.effort_dimension)
        accuracy = "" if math.isnan(point.error) else f" (both within {100 * point.error:.2g} %)"
        yield finding("bifurcation", f"the part leaves its path at {at} and {load}{accuracy} for a stable branch")
    if reported := _explain_sharp_corners(spec):
        yield finding("sharp_corners", reported, usual_fillet(spec.mechanism.thinnest))
    yield from drawing(spec).warnings
    thinnest, section = solution.assembly.thinnest, next(iter(solution.assembly.network.beams.values())).section
    wide = spec.mechanism.wide_beams
    yield from findings_of_mesh(finding, solution.error, [(section.width, thinnest)], section.poisson_ratio, wide)
    allowable = solution.assembly.allowable_stress
    if allowable is not None and solution.worst is not None and solution.worst[0] > allowable:
        from cfmkit.solid.boundary_and_element_sizes import place_text

        largest, spot = solution.worst
        stress, allowed = (format_short(value, "stress") for value in (largest, allowable))
        message = f"the stress reaches {stress} at {place_text(spot)}; the allowable stress is {allowed}"
        yield finding("overstressed", message, short=f"{stress}, {allowed} allowed")
