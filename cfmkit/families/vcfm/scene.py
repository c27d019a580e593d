"""Where everything is when the shuttle has travelled so far: outlines in metres, for pictures.

The shuttle moves down along x = 0; the leaves go from it to the walls at both sides, the spring stands below it on
a base that the preload pushes up. The as-made apex of the lowest leaves is the origin.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.vcfm.parts import RIM
from cfmkit.families.vcfm.shapes import bent_leaf, centre_line, u_chain

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.vcfm.model import Solution
    from cfmkit.families.vcfm.spec import Bistable

MIRROR = np.array([-1.0, 1.0])


@dataclass
class Scene:
    """Outlines of rigid parts, snap-through leaves and spring, (n, 2) each [m]; forces act at two points."""

    rigid: list[FloatArray] = field(default_factory=list)
    leaves: list[FloatArray] = field(default_factory=list)
    spring: list[FloatArray] = field(default_factory=list)
    top: tuple[float, float] = (0.0, 0.0)
    base: tuple[float, float] = (0.0, 0.0)

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Left, bottom, right and top of everything [m]."""
        points = np.concatenate([*self.rigid, *self.leaves, *self.spring])
        (left, bottom), (right, top) = points.min(axis=0), points.max(axis=0)
        return float(left), float(bottom), float(right), float(top)


def rectangle(left: float, bottom: float, right: float, top: float) -> FloatArray:
    """Return the corners of a rectangle, counter-clockwise."""
    return np.array([[left, bottom], [right, bottom], [right, top], [left, top]])


def normals(line: FloatArray) -> FloatArray:
    """Return the unit normals along a line, to its left."""
    along = np.gradient(line, axis=0)
    along /= np.hypot(*along.T)[:, None]
    return np.column_stack([-along[:, 1], along[:, 0]])


def band(line: FloatArray, thickness: Any) -> FloatArray:
    """Return the outline of a leaf of this thickness [m], a number or one for each point, around its centre line."""
    half = 0.5 * np.broadcast_to(np.asarray(thickness, dtype=float), len(line))[:, None] * normals(line)
    return np.concatenate([line + half, (line - half)[::-1]])


def leaf_thickness(about: Bistable, count: int) -> FloatArray:
    """Return the thickness of a snap-through leaf at `count` even places of its length [m]."""
    stations, heights = about.profile
    share = np.linspace(0.0, 1.0, count)
    middle = (share > stations[1]) & (share < stations[-2])
    return np.where(middle, max(heights), min(heights))


def scene(solution: Solution, travel: float, preload: float) -> Scene:
    """Return everything at a travel of the shuttle and a preload [m]."""
    found, frame = Scene(), solution.spec.mechanism.frame
    about, strip = solution.spec.mechanism.bistable, solution.parts.strip
    levels = -(-about.half_beams // 2)
    half, reach, rise = 0.5 * frame.shuttle_width, float(strip.reach), float(strip.rise)
    line = centre_line(solution.parts.leaf, travel)[::-1] * MIRROR + np.array([half + reach, -rise])
    thickness = leaf_thickness(about, len(line))
    for level in range(levels):
        up = np.array([0.0, level * frame.spacing])
        one = band(line + up, thickness)
        found.leaves.append(one)
        if 2 * level + 2 <= about.half_beams:
            found.leaves.append(one * MIRROR)
    low, high = -rise - frame.block, (levels - 1) * frame.spacing - rise + frame.block
    for side in (1.0, -1.0):
        ends = sorted((side * (half + reach), side * (half + reach + frame.block)))
        found.rigid.append(rectangle(ends[0], low, ends[1], high))
    bottom, top = -frame.clearance - travel, (levels - 1) * frame.spacing + frame.clearance - travel
    found.rigid.append(rectangle(-half, bottom, half, top))
    found.top = (0.0, top)
    _add_spring(found, solution, bottom, travel + preload)
    return found


def _add_spring(found: Scene, solution: Solution, top: float, compression: float) -> None:
    """Add the spring below the shuttle's lower end."""
    about, frame = solution.spec.mechanism.positive, solution.spec.mechanism.frame
    half, rim = 0.5 * frame.block, RIM * about.thickness
    if about.structure == "straight":
        _add_straight(found, solution, top, compression)
        return
    if about.structure == "u-shape":
        chain = u_chain(solution.parts.spring.strip, float(about.radius or 0.0), compression)
        lines, corners, height = [chain], [], float(chain[-1, 1])
    else:
        lower = bent_leaf(solution.parts.spring.strip, 0.5 * compression, free=True)
        height = 2.0 * float(lower[-1, 1]) + frame.corner
        lines = [lower, lower * np.array([1.0, -1.0]) + np.array([0.0, height])]
        x, y = lower[-1]
        corners = [rectangle(x, y - rim, x + frame.block, y + frame.corner + rim)]
    shift = np.array([half, top - frame.block - height])
    sides = (1.0,) if about.loaded == "half" else (1.0, -1.0)
    for side in sides:
        mirror = np.array([side, 1.0])
        found.spring += [band(line + shift, about.thickness) * mirror for line in lines]
        found.rigid += [(corner + shift) * mirror for corner in corners]
    found.rigid.append(rectangle(-half, top - frame.block - rim, half, top))
    base = top - frame.block - height
    found.rigid.append(rectangle(-half, base - frame.block, half, base + rim))
    found.base = (0.0, base - frame.block)


def _add_straight(found: Scene, solution: Solution, top: float, compression: float) -> None:
    """Add a straight beam clamped at both ends, with the shuttle on its middle."""
    about, frame = solution.spec.mechanism.positive, solution.spec.mechanism.frame
    half, length = 0.5 * frame.block, about.length
    line = bent_leaf(solution.parts.spring.strip, -compression)
    middle = top - half
    for side in (1.0, -1.0):
        mirror = np.array([side, 1.0])
        found.spring.append(band(line + np.array([half, middle]), about.thickness) * mirror)
        end = middle + compression
        ends = sorted((side * (half + length), side * (half + length + frame.block)))
        found.rigid.append(rectangle(ends[0], end - half, ends[1], end + half))
    found.rigid.append(rectangle(-half, middle - half, half, top))
    found.base = (half + length + half, middle + compression - half)
