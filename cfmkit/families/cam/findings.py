"""Warnings of the cam family: of each its name and meaning, when it is raised, and its sentence with numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cfmkit.families.cam.contact_pressure import YIELD_PRESSURE, allowable_stress
from cfmkit.families.cam.statics import spring_force
from cfmkit.families.findings import Finder, format_at_least, mm, mpa, newton
from cfmkit.families.largest_next_to_samples import largest_of_each
from cfmkit.families.rows import FindingRule

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.solution import Solution
    from cfmkit.families.cam.spec import CamSpec, Mechanism
    from cfmkit.results import Finding


CAM_FINDINGS = {
    "brace_too_short": "the roller's distance from the axis reaches the length of the brace",
    "path_vertical": "the profile is cut for so much friction that the path turns vertical within the stroke",
    "design_singular": "the profile is cut for so much friction on the way down that the path does not rise at its "
    "start",
    "undercut": "the roller is larger than the path's radius of curvature: the cam starts with a corner",
    "undercut_total": "the roller is so large that no part of the flank remains",
    "corner_pressure": "on the sharp corner the contact pressure is unbounded",
    "overstressed": "the contact pressure exceeds the one at which the material first yields below the surface",
    "up_jam": "the mechanism self-locks over a ten-thousandth of its travel or more: no force moves the slider up",
    "dead_point": "the slider cannot move the roller at the start: forces other than the springs' diverge",
    "spring_slack": "the springs are slack (shorter than their rest length) and carry no force",
    "spring_overstretched": "the springs are stretched beyond their limit",
    "lift_off": "the contact force is not positive: the roller leaves the cam",
    "slack_cable": "the force on the slider is not positive: a cable would go slack",
    "flanks_collide": "the two flanks cross the axis: no plate is left between them",
    "rollers_collide": "the two rollers touch each other",
    "outside_profile": "the requested travel is longer than the cut profile allows",
    "inertia_mismatch": "a moment of inertia does not fit the mass and the size of its part",
    "symmetric_model": "the quasi-static model neglects the differences between the two sides",
    "friction_left_out": "the model neglects specified friction, or weight across the travel",
    "end_stop": "the end stops of the slider allow less travel than requested",
    "parts_touch": "the clearance between moving parts, or from them to the plate or its screws, is less than required",
    "bearing_overloaded": "the load of a roller's bearing exceeds its static rating",
    "plate_incomplete": "there is no room for the tab of the plate, or for its fixing holes",
    "target_curve": "no cam gives the target curve: it ends too early, is not above zero, or needs a vertical path",
    "weight_too_large": "the target force is less than the weight of the moving parts",
    "force_constant_too_small": "the required force constant is below the smallest one without undercut",
    "registration_weak": "the measured points determine the position of the cam poorly",
    "width_error": "the measured cam is wider or narrower than the design on both flanks",
    "profile_outliers": "measured points are so far off that the registration ignored them",
    "noise_understated": "neighbouring points differ by more than the stated noise of the measurement explains",
    "noise_overstated": "the stated noise of the measurement is larger than all errors of the profile",
    "profile_hole": "a part of a flank was not measured: the force there is not known, nor what holds over it",
    "part_measured": "the flanks were measured over a part of the travel only",
    "no_spring_fits": "no spring of the catalogue meets the limits",
}

finding = Finder(CAM_FINDINGS)  # return a finding of this family; the name must be one that `CAM_FINDINGS` explains


LIMIT_RTOL = 1e-9  # a value that exceeds its limit by this share is on it: conversions of units and sums leave less
LENGTH_TOL = 1e-12
"""Springs shorter than at rest by less [m] are at rest: rounding of half widths of decimetres is smaller."""


def exceeds_yield_pressure(pressure: FloatArray | float, allowable: FloatArray | float) -> Any:
    """Return whether a contact pressure exceeds the one at which a material with an allowable stress first yields."""
    return np.asarray(pressure > YIELD_PRESSURE * allowable * (1 + LIMIT_RTOL))


def sinks_first(dead_point: FloatArray | float, start: FloatArray | float, brace: FloatArray | float) -> Any:
    """Return whether the slider's dead point lies below its start [m], by more than rounding of the brace's length."""
    return np.asarray(dead_point < start - LIMIT_RTOL * brace)


def is_slack(elongation: FloatArray) -> NDArray[np.bool_]:
    """Return where springs are shorter than at rest, from their elongation [m]."""
    return np.asarray(elongation < -LENGTH_TOL)


def is_overstretched(longest: FloatArray | float, limit: float) -> Any:
    """Return whether springs are stretched beyond their limit [m]."""
    return np.asarray(longest > limit * (1 + LIMIT_RTOL))


def find_overstress(mechanism: Mechanism, largest: float | None, place: str) -> Finding | None:
    """Return what to say where the contact yields under the largest pressure [Pa]; None if it does not."""
    allowable = allowable_stress(mechanism)
    if (
        mechanism.contact is None
        or allowable is None
        or largest is None
        or not exceeds_yield_pressure(largest, allowable)
    ):
        return None
    return finding("overstressed", *overstress(mechanism, largest, place))


def overstress(mechanism: Mechanism, largest: float, place: str) -> tuple[str, ...]:
    """Return message and cure of a contact that yields under a pressure [Pa] at a place."""
    contact, limit = mechanism.contact, YIELD_PRESSURE * (allowable_stress(mechanism) or 0.0)
    assert contact is not None
    wider = format_at_least(contact.width * (largest / limit) ** 2)
    safety = f" over a safety factor of {mechanism.safety_factor:g}" if mechanism.safety_factor != 1 else ""
    return (
        f"the contact pressure of {mpa(largest)} {place} is above {mpa(limit)}, at which the material first yields "
        f"below the surface (1.67 times its yield strength{safety}); use a contact of at least {wider} "
        "('mechanism.contact.width'), a stronger material or a larger roller",
        f"mechanism.contact.width={wider}",
    )


def warn_of_asymmetry(spec: CamSpec) -> tuple[Finding, ...]:
    """Return what to say where the two sides differ: the quasi-static model is symmetric."""
    errors, unsupported = spec.mechanism.errors, []
    if errors and (errors.slider_deviation or errors.flank_angle):
        unsupported.append("'mechanism.errors'")
    if spec.mechanism.left:
        unsupported.append("'mechanism.left'")
    if not unsupported:
        return ()
    verb = "counts" if len(unsupported) == 1 else "count"
    message = (
        f"the quasi-static model is symmetric: {' and '.join(unsupported)} {verb} in the dynamic model only; to see "
        "the effect, state a slow motion in 'analysis.dynamics'"
    )
    return (finding("symmetric_model", message),)


def warn_of_neglected_friction(spec: CamSpec, model: str) -> tuple[Finding, ...]:
    """Return what to say where a model has rolling friction only."""
    mechanism = spec.mechanism
    said = [name for name in ("bearings", "pins", "guide") if (part := getattr(mechanism, name)) and part.friction]
    if not said:
        return ()
    keys = ", ".join(f"'mechanism.{name}.friction'" for name in said)
    return (finding("friction_left_out", f"{model} includes rolling friction only: {keys} is neglected"),)


def _describe_undercut(solution: Solution) -> tuple[str, ...]:
    profile, travel = solution.assembly.track.profile, solution.corner_travel
    assert profile.corner is not None
    law, point = profile.path.law, profile.corner.point
    (place, radius), missing = law.tightest(profile.end), max(-float(solution.mechanism.profile.offset), 0.0)
    where = "at the start" if place <= law.rest_half_width else f"at x = {mm(place)}"
    roller = f"the {mm(profile.roller_radius - missing)} roller"
    roller += f", with {mm(missing)} of the flank missing," if missing else ""
    cure = law.smallest_force_constant(profile.roller_radius)
    larger = f" or A >= {mm(cure)}" if cure else ""
    tight, designed = _preload_cure(solution), solution.assembly.spec.design
    tighter = f"springs stretched by {mm(tight)} at the start ('mechanism.springs.preload'), " if tight else ""
    cures = ["design.choose=preload"] if designed and tight else []
    cures += ["design.avoid_undercut=true"] if cure and designed else []
    fits = f"a roller <= {mm(radius - missing)}" if radius > missing else "less missing material"
    return (
        f"{roller} is larger than the path's smallest radius of curvature "
        f"({mm(radius)}, {where}): over the first {mm(travel)} it runs on the corner at x = {mm(point[0])}, "
        f"y = {mm(point[1])}, and {'the force is not constant' if law.constant else 'the force is not as cut'}. "
        f"Use {tighter}{fits}{larger}",
        *cures,
    )


def _undercut_in_short(solution: Solution) -> str:
    law = solution.assembly.track.profile.path.law
    return f"force not {'constant' if law.constant else 'as cut'} up to {mm(solution.corner_travel)}"


def _describe_corner_pressure(solution: Solution) -> tuple[str, ...]:
    corner = mm(solution.corner_travel)
    return (f"on a sharp corner the contact pressure is unbounded: it is reported from {corner} of travel on",)


def _preload_cure(solution: Solution) -> float | None:
    """Return the least elongation at the start with which the roller can follow the path [m]; None if none helps."""
    profile, mechanism = solution.assembly.track.profile, solution.mechanism
    half = profile.path.law.smallest_preload(profile.roller_radius)
    is_cure = half is not None and half < mechanism.rest_half_width and mechanism.profile.offset >= 0
    return 2.0 * half if half is not None and is_cure else None


def _make_jam_rule(number: int) -> FindingRule[Solution]:
    """Return the rule of the first interval without leverage, or of a later one."""

    def message(solution: Solution) -> tuple[str, ...]:
        (low, high), friction = solution.jams[number], solution.mechanism.rolling_friction
        return (
            f"on the way up friction ({friction:g}) holds the roller from {mm(low)} to {mm(high)} of travel: "
            "no force moves the slider there; use less friction, or start beyond",
        )

    def short(solution: Solution) -> str:
        low, high = (mm(end) for end in solution.jams[number])
        return f"self-locks on the way up from {low} to {high}"

    def is_felt(solution: Solution) -> NDArray[np.bool_]:
        ends = np.array([jams[number] if len(jams) > number else (0.0, 0.0) for jams in solution.all_jams])
        low, high = ends.T[..., None]
        leaves_gap = ((low < solution.travel) & (solution.travel < high)).any(axis=-1, keepdims=True)
        is_long: NDArray[np.bool_] = high - low > MIN_JAM_SHARE * solution.travel[..., -1:]
        return np.asarray(leaves_gap | is_long, bool)[..., 0]

    return FindingRule("up_jam", is_felt, message, short)


MIN_JAM_SHARE = 1e-4
"""Part of the travel over which a mechanism may self-lock without a warning if no point of the curve is in it.

No slider is stopped or measured more finely (wire EDM places holes within 0.005 mm). With friction every cam that
starts without leverage self-locks, over nanometres.
"""


def _sinks_first(solution: Solution) -> Any:
    track = solution.assembly.track
    return sinks_first(track.dead_point, track.start, track.brace_length)


def _has_dead_start(solution: Solution) -> Any:
    unbounded = np.isnan(solution.up.slider[..., :1]) | np.isnan(solution.down.slider[..., :1])
    return np.logical_or(solution.column(_sinks_first(solution)), solution.column(unbounded))


def _describe_dead_point(solution: Solution) -> tuple[str, ...]:
    track, loads = solution.assembly.track, solution.assembly.loads
    if _sinks_first(solution):
        return (
            f"at the start the slider must first go down by {mm(track.start - track.dead_point)} before the rollers "
            "move out: the brace is too short for this profile",
        )
    cause = "weight" if loads.roller_weight else "spring pretension or friction"
    return (
        f"at the start the slider has no leverage on the rollers: the force from {cause} is unbounded there; "
        "state a window that begins later, or use a gravity-compensated profile",
    )


def _travel_at(solution: Solution, elongation: float) -> float:
    """Return the travel at which the springs are stretched by so much [m]."""
    track, opened = solution.assembly.track, solution.mechanism.springs.tension_stretch
    half_width = solution.assembly.loads.rest_half_width + 0.5 * (elongation + opened)
    return min(track.slider_at(half_width) - track.start, float(solution.travel[-1]))


def _describe_slack(solution: Solution) -> tuple[str, ...]:
    last = _travel_at(solution, 0.0)
    return (
        f"the springs are shorter than their rest length for the first {mm(last)} of travel, by up to "
        f"{mm(-float(solution.elongation.min()))}: they carry no force there",
    )


def _is_overstretched(solution: Solution) -> Any:
    limit = solution.mechanism.springs.max_elongation
    return limit is not None and is_overstretched(solution.elongation[..., -1:], limit)


def _describe_overstretch(solution: Solution) -> tuple[str, ...]:
    limit, longest = solution.mechanism.springs.max_elongation, float(solution.elongation[-1])
    return (describe_overstretch(longest, limit, _travel_at(solution, limit)),)


def describe_overstretch(longest: float, limit: float, travel: float) -> str:
    """Return the sentence on springs stretched beyond a limit that is reached at a travel [m]."""
    return f"the springs are stretched by {mm(longest)}, their limit is {mm(limit)}, reached at {mm(travel)} of travel"


def _make_slack_cable_rule(direction: Literal["up", "down"]) -> FindingRule[Solution]:
    # Springs that pull keep the rollers on the cam as long as nothing accelerates: the contact force is positive.
    def places(solution: Solution) -> NDArray[np.bool_]:
        return np.asarray((solution.elongation > 0) & (getattr(solution, direction).slider <= 0))

    def message(solution: Solution) -> tuple[str, ...]:
        low, high = (mm(end) for end in solution.travel[places(solution)][[0, -1]].tolist())
        where = f"from {low} to {high} of travel"
        return (f"on the way {direction} the force on the slider is not positive {where}: a cable would go slack",)

    return FindingRule("slack_cable", lambda solution: places(solution).any(axis=-1), message)


def _is_lifted(solution: Solution) -> Any:
    """Return whether weight across the slider's travel pulls the lower roller off the cam."""
    loads, beside = solution.assembly.loads, np.abs(solution.assembly.loads.sideways[0])
    mounted = solution.mechanism.mounting is not None
    return mounted and (beside > 0) & (beside > spring_force(solution.states, loads)[..., :1])


def _describe_lift_off(solution: Solution) -> tuple[str, ...]:
    loads, mounting = solution.assembly.loads, solution.mechanism.mounting
    beside, released = abs(loads.sideways[0]), _lifted_travel(solution)
    return (
        f"at the start the weight of a roller across the guide is {newton(beside)}, more than the springs hold: "
        f"the lower roller lifts off the cam for the first {mm(released)} of travel; use preloaded springs, "
        "lighter rollers, or turn the cam's plane flat ('mechanism.mounting: {roll: 90 deg}')",
        f"mechanism.mounting={{elevation: {np.degrees(mounting.elevation):.10g} deg, roll: 90 deg}}",
    )


def _lifted_travel(solution: Solution) -> float:
    """Return the travel over which the lower roller is off the cam [m]."""
    loads = solution.assembly.loads
    opened = loads.stiffness * solution.mechanism.springs.tension_stretch
    return _travel_at(solution, (abs(loads.sideways[0]) - opened) / loads.stiffness)


def _lift_off_in_short(solution: Solution) -> str:
    return f"the lower roller is off the cam over the first {mm(_lifted_travel(solution))}"


def _is_overloaded(solution: Solution) -> Any:
    bearings = solution.mechanism.bearings
    if bearings is None or bearings.static_rating is None:
        return False
    most = largest_of_each(solution.up.contact, solution.down.contact)
    return (most > 0) & (most > bearings.static_rating * bearings.per_roller)


def _describe_overload(solution: Solution) -> tuple[str, ...]:
    bearings, (most,) = solution.mechanism.bearings, largest_of_each(solution.up.contact, solution.down.contact)
    return (
        f"a roller presses with {newton(float(most))} on {bearings.per_roller} bearing(s) with a static rating of "
        f"{newton(bearings.static_rating)} each ('mechanism.bearings.static_rating')",
    )


def _is_overstressed(solution: Solution) -> Any:
    allowable = allowable_stress(solution.mechanism)
    return allowable is not None and exceeds_yield_pressure(solution.largest_pressure, allowable)


def _describe_overstress(solution: Solution) -> tuple[str, ...]:
    top = float(solution.largest_pressure[0, 0])
    travel = float(solution.travel_of_largest_pressure[0, 0])
    return overstress(solution.mechanism, top, f"at {mm(travel)} of travel")


def _is_undercut(solution: Solution) -> Any:
    return np.greater(solution.corner_travel, 0.0)


def rules_of(solution: Solution) -> tuple[FindingRule[Solution], ...]:
    """Return every rule that a solved mechanism may break, the gravest first."""
    number = max(map(len, solution.all_jams))
    return (
        FindingRule("undercut", _is_undercut, _describe_undercut, _undercut_in_short),
        FindingRule(
            "corner_pressure",
            lambda solution: solution.mechanism.contact is not None and _is_undercut(solution),
            _describe_corner_pressure,
        ),
        *map(_make_jam_rule, range(number)),
        FindingRule("dead_point", _has_dead_start, _describe_dead_point),
        FindingRule("spring_slack", lambda solution: is_slack(solution.elongation).any(axis=-1), _describe_slack),
        FindingRule("spring_overstretched", _is_overstretched, _describe_overstretch),
        _make_slack_cable_rule("up"),
        _make_slack_cable_rule("down"),
        FindingRule("lift_off", _is_lifted, _describe_lift_off, _lift_off_in_short),
        FindingRule("bearing_overloaded", _is_overloaded, _describe_overload),
        FindingRule("overstressed", _is_overstressed, _describe_overstress),
    )
