"""Solution of a mechanism with a measured cam: both sides, parts of the force, scalar results and warnings.

`MeasuredCam` is the solved cam as built, with its measured flanks. It is computed over travels that count from its own
start; `MeasuredCam.origin` added to one gives the displacement of the specification. Where a flank was not measured the
force is not known (`MeasuredCam.unmeasured_spans`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.families.cam.contact_pressure import flank_pressure, index_of_largest, stress
from cfmkit.families.cam.findings import describe_overstretch, find_overstress, finding, is_overstretched
from cfmkit.families.cam.geometry.flank_from_roller_path import DesignFlank
from cfmkit.families.cam.geometry.slope_law import brace_tangent
from cfmkit.families.cam.mechanism_from_spec import displacement_origin
from cfmkit.families.cam.scalar_results import SCALAR_DEFINITIONS, integrate_between
from cfmkit.families.cam.solution import BRANCH_DIRECTIONS
from cfmkit.families.cam.statics import constant_force, levers, load_on_contact, load_on_slider
from cfmkit.families.findings import mm
from cfmkit.families.largest_next_to_samples import largest_of_each
from cfmkit.families.rows import ScalarQuantity
from cfmkit.numerics.holes_in_samples import MAX_HOLE_SHARE
from cfmkit.numerics.rigid_point_registration import gaps_across
from cfmkit.numerics.robust_statistics import neighbour_noise
from cfmkit.specs.units import window_places

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.statics import Assembly, Loads
    from cfmkit.numerics.rigid_point_registration import Registration
    from cfmkit.results import Finding


@dataclass(frozen=True)
class Sides:
    """Right and left roller at some slider positions: x [m] and slope of the track, each (n,)."""

    x: tuple[FloatArray, FloatArray]
    slope: tuple[FloatArray, FloatArray]

    def forces(self, loads: Loads, friction: float, rest: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the force on the slider and at the right and left contact [N]; NaN where nothing moves a side.

        Friction is negative on the way down; the springs are at rest at a half width [m].
        """
        pull, contacts = np.full_like(self.x[0], loads.slider_weight), []
        weight = loads.roller_weight
        spring = loads.stiffness * np.maximum(self.x[0] + self.x[1] - 2.0 * rest, 0.0)  # springs do not push
        for x, slope in zip(self.x, self.slope, strict=True):
            tangent = brace_tangent(x, loads.brace_length)
            turn, lever = levers(slope, tangent, friction)
            lever = np.where(lever > 0, lever, np.nan)
            pull = pull + load_on_slider(turn, slope, friction, spring, weight) / lever
            contacts.append(load_on_contact(slope, tangent, spring, weight) / lever)
        return pull, contacts[0], contacts[1]


@dataclass(frozen=True)
class BuiltTrack:
    """The track of a roller's centre on a built flank, mirrored to the right, over the slider's position."""

    slider: FloatArray  # (n,) increasing: height of the slider above the path's first point [m]
    # x, y, (n,): roller centre [m]
    x: FloatArray
    y: FloatArray
    slope: FloatArray  # (n,) dy/dx of the track
    contact: FloatArray  # (n,) arc length of the flank at which the roller touches it [m]
    # slider positions between which the contact is where nothing was measured [m]
    holes: tuple[tuple[float, float], ...] = ()

    def interpolate(self, slider: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return x [m] and slope of the track at slider positions; no slope is known in a hole."""
        slope = np.interp(slider, self.slider, self.slope)
        for low, high in self.holes:
            slope = np.where((slider > low) & (slider < high), np.nan, slope)
        return np.interp(slider, self.slider, self.x), slope


def flanks_of(assembly: Assembly) -> tuple[DesignFlank, DesignFlank]:
    """Return the right and the left flank of the design."""
    return DesignFlank(assembly.profile, 1.0), DesignFlank(assembly.profile, -1.0)


@dataclass(frozen=True, repr=False)
class MeasuredCam(ShortRepr):
    """Solution of a mechanism whose cam profile was measured after manufacture."""

    assembly: Assembly  # the design and the loads
    registration: Registration  # of the right and the left flank
    tracks: tuple[BuiltTrack, BuiltTrack]  # of the right and the left roller
    travel: FloatArray  # (n,) from the start of the design's roller path [m]

    @property
    def slider(self) -> FloatArray:
        """Heights of the slider above the first point of the design's roller path, (n,) [m]."""
        return self.assembly.track.start + self.travel

    @property
    def origin(self) -> float:
        """Length that is added to the travel to give the displacement [m]."""
        return displacement_origin(self.assembly)

    @property
    def displacement(self) -> FloatArray:
        """Displacements of the slider, (n,) [m]."""
        return self.travel + self.origin

    @cached_property
    def sides(self) -> Sides:
        """Both rollers at those travels."""
        (right_x, right), (left_x, left) = (track.interpolate(self.slider) for track in self.tracks)
        return Sides((right_x, left_x), (right, left))

    @cached_property
    def across(self) -> tuple[FloatArray, FloatArray]:
        """Errors of both flanks in x at the same y, positive outside [m]."""
        flanks = zip(flanks_of(self.assembly), self.registration.points, self.registration.parameters, strict=True)
        right, left = (flank.side * gaps_across(flank, points, u) for flank, points, u in flanks)
        return right, left

    @cached_property
    def shares(self) -> dict[str, FloatArray]:
        """Parts of the force: that of the design, and what each deviation adds to it, (n,) each [N]."""
        loads, mechanism, states = (
            self.assembly.loads,
            self.assembly.spec.mechanism,
            self.assembly.track.states(self.slider),
        )
        designed, rest = Sides((states.x, states.x), (states.slope, states.slope)), loads.rest_half_width
        ideal = designed.forces(loads, 0.0, mechanism.springs_rest_as_cut)[0]
        longer = designed.forces(loads, 0.0, rest)[0]
        smooth = self.sides.forces(loads, 0.0, rest)[0]
        return {
            "design": ideal,
            "rest": longer - ideal,
            "profile": smooth - longer,
            "friction_up": self.forces(1.0)[0] - smooth,
            "friction_down": self.forces(-1.0)[0] - smooth,
        }

    # --- between the points, as a `cfmkit.results.ClosedForm`: tracks are known between nodes ----------------------

    @cached_property
    def places(self) -> FloatArray:
        """Increasing displacements at which a side of the track bends [m]."""
        travel, start = self.travel, self.assembly.track.start
        nodes = np.concatenate([track.slider for track in self.tracks]) - start
        inner = nodes[(nodes > travel[0]) & (nodes < travel[-1])]
        return np.unique(np.concatenate([travel[[0, -1]], inner])) + self.origin

    @property
    def peaks(self) -> FloatArray:
        """Each of them: an extreme of a cut edge may stand anywhere [m]."""
        return self.places

    def effort(self, branch: str, places: FloatArray) -> FloatArray:
        """Return the force on the way up or down at displacements of any shape [N]."""
        return np.asarray(self._move_to(places).forces(BRANCH_DIRECTIONS[branch])[0].reshape(np.shape(places)))

    def stress(self, branch: str, places: FloatArray) -> FloatArray:
        """Return the stress below the more loaded contact at displacements of any shape [Pa]."""
        pressed = self._move_to(places).pressure(BRANCH_DIRECTIONS[branch])
        return np.asarray(stress(pressed).reshape(np.shape(places)))

    def _move_to(self, places: FloatArray) -> MeasuredCam:
        """Return the mechanism at other displacements."""
        return replace(self, travel=np.clip(np.ravel(places) - self.origin, self.travel[0], self.travel[-1]))

    # --- how much was measured, and what of it counts --------------------------------------------------------------

    @property
    def unmeasured_spans(self) -> tuple[tuple[float, float], ...]:
        """Travels between which the force is not known, in their order, those that overlap joined [m]."""
        joined: list[tuple[float, float]] = []
        start = self.assembly.track.start
        for low, high in sorted((low - start, high - start) for track in self.tracks for low, high in track.holes):
            low, high = max(low, float(self.travel[0])), min(high, float(self.travel[-1]))
            if joined and low <= joined[-1][1]:
                joined[-1] = joined[-1][0], max(joined[-1][1], high)
            elif low < high:
                joined.append((low, high))
        return tuple(joined)

    @property
    def measured_spans(self) -> tuple[tuple[float, float], ...]:
        """Travels between which both contacts are on measured points [m]."""
        ends = [
            float(self.travel[0]),
            *(place for hole in self.unmeasured_spans for place in hole),
            float(self.travel[-1]),
        ]
        return tuple((low, high) for low, high in zip(ends[::2], ends[1::2], strict=True) if low < high)

    @property
    def elongation(self) -> FloatArray:
        """Elongation of the springs, (n,) [m]."""
        opened = self.assembly.spec.mechanism.springs.tension_stretch
        return self.sides.x[0] + self.sides.x[1] - 2.0 * self.assembly.loads.rest_half_width - opened

    def forces(self, direction: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the force on the slider and at both contacts on the way up (1) or down (-1), each (n,) [N]."""
        loads, friction = self.assembly.loads, self.assembly.spec.mechanism.rolling_friction
        return self.sides.forces(loads, direction * friction, loads.rest_half_width)

    @property
    def requested_ends(self) -> tuple[float, float]:
        """Displacements at which the motion starts, and at which it was to end [m]."""
        start, end = float(self.travel[0]), self.assembly.spec.analysis.travel or float(self.travel[-1])
        return start + self.origin, end + self.origin

    @property
    def window(self) -> tuple[float, float]:
        """Displacements at which the window begins and ends, by default those of the whole travel [m]."""
        stated = self.assembly.spec.analysis.window
        if stated is not None:
            return window_places(stated, self.requested_ends)
        return float(self.travel[0] + self.origin), float(self.travel[-1] + self.origin)

    @property
    def in_window(self) -> NDArray[np.bool_]:
        """Which travels lie in the window, (n,); all if it holds fewer than 3."""
        (low, high), places = self.window, self.displacement
        inside: NDArray[np.bool_] = (places >= low) & (places <= high)
        return inside if inside.sum() > 2 else np.ones(len(places), dtype=bool)

    @property
    def hole_shares(self) -> list[float]:
        """Widths of the intervals in the window that were not measured, over that of the window."""
        low, high = self.window
        ends = ((start + self.origin, stop + self.origin) for start, stop in self.unmeasured_spans)
        return [max(min(stop, high) - max(start, low), 0.0) / (high - low) for start, stop in ends]

    @property
    def has_large_hole(self) -> bool:
        """Whether so much of the window was not measured that what holds over all of it is not known."""
        return any(share > MAX_HOLE_SHARE for share in self.hole_shares)

    @property
    def half_extent(self) -> float:
        """Half the height of the measured part [m]: where an angle is felt."""
        return 0.5 * float(np.ptp(np.concatenate([points[:, 1] for points in self.registration.points])))

    def select_used(self, values: Iterable[FloatArray]) -> FloatArray:
        """Return values of the points of both flanks that count."""
        return np.concatenate([item[keep] for item, keep in zip(values, self.registration.used, strict=True)])

    @cached_property
    def errors(self) -> FloatArray:
        """Errors of the points that count, of both flanks [m]."""
        return self.select_used(self.registration.errors)

    def pressure(self, direction: float) -> FloatArray:
        """Return the larger pressure of both contacts on the way up (1) or down (-1), the flank as designed [Pa]."""
        track, forces = self.assembly.track, self.forces(direction)
        states = track.states(track.start + self.travel)
        return flank_pressure(self.assembly, states, np.maximum(forces[1], forces[2]))


def root_mean_square(*parts: FloatArray) -> float:
    """Return the root mean square of all values of some arrays."""
    return float(np.sqrt(np.mean(np.square(np.concatenate(parts)))))


def _half_gap(built: MeasuredCam) -> FloatArray:
    """Return the largest half difference of both branches over their mean."""
    up, down = built.forces(1.0)[0], built.forces(-1.0)[0]
    is_known = np.isfinite(up) & np.isfinite(down) & (up + down > 0)
    return largest_of_each((up - down)[is_known] / (up + down)[is_known])


def _count_outliers(built: MeasuredCam) -> int:
    return sum(int((~keep).sum()) for keep in built.registration.used)


def _force_deviation_of_profile(built: MeasuredCam) -> Any:
    return np.nan if built.has_large_hole else np.nanstd(built.shares["profile"][built.in_window], ddof=1)


def _loop_area_per_friction(built: MeasuredCam) -> float:
    """Return d(loop area)/d(friction) over the window [J], from a small friction either way."""
    if built.has_large_hole:
        return np.nan
    loads, small = built.assembly.loads, 1e-6
    up, down = (built.sides.forces(loads, direction * small, loads.rest_half_width)[0] for direction in (1.0, -1.0))
    return float(integrate_between(built.displacement, up - down, *built.window)[0]) / small


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
        lambda built: root_mean_square(built.select_used(built.across)),
    ),
    "profile_sd_x": _quantity(
        "length",
        "standard deviation (n - 1) of the error in x",
        lambda built: built.select_used(built.across).std(ddof=1),
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
        "force", "standard deviation (n - 1) of the force error due to the profile", _force_deviation_of_profile
    ),
    "profile_force_share": _quantity(
        "ratio",
        "standard deviation of the force error due to the profile, over the mean force of the design [SS, fig. 13: 0.8 "
        "%]",
        lambda built: _force_deviation_of_profile(built) / np.nanmean(built.shares["design"][built.in_window]),
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
    if built.travel[-1] < last * (1 - 1e-9) or built.travel[0] > 0 or built.unmeasured_spans:
        measured = f"{_join_spans(built.measured_spans)} of the travel only, which is {mm(last)}"
        warnings.append(finding("part_measured", f"the flanks were measured for {measured}"))
    if built.unmeasured_spans:
        warnings.append(finding("profile_hole", describe_unmeasured(built)))
    return warnings


def describe_unmeasured(built: MeasuredCam) -> str:
    """Return what is said of parts of the flanks without points."""
    spans = _join_spans(built.unmeasured_spans)
    return f"a flank has no points where the rollers touch it from {spans} of travel: the force there is not known"


def _join_spans(spans: Iterable[tuple[float, float]]) -> str:
    return " and ".join(f"{mm(low)} to {mm(high)}" for low, high in spans)


def _built_mechanics(built: MeasuredCam) -> Iterator[Finding]:
    """Yield what is wrong with the mechanism that the measured cam is built into."""
    limit, longest = built.assembly.spec.mechanism.springs.max_elongation, float(built.elongation.max())
    if limit and is_overstretched(longest, limit):
        past = float(built.travel[np.argmax(built.elongation > limit)])
        yield finding("spring_overstretched", describe_overstretch(longest, limit, past))
    if (slack := built.elongation < 0).any():
        last = float(built.travel[slack][-1])
        yield finding("spring_slack", f"the springs carry no force up to {mm(last)} of travel: they are too long")
    pressed = built.pressure(1.0)
    if (top := index_of_largest(pressed)) is not None:
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
