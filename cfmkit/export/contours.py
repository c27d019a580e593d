"""Planar outlines as values: edges, contours, layers, sections of beams, dimensions; `Drawing`, which families make.

A contour is a chain of edges, each ending where the next begins. Smooth curves carry exact points and exact unit
tangents, so that an exporter can fit arcs or splines within a stated tolerance instead of chopping them into a
polyline. All lengths in metres.

Sections of beams, as specified, say how thick a drawn or meshed part must be: across the middle of every smooth piece
of a beam it has the beam's thickness. Joints are left out: sections at which the part runs on into another beam or a
block, and short pieces beside a step, which a fillet may thicken.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from cfmkit.arrays import FloatArray, ShortRepr, distinct, read_only
from cfmkit.errors import GeometryError
from cfmkit.numerics.arc_chains import cubic
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cfmkit.results import Finding


@dataclass(frozen=True)
class LayerLook:
    """Colour as AutoCAD index and as RGB, and the dashes [mm] of a line that nothing is cut along."""

    index: int
    rgb: str
    dashes: tuple[float, ...] = ()


_LAYER_LOOKS = {
    "cut": LayerLook(1, "#ff0000"),
    "path": LayerLook(150, "#007fff", (6.0, 1.5, 1.0, 1.5)),
    "reference": LayerLook(8, "#808080"),
}
HELD_LAYER, DRIVEN_LAYER = "held", "driven"
"""Layers of what stands while the mechanism works, and of what is moved: closed contours that nothing is cut along."""
ENGRAVED_LAYER = "engraved"  # layer of texts on the parts
_MARK_LOOKS = {HELD_LAYER: LayerLook(3, "#008000", (1.0, 1.0)), DRIVEN_LAYER: LayerLook(30, "#ff8000", (1.0, 1.0))}
_MARK_LOOKS[ENGRAVED_LAYER] = LayerLook(5, "#0000ff")
_OTHER_LOOKS = (LayerLook(6, "#ff00ff"), LayerLook(4, "#00a0a0"), LayerLook(34, "#995200"), LayerLook(92, "#408000"))


def looks(used: Iterable[str]) -> dict[str, LayerLook]:
    """Return the look of the three usual layers, of marks and of every other one in use, in that order."""
    used = list(dict.fromkeys(used))
    marks = {name: look for name, look in _MARK_LOOKS.items() if name in used}
    others = [name for name in used if name not in _LAYER_LOOKS | marks]
    for name in others:
        check_name(name, "layer")
    return _LAYER_LOOKS | marks | {name: _OTHER_LOOKS[index % len(_OTHER_LOOKS)] for index, name in enumerate(others)}


def check_name(name: str, what: str) -> str:
    """Return `name` if it can be part of a file name and of every format.

    Raises GeometryError if it cannot.
    """
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}", name):
        raise GeometryError(f"{name!r} cannot name a {what}: use letters, digits, '-', '_' and '.', at most 100")
    return name


SECTION_RTOL = 1e-3  # largest relative error of an area and of a section modulus, b t^2 / 6


@dataclass(frozen=True, eq=False)
class BeamSection:
    """A section of a beam as specified."""

    beam: str  # its name, for messages
    # at, across, (2,): its middle [m], and the unit vector along it
    at: FloatArray
    across: FloatArray
    # thickness, length: of the beam there, and of its piece that is smooth [m]
    thickness: float
    length: float

    def cut(self, starts: FloatArray, ends: FloatArray) -> tuple[float, float]:
        """Return how far the material goes to both sides, as bounded by lines (n, 2) [m]; infinite without a bound."""
        along = np.array([self.across[1], -self.across[0]])
        first, second = ((points - self.at) @ along for points in (starts, ends))
        met = (first > 0) != (second > 0)
        share = first[met] / (first[met] - second[met])
        away = ((starts[met] + share[:, None] * (ends[met] - starts[met])) - self.at) @ self.across
        return (
            float(-away[away < 0].max(initial=-np.inf)),
            float(away[away > 0].min(initial=np.inf)),
        )

    def line(self, cut: tuple[float, float]) -> FloatArray:
        """Return the ends of the section that reaches so far to both sides (2, 2) [m]."""
        return np.array([self.at - cut[0] * self.across, self.at + cut[1] * self.across])

    def check(self, measured: float, what: str, remedy: str) -> None:
        """Refuse a thickness [m] whose section modulus is not that of the specification.

        Raises GeometryError with the beam, the place, both values and a remedy.
        """
        if abs((measured / self.thickness) ** 2 - 1.0) <= SECTION_RTOL:
            return
        x, y = (format_short(float(coordinate), "length") for coordinate in self.at)
        reported = f"{format_short(measured, 'length')} thick" if np.isfinite(measured) else "endless"
        raise GeometryError(
            f"beam {self.beam!r} is {reported} in the {what} at ({x}, {y}), but "
            f"{format_short(self.thickness, 'length')} in the specification: {remedy}"
        )


def lines_of(rings: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return starts and ends (n, 2) of the lines of closed rings (k, 2) of points [m]."""
    return np.concatenate(list(rings)), np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])


OUTLINE_TOLERANCE = 5e-6  # how far outlines may be from the exact ones by default [m]


@dataclass(frozen=True)
class Line:
    """A straight edge from `start` to `end`, each (2,) [m]."""

    start: tuple[float, float]
    end: tuple[float, float]

    @property
    def ends(self) -> tuple[complex, complex]:
        """First and last point as x + iy [m]."""
        return complex(*self.start), complex(*self.end)

    def reverse(self) -> Line:
        """Return the same line from its end to its start."""
        return Line(self.end, self.start)

    def mirror(self) -> Line:
        """Return the mirror image about the y axis, run in the same order of points."""
        return Line((-self.start[0], self.start[1]), (-self.end[0], self.end[1]))


@dataclass(frozen=True)
class Arc:
    """A circular edge about `center` [m], from angle `start` to `end` [rad].

    Counter-clockwise if ``end > start``, else clockwise; ``end - start = 2 pi`` is a full circle.
    """

    center: tuple[float, float]
    radius: float
    start: float
    end: float

    @property
    def ends(self) -> tuple[complex, complex]:
        """First and last point as x + iy [m]."""
        return self._locate(self.start), self._locate(self.end)

    def _locate(self, angle: float) -> complex:
        return complex(*self.center) + self.radius * complex(math.cos(angle), math.sin(angle))

    @property
    def full(self) -> bool:
        """Whether the edge is one whole circle."""
        return math.isclose(abs(self.end - self.start), 2 * math.pi, rel_tol=1e-12)

    def reverse(self) -> Arc:
        """Return the same arc from its end to its start."""
        return Arc(self.center, self.radius, self.end, self.start)

    def mirror(self) -> Arc:
        """Return the mirror image about the y axis, run in the same order of points."""
        return Arc((-self.center[0], self.center[1]), self.radius, math.pi - self.start, math.pi - self.end)


@dataclass(frozen=True)
class Smooth:
    """A smooth edge: exact `points` (n, 2) [m] with exact unit `tangents` (n, 2) along it."""

    points: FloatArray
    tangents: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", read_only(self.points))
        object.__setattr__(self, "tangents", read_only(self.tangents))
        if self.points.shape != self.tangents.shape or self.points.ndim != 2 or self.points.shape[1] != 2:
            raise ValueError("points and tangents of a smooth edge must both be (n, 2)")

    @property
    def ends(self) -> tuple[complex, complex]:
        """First and last point as x + iy [m]."""
        return complex(*self.points[0]), complex(*self.points[-1])

    def reverse(self) -> Smooth:
        """Return the same edge from its last point to its first."""
        return Smooth(self.points[::-1], -self.tangents[::-1])

    def mirror(self) -> Smooth:
        """Return the mirror image about the y axis, run in the same order of points."""
        flip = np.array([-1.0, 1.0])
        return Smooth(self.points * flip, self.tangents * flip)


Edge = Line | Arc | Smooth


@dataclass(frozen=True)
class Contour:
    """A chain of edges on one layer; `closed` contours end where they begin.

    `hole` marks a closed contour that bounds material from inside (kerf goes the other way).
    """

    edges: tuple[Edge, ...]
    layer: str
    closed: bool = False
    hole: bool = False

    @property
    def extents(self) -> tuple[float, float, float, float]:
        """Smallest x and y, largest x and y of the edges' points [m]; arcs count as whole circles."""
        corners = np.concatenate([_rough_extreme_points(edge) for edge in self.edges])
        return (*corners.min(axis=0).tolist(), *corners.max(axis=0).tolist())

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Smallest x and y, largest x and y of the edges [m], of arcs as far as they go."""
        corners = np.concatenate([_extreme_points(edge) for edge in self.edges])
        return (*corners.min(axis=0).tolist(), *corners.max(axis=0).tolist())

    def points(self, sagitta: float, turn: float = math.inf) -> FloatArray:
        """Return points (n, 2) [m] along closed edges, smooth ones' own among them, within `sagitta` [m] of all edges.

        On arcs neighbouring lines differ by `turn` [rad] at most.
        """
        pieces = [_points_along(edge, sagitta, turn) for edge in self.edges]
        return np.concatenate([piece[:-1] for piece in pieces])


def _rough_extreme_points(edge: Edge) -> FloatArray:
    if isinstance(edge, Smooth):
        return edge.points
    if isinstance(edge, Line):
        return np.array([edge.start, edge.end])
    return np.array(edge.center) + edge.radius * np.array([[-1.0, -1.0], [1.0, 1.0]])


def _extreme_points(edge: Edge) -> FloatArray:
    """Return points (n, 2) [m] whose bounding box is that of an edge."""
    if not isinstance(edge, Arc):
        return _rough_extreme_points(edge)
    low, high = sorted((edge.start, edge.end))
    quarters = 0.5 * math.pi * np.arange(math.ceil(low / (0.5 * math.pi)), math.floor(high / (0.5 * math.pi)) + 1)
    angle = np.array([low, high, *quarters])
    return np.array(edge.center) + edge.radius * np.column_stack([np.cos(angle), np.sin(angle)])


def _points_along(edge: Edge, sagitta: float, turn: float) -> FloatArray:
    if isinstance(edge, Smooth):
        return _points_between(edge, sagitta)
    if isinstance(edge, Line):
        return np.array([edge.start, edge.end])
    # quarter turns at most: a circle within `sagitta` of its centre is still a ring
    step = min(2.0 * math.acos(max(1.0 - sagitta / edge.radius, 0.0)), turn, 0.5 * math.pi)
    count = max(math.ceil(abs(edge.end - edge.start) / step), 2)
    angle = np.linspace(edge.start, edge.end, count + 1)
    return np.array(edge.center) + edge.radius * np.column_stack([np.cos(angle), np.sin(angle)])


def _points_between(edge: Smooth, sagitta: float) -> FloatArray:
    """Return the points of a smooth edge, and between them those of its cubics that keep lines within `sagitta` [m]."""
    z, t = (values @ np.array([1, 1j]) for values in (edge.points, edge.tangents))
    bulge = np.abs(np.diff(z) * np.angle(t[1:] / t[:-1])) / 8.0
    count = np.maximum(np.ceil(np.sqrt(bulge / sagitta)), 1).astype(int)
    if count.max() == 1:
        return edge.points
    k = np.repeat(np.arange(len(count)), count)
    share = (np.arange(len(k)) - np.repeat(np.cumsum(count) - count, count)) / count[k]
    inner = cubic(z[k], t[k], z[k + 1], t[k + 1], share)
    points = np.column_stack([inner.real, inner.imag])
    points[share == 0.0] = edge.points[:-1]
    return np.vstack([points, edge.points[-1]])


UNCUT_LAYERS = ("path", "reference", HELD_LAYER, DRIVEN_LAYER)  # layers that nothing is cut along


def circle(center: tuple[float, float], radius: float, layer: str, hole: bool = False) -> Contour:
    """Return a full circle [m] as a closed contour."""
    return Contour((Arc(center, radius, 0.0, 2 * math.pi),), layer, closed=True, hole=hole)


def polygon(corners: Sequence[tuple[float, float]], layer: str, hole: bool = False) -> Contour:
    """Return a closed contour of straight edges through `corners` [m]."""
    ends = (*corners[1:], corners[0])
    return Contour(tuple(Line(a, b) for a, b in zip(corners, ends, strict=True)), layer, closed=True, hole=hole)


def mark(shape: FloatArray, driven: bool) -> Contour:
    """Return a polygon (n, 2) [m], or a line (2, 2), on the layer of what stands or of what is driven."""
    layer, corners = DRIVEN_LAYER if driven else HELD_LAYER, [(float(x), float(y)) for x, y in shape]
    return Contour((Line(*corners),), layer) if len(corners) == 2 else polygon(corners, layer)


REFERENCE_SIZE = 0.05  # side of the reference square [m]


def reference_square(
    size: float = REFERENCE_SIZE,  # length of a side [m]
    corner: tuple[float, float] = (0.0, 0.0),  # the lower left corner [m]
) -> Contour:
    """Return a square on layer `reference`, with which a user checks the scale of a print."""
    x, y = corner
    return polygon([(x, y), (x + size, y), (x + size, y + size), (x, y + size)], "reference")


@dataclass(frozen=True)
class Curve2D:
    """A named table for CSV: exact points x, y [m] along a curve, and further columns."""

    name: str
    columns: dict[str, tuple[FloatArray, str]]


@dataclass(frozen=True)
class Region:
    """Region of another thickness than elsewhere: within a closed `polygon` (n, 2) [m], `thickness` [m]."""

    polygon: FloatArray
    thickness: float


@dataclass(frozen=True)
class Sheet:
    """Thickness of parts across the plane of the drawing."""

    thickness: float | None = None  # wherever no region says otherwise [m]; None if the specification does not tell
    regions: tuple[Region, ...] = ()  # where two overlap, the thicker one holds
    key: str = ""  # what in a specification says it, for messages


@dataclass(frozen=True)
class DrawnDimension:
    """A length that a drawing states: between two points, measured along x, along y or straight."""

    name: str  # in words, as the family's keys have it
    # start, end: what is measured between [m]
    start: tuple[float, float]
    end: tuple[float, float]
    along: Literal["x", "y", "line"] = "line"  # in which direction

    @property
    def value(self) -> float:
        """The length [m]."""
        x, y = abs(self.end[0] - self.start[0]), abs(self.end[1] - self.start[1])
        return {"x": x, "y": y, "line": math.hypot(x, y)}[self.along]


@dataclass(frozen=True)
class EngravedText:
    """A text that is engraved: its middle [m], the height of its letters [m], and its direction [rad]."""

    text: str
    at: tuple[float, float]
    height: float
    angle: float = 0.0


@dataclass(frozen=True, repr=False)
class Drawing(ShortRepr):
    """Everything about a part that can be cut: contours for DXF and SVG, tables for CSV, thickness for STL.

    `name` is the file stem; `cut`, `path` and `reference` are the usual layers, `held` and `driven` mark what stands
    and what is moved. `notes` say what the contours do not show: how often a part is to be made. `dimensions` and
    `facts` are what a sheet of paper says beside the outline: main lengths, and what it is made of in (word, text).
    `labels` are engraved. `warnings` say what is wrong with the part as drawn. `tolerance` is how far files may be from
    the exact outlines unless somebody states another value [m]. `sections` are those of beams that the outline has.
    """

    name: str
    contours: tuple[Contour, ...]
    tables: tuple[Curve2D, ...] = ()
    notes: tuple[str, ...] = ()
    sheet: Sheet = Sheet()
    dimensions: tuple[DrawnDimension, ...] = ()
    facts: tuple[tuple[str, str], ...] = ()
    labels: tuple[EngravedText, ...] = ()
    warnings: tuple[Finding, ...] = ()
    tolerance: float = OUTLINE_TOLERANCE
    sections: tuple[BeamSection, ...] = ()

    @property
    def extents(self) -> tuple[float, float, float, float]:
        """Smallest x and y, largest x and y of what is cut [m]."""
        boxes = np.array([contour.box for contour in self.contours if contour.layer not in UNCUT_LAYERS])
        return (*boxes[:, :2].min(axis=0).tolist(), *boxes[:, 2:].max(axis=0).tolist())

    def with_reference_square(self) -> Drawing:
        """Return the drawing with a reference square of 50 mm to its right, unless it has a reference already."""
        if not self.contours or any(contour.layer == "reference" for contour in self.contours):
            return self
        boxes = np.array([contour.extents for contour in self.contours])
        corner = (float(boxes[:, 2].max()) + REFERENCE_SIZE / 5, float(boxes[:, 1].min()))
        return replace(self, contours=(*self.contours, reference_square(REFERENCE_SIZE, corner)))


def signed_area(points: FloatArray) -> float:
    """Return the area within a closed chain of points (n, 2) [m2], negative where it runs clockwise."""
    x, y = (points - points[0]).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def polygons(contours: Sequence[Contour], points: int = 240) -> list[FloatArray]:
    """Return the closed contours that are cut as closed chains of points, for pictures only.

    Parameters
    ----------
    contours : sequence of Contour
        Of a drawing.
    points : int
        Most points that are taken of a smooth edge, evenly by index; its ends are always among them.

    Returns
    -------
    list of (n, 2) array
        Counter-clockwise, holes clockwise [m].
    """
    chosen = [contour for contour in contours if contour.closed and contour.layer == "cut"]
    rings = []
    for contour in chosen:
        chain = np.concatenate([_points_for_picture(edge, points) for edge in contour.edges])
        rings.append(chain if (signed_area(chain) > 0.0) != contour.hole else chain[::-1])
    return rings


def _points_for_picture(edge: Edge, most_of_smooth: int) -> FloatArray:
    """Return points along an edge, both ends included, (n, 2) [m]: 2 of a line, 73 of an arc."""
    if isinstance(edge, Smooth):
        chosen = distinct(np.linspace(0, len(edge.points) - 1, most_of_smooth).astype(int))
        return np.asarray(edge.points[chosen])
    if isinstance(edge, Line):
        return np.array([edge.start, edge.end], dtype=float)
    angle = np.linspace(edge.start, edge.end, 73)
    return np.column_stack([edge.center[0] + edge.radius * np.cos(angle), edge.center[1] + edge.radius * np.sin(angle)])
