"""From a force and a ripple to a strip, or from springs to flexures: a complete specification again.

The strip is searched with a little of the band and of the stress in reserve, rounded, pressed again at many places, and
its stroke is where the first limit is met. Independent elements then compute force and stress once more.

[B] P. Bilancia, A. Geraci, G. Berselli, SMASIS2019-5519, sec. 2.2 and 3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.designing.rounded_and_reported_values import measure_metrics, round_within_bounds, search_values
from cfmkit.designing.run_many_starts import Clock, identity_of
from cfmkit.errors import InputError
from cfmkit.families.findings import mm, mpa, newton, percent, refusals_answered
from cfmkit.families.rows import with_values
from cfmkit.families.slider_crank.findings import finding, unreachable
from cfmkit.families.slider_crank.linkage import linkage_of, resolve
from cfmkit.families.slider_crank.printed.audit import FinishedStrip, judge_strip
from cfmkit.families.slider_crank.printed.beam_chain_from_spec import corners, elasticity, pins_of
from cfmkit.families.slider_crank.printed.flexure_sizing import design_flexures
from cfmkit.families.slider_crank.printed.model import analyze, slider_reach
from cfmkit.families.slider_crank.printed.spec import StripSpec
from cfmkit.families.slider_crank.printed.sqp_program import Form, StripTask
from cfmkit.families.slider_crank.printed.strip_thickness_search import (
    COARSE_RIPPLE,
    MIN_BAND_LENGTH,
    FoundStrip,
    infeasible,
    search,
    uniform_for_stroke,
    uniform_for_width,
)
from cfmkit.numerics.sqp import SearchEnding
from cfmkit.results import Design, Finding, Searched, Status
from cfmkit.stock.material_and_part_spec import sheet_of

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.run_control import Run
    from cfmkit.families.slider_crank.printed.spec import StripDesign
    from cfmkit.families.slider_crank.spec import CrankDesign, SliderCrankSpec


SEARCH_RESERVES, RESERVE_STRESS = (4e-5, 2e-4), 5e-4
"""What the search keeps of the band (a share of the force), more if that was not enough, and of the stress allowed."""
MIN_STROKE_SHARE = 0.99
"""Share of the stroke searched that the finished strip must have, or the search is repeated with more in reserve."""
MAX_ANALYSIS_POINTS = 61
"""Points, at most, of the analysis that judges a uniform strip: between them the curve is just as exact."""
MAX_NAMED_LIMITS = 4
"""So many of the limits that hold a strip are named in the message; all are in the document of `--json`."""
FORM_DECIMALS, LENGTH_DECIMALS = 6, 9
"""Of the numbers of a form, mostly millimetres, and of lengths in metres: both nanometres."""
DEFAULT_THICKNESS = (0.5e-3, 2e-3)  # range where none is given [m]: what printing makes
DEFAULT_WIDTH = (5e-3, 8e-3)  # range where none is given [m], as of the strip of [B, Table 3]
THICKER_BY = 3.0
"""Times the thickest strip beyond which no thickness from the stress is stated: rubber may bear any curvature of the
motion, and what grows without end by corrections is no dimension."""


@refusals_answered
def design(spec: SliderCrankSpec, run: Run) -> Design:
    """Return a specification with the strip, or the flexures, that the `design` block asks for.

    INFEASIBLE, with the reason and the nearest, where the targets contradict the ranges.
    """
    wanted = spec.design
    if wanted is None or wanted.drive != "force" or (wanted.force is None and wanted.beam is None):
        return Design(None, Status.INVALID, "a part that is pressed needs 'design.force'")
    try:
        spec = resolve(spec)
        return design_flexures(spec) if wanted.beam is None else _design_strip(spec, run)
    except InputError as problem:
        return Design(None, Status.INVALID, str(problem))


def _strip_design(spec: SliderCrankSpec) -> tuple[CrankDesign, StripDesign]:
    """Return the block `design` of a strip, and its block `beam`."""
    assert spec.design is not None
    assert spec.design.beam is not None
    return spec.design, spec.design.beam


def _design_strip(spec: SliderCrankSpec, run: Run) -> Design:
    _, wanted = _strip_design(spec)
    task = task_of(spec)
    form, ranges = form_of(spec, task)
    if wanted.shape == "uniform" and task.goal != "stroke":
        return _design_uniform_strip(spec, task, ranges, run)
    pins, allowed, limits = pins_of(spec.mechanism), task.material.allowable_stress, _limits(spec)
    identity, clock = identity_of(spec, run.seed), Clock.from_budgets(run.time_budget)
    kept: Design | None = None
    for reserve in SEARCH_RESERVES:
        made_of = replace(task.material, allowable_stress=allowed)
        searched_for = replace(task, ripple=task.ripple - reserve, material=made_of)
        strip = search(searched_for, form, ranges, wanted.seeds, run, f"{identity} {reserve} {allowed}", clock)
        if isinstance(strip, Design):
            return kept or strip
        if not strip.descent.feasible:
            return kept or infeasible(strip)
        judged = judge_strip(round_within_bounds(strip.values, ranges, FORM_DECIMALS), strip, limits, pins)
        if judged is None:
            refused = _unpressed_strip(strip)
            continue
        if allowed is not None:
            allowed /= max(1.0, judged.overstress)
        reported = _analyse_reported(_with_finished_strip(spec, judged, wanted.shape == "uniform"), judged.window, run)
        if not reported.keeps(*limits):
            refused = _broken_limit(reported, judged.window, limits)
            continue
        kept = _make_design(strip, judged, reported)
        if (
            judged.window[1] > MIN_STROKE_SHARE * strip.program.stroke(strip.descent.z)
            and allowed == made_of.allowable_stress
        ):
            break
    return kept or refused


def _make_design(strip: FoundStrip, judged: FinishedStrip, reported: Reported) -> Design:
    """Return a strip that keeps its limits as a design."""
    return Design(
        reported.spec,
        Status.COMPLETE,
        _describe_strip(strip, judged, reported),
        active_bounds=judged.active,
        warnings=_warnings(strip, judged),
        search=_search_of(strip, judged),
    )


@dataclass(frozen=True)
class Reported:
    """Numbers of the analysis of a finished strip: what is reported of a design are these numbers."""

    spec: SliderCrankSpec  # with the strip
    # deviation, rms: over the window: as a share of the force, and in N; None if the analysis ends before it
    deviation: float | None
    rms: float | None
    stress: float | None  # largest one in the window [Pa]
    ending: str = ""  # how the analysis ended

    def keeps(self, ripple: float | None, stress: float | None) -> bool:
        """Return whether the analysis has all of the window, and the strip is within its band and stress there."""
        pairs = (self.deviation, ripple), (self.stress, stress)
        return self.rms is not None and all(
            limit is None or (value is not None and value <= limit) for value, limit in pairs
        )


def _analyse_reported(spec: SliderCrankSpec, window: tuple[float, float], run: Run) -> Reported:
    result = analyze(spec, run)
    kind = "target" if spec.target_curve is None else "curve"
    names = (f"deviation_from_{kind}", f"rms_to_{kind}", "stress_max")
    deviation, rms, stress = measure_metrics(result, window, *names)
    return Reported(spec, deviation, rms, stress, result.message)


def _broken_limit(reported: Reported, window: tuple[float, float], limits: tuple[float | None, float | None]) -> Design:
    """Return which limit a strip breaks in its analysis that it kept in the search."""
    (ripple, stress), missed = limits, []
    if reported.rms is None:
        missed.append(f"has no force all the way ({reported.ending})")
    if ripple is not None and reported.deviation is not None and reported.deviation > ripple:
        missed.append(f"is up to {percent(reported.deviation)} off the force")
    if stress is not None and reported.stress is not None and reported.stress > stress:
        missed.append(f"has a stress of {mpa(reported.stress)}")
    cure = "change 'design.travel' or the ranges in 'design.beam'"
    if reported.spec.analysis.side is not None:
        cure = "a strip is designed for the side to which it is kinked: remove 'analysis.side'"
    text = f"from {mm(window[0])} to {mm(window[1])} the strip found {' and '.join(missed)} in its analysis; {cure}"
    return unreachable(text)


def _unpressed_strip(strip: FoundStrip) -> Design:
    """Return that a strip keeps its limits at the places of its search only."""
    over = f"from {mm(strip.program.task.start)} to {mm(strip.program.stroke(strip.descent.z))}"
    text = f"{over} the strip found keeps its band, or has its force, at the places of the search only"
    return unreachable(f"{text}; change 'design.travel' or the ranges in 'design.beam'")


def _search_of(strip: FoundStrip, judged: FinishedStrip) -> dict[str, Searched]:
    """Return what only the search knows."""
    numbers: dict[str, tuple[float | None, str, str]] = {
        "strips_tried": (float(strip.descent.evaluations), "count", "strips that the last descent pressed")
    }
    if _has_uniform_strip(strip):
        text = "longest travel that a strip of one thickness reaches within the band and the stress"
        numbers["one_thickness_travel"] = (_uniform_stroke(strip), "length", text)
    return search_values(numbers, "beam", judged.window)


def _has_uniform_strip(strip: FoundStrip) -> bool:
    """Return whether a strip of one thickness is known to compare with."""
    return (
        strip.uniform is not None
        and strip.uniform.feasible
        and strip.program.form.count > 1
        and strip.program.task.goal == "stroke"
    )


def _uniform_stroke(strip: FoundStrip) -> float:
    """Return the stroke of a strip of one thickness [m]."""
    return 0.0 if strip.uniform is None else 0.01 * float(strip.uniform.z[-1])


def task_of(spec: SliderCrankSpec) -> StripTask:
    """Return what the strip of a `design` block is to do, with its reserve.

    Raises InputError if the goal lacks its tolerance or its travel.
    """
    wanted, beam = _strip_design(spec)
    ripple, travel = wanted.tolerance, wanted.travel
    if beam.goal == "stroke" and (ripple is None or travel is not None):
        raise InputError("the longest stroke needs 'design.tolerance', and no 'design.travel'; else set 'goal: ripple'")
    if wanted.curve is not None and (beam.goal == "stroke" or beam.shape == "uniform"):
        raise InputError("a curve ('design.target') needs 'design.beam.goal: ripple' or 'rms', and a shape that varies")
    if wanted.curve is not None and not wanted.curve.extremes(*(travel or (0.0, 1.0)))[0] >= 0:
        raise InputError("'design.target' must not be negative over 'design.travel': a strip is pressed, not pulled")
    if beam.goal != "stroke" and travel is None:
        raise InputError(f"the goal {beam.goal!r} needs 'design.travel', the travel over which the force is required")
    reach = slider_reach(spec.mechanism)
    start, stroke = travel if travel is not None else (beam.start, 0.2 * reach)
    if beam.goal != "rms" and start <= 0:
        raise InputError("'design.travel' must begin after the run-in, above 0: the force begins at zero there")
    if beam.goal == "stroke" and beam.longest is not None and beam.longest <= start + MIN_BAND_LENGTH:
        raise InputError(
            f"'design.beam.longest' must be more than {mm(MIN_BAND_LENGTH)} beyond 'design.beam.start', "
            f"{mm(float(start))}"
        )
    made_of = elasticity(spec.mechanism)
    limit = made_of.allowable_stress if beam.stressed else None
    limit = None if limit is None else limit * (1.0 - RESERVE_STRESS)
    return StripTask(
        corners(spec.mechanism, spec.mechanism.beam),
        linkage_of(spec.mechanism).travel_direction,
        replace(made_of, allowable_stress=limit),
        wanted.size / spec.mechanism.sets,
        float(start),
        float(stroke),
        ripple or COARSE_RIPPLE,
        beam.goal,
        beam.longest or 0.5 * reach,
        None if wanted.curve is None else wanted.curve.scale(1.0 / wanted.size),
        spec.mechanism.sets,
    )


def form_of(spec: SliderCrankSpec, task: StripTask) -> tuple[Form, FloatArray]:
    """Return how the strip is described, and the ranges of its numbers, (n, 2).

    Raises InputError if the ranges do not fit the shape.
    """
    (_, wanted), beam = _strip_design(spec), spec.mechanism.beam
    width = sheet_of(spec.mechanism.part) or wanted.width or (beam.width if beam is not None else DEFAULT_WIDTH)
    fixed = None if isinstance(width, tuple) else float(width)
    per_piece: tuple[int, ...] = ()
    shares: tuple[tuple[float, ...], ...] = ()
    count = {"uniform": 1, "even": wanted.nodes}.get(wanted.shape, 0)
    if wanted.shape == "shares":
        if beam is None or beam.shares is None:
            raise InputError("the shape 'shares' needs 'mechanism.beam.shares'")
        count = 2 + sum(len(piece) for piece in beam.shares)
        moving = wanted.shares is not None
        per_piece = tuple(len(piece) for piece in beam.shares) if moving else ()
        shares = () if moving else beam.shares
    rows = list(wanted.thicknesses or [wanted.thickness or DEFAULT_THICKNESS] * count)
    if len(rows) != count:
        raise InputError(f"design.beam.thicknesses has {len(rows)} ranges, and there are {count} thicknesses")
    form = Form(count, per_piece, shares, fixed)
    if form.placed and len(wanted.shares or ()) != form.placed:
        raise InputError(
            f"design.beam.shares has {len(wanted.shares or ())} ranges, and there are {form.placed} shares"
        )
    table = [(low * 1e3, high * 1e3) for low, high in rows] + list(wanted.shares or ())
    if not form.is_ordered(np.mean(table, axis=1), task.corners):
        raise InputError("the middles of the ranges in 'design.beam.shares' must increase: the search begins there")
    if isinstance(width, tuple):
        table.append((width[0] * 1e3, width[1] * 1e3))
    return form, np.array(table)


def _limits(spec: SliderCrankSpec) -> tuple[float | None, float | None]:
    """Return the ripple and the stress that the finished strip is held to."""
    wanted, beam = _strip_design(spec)
    stress = elasticity(spec.mechanism).allowable_stress if beam.stressed else None
    return (wanted.tolerance if beam.goal == "stroke" else None), stress


def _design_uniform_strip(spec: SliderCrankSpec, task: StripTask, ranges: FloatArray, run: Run) -> Design:
    """Return the uniform strip for a stroke: thickness from the stress, width from the force.

    Where the width is stated, the thickness follows from the force.
    """
    wanted = _strip_design(spec)[1].width
    fixed = sheet_of(spec.mechanism.part) or (None if isinstance(wanted, tuple) else wanted)
    if fixed is not None:
        return _design_of_width(spec, task, ranges, float(fixed), run)
    uniform = uniform_for_stroke(task)
    if uniform is None:
        return unreachable(
            "the strip has no equilibrium over 'design.travel', or 'mechanism.material' no yield strength"
        )
    thickness, width = uniform
    low, high = ranges[0] / 1e3
    allowed = f"'design.beam.thickness', {mm(low)} to {mm(high)}"
    if thickness > THICKER_BY * high:
        cure = "state one 'design.beam.width': the thickness then follows from the force"
        return unreachable(f"the stress allows strips far thicker than {allowed}; {cure}")
    if not low <= thickness <= high:
        text = f"the stress requires a thickness of {mm(thickness)}, outside {allowed}"
        return unreachable(text, {"design.beam.thickness": mm(thickness)})
    if isinstance(wanted, tuple) and not wanted[0] <= width <= wanted[1]:
        wide, force = float(np.clip(width, *wanted)), task.sum_over_sets(task.force)
        reached = newton(_four_digits(force * wide / width, up=width < wide))
        text = (
            f"{newton(force)} need a width of {mm(width)}; within 'design.beam.width', "
            f"{mm(wanted[0])} to {mm(wanted[1])}, the nearest is {reached}"
        )
        return unreachable(text, {"design.force": reached, "design.beam.width": mm(width)})
    text = f"thickness {mm(thickness)} from the stress up to {mm(task.stroke)}, width {mm(width)} from the force"
    return _analyse_strip(spec, task, (round(width, LENGTH_DECIMALS), thickness), text, run)


def _design_of_width(spec: SliderCrankSpec, task: StripTask, ranges: FloatArray, width: float, run: Run) -> Design:
    """Return the uniform strip of a stated width, its thickness from the force."""
    uniform = uniform_for_width(task, width)
    if uniform is None:
        return unreachable("the strip has no equilibrium over 'design.travel'")
    (thickness, stress), allowed = uniform, task.material.allowable_stress
    low, high = ranges[0] / 1e3
    # the stress goes with the thickness, and the force with its cube
    strongest = math.inf if allowed is None else thickness * allowed / stress
    thickest = min(high, strongest)
    if not low <= thickness <= thickest * (1 + 1e-9):
        limit = "the stress" if strongest < high else "'design.beam.thickness'"
        nearest = newton(task.sum_over_sets((float(np.clip(thickness, low, thickest)) / thickness) ** 3 * task.force))
        text = (
            f"a strip {mm(width)} wide would have to be {mm(thickness)} thick; {limit} allows {mm(low)} to "
            f"{mm(thickest)}, which is about {nearest}"
        )
        return unreachable(text, {"design.force": nearest} if thickest >= low else {})
    text = f"width {mm(width)} as stated, thickness {mm(thickness)} from the force"
    if allowed is not None:
        text += f", stress {mpa(stress)} up to {mm(task.stroke)}"
    return _analyse_strip(spec, task, (width, thickness), text, run)


def _analyse_strip(spec: SliderCrankSpec, task: StripTask, section: tuple[float, float], text: str, run: Run) -> Design:
    """Return a uniform strip of a width and a thickness [m] as a design, if its analysis keeps the stress, too."""
    window, limits = (task.start, task.stroke), _limits(spec)
    spec = _with_strip(spec, *section, None, window)
    reported = _analyse_reported(
        with_values(spec, {"analysis.points": min(spec.analysis.points, MAX_ANALYSIS_POINTS)}), window, run
    )
    return Design(spec, Status.COMPLETE, text) if reported.keeps(*limits) else _broken_limit(reported, window, limits)


def _four_digits(value: float, up: bool) -> float:
    """Return a positive number with four significant digits, rounded up or down: what is proposed is within a range."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 3)
    return (math.ceil if up else math.floor)(value / unit) * unit


def _with_strip(
    spec: SliderCrankSpec,
    width: float,
    thickness: float | tuple[float, ...],
    shares: tuple[tuple[float, ...], ...] | None,
    window: tuple[float, float],
) -> SliderCrankSpec:
    """Return a specification with a strip, analysed up to the end of its window."""
    kept = {} if spec.mechanism.beam is None else spec.mechanism.beam.model_dump(exclude_unset=True, exclude={"offset"})
    many = thickness if isinstance(thickness, tuple) else round(thickness, LENGTH_DECIMALS)
    strip = StripSpec.model_validate(kept | {"width": width, "thickness": many, "shares": shares})
    analysis = {"travel": (0.0, window[1]), "window": window, "fidelity": None, "drive": "force"}
    changes: dict[str, Any] = {f"analysis.{name}": value for name, value in analysis.items()}
    if spec.design is not None and spec.design.target is not None:
        changes |= {"design.target": spec.design.target.written_out(spec.design.force), "design.force": None}
    return with_values(spec, changes | {"mechanism.beam": strip})


def _with_finished_strip(spec: SliderCrankSpec, finished: FinishedStrip, uniform: bool) -> SliderCrankSpec:
    """Return a specification with a finished strip, rounded; if it is uniform, with one thickness instead of a list."""
    listed = tuple(round(float(value), LENGTH_DECIMALS) for value in np.asarray(finished.strip.thickness))
    width = round(float(finished.strip.width), LENGTH_DECIMALS)
    return _with_strip(spec, width, listed[0] if uniform else listed, finished.shares, finished.window)


def _describe_strip(strip: FoundStrip, judged: FinishedStrip, reported: Reported) -> str:
    descent, count = strip.descent, strip.program.form.count
    what = "one thickness" if count == 1 else f"{count} thicknesses"
    if strip.program.task.goal == "rms":
        head = f"root mean square {newton(reported.rms or 0.0)} over {mm(judged.window[1])}"
    else:
        head = f"within {percent(reported.deviation or 0.0)} from {mm(judged.window[0])} to {mm(judged.window[1])}"
    compared = ""
    if _has_uniform_strip(strip):
        within = percent(max(strip.program.task.ripple, COARSE_RIPPLE))
        compared = f"; one thickness reaches {mm(_uniform_stroke(strip))} within {within}"
    shown = judged.active[:MAX_NAMED_LIMITS]
    more = f" and {len(judged.active) - MAX_NAMED_LIMITS} more" if len(judged.active) > MAX_NAMED_LIMITS else ""
    held = f"; limited by {', '.join(shown)}{more}" if shown else ""
    return f"{what}, {head}{compared}; {descent.ending.value} after {descent.evaluations} strips{held}"


def _warnings(strip: FoundStrip, judged: FinishedStrip) -> tuple[Finding, ...]:
    findings = []
    if strip.descent.ending is not SearchEnding.OPTIMUM:
        text = f"the search was {strip.descent.ending.value}: a better strip may exist; try 'design.beam.seeds'"
        findings.append(finding("optimizer_stopped", text))
    if strip.lost:
        findings.append(finding("optimizer_stopped", f"some starts were lost: {'; '.join(strip.lost)}"))
    return tuple(findings)
