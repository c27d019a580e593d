"""Quasi-static analysis of a cam as it was built, from measured points of its flanks: where rollers run on them.

The points are registered to the design, both flanks by one motion; what is left is the error of the profile. Both sides
may differ: with the spring force S = K (x_R + x_L - 2 x0) on each roller the slider's force is the sum of what each
side needs. The force is split into what the design gives, and what rest length, profile and friction add to it, one
after the other, so that the parts add up.

Where rollers run on flanks as they were built: the outermost place that no point of the flank forbids. A roller is
larger than the waves of a cut edge: it rides on the crests and bridges hollows narrower than itself. Its centre is on
the design's roller path, moved along the normal until the circle touches the built flank and cuts it nowhere; the
direction of its track is perpendicular to the contact's normal.

[SS] S. Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819, sec. 2.3 and 3.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.curves import Column, Curve
from cfmkit.errors import DataError
from cfmkit.families.cam.contact_pressure import allowable_stress, stress
from cfmkit.families.cam.findings import finding, warn_of_asymmetry, warn_of_neglected_friction
from cfmkit.families.cam.geometry.flank_from_roller_path import BuiltFlank, DesignFlank, arc_lengths
from cfmkit.families.cam.measured_cam import (
    MEASURED_QUANTITIES,
    BuiltTrack,
    MeasuredCam,
    describe_unmeasured,
    findings_of_built,
    flanks_of,
)
from cfmkit.families.cam.mechanism_from_spec import (
    assemble,
    check_first_pose,
    check_springs,
    count_before_overlap,
)
from cfmkit.families.cam.scalar_results import curve_cut_for
from cfmkit.families.cam.statics import Assembly, target_force
from cfmkit.families.findings import CannotBuild, mm, no_result
from cfmkit.families.rows import values_of_one
from cfmkit.numerics.holes_in_samples import MAX_HOLE_SHARE, holes_between
from cfmkit.numerics.rigid_point_registration import (
    CurveFrame,
    Registration,
    feet,
    register,
    registered_where_it_is,
)
from cfmkit.numerics.smoothing_spline import fit_smoothing_spline
from cfmkit.results import Result, Status
from cfmkit.specs.data_file_paths import DataSource
from cfmkit.specs.units import window_places
from cfmkit.tables.measured_outline import read_sides

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.spec import CamSpec
    from cfmkit.results import Finding


MAX_HEIGHT_DEVIATION = 0.01  # points are those of another part if they are off the design by this part of their height
WIDTH_CERTAIN = 5.0
"""An error of width is taken out of the points only if it is larger than this many of its standard deviations."""
WIDTH_EXPLAINS = 0.6
"""It must also leave less than this part of the variance that the points' errors have if it is not taken out."""


def analyze_built(spec: CamSpec) -> Result:
    """Return the loop of a cam whose flanks were measured.

    Raises DataError if the file with the points cannot be used.
    """
    try:
        assembly = assemble(spec)
        check_first_pose(assembly)
        registration = register_cam(assembly)
        tracks = _make_tracks(assembly, registration)
        travel, ended = _travel(assembly, tracks)
        built = MeasuredCam(assembly, registration, tracks, travel)
        check_springs(built.elongation, built.forces(1.0)[1], assembly.loads.rest_half_width)
    except CannotBuild as problem:
        return no_result(spec, problem.finding)
    short = ended.message if ended else describe_unmeasured(built) if built.has_large_hole else ""
    warnings = [ended] if ended else []
    asked = assembly.spec.analysis.model_copy(
        update={"travel": float(travel[-1]), "gravity": spec.gravity, "fidelity": "quasi-static"}
    )
    return Result(
        spec=assembly.spec.model_copy(update={"analysis": asked}),
        status=Status.PARTIAL if short else Status.COMPLETE,
        message=short,
        curves=(_curve(built),),
        closed=built,
        values=values_of_one(MEASURED_QUANTITIES, built),
        warnings=(
            *warnings,
            *warn_of_asymmetry(spec),
            *warn_of_neglected_friction(spec, "the model of a measured cam"),
            *findings_of_built(built),
        ),
        travel=built.requested_ends,
        valid=tuple((low + built.origin, high + built.origin) for low, high in built.measured_spans),
        target=(
            target_force(spec, assembly)
            if spec.design or assembly.spec.mechanism.profile.curve
            else float(built.shares["design"][-1])
        ),
        target_curve=None if spec.target_curve else curve_cut_for(assembly),
        allowable_stress=allowable_stress(spec.mechanism),
        state=built,
    )


def register_cam(assembly: Assembly) -> Registration:
    """Return the measured points of an assembly's cam, registered to its design."""
    source = assembly.spec.mechanism.profile.file
    if not isinstance(source, DataSource):
        raise DataError("the specification names no file with measured points")
    points, flanks = read_sides(source.path), flanks_of(assembly)
    method = assembly.spec.mechanism.profile.registration or "auto"
    if method == "datum":
        registration = registered_where_it_is(points, flanks, register(points, flanks, width=True))
    elif method == "auto":
        registration = _as_the_points_tell(register(points, flanks), register(points, flanks, width=True))
    else:
        registration = register(points, flanks, width=method == "width")
    _check_fit(registration, source)
    return registration


def _as_the_points_tell(moved: Registration, widened: Registration) -> Registration:
    """Return the registration with an error of width where that explains what waves and noise do not, else without.

    Long waves look like a width, too: it is believed only where it is certain and takes away much of the errors, on
    the points that count with it.
    """
    if not any(use.any() for use in widened.used):
        return moved
    with_width, without = (
        np.concatenate([error[use] for error, use in zip(item.errors, widened.used, strict=True)])
        for item in (widened, moved)
    )
    certain = abs(widened.width) > WIDTH_CERTAIN * widened.width_deviation
    explains = np.mean((with_width - widened.width) ** 2) < WIDTH_EXPLAINS * np.mean(without**2)
    return widened if certain and explains else moved


def _check_fit(registration: Registration, name: str) -> None:
    """Refuse points that are not those of the design's flanks."""
    for use in registration.used:
        if int(use.sum()) < 20:
            raise DataError(
                f"{name}: only {int(use.sum())} points of a flank lie on the design; is it the same cam, with x "
                "across, y upwards and the right units?"
            )
    errors = np.concatenate([error[use] for error, use in zip(registration.errors, registration.used, strict=True)])
    height = max(float(np.ptp(points[:, 1])) for points in registration.points)
    if (rms := float(np.sqrt(np.mean(errors**2)))) > MAX_HEIGHT_DEVIATION * height:
        raise DataError(
            f"{name}: registered to the design, the points are still {mm(rms)} (rms) off it; is it the same cam?"
        )


def _make_tracks(assembly: Assembly, registration: Registration) -> tuple[BuiltTrack, BuiltTrack]:
    mechanism, design = assembly.spec.mechanism, flanks_of(assembly)[0]
    noise = float(mechanism.profile.noise or 0.0)
    # The left flank's feet and errors are those of its mirror image.
    tracks = []
    for u, error, used in zip(registration.parameters, registration.errors, registration.used, strict=True):
        flank = built_flank(design, u[used], error[used], noise)
        track = built_track(flank, mechanism.roller_radius, mechanism.brace_length)
        tracks.append(replace(track, holes=_holes(track, np.sort(np.interp(u[used], *flank.arc)), assembly)))
    return tracks[0], tracks[1]


def _holes(track: BuiltTrack, places: FloatArray, assembly: Assembly) -> tuple[tuple[float, float], ...]:
    """Return where the slider is while the contact is in a hole between measured points, if that is large [m]."""
    holes = []
    for low, high in holes_between(places, places[0], places[-1]):
        inside = track.slider[(track.contact > low) & (track.contact < high)]
        if len(inside) and np.ptp(inside) > MAX_HOLE_SHARE * _narrowest_window(track, assembly):
            holes.append((float(inside[0]), float(inside[-1])))
    return tuple(holes)


def _narrowest_window(track: BuiltTrack, assembly: Assembly) -> float:
    """Return the width of the narrowest window over which something is measured, by default of the travel [m]."""
    spec = assembly.spec
    travel = spec.analysis.travel or float(track.slider[-1]) - assembly.track.start
    windows = [window_places(ends, (0.0, travel)) for _, ends in spec.windows()]
    return min([travel, *(high - low for low, high in windows)])


def _travel(assembly: Assembly, tracks: tuple[BuiltTrack, BuiltTrack]) -> tuple[FloatArray, Finding | None]:
    """Return the travels at which both sides were measured, and why they are short, if they are [m]."""
    start = assembly.track.start
    low = max(0.0, *(float(track.slider[0]) - start for track in tracks))
    high = min(float(track.slider[-1]) for track in tracks) - start
    asked, name = assembly.spec.analysis.travel, assembly.spec.mechanism.profile.file
    if high <= low:
        raise DataError(f"{name}: the two flanks were measured at different heights")
    if asked is not None and asked <= low:
        raise DataError(
            f"{name}: the requested travel is {mm(asked)}, but the flanks were measured from {mm(low)} of travel on "
            "only; request more ('analysis.travel')"
        )
    short = None
    if asked is not None and asked > high * (1 + 1e-9):
        message = f"the requested travel is {mm(asked)}, but the flanks were measured up to {mm(high)} of travel only"
        short = finding("outside_profile", message)
    travel = np.linspace(low, min(asked or high, high), assembly.spec.analysis.points)
    x = tracks[0].interpolate(start + travel)[0], tracks[1].interpolate(start + travel)[0]
    count, overlap = count_before_overlap(travel, start + travel, x, assembly.spec.mechanism)
    return travel[:count], overlap or short


def _curve(built: MeasuredCam) -> Curve:
    """Return the closed loop with the parts of the force."""
    up, down = built.forces(1.0), built.forces(-1.0)

    def loop(up_column: FloatArray, down_column: FloatArray | None = None) -> FloatArray:
        return np.concatenate([up_column, (up_column if down_column is None else down_column)[::-1]])

    shares = built.shares
    extra = {
        "contact_force_right": Column(loop(up[1], down[1]), "force"),
        "contact_force_left": Column(loop(up[2], down[2]), "force"),
        "spring_elongation": Column(loop(built.elongation), "length"),
        "roller_x_right": Column(loop(built.sides.x[0]), "length"),
        "roller_x_left": Column(loop(built.sides.x[1]), "length"),
        "force_of_design": Column(loop(shares["design"]), "force"),
        "added_by_rest_length": Column(loop(shares["rest"]), "force"),
        "added_by_profile": Column(loop(shares["profile"]), "force"),
        "added_by_friction": Column(loop(shares["friction_up"], shares["friction_down"]), "force"),
    }
    if built.assembly.spec.mechanism.contact:
        pressed = loop(built.pressure(1.0), built.pressure(-1.0))
        extra |= {"contact_pressure": Column(pressed, "stress"), "max_stress": Column(stress(pressed), "stress")}
    with np.errstate(invalid="ignore"):
        stable = (loop(up[1], down[1]) > 0) & (loop(up[2], down[2]) > 0)
    branch = np.repeat(["load", "unload"], len(built.travel))
    return Curve(loop(built.displacement), loop(up[0], down[0]), branch, stable, extra)


PLACE_STEP = 5e-5  # distance of the places that are computed [m]
CONTACT_REACH = 2e-3  # how far along the flank, beside the place where the design touches, contact is sought [m]


def built_flank(design: DesignFlank, points: FloatArray, errors: FloatArray, noise: float) -> BuiltFlank:
    """Return a flank from registered points, whose distances from a right flank have a standard deviation [m].

    Their feet are path coordinates (n,) in any order [m]; points at one place are averaged.
    """
    arc = arc_lengths(design)
    along = np.interp(points, *arc)
    places, inverse, counts = np.unique(np.round(along, 9), return_inverse=True, return_counts=True)
    mean = np.bincount(inverse, errors) / counts
    return BuiltFlank(design, fit_smoothing_spline(places, mean, noise), arc)


def built_track(flank: BuiltFlank, roller_radius: float, brace_length: float) -> BuiltTrack:
    """Return the track of a roller's centre on a built flank, which is mirrored to the right."""
    low, high = flank.ends
    places = np.linspace(low, high, max(int((high - low) / PLACE_STEP), 50) + 1)
    base = flank.design.frame(np.interp(places, flank.arc[1], flank.arc[0]))
    centers = base.points + roller_radius * base.normals
    lift, contact = _lift(flank, places, (centers, base.normals), roller_radius)
    for _ in range(3):
        contact = feet(flank, centers + lift[:, None] * base.normals, contact)
        at = flank.frame(contact)
        gap = centers + lift[:, None] * base.normals - at.points
        lift = lift + (roller_radius - np.hypot(gap[:, 0], gap[:, 1])) / (at.normals * base.normals).sum(axis=1)
    centers = centers + lift[:, None] * base.normals
    return track_over_slider(centers, flank.frame(contact), contact, brace_length)


def _lift(
    flank: BuiltFlank, places: FloatArray, nominal: tuple[FloatArray, FloatArray], radius: float
) -> tuple[FloatArray, FloatArray]:
    """Return how far the circle must move along the normal to cut the flank nowhere, and where it then touches."""
    centers, normals = nominal
    points = flank.frame(places).points
    count, reach = len(places), max(int(CONTACT_REACH / (places[1] - places[0])), 2)
    best, where = np.full(count, -np.inf), np.zeros(count, dtype=int)
    for shift in range(-reach, reach + 1):
        neighbour = np.clip(np.arange(count) + shift, 0, count - 1)
        gap = points[neighbour] - centers
        along = (gap * normals).sum(axis=1)
        beside = (gap * gap).sum(axis=1) - along**2
        need = along + np.sqrt(np.maximum(radius**2 - beside, 0.0))
        better = need > best
        best, where = np.where(better, need, best), np.where(better, neighbour, where)
    return best, places[where]


def track_over_slider(centers: FloatArray, frame: CurveFrame, contact: FloatArray, brace: float) -> BuiltTrack:
    """Return the track of a roller's centre over the slider's position, of centres that touch a flank in frames."""
    x, y = centers.T
    slider = y + np.sqrt((brace - x) * (brace + x))
    # Where a wave makes the slider fall the roller jumps to the next place at which it rises beyond.
    rising = np.concatenate([[True], np.diff(np.maximum.accumulate(slider)) > 0])
    slope = frame.normals[:, 0] / -frame.normals[:, 1]
    return BuiltTrack(slider[rising], x[rising], y[rising], slope[rising], contact[rising])
