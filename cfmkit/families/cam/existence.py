"""Whether the parts can be where a model puts them.

Rollers must have room beside each other, each flank must stay on its own side of the axis, the cam
can push a roller but not pull it, and springs that hold the rollers must not go slack. A mechanism whose first pose
breaks one of these is not assembled; where a later pose does, what follows does not happen. Springs that are
slack at the start and tighten later can be built: the force is zero until they do (`spring_slack` warns of it).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.cam.findings import finding
from cfmkit.families.findings import mm
from cfmkit.families.refusals import CannotBuild

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.build import Assembly
    from cfmkit.families.cam.geometry.cut import CamProfile
    from cfmkit.families.cam.spec import Mechanism
    from cfmkit.results import Finding


def room_between(x: tuple[FloatArray, FloatArray], y: tuple[FloatArray, FloatArray], radii: float) -> FloatArray:
    """Return the gap between the right and the left roller, negative where they overlap [m].

    Parameters
    ----------
    x, y : pair of (n,) array
        Axis of the right roller, and of the left one as seen in a mirror [m].
    radii : float
        Sum of both radii [m].
    """
    return np.asarray(np.hypot(x[0] + x[1], y[0] - y[1]) - radii)


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
    """Return what to say where the flanks meet or cross, so that there is no plate between them.

    Parameters
    ----------
    profile : CamProfile
        The cam as cut.
    offset : float
        Material left on it beyond the profile [m].
    """
    x = float(profile.shifted(profile.start, offset - profile.roller_radius)[0])
    return None if x > 0 else flanks_cross(x)


def check_first_pose(assembly: Assembly) -> None:
    """Raise if flanks or rollers are in each other's way where the slider is lowest.

    The rollers of a symmetric mechanism move apart as the slider rises: what has room at the start has it later.

    Raises
    ------
    CannotBuild
        The finding says what is in the way.
    """
    track, mechanism = assembly.track, assembly.spec.mechanism
    if crossing := flanks_crossing(track.profile, max(mechanism.profile.offset, 0.0)):
        raise CannotBuild(crossing)
    x = float(track.states(np.array([track.start])).x[0])
    if (gap := 2.0 * (x - mechanism.roller_radius)) < -1e-12 * mechanism.brace_length:
        raise CannotBuild(rollers_overlap(gap))


def until_overlap(
    travel: FloatArray, slider: FloatArray, x: tuple[FloatArray, FloatArray], mechanism: Mechanism
) -> tuple[int, Finding | None]:
    """Return the number of points before the rollers overlap, and what to say if they do.

    Parameters
    ----------
    travel, slider : (n,) array
        Travel, and position of the slider [m].
    x : pair of (n,) array
        Axes of both rollers, outwards [m].
    mechanism : Mechanism
        Whose rollers and braces they are.

    Raises
    ------
    CannotBuild
        If they overlap at the first point.
    """
    brace = mechanism.brace_length
    right, left = (slider - np.sqrt((brace - across) * (brace + across)) for across in x)
    gap = room_between(x, (right, left), 2.0 * mechanism.roller_radius)
    overlap = np.flatnonzero(gap < -1e-12 * brace)
    if not overlap.size:
        return len(travel), None
    first = int(overlap[0])
    if first < 2:
        raise CannotBuild(rollers_overlap(float(gap[first])))
    return first, rollers_overlap(float(gap.min()), f"from {mm(float(travel[first]))} of travel on")


def check_springs(elongation: FloatArray, held: FloatArray, rest_half_width: float) -> None:
    """Raise if nothing holds the rollers on the cam anywhere: springs that are slack over the whole travel.

    Parameters
    ----------
    elongation, held : (n,) array
        Of the springs [m], and the contact force [N].
    rest_half_width : float
        Half width at which the springs are at rest [m].

    Raises
    ------
    CannotBuild
        If no contact is pressed and no spring is stretched.
    """
    if elongation.max() < 0 and not (held > 0).any():
        short = mm(-float(elongation.max()))
        raise CannotBuild(
            finding(
                "spring_slack",
                f"the springs are slack over the whole travel, by at least {short}: nothing holds the rollers on the "
                f"cam; use shorter springs ('mechanism.rest_half_width', here {mm(rest_half_width)})",
            )
        )
