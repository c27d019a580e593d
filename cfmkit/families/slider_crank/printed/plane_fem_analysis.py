"""Analysis of a printed slider-crank as drawn, a planar solid: flexures with fillets, links that bend, or a strip.

The pad at the ground is held and that at the slider moved from their faces on; widths are those of the flexures where
they are. Poses stand close where the travel begins: a nearly straight chain buckles within a thousandth of it. Nominal
stresses of fillets are those of the flexures between rigid links, or of the strip.

Assumes: plane stress. No contact, no plasticity.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import ShortRepr, read_only
from cfmkit.curves import Curve
from cfmkit.errors import GeometryError, InputError
from cfmkit.families.fem_results import (
    PATH_TOLERANCE,
    FilletRow,
    columns_of_solid,
    drop_repeats,
    fillet_table,
    findings_of_mesh,
    largest_concentration,
    nominal_stresses,
    not_meshed,
    stable_between_poses,
    stress_between_poses,
    with_nominal,
    with_steps,
)
from cfmkit.families.findings import CannotBuild, no_result, sharp_inside
from cfmkit.families.slider_crank.findings import finding
from cfmkit.families.slider_crank.linkage import linkage_of
from cfmkit.families.slider_crank.printed.beam_chain_from_spec import chain_of, elasticity
from cfmkit.families.slider_crank.printed.findings import left_out_friction
from cfmkit.families.slider_crank.printed.flexures_as_beam_network import FLEXURE_BEAMS
from cfmkit.families.slider_crank.printed.model import as_run
from cfmkit.families.slider_crank.printed.outline import solved_piece
from cfmkit.families.slider_crank.printed.scalar_results import SCALAR_DEFINITIONS
from cfmkit.families.slider_crank.printed.solution import first_at
from cfmkit.results import Quantity, Result, Status
from cfmkit.specs.units import format_short, window_places
from cfmkit.stock.material_and_part_spec import usual_fillet

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.export.beam_deck_for_abaqus import DrivenNetwork
    from cfmkit.families.run_control import Run
    from cfmkit.families.slider_crank.printed.equilibrium_path import Chain
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.results import Finding
    from cfmkit.solid.adaptive_solution import AdaptiveSolution, DrivenPart, MeshError
    from cfmkit.solid.meshed_part import MeshSolution, Part


POSE_EXPONENT = 3.0  # poses stand at (k/n) to this power of the travel, and where the stiffness leaps
LINK_ELEMENT_RATIO = 4.0  # sides of elements in links, in those of flexures: links are stiff, and hardly bend
NOT_COMPUTED_TEXT = "the model of the part as a solid does not compute it"


@dataclass(frozen=True, eq=False, repr=False)
class SolidSolution(ShortRepr):
    """A part that was solved."""

    spec: SliderCrankSpec  # with every default written out
    solved: AdaptiveSolution
    travel: FloatArray  # (n,) of the slider, at the points of the curve [m]
    chain: Chain  # the leg as beams

    @cached_property
    def force(self) -> FloatArray:
        """Of all legs, at the points of the curve [N]: cubics between the poses."""
        return read_only(self.spec.mechanism.sets * self.fine.course.effort(self.travel))

    @cached_property
    def stress(self) -> FloatArray:
        """Largest along a free edge [Pa]."""
        return stress_between_poses(self.fine, self.travel)

    @property
    def fine(self) -> MeshSolution:
        """The part on its mesh."""
        return self.solved.solution

    @cached_property
    def error(self) -> MeshError:
        """Errors of force and stress."""
        return self.solved.error

    @cached_property
    def fillets(self) -> tuple[FilletRow, ...]:
        """Stress fillet by fillet."""
        return fillets(self.spec, self.chain, self.fine, self.window)

    @property
    def window(self) -> tuple[float, float]:
        """Window in which metrics are taken [m]."""
        ends = self.spec.analysis.travel or (0.0, 0.0)
        return ends if self.spec.analysis.window is None else window_places(self.spec.analysis.window, ends)

    @cached_property
    def level(self) -> float:
        """Mean force in the window [N]."""
        low, high = max(self.window[0], self.travel[0]), min(self.window[1], self.travel[-1])
        places = np.linspace(low, high, 401)
        return float(self.spec.mechanism.sets * self.fine.course.effort(places).mean())


def analyze(spec: SliderCrankSpec, run: Run) -> Result:
    """Return the force of the part as drawn over its slider's travel, with everything that is wrong with it.

    PARTIAL if the path ends before the travel; NO_EQUILIBRIUM if it cannot be meshed or has no second pose.
    """
    from cfmkit.solid.path_following import PathEnd

    try:
        spec = as_run(spec)
        solved = driven_part(spec).solve(run.progress)
    except CannotBuild as problem:
        return no_result(spec, problem.finding)
    except GeometryError as error:
        return not_meshed(spec, error)
    except InputError as problem:
        return Result(spec, Status.INVALID, str(problem))
    low, high = spec.analysis.travel or (0.0, 0.0)
    if why := solved.no_curve(3):
        return Result(spec, Status.NO_EQUILIBRIUM, f"no curve: {why}")
    asked = np.linspace(low, high, spec.analysis.points)
    course = solved.solution.course
    reached = read_only(asked[asked <= course.travel[-1] * (1 + 1e-12)])
    solution = SolidSolution(spec, solved, reached, chain_of(spec))
    complete = course.ending is PathEnd.COMPLETE
    warnings = tuple(_findings(solution))
    return Result(
        spec=spec,
        status=Status.COMPLETE if complete else Status.PARTIAL,
        message="" if complete else warnings[0].message,
        curves=(_curve(solution),),
        values=_values(solution),
        warnings=warnings,
        travel=(low, high),
        target=spec.design.force if spec.design else None,
        reference=spec.analysis.reference_travel,
        allowable_stress=elasticity(spec.mechanism).allowable_stress,
        tables={"fillets": partial(fillet_table, solution.fillets)},
        state=solution,
    )


def part_of(spec: SliderCrankSpec) -> Part:
    """Return one leg as it is solved: its outline as printed, with its widths and both pads."""
    from cfmkit.solid.meshed_part import HeldOrDriven, Part, rings_of
    from cfmkit.solid.plane_stress_law import MATERIAL_LAWS

    piece = solved_piece(spec)
    made_of, material = elasticity(spec.mechanism), spec.mechanism.material
    direction = linkage_of(spec.mechanism).travel_direction
    driven = np.array([np.cos(direction), np.sin(direction), 0.0])
    places = tuple(
        HeldOrDriven(name, (pad,), pad.mean(axis=0), motion, seams=(pad[:2],))
        for name, pad, motion in (("ground", piece.pads[0], np.zeros(3)), ("slider", piece.pads[1], driven))
    )
    assert material is not None  # or `elasticity` had refused
    law = MATERIAL_LAWS[material.law](made_of.youngs_modulus, made_of.poisson_ratio)
    regions = tuple((region.polygon, region.thickness) for region in piece.sheet.regions)
    rings = rings_of((piece.contour, *piece.holes), piece.thinnest)
    width = float(piece.sheet.thickness or 0.0)
    return Part(rings, piece.thinnest, width, law, places, regions, LINK_ELEMENT_RATIO, piece.frame, piece.sections)


def driven_part(spec: SliderCrankSpec) -> DrivenPart:
    """Return one leg with the travels that it is solved for."""
    from cfmkit.solid.adaptive_solution import DrivenPart

    return DrivenPart("slider-crank", part_of(spec), spec.analysis.solid.error, tuple(_list_travels(spec)))


def elastic_parts(spec: SliderCrankSpec) -> tuple[DrivenPart, ...]:
    """Return what is solved of a mechanism, for decks of other solvers and for studies of meshes."""
    return (driven_part(as_run(spec.replace({"analysis.fidelity": "solid"}))),)


def elastic_networks(spec: SliderCrankSpec) -> tuple[DrivenNetwork, ...]:
    """Return the same leg as beams, for decks of other solvers."""
    from cfmkit.elastica import Displacement
    from cfmkit.export.beam_deck_for_abaqus import DrivenNetwork
    from cfmkit.families.slider_crank.printed.flexures_as_beam_network import SLIDER_NODE

    spec = as_run(spec)
    _, end = spec.analysis.travel or (0.0, 0.0)
    chain = chain_of(spec)
    drive = Displacement(SLIDER_NODE, chain.direction, np.array([end]))
    return (DrivenNetwork("slider-crank", chain.build(chain.points), drive),)


def _list_travels(spec: SliderCrankSpec) -> list[float]:
    """Return the travels to solve for [m]: rest, closer ones where the travel begins, and the ends of every window."""
    low, high = spec.analysis.travel or (0.0, 0.0)
    places = high * np.linspace(0.0, 1.0, spec.analysis.solid.poses) ** POSE_EXPONENT
    windows = [spec.analysis.window, *(requirement.over for requirement in spec.requirements)]
    ends = [low, *(place for window in windows if window is not None for place in window_places(window, (low, high)))]
    inside = [place for place in ends if 0.0 < place < high]
    return drop_repeats(np.concatenate([places, inside]), high).tolist()  # type: ignore[no-any-return]


def _curve(solution: SolidSolution) -> Curve:
    course, travel = solution.fine.course, solution.travel
    extra = columns_of_solid(course, travel, solution.stress, travel[-1])
    return Curve(travel, solution.force, stable=stable_between_poses(course, travel), extra=extra)


def _values(solution: SolidSolution) -> Mapping[str, Quantity]:
    """Return the scalar results by name; those that a solid does not know have no value."""
    limit = elasticity(solution.spec.mechanism).allowable_stress
    values: dict[str, float | None] = {
        "kink": solution.chain.kink,
        "run_in_95": first_at(solution.travel, solution.force, 0.95 * solution.level),
        "run_in_98": first_at(solution.travel, solution.force, 0.98 * solution.level),
        "allowable_stress": limit,
        "stress_stroke": None if limit is None else first_at(solution.travel, solution.stress, limit),
        **solution.error.values(),
    }
    quantities = {
        name: Quantity(values.get(name), *about, NOT_COMPUTED_TEXT if values.get(name) is None else "")
        for name, about in SCALAR_DEFINITIONS.items()
    }
    return quantities | largest_concentration(solution.fillets)


def _findings(solution: SolidSolution) -> Iterator[Finding]:
    from cfmkit.solid.path_following import PathEnd

    names = {PathEnd.LIMIT_POINT: "limit_point", PathEnd.UNSTABLE: "unstable", PathEnd.CONTACT: "self_contact"}
    course = solution.fine.course
    if course.ending is not PathEnd.COMPLETE:
        where = format_short(float(course.travel[-1]), "length")
        yield finding(names.get(course.ending, "not_converged"), f"{course.ended}, at {where}")
    piece, made_of = solved_piece(solution.spec), elasticity(solution.spec.mechanism)
    if reported := sharp_inside(solution.spec.mechanism.fillet, piece.sharp):
        yield finding("sharp_corners", reported, usual_fillet(solution.spec.mechanism.thinnest))
    section = piece.sheet.thickness or 0.0, piece.thinnest
    yield from findings_of_mesh(finding, solution.error, [section], made_of.poisson_ratio, made_of.wide)
    limit = made_of.allowable_stress
    peaks, places = solution.fine.peaks
    if limit is not None and peaks.max() > limit:
        from cfmkit.solid.boundary_and_element_sizes import place_text

        worst = int(peaks.argmax())
        yield finding(
            "overstressed",
            f"the stress reaches {format_short(float(peaks[worst]), 'stress')} at {place_text(places[worst])} "
            f"of the drawing, at {format_short(float(course.travel[worst]), 'length')} of travel; "
            f"the allowable stress is {format_short(limit, 'stress')}",
            short=f"{format_short(float(peaks[worst]), 'stress')}, {format_short(limit, 'stress')} allowed",
        )
    if reported := left_out_friction(solution.spec):
        yield finding("friction_left_out", reported)


def fillets(
    spec: SliderCrankSpec, chain: Chain, solved: MeshSolution, window: tuple[float, float]
) -> tuple[FilletRow, ...]:
    """Return the fillets of a leg with their largest stress in a window [m], named by pad or flexure.

    chain: the leg as beams, unloaded.
    """
    from cfmkit.solid.stress_along_fillets import stressed_fillets

    pads = {place.name: place.shapes for place in solved.part.places}
    rows = []
    for fillet in stressed_fillets(solved, spec.mechanism.fillet):
        nearest = FLEXURE_BEAMS[int(np.hypot(*(chain.pins - fillet.arc.middle).T).argmin())]
        names = [] if spec.piece == "beam" else [nearest]
        names += fillet.arc.find_touched(pads) or ([] if names else ["strip"])
        if (largest := fillet.largest(*window)) is not None:
            rows.append(FilletRow(": ".join(names), fillet.arc, *largest))
    stresses = nominal_stresses(
        rows,
        np.array([row.motion for row in rows]),
        lambda travel: [chain.press(with_steps(travel), tolerance=PATH_TOLERANCE).path],
        lambda points: points,
    )
    return with_nominal(rows, stresses)
