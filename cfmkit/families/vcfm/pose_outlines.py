"""Where everything is when the shuttle has travelled so far: outlines in metres, for pictures.

The shuttle moves down along x = 0; the leaves go from it to the walls at both sides, the spring stands below it on
a base that the preload pushes up. The as-made apex of the lowest leaves is the origin.

The deformed centre lines of the leaves follow from the closed forms. There a leaf goes from the wall at (0, 0) to the
shuttle at (X, h - d); its ends keep their direction.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.vcfm.leaf_laws_from_spec import leaf_spring
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import RIM

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.vcfm.leaves.kinds import LeafLaw
    from cfmkit.families.vcfm.solution import Solution


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


def leaf_thickness(law: LeafLaw, count: int) -> FloatArray:
    """Return the thickness of a snap-through leaf at `count` even places of its length, at a step the smaller [m]."""
    place, (shares, heights) = np.linspace(0.0, 1.0, count), np.array(law.profile)
    return np.asarray(np.minimum(np.interp(place, shares, heights), np.interp(-place, -shares[::-1], heights[::-1])))


def scene(solution: Solution, travel: float, preload: float) -> Scene:
    """Return everything at a travel of the shuttle and a preload [m]."""
    found, frame = Scene(), solution.spec.mechanism.frame
    about, strip = solution.spec.mechanism.bistable, solution.parts.strip
    levels = -(-about.half_beams // 2)
    half, reach, rise = 0.5 * frame.shuttle_width, float(strip.reach), float(strip.rise)
    leaf = solution.parts.leaf
    line = leaf.bent_line(travel)[::-1] * MIRROR + np.array([half + reach, -rise])
    thickness = leaf_thickness(leaf, len(line))
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
    if solution.spec.mechanism.springs is not None:
        _add_coils(found, solution, top, compression)
        return
    about, frame = solution.spec.mechanism.flexures, solution.spec.mechanism.frame
    half, rim = 0.5 * frame.block, RIM * about.thickness
    lines, height = leaf_spring(about, solution.spec.mechanism.material).bent_lines(compression, frame.corner)
    if about.kind.stands_on_ends:
        _add_on_ends(found, solution, top, lines[0], height)
        return
    ends = [line[-1] for line in lines[:-1]]
    corners = [rectangle(x, y - rim, x + frame.block, y + frame.corner + rim) for x, y in ends]
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


WINDINGS = 8
"""Turns of a bought spring as they are drawn."""


def _add_coils(found: Scene, solution: Solution, bottom: float, deflection: float) -> None:
    """Add bought springs side by side: below the shuttle, or above it where they are pulled.

    Sizes that are not stated are such as fit the frame: only the deflection is to scale then.
    """
    springs, frame = solution.spec.mechanism.springs, solution.spec.mechanism.frame
    assert springs is not None
    hangs = springs.kind == "extension"
    across = springs.outer_diameter or 1.5 * frame.block
    farthest = max(push.preload for push in solution.pushes) + float(solution.first.travel[-1])
    length = (springs.free_length or max(2.0 * frame.corner, 1.5 * farthest)) + (deflection if hangs else -deflection)
    start = found.top[1] if hangs else bottom
    end = start + length if hangs else start - length
    wire = springs.wound.wire if springs.wound else 0.06 * across
    shown = min(springs.count, 4)
    pitch = 1.2 * across
    # an even number leaves the middle to the force
    middles = pitch * (np.arange(shown) - 0.5 * (shown - 1)) + (pitch if hangs and shown % 2 else 0.0)
    phase = np.linspace(0.0, 2.0 * np.pi * WINDINGS, 40 * WINDINGS + 1)
    heights = start + (end - start) * phase / phase[-1]
    for middle in middles:
        line = np.column_stack([middle + 0.5 * (across - wire) * np.sin(phase), heights])
        found.spring.append(band(line, wire))
    left, right = float(middles.min()) - 0.6 * across, float(middles.max()) + 0.6 * across
    away = frame.block if hangs else -frame.block
    found.rigid.append(rectangle(left, min(end, end + away), right, max(end, end + away)))
    if hangs:  # a beam on the shuttle that they pull on
        found.rigid.append(rectangle(min(left, 0.0), start - 0.5 * frame.block, right, start))
    found.base = (0.5 * (left + right), end + away)


def _add_on_ends(found: Scene, solution: Solution, top: float, line: FloatArray, compression: float) -> None:
    """Add a beam clamped at both ends, with the shuttle on its middle."""
    about, frame = solution.spec.mechanism.flexures, solution.spec.mechanism.frame
    half, length = 0.5 * frame.block, about.length
    middle = top - half
    for side in (1.0, -1.0):
        mirror = np.array([side, 1.0])
        found.spring.append(band(line + np.array([half, middle]), about.thickness) * mirror)
        end = middle + compression
        ends = sorted((side * (half + length), side * (half + length + frame.block)))
        found.rigid.append(rectangle(ends[0], end - half, ends[1], end + half))
    found.rigid.append(rectangle(-half, middle - half, half, top))
    found.base = (half + length + half, middle + compression - half)
