"""Scalar results of a cam mechanism, as designed or as measured, beside the constant-force metrics of every family."""

from __future__ import annotations

from dataclasses import replace
from functools import partial, reduce
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.cam.contact_pressure import flank_pressure
from cfmkit.families.cam.geometry.slope_law_for_curve import CurveSlopeLaw
from cfmkit.families.cam.solution import ON_CORNER
from cfmkit.families.cam.solution_of_measured_cam import large_holes, profile_coverage, requested_travel, window_mask
from cfmkit.families.cam.statics import Losses, constant_force, normal_turn
from cfmkit.families.largest_next_to_samples import extreme_next_to, largest_of_each
from cfmkit.families.rows import ScalarQuantity, columns_of_absent_values, or_nan, quantity_of_each, row_of
from cfmkit.results import Quantity
from cfmkit.specs.evaluable_target_curve import TargetCurve
from cfmkit.specs.units import window_places
from cfmkit.stock.springs.extension_springs import ExtensionSpring
from cfmkit.stock.springs.stress_and_life import WIRE_DEFINITIONS, SpringInUse, wire_quantities

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.geometry.flank_from_roller_path import CamProfile
    from cfmkit.families.cam.solution import Solution
    from cfmkit.families.cam.solution_of_measured_cam import MeasuredCam
    from cfmkit.families.cam.statics import Assembly, Forces


BUILT_DEFINITIONS = {
    "profile_rmse": ("length", "root mean square distance of the measured points from the design, along its normal"),
    "profile_sd": ("length", "standard deviation (n - 1) of the distances of the measured points from the design"),
    "profile_mean": (
        "length",
        "mean distance of the measured points from the design, along its normal; positive: too much material",
    ),
    "profile_rmse_x": ("length", "root mean square error in x at the same y [SS, fig. 3]"),
    "profile_sd_x": ("length", "standard deviation (n - 1) of the error in x"),
    "profile_outliers": ("count", "measured points that the registration ignored"),
    "registration_angle": ("angle", "rotation that registers the measured points to the design"),
    "registration_x": ("length", "shift in x, after the rotation, that registers the measured points to the design"),
    "registration_y": ("length", "shift in y, after the rotation, that registers the measured points to the design"),
    "registration_width": (
        "length",
        "extra material on both flanks, along the normal, as fitted by the registration; 0: none",
    ),
    "registration_uncertainty": ("length", "standard deviation of the least certain motion of the registration"),
    "registration_y_per_width": (
        "factor",
        "shift in y that the registration finds for a cam that is wider on both flanks, per width along its normal",
    ),
    "profile_force_sd": ("force", "standard deviation (n - 1) of the force error due to the profile"),
    "profile_force_share": (
        "ratio",
        "standard deviation of the force error due to the profile, over the mean force of the design [SS, fig. 13: 0.8 "
        "%]",
    ),
    "rest_force_mean": ("force", "mean force error due to the rest length of the springs"),
    "manufacturing_force_share": (
        "ratio",
        "median over the sampled cams of the standard deviation of the force error along the travel, over the "
        "mean force [SS, fig. 13: 0.8 %]",
    ),
    "manufacturing_force_share_95": (
        "ratio",
        "95th percentile over the sampled cams of the standard deviation of the force error along the travel, over the "
        "mean force",
    ),
    "profile_coverage": ("ratio", "part of the window in which both rollers touch measured parts of the flanks"),
    "loop_area_per_friction": (
        "energy",
        "area of the loop per unit of rolling friction, over the window: a measured loop area divided by it is the "
        "friction",
    ),
}
FRICTION_KINDS = {
    "rolling": "rolling on the cam dissipates",
    "bearings": "the rollers' bearings dissipate",
    "pins": "slider pin and spring hooks dissipate",
    "guide": "the slider's guide dissipates",
}
"""Of friction, and what each does."""
SCALAR_DEFINITIONS = {
    "force_constant": ("length", "A of the cut profile; the force is 4 K A [SS, eq. 1]"),
    "spring_stiffness": ("stiffness", "K, the sum of all parallel springs"),
    "theoretical_force": (
        "force",
        "4 K A, plus the weights that the profile is shaped to carry: without friction, with the parts that it is "
        "cut for; for a target curve the largest value",
    ),
    "undercut_travel": (
        "length",
        "travel at the start over which the roller runs on a corner of the cam; 0 if there is no corner",
    ),
    "roller_radius_max": ("length", "smallest radius of curvature of the roller path: the largest roller that fits"),
    "force_constant_min": ("length", "smallest force constant whose path the roller can follow"),
    "corner_force_max": (
        "force",
        "largest force on the way up while the roller pivots on the corner; none if friction holds it there",
    ),
    "jam_travel": ("length", "travel at the start over which the mechanism self-locks: no force moves the slider up"),
    "spring_elongation_max": (
        "length",
        "largest elongation of the springs from their relaxed length; initial tension is no elongation",
    ),
    "contact_force_max": ("force", "largest contact force between a roller and the cam"),
    "pressure_angle_max": (
        "angle",
        "largest angle between the force of a brace and the motion of its roller, on the flank",
    ),
    "brace_angle_max": ("angle", "largest angle of a brace from the axis"),
    "friction_half_gap_max": (
        "ratio",
        "largest (up - down)/(up + down) on the flank: fixed by friction and geometry, no choice of the profile "
        "removes it",
    ),
    **{
        f"loop_{what}_{kind}": (
            "energy" if what == "energy" else "ratio",
            (
                f"energy that {words} over the window, up and down; the four losses add up to the loop's area"
                if what == "energy"
                else f"share of the loop's area that {words}"
            ),
        )
        for kind, words in FRICTION_KINDS.items()
        for what in ("energy", "share")
    },
    "contact_force_least": (
        "force",
        "smallest contact force beyond the first point; zero or negative if a roller leaves the cam",
    ),
    "clearance_min": ("length", "smallest distance of the moving parts from plate, screws and each other"),
    "bearing_load_max": ("force", "largest radial load of one roller bearing"),
    "bearing_life": (
        "count",
        "strokes up and down that 90 % of single bearings survive: L10 = (C/P)^3 million revolutions, for roller "
        "bearings (C/P)^(10/3), with the mean of P^3 over the revolutions of a stroke [ISO 281]",
    ),
    "bearing_static_safety": ("factor", "static rating C0 of a bearing over its largest load [ISO 76]"),
    "contact_pressure_max": (
        "stress",
        "largest Hertzian pressure of the line contact on the flank, on the way up; in motion, of both sides",
    ),
    "contact_force_min": ("force", "smallest contact force during a motion: below zero the roller would leave the cam"),
    "brace_force_max": ("force", "largest force of a motion in a brace, at the roller's axis"),
    "roller_speed_max": ("angular_velocity", "largest speed at which a roller turns"),
    "slider_speed_max": ("velocity", "largest speed of the slider"),
    "slider_acceleration_max": ("acceleration", "largest acceleration of the slider"),
    "dead_weight_peak": ("ratio", "largest acceleration over g: relative increase of the force of a dead weight"),
    "moving_mass_max": ("mass", "largest mass that, fixed to the slider, would have the same kinetic energy"),
    "force_peak_over_static": ("ratio", "largest F/F_0 - 1 of a motion, F_0 the static force at the same position"),
    "force_dip_under_static": ("ratio", "largest 1 - F/F_0 of a motion; above 1 the force changes sign"),
    "force_peak_over_slow": ("ratio", "largest F/F_1 - 1, F_1 the force of the same motion in 1 s [SS, Fig. 14]"),
    "angle_error_effect": (
        "ratio",
        "static force at the end of the motion over that without the angular error, minus 1 [SS, Fig. 15 and 16]",
    ),
    **WIRE_DEFINITIONS,
} | BUILT_DEFINITIONS


def largest_roller(cam: CamProfile) -> float:
    """Return the smallest radius of curvature of the roller path [m]; infinite if no roller is too large for it."""
    return cam.path.law.tightest(cam.end)[1]


def smallest_constant(cam: CamProfile) -> float:
    """Return the smallest force constant whose path the roller can follow [m]; NaN without one, and of curves."""
    law = cam.path.law
    return or_nan(law.smallest_force_constant(cam.roller_radius) if law.constant else None)


def design_values(assembly: Assembly) -> dict[str, float]:
    """Return what the profile and the springs say by themselves, by name."""
    return {
        "force_constant": assembly.profile.path.law.force_constant,
        "spring_stiffness": assembly.loads.stiffness,
        "theoretical_force": constant_force(assembly),
    }


def curve_cut_for(assembly: Assembly) -> TargetCurve | None:
    """Return the curve of forces that the profile is cut for, with the springs built in; None of a constant force."""
    law, loads = assembly.profile.path.law, assembly.loads
    if not isinstance(law, CurveSlopeLaw):
        return None
    full = 4.0 * loads.stiffness * law.force_constant
    shape = replace(law.shape, values=tuple(full * share + loads.slider_weight for share in law.shape.values))
    return TargetCurve(shape, "force")


def contact_pressure(solution: Solution, forces: Forces | None = None) -> FloatArray:
    """Return the pressure of the line contact, on the way up if nothing else is said [Pa]; NaN on the corner."""
    return flank_pressure(solution.assembly, solution.states, (forces or solution.up).contact)


def largest(*arrays: FloatArray) -> float | None:
    """Return the largest finite value of all arrays; None if there is none."""
    largest = float(largest_of_each(*arrays)[0])
    return None if np.isnan(largest) else largest


def _bearing_load(solution: Solution) -> FloatArray:
    """Return the largest load of one bearing of each mechanism [N]."""
    return largest_of_each(*(_find_bearing_share(solution) * state.contact for state in (solution.up, solution.down)))


def _find_bearing_share(solution: Solution) -> Any:
    """Return the load of one bearing over the contact force of its roller."""
    mechanism, loads = solution.mechanism, solution.assembly.loads
    losses = loads.losses or Losses(roller_radius=mechanism.roller_radius)
    turn = normal_turn(losses, mechanism.rolling_friction)
    return np.sqrt(1.0 + turn**2) / mechanism.bearings.per_roller


def _bearing_life(solution: Solution) -> FloatArray:
    """Return the strokes up and down that 90 % of single bearings survive, of each mechanism."""
    bearings, travel, turns = solution.mechanism.bearings, solution.travel, _bearing_turns(solution)
    exponent = 3.0 if bearings.kind == "ball" else 10.0 / 3.0
    # In the middle of each step: at the start the load of a mechanism that jams there is unbounded.
    middles = 0.5 * (travel[..., 1:] + travel[..., :-1])
    used = 0.0
    for direction in (1.0, -1.0):
        load = np.nan_to_num(
            np.maximum(solution.evaluate_travel(middles, direction)[1].contact, 0.0)
        ) * _find_bearing_share(solution)
        used = used + (turns * (load / bearings.dynamic_rating) ** exponent).sum(axis=-1, keepdims=True)
    return np.where(used > 0, 1e6 / used, np.nan)


def _bearing_turns(solution: Solution) -> FloatArray:
    """Return the revolutions of a roller's bearing from point to point, (..., n - 1).

    Its shaft turns with the brace, in the direction in which the roller rolls: the bearing feels the difference.
    """
    states, mechanism = solution.states, solution.mechanism
    rolled = np.hypot(np.diff(states.x), np.diff(states.y)) / mechanism.roller_radius
    return np.asarray(np.abs(rolled - np.diff(np.arcsin(states.x / mechanism.brace_length))) / (2.0 * np.pi))


def _friction_energy(solution: Solution, kind: str) -> FloatArray:
    """Return the energy that a kind of friction takes over the window, up and down [J]."""
    up, down = (state.lost or {} for state in (solution.up, solution.down))
    places = solution.travel + solution.origin
    return _integral(places, up[kind] + down[kind], *solution.window)


def _loop_area(solution: Solution) -> FloatArray:
    """Return the energy that all friction takes over the window [J]; NaN where it is not finite, or nothing."""
    area = reduce(np.add, (_friction_energy(solution, kind) for kind in solution.up.lost or {}))
    return np.where(np.isfinite(area) & (area > 0), area, np.nan)


def _integral(places: FloatArray, values: FloatArray, low: Any, high: Any) -> FloatArray:
    """Return the integral of values over increasing places from low to high, linear between them, (..., 1)."""
    start, stop = np.clip(places, low, high)[..., :-1], np.clip(places, low, high)[..., 1:]
    left, first = places[..., :-1], values[..., :-1]
    slope = np.diff(values) / np.diff(places)
    middle = np.where(start == left, first, first + slope * (start - left)) + 0.5 * slope * (stop - start)
    areas = np.where(stop > start, (stop - start) * middle, 0.0)
    return np.asarray(areas.sum(axis=-1, keepdims=True))


def _corner_peak(solution: Solution) -> FloatArray:
    """Return the peak force on the corner, on the way up, (m, 1) [N]."""
    corner = np.minimum(solution.corner_travel, solution.travel[..., -1:])
    free = (corner > 0) & ~solution.is_held_on_corner  # next to a jam the force is unbounded
    if not free.any():
        return np.full((1, 1), np.nan)

    def force(travel: FloatArray) -> FloatArray:
        return solution.evaluate_travel(travel, 1.0)[1].slider

    travel = corner * np.concatenate([[0.0], ON_CORNER])
    return np.where(free, extreme_next_to(force, travel, force(travel), len(solution))[0], np.nan)


def _wires(solution: Solution) -> Iterator[Mapping[str, Quantity]]:
    """Yield what a spring's wire bears, where it is known, of each mechanism; of unequal springs the stiffest."""
    springs, ends = solution.mechanism.springs, solution.elongation
    loads = (
        solution.column(springs.initial_tension * (end >= 0.0) + springs.stiffest * np.maximum(end, 0.0)).tolist()
        for end in (ends.min(axis=-1, keepdims=True), ends.max(axis=-1, keepdims=True))
    )
    for row, (least, largest) in enumerate(zip(*loads, strict=True)):
        wire, life = row_of((springs.wound, springs.life), row)
        wound = None if wire is None else wire.to_wound(ExtensionSpring)
        fatigue = None if wire is None or wire.fatigue is None else wire.fatigue.law
        yield wire_quantities([SpringInUse(wound, least, largest, fatigue, life)])


def _is_in_contact(solution: Solution) -> bool:
    return solution.mechanism.contact is not None


def _rubs(solution: Solution) -> bool:
    return solution.assembly.loads.losses is not None


def _has_bearings(solution: Solution) -> bool:
    return solution.mechanism.bearings is not None


def _is_tilted(solution: Solution) -> bool:
    return solution.up.least_contact is not None and solution.down.least_contact is not None


def _deviations(share: float) -> Callable[[Solution], float]:
    return lambda solution: float(np.quantile(solution.band.deviations(), share)) if solution.band else np.nan


def _loop_energy(solution: Solution, kind: str) -> FloatArray:
    return np.where(np.isnan(_loop_area(solution)), np.nan, _friction_energy(solution, kind))


def _loop_share(solution: Solution, kind: str) -> FloatArray:
    return _friction_energy(solution, kind) / _loop_area(solution)


def _least_contact(solution: Solution) -> FloatArray:
    both = (solution.up.least_contact, solution.down.least_contact)
    return -largest_of_each(*(-contact[..., 1:] for contact in both if contact is not None))


_SCALAR_FUNCTIONS: dict[str, tuple[Callable[[Solution], Any], Callable[[Solution], bool] | None]] = {
    "force_constant": (lambda solution: solution.assembly.profile.path.law.force_constant, None),
    "spring_stiffness": (lambda solution: solution.assembly.loads.stiffness, None),
    "theoretical_force": (lambda solution: constant_force(solution.assembly), None),
    "undercut_travel": (lambda solution: solution.corner_travel, None),
    "roller_radius_max": (lambda solution: solution.read_each_cam(largest_roller), None),
    "force_constant_min": (lambda solution: solution.read_each_cam(smallest_constant), None),
    "corner_force_max": (_corner_peak, None),
    "jam_travel": (lambda solution: solution.jam_travel, None),
    "spring_elongation_max": (lambda solution: solution.elongation.max(axis=-1, keepdims=True), None),
    "contact_force_max": (lambda solution: largest_of_each(solution.up.contact, solution.down.contact), None),
    "pressure_angle_max": (lambda solution: largest_of_each(solution.flank.pressure_angle), None),
    "brace_angle_max": (
        lambda solution: np.arcsin(
            solution.states.x.max(axis=-1, keepdims=True) / solution.assembly.track.brace_length
        ),
        None,
    ),
    "friction_half_gap_max": (lambda solution: solution.flank.half_gap, None),
    "contact_pressure_max": (lambda solution: solution.flank.largest_pressure[0], _is_in_contact),
    **{f"loop_energy_{kind}": (partial(_loop_energy, kind=kind), _rubs) for kind in FRICTION_KINDS},
    **{f"loop_share_{kind}": (partial(_loop_share, kind=kind), _rubs) for kind in FRICTION_KINDS},
    "bearing_load_max": (_bearing_load, _has_bearings),
    "bearing_static_safety": (
        lambda solution: solution.mechanism.bearings.static_rating / _bearing_load(solution),
        lambda solution: (
            _has_bearings(solution)
            and solution.mechanism.bearings.static_rating is not None
            and bool((_bearing_load(solution) > 0).any())
        ),
    ),
    "bearing_life": (
        _bearing_life,
        lambda solution: _has_bearings(solution) and solution.mechanism.bearings.dynamic_rating is not None,
    ),
    "contact_force_least": (_least_contact, _is_tilted),
    "manufacturing_force_share": (_deviations(0.5), lambda solution: solution.band is not None),
    "manufacturing_force_share_95": (_deviations(0.95), lambda solution: solution.band is not None),
}
SCALAR_QUANTITIES: Mapping[str, ScalarQuantity[Solution]] = {
    **{
        name: ScalarQuantity(*SCALAR_DEFINITIONS[name], function, "", applies)
        for name, (function, applies) in _SCALAR_FUNCTIONS.items()
    },
    **{name: quantity_of_each(name, about, _wires) for name, about in WIRE_DEFINITIONS.items()},
}
"""Every scalar result of a quasi-static cam as designed, in the order in which they are shown."""
ROW_COLUMNS: Mapping[str, ScalarQuantity[Solution]] = {
    **SCALAR_QUANTITIES,
    **columns_of_absent_values({n: about for n, about in SCALAR_DEFINITIONS.items() if n not in SCALAR_QUANTITIES}),
}
"""What studies may ask of rows: of values that only motions and measured cams have their cells are empty."""


def values_of_built(built: MeasuredCam) -> Mapping[str, Quantity]:
    """Return the scalar results by name."""
    registration, used = built.registration, built.registration.used
    errors = errors_used(built)
    across = np.concatenate([item[keep] for item, keep in zip(built.across, used, strict=True)])
    inside = window_mask(built)
    share = built.shares["profile"][inside]
    numbers = {
        "profile_rmse": root_mean_square(errors),
        "profile_sd": float(errors.std(ddof=1)),
        "profile_mean": float(errors.mean()),
        "profile_rmse_x": root_mean_square(across),
        "profile_sd_x": float(across.std(ddof=1)),
        "profile_outliers": float(sum(int((~keep).sum()) for keep in used)),
        "registration_angle": registration.angle,
        "registration_x": float(registration.shift[0]),
        "registration_y": float(registration.shift[1]),
        "registration_width": registration.width,
        "registration_uncertainty": registration.weakest(half_extent(built))[1],
        "registration_y_per_width": float(registration.growth[1]),
        "profile_force_sd": float(np.nanstd(share, ddof=1)),
        "profile_force_share": float(np.nanstd(share, ddof=1) / np.nanmean(built.shares["design"][inside])),
        "rest_force_mean": float(np.nanmean(built.shares["rest"][inside])),
        "profile_coverage": profile_coverage(built),
        "loop_area_per_friction": loop_area_per_friction(built),
    }
    unknown = OF_THE_FORCE if large_holes(built) else ()
    quantities = {name: Quantity(value, *BUILT_DEFINITIONS[name]) for name, value in numbers.items()}
    why = "a part of the flanks was not measured"
    return quantities | {name: Quantity(None, *BUILT_DEFINITIONS[name], why) for name in unknown}


OF_THE_FORCE = ("profile_force_sd", "profile_force_share", "loop_area_per_friction")
"""What needs the force everywhere in the window."""


def pressure_of(built: MeasuredCam, direction: float) -> FloatArray:
    """Return the larger pressure of both contacts on the way up (1) or down (-1), the flank curved as designed [Pa]."""
    track, forces = built.assembly.track, built.forces(direction)
    return flank_pressure(built.assembly, track.states(track.start + built.travel), np.maximum(forces[1], forces[2]))


def loop_area_per_friction(built: MeasuredCam) -> float:
    """Return d(loop area)/d(friction) over the window [J], from a small friction either way."""
    loads, small = built.assembly.loads, 1e-6
    up, down = (built.sides.forces(loads, direction * small, loads.rest_half_width)[0] for direction in (1.0, -1.0))
    window = built.assembly.spec.analysis.window
    ends = window_places(window, requested_travel(built)) if window else None
    places = built.travel + built.origin
    return float(_integral(places, up - down, *(ends or (places[0], places[-1])))[0]) / small


def half_extent(built: MeasuredCam) -> float:
    """Return half the height of the measured part [m]: where an angle is felt."""
    heights = np.concatenate([points[:, 1] for points in built.registration.points])
    return 0.5 * float(np.ptp(heights))


def errors_used(built: MeasuredCam) -> FloatArray:
    """Return the errors of the points that count, both flanks [m]."""
    registration = built.registration
    return np.concatenate([error[keep] for error, keep in zip(registration.errors, registration.used, strict=True)])


def root_mean_square(values: FloatArray) -> float:
    """Return the root mean square of values."""
    return float(np.sqrt(np.mean(values**2)))


DEVIATION_DEFINITIONS = {
    "data_friction": (
        "ratio",
        "rolling friction whose loop has the measured area, over the displacements that are compared",
    ),
    "data_rest_error": (
        "length",
        "by how much the springs' rest length must exceed the stated one to explain the measured midline",
    ),
    "data_off_design": ("force", "root mean square of the measured force less that of the design without friction"),
    "data_by_profile": ("force", "root mean square contribution of the measured errors of the profile"),
    "data_by_friction": ("force", "root mean square contribution of the friction that gives the measured loop area"),
    "data_by_rest_length": ("force", "root mean square contribution of the springs' rest length, its error included"),
    "data_unexplained": ("force", "root mean square of the remainder"),
}
