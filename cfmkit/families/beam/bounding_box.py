"""The box that a mechanism of beams stays in: the part as it is cut, and its beams and pads as they move."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.base import Room
from cfmkit.families.beam.network_from_spec import mirror_axis, thickest
from cfmkit.families.beam.outline import drawing, regions
from cfmkit.families.beam.strips_and_gaps import mirrored

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.beam.solution import Solution
    from cfmkit.results import Result

POSES = 13
"""Poses that are looked at: between two of them, a twelfth of the travel apart, beams bulge by next to nothing."""

COARSE = 5e-5
"""Tolerance of the outline: a box is wanted to a tenth of a millimetre [m]."""


def room(result: Result) -> Room | None:
    """Return the box of a solved mechanism, along and across its drive; equal legs stand side by side in the depth."""
    if result.state is None or hasattr(result.state, "fine"):  # nothing was solved, or the part as a solid
        return None
    solution: Solution = result.state
    mechanism = solution.spec.mechanism
    angle = solution.assembly.direction if solution.motion_dimension == "length" else 0.5 * np.pi
    axes = np.array([[np.sin(angle), -np.cos(angle)], [np.cos(angle), np.sin(angle)]])
    contours = [contour for contour in drawing(solution.spec, COARSE).contours if contour.layer == "cut"]
    boxes = np.array([contour.extents for contour in contours])
    points = [boxes[:, [0, 1]], boxes[:, [0, 3]], boxes[:, [2, 1]], boxes[:, [2, 3]], *_moved_pads(solution)]
    spread = np.concatenate(points) @ axes.T
    bent = np.concatenate(_bent(solution)) @ axes.T
    half = 0.5 * thickest(mechanism.thickness)
    low = np.minimum(spread.min(axis=0), bent.min(axis=0) - half)
    high = np.maximum(spread.max(axis=0), bent.max(axis=0) + half)
    across, along = (high - low).tolist()
    legs = mechanism.copies.legs if mechanism.copies else 1
    corner = np.minimum(np.concatenate(points).min(axis=0), np.concatenate(_bent(solution)).min(axis=0) - half)
    sideways = bool(abs(np.cos(angle)) > abs(np.sin(angle)))
    return Room(
        across, along, legs * mechanism.width, legs, corner=(float(corner[0]), float(corner[1])), sideways=sideways
    )


def _bent(solution: Solution) -> list[FloatArray]:
    """Return centre lines of all beams at places of the travel, those of a mirrored half included [m]."""
    chosen = np.unique(np.linspace(0, len(solution.keep) - 1, POSES).astype(int))
    names = solution.path.layout.network.beams
    lines = [solution.path.shape(name, int(solution.keep[pose])) for pose in chosen for name in names]
    axis = mirror_axis(solution.assembly)
    return lines if axis is None else [*lines, *(mirrored(line, *axis) for line in lines)]


def _moved_pads(solution: Solution) -> list[FloatArray]:
    """Return what moves as one piece with the drive, at the end of the travel [m]."""
    if solution.motion_dimension != "length":
        return []
    angle, travel = solution.assembly.direction, float(solution.motion[-1])
    way = travel * np.array([np.cos(angle), np.sin(angle)])
    driven = solution.assembly.driven
    return [shape + way for place in regions(solution.spec, COARSE) if place.node == driven for shape in place.shapes]
