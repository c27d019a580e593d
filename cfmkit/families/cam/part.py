"""Geometry of a cam mechanism over its motion: bodies at every position, for exports; shapes for its figures [m]."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.curves import Curve
from cfmkit.export.contours import polygons
from cfmkit.export.posed_part import PosedBody, PosedPart, box, rectangle
from cfmkit.families.cam.hardware import cut_plate, hardware
from cfmkit.families.cam.part_sizes_and_clearances import (
    BRACE_WIDTH,
    PLATE_THICKNESS,
    depth_of,
    wire_and_coil,
)
from cfmkit.families.cam.statics import forces
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.solution import Solution
    from cfmkit.results import Result

Point = tuple[float, float]

MIN_ASPECT_RATIO = 0.2
"""A picture of the mechanism is at least this fraction of its height wide to each side: words need room."""


def part_over_motion(result: Result) -> PosedPart | None:
    """Return a solved mechanism over its travel; None of a motion in time, or of a cam as built.

    In the depth there are the plate, on both sides of it a brace and half of the slider, and outside of these the
    springs, which stand above each other.
    """
    solution = result.state
    if not hasattr(solution, "states"):
        return None
    mechanism = result.spec.get_value("mechanism")
    springs, thick = mechanism.springs, PLATE_THICKNESS if mechanism.contact is None else mechanism.contact.width
    wire = wire_and_coil(springs, float(solution.elongation.max()), mechanism.rest_half_width)
    joining = hardware(solution)
    if wire is None:
        depth, reported = None, "no steel spring fits between the rollers"
    else:
        half = 0.5 * (depth_of(thick, sum(wire), springs.number) + joining.slider_excess)
        depth = half + max(half, 0.5 * thick + joining.screw_head_height)
        wound = f"springs {springs.name or 'as wound'}" if springs.wound else "springs wound of steel wire"
        reported = f"depth: plate {1e3 * thick:.4g} mm, braces {1e3 * min(thick, BRACE_WIDTH):.4g} mm each, {wound}"
    return PosedPart(
        (*bodies(solution), *joining.bodies),
        depth=depth,
        pieces=9 + springs.number,  # plate, two rollers, four braces, two halves of the slider
        assumed=reported,
        rubbing=joining.rubbing,
        faults=joining.faults,
    )


def bodies(solution: Solution) -> tuple[PosedBody, ...]:
    """Return the boxes of the plate and its holes, the rollers, and the slider's pin as large, at every point."""
    radius = solution.mechanism.roller_radius
    plate = [PosedBody.polygon("plate", "held", rectangle(*contour.extents)) for contour in cut_plate(solution)]
    right = PosedBody.line("roller", "contact", solution.roller_path[:, None], radius)
    return (*plate, right, right.mirror(), PosedBody.line("slider", "driven", solution.pin_path[:, None], radius))


# --- for pictures -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class PartsPose:
    """Positions of the parts, of two equal ones the right one, each (x, y) [m]."""

    # roller, slider, contact: axis of the roller, pin of the slider, point where the roller touches the cam
    roller: Point
    slider: Point
    contact: Point
    on_corner: bool  # whether the roller pivots on the cam's corner

    def mirror(self) -> PartsPose:
        """Return the positions of the left parts."""
        (x, y), (a, b) = self.roller, self.contact
        return PartsPose((-x, y), self.slider, (-a, b), self.on_corner)


def pose(solution: Solution, index: int) -> PartsPose:
    """Return the positions of the parts at one point of the solution."""
    (x, y), (_, pin) = (path[index].tolist() for path in (solution.roller_path, solution.pin_path))
    return PartsPose((x, y), (0.0, pin), _contact_point(solution, index), bool(solution.states.on_corner[index]))


def _contact_point(solution: Solution, index: int) -> Point:
    states, profile = solution.states, solution.assembly.track.profile
    center = np.array([states.x[index], states.y[index]])
    if states.on_corner[index] and profile.corner:
        toward = center - np.array(profile.corner.point)
        normal = toward / np.hypot(*toward)
    else:
        normal = np.array(profile.normal(float(states.parameter[index])))
    x, y = center - solution.mechanism.roller_radius * normal
    return float(x), float(y)


def surface(solution: Solution) -> FloatArray:
    """Return the right flank as the roller finds it, material left on it included, (n, 2) [m]."""
    profile = solution.assembly.track.profile  # with material missing: the flank cut for a larger roller
    offset = max(solution.mechanism.profile.offset, 0.0) - profile.roller_radius
    share = np.linspace(0.0, 1.0, 400)
    u = profile.start + (profile.end - profile.start) * share**2
    return np.column_stack(profile.offset_points(u, offset))


@dataclass(frozen=True)
class Scene:
    """Shapes that stay the same at every position, in metres: outlines of the plate, right flank and path, limits."""

    plate: list[FloatArray]
    flank: FloatArray
    path: FloatArray
    box: tuple[float, float, float, float]


def scene(solution: Solution) -> Scene:
    """Return what is the same at every position [m]: plate, right flank, right roller's path, view of all motion."""
    (_, bottom), (across, top) = box(bodies(solution)).tolist()
    height = top - bottom
    half = max(1.06 * across, MIN_ASPECT_RATIO * height)
    view = (-half, bottom - 0.03 * height, half, top + 0.14 * height)
    return Scene(polygons(cut_plate(solution)), surface(solution), solution.roller_path, view)


def swallowtail(solution: Solution, points: int = 200) -> FloatArray:
    """Return the part of the shifted path that undercut removes, from the path's start to the corner, (n, 2) [m]."""
    profile = solution.assembly.track.profile
    u = np.linspace(profile.path.law.rest_half_width, profile.start, points)
    return np.column_stack(profile.flank(u))


def pivoting(solution: Solution) -> tuple[Point, Point]:
    """Return where the roller's axis is when it starts on the corner and when it leaves it [m]."""
    track = solution.assembly.track
    ends = track.states(np.array([track.start, track.corner_end]))
    return (float(ends.x[0]), float(ends.y[0])), (float(ends.x[1]), float(ends.y[1]))


def start_curve(solution: Solution, travel: float, points: int = 400) -> Curve:
    """Return the loop over the first part of the travel [m] only, on a grid of its own."""
    assembly = solution.assembly
    grid = np.linspace(0.0, min(travel, float(solution.travel[-1])), points)
    states = assembly.track.states(assembly.track.start + grid)
    friction = assembly.spec.mechanism.rolling_friction
    up, down = (forces(states, assembly.loads, sign * friction, sign).slider for sign in (1.0, -1.0))
    motion = np.concatenate([grid, grid[::-1]]) + solution.origin
    branch = np.repeat(["load", "unload"], points)
    return Curve(motion, np.concatenate([up, down[::-1]]), branch, np.ones(2 * points, dtype=bool))


def describe_position(solution: Solution, index: int) -> str:
    """Return travel and force at one point in words, on two lines."""
    travel = format_short(float(solution.travel[index] + solution.origin), "length", 3)
    up, down = (float(state.slider[index]) for state in (solution.up, solution.down))
    if not np.isfinite(up + down):
        return f"{travel}\nno finite force"
    up_text, down_text = (format_short(value, "force", 3) for value in (up, down))
    return f"{travel}\n{up_text}" if up_text == down_text else f"{travel}\n{up_text} up, {down_text} down"
