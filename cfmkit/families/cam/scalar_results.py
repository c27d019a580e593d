"""Scalar results of a cam mechanism as designed, beside the constant-force metrics of every family.

Those of measured cams stand in `measured_cam`; how those of a motion are computed stands in `dynamics.scalar_results`.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial, reduce
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.cam.geometry.slope_law_for_curve import CurveSlopeLaw
from cfmkit.families.cam.solution import ON_CORNER
from cfmkit.families.cam.statics import Losses, constant_force, normal_turn
from cfmkit.families.largest_next_to_samples import extreme_next_to, largest_of_each
from cfmkit.families.rows import ScalarQuantity, or_nan, quantity_of_each, row_of
from cfmkit.specs.evaluable_target_curve import TargetCurve
from cfmkit.stock.springs.extension_springs import ExtensionSpring
from cfmkit.stock.springs.stress_and_life import WIRE_DEFINITIONS, SpringInUse, wire_quantities

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.geometry.flank_from_roller_path import CamProfile
    from cfmkit.families.cam.solution import Solution
    from cfmkit.families.cam.statics import Assembly
    from cfmkit.results import Quantity


def _smallest_constant(cam: CamProfile) -> float:
    """Return the smallest force constant whose path the roller can follow [m]; NaN without one, and of curves."""
    law = cam.path.law
    return or_nan(law.smallest_force_constant(cam.roller_radius) if law.constant else None)


def curve_cut_for(assembly: Assembly) -> TargetCurve | None:
    """Return the curve of forces that the profile is cut for, with the springs built in; None of a constant force."""
    law, loads = assembly.profile.path.law, assembly.loads
    if not isinstance(law, CurveSlopeLaw):
        return None
    full = 4.0 * loads.stiffness * law.force_constant
    shape = replace(law.shape, values=tuple(full * share + loads.slider_weight for share in law.shape.values))
    return TargetCurve(shape, "force")


def _bearing_load(solution: Solution) -> FloatArray:
    """Return the largest load of one bearing of each mechanism [N]."""
    return largest_of_each(*(_bearing_share(solution) * state.contact for state in (solution.up, solution.down)))


def _bearing_share(solution: Solution) -> Any:
    """Return the load of one bearing over the contact force of its roller."""
    mechanism = solution.mechanism
    losses = solution.assembly.loads.losses or Losses(roller_radius=mechanism.roller_radius)
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
        contact = solution.evaluate_travel(middles, direction)[1].contact
        load = np.nan_to_num(np.maximum(contact, 0.0)) * _bearing_share(solution)
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
    return integrate_between(solution.displacement, up[kind] + down[kind], *solution.window)


def _loop_area(solution: Solution) -> FloatArray:
    """Return the energy that all friction takes over the window [J]; NaN where it is not finite, or nothing."""
    area = reduce(np.add, (_friction_energy(solution, kind) for kind in solution.up.lost or {}))
    return np.where(np.isfinite(area) & (area > 0), area, np.nan)


def _loop_energy(solution: Solution, kind: str) -> FloatArray:
    return np.where(np.isnan(_loop_area(solution)), np.nan, _friction_energy(solution, kind))


def _loop_share(solution: Solution, kind: str) -> FloatArray:
    return _friction_energy(solution, kind) / _loop_area(solution)


def integrate_between(places: FloatArray, values: FloatArray, low: Any, high: Any) -> FloatArray:
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


def _smallest_contact_force(solution: Solution) -> FloatArray:
    both = (solution.up.least_contact, solution.down.least_contact)
    return -largest_of_each(*(-contact[..., 1:] for contact in both if contact is not None))


def _smallest_clearance(solution: Solution) -> float:
    from cfmkit.families.cam.part_sizes_and_clearances import smallest_gap

    return smallest_gap(solution)


def _quantity(
    dimension: str,
    definition: str,
    function: Callable[[Solution], Any],
    applies: Callable[[Solution], bool] | None = None,
) -> ScalarQuantity[Solution]:
    return ScalarQuantity(dimension, definition, function, "", applies)


def _has_losses(solution: Solution) -> bool:
    return solution.assembly.loads.losses is not None


def _states_rating(name: str) -> Callable[[Solution], bool]:
    return lambda solution: getattr(solution.mechanism.bearings, name, None) is not None


def _has_band(solution: Solution) -> bool:
    return solution.band is not None


def _deviation_quantile(share: float) -> Callable[[Solution], float]:
    return lambda solution: float(np.quantile(solution.band.deviations(), share)) if solution.band else np.nan


FRICTION_KINDS = {
    "rolling": "rolling on the cam dissipates",
    "bearings": "the rollers' bearings dissipate",
    "pins": "slider pin and spring hooks dissipate",
    "guide": "the slider's guide dissipates",
}
"""Of friction, and what each does."""
SCALAR_QUANTITIES: Mapping[str, ScalarQuantity[Solution]] = {
    "force_constant": _quantity(
        "length",
        "A of the cut profile; the force is 4 K A [SS, eq. 1]",
        lambda solution: solution.assembly.profile.path.law.force_constant,
    ),
    "spring_stiffness": _quantity(
        "stiffness", "K, the sum of all parallel springs", lambda solution: solution.assembly.loads.stiffness
    ),
    "theoretical_force": _quantity(
        "force",
        "4 K A, plus the weights that the profile is shaped to carry: without friction, with the parts that it is "
        "cut for; for a target curve the largest value",
        lambda solution: constant_force(solution.assembly),
    ),
    "undercut_travel": _quantity(
        "length",
        "travel at the start over which the roller runs on a corner of the cam; 0 if there is no corner",
        lambda solution: solution.corner_travel,
    ),
    "roller_radius_max": _quantity(
        "length",
        "smallest radius of curvature of the roller path: the largest roller that fits",
        lambda solution: solution.read_each_cam(lambda cam: cam.path.law.tightest(cam.end)[1]),
    ),
    "force_constant_min": _quantity(
        "length",
        "smallest force constant whose path the roller can follow",
        lambda solution: solution.read_each_cam(_smallest_constant),
    ),
    "corner_force_max": _quantity(
        "force",
        "largest force on the way up while the roller pivots on the corner; none if friction holds it there",
        _corner_peak,
    ),
    "jam_travel": _quantity(
        "length",
        "travel at the start over which the mechanism self-locks: no force moves the slider up",
        lambda solution: solution.jam_travel,
    ),
    "spring_elongation_max": _quantity(
        "length",
        "largest elongation of the springs from their relaxed length; initial tension is no elongation",
        lambda solution: solution.elongation.max(axis=-1, keepdims=True),
    ),
    "contact_force_max": _quantity(
        "force",
        "largest contact force between a roller and the cam",
        lambda solution: largest_of_each(solution.up.contact, solution.down.contact),
    ),
    "pressure_angle_max": _quantity(
        "angle",
        "largest angle between the force of a brace and the motion of its roller, on the flank",
        lambda solution: solution.largest_angle_on_flank,
    ),
    "brace_angle_max": _quantity(
        "angle",
        "largest angle of a brace from the axis",
        lambda solution: np.arcsin(
            solution.states.x.max(axis=-1, keepdims=True) / solution.assembly.track.brace_length
        ),
    ),
    "friction_half_gap_max": _quantity(
        "ratio",
        "largest (up - down)/(up + down) on the flank: fixed by friction and geometry, no choice of the profile "
        "removes it",
        lambda solution: solution.largest_half_gap,
    ),
    "contact_pressure_max": _quantity(
        "stress",
        "largest Hertzian pressure of the line contact on the flank, on the way up; in motion, of both sides",
        lambda solution: solution.largest_pressure,
        lambda solution: solution.mechanism.contact is not None,
    ),
    **{
        f"loop_energy_{kind}": _quantity(
            "energy",
            f"energy that {words} over the window, up and down; the four losses add up to the loop's area",
            partial(_loop_energy, kind=kind),
            _has_losses,
        )
        for kind, words in FRICTION_KINDS.items()
    },
    **{
        f"loop_share_{kind}": _quantity(
            "ratio", f"share of the loop's area that {words}", partial(_loop_share, kind=kind), _has_losses
        )
        for kind, words in FRICTION_KINDS.items()
    },
    "bearing_load_max": _quantity(
        "force", "largest radial load of one roller bearing", _bearing_load, _states_rating("bore")
    ),
    "bearing_static_safety": _quantity(
        "factor",
        "static rating C0 of a bearing over its largest load [ISO 76]",
        lambda solution: solution.mechanism.bearings.static_rating / _bearing_load(solution),
        lambda solution: _states_rating("static_rating")(solution) and bool((_bearing_load(solution) > 0).any()),
    ),
    "bearing_life": _quantity(
        "count",
        "strokes up and down that 90 % of single bearings survive: L10 = (C/P)^3 million revolutions, for roller "
        "bearings (C/P)^(10/3), with the mean of P^3 over the revolutions of a stroke [ISO 281]",
        _bearing_life,
        _states_rating("dynamic_rating"),
    ),
    "contact_force_least": _quantity(
        "force",
        "smallest contact force beyond the first point; zero or negative if a roller leaves the cam",
        _smallest_contact_force,
        lambda solution: solution.up.least_contact is not None and solution.down.least_contact is not None,
    ),
    "manufacturing_force_share": _quantity(
        "ratio",
        "median over the sampled cams of the standard deviation of the force error along the travel, over the "
        "mean force [SS, fig. 13: 0.8 %]",
        _deviation_quantile(0.5),
        _has_band,
    ),
    "manufacturing_force_share_95": _quantity(
        "ratio",
        "95th percentile over the sampled cams of the standard deviation of the force error along the travel, over the "
        "mean force",
        _deviation_quantile(0.95),
        _has_band,
    ),
    **{name: quantity_of_each(name, about, _wires) for name, about in WIRE_DEFINITIONS.items()},
    "clearance_min": _quantity(
        "length",
        "smallest distance of the moving parts from plate, screws and each other",
        _smallest_clearance,
        lambda solution: solution.mechanism.envelope is not None,
    ),
}
"""Every scalar result of a quasi-static cam as designed, in the order in which they are shown."""
MOTION_DEFINITIONS = {
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
}
SCALAR_DEFINITIONS = {name: quantity.about for name, quantity in SCALAR_QUANTITIES.items()} | MOTION_DEFINITIONS
