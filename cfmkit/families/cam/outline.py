"""The cam plate as a closed contour that can be cut, and the roller path beside it.

The two flanks are exact, each as its own side is analysed; what closes the contour (a margin above, a tab below that
passes between the rollers, fixing holes) is a sensible choice that `mechanism.plate`
can change. The tab is narrower than the space between the rollers at the start.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import distinct
from cfmkit.export.contours import (
    OUTLINE_TOLERANCE,
    Arc,
    Contour,
    Curve2D,
    Drawing,
    DrawnDimension,
    Edge,
    Line,
    Sheet,
    Smooth,
    circle,
)
from cfmkit.families.cam.mechanism_from_spec import assemble_sides, flanks_crossing
from cfmkit.families.findings import CannotBuild, mm, rate

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.geometry.flank_from_roller_path import CamProfile
    from cfmkit.families.cam.spec import CamSpec, Plate

    Profiles = tuple[CamProfile, CamProfile]
    """The right flank and the left one, each as it would be on the right."""

N_OUTLINE_POINTS = 1201
TAB_CLEARANCE = 0.25  # space left between the tab and a roller, in roller radii


def drawing(spec: CamSpec, tolerance: float = OUTLINE_TOLERANCE) -> Drawing:
    """Return the plate, the roller paths and their point tables of a cam specification.

    Raises `CannotBuild` if there is no cam to draw.
    """
    sides = assemble_sides(spec)
    profiles = sides[0].profile, sides[1].profile
    for profile in dict.fromkeys(profiles):
        if crossing := flanks_crossing(profile):
            raise CannotBuild(crossing)
    paths = Contour((path_edge(profiles[0]),), "path"), Contour((path_edge(profiles[1]).mirror(),), "path")
    plate = sides[0].spec.mechanism.plate
    contours = (*plate_contours(profiles, plate), *paths)
    contact = sides[0].spec.mechanism.contact
    sheet = Sheet(plate.thickness or (contact.width if contact else None), key="mechanism.plate.thickness")
    dimensions, facts = tuple(_dimensions(profiles, plate)), tuple(_facts(sides[0].spec))
    return Drawing(
        "cam",
        contours,
        tuple(_tables(profiles)),
        plate_notes(profiles, plate),
        sheet,
        dimensions=dimensions,
        facts=facts,
    )


def _dimensions(profiles: Profiles, plate: Plate) -> Iterator[DrawnDimension]:
    """Yield the main lengths of the plate, and where the rollers start."""
    right, left = (flank_edge(profile).points for profile in profiles)
    yield DrawnDimension("cam", (0.0, float(right[0, 1])), (0.0, float(right[-1, 1])), "y")
    yield DrawnDimension(
        "top", (-float(left[-1, 0]), float(left[-1, 1])), (float(right[-1, 0]), float(right[-1, 1])), "x"
    )
    if half := 0.5 * tab_width(plate, profiles):
        floor = float(min(right[0, 1], left[0, 1])) - plate.base_height
        yield DrawnDimension("tab", (-half, floor), (half, floor), "x")
    x0 = [profile.path.law.rest_half_width for profile in profiles]
    yield DrawnDimension("roller axes at the start", (-x0[1], 0.0), (x0[0], 0.0), "x")


def _facts(spec: CamSpec) -> Iterator[tuple[str, str]]:
    """Yield what the cam is made of, and what it is cut for."""
    mechanism, profile = spec.mechanism, spec.mechanism.profile
    yield "material", mechanism.contact.material.words if mechanism.contact else "not stated"
    yield "rollers", f"2, diameter {mm(2.0 * mechanism.roller_radius)}"
    yield "braces", f"2, {mm(mechanism.brace_length)} between pin and roller axis"
    stated_rates, count = mechanism.springs.each, mechanism.springs.count or 1
    rates = stated_rates if isinstance(stated_rates, tuple) else (stated_rates,) * count
    same = len(set(rates)) == 1
    yield "springs", f"{len(rates)} of {rate(rates[0])}" if same else f"{len(rates)}: {', '.join(map(rate, rates))}"
    if mechanism.preload:
        yield "preload", f"springs stretched by {mm(mechanism.preload)} at the start"
    yield "cut for", f"A {mm(profile.force_constant)}, rolling friction {profile.friction:g}"


def plate_contours(profiles: Profiles, plate: Plate) -> tuple[Contour, ...]:
    """Return the outline of the plate between a right and a left flank, and its holes."""
    flanks = flank_edge(profiles[0]), flank_edge(profiles[1])
    return plate_contour(flanks, plate, profiles), *holes(flanks, plate, profiles)


def _coordinates(profile: CamProfile, start: float) -> FloatArray:
    """Return path coordinates from `start` to the end, denser where the path is curved or steep most.

    Equal shares of length and of turning lie between neighbours: a path that is nearly
    vertical at its end, or turns within its first micrometres, is followed as well.
    """
    share = np.linspace(0.0, 1.0, N_OUTLINE_POINTS)
    ends = np.concatenate([share**4, 1.0 - share**4, 0.3 * share + 0.7 * share**2])
    fine = distinct(start + (profile.end - start) * ends)
    slope = profile.path.law.slope(fine)
    steps = np.hypot(np.diff(fine), np.diff(profile.path.height(fine)))
    measure = np.zeros_like(fine)
    for grown in (steps, np.abs(np.diff(np.arctan(slope))), np.diff(fine)):
        measure[1:] += np.cumsum(grown) / max(float(np.sum(grown)), 1e-300)
    spread: FloatArray = np.interp(np.linspace(0.0, measure[-1], N_OUTLINE_POINTS), measure, fine)
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


def plate_contour(flanks: tuple[Smooth, Smooth], plate: Plate, profiles: Profiles) -> Contour:
    """Return the closed outline: right flank up, top, left flank down, bottom with the tab.

    `flanks` are both drawn on the right; flanks that begin or end at different heights leave a step.
    """
    (low, high), (left_low, left_high) = ((flank.points[0], flank.points[-1]) for flank in flanks)
    top = max(high[1], left_high[1]) + plate.top_margin
    above = [(high[0], high[1]), (high[0], top), (-left_high[0], top), (-left_high[0], left_high[1])]
    half = 0.5 * tab_width(plate, profiles)
    if half > 0 and plate.base_height > 0:
        floor = min(low[1], left_low[1]) - plate.base_height
        tab = [(-half, left_low[1]), (-half, floor), (half, floor), (half, low[1])]
    else:  # a slanted bottom could pass through the higher roller
        tab = [(0.0, left_low[1]), (0.0, low[1])] if left_low[1] != low[1] else []
    below = [(-left_low[0], left_low[1]), *tab, (low[0], low[1])]
    bottom: list[Edge] = list(_lines(below))
    r = plate.tool_radius
    if 0 < r <= _room_for_tool(flanks, plate, profiles):
        (left, right), floor = (left_low[1], low[1]), min(low[1], left_low[1]) - plate.base_height
        bottom = [
            *_lines([(-left_low[0], left), (-half - r, left)]),
            Arc((-half - r, float(left) - r), r, 0.5 * np.pi, 0.0),
            *_lines([(-half, left - r), (-half, floor), (half, floor), (half, right - r)]),
            Arc((half + r, float(right) - r), r, np.pi, 0.5 * np.pi),
            *_lines([(half + r, right), (low[0], right)]),
        ]
    edges: list[Edge] = [flanks[0], *_lines(above), flanks[1].mirror().reverse(), *bottom]
    return Contour(tuple(edges), "cut", closed=True)


def _room_for_tool(flanks: tuple[Smooth, Smooth], plate: Plate, profiles: Profiles) -> float:
    """Return the largest radius that the inside corners beside the tab have room for [m]; 0 without a tab."""
    half = 0.5 * tab_width(plate, profiles)
    beside = min(float(flank.points[0, 0]) for flank in flanks) - half
    return min(beside, plate.base_height) if half > 0 else 0.0


def _lines(corners: list[tuple[float, float]]) -> list[Line]:
    points = [(float(x), float(y)) for x, y in corners]
    return [Line(a, b) for a, b in pairwise(points) if a != b]


def tab_width(plate: Plate, profiles: Profiles) -> float:
    """Return the width of the tab below the cam [m]; 0 if the rollers leave no space for one."""
    free, lowest = np.inf, np.inf
    for profile in profiles:
        x0, radius = profile.path.law.rest_half_width, profile.roller_radius
        free = min(free, 2.0 * (x0 - (1.0 + TAB_CLEARANCE) * radius))
        lowest = min(lowest, 2.0 * float(profile.flank(profile.start)[0]))
    widest = max(min(free, lowest), 0.0)
    return min(plate.base_width, lowest) if plate.base_width else widest


def holes(flanks: tuple[Smooth, Smooth], plate: Plate, profiles: Profiles) -> list[Contour]:
    """Return the fixing holes: two in the tab and two near the top, where there is room for them."""
    diameter, width = plate.hole_diameter, tab_width(plate, profiles)
    bottom, top, across = _extents(flanks, plate)
    centers: list[tuple[float, float]] = []
    if _room_in_tab(plate, width):
        centers += [(side * 0.3 * width, bottom - 0.5 * plate.base_height) for side in (-1.0, 1.0)]
    if _room_at_top(plate, top - bottom, across):
        centers += [(side * 0.5 * across, top - 2.0 * diameter) for side in (-1.0, 1.0)]
    return [circle((float(x), float(y)), 0.5 * diameter, "cut", hole=True) for x, y in centers]


def _extents(flanks: tuple[Smooth, Smooth], plate: Plate) -> tuple[float, float, float]:
    """Return the heights of the cam's bottom and of the plate's top, and half its width there [m]."""
    bottom, top = min(flank.points[0, 1] for flank in flanks), max(flank.points[-1, 1] for flank in flanks)
    return bottom, top + plate.top_margin, min(float(flank.points[-1, 0]) for flank in flanks)


def _room_in_tab(plate: Plate, width: float) -> bool:
    return bool(
        plate.hole_diameter and plate.base_height >= 2.0 * plate.hole_diameter and width >= 6.0 * plate.hole_diameter
    )


def _room_at_top(plate: Plate, height: float, across: float) -> bool:
    return bool(plate.hole_diameter and height >= 6.0 * plate.hole_diameter and across >= 4.0 * plate.hole_diameter)


def plate_notes(profiles: Profiles, plate: Plate) -> tuple[str, ...]:
    """Return what the plate lacks for want of room: its tab, or some of its fixing holes."""
    flanks, diameter = (flank_edge(profiles[0]), flank_edge(profiles[1])), plate.hole_diameter
    width, (bottom, top, across) = tab_width(plate, profiles), _extents(flanks, plate)
    faults = []
    if plate.base_height and not width:
        faults.append("the rollers leave no room for the tab below the cam: the plate has none ('mechanism.plate')")
    elif plate.base_height and diameter and not _room_in_tab(plate, width):
        faults.append(
            f"the two {mm(diameter)} holes of the tab are left out: they need a tab of {mm(6 * diameter)} by "
            f"{mm(2 * diameter)}, it is {mm(width)} by {mm(plate.base_height)} ('mechanism.plate.base_width', "
            "'.base_height', '.hole_diameter')"
        )
    room = _room_for_tool(flanks, plate, profiles)
    if plate.tool_radius > room > 0:
        faults.append(
            f"inside corners beside the tab have room for a tool radius of {mm(room)}, not {mm(plate.tool_radius)}: "
            "they are drawn sharp ('mechanism.plate.tool_radius', '.base_width')"
        )
    if diameter and not _room_at_top(plate, top - bottom, across):
        faults.append(
            f"the two {mm(diameter)} holes near the top are left out: they need a cam {mm(6 * diameter)} high and "
            f"{mm(8 * diameter)} wide, it is {mm(top - bottom)} by {mm(2 * across)} ('mechanism.plate.hole_diameter')"
        )
    return tuple(faults)


def _tables(profiles: Profiles) -> Iterator[Curve2D]:
    """Yield the exact points of both flanks and both roller paths."""
    for side, sign, profile in zip(("right", "left"), (1.0, -1.0), profiles, strict=True):
        law = profile.path.law
        on_path, on_flank = _coordinates(profile, law.rest_half_width), _coordinates(profile, profile.start)
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
        yield from (Curve2D(f"roller-path-{side}", path), Curve2D(f"cam-{side}", cam))
