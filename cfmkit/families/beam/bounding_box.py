"""The box that a mechanism of beams stays in: the part as it is cut, and its beams and pads as they move."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.base import Room
from cfmkit.families.beam.model import analyze
from cfmkit.families.beam.network_from_spec import mirror_axis, thickest_of
from cfmkit.families.beam.outline import drawing, regions
from cfmkit.families.beam.strips_and_gaps import mirrored
from cfmkit.families.run_control import Run

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.beam.solution import Solution
    from cfmkit.results import Result

POSES = 13
"""Poses that are looked at: between two of them, a twelfth of the travel apart, beams bulge by next to nothing."""

COARSE = 5e-5
"""Tolerance of the outline: a box is wanted to a tenth of a millimetre [m]."""


def room(result: Result) -> Room | None:
    """Return the box of a solved mechanism, along and across its drive; equal legs stand side by side in the depth.

    A part that was solved as a solid moves as its beams do, to a fraction of a thickness.
    """
    if hasattr(result.state, "fine"):
        given: Any = result.spec
        result = analyze(given.replace({"analysis.fidelity": "reissner", "requirements": ()}), Run())
    if result.state is None:
        return None
    solution: Solution = result.state
    mechanism = solution.spec.mechanism
    angle = solution.assembly.direction if solution.motion_dimension == "length" else 0.5 * np.pi
    axes = np.array([[np.sin(angle), -np.cos(angle)], [np.cos(angle), np.sin(angle)]])
    drawn = drawing(solution.spec, COARSE, check=False)
    boxes = np.array([contour.extents for contour in drawn.contours if contour.layer == "cut"])
    corners = [boxes[:, [0, 1]], boxes[:, [0, 3]], boxes[:, [2, 1]], boxes[:, [2, 3]]]
    inside = [(points, 0.0) for points in (*corners, *_moved_pads(solution))] + _bent(solution)
    low, high = _box(inside, axes)
    across, along = (high - low).tolist()
    legs = mechanism.copies.legs if mechanism.copies else 1
    deepest = max([drawn.sheet.thickness or 0.0, *(one.thickness for one in drawn.sheet.regions)])
    corner, far = _box(inside, np.eye(2))
    width, height = (far - corner).tolist()
    sideways = bool(abs(np.cos(angle)) > abs(np.sin(angle)))
    place = float(corner[0]), float(corner[1])
    return Room(across, along, legs * deepest, legs, corner=place, sideways=sideways, drawn=(width, height))


def _box(inside: list[tuple[FloatArray, float]], axes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the smallest and the largest place along two axes (2, 2) of points, with what is around each [m]."""
    points = np.concatenate([points for points, _ in inside]) @ axes.T
    around = np.concatenate([np.full((len(points), 1), half) for points, half in inside])
    return (points - around).min(axis=0), (points + around).max(axis=0)


def _bent(solution: Solution) -> list[tuple[FloatArray, float]]:
    """Return centre lines (n, 2) of all beams at places of the travel, mirrored ones too, each with what is beside it.

    That is half its largest thickness; all in m.
    """
    chosen = np.unique(np.linspace(0, len(solution.keep) - 1, POSES).astype(int))
    halves = {name: 0.5 * thickest_of(beam.section) for name, beam in solution.path.network.beams.items()}
    poses = [int(solution.keep[one]) for one in chosen]
    lines = [(solution.path.shape(name, pose), half) for pose in poses for name, half in halves.items()]
    axis = mirror_axis(solution.assembly)
    return lines if axis is None else [*lines, *((mirrored(line, *axis), half) for line, half in lines)]


def _moved_pads(solution: Solution) -> list[FloatArray]:
    """Return what moves as one piece with the drive, at the end of the travel [m]."""
    if solution.motion_dimension != "length":
        return []
    angle, travel = solution.assembly.direction, float(solution.motion[-1])
    way = travel * np.array([np.cos(angle), np.sin(angle)])
    driven = solution.assembly.driven
    return [shape + way for place in regions(solution.spec, COARSE) if place.node == driven for shape in place.shapes]
