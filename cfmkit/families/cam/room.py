"""The box that a cam mechanism stays in: plate with tab, rollers, and the slider's pin on its way up."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.base import Room
from cfmkit.families.cam.outline import plate_contours
from cfmkit.families.cam.picture_parts import pose, roller_path

if TYPE_CHECKING:
    from cfmkit.results import Result

PLATE = 0.008
"""Thickness of the plate where no `contact.width` says it [m]: that of the contact's example."""

LAYERS = 5
"""Plate, a brace on both sides of it, springs outside of the braces: each is taken to be as thick as the plate."""


def room(result: Result) -> Room | None:
    """Return the box of a solved mechanism over its travel; None of a motion in time, or of a cam as built."""
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
    told = f"depth: {LAYERS} layers (springs, braces, plate) of {1e3 * thick:.4g} mm"
    return Room(2.0 * half, high - low, LAYERS * thick, told)
