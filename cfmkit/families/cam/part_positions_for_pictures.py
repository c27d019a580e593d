"""Where the parts of a cam mechanism are, as its pictures need it; lengths in metres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.curves import Curve
from cfmkit.export.contours import polygons
from cfmkit.families.cam.outline import plate_contours
from cfmkit.families.cam.statics import forces
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.solution import Solution

Point = tuple[float, float]

SLENDER = 0.2
"""A picture of the mechanism is at least this fraction of its height wide to each side: words need room."""


@dataclass(frozen=True)
class PartsPose:
    """Positions of the parts, of two equal ones the right one, each (x, y) [m]."""

    # roller, slider, contact: axis of the roller, pin of the slider, point where the roller touches the cam
    roller: Point
    slider: Point
    contact: Point
    on_corner: bool  # whether the roller pivots on the cam's corner

    def mirrored(self) -> PartsPose:
        """Return the positions of the left parts."""
        (x, y), (a, b) = self.roller, self.contact
        return PartsPose((-x, y), self.slider, (-a, b), self.on_corner)


def pose(solution: Solution, index: int) -> PartsPose:
    """Return the positions of the parts at one point of the solution."""
    states, assembly = solution.states, solution.assembly
    x, y = float(states.x[index]), float(states.y[index])
    length = assembly.track.brace_length
    slider = (0.0, y + float(np.sqrt((length - x) * (length + x))))
    return PartsPose((x, y), slider, _contact(solution, index), bool(states.on_corner[index]))


def _contact(solution: Solution, index: int) -> Point:
    states, profile = solution.states, solution.assembly.track.profile
    center = np.array([states.x[index], states.y[index]])
    if states.on_corner[index] and profile.corner:
        toward = center - np.array(profile.corner.point)
        normal = toward / np.hypot(*toward)
    else:
        normal = np.array(profile.normal(float(states.parameter[index])))
    x, y = center - solution.assembly.spec.mechanism.roller_radius * normal
    return float(x), float(y)


def surface(solution: Solution, points: int = 400) -> FloatArray:
    """Return the right flank as the roller finds it, material left on it included, (n, 2) [m]."""
    profile = solution.assembly.track.profile  # with material missing: the flank cut for a larger roller
    offset = max(solution.assembly.spec.mechanism.profile.offset, 0.0) - profile.roller_radius
    share = np.linspace(0.0, 1.0, points)
    u = profile.start + (profile.end - profile.start) * share**2
    return np.column_stack(profile.shifted(u, offset))


def roller_path(solution: Solution) -> FloatArray:
    """Return the positions of the right roller's axis over the solution, (n, 2) [m]."""
    return np.column_stack([solution.states.x, solution.states.y])


@dataclass(frozen=True)
class Scene:
    """Shapes that stay the same at every position, in metres: outlines of the plate, right flank and path, limits."""

    plate: list[FloatArray]
    flank: FloatArray
    path: FloatArray
    box: tuple[float, float, float, float]


def scene(solution: Solution) -> Scene:
    """Return the parts that do not move, and what the mechanism sweeps over the whole solution."""
    assembly = solution.assembly
    profile = assembly.track.profile
    plate = polygons(plate_contours((profile, profile), assembly.spec.mechanism.plate), "cut")
    path, radius = roller_path(solution), assembly.spec.mechanism.roller_radius
    outline = np.concatenate(plate)
    across = max(float(path[:, 0].max()) + radius, float(outline[:, 0].max()))
    bottom = min(float(path[:, 1].min()) - radius, float(outline[:, 1].min()))
    top = max(pose(solution, -1).slider[1], float(outline[:, 1].max()))
    height = top - bottom
    half = max(1.06 * across, SLENDER * height)
    box = (-half, bottom - 0.03 * height, half, top + 0.14 * height)
    return Scene(plate, surface(solution), path, box)


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


def moment(solution: Solution, index: int) -> str:
    """Return travel and force at one point in words, on two lines."""
    travel = format_short(float(solution.travel[index] + solution.origin), "length", 3)
    up, down = (float(state.slider[index]) for state in (solution.up, solution.down))
    if not np.isfinite(up + down):
        return f"{travel}\nno finite force"
    up_text, down_text = (format_short(value, "force", 3) for value in (up, down))
    return f"{travel}\n{up_text}" if up_text == down_text else f"{travel}\n{up_text} up, {down_text} down"


def spring_count(solution: Solution) -> int:
    """Return the number of springs in parallel."""
    springs = solution.assembly.spec.mechanism.springs
    return len(springs.each) if isinstance(springs.each, tuple) else springs.count or 1
