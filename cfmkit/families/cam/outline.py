"""The cam plate as a closed contour that can be cut, and the roller path beside it.

The two flanks are exact, each as its own side is analysed; what closes the contour (a margin above, a tab below that
passes between the rollers, fixing holes) is a sensible choice that `mechanism.plate`
can change. The tab is narrower than the space between the rollers at the start.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
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
    profiles, spec = (sides[0].profile, sides[1].profile), sides[0].spec
    for profile in dict.fromkeys(profiles):
        if crossing := flanks_crossing(profile):
            raise CannotBuild(crossing)
    cut, contact = CutPlate(profiles, spec.mechanism.plate), spec.mechanism.contact
    paths = Contour((path_edge(profiles[0]),), "path"), Contour((path_edge(profiles[1]).mirror(),), "path")
    thickness = cut.plate.thickness or (contact.width if contact else None)
    return Drawing(
        "cam",
        (*cut.contours, *paths),
        tuple(_tables(profiles)),
        cut.notes,
        Sheet(thickness, key="mechanism.plate.thickness"),
        dimensions=tuple(cut.dimensions()),
        facts=tuple(_title_block_lines(spec)),
    )


@dataclass(frozen=True)
class CutPlate:
    """The plate between a right and a left flank; both are drawn on the right."""

    profiles: Profiles
    plate: Plate

    @cached_property
    def flanks(self) -> tuple[Smooth, Smooth]:
        """Both flanks from their lowest points up."""
        return flank_edge(self.profiles[0]), flank_edge(self.profiles[1])

    @cached_property
    def tab_width(self) -> float:
        """Width of the tab below the cam [m]; 0 if the rollers leave no space for one."""
        free, lowest = np.inf, np.inf
        for profile in self.profiles:
            x0, radius = profile.path.law.rest_half_width, profile.roller_radius
            free = min(free, 2.0 * (x0 - (1.0 + TAB_CLEARANCE) * radius))
            lowest = min(lowest, 2.0 * float(profile.flank(profile.start)[0]))
        return min(self.plate.base_width, lowest) if self.plate.base_width else max(min(free, lowest), 0.0)

    @property
    def bottom(self) -> float:
        """Height of the cam's bottom [m]."""
        return float(min(flank.points[0, 1] for flank in self.flanks))

    @property
    def top(self) -> float:
        """Height of the plate's top [m]."""
        return float(max(flank.points[-1, 1] for flank in self.flanks)) + self.plate.top_margin

    @property
    def across(self) -> float:
        """Half the width at the top [m]."""
        return min(float(flank.points[-1, 0]) for flank in self.flanks)

    @property
    def tool_room(self) -> float:
        """Largest radius that the inside corners beside the tab have room for [m]; 0 without a tab."""
        beside = min(float(flank.points[0, 0]) for flank in self.flanks) - 0.5 * self.tab_width
        return min(beside, self.plate.base_height) if self.tab_width > 0 else 0.0

    @property
    def has_holes_in_tab(self) -> bool:
        """Whether the tab has room for two fixing holes."""
        size = self.plate.hole_diameter
        return bool(size and self.plate.base_height >= 2.0 * size and self.tab_width >= 6.0 * size)

    @property
    def has_holes_at_top(self) -> bool:
        """Whether there is room for two fixing holes near the top."""
        size = self.plate.hole_diameter
        return bool(size and self.top - self.bottom >= 6.0 * size and self.across >= 4.0 * size)

    @property
    def contours(self) -> tuple[Contour, ...]:
        """The outline of the plate, and its holes."""
        return self.outline, *self.holes

    @property
    def outline(self) -> Contour:
        """The closed outline: right flank up, top, left flank down, bottom with the tab.

        Flanks that begin or end at different heights leave a step.
        """
        plate, flanks = self.plate, self.flanks
        (low, high), (left_low, left_high) = ((flank.points[0], flank.points[-1]) for flank in flanks)
        above = [(high[0], high[1]), (high[0], self.top), (-left_high[0], self.top), (-left_high[0], left_high[1])]
        half, floor = 0.5 * self.tab_width, self.bottom - plate.base_height
        if half > 0 and plate.base_height > 0:
            tab = [(-half, left_low[1]), (-half, floor), (half, floor), (half, low[1])]
        else:  # a slanted bottom could pass through the higher roller
            tab = [(0.0, left_low[1]), (0.0, low[1])] if left_low[1] != low[1] else []
        bottom: list[Edge] = list(_lines_between([(-left_low[0], left_low[1]), *tab, (low[0], low[1])]))
        r = plate.tool_radius
        if 0 < r <= self.tool_room:
            left, right = left_low[1], low[1]
            bottom = [
                *_lines_between([(-left_low[0], left), (-half - r, left)]),
                Arc((-half - r, float(left) - r), r, 0.5 * np.pi, 0.0),
                *_lines_between([(-half, left - r), (-half, floor), (half, floor), (half, right - r)]),
                Arc((half + r, float(right) - r), r, np.pi, 0.5 * np.pi),
                *_lines_between([(half + r, right), (low[0], right)]),
            ]
        edges: list[Edge] = [flanks[0], *_lines_between(above), flanks[1].mirror().reverse(), *bottom]
        return Contour(tuple(edges), "cut", closed=True)

    @property
    def holes(self) -> list[Contour]:
        """The fixing holes: two in the tab and two near the top, where there is room for them."""
        diameter, centers = self.plate.hole_diameter, list[tuple[float, float]]()
        if self.has_holes_in_tab:
            height = self.bottom - 0.5 * self.plate.base_height
            centers += [(side * 0.3 * self.tab_width, height) for side in (-1.0, 1.0)]
        if self.has_holes_at_top:
            centers += [(side * 0.5 * self.across, self.top - 2.0 * diameter) for side in (-1.0, 1.0)]
        return [circle((float(x), float(y)), 0.5 * diameter, "cut", hole=True) for x, y in centers]

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on a tab or fixing holes that the plate lacks for want of room."""
        plate, diameter, width, faults = self.plate, self.plate.hole_diameter, self.tab_width, []
        if plate.base_height and not width:
            faults.append("the rollers leave no room for the tab below the cam: the plate has none ('mechanism.plate')")
        elif plate.base_height and diameter and not self.has_holes_in_tab:
            faults.append(
                f"the two {mm(diameter)} holes of the tab are left out: they need a tab of {mm(6 * diameter)} by "
                f"{mm(2 * diameter)}, it is {mm(width)} by {mm(plate.base_height)} ('mechanism.plate.base_width', "
                "'.base_height', '.hole_diameter')"
            )
        if plate.tool_radius > self.tool_room > 0:
            faults.append(
                f"inside corners beside the tab have room for a tool radius of {mm(self.tool_room)}, not "
                f"{mm(plate.tool_radius)}: they are drawn sharp ('mechanism.plate.tool_radius', '.base_width')"
            )
        if diameter and not self.has_holes_at_top:
            faults.append(
                f"the two {mm(diameter)} holes near the top are left out: they need a cam {mm(6 * diameter)} high and "
                f"{mm(8 * diameter)} wide, it is {mm(self.top - self.bottom)} by {mm(2 * self.across)} "
                "('mechanism.plate.hole_diameter')"
            )
        return tuple(faults)

    def dimensions(self) -> Iterator[DrawnDimension]:
        """Yield the main lengths of the plate, and where the rollers start."""
        right, left = (flank.points.tolist() for flank in self.flanks)
        yield DrawnDimension("cam", (0.0, right[0][1]), (0.0, right[-1][1]), "y")
        yield DrawnDimension("top", (-left[-1][0], left[-1][1]), (right[-1][0], right[-1][1]), "x")
        if half := 0.5 * self.tab_width:
            floor = self.bottom - self.plate.base_height
            yield DrawnDimension("tab", (-half, floor), (half, floor), "x")
        x0 = [profile.path.law.rest_half_width for profile in self.profiles]
        yield DrawnDimension("roller axes at the start", (-x0[1], 0.0), (x0[0], 0.0), "x")


def _lines_between(corners: list[tuple[float, float]]) -> list[Line]:
    points = [(float(x), float(y)) for x, y in corners]
    return [Line(a, b) for a, b in pairwise(points) if a != b]


def _title_block_lines(spec: CamSpec) -> Iterator[tuple[str, str]]:
    """Yield what the cam is made of, and what it is cut for."""
    mechanism, profile = spec.mechanism, spec.mechanism.profile
    yield "material", mechanism.contact.material.words if mechanism.contact else "not stated"
    yield "rollers", f"2, diameter {mm(2.0 * mechanism.roller_radius)}"
    yield "braces", f"2, {mm(mechanism.brace_length)} between pin and roller axis"
    rates = mechanism.springs.rates
    same = len(set(rates)) == 1
    yield "springs", f"{len(rates)} of {rate(rates[0])}" if same else f"{len(rates)}: {', '.join(map(rate, rates))}"
    if mechanism.preload:
        yield "preload", f"springs stretched by {mm(mechanism.preload)} at the start"
    yield "cut for", f"A {mm(profile.force_constant)}, rolling friction {profile.friction:g}"


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
