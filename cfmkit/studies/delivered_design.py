"""A design as it is delivered: what the family makes of a specification, moved for its yield, verified as a solid.

At the end its widths are those of a sheet that is sold, where that is wanted, and its dimensions have the digits that
its process can hold. `cfmkit design` and the points of a study that designs take the same way.

Without targets of their own the free values of a mechanism move until it meets its requirements. The curve keeps its
form and gets the mean that the requirements on its effort allow, their middle. Values move as in the correction of a
made part: widths before thicknesses, and no further than is needed. A mechanism that meets all requirements stays as it
is. A part that is a planar solid is moved by the beams of its family.

The part as drawn is solved as a solid, and corrected once so that its force is the wanted one. A planar solid's force
is proportional to its width. Where widths are free, all of them are multiplied by what the force misses; the stress
stays as it is. Where a sheet fixes them, the force that is designed for is multiplied by it, and the design is
repeated. Under a load both move as far as they give way: their forces are compared at the same travel, so that the
corrected part moves as far under its load as the beams do.

Of a design that states no friction, the loss by that of pins and guide is told beside it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.designing.rounded_and_reported_values import search_values
from cfmkit.errors import CfmError, SpecError
from cfmkit.families import family
from cfmkit.families.base import add_size
from cfmkit.metrics import evaluate, mean_effort, window_of
from cfmkit.results import Design, Status
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.experiment.parameters_to_fit import FitParameter
    from cfmkit.families.run_control import Run
    from cfmkit.metrics.requirements import Outcome
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.point_evaluation import Designer


PLAIN_FRICTION = 0.15  # coefficient of pins and guide, assumed: dry steel on steel has 0.1 to 0.2
JOINT_NAMES = {"pins": "pins", "bearings": "plain bearings of the rollers", "guide": "guide"}
"""Names of what rubs, by its block of the mechanism."""


def friction_note(
    result: Result,  # of a design; mechanisms without pins have no note
    run: Run,  # for the analysis with friction
) -> str:
    """Return the mean force both ways with pins and guide that rub as assumed; empty where friction is stated."""
    record, mechanism = family(result.spec.family), getattr(result.spec, "mechanism", None)
    if not record.part or not result.status.usable:
        return ""
    rubbing = getattr(record.part(result), "rubbing", {})
    if not rubbing or any(getattr(mechanism, block, None) is not None for block in rubbing):
        return ""
    blocks = {f"mechanism.{block}": {**sizes, "friction": PLAIN_FRICTION} for block, sizes in rubbing.items()}
    try:
        outcome = record.analyze(result.spec.replace(blocks), run)
    except SpecError:
        return ""
    kind = result.curve.kind
    name = f"{kind}_mean"
    means = [evaluate(outcome, [f"{name}[{path}]"])[f"{name}[{path}]"].value for path in ("load", "unload")]
    frictionless = evaluate(result, [name])[name].value
    where = _name_joints(rubbing)
    if None in means or frictionless is None:
        return f"no force all the way, with {PLAIN_FRICTION:g} assumed in {where}: no friction is stated"
    up, down, free = (format_short(float(entry or 0.0), kind) for entry in (*means, frictionless))
    return (
        f"mean {kind} {up} one way, {down} back with {PLAIN_FRICTION:g} in {where} (assumed: none is stated); {free} "
        "without"
    )


def _name_joints(rubbing: Mapping[str, Mapping[str, float]]) -> str:
    """Return what rubs with its sizes, as "pins (3 mm) and guide"."""
    *first, last = (
        " ".join([name, *(f"({format_short(size, 'length')})" for size in rubbing[block].values())])
        for block, name in JOINT_NAMES.items()
        if block in rubbing
    )
    return f"{', '.join(first)} and {last}" if first else last


FIDELITY_KEY = "analysis.fidelity"
WIDTH_DIGITS = 7  # significant ones of a corrected width: a tenth of a micrometre in a metre
AT_END = {"design.rescale.force": "nominal_force"}
"""Levels that are no mean over the window, but the force at its end; and the metric that is compared."""


def verify_by_solid(requested: Spec, design: Design, run: Run) -> Design:
    """Return a design that ends with its part as a solid, whose force is the wanted one: the mean, or that at the end.

    Parameters
    ----------
    given : Spec
        With `design.verify`.
    design : Design
        What the family made of it; returned as it is where there is none.
    run : Run
        Seed, progress, time budget.

    Returns
    -------
    Design
        Its specification has `analysis.fidelity: solid`. INVALID where the design cannot be a solid, INFEASIBLE where a
        corrected width is not in its range, PARTIAL or NO_EQUILIBRIUM where the solid cannot be followed to the end.
    """
    if design.spec is None:
        return design
    record = family(requested.family)
    try:
        as_solid = design.spec.replace({FIDELITY_KEY: "solid"})
    except SpecError as error:
        reported = "; ".join(problem.message for problem in error.problems)
        return Design(None, Status.INVALID, f"design.verify: this design cannot be analysed as a solid: {reported}")
    beams = record.analyze(design.spec, run)
    solid = record.analyze(as_solid, run)
    levels = record.design.levels if record.design else ()
    path = next((path for path in levels if _number_at(requested, path)), None)
    by_beams, by_solid, where = _forces_at_end(beams, solid, AT_END[path]) if path in AT_END else _means(beams, solid)
    wanted = by_beams if path is None else math.copysign(_number_at(requested, path), by_beams or 0.0)
    if solid.status is not Status.COMPLETE or not wanted or not by_solid or not by_beams or wanted / by_solid <= 0:
        reported = f"the part as a solid has no force that could be corrected: {solid.message}"
        return replace(design, spec=as_solid, notes=(*design.notes, ("verify", reported)))
    factor = wanted / by_solid
    kind = solid.curve.kind
    mean, which = ("", f"force{where}") if path in AT_END else ("mean ", "mean force")
    begun = (
        f"{design.spec.fidelity} has a {mean}{kind} of {format_short(by_beams, kind)}, the part as a solid of "
        f"{format_short(by_solid, kind)} ({100 * (by_solid / by_beams - 1):+.2g} %){where}"
    )
    if _states_sheet(as_solid):
        return _design_other_force(requested, design, as_solid, path, factor, begun, run)
    corrected = {path: float(f"{factor * width:.{WIDTH_DIGITS}g}") for path, width in _widths(as_solid).items()}
    outside = _explain_outside(requested, design.spec, corrected)
    if outside is not None:
        return outside
    reported = "; ".join(
        f"{path} {format_short(width, 'length')} -> {format_short(corrected[path], 'length', 6)}"
        for path, width in _widths(as_solid).items()
    )
    made = as_solid.replace(corrected)
    aim = format_short(wanted, kind)
    note = f"{begun}; all widths are multiplied by {factor:.5g}, so that the solid has {aim}: {reported}"
    numbers = {
        "verified_target": (wanted, kind, f"requested {which} of the part as a solid"),
        "verified_before": (by_beams, kind, f"{which} of the design by its own model"),
        "verified_solid_before": (by_solid, kind, f"{which} of the part as a solid, before its correction"),
        "verified_width_factor": (factor, "ratio", "factor by which all widths were multiplied"),
    }
    about = search_values(numbers, "solid", solid.travel or (0.0, 0.0), made.motion or "length")
    return replace(design, spec=made, search={**design.search, **about}, notes=(*design.notes, ("verify", note)))


def _design_other_force(
    requested: Spec, design: Design, as_solid: Spec, path: str | None, factor: float, begun: str, run: Run
) -> Design:
    """Return a design of another force, whose solid has the wanted one: the widths are those of the sheet."""
    if path is None:
        reported = f"{begun}; the sheet fixes the widths and the design states no force: no correction is made"
        return replace(design, spec=as_solid, notes=(*design.notes, ("verify", reported)))
    wanted = _number_at(requested, path)
    method = family(requested.family).design
    assert method is not None
    again = method.make(requested.replace({path: factor * wanted}), run)
    if again.spec is None:
        return replace(again, message=f"design.verify: for a solid of {format_short(wanted, 'force')}, {again.message}")
    # what is wanted stays what is wanted
    made = again.spec.replace({path: wanted, FIDELITY_KEY: "solid"})
    reached, aim = format_short(factor * wanted, "force", 5), format_short(wanted, "force")
    note = f"{begun}; the sheet fixes the widths, so it is designed for {reached} instead of {aim}"
    if (
        getattr(requested.get_value("design"), "yield", None) is not None
    ):  # these are judged by requirements about what is wanted
        note += "; the margins of design.yield are not repeated for that force"
    return replace(again, spec=made, notes=(*again.notes, ("verify", note)))


def _forces_at_end(beams: Result, solid: Result, name: str) -> tuple[float | None, float | None, str]:
    """Return the forces of both at the end of the window, and that they are those there."""
    by_beams, by_solid = (evaluate(result, [name])[name].value if result.curves else None for result in (beams, solid))
    return by_beams, by_solid, " at the end of the window"


def _means(beams: Result, solid: Result) -> tuple[float | None, float | None, str]:
    """Return the mean forces or torques of both, and over which travel where that is not their window."""
    if not beams.curves or not solid.curves or np.allclose(beams.travel or 0.0, solid.travel or 0.0, rtol=1e-9):
        return mean_effort(beams), mean_effort(solid), ""
    far = min(abs(float(result.curve.motion[-1])) for result in (beams, solid))
    window = window_of(beams)
    low, high = sorted((abs(window.lo), abs(window.hi))) if window is not None else (0.0, far)
    reported = format_short(min(high, far), solid.spec.motion or "length")
    over = f" over the travel up to {reported}, which both reach"
    return _mean_over_travel(beams, low, min(high, far)), _mean_over_travel(solid, low, min(high, far)), over


def _mean_over_travel(result: Result, low: float, high: float) -> float | None:
    """Return the mean over a travel of either sign [m or rad], whatever points the curve has; None if it turns back."""
    from scipy.interpolate import PchipInterpolator

    motion, effort = np.abs(result.curve.motion), result.curve.effort
    if not (np.diff(motion) > 0).all() or low >= high:
        return None
    return float(PchipInterpolator(motion, effort).integrate(low, high)) / (high - low)


def _widths(spec: Spec) -> Mapping[str, float]:
    return {f"mechanism.{key}": float(width) for key, width in spec.out_of_plane_widths.items() if width is not None}


def _states_sheet(spec: Spec) -> bool:
    try:
        return spec.get_value("mechanism.part.sheet") is not None
    except KeyError:
        return False


def _number_at(spec: Spec, path: str) -> float:
    try:
        return float(spec.get_value(path) or 0.0)
    except KeyError:
        return 0.0


def _explain_outside(requested: Spec, designed: Spec, corrected: Mapping[str, float]) -> Design | None:
    """Return why there is no design, where a corrected width is not in the range that it is designed in."""
    for path, (low, high) in family(requested.family).free(requested, designed).items():
        if path in corrected and not low * (1 - 1e-9) <= corrected[path] <= high * (1 + 1e-9):
            reported = (
                f"design.verify: for the requested force of the solid {path} would be "
                f"{format_short(corrected[path], 'length')}, outside its range of {format_short(low, 'length')} to "
                f"{format_short(high, 'length')}"
            )
            return Design(None, Status.INFEASIBLE, reported)
    return None


NO_LEVEL_MESSAGE = (
    "the requirements state no {0} that the mechanism could be designed for: require '{0}_mean', or a band of it"
)


@dataclass(frozen=True)
class AsDrawn:
    """A part that is made as drawn, without errors."""

    errors: tuple[FitParameter, ...] = ()
    values: FloatArray = field(default_factory=lambda: np.zeros(0))

    def part_of(self, drawn: Spec) -> Spec:
        """Return the drawing."""
        return drawn


def move_free_values(
    spec: Spec,  # with a block `design` that states `free`, and no target of its family
    run: Run,  # seed, progress, time budget
) -> Design:
    """Return a specification whose free values were moved until all requirements are met, or why there is none."""
    from cfmkit.experiment.redrawn_values import Redesign, aim_of, limits_of

    nominal = _analyze_with_box(spec, run)
    if not nominal.curves:
        return Design(None, nominal.status, nominal.message)
    outcomes = family(spec.family).check(nominal)
    if nominal.status is Status.COMPLETE and outcomes and all(outcome.ok for outcome in outcomes):
        return Design(spec, Status.COMPLETE, notes=(("free", "all requirements are met as it is: nothing was moved"),))
    kind = nominal.curve.kind
    target = _mean_required(outcomes, kind)
    if target is None:
        return Design(None, Status.INVALID, NO_LEVEL_MESSAGE.format(kind))
    drawn = _choose_finest_beam_model(spec)
    begun = nominal if drawn is spec else _analyze_with_box(drawn, run)
    if not begun.curves:
        return Design(None, begun.status, begun.message)
    own_aim = aim_of(begun)
    aim = replace(own_aim, efforts=tuple(target / own_aim.mean_effort * effort for effort in own_aim.efforts))
    redesign = Redesign(drawn, (AsDrawn(),), aim, limits_of(drawn))
    try:
        moved = redesign.drawing(redesign.solve())
    except CfmError as problem:
        return Design(None, Status.INFEASIBLE, str(problem))
    design = Design(moved, Status.COMPLETE, notes=(("free", _describe_changes(spec, moved, tuple(redesign.limits))),))
    if drawn is not spec:
        design = verify_by_solid(spec, design, run)
    return design if design.spec is None else _check_requirements(design, run)


def _analyze_with_box(spec: Spec, run: Run) -> Result:
    record = family(spec.family)
    result: Result = record.analyze(spec, run)
    return add_size(result, record.envelope(result)) if result.curves else result


def _check_requirements(design: Design, run: Run) -> Design:
    """Return a design, or what it misses by more than the rounding of its values."""
    assert design.spec is not None
    outcomes = family(design.spec.family).check(_analyze_with_box(design.spec, run))
    missed = [outcome.sentence for outcome in outcomes if not outcome.ok]
    if not missed:
        return design
    reported = f"no values in the ranges of 'design.free' meet all requirements; the nearest: {'; '.join(missed)}"
    return Design(None, Status.INFEASIBLE, reported)


def _mean_required(outcomes: Sequence[Outcome], kind: str) -> float | None:
    """Return the middle of what requirements allow for the effort [N or N m]; None if they do not bound it twice."""
    lows = [
        outcome.min
        for outcome in outcomes
        if outcome.metric in (f"{kind}_mean", f"{kind}_min") and outcome.min is not None
    ]
    highs = [
        outcome.max
        for outcome in outcomes
        if outcome.metric in (f"{kind}_mean", f"{kind}_max") and outcome.max is not None
    ]
    return 0.5 * (max(lows) + min(highs)) if lows and highs else None


def _choose_finest_beam_model(spec: Spec) -> Spec:
    """Return a specification with the finest model of its family that is no solid."""
    if spec.fidelity != "solid":
        return spec
    for name in reversed([name for name in family(spec.family).models if name != "solid"]):
        try:
            return spec.replace({FIDELITY_KEY: name})
        except SpecError:  # what that model needs is not there
            continue
    return spec


def _describe_changes(before: Spec, after: Spec, paths: Sequence[str]) -> str:
    from cfmkit.experiment.redrawn_values import dimension_of

    moved = [
        f"{path} {format_short(float(old), dimension_of(before, path))} -> "
        f"{format_short(float(new), dimension_of(before, path), 6)}"
        for path in paths
        if (old := before.get_value(path)) != (new := after.get_value(path))
    ]
    return f"moved so that the requirements are met: {'; '.join(moved)}" if moved else "nothing was moved"


def run_design(
    spec: Spec,  # with a `design` block
    designer: Designer,  # what designs perfect parts of the family
    # seed, progress, time budget. If a yield is requested, the search for the perfect part has half of the time, and
    # that for its margins what is left. A part from a sheet is designed again for its solid, with the whole budget:
    # with what is left, the finished design could be lost
    run: Run,
) -> Design:
    """Return the design of a specification, with all that its block `design` asks for, or why there is none."""
    from cfmkit.studies.stock_and_digits import with_digits_of_process, with_stock_sheet, with_whole_strands

    rounded = _finished_design(spec, designer, run)

    def finish(variant: Spec) -> Design:
        return _finished_design(variant, designer, run)

    rounded = with_whole_strands(spec, with_stock_sheet(spec, rounded, finish, run), finish, run)
    return with_digits_of_process(spec, rounded, finish, run)


def _finished_design(spec: Spec, designer: Designer, run: Run) -> Design:
    """Return the design of a specification with its margins, verified."""
    asked = getattr(spec, "design", None)
    if asked is not None and asked.by_requirements:
        designer = move_free_values
    plain = getattr(asked, "yield", None) is None
    result = designer(spec, run) if plain else _with_yield(spec, designer, run)
    if getattr(asked, "verify", None) is not None:
        result = verify_by_solid(spec, result, run)
    return result


def _with_yield(spec: Spec, designer: Designer, run: Run) -> Design:
    """Return a design of perfect parts, in half of the time, with margins for the yield, in the time that is left."""
    from cfmkit.designing.run_many_starts import Clock
    from cfmkit.studies.parts.redesign import with_design_margins

    clock = Clock.from_budgets(run.time_budget)
    half = None if run.time_budget is None else 0.5 * run.time_budget
    design = designer(spec, replace(run.part(0.0, 0.5), time_budget=half))
    if designer is move_free_values and design.status is Status.INFEASIBLE:
        design = Design(spec, Status.COMPLETE)  # margins may lead from what misses a requirement to what meets all
    return with_design_margins(spec, design, replace(run.part(0.5, 1.0), time_budget=clock.get_time_left()))
