"""Beams as strips of their true thickness before any load, and the gaps between them before and during the motion."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.model.beam_fits import beam_end_at
from cfmkit.errors import GeometryError
from cfmkit.export.contours import BeamSection, Line, Smooth
from cfmkit.export.union import OutlinePiece
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.model.beam import Beam, Fit
    from cfmkit.elastica.model.network import Network
    from cfmkit.export.contours import Edge
    from cfmkit.families.beam.network_from_spec import Mirror

STEP_LIMITS, MOST_STEPS = 160, 20_000
_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(4)
LINE_RTOL = 1e-9  # of the thickness: edges that bulge less are lines
COMPLEX_STEP = 1e-30  # of a complex step
COMMON_END_THICKNESSES = 3.0  # thicknesses beside a common end that are no gap
MAX_OVERLAP_SHARE = 0.02  # of half the thickness, by which beams in contact may overlap as drawn by straight pieces
END_DISTANCE_RATIO = 0.25  # of the thickness: ends closer than this are one


@dataclass(frozen=True)
class BeamStrip:
    """A smooth piece of a beam."""

    points: FloatArray  # (n, 2) of its centre line [m]
    # angle, thickness, (n,): there [rad], [m]
    angle: FloatArray
    thickness: FloatArray
    # curvature, slope, (n,): how fast these change along the line [1/m], [1]
    curvature: FloatArray
    slope: FloatArray

    @property
    def sides(self) -> tuple[FloatArray, FloatArray]:
        """The left and the right edge, (n, 2) [m]."""
        normal = np.column_stack([-np.sin(self.angle), np.cos(self.angle)])
        half = 0.5 * self.thickness[:, None] * normal
        return self.points + half, self.points - half

    @property
    def edges(self) -> tuple[Edge, ...]:
        """Its boundary, counter-clockwise: right edge, end, left edge, start."""
        along = np.column_stack([np.cos(self.angle), np.sin(self.angle)])
        aside = np.column_stack([-along[:, 1], along[:, 0]])
        bend, opens = 0.5 * (self.thickness * self.curvature)[:, None], 0.5 * self.slope[:, None]
        left, right = self.sides
        ways = ((1.0 - bend) * along + opens * aside, (1.0 + bend) * along - opens * aside)
        left_edge, right_edge = (tangent / np.hypot(*tangent.T)[:, None] for tangent in ways)
        start, end = ((tuple(right[k].tolist()), tuple(left[k].tolist())) for k in (0, -1))
        return Smooth(right, right_edge), Line(*end), Smooth(left[::-1], -left_edge[::-1]), Line(*start[::-1])

    @property
    def straight(self) -> bool:
        """Whether its edges are straight lines."""
        chords = [line[-1] - line[0] for line in self.sides]
        off = [np.abs(chord[0] * (line - line[0])[:, 1] - chord[1] * (line - line[0])[:, 0]).max() / np.hypot(*chord)
               for line, chord in zip(self.sides, chords, strict=True)]  # fmt: skip
        return bool(max(off) <= LINE_RTOL * float(self.thickness.min()))

    @property
    def length(self) -> float:
        """Of its centre line [m]."""
        return float(np.hypot(*np.diff(self.points, axis=0).T).sum())

    def section(self, beam: str) -> BeamSection:
        """Return the section in its middle, of a beam of that name."""
        k = len(self.points) // 2
        across = np.array([-np.sin(self.angle[k]), np.cos(self.angle[k])])
        return BeamSection(beam, self.points[k], across, float(self.thickness[k]), self.length)

    @property
    def piece(self) -> OutlinePiece:
        """Name of what it is of the part."""
        if self.straight:
            left, right = self.sides
            return OutlinePiece.polygon(np.array([right[0], right[-1], left[-1], left[0]]))
        return OutlinePiece(self.edges, tuple(self.polygons))

    def reflect(self, mirror: Mirror) -> BeamStrip:
        """Return its mirror image."""
        points, angle = mirror.reflect(self.points), 2.0 * mirror.direction - self.angle
        return replace(self, points=points, angle=angle, curvature=-self.curvature)

    @property
    def sagitta(self) -> float:
        """Largest distance of the edges and the centre line from the lines between neighbouring points [m]."""
        turn = np.abs(np.diff(self.angle))
        chords = np.max([np.hypot(*np.diff(line, axis=0).T) for line in (self.points, *self.sides)], axis=0)
        return float((turn * (chords + turn * self.thickness[1:])).max(initial=0.0)) / 8.0

    @property
    def polygon(self) -> FloatArray:
        """The outline, (2n, 2) [m]."""
        left, right = self.sides
        return np.concatenate([left, right[::-1]])

    @property
    def polygons(self) -> list[FloatArray]:
        """The outline, or where the strip winds, outlines of parts that do not overlap themselves, (2n, 2) each [m].

        The union of windings takes a second in parts, and twenty as one outline that crosses itself thousands of times.
        """
        turned = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(self.angle)))])
        if turned[-1] <= 2 * np.pi:
            return [self.polygon]
        left, right = self.sides
        cuts = [*np.searchsorted(turned, np.arange(0.0, turned[-1], 0.5 * np.pi)).tolist(), len(turned) - 1]
        parts = [slice(first, last + 1) for first, last in itertools.pairwise(cuts) if last > first]
        return [np.concatenate([left[part], right[part][::-1]]) for part in parts]


def strips(network: Network, fits: Mapping[str, Fit], name: str, tolerance: float = np.inf) -> list[BeamStrip]:
    """Return a beam in smooth pieces, from its first end to its last.

    It is cut where its shape has a corner and where its thickness has a kink or a step. Lines between the points of
    a piece are no farther than `tolerance` [m] from its edges and its centre line.

    Raises GeometryError if more points would be needed for that than a drawing can have.
    """
    beam, fit = network.beams[name], fits[name]
    at = np.array(beam_end_at(network, name, 0))
    cuts = {*fit.course.breaks.tolist(), *(fit.parameter(float(place)) for place in beam.section.stations)}
    pieces = []
    for low, high in itertools.pairwise(sorted(cuts)):
        count = max(4, int(np.ceil(STEP_LIMITS * (high - low))))
        piece = _piece(beam, fit, at, np.linspace(low, high, count + 1))
        while piece.sagitta > tolerance and count < MOST_STEPS:
            count = min(MOST_STEPS, int(1.1 * count * np.sqrt(piece.sagitta / tolerance)) + 1)
            piece = _piece(beam, fit, at, np.linspace(low, high, count + 1))
        if piece.sagitta > tolerance:
            size = format_short(float(np.hypot(*np.diff(piece.points, axis=0).T).sum()), "length")
            raise GeometryError(
                f"{name!r}, {size} long, is too large to be drawn to the tolerance: {MOST_STEPS} points do not follow "
                "its edges that closely; draw it with a coarser --tolerance"
            )
        pieces.append(piece)
        at = piece.points[-1]
    return pieces


def _piece(beam: Beam, fit: Fit, at: FloatArray, t: FloatArray) -> BeamStrip:
    """Return a smooth piece of a beam that starts at a place [m], at parameters of its shape."""
    inside, half = 0.5 * (t[0] + t[-1]), 0.5 * (t[1] - t[0])
    nodes = (t[:-1] + half)[:, None] + half * _GAUSS_NODES
    speed, angle = np.real(fit.speed(nodes, inside)), np.real(fit.angle(nodes, inside))
    step = half * np.stack([speed * np.cos(angle), speed * np.sin(angle)]) @ _GAUSS_WEIGHTS
    points = at + np.concatenate([np.zeros((1, 2)), np.cumsum(step.T, axis=0)])
    place = t if fit.course.uniform else np.array([float(np.real(fit.arc(float(parameter)))) for parameter in t])
    middle = float(place[len(place) // 2])
    thickness = np.real(beam.section.thickness_at(place, middle)) + np.zeros(len(t))
    turn = np.imag(fit.angle(t + 1j * COMPLEX_STEP, inside)) / COMPLEX_STEP / np.real(fit.speed(t, inside))
    slope = np.full(len(t), (thickness[-1] - thickness[0]) / ((place[-1] - place[0]) * float(np.real(fit.length))))
    angle = np.real(fit.angle(t, inside))
    return BeamStrip(*(read_only(column) for column in (points, angle, thickness, turn + np.zeros(len(t)), slope)))


@dataclass(frozen=True, order=True)
class BeamGap:
    """A distance between the surfaces of two beams [m], negative where they overlap, and which they are."""

    size: float
    first: str
    second: str


def smallest_gap(
    # centre lines (n, 2) [m] by beam; those of a mirrored half have the same name with a prime
    lines: Mapping[str, FloatArray],
    halves: Mapping[str, float],  # half thickness by beam [m]
    # pairs of beams whose contact is solved for: they count only where they overlap all the same
    may_touch: Collection[frozenset[str]] = (),
) -> BeamGap | None:
    """Return the smallest gap of two beams; near an end that they have in common there is none.

    Pairs whose boxes are farther apart than that are not looked at.
    """
    pairs = list(_pairs(lines))
    best: BeamGap | None = None
    bounds = _bounds(lines, halves, pairs)
    for k in np.argsort(bounds).tolist():
        if best is not None and bounds[k] > best.size:
            break
        gap = _gap(lines, halves, *pairs[k])
        may_close = frozenset(pairs[k]) in may_touch
        if gap is not None and may_close and gap.size > -MAX_OVERLAP_SHARE * min(halves[name] for name in pairs[k]):
            continue
        best = gap if best is None or (gap is not None and gap < best) else best
    return best


def _bounds(
    lines: Mapping[str, FloatArray], halves: Mapping[str, float], pairs: Sequence[tuple[str, str]]
) -> FloatArray:
    """Return how far the boxes of pairs of beams are apart, less their half thicknesses, (p,) [m]."""
    number = {name: k for k, name in enumerate(lines)}
    low, high = (np.array([end(line, axis=0) for line in lines.values()]).reshape(-1, 2) for end in (np.min, np.max))
    half = np.array([halves[name.rstrip("'")] for name in lines])
    first, second = np.array([(number[a], number[b]) for a, b in pairs], dtype=np.int64).reshape(-1, 2).T
    apart = np.maximum(np.maximum(low[second] - high[first], low[first] - high[second]), 0.0)
    return np.asarray(np.hypot(*apart.T) - half[first] - half[second])


def _pairs(lines: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Yield every two beams of which one at least is described and not mirrored."""
    return ((first, second) for first, second in itertools.combinations(lines, 2) if not first.endswith("'"))


def _gap(lines: Mapping[str, FloatArray], halves: Mapping[str, float], first: str, second: str) -> BeamGap | None:
    """Return the gap of two beams; None if nothing is left of one beside their common ends."""
    a, b, half = lines[first], lines[second], halves[second.rstrip("'")]
    for i, j in itertools.product((0, -1), repeat=2):
        if np.hypot(*(lines[first][i] - lines[second][j])) < END_DISTANCE_RATIO * (halves[first] + half):
            a = _cut_off(a, i, 2 * COMMON_END_THICKNESSES * halves[first])
            b = _cut_off(b, j, 2 * COMMON_END_THICKNESSES * half)
    if len(a) < 2 or len(b) < 2:
        return None
    import shapely

    distance = float(shapely.distance(shapely.LineString(a), shapely.LineString(b)))
    return BeamGap(distance - halves[first] - half, first, second)


def _cut_off(line: FloatArray, end: int, length: float) -> FloatArray:
    """Return a line without some length at one end; of a short one nothing may be left, and nothing is taken then."""
    if not len(line):
        return line
    ordered = line if end == 0 else line[::-1]
    arc_length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(ordered, axis=0).T))])
    if arc_length[-1] <= length:
        return ordered[:0]
    first = [np.interp(length, arc_length, column) for column in ordered.T]
    kept = np.vstack([first, ordered[arc_length > length]])
    return kept if end == 0 else kept[::-1]
