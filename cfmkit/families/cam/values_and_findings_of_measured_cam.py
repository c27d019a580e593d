"""Scalar results and warnings of a mechanism with a measured cam, beside those of every cam."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.cam.contact_pressure import worst
from cfmkit.families.cam.findings import find_overstress, finding, is_overstretched
from cfmkit.families.cam.scalar_results import SCALAR_DEFINITIONS, integrate_between
from cfmkit.families.cam.solution_of_measured_cam import root_mean_square
from cfmkit.families.cam.statics import constant_force
from cfmkit.families.findings import mm
from cfmkit.families.largest_next_to_samples import largest_of_each
from cfmkit.families.rows import ScalarQuantity
from cfmkit.numerics.robust_statistics import neighbour_noise

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.solution_of_measured_cam import MeasuredCam
    from cfmkit.results import Finding


def _half_gap(built: MeasuredCam) -> FloatArray:
    up, down = built.forces(1.0)[0], built.forces(-1.0)[0]
    is_known = np.isfinite(up) & np.isfinite(down) & (up + down > 0)
    return largest_of_each((up - down)[is_known] / (up + down)[is_known])


def _count_outliers(built: MeasuredCam) -> int:
    return sum(int((~keep).sum()) for keep in built.registration.used)


def _force_sd(built: MeasuredCam) -> Any:
    return np.nan if built.has_large_hole else np.nanstd(built.shares["profile"][built.in_window], ddof=1)


def _loop_area_per_friction(built: MeasuredCam) -> float:
    """Return d(loop area)/d(friction) over the window [J], from a small friction either way."""
    if built.has_large_hole:
        return np.nan
    loads, small = built.assembly.loads, 1e-6
    up, down = (built.sides.forces(loads, direction * small, loads.rest_half_width)[0] for direction in (1.0, -1.0))
    return float(integrate_between(built.travel + built.origin, up - down, *built.window)[0]) / small


def _quantity(dimension: str, definition: str, function: Callable[[MeasuredCam], Any]) -> ScalarQuantity[MeasuredCam]:
    return ScalarQuantity(dimension, definition, function, "a part of the flanks was not measured")


_FUNCTIONS_OF_ANY_CAM: dict[str, Callable[[MeasuredCam], Any]] = {
    "force_constant": lambda built: built.assembly.profile.path.law.force_constant,
    "spring_stiffness": lambda built: built.assembly.loads.stiffness,
    "theoretical_force": lambda built: constant_force(built.assembly),
    "spring_elongation_max": lambda built: built.elongation.max(),
    "contact_force_max": lambda built: largest_of_each(*built.forces(1.0)[1:], *built.forces(-1.0)[1:]),
    "friction_half_gap_max": _half_gap,
}
_PROFILE_QUANTITIES: Mapping[str, ScalarQuantity[MeasuredCam]] = {
    "profile_rmse": _quantity(
        "length",
        "root mean square distance of the measured points from the design, along its normal",
        lambda built: root_mean_square(built.errors),
    ),
    "profile_sd": _quantity(
        "length",
        "standard deviation (n - 1) of the distances of the measured points from the design",
        lambda built: built.errors.std(ddof=1),
    ),
    "profile_mean": _quantity(
        "length",
        "mean distance of the measured points from the design, along its normal; positive: too much material",
        lambda built: built.errors.mean(),
    ),
    "profile_rmse_x": _quantity(
        "length",
        "root mean square error in x at the same y [SS, fig. 3]",
        lambda built: root_mean_square(built.used(built.across)),
    ),
    "profile_sd_x": _quantity(
        "length", "standard deviation (n - 1) of the error in x", lambda built: built.used(built.across).std(ddof=1)
    ),
    "profile_outliers": _quantity("count", "measured points that the registration ignored", _count_outliers),
    "registration_angle": _quantity(
        "angle", "rotation that registers the measured points to the design", lambda built: built.registration.angle
    ),
    "registration_x": _quantity(
        "length",
        "shift in x, after the rotation, that registers the measured points to the design",
        lambda built: built.registration.shift[0],
    ),
    "registration_y": _quantity(
        "length",
        "shift in y, after the rotation, that registers the measured points to the design",
        lambda built: built.registration.shift[1],
    ),
    "registration_width": _quantity(
        "length",
        "extra material on both flanks, along the normal, as fitted by the registration; 0: none",
        lambda built: built.registration.width,
    ),
    "registration_uncertainty": _quantity(
        "length",
        "standard deviation of the least certain motion of the registration",
        lambda built: built.registration.weakest(built.half_extent)[1],
    ),
    "registration_y_per_width": _quantity(
        "factor",
        "shift in y that the registration finds for a cam that is wider on both flanks, per width along its normal",
        lambda built: built.registration.growth[1],
    ),
    "profile_force_sd": _quantity(
        "force", "standard deviation (n - 1) of the force error due to the profile", _force_sd
    ),
    "profile_force_share": _quantity(
        "ratio",
        "standard deviation of the force error due to the profile, over the mean force of the design [SS, fig. 13: 0.8 "
        "%]",
        lambda built: _force_sd(built) / np.nanmean(built.shares["design"][built.in_window]),
    ),
    "rest_force_mean": _quantity(
        "force",
        "mean force error due to the rest length of the springs",
        lambda built: np.nanmean(built.shares["rest"][built.in_window]),
    ),
    "profile_coverage": _quantity(
        "ratio",
        "part of the window in which both rollers touch measured parts of the flanks",
        lambda built: 1.0 - sum(built.hole_shares),
    ),
    "loop_area_per_friction": _quantity(
        "energy",
        "area of the loop per unit of rolling friction, over the window: a measured loop area divided by it is the "
        "friction",
        _loop_area_per_friction,
    ),
}
MEASURED_QUANTITIES: Mapping[str, ScalarQuantity[MeasuredCam]] = {
    **{name: _quantity(*SCALAR_DEFINITIONS[name], function) for name, function in _FUNCTIONS_OF_ANY_CAM.items()},
    "contact_pressure_max": ScalarQuantity(
        *SCALAR_DEFINITIONS["contact_pressure_max"],
        lambda built: largest_of_each(built.pressure(1.0)),
        applies=lambda built: built.assembly.spec.mechanism.contact is not None,
    ),
    **_PROFILE_QUANTITIES,
}
"""Every scalar result of a mechanism with a measured cam, in the order in which they are shown."""
PROFILE_DEFINITIONS = {name: quantity.about for name, quantity in _PROFILE_QUANTITIES.items()}
TOO_NOISY = 2.0  # points are noisier than stated if their neighbours say so by this factor


def findings_of_built(built: MeasuredCam) -> list[Finding]:
    """Return what the user must know about the measured profile."""
    warnings = [*_built_mechanics(built), *_weak_registration(built), *_doubtful_points(built)]
    last = built.assembly.stroke
    if built.travel[-1] < last * (1 - 1e-9) or built.travel[0] > 0 or built.unmeasured:
        measured = f"{_join_spans(built.measured)} of the travel only, which is {mm(last)}"
        warnings.append(finding("part_measured", f"the flanks were measured for {measured}"))
    if built.unmeasured:
        warnings.append(finding("profile_hole", describe_unmeasured(built)))
    return warnings


def describe_unmeasured(built: MeasuredCam) -> str:
    """Return what is said of parts of the flanks without points."""
    spans = _join_spans(built.unmeasured)
    return f"a flank has no points where the rollers touch it from {spans} of travel: the force there is not known"


def _join_spans(spans: Iterable[tuple[float, float]]) -> str:
    return " and ".join(f"{mm(low)} to {mm(high)}" for low, high in spans)


def _built_mechanics(built: MeasuredCam) -> Iterator[Finding]:
    """Yield what is wrong with the mechanism that the measured cam is built into."""
    limit, longest = built.assembly.spec.mechanism.springs.max_elongation, float(built.elongation.max())
    if limit and is_overstretched(longest, limit):
        past = float(built.travel[np.argmax(built.elongation > limit)])
        yield finding(
            "spring_overstretched",
            f"the springs are stretched by {mm(longest)}, their limit is {mm(limit)}, reached at {mm(past)} of travel",
        )
    if (slack := built.elongation < 0).any():
        last = float(built.travel[slack][-1])
        yield finding("spring_slack", f"the springs carry no force up to {mm(last)} of travel: they are too long")
    pressed = built.pressure(1.0)
    if (top := worst(pressed)) is not None:
        place = f"at {mm(float(built.travel[top]))} of travel"
        if reported := find_overstress(built.assembly.spec.mechanism, float(pressed[top]), place):
            yield reported
    held = ~np.isfinite(built.forces(1.0)[0]) & np.isfinite(built.sides.slope[0]) & np.isfinite(built.sides.slope[1])
    if held.any():
        friction, places = built.assembly.spec.mechanism.rolling_friction, built.travel[held]
        yield finding(
            "up_jam",
            f"on the way up friction ({friction:g}) holds a roller at {int(held.sum())} of {len(held)} points, from "
            f"{mm(float(places[0]))} to {mm(float(places[-1]))} of travel: no force moves the slider there",
        )


def _weak_registration(built: MeasuredCam) -> Iterator[Finding]:
    """Yield how uncertain the place of the cam is along the direction that the points tell least of."""
    direction, deviation = built.registration.weakest(built.half_extent)
    rmse, lifted = root_mean_square(built.errors), float(built.registration.growth[1])
    if built.registration.width:
        more = "more" if built.registration.width > 0 else "less"
        yield finding(
            "width_error",
            f"the points are those of a cam with {mm(abs(built.registration.width))} {more} material on both flanks, "
            f"± {mm(built.registration.width_deviation)} (one standard deviation), which the registration allows for; "
            "'mechanism.profile.registration: motion' treats it as a shift of the cam, 'datum' moves no points",
        )
    if deviation > 0.1 * rmse and rmse > 0:
        names = ("the angle", "the shift in x", "the shift in y")
        parts = [f"{100 * part**2:.0f} % {name}" for part, name in zip(direction, names, strict=True) if part**2 > 0.05]
        taken = (
            f"; 0.01 mm more material on both flanks would be mistaken for a cam that lies {mm(1e-5 * abs(lifted))} "
            f"{'lower' if lifted > 0 else 'higher'}: the flanks are steep"
        )
        yield finding(
            "registration_weak",
            f"the position of the cam is known to ± {mm(deviation)} (one standard deviation) along its weakest "
            f"direction: {', '.join(parts)}{'' if built.registration.width else taken}",
        )


def _doubtful_points(built: MeasuredCam) -> Iterator[Finding]:
    """Yield what speaks against the measured points, or against what is said of their noise."""
    registration = built.registration
    if outliers := _count_outliers(built):
        count = sum(map(len, registration.used))
        yield finding(
            "profile_outliers", f"{outliers} of {count} points are far off or beyond the flank and are omitted"
        )
    stated = float(built.assembly.spec.mechanism.profile.noise or 0.0)
    flanks = zip(registration.parameters, registration.errors, registration.used, strict=True)
    seen = max(neighbour_noise(place[keep], error[keep]) for place, error, keep in flanks)
    if seen > TOO_NOISY * stated:
        yield finding(
            "noise_understated",
            f"neighbouring points scatter like a noise of {mm(seen)}, but 'mechanism.profile.noise' is {mm(stated)}; "
            "the difference is treated as waviness of the flank, and the force depends on its slope",
        )
    elif (rms := root_mean_square(built.errors)) < 0.8 * stated:
        yield finding(
            "noise_overstated",
            f"the points are {mm(rms)} (rms) off the design, less than the stated noise of {mm(stated)}: "
            "the errors of the profile cannot be distinguished from noise",
        )
