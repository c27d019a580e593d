"""From a cam specification to the parts that the model works with, and whether these can be where it puts them.

Rollers must have room beside each other, each flank must stay on its own side of the axis, the cam
can push a roller but not pull it, and springs that hold the rollers must not go slack. A mechanism whose first pose
breaks one of these is not assembled; where a later pose does, what follows does not happen. Springs that are
slack at the start and tighten later can be built: the force is zero until they do (`spring_slack` warns of it).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.families.cam.findings import finding
from cfmkit.families.cam.geometry.flank_from_roller_path import CamProfile, WholeCamUndercut, cut_cam
from cfmkit.families.cam.geometry.path import CAMS_KEPT, RollerPath, reached_path
from cfmkit.families.cam.geometry.roller_track_on_cut_cam import NoTrack, Track, track_of
from cfmkit.families.cam.geometry.slope_law import SlopeLaw
from cfmkit.families.cam.geometry.slope_law_for_curve import CurveSlopeLaw
from cfmkit.families.cam.statics import STANDARD_GRAVITY, TRAVEL_RTOL, Assembly, Loads, Losses
from cfmkit.families.cam.target_curve_limits import check_bends, with_curve
from cfmkit.families.findings import CannotBuild, mm
from cfmkit.families.guide_friction import GuideFriction
from cfmkit.families.rows import agree, fails, refuse_columns, remember_plain

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.geometry.spec import Profile
    from cfmkit.families.cam.spec import CamSpec, Mechanism, Mounting
    from cfmkit.results import Finding


def resolve(spec: CamSpec) -> CamSpec:
    """Return the spec with the cut profile written out: what was left to follow the mechanism is now fixed."""
    mechanism = spec.mechanism
    strokes = mechanism.profile.stroke, spec.analysis.travel, spec.design.stroke if spec.design else None
    stroke = next((value for value in strokes if value is not None), 0.5 * mechanism.brace_length)
    changes: dict[str, object] = {"profile": _write_out(mechanism.profile, mechanism, stroke)}
    if (left := mechanism.left) and left.profile:
        profile = _write_out(left.profile, left_side(spec).mechanism, left.profile.stroke or stroke)
        changes["left"] = left.model_copy(update={"profile": profile})
    return spec.model_copy(update={"mechanism": mechanism.model_copy(update=changes)})


def _write_out(profile: Profile, mechanism: Mechanism, stroke: float) -> Profile:
    """Return a profile whose omitted values are those of the mechanism around it."""
    preload = mechanism.effective_preload if profile.preload is None else profile.preload
    written = {
        name: getattr(mechanism if getattr(profile, name) is None else profile, name)
        for name in ("brace_length", "rest_half_width", "roller_radius")
    }
    written |= {"preload": preload if np.any(preload) else None, "stroke": stroke}
    return profile.model_copy(update=written)


def left_side(spec: CamSpec) -> CamSpec:
    """Return the spec whose right side is the left side of a resolved one."""
    mechanism, left = spec.mechanism, spec.mechanism.left
    if left is None:
        return spec
    changes = {
        "brace_length": left.brace_length or mechanism.brace_length,
        "roller_radius": left.roller_radius or mechanism.roller_radius,
        "profile": left.profile or mechanism.profile,
    }
    return spec.model_copy(update={"mechanism": mechanism.model_copy(update=changes)})


def slope_law(spec: CamSpec) -> SlopeLaw:
    """Return the slope law of a resolved spec's profile."""
    profile = spec.mechanism.profile
    x0, brace, preload = profile.rest_half_width, profile.brace_length, profile.preload
    assert x0 is not None  # of a resolved spec
    assert brace is not None
    springs = 0.0 if preload is None else 0.5 * preload
    plain = SlopeLaw(profile.force_constant, x0, brace, profile.friction, profile.slope_factor, springs)
    if profile.curve is None:
        return plain
    return with_curve(plain, profile.curve.shape, profile.stroke)


class Weights(NamedTuple):
    """Weight on one roller and on the slider, against the slider's way out and across it; and what the guide carries.

    All in newtons, `off_plane` that of all parts.
    """

    along: tuple[float, float] = (0.0, 0.0)
    sideways: tuple[float, float] = (0.0, 0.0)
    off_plane: float = 0.0


def directions(mounting: Mounting | None) -> tuple[float, float, float]:
    """Return the shares of gravity against the slider's way out, to the right of it and out of the cam's plane."""
    if mounting is None:
        return 1.0, 0.0, 0.0
    angles = mounting.elevation, mounting.roll
    (up, turned), (across, upright) = ([_exact(function(angle)) for angle in angles] for function in (np.sin, np.cos))
    return up, across * upright, across * turned


def _exact(share: Any) -> Any:
    """Return a share without the rounding that is left of a right angle."""
    return np.where(np.abs(share) < 1e-15, 0.0, share)[()]


def weights_of(mechanism: Mechanism) -> Weights:
    """Return what the parts weigh, in the directions that the mounting gives: each brace counts half at each end."""
    masses = mechanism.masses
    if masses is None:
        return Weights()
    roller, slider = (
        STANDARD_GRAVITY * (masses.roller + 0.5 * masses.brace),
        STANDARD_GRAVITY * (masses.slider + masses.brace),
    )
    along, right, off = directions(mechanism.mounting)
    return Weights((along * roller, along * slider), (right * roller, right * slider), off * (2.0 * roller + slider))


def losses_of(mechanism: Mechanism) -> Losses | None:
    """Return the friction of bearings, pins and guide; None if nothing rubs but the rollers."""
    bearings, pins, guide = mechanism.bearings, mechanism.pins, GuideFriction.from_guide(mechanism.guide)
    bearing = 0.5 * bearings.bore * bearings.friction if bearings else 0.0
    pin = 0.5 * pins.diameter * pins.friction if pins else 0.0
    if not agree(np.not_equal(bearing, 0.0)) and not agree(np.not_equal(pin, 0.0)) and not guide.is_present:
        return None
    return Losses(
        rolling=mechanism.rolling_friction, roller_radius=mechanism.roller_radius, bearing=bearing, pin=pin, guide=guide
    )


def loads_of(spec: CamSpec, stiffness: float, rest: float) -> Loads:
    """Return what acts on rollers and slider with springs of a stiffness that are at rest at a half width."""
    weights, brace = weights_of(spec.mechanism) if spec.gravity else Weights(), spec.mechanism.brace_length
    acting = (*weights.along, weights.sideways, weights.off_plane)
    return Loads(stiffness, rest, brace, *acting, losses=losses_of(spec.mechanism))


def assemble(spec: CamSpec) -> Assembly:
    """Return the mechanism put together.

    Raises CannotBuild if it cannot exist; the finding says why.
    """
    spec = resolve(spec)
    mechanism, law, method = spec.mechanism, slope_law(spec), spec.analysis.path_method
    stroke, radius, offset = mechanism.profile.stroke, mechanism.profile.roller_radius, mechanism.profile.offset
    assert stroke is not None  # of a resolved spec
    assert radius is not None
    lengths = stroke, radius, offset, mechanism.roller_radius, mechanism.brace_length, *law.numbers
    if agree(law.friction != 0.0) or method == "ode":
        refuse_columns(*lengths)  # the height of such a path is no formula
    missing = np.maximum(-offset, 0.0)
    check_start(law, (mechanism.roller_radius, mechanism.brace_length), (radius + missing, law.brace_length))
    path, end, reached = reached_path(law, stroke, method)
    shortfall = _shortfall(law, stroke, end, reached)
    profile = cut_profile(path, radius, end)
    # A flank with material missing is the flank for a larger roller, trimmed where that one undercuts it.
    track = _make_track(cut_profile(path, radius + missing, end) if agree(missing > 0.0) else profile, mechanism)
    loads = loads_of(spec, mechanism.springs.total, mechanism.springs_rest)
    return Assembly(spec, profile, track, loads, reached, shortfall)


def assemble_sides(spec: CamSpec) -> tuple[Assembly, Assembly]:
    """Return the right and the left side put together; one and the same where nothing differs on the left.

    Raises CannotBuild if one of them cannot exist; the finding says why.
    """
    right = assemble(spec)
    return right, assemble(left_side(right.spec)) if spec.mechanism.left else right


def displacement_origin(assembly: Assembly) -> float:
    """Return what turns travel into the displacement that the spec asks for [m]."""
    origin = assembly.spec.analysis.origin
    if origin == "path-start":
        return 0.0
    below = cam_start_height(assembly.profile) if origin == "slider-from-cam" else 0.0
    return assembly.track.start - below


def check_start(law: SlopeLaw, *rollers: tuple[float, float]) -> None:
    """Raise CannotBuild if there is no mechanism to begin with, whatever the force constant.

    That is so if the braces do not reach, the rollers have no room, or the path does not rise. `rollers` are radius and
    brace length [m] of the one built in, and of the one that the cam is cut for.
    """
    x0, shortest = law.rest_half_width, np.minimum(rollers[0][1], rollers[-1][1])
    if fails(x0 >= shortest * (1 - 1e-6)):
        raise finding.cannot_build(
            "brace_too_short",
            f"the braces ({mm(shortest)}) do not reach from the axis to the rollers, which start at "
            f"{mm(x0)} from it; use a brace longer than {mm(x0)} ('mechanism.brace_length')",
        )
    for radius, brace in rollers:
        if fails(radius >= brace):
            raise finding.cannot_build(
                "rollers_collide",
                f"there is no room for two rollers with a radius of {mm(radius)} on braces of {mm(brace)}; "
                "use smaller rollers ('mechanism.roller_radius')",
            )
    p = law.frictionless(x0)
    if fails(np.logical_or(p + law.friction <= 0, law.friction * p >= 1)):
        raise finding.cannot_build(
            "design_singular",
            f"a profile cut for a friction of {law.friction:g} does not rise at its start: |friction| must stay "
            f"below {p if law.friction <= 0 else 1 / p:.3g} ('friction' of 'mechanism.profile', or of 'design')",
        )


def _shortfall(law: SlopeLaw, stroke: float, end: float, reached: float) -> Finding | None:
    """Return why the profile ends at x = `end` after `reached`, and not at `stroke` [m]; None if it does not."""
    if not fails(reached < stroke * (1 - TRAVEL_RTOL)):
        return None
    ends = f"the stroke ends at {mm(reached)} of {mm(stroke)}"
    if turns_vertical(law, end):
        return finding(
            "path_vertical",
            f"cut for a friction of {law.friction:g} the path turns vertical at x = {mm(law.vertical_at)}: {ends}; "
            "use less friction or a larger force constant ('friction' and 'force_constant' of 'mechanism.profile', or "
            "of 'design')",
        )
    if reached <= 0:
        helped = law.slope_factor < 1
        cut_for = "that lets the weights help" if helped else f"cut for a friction of {law.friction:g}"
        less = "lighter parts ('mechanism.masses')" if helped else "less friction ('friction' of 'mechanism.profile')"
        raise finding.cannot_build(
            "design_singular",
            f"a profile {cut_for} self-locks: the slider cannot rise anywhere as the rollers move out; use {less} "
            "or a smaller force constant ('force_constant' of 'mechanism.profile')",
        )
    return finding(
        "brace_too_short",
        f"the brace of {mm(law.brace_length)} turns horizontal too early: {ends}; use a longer brace "
        "('mechanism.brace_length') or a smaller force constant ('force_constant' of 'mechanism.profile', or of "
        "'design')",
    )


def turns_vertical(law: SlopeLaw, end: float) -> bool:
    """Return whether a path that ends at an x [m] does so because it turns vertical there."""
    return law.vertical_at < law.brace_length and end >= law.vertical_at * (1 - TRAVEL_RTOL)


@remember_plain(CAMS_KEPT)
def cut_profile(path: RollerPath, roller_radius: float, end: float) -> CamProfile:
    """Return the flank for a roller along a path up to x = `end` [m].

    Raises CannotBuild if nothing of it is left, or a part that the roller needs is missing beyond the start.
    """
    try:
        profile = cut_cam(path, roller_radius, end)
        _check_bend(profile)
        return profile
    except WholeCamUndercut:
        smallest = float(path.law.curvature_radius(path.law.rest_half_width))
        raise finding.cannot_build(
            "undercut_total",
            f"nothing of the flank remains: the {mm(roller_radius)} roller is larger than the path's radius of "
            f"curvature ({mm(smallest)} at the start), and it would pivot on the cam's corner over the whole stroke; "
            "use a smaller roller ('mechanism.roller_radius'), a larger force constant or a longer stroke "
            "('force_constant' and 'stroke' of 'mechanism.profile')",
        ) from None


def _check_bend(profile: CamProfile) -> None:
    """Raise where a path for hanging weights, which may be bent most behind its start, is bent too tightly there."""
    law = profile.path.law
    if isinstance(law, CurveSlopeLaw):
        check_bends(law, profile)
        return
    if not fails(law.slope_factor < 1.0):
        return
    place, radius = law.tightest(profile.end, profile.start)
    if radius < profile.roller_radius and place > profile.start:
        raise finding.cannot_build(
            "undercut_total",
            f"the path that lets the weights help has a radius of curvature of {mm(radius)} at x = {mm(place)}, "
            f"less than the roller's {mm(profile.roller_radius)}; use a smaller roller ('mechanism.roller_radius') "
            "or leave the weight uncompensated ('design.gravity')",
        )


def _make_track(profile: CamProfile, mechanism: Mechanism) -> Track:
    try:
        offset = np.maximum(mechanism.profile.offset, 0.0)
        return track_of(profile, mechanism.roller_radius, mechanism.brace_length, offset)
    except NoTrack as problem:
        brace = mechanism.brace_length
        if problem.reason == "brace":
            raise finding.cannot_build(
                "brace_too_short",
                f"the braces ({mm(brace)}) do not reach from the axis to the rollers, which start at "
                f"{mm(problem.start)} from it on this cam; use a brace longer than {mm(problem.start)} "
                "('mechanism.brace_length')",
            ) from None
        if problem.reason == "crossed":
            raise finding.cannot_build(
                "flanks_collide",
                f"on this cam the right roller would start at x = {mm(problem.start)}, across the axis; use a cam with "
                "a larger rest half width ('mechanism.profile.rest_half_width'), or rollers nearer to those it is cut "
                "for ('mechanism.roller_radius')",
            ) from None
        raise finding.cannot_build(
            "dead_point",
            f"with a brace of {mm(brace)} the slider does not rise above its start while the rollers move out on "
            "this cam; use a longer brace ('mechanism.brace_length'), or a cam cut for this one "
            "('mechanism.profile.brace_length')",
        ) from None


def cam_start_height(profile: CamProfile) -> float:
    """Return the height of the flank's first point, before trimming, above the path's start [m]."""
    return profile.flank(profile.path.law.rest_half_width)[1]


def rollers_overlap(gap: float, place: str = "at the start") -> Finding:
    """Return what to say about rollers that overlap, `gap` [m] being negative."""
    return finding(
        "rollers_collide",
        f"the rollers overlap by {mm(-gap)} {place}; use smaller rollers ('mechanism.roller_radius') or a longer "
        "spring rest length ('mechanism.rest_half_width', of a cam that is cut 'mechanism.profile.rest_half_width')",
    )


def flanks_cross(x: float) -> Finding:
    """Return what to say about a flank whose contact is across the axis, at `x` [m]."""
    return finding(
        "flanks_collide",
        f"the flanks cross the axis (x = {mm(x)}): no plate is left between them; use a smaller roller "
        "('mechanism.roller_radius') or springs with a longer rest length ('mechanism.rest_half_width')",
    )


def flanks_crossing(profile: CamProfile, offset: float = 0.0) -> Finding | None:
    """Return what to say where flanks with so much material left on them [m] meet: no plate is between them."""
    x = profile.offset_points(profile.start, offset - profile.roller_radius)[0]
    return flanks_cross(x) if fails(x <= 0) else None


def check_first_pose(assembly: Assembly) -> None:
    """Raise if flanks or rollers are in each other's way where the slider is lowest.

    The rollers of a symmetric mechanism move apart as the slider rises: what has room at the start has it later.

    Raises CannotBuild the finding says what is in the way.
    """
    track, mechanism = assembly.track, assembly.spec.mechanism
    if crossing := flanks_crossing(track.profile, np.maximum(mechanism.profile.offset, 0.0)):
        raise CannotBuild(crossing)
    gap = 2.0 * (track.first_x - mechanism.roller_radius)
    if fails(gap < -1e-12 * mechanism.brace_length):
        raise CannotBuild(rollers_overlap(gap))


def count_before_overlap(
    travel: FloatArray, slider: FloatArray, x: tuple[FloatArray, FloatArray], mechanism: Mechanism
) -> tuple[int, Finding | None]:
    """Return the number of points before the rollers overlap, and what to say if they do.

    At travels and slider positions, (n,), with both rollers' axes outwards at x [m]. Raises CannotBuild if they overlap
    at the first point.
    """
    brace = mechanism.brace_length
    right, left = (slider - np.sqrt((brace - across) * (brace + across)) for across in x)
    gap = np.hypot(x[0] + x[1], right - left) - 2.0 * mechanism.roller_radius
    overlap = np.flatnonzero(gap < -1e-12 * brace)
    if not overlap.size:
        return len(travel), None
    first = int(overlap[0])
    if first < 2:
        raise CannotBuild(rollers_overlap(float(gap[first])))
    return first, rollers_overlap(float(gap.min()), f"from {mm(float(travel[first]))} of travel on")


def check_springs(elongation: FloatArray, held: FloatArray, rest_half_width: float) -> None:
    """Raise CannotBuild if nothing holds the rollers on the cam anywhere: springs are slack, and no contact presses.

    From elongations of the springs [m] and contact forces [N], (n,); springs are at rest at a half width [m].
    """
    if elongation.max() < 0 and not (held > 0).any():
        short = mm(-float(elongation.max()))
        raise finding.cannot_build(
            "spring_slack",
            f"the springs are slack over the whole travel, by at least {short}: nothing holds the rollers on the "
            f"cam; use shorter springs ('mechanism.rest_half_width', here {mm(rest_half_width)})",
        )
