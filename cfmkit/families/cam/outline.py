"""The cam plate as a closed contour that can be cut, and the roller path beside it.

The two flanks are exact; what closes the contour (a margin above, a tab below that
passes between the rollers, fixing holes) is a sensible choice that `mechanism.plate`
can change. The tab is narrower than the space between the rollers at the start.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.cam.build import assemble
from cfmkit.families.cam.checks import flanks_crossing
from cfmkit.families.refusals import CannotBuild
from cfmkit.geometry import Arc, Contour, Curve2D, Drawing, Edge, Line, Smooth

if TYPE_CHECKING:
    from cfmkit.bodies.cam_cut import CamProfile
    from cfmkit.curves import FloatArray
    from cfmkit.families.cam.spec import CamSpec, Plate

POINTS = 1201
TAB_CLEARANCE = 0.25
"""Space left between the tab and a roller, in roller radii."""


def drawing(spec: CamSpec) -> Drawing:
    """Return the plate, the roller paths and their point tables of a cam specification.

    Raises
    ------
    cfmkit.families.refusals.CannotBuild
        If there is no cam to draw.
    """
    assembly = assemble(spec)
    profile, plate = assembly.profile, assembly.spec.mechanism.plate
    if crossing := flanks_crossing(profile):
        raise CannotBuild(crossing)
    path = path_edge(profile)
    paths = Contour((path,), "path"), Contour((path.mirrored(),), "path")
    return Drawing("cam", (*plate_contours(profile, plate), *paths), tuple(_tables(profile)))


def plate_contours(profile: CamProfile, plate: Plate) -> tuple[Contour, ...]:
    """Return the outline of the plate with a flank, and its holes."""
    flank = flank_edge(profile)
    return plate_contour(flank, plate, profile), *holes(flank, plate, profile)


def _coordinates(profile: CamProfile, start: float) -> FloatArray:
    """Return path coordinates from `start` to the end, denser where the path is curved or steep most.

    Equal shares of length and of turning lie between neighbours: a path that is nearly
    vertical at its end, or turns within its first micrometres, is followed as well.
    """
    share = np.linspace(0.0, 1.0, POINTS)
    ends = np.concatenate([share**4, 1.0 - share**4, 0.3 * share + 0.7 * share**2])
    fine = np.unique(start + (profile.end - start) * ends)
    slope = profile.path.law.slope(fine)
    steps = np.hypot(np.diff(fine), np.diff(profile.path.height(fine)))
    measure = np.zeros_like(fine)
    for grown in (steps, np.diff(np.arctan(slope)), np.diff(fine)):
        measure[1:] += np.cumsum(grown) / max(float(np.sum(grown)), 1e-300)
    spread: FloatArray = np.interp(np.linspace(0.0, measure[-1], POINTS), measure, fine)
    return spread


def flank_edge(profile: CamProfile) -> Smooth:
    """Return the right flank from its lowest point up, trimmed at the corner if there is one."""
    u = _coordinates(profile, profile.start)
    return Smooth(np.column_stack(profile.flank(u)), _tangents(profile, u))


def path_edge(profile: CamProfile) -> Smooth:
    """Return the right roller's centre path from its start up."""
    u = _coordinates(profile, profile.path.law.rest_half_width)
    return Smooth(np.column_stack([u, profile.path.height(u)]), _tangents(profile, u))


def _tangents(profile: CamProfile, u: FloatArray) -> FloatArray:
    nx, ny = profile.normal(u)
    return np.column_stack([-ny, nx])


def plate_contour(flank: Smooth, plate: Plate, profile: CamProfile) -> Contour:
    """Return the closed outline: right flank up, top, left flank down, bottom with the tab."""
    first, last = flank.points[0], flank.points[-1]
    top = last[1] + plate.top_margin
    left = flank.mirrored().reversed()
    corners = [(last[0], last[1])]
    if plate.top_margin:
        corners += [(last[0], top), (-last[0], top)]
    corners.append((-last[0], last[1]))
    edges: list[Edge] = [flank, *_lines(corners), left]
    half = 0.5 * tab_width(plate, profile)
    below = [(-first[0], first[1])]
    if half > 0 and plate.base_height > 0:
        floor = first[1] - plate.base_height
        below += [(-half, first[1]), (-half, floor), (half, floor), (half, first[1])]
    below.append((first[0], first[1]))
    return Contour((*edges, *_lines(below)), "cut", closed=True)


def _lines(corners: list[tuple[float, float]]) -> list[Line]:
    points = [(float(x), float(y)) for x, y in corners]
    return [Line(a, b) for a, b in pairwise(points) if a != b]


def tab_width(plate: Plate, profile: CamProfile) -> float:
    """Return the width of the tab below the cam [m]; 0 if the rollers leave no space for one."""
    x0, radius = profile.path.law.rest_half_width, profile.roller_radius
    free = 2.0 * (x0 - (1.0 + TAB_CLEARANCE) * radius)
    lowest = 2.0 * float(profile.flank(profile.start)[0])
    widest = max(min(free, lowest), 0.0)
    return min(plate.base_width, lowest) if plate.base_width else widest


def holes(flank: Smooth, plate: Plate, profile: CamProfile) -> list[Contour]:
    """Return the fixing holes: two in the tab and two near the top, where there is room for them."""
    diameter, width = plate.hole_diameter, tab_width(plate, profile)
    if not diameter:
        return []
    first, last = flank.points[0], flank.points[-1]
    centers: list[tuple[float, float]] = []
    if plate.base_height >= 2.0 * diameter and width >= 6.0 * diameter:
        centers += [(side * 0.3 * width, first[1] - 0.5 * plate.base_height) for side in (-1.0, 1.0)]
    top = last[1] + plate.top_margin
    if top - first[1] >= 6.0 * diameter and last[0] >= 4.0 * diameter:
        centers += [(side * 0.5 * last[0], top - 2.0 * diameter) for side in (-1.0, 1.0)]
    return [_circle(center, 0.5 * diameter) for center in centers]


def _circle(center: tuple[float, float], radius: float) -> Contour:
    circle = Arc((float(center[0]), float(center[1])), radius, 0.0, 2.0 * np.pi)
    return Contour((circle,), "cut", closed=True, hole=True)


def _tables(profile: CamProfile) -> list[Curve2D]:
    """Return the exact points of both flanks and both roller paths."""
    law = profile.path.law
    on_path, on_flank = _coordinates(profile, law.rest_half_width), _coordinates(profile, profile.start)
    found = []
    for side, sign in (("right", 1.0), ("left", -1.0)):
        path = {
            "x": (sign * on_path, "length"),
            "y": (profile.path.height(on_path), "length"),
            "travel": (profile.path.travel(on_path), "length"),
            "slope": (law.slope(on_path), "ratio"),
            "curvature_radius": (law.curvature_radius(on_path), "length"),
        }
        x, y = profile.flank(on_flank)
        cam = {
            "x": (sign * x, "length"),
            "y": (y, "length"),
            "curvature_radius": (law.curvature_radius(on_flank) - profile.roller_radius, "length"),
        }
        found += [Curve2D(f"roller-path-{side}", path), Curve2D(f"cam-{side}", cam)]
    return found
