"""Scalar results and findings of a cam that was measured."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.cam.contact import flank_pressure, overstressed, worst
from cfmkit.families.cam.findings import finding
from cfmkit.families.findings import mm
from cfmkit.numerics.robust import neighbour_noise
from cfmkit.results import Quantity
from cfmkit.specs.units import between

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.built import Built
    from cfmkit.results import Finding

TOO_NOISY = 2.0
"""Points are noisier than stated if their neighbours say so by this factor."""

BUILT_DEFINITIONS = {
    "profile_rmse": ("length", "root mean square distance of the measured points from the design, along its normal"),
    "profile_sd": ("length", "standard deviation (n - 1) of those distances"),
    "profile_mean": ("length", "mean of those distances: positive where material is left"),
    "profile_rmse_x": ("length", "root mean square error in x at the same y [SS, fig. 3]"),
    "profile_sd_x": ("length", "standard deviation (n - 1) of the error in x"),
    "profile_outliers": ("count", "measured points that the registration gave no weight"),
    "registration_angle": ("angle", "turn that lays the measured points on the design"),
    "registration_x": ("length", "shift in x after that turn"),
    "registration_y": ("length", "shift in y after that turn"),
    "registration_width": (
        "length",
        "material on both flanks, along the normal, that the registration fitted; 0: none",
    ),
    "registration_uncertainty": ("length", "standard deviation of the least certain motion of the registration"),
    "registration_y_per_width": (
        "ratio",
        "shift in y with which the registration answers a cam that is wider on both flanks, per width along its normal",
    ),
    "profile_force_sd": ("force", "standard deviation (n - 1) of what the profile's errors add to the force"),
    "profile_force_share": ("ratio", "that, over the mean force of the design [SS, fig. 13: 0.8 %]"),
    "rest_force_mean": ("force", "mean of what the springs' rest length adds to the force of the design"),
    "manufacturing_force_share": (
        "ratio",
        "median over the cams that are drawn of the standard deviation of the force error along the travel, over the "
        "mean force [SS, fig. 13: 0.8 %]",
    ),
    "manufacturing_force_share_95": ("ratio", "what 95 % of the cams that are drawn stay below in that"),
    "loop_area_per_friction": (
        "energy",
        "area of the loop per unit of rolling friction, over the window: a measured area over it is the friction",
    ),
}


def values_of_built(built: Built) -> Mapping[str, Quantity]:
    """Return the scalar results by name."""
    found, used = built.registration, built.registration.used
    errors = _used(built)
    across = np.concatenate([item[keep] for item, keep in zip(built.across, used, strict=True)])
    inside = window_mask(built)
    share = built.shares["profile"][inside]
    numbers = {
        "profile_rmse": _rms(errors),
        "profile_sd": float(errors.std(ddof=1)),
        "profile_mean": float(errors.mean()),
        "profile_rmse_x": _rms(across),
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
        "loop_area_per_friction": loop_area_per_friction(built),
    }
    return {name: Quantity(value, *BUILT_DEFINITIONS[name]) for name, value in numbers.items()}


def pressure_of(built: Built, way: float) -> FloatArray:
    """Return the larger pressure of both contacts on the way up (1) or down (-1), the flank curved as designed [Pa]."""
    track, forces = built.assembly.track, built.forces(way)
    return flank_pressure(built.assembly, track.states(track.start + built.travel), np.maximum(forces[1], forces[2]))


def window_mask(built: Built) -> NDArray[np.bool_]:
    """Return which travels lie in ``analysis.window``."""
    place, window = built.travel + built.origin, built.assembly.spec.analysis.window
    if window is None:
        return np.ones(len(place), dtype=bool)
    low, high = between(window, requested_travel(built))
    inside: NDArray[np.bool_] = (place >= low) & (place <= high)
    return inside if inside.sum() > 2 else np.ones(len(place), dtype=bool)


def requested_travel(built: Built) -> tuple[float, float]:
    """Return where the displacement starts and where it was to end [m]."""
    start, end = float(built.travel[0]), built.assembly.spec.analysis.travel or float(built.travel[-1])
    return start + built.origin, end + built.origin


def loop_area_per_friction(built: Built) -> float:
    """Return d(loop area)/d(friction) over the window [J], from a small friction either way."""
    loads, small = built.assembly.loads, 1e-6
    up, down = (built.sides.forces(loads, way * small, loads.rest_half_width)[0] for way in (1.0, -1.0))
    inside = window_mask(built)
    return float(np.trapezoid((up - down)[inside], built.travel[inside]) / small)


def half_extent(built: Built) -> float:
    """Return half the height of the measured part [m]: where an angle is felt."""
    heights = np.concatenate([points[:, 1] for points in built.registration.points])
    return 0.5 * float(np.ptp(heights))


def findings_of_built(built: Built) -> list[Finding]:
    """Return what the user must know about the measured profile."""
    found = [*_mechanics(built), *_weak(built), *_doubtful_points(built)]
    last = built.assembly.stroke
    if built.travel[-1] < last * (1 - 1e-9) or built.travel[0] > 0:
        span = f"{mm(float(built.travel[0]))} to {mm(float(built.travel[-1]))}"
        found.append(finding("part_measured", f"the flanks were measured for {span} of travel only, of {mm(last)}"))
    return found


def _mechanics(built: Built) -> Iterator[Finding]:
    """Yield what is wrong with the mechanism that the measured cam is built into."""
    limit, longest = built.assembly.spec.mechanism.springs.max_elongation, float(built.elongation.max())
    if limit and longest > limit * (1 + 1e-9):
        past = float(built.travel[np.argmax(built.elongation > limit)])
        yield finding(
            "spring_overstretched",
            f"the springs are stretched by {mm(longest)}, their limit is {mm(limit)}, reached at {mm(past)} of travel",
        )
    if (slack := built.elongation < 0).any():
        last = float(built.travel[slack][-1])
        yield finding("spring_slack", f"the springs carry nothing up to {mm(last)} of travel: they are too long")
    pressed = pressure_of(built, 1.0)
    if (top := worst(pressed)) is not None:
        place = f"at {mm(float(built.travel[top]))} of travel"
        if told := overstressed(built.assembly.spec.mechanism, float(pressed[top]), place):
            yield told
    held = ~np.isfinite(built.forces(1.0)[0])
    if held.any():
        friction, places = built.assembly.spec.mechanism.rolling_friction, built.travel[held]
        yield finding(
            "up_jam",
            f"on the way up friction ({friction:g}) holds a roller at {int(held.sum())} of {len(held)} points, from "
            f"{mm(float(places[0]))} to {mm(float(places[-1]))} of travel: no force moves the slider there",
        )


def _weak(built: Built) -> Iterator[Finding]:
    """Yield how uncertain the place of the cam is along the direction that the points tell least of."""
    direction, deviation = built.registration.weakest(half_extent(built))
    rmse, lifted = _rms(_used(built)), float(built.registration.growth[1])
    if built.registration.width:
        more = "more" if built.registration.width > 0 else "less"
        yield finding(
            "width_error",
            f"the points are those of a cam with {mm(abs(built.registration.width))} {more} material on both flanks, "
            f"± {mm(built.registration.width_deviation)} (one standard deviation), and are laid on the design so; "
            "'mechanism.profile.registration: motion' takes it for a place, 'datum' moves nothing",
        )
    if deviation > 0.1 * rmse and rmse > 0:
        names = ("the angle", "the shift in x", "the shift in y")
        parts = [f"{100 * part**2:.0f} % {name}" for part, name in zip(direction, names, strict=True) if part**2 > 0.05]
        taken = (
            f"; and 0.01 mm more on both flanks would be taken for a cam that lies {mm(1e-5 * abs(lifted))} "
            f"{'lower' if lifted > 0 else 'higher'}: the flanks are steep"
        )
        yield finding(
            "registration_weak",
            f"where the cam lies is known to ± {mm(deviation)} (one standard deviation) along its weakest "
            f"direction: {', '.join(parts)}{'' if built.registration.width else taken}",
        )


def _doubtful_points(built: Built) -> Iterator[Finding]:
    """Yield what speaks against the measured points, or against what is said of their noise."""
    outliers = sum(int((~keep).sum()) for keep in built.registration.used)
    if outliers:
        count = sum(len(keep) for keep in built.registration.used)
        yield finding("profile_outliers", f"{outliers} of {count} points lie far off or beyond the flank: left out")
    stated = float(built.assembly.spec.mechanism.profile.noise or 0.0)
    seen = max(neighbour_noise(one, use) for one, use in _along(built))
    if seen > TOO_NOISY * stated:
        yield finding(
            "noise_understated",
            f"neighbouring points differ as with a noise of {mm(seen)}, but 'mechanism.profile.noise' is {mm(stated)}: "
            "the difference is taken for waves of the flank, and the force follows their slope",
        )
    elif _rms(_used(built)) < 0.8 * stated:
        yield finding(
            "noise_overstated",
            f"the points are {mm(_rms(_used(built)))} (rms) off the design, less than the stated noise of "
            f"{mm(stated)}: nothing of the profile's errors is left to be seen",
        )


def _used(built: Built) -> FloatArray:
    """Return the errors of the points that count, both flanks [m]."""
    registration = built.registration
    return np.concatenate([error[keep] for error, keep in zip(registration.errors, registration.used, strict=True)])


def _along(built: Built) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield path coordinates and errors of the points that count, one flank after the other [m]."""
    registration = built.registration
    for place, error, keep in zip(registration.parameters, registration.errors, registration.used, strict=True):
        yield place[keep], error[keep]


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))
