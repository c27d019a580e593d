"""Scalar results of a cam mechanism, as designed or as measured, beside the constant-force metrics of every family."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.cam.contact_pressure import flank_pressure
from cfmkit.families.cam.geometry.roller_track_on_cut_cam import TrackStates
from cfmkit.families.cam.geometry.slope_law_for_curve import CurveSlopeLaw
from cfmkit.families.cam.solution import ON_CORNER, pressure_angle
from cfmkit.families.cam.statics import Forces, Losses, forces, normal_turn
from cfmkit.families.cam.window_of_measured_cam import large_holes, profile_coverage, requested_travel, window_mask
from cfmkit.metrics.continuous_means_and_extremes import extremes
from cfmkit.results import Quantity, quantities
from cfmkit.specs.evaluable_target_curve import TargetCurve
from cfmkit.specs.units import between
from cfmkit.stock.springs.stress_and_life import WIRE_DEFINITIONS, SpringInUse, wire_quantities

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.solution import Assembly, Built, Solution
    from cfmkit.families.cam.spec import CamSpec


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

DEFINITIONS = {
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
        for kind, words in {
            "rolling": "rolling on the cam dissipates",
            "bearings": "the rollers' bearings dissipate",
            "pins": "slider pin and spring hooks dissipate",
            "guide": "the slider's guide dissipates",
        }.items()
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
    "dead_weight_peak": (
        "ratio",
        "largest acceleration over g: relative increase of the force of a dead weight",
    ),
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


def values_of(solution: Solution) -> Mapping[str, Quantity]:
    """Return the scalar results by name; None if a value does not exist."""
    assembly = solution.assembly
    law = assembly.profile.path.law
    flank = FlankSamples.of(solution)
    numbers: dict[str, float | None] = {
        **design_values(assembly),
        "undercut_travel": solution.corner_travel,
        "roller_radius_max": largest_roller(assembly),
        "force_constant_min": law.smallest_force_constant(assembly.profile.roller_radius) if law.constant else None,
        "corner_force_max": _corner_peak(solution),
        "jam_travel": next((high for low, high in solution.jams if low == 0), 0.0),
        "spring_elongation_max": float(solution.elongation.max()),
        "contact_force_max": largest(solution.up.contact, solution.down.contact),
        "pressure_angle_max": largest(flank.pressure_angle),
        "brace_angle_max": float(np.arcsin(solution.states.x.max() / assembly.track.brace_length)),
        "friction_half_gap_max": _half_gap(flank),
    }
    if assembly.spec.mechanism.contact:
        numbers["contact_pressure_max"] = largest_pressure(flank)[0]
    if assembly.loads.losses is not None:
        numbers |= loop_shares(solution)
    if assembly.spec.mechanism.bearings:
        numbers |= _bearing(solution)
    if solution.up.least_contact is not None and solution.down.least_contact is not None:
        numbers["contact_force_least"] = smallest(solution.up.least_contact[1:], solution.down.least_contact[1:])
    if solution.band is not None:
        shares = solution.band.deviations()
        numbers["manufacturing_force_share"] = float(np.median(shares))
        numbers["manufacturing_force_share_95"] = float(np.quantile(shares, 0.95))
    return quantities(DEFINITIONS, numbers) | _wire(solution)


def _wire(solution: Solution) -> dict[str, Quantity]:
    """Return what the springs' wire bears, where it is known; of unequal springs the stiffest."""
    springs, ends = solution.assembly.spec.mechanism.springs, solution.elongation
    stiffest = max(springs.each) if isinstance(springs.each, tuple) else springs.each
    wire = springs.wound
    wound = None if wire is None else wire.wound("extension")
    fatigue = None if wire is None or wire.fatigue is None else wire.fatigue.law
    least, most = (
        springs.initial_tension * (end >= 0.0) + stiffest * max(float(end), 0.0) for end in (ends.min(), ends.max())
    )
    return wire_quantities([SpringInUse(wound, least, most, fatigue, springs.life)])


def largest_roller(assembly: Assembly) -> float | None:
    """Return the smallest radius of curvature of the roller path [m]; None if no roller is too large for it."""
    radius = assembly.profile.path.law.tightest(assembly.profile.end)[1]
    return radius if isfinite(radius) else None


def design_values(assembly: Assembly) -> dict[str, float]:
    """Return what the profile and the springs say by themselves, by name."""
    return {
        "force_constant": assembly.profile.path.law.force_constant,
        "spring_stiffness": assembly.loads.stiffness,
        "theoretical_force": constant_force(assembly),
    }


def constant_force(assembly: Assembly) -> float:
    """Return the force that the profile is cut for, with the springs and weights built in [N]."""
    law, loads = assembly.profile.path.law, assembly.loads
    return 4.0 * loads.stiffness * law.force_constant + loads.slider_weight


def target_force(spec: CamSpec, assembly: Assembly) -> float | None:
    """Return the constant force that is wanted or that the profile is cut for [N]; None if it follows a curve."""
    if spec.target_curve is not None or assembly.spec.mechanism.profile.curve is not None:
        return None
    return spec.design.force if spec.design else constant_force(assembly)


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
    finite = [array[np.isfinite(array)] for array in arrays]
    return max((float(array.max()) for array in finite if array.size), default=None)


def smallest(*arrays: FloatArray) -> float | None:
    """Return the smallest finite value of all arrays; None if there is none."""
    found = largest(*(-array for array in arrays))
    return None if found is None else -found


def loop_shares(solution: Solution) -> dict[str, float | None]:
    """Return the energy that each kind of friction takes over the window [J], and its share of the loop's area."""
    up, down = solution.up.lost or {}, solution.down.lost or {}
    places, window = solution.travel + solution.origin, solution.assembly.spec.analysis.window
    ends = between(window, (float(places[0]), float(places[-1]))) if window else None
    taken = {kind: _integral(places, up[kind] + down[kind], ends) for kind in up}
    area = sum(taken.values())
    finite = np.isfinite(area) and area > 0
    return {f"loop_energy_{kind}": value if finite else None for kind, value in taken.items()} | {
        f"loop_share_{kind}": value / area if finite else None for kind, value in taken.items()
    }


def _integral(places: FloatArray, values: FloatArray, window: tuple[float, float] | None) -> float:
    """Return the integral of values over increasing places, from one end of a window to the other."""
    low, high = np.clip(window or (places[0], places[-1]), places[0], places[-1])
    at = np.unique(np.concatenate([[low, high], places[(places > low) & (places < high)]]))
    return float(np.trapezoid(np.interp(at, places, values), at))


def _bearing(solution: Solution) -> dict[str, float | None]:
    """Return largest load [N], life [strokes up and down] and static safety of the rollers' bearings."""
    mechanism, loads = solution.assembly.spec.mechanism, solution.assembly.loads
    bearings = mechanism.bearings
    assert bearings is not None
    mu = mechanism.rolling_friction
    of_contact = np.sqrt(1.0 + normal_turn(loads.losses or Losses(roller_radius=mechanism.roller_radius), mu) ** 2)
    of_contact /= bearings.per_roller
    most = largest(*(of_contact * state.contact for state in _both(solution)))
    found: dict[str, float | None] = {"bearing_load_max": most}
    if bearings.static_rating and most:
        found["bearing_static_safety"] = bearings.static_rating / most
    if bearings.dynamic_rating:
        exponent = 3.0 if bearings.kind == "ball" else 10.0 / 3.0
        turns, track = _bearing_turns(solution), solution.assembly.track
        # In the middle of each step: at the start the load of a mechanism that jams there is unbounded.
        middles = track.states(track.start + 0.5 * (solution.travel[1:] + solution.travel[:-1]))
        used = 0.0
        for way in (1.0, -1.0):
            load = of_contact * np.nan_to_num(np.maximum(forces(middles, loads, way * mu, way).contact, 0.0))
            used += float(turns @ (load / bearings.dynamic_rating) ** exponent)
        found["bearing_life"] = 1e6 / used if used > 0 else None
    return found


def _bearing_turns(solution: Solution) -> FloatArray:
    """Return the revolutions of a roller's bearing from point to point, (n - 1,).

    Its shaft turns with the brace, in the direction in which the roller rolls: the bearing feels the difference.
    """
    states, mechanism = solution.states, solution.assembly.spec.mechanism
    rolled = np.hypot(np.diff(states.x), np.diff(states.y)) / mechanism.roller_radius
    return np.asarray(np.abs(rolled - np.diff(np.arcsin(states.x / mechanism.brace_length))) / (2.0 * np.pi))


@dataclass(frozen=True, eq=False)
class FlankSamples:
    """Contacts on the flank: the samples there, and before them the place at which the roller leaves the corner."""

    solution: Solution  # the mechanism
    travel: FloatArray  # (n,) increasing [m]
    states: TrackStates  # where the rollers are, (n,)
    # up, down: on the way up and on the way down, (n,) each
    up: Forces
    down: Forces

    @classmethod
    def of(cls, solution: Solution) -> FlankSamples:
        """Return those of a solved mechanism."""
        corner = solution.corner_travel
        if not 0 < corner <= solution.travel[-1]:
            keep = ~solution.states.on_corner
            states = TrackStates(*(field[keep] for field in solution.states.fields()))
            up, down = (Forces(one.slider[keep], one.contact[keep], one.brace[keep]) for one in _both(solution))
            return cls(solution, solution.travel[keep], states, up, down)
        track, mu = solution.assembly.track, solution.assembly.spec.mechanism.rolling_friction
        travel = np.concatenate([[corner], solution.travel[~solution.states.on_corner & (solution.travel > corner)]])
        states = track.states(np.maximum(track.start + travel, track.corner_end))
        up, down = (forces(states, solution.assembly.loads, way * mu, way) for way in (1.0, -1.0))
        return cls(solution, travel, states, up, down)

    @property
    def pressure_angle(self) -> FloatArray:
        """Angle between the brace's pull and the roller's motion [rad]."""
        return pressure_angle(self.states, self.solution.assembly.track.brace_length)

    def pressure(self, travel: FloatArray) -> FloatArray:
        """Return the pressure of the contact on the way up at travels of any shape [Pa]; NaN where there is none."""
        track, mechanism = self.solution.assembly.track, self.solution.assembly.spec.mechanism
        states = track.states(np.maximum(track.start + np.ravel(travel), track.corner_end))
        contact = forces(states, self.solution.assembly.loads, mechanism.rolling_friction).contact
        return flank_pressure(self.solution.assembly, states, contact).reshape(np.shape(travel))


def _both(solution: Solution) -> tuple[Forces, Forces]:
    return solution.up, solution.down


def largest_pressure(flank: FlankSamples) -> tuple[float | None, float]:
    """Return the largest pressure of the contact on the way up [Pa], None without one, and about where it is [m]."""
    pressed = flank.pressure(flank.travel)
    known = np.isfinite(pressed)
    if not known.any():
        return None, 0.0
    travel, pressed = flank.travel[known], pressed[known]
    top, _ = extremes(flank.pressure, travel[None, :], pressed[None, :], uneven=True)
    return float(top[0]), float(travel[np.argmax(pressed)])


def _half_gap(flank: FlankSamples) -> float | None:
    up, down = flank.up.slider, flank.down.slider
    usable = np.isfinite(up) & np.isfinite(down) & (up + down > flank.solution.effort_error)
    return largest(((up - down) / np.where(usable, up + down, 1.0))[usable])


def _corner_peak(solution: Solution) -> float | None:
    """Return the peak force on the corner, on the way up [N]."""
    assembly = solution.assembly
    corner = min(solution.corner_travel, float(solution.travel[-1]))
    if corner <= 0 or any(low < corner for low, _ in solution.jams):  # next to a jam the force is unbounded
        return None

    def force(travel: FloatArray) -> FloatArray:
        states = assembly.track.states(assembly.track.start + np.ravel(travel))
        found = forces(states, assembly.loads, assembly.spec.mechanism.rolling_friction).slider
        return np.asarray(found.reshape(np.shape(travel)))

    travel = np.concatenate([[0.0], corner * ON_CORNER])[None, :]
    found = force(travel)
    known = np.isfinite(found[0])
    return float(extremes(force, travel[:, known], found[:, known], uneven=True)[0][0])


def values_of_built(built: Built) -> Mapping[str, Quantity]:
    """Return the scalar results by name."""
    found, used = built.registration, built.registration.used
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
        "registration_angle": found.angle,
        "registration_x": float(found.shift[0]),
        "registration_y": float(found.shift[1]),
        "registration_width": found.width,
        "registration_uncertainty": found.weakest(half_extent(built))[1],
        "registration_y_per_width": float(found.growth[1]),
        "profile_force_sd": float(np.nanstd(share, ddof=1)),
        "profile_force_share": float(np.nanstd(share, ddof=1) / np.nanmean(built.shares["design"][inside])),
        "rest_force_mean": float(np.nanmean(built.shares["rest"][inside])),
        "profile_coverage": profile_coverage(built),
        "loop_area_per_friction": loop_area_per_friction(built),
    }
    unknown = OF_THE_FORCE if large_holes(built) else ()
    known = {name: Quantity(value, *BUILT_DEFINITIONS[name]) for name, value in numbers.items()}
    why = "a part of the flanks was not measured"
    return known | {name: Quantity(None, *BUILT_DEFINITIONS[name], why) for name in unknown}


OF_THE_FORCE = ("profile_force_sd", "profile_force_share", "loop_area_per_friction")
"""What needs the force everywhere in the window."""


def pressure_of(built: Built, way: float) -> FloatArray:
    """Return the larger pressure of both contacts on the way up (1) or down (-1), the flank curved as designed [Pa]."""
    track, forces = built.assembly.track, built.forces(way)
    return flank_pressure(built.assembly, track.states(track.start + built.travel), np.maximum(forces[1], forces[2]))


def loop_area_per_friction(built: Built) -> float:
    """Return d(loop area)/d(friction) over the window [J], from a small friction either way."""
    loads, small = built.assembly.loads, 1e-6
    up, down = (built.sides.forces(loads, way * small, loads.rest_half_width)[0] for way in (1.0, -1.0))
    window = built.assembly.spec.analysis.window
    ends = between(window, requested_travel(built)) if window else None
    return _integral(built.travel + built.origin, up - down, ends) / small


def half_extent(built: Built) -> float:
    """Return half the height of the measured part [m]: where an angle is felt."""
    heights = np.concatenate([points[:, 1] for points in built.registration.points])
    return 0.5 * float(np.ptp(heights))


def errors_used(built: Built) -> FloatArray:
    """Return the errors of the points that count, both flanks [m]."""
    registration = built.registration
    return np.concatenate([error[keep] for error, keep in zip(registration.errors, registration.used, strict=True)])


def root_mean_square(values: FloatArray) -> float:
    """Return the root mean square of values."""
    return float(np.sqrt(np.mean(values**2)))
