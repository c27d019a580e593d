"""The box that a cam mechanism stays in: plate with tab, rollers, springs, and the slider's pin on its way up."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.base import Room
from cfmkit.families.cam.outline import plate_contours
from cfmkit.families.cam.part_positions_for_pictures import pose, roller_path
from cfmkit.stock.springs.made_to_measure import extension_spring

if TYPE_CHECKING:
    from cfmkit.families.cam.springs_spec import Springs
    from cfmkit.results import Result

PLATE = 0.008
"""Thickness of the plate where no `contact.width` says it [m]: that of the contact's example."""


def room(result: Result) -> Room | None:
    """Return the box of a solved mechanism over its travel; None of a motion in time, or of a cam as built.

    In the depth there are the plate, a brace on both sides of it, and outside of these the springs.
    """
    solution = result.state
    if not hasattr(solution, "states"):
        return None
    mechanism, profile = result.spec.at("mechanism"), solution.assembly.track.profile
    plate = np.array([contour.extents for contour in plate_contours((profile, profile), mechanism.plate)])
    path, radius = roller_path(solution), mechanism.roller_radius
    half = max(float(path[:, 0].max()) + radius, float(plate[:, 2].max()))
    low = min(float(path[:, 1].min()) - radius, float(plate[:, 1].min()))
    pins = [pose(solution, index).slider[1] + radius for index in (0, -1)]
    high = max(*pins, float(path[:, 1].max()) + radius, float(plate[:, 3].max()))
    thick = PLATE if mechanism.contact is None else mechanism.contact.width
    depth = depth_of(thick, mechanism.springs, float(solution.elongation.max()), mechanism.rest_half_width)
    reported = f"depth: plate {1e3 * thick:.4g} mm, braces {1e3 * min(thick, BRACE):.4g} mm each, " + (
        f"springs {mechanism.springs.name or 'as wound'}" if mechanism.springs.wound else "springs wound of steel wire"
    )
    if depth is None:
        reported = "no steel spring fits between the rollers"
    # plate, two rollers, two braces, slider
    return Room(2.0 * half, high - low, depth, 6 + count_of(mechanism.springs), reported, (-half, low))


BRACE = 0.010
"""Thickness of a brace where the plate is thicker [m]: it is pulled along, the plate is pressed on its edge."""


def depth_of(thick: float, springs: Springs, stretch: float, half_width: float) -> float | None:
    """Return the depth with springs of a known wire, else wound of steel wire [m]; None if no such spring fits.

    Parameters
    ----------
    thick : float
        Of the plate, and of each brace up to `BRACE` [m].
    springs : Springs
        How many of what stiffness: half of them on either side, above each other.
    stretch, half_width : float
        Their largest elongation, and half their length at rest [m].
    """
    count = count_of(springs)
    if springs.wound is not None:
        outer = springs.wound.coil + springs.wound.wire
    else:
        coil = extension_spring(springs.total / count, stretch, 2.0 * half_width)
        if coil is None:
            return None
        outer = coil.outer_diameter
    return thick + 2.0 * min(thick, BRACE) + min(count, 2) * outer


def count_of(springs: Springs) -> int:
    """Return how many springs there are."""
    return len(springs.each) if isinstance(springs.each, tuple) else springs.count or 1
